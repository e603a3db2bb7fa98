"""A part of docs/report.md: point-steps per second of one core, what its kernels reach of what the core can
do, and a peer.

    ./dev run python tests/benchmarks/bench_throughput.py [points=10976] [steps=5] [out=DIR]
        [peer=PYTHON script=FILE]

Scenes and time steps: see ``throughput``; kernels: see ``roofline``. The peer's script takes --work DIR
--steps N --dt S --h H --E E --nu NU --rho RHO --phi PHI --summary FILE, lets a column of dry soil, 0.2 m
high, collapse in the plane on cells of H [m], and writes JSON with material_points_start_end, newton_mean
and, as median of a step, median_s.cpu_time_total.
"""
import json
import subprocess
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
sys.path[:0] = [str(ROOT)]
import roofline  # noqa: E402
import throughput  # noqa: E402

SCENES = [(2, "elastic"), (2, "plastic"), (3, "elastic"), (3, "plastic")]
LIMITS = 1, 10
PEER_H, PHI = 0.2 / 30, 30.0
PLACES = {2: "plane", 3: "space"}


def child(*command):
    """What a process says at its end, read as JSON."""
    answer = subprocess.run([sys.executable, *command], check=True, text=True, stdout=subprocess.PIPE)
    return json.loads(answer.stdout.splitlines()[-1])


def kernels(points, dim, law):
    """Print the kernels of a scene, in a process of their own: steps at the limit after the start, each with
    a new tangent."""
    import petsc4py
    petsc4py.init([sys.argv[0], "-mpm_snes_lag_jacobian", "1"])
    solid, limit = throughput.scene(points, 1e6, dim, law)
    for _ in range(throughput.START):
        solid.advance(limit)
    watches = roofline.watch(solid.step.problem.bodies[0])
    for _ in range(4):
        solid.advance(limit)
    print(json.dumps(roofline.measured(watches, solid.count)))


def peer(python, script, steps):
    """Records of the peer, one for each of the limits."""
    found = []
    for times in LIMITS:
        with tempfile.TemporaryDirectory() as folder:
            lame = throughput.NU / (1 + throughput.NU) / (1 - 2 * throughput.NU), 1 / (1 + throughput.NU)
            dt = times * PEER_H * (throughput.RHO / (1e6 * sum(lame))) ** 0.5
            words = dict(work=folder, steps=throughput.START + steps, dt=dt, h=PEER_H, E=1e6,
                         nu=throughput.NU, rho=throughput.RHO, phi=PHI, summary=f"{folder}/summary.json")
            done = subprocess.run([python, script, *(f"--{key}={value}" for key, value in words.items())],
                                  stdout=subprocess.DEVNULL)
            if done.returncode != 0:  # it does not bear such a step
                print(f"The peer failed at {times} explicit limits.\n")
                continue
            said = json.loads(Path(folder, "summary.json").read_text())
        n = said["material_points_start_end"][0]
        found.append(dict(limit=times, points=n, rate=n / said["median_s"]["cpu_time_total"],
                          Newton=said["newton_mean"]))
    return found


def table(heads, rows):
    """Print Markdown."""
    for row in (heads, ["---"] * len(heads), *rows):
        print("| " + " | ".join(row) + " |")
    print()


def tell(rates, can, found):
    """Print both tables."""
    print("Point-steps per second of one core, a block that flows (`tests/benchmarks/throughput.py`):\n")
    table(["scene", "points", "dt / explicit limit", "point-steps/s", "Newton"],
          [[name, f"{row['points']:,}", f"{row['limit']:g}", f"{float('%.3g' % row['rate']):,.0f}",
            f"{row['Newton']:.1f}"] for name, row in rates])
    print(f"This core: {can.bandwidth / 1e9:.1f} GB/s (triad), {can.peak / 1e9:.1f} Gflop/s (products that "
          "are added, in registers). Kernels at the limit, estimated as `tests/benchmarks/roofline.py` says:"
          "\n")
    rows = []
    for scene, of_scene in found.items():
        for one in of_scene:
            memory, arithmetic, _ = can.shares(one)
            rows.append([scene, one.name, f"{1e9 * one.seconds:.0f}", f"{one.bytes:.0f}",
                         f"{one.operations:.0f}", f"{memory:.0%}", f"{arithmetic:.0%}",
                         "memory" if memory > arithmetic else "arithmetic"])
    table(["scene", "kernel", "ns/point", "bytes/point", "flop/point", "of the bandwidth", "of the peak",
           "nearer roof"], rows)


def draw(path, rates, can, found):
    """Rates, and the kernels under their roof."""
    import matplotlib
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    import numpy as np

    figure, (left, right) = plt.subplots(1, 2, figsize=(10.5, 4.2))
    names = list(dict.fromkeys(name for name, _ in rates))
    for place, times in enumerate(LIMITS):
        chosen = [(names.index(name), row["rate"]) for name, row in rates if row["limit"] == times]
        left.bar([at + 0.4 * (place - 0.5) for at, _ in chosen], [rate for _, rate in chosen], 0.38,
                 label=f"dt = {times} explicit limit{'s' if times > 1 else ''}")
    left.set_xticks(range(len(names)), [name.replace(", ", "\n") for name in names])
    left.set(yscale="log", ylabel="point-steps per second of one core")
    left.legend()
    x = np.logspace(-1.5, 2.5)
    right.plot(x, np.minimum(x * can.bandwidth, can.peak) / 1e9, "k-", label="roof of this core")
    marks = dict(zip(roofline.KERNELS.values(), "os^vDP"))
    for colour, of_scene in enumerate(found.values()):
        for one in of_scene:
            right.plot(one.operations / one.bytes, one.operations / one.seconds / 1e9, marks[one.name],
                       color=f"C{colour}")
    for colour, scene in enumerate(found):
        right.plot([], [], "s", color=f"C{colour}", label=scene)
    for name, mark in marks.items():
        right.plot([], [], mark, color="grey", label=name)
    right.set(xscale="log", yscale="log", xlabel="flop per byte", ylabel="Gflop/s")
    right.legend(fontsize=7)
    figure.tight_layout()
    figure.savefig(path, dpi=120)


def main(words):
    points, steps = int(words.get("points", 10976)), int(words.get("steps", 5))
    rates, found, machines = [], {}, [roofline.machine()]
    for dim, law in SCENES:
        name, given = f"{PLACES[dim]}, {law}", [f"points={points}", f"dim={dim}", f"law={law}"]
        rates += [(name, row) for row in child(HERE / "throughput.py", f"tree={ROOT}", f"steps={steps}",
                                               *given, f"limits={','.join(map(str, LIMITS))}")]
        found[name] = [roofline.Kernel(*one) for one in child(__file__, "kernels=yes", *given)]
        machines.append(roofline.machine())
    if "peer" in words:
        rates += [("peer: plane, plastic", row) for row in peer(words["peer"], words["script"], steps)]
    can = roofline.Machine(*map(max, zip(*machines)))
    tell(rates, can, found)
    if "out" in words:
        draw(Path(words["out"]) / "throughput.png", rates, can, found)


if __name__ == "__main__":
    given = dict(word.split("=", 1) for word in sys.argv[1:])
    if "kernels" in given:
        kernels(int(given["points"]), int(given["dim"]), given["law"])
    else:
        main(given)
