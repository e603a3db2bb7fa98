"""Run time of the beam case: phases of a coupled step, the peer's step, and what a scene does not pay for.

    python tests/benchmarks/bench_beam.py [peer=PYTHON script=BEAM_IMPACT_PY] [repeat=3]

peer: an interpreter with Kratos' MPM, DEM and CoSimulation applications; script: a script that runs the same
case on it and takes --steps, --work and --summary. Both run in this one call, one after the other, so that
the ratio is of one machine at one time. Prints Markdown tables; nothing passes or fails here.
"""
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from time import perf_counter

ROOT = Path(__file__).resolve().parents[2]
CASE = ROOT / "cases" / "beam_impact.py"
PAPER = ["preset=paper", "t_end=2e-5"]  # 400 windows of the paper's step, all in contact


def run(*words):
    """report.json of one run of the case in a process of its own."""
    with tempfile.TemporaryDirectory() as out:
        subprocess.run([sys.executable, CASE, f"out={out}", *words], check=True, stdout=subprocess.DEVNULL)
        return json.loads((Path(out) / "report.json").read_text())


def best(repeat, *words):
    """The run with the smallest median window: the one the machine disturbed least."""
    return min((run(*words) for _ in range(repeat)), key=lambda report: report["window_ms"]["median"])


def table(head, rows):
    print("| " + " | ".join(head) + " |")
    print("| " + " | ".join("---" for _ in head) + " |")
    for row in rows:
        print("| " + " | ".join(str(cell) for cell in row) + " |")
    print(flush=True)


def phases(repeat):
    """Median milliseconds per phase of the paper's coupled step, both back ends."""
    reports = {dem: best(repeat, *PAPER, f"dem={dem}") for dem in ("reference", "liggghts")}
    names = list(reports["reference"]["phases_ms"])
    print(
        f"Coupled step of the paper's beam, {reports['reference']['points']} points, one rank, median [ms]\n")
    table(["DEM", *names, "whole window", "start [s]"],
          [[dem, *(f"{r['phases_ms'][n]:.2f}" for n in names), f"{r['window_ms']['median']:.2f}",
            r["startup_s"]] for dem, r in reports.items()])
    return reports["reference"]["window_ms"]["median"]


def peer(python, script, ours):
    """Median step of the peer, and the ratio."""
    with tempfile.TemporaryDirectory() as work:
        summary = Path(work) / "summary.json"
        subprocess.run([python, script, "--work", work, "--steps", "40", "--summary", summary], check=True,
                       stdout=subprocess.DEVNULL, env={**os.environ, "OMP_NUM_THREADS": "1"})
        theirs = 1e3 * json.loads(summary.read_text())["median_s"]["total"]
    print("The same step on the peer (Kratos), in this run\n")
    table(["peer [ms]", "ours [ms]", "ratio"], [[f"{theirs:.0f}", f"{ours:.2f}", f"{theirs / ours:.0f}"]])


def large_background(repeat):
    """Median MPM step in a background grid as in the paper and in one with ten times as many cells, all
    empty."""
    from mpm_fenicsx import MPM, Body, Box, Grid, Interface, Support, linear

    beam = Body(Box((-0.07675, -0.01), (0.07675, 0.0)), (120, 8), 4, linear(215.82e9, 0.289), 7960.0,
                "plane_stress", 0.01)
    rows = []
    for times in (1, 10):
        grid = Grid(Box((-0.07935, -0.02), (0.07935, 0.01 + 0.03 * (times - 1))), (62, 13 * times))
        ends = [Support.column("x", x, grid, "y") for x in (-0.07675, 0.07675)]
        solid = MPM(grid, beam, ends, Interface.top(beam.box, 60))
        seconds = []
        for _ in range(60 * repeat):
            start = perf_counter()
            solid.advance(5e-8)
            seconds.append(perf_counter() - start)
        rows.append(1e3 * sorted(seconds)[len(seconds) // 2])
        solid.close()
    return rows


def left_out(repeat):
    """With and without: what a scene does not need costs nothing."""
    kept = best(repeat, *PAPER)
    fresh = best(repeat, *PAPER, "-mpm_snes_lag_jacobian", "1")
    free = best(repeat, *PAPER, "gap=1e-4")
    friction = best(repeat, *PAPER, "friction=0.3")
    written = best(repeat, *PAPER, "paraview=10")
    small, large = large_background(repeat)
    whole = lambda report: f"{report['window_ms']['median']:.2f}"  # noqa: E731
    print("With and without, median window [ms]\n")
    table(["what", "without", "with"], [["new tangent and factorisation in every iteration", whole(kept),
                                         whole(fresh)], ["contact", whole(free), whole(kept)],
                                        ["friction and its history", whole(kept), whole(friction)],
                                        ["ten times as many background cells, empty (MPM step alone)",
                                         f"{small:.2f}", f"{large:.2f}"], ["ParaView files every 10 windows "
                                                                           "(mean window)",
                                                                           *(
        f"{1e3 * (r['wall_s'] - r['startup_s']) / r['windows']:.2f}" for r in (kept, written))]])


def main(words):
    given = dict(word.split("=", 1) for word in words)
    repeat = int(given.get("repeat", 3))
    ours = phases(repeat)
    if "peer" in given:
        peer(given["peer"], given["script"], ours)
    else:
        print("(no peer=PYTHON given: the comparison with the peer is left out)\n")
    left_out(repeat)


if __name__ == "__main__":
    main(sys.argv[1:])
