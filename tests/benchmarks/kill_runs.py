"""Kills runs with SIGKILL at random moments, again and again, and lets them go on from their checkpoints.

    ./dev run python tests/benchmarks/kill_runs.py                 50 kills, in turns of beam and blocks
    ./dev run python tests/benchmarks/kill_runs.py kills=10 seed=7

After each kill history and ParaView series must be readable, and a run that has come to its end must have
left the same bytes as one that nobody killed. ``tests/cases/test_killed.py`` does a few of them.
"""
import json
import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path
from xml.etree import ElementTree

import meshio

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT))

from coupling import case  # noqa: E402
from coupling.records import manifest  # noqa: E402
from coupling.records.history import read  # noqa: E402

# every second or third window has a checkpoint, so that many kills hit one
BEAM = ("beam_impact", "cells=31,7 body=60,4 points=3 segments=30 dt=1e-6 substeps=20 t_end=1e-4 "
        "paraview=20 checkpoint=2 ")
BLOCKS = ("granular_blocks", "h=0.02 dt=1e-3 substeps=50 t_end=0.12 at=0.12 box=0.3,0.4 restitution=0.3 "
          "paraview=10 checkpoint=3 ")
RUNS = {  # name → (script, its keys), more keys
    "beam": (BEAM, "iterate=20"), "beam, LIGGGHTS": (BEAM, "dem=liggghts"), "blocks": (BLOCKS, ""),
    "blocks, LIGGGHTS": (BLOCKS, "contact=points dem=liggghts")}


class Killed:
    """One of RUNS, beside a straight one in ``folder``."""

    def __init__(self, name, folder):
        (self.script, keys), more = RUNS[name]
        self.keys = keys + more
        self._straight, self._folder = folder / "straight", folder / "killed"
        assert self._start(self._straight, self.keys).wait() == 0
        report = json.loads((self._straight / "report.json").read_text())
        self._windows, self._seconds, self.restarts = report["windows"], report["window_s"], 0

    def _start(self, out, keys):
        env = {**os.environ, "PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1"}
        script = ROOT / f"cases/{self.script}.py"
        return subprocess.Popen([sys.executable, script, f"out={out}", *keys.split()], env=env,
                                stdout=subprocess.DEVNULL)

    def kill(self, chance):
        """Start it, or let it go on, and kill it at a random moment after its first window. Returns how many
        windows there are."""
        path = self._folder / "history.csv"
        before = path.stat().st_mtime if path.exists() else 0.0
        done, process = check_readable(self._folder), self._go_on()
        while process.poll() is None and not (path.exists() and path.stat().st_mtime > before):
            time.sleep(0.005)
        time.sleep(chance.random() * self._seconds * (1.0 - done / self._windows))
        process.send_signal(signal.SIGKILL)
        process.wait()
        return check_readable(self._folder)

    def _go_on(self):
        there = any(self._folder.glob("checkpoint*.h5"))
        self.restarts += there
        return self._start(self._folder, f"restart={self._folder}" if there else self.keys)

    def finish(self):
        """To the end, without a kill; all that it has left must be the same as what the straight run has."""
        assert self._go_on().wait() == 0
        check_readable(self._folder)
        assert manifest.read(self._folder).state == "complete"
        for path in self._straight.iterdir():
            if path.suffix in (".csv", ".vtu", ".pvd", ".png"):
                assert content(self._folder / path.name) == content(path), path.name
        series = {path.name for path in self._straight.glob("*.vtu")}
        assert series == {path.name for path in self._folder.glob("*.vtu")}


def content(path):
    """Bytes of a file but for the line with the keys, among them the folder."""
    return b"".join(line for line in path.read_bytes().splitlines(True) if b" out=" not in line)


def check_readable(folder):
    """Number of windows in the history; ParaView's lists name files that are whole."""
    if not (folder / "history.csv").exists():
        return 0
    for path in folder.glob("*.pvd"):
        for entry in ElementTree.parse(path).findall("Collection/DataSet"):
            meshio.read(folder / entry.get("file"))
    return len(read(folder / "history.csv")["time"])


@case
def main(
    kills: int = 50,  # in all
    seed: int = 1,  # of the random moments
    out: Path = Path("out/killed"),  # folder of the results
):
    """Kill runs and let them go on; AssertionError where something is lost."""
    chance, names = random.Random(seed), list(RUNS)
    done, restarts, number = 0, 0, 0
    while done < kills:
        name = names[number % len(names)]
        run = Killed(name, out / str(number))
        windows = []
        for _ in range(min(chance.randint(1, 4), kills - done)):
            windows.append(run.kill(chance))
            done += 1
        run.finish()
        restarts += run.restarts
        number += 1
        print(f"{name}: killed with {', '.join(map(str, windows))} windows, the end is as without: {done} "
              f"of {kills} kills, {restarts} restarts", flush=True)


if __name__ == "__main__":
    main.run()
