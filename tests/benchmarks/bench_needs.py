"""What a scene does not need costs nothing: time and memory with and without, and where the start-up goes.

    python tests/benchmarks/bench_needs.py [repeat=3] [parts=needs,start]

Every number is the CPU time of a process of its own, the least of ``repeat``, so that other work on the
machine does not count for much; "with" and "without" take turns. Prints Markdown; nothing passes or fails
here.
"""
import json
import os
import subprocess
import sys
import tempfile
from contextlib import suppress
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
BASE = ["t_end=1.2e-4"]  # 60 windows, in contact from the first to the last
SLAB = ["cells=62,13", "body=80,5", "segments=60"]
SLAB_3D = ["dim=3", "cells=62,13,3", "body=80,5,1", "segments=60,1"]
CASES = [  # what, words without, words with; the case of cases/beam_impact.py
    ("a new tangent and factorisation in every iteration", [], ["-mpm_snes_lag_jacobian", "1"]),
    ("contact", ["gap=1e-4"], []),
    ("friction and its history", [], ["friction=0.3"]),
    ("a third dimension (slab of one body cell across)", SLAB, SLAB_3D),
    ("ParaView files in every 10th window", [], ["paraview=10"]),
    ("LIGGGHTS", [], ["dem=liggghts"])]
SCENES = [  # what, key of ``measure_scene`` without and with; the MPM alone
    ("ten times as many background cells, empty", "plain", "empty"),
    ("the body as two, half each", "plain", "halves")]
IMPORTS = ["numpy", "numba", "mpi4py.MPI", "scipy.sparse", "coupling", "references.beam_theory",
           "dem_liggghts", "petsc4py", "dolfinx.mesh", "mpm_fenicsx", "beam_impact"]  # in the order of a run
LATER = {"scipy.spatial": "several ranks or bodies, named surfaces of a mesh, mapping=nearest",
         "matplotlib.pyplot": "the figure at the end", "meshio": "ParaView files, meshes from files",
         "h5py": "XDMF meshes (by meshio)", "dem_liggghts.liggghts": "dem=liggghts"}


def environment(**more):
    return {"OMP_NUM_THREADS": "1", **os.environ, "PYTHONPATH": str(ROOT), **more}


def run_case(words, **more):
    """CPU milliseconds per window, start-up [s] (wall), whole process [CPU s] and memory [MB] of a run of the
    beam."""
    with tempfile.TemporaryDirectory() as out:
        before = os.times()
        subprocess.run([sys.executable, ROOT / "cases/beam_impact.py", f"out={out}", *words], check=True,
                       stdout=subprocess.DEVNULL, env=environment(**more))
        after = os.times()
        report = json.loads((Path(out) / "report.json").read_text())
    whole = after.children_user - before.children_user + after.children_system - before.children_system
    return {"window": 1e3 * report["window_cpu_s"] / report["windows"], "start": report["startup_s"],
            "whole": whole, "memory": max(report["peak_mb"])}


def run_scene(name):
    """CPU milliseconds per step and memory [MB] of the MPM alone."""
    answer = subprocess.run([sys.executable, __file__, f"measure={name}"], check=True, capture_output=True,
                            text=True, env=environment())
    return json.loads(answer.stdout)


def measure_scene(name):
    """In a process of its own: the paper's beam under its own weight, and what else ``name`` says."""
    import resource
    from time import process_time

    from mpm_fenicsx import MPM, Body, Box, Grid, Interface, Support, linear

    times = 10 if name == "empty" else 1
    grid = Grid(Box((-0.07935, -0.02), (0.07935, 0.01 + 0.03 * (times - 1))), (62, 13 * times))
    boxes = [Box((-0.07675, -0.01), (0.07675, 0.0))]
    if name == "halves":
        boxes = [Box((-0.07675, -0.01), (0.0, 0.0)), Box((0.0, -0.01), (0.07675, 0.0))]
    bodies = [Body(box, (120 // len(boxes), 8), 4, linear(215.82e9, 0.289), 7960.0, "plane_stress", 0.01)
              for box in boxes]
    ends = [Support.column("x", x, grid, "y") for x in (-0.07675, 0.07675)]
    top = Interface.top(Box((-0.07675, -0.01), (0.07675, 0.0)), 60)
    solid = MPM(grid, bodies, ends, top, gravity=(0.0, -9.81))
    seconds = []
    for _ in range(120):
        begin = process_time()
        solid.advance(5e-8)
        seconds.append(process_time() - begin)
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(json.dumps({"window": 1e3 * sorted(seconds)[len(seconds) // 2], "memory": memory}))


def measure_start():
    """In a process of its own: CPU seconds of each import, then of reference, scene and windows; last, what
    is loaded only later."""
    import importlib
    from time import process_time

    sys.path[:0] = [str(ROOT / "cases")]
    sys.argv = ["beam_impact.py"]
    took, last = [], [process_time()]

    def lap(name):
        took.append((name, process_time() - last[0]))
        last[0] = process_time()

    for name in IMPORTS:
        importlib.import_module(name)
        lap(f"import {name}")
    loaded = [name for name in LATER if name in sys.modules]
    case = sys.modules["beam_impact"]
    from coupling import couple

    key = {name: key.default for name, key in case.main.keys.items()}
    beam = case.SimplySupportedBeam(body=case.BODY[2], segments=case.SEGMENTS[2])
    radius, v0, E, nu, rho = key["radius"], key["v0"], beam.E, beam.nu, beam.rho
    case.impact(beam.length, beam.height, beam.width, radius, v0, E, nu, rho, key["t_end"])
    lap("reference solution")
    solid = case.MPM(*beam.scene(case.LAWS["linear"](E, nu)))
    lap("grid, points, kernels of the MPM")
    steel, interface = case.Material(E, nu), solid.interface
    ball = case.Spheres([[0.0, radius]], [[0.0, -v0]], radius, rho)
    scene = case.Scene(ball, case.Wall(interface.x, interface.elements), steel, steel)
    grains = scene.open("reference", key["dt"] / key["substeps"])
    follow = case.linear(interface.x, interface.elements, interface.x)
    lap("wall, particles, map")
    for name in ("first window", "second window"):
        couple(solid, grains, follow, case.Scheme(key["dt"], solid.time + key["dt"],
                                                  substeps=key["substeps"]))
        lap(name)
    for name in LATER:
        with suppress(ImportError):
            importlib.import_module(name)
        lap(f"import {name}")
    print(json.dumps({"took": took, "loaded": loaded}))


def start(repeat):
    """Where the start-up goes, warm and cold."""
    def run(**more):
        answer = subprocess.run([sys.executable, __file__, "measure=start"], check=True, capture_output=True,
                                text=True, env=environment(**more))
        return json.loads(answer.stdout)

    warm = [run() for _ in range(repeat)]
    with tempfile.TemporaryDirectory() as folder:
        cold = dict(run(NUMBA_CACHE_DIR=folder)["took"])
    best = {name: min(dict(w["took"])[name] for w in warm) for name, _ in warm[0]["took"]}
    rows = [[name, f"{seconds:.2f}", f"{cold[name]:.2f}"] for name, seconds in best.items()
            if name.partition(" ")[2] not in LATER]
    rows.append(["**in all**", *(f"{sum(float(row[i]) for row in rows):.2f}" for i in (1, 2))])
    print("\nStart-up of the beam case, CPU seconds (cold: without compiled kernels)\n")
    table(["part", "warm", "cold"], rows)
    print("Loaded only when needed, CPU seconds that other runs save\n")
    table(["module", "import", "needed by", "loaded by the default run before its first window"],
          [[name, f"{best[f'import {name}']:.2f}", why, "yes" if name in warm[0]["loaded"] else "no"]
           for name, why in LATER.items()])


def needs(repeat):
    """The table with and without."""
    rows = []
    for what, without, having in CASES:
        pairs = [(run_case([*BASE, *without]), run_case([*BASE, *having])) for _ in range(repeat)]
        rows.append([what, *compared(pairs)])
    for what, without, having in SCENES:
        pairs = [(run_scene(without), run_scene(having)) for _ in range(repeat)]
        rows.append([what, *compared(pairs)])
    print("With and without, CPU time per window (of the last rows: per MPM step), memory, whole process\n")
    table(["what", "without [ms]", "with [ms]", "ratio", "without [MB]", "with [MB]", "without [CPU s]",
           "with [CPU s]"], rows)


def compared(pairs):
    """Cells of a row: the least of each quantity over the pairs (without, with)."""
    least = {key: [min(pair[side][key] for pair in pairs) for side in (0, 1)] for key in pairs[0][0]}
    a, b = least["window"]
    whole = [f"{x:.2f}" for x in least["whole"]] if "whole" in least else ["", ""]
    return [f"{a:.2f}", f"{b:.2f}", f"{b / a:.2f}", *(f"{x:.0f}" for x in least["memory"]), *whole]


def table(head, rows):
    print("| " + " | ".join(head) + " |\n" + "|" + " --- |" * len(head))
    for row in rows:
        print("| " + " | ".join(map(str, row)) + " |")
    print(flush=True)


def main(given):
    repeat = int(given.get("repeat", 3))
    for part in given.get("parts", "needs,start").split(","):
        {"needs": needs, "start": start}[part](repeat)


if __name__ == "__main__":
    words = dict(word.split("=", 1) for word in sys.argv[1:])
    if words.get("measure") == "start":
        measure_start()
    elif "measure" in words:
        measure_scene(words["measure"])
    else:
        main(words)
