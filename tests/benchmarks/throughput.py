"""Throughput of the implicit step: point-steps per second of the processor, and what they are spent on. One
rank.

    ./dev run python tests/benchmarks/throughput.py [points=10976] [limits=1,0.2,5] [steps=10] [turns=1]
        [dim=3] [law=plastic] [E=1e6] [solver=auto] [against=PATH] [-mpm_... ...]

A quarter of a block (in the plane half of it) on a rough floor is flattened from the first step on; its sides
and its top are free. law=plastic: dry soil, Mohr–Coulomb with F-bar, lumped inertia; law=elastic: neo-Hooke,
consistent inertia. After 15 steps at the explicit limit, h over the speed of
pressure waves, it goes on from the same state for ``steps`` steps of each of the ``limits`` times that.
``against``: root of another tree of this project, such as that of the commit before, which runs in turns with
this one. Every run is a process of its own. Memory: what the process has grown by at most.
"""
import json
import os
import resource
import subprocess
import sys
from collections import Counter
from pathlib import Path
from time import process_time

OPTIONS = [word for word in sys.argv[1:] if "=" not in word]
WORDS = dict(word.split("=", 1) for word in sys.argv[1:] if "=" in word)
TREE = WORDS.get("tree", str(Path(__file__).resolve().parents[2]))
HEIGHT, RHO, NU, START = 0.5, 1600.0, 0.3, 15


def scene(points, E, dim=3, law="plastic", solver="auto"):
    """The MPM with about so many ``points``, and the explicit limit of the time step [s]."""
    from mpm_fenicsx import (
        MPM,
        Body,
        Box,
        Numerics,
        Support,
        at_rest,
        flow_grid,
        level_floor,
        mohr_coulomb,
        neo_hooke,
    )

    high = round((points / (32 if dim == 3 else 8)) ** (1 / dim))
    wide = round((points / 2**dim / high) ** (1 / (dim - 1)))
    h, across, ways = HEIGHT / high, dim == 3, "xz"[:dim - 1]
    size, rate = (wide * h, HEIGHT, wide * h)[:dim], 0.3 * (9.81 / HEIGHT) ** 0.5
    push = (0.5, -1.0, 0.5) if across else (1.0, -1.0)
    soil = dict(law=mohr_coulomb(E, NU, 30.0), f_bar=True, stress=at_rest(HEIGHT, RHO, 9.81, 0.5))
    given = soil if law == "plastic" else dict(law=neo_hooke(E, NU))
    body = Body(Box((0.0,) * dim, size), (wide, high, wide)[:dim], 2, rho=RHO,
                velocity=lambda x: rate * x * push, **given)
    room = (2 * wide * h, HEIGHT + 2 * h, 2 * wide * h)[:dim]
    grid = flow_grid(size, h, room, ways)
    supports, walls = level_floor("stick", h, dim)
    supports += [Support.column(axis, 0.0, grid, axis) for axis in ways]
    solid = MPM(grid, body, supports, gravity=(0.0, -9.81, 0.0)[:dim], penalties=walls,
                inertia="lumped" if law == "plastic" else "consistent", numerics=Numerics(solver=solver))
    elastic = body.law.params
    return solid, h / ((elastic.lam + 2 * elastic.mu) / RHO) ** 0.5


def peak():
    """Largest memory so far [B]."""
    return 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


def count_calls(counted, *methods):
    """Count in ``counted`` by name how often methods, (class, name) each, are called."""
    for owner, name in methods:
        def call(self, *given, function=getattr(owner, name), name=name):
            counted[name] += 1
            return function(self, *given)

        setattr(owner, name, call)


def measure(points, E, limits, steps, **kind):
    """In a process of its own: a record of each of the ``limits``. kind: ``dim``, ``law``, ``solver``."""
    sys.path.insert(0, TREE)
    from mpm_fenicsx.solve import clock
    from mpm_fenicsx.solve.equations import Equations
    from mpm_fenicsx.solve.snes import Newton

    clock.perf_counter, counted = process_time, Counter()
    count_calls(counted, (Equations, "residual"), (Equations, "tangent"), (Newton, "solve"))
    before = peak()
    solid, limit = scene(points, E, **kind)
    for _ in range(START):
        solid.advance(limit)
    state, rows = solid.get_state(), []
    for times in limits:
        solid.set_state(state)
        solid.advance(times * limit)
        counted.clear()
        phases, start, iterations = dict(solid.phases), process_time(), 0
        for _ in range(steps):
            solid.advance(times * limit)
            iterations += solid.iterations
        seconds = process_time() - start
        row = {name: (solid.phases[name] - phases[name]) / seconds for name in phases}
        row.update(rest=1.0 - sum(row.values()), limit=times, points=solid.count,
                   rate=solid.count * steps / seconds, Newton=iterations / steps)
        rows.append(row | {f"{name}s": number / steps for name, number in counted.items()})
    memory = (peak() - before) / solid.count
    print(json.dumps([{"solves": 0.0, "tangents": 0.0, "memory": memory, **row} for row in rows]))


def child(tree):
    """The records of a run with the ``tree``."""
    words = [f"{key}={value}" for key, value in WORDS.items()]
    answer = subprocess.run([sys.executable, __file__, *words, f"tree={tree}", *OPTIONS], check=True,
                            text=True, stdout=subprocess.PIPE, env={"OMP_NUM_THREADS": "1", **os.environ})
    return json.loads(answer.stdout.splitlines()[-1])


def main():
    """Print a table; of several turns that with the highest rate."""
    trees = {"this": TREE} | ({"other": WORDS["against"]} if "against" in WORDS else {})
    best = {}
    for _ in range(int(WORDS.get("turns", 1))):
        for name, tree in trees.items():
            for row in child(tree):
                key = row["limit"], name
                best[key] = max(best.get(key, row), row, key=lambda one: one["rate"])
    numbers, shares = ("Newton", "residuals", "tangents", "solves"), (
        "tangent", "residual", "solve", "to grid", "to points", "search", "rest")
    heads = ["points", "dt / limit", "tree", "point-steps/s", "ratio", *numbers,
             *(f"{name} %" for name in shares), "kB/point"]
    print("| " + " | ".join(heads) + " |\n" + "| --- " * len(heads) + "|")
    for (limit, name), row in sorted(best.items()):
        ratio = row["rate"] / best[limit, list(trees)[-1]]["rate"]
        cells = [f"{row['points']}", f"{limit:g}", name, f"{row['rate']:.3g}", f"{ratio:.2f}",
                 *(f"{row[key]:.1f}" for key in numbers), *(f"{100 * row[key]:.0f}" for key in shares),
                 f"{row['memory'] / 1e3:.2f}"]
        print("| " + " | ".join(cells) + " |", flush=True)


if __name__ == "__main__":
    if "tree" in WORDS:
        sys.argv[1:] = OPTIONS
        measure(float(WORDS.get("points", 10976)), float(WORDS.get("E", 1e6)),
                [float(text) for text in WORDS.get("limits", "1,0.2,5").split(",")],
                int(WORDS.get("steps", 10)), dim=int(WORDS.get("dim", 3)), law=WORDS.get("law", "plastic"),
                solver=WORDS.get("solver", "auto"))
    else:
        main()
