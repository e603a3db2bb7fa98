"""What a case leaves in its folder, history.csv, report.json, ParaView files, and shows: progress bar and summary."""
import sys
import warnings
from pathlib import Path

import numpy as np
from mpi4py import MPI
from tqdm import tqdm

from . import balance, report
from .history import History
from .paraview import ParaView


WINDOW = {  # name → (unit, meaning)
    "newton": ("1", "Newton iterations of the MPM, in the last computation of the window"),
    "window": ("s", "length of the window"),
    "iterations": ("1", "computations of the window by both partitions until they agreed; 1 when weakly coupled"),
    "retries": ("1", "longer windows from the same start that were given up"),
}
ALONE = {"newton": ("1", "Newton iterations of the MPM")}


class Record:
    """Observer of a run: ``with Record(…) as record: couple(…, on_window=[record]); record.finish(…)``.

    case, parameters: name and keyword arguments of the run; out: folder; grains: None for a solid alone (``march``),
    which has no balance; columns: name → (unit, meaning, function of the ``Window``) of the case's own quantities;
    gravity: on the particles [m/s^2], upward (along y) or all components; paraview: every how many windows the state
    is written, 0 for never; label: goes into the file names when a case runs more than once; closed: nothing but the
    two exchanges energy, so that a run which gains some is stopped (``balance.Unstable``). Collective; files are
    written by rank 0, the ParaView files of points and grid by every rank. An error inside leaves the history so far
    and a report that names it. Raises ValueError for a negative ``paraview`` and OSError when ``out`` cannot be written.
    """

    def __init__(self, case, parameters, out, solid, grains, *, windows, columns, gravity=0.0, paraview=0, label="",
                 closed=False):
        if paraview < 0:
            raise ValueError(f"paraview is {paraview}: give the number of windows from file to file, or 0 for none")
        self.solid, self.grains, self.out = solid, grains, Path(out)
        self._case, self._parameters, self._columns = case, parameters, columns
        self._first, self._suffix = MPI.COMM_WORLD.rank == 0, f"_{label}" if label else ""
        self._ledger = None if grains is None else balance.Ledger(solid, grains, gravity)
        self._newton, self._counts, self._substeps = 0, np.zeros(3, int), parameters.get("substeps", 1)
        self._closed, self._every, self._pieces = closed, paraview, ParaView(self.out, self._suffix, MPI.COMM_WORLD)
        own = ALONE if grains is None else {**WINDOW, **self._ledger.columns}
        self._open({"time": ("s", "end of the window"),
                    **{name: (unit, meaning) for name, (unit, meaning, _) in columns.items()}, **own})
        self._bar = tqdm(total=windows, disable=not (self._first and sys.stderr.isatty()), leave=False,
                         bar_format="{desc} {percentage:3.0f}%|{bar}| {elapsed} gone, {remaining} to go")

    def _open(self, columns):
        """Folder and history; rank 0 tells the others when that fails."""
        path, notes, problem = None, [], None
        if self._first:
            path = self.out / f"history{self._suffix}.csv"
            notes = [self._case, " ".join(f"{k}={v}" for k, v in self._parameters.items())]
        try:
            if self._first:
                self.out.mkdir(parents=True, exist_ok=True)
            self.history = History(path, columns, notes)
        except OSError as error:
            problem = f"out={self.out} cannot be written ({error.strerror}): choose another folder"
        problem = MPI.COMM_WORLD.bcast(problem)
        if problem:
            raise OSError(problem)

    def __enter__(self):
        self._paraview(self.solid.time, None)
        self._timing = report.Timing(self.solid)
        return self

    def __call__(self, window):
        self._last = self._coupling(window) if self._ledger else {}
        self.history.add({"time": window.time, **{name: of(window) for name, (_, _, of) in self._columns.items()},
                          "newton": self.solid.iterations, **self._last})
        self._newton += self.solid.iterations
        if self._closed:
            balance.check_closed(self._last, window.time)
        self._counts += window.iterations, window.failed, window.refused
        if self._every and window.number % self._every == 0:
            self._paraview(window.time, window)
        if not self._bar.disable:
            self._bar.set_description_str(f"t = {window.time:.3e} s", refresh=False)
            self._bar.update(window.substeps / self._substeps)
        self._timing(window)

    def _coupling(self, window):
        return {"window": window.dt, "iterations": window.iterations, "retries": window.failed + window.refused,
                **self._ledger(window)}

    def _paraview(self, time, window):
        """Points, grid and interface by the ranks that have them, wall and particles by rank 0, at one time [s]."""
        if not self._every:
            return
        parts = self.solid.snapshot()  # collective
        if self._ledger:
            self._add_grains(parts, window)
        self._pieces.add(time, parts)

    def _add_grains(self, parts, window):
        particles = self.grains.particles()  # collective
        if self._first:
            parts["particles"] = (particles["x"], {"vertex": [[i] for i in range(len(particles))]},
                                  {"velocity": particles["v"], "spin": particles["omega"],
                                   "radius": particles["radius"], "mass": particles["mass"]})
            parts["wall"] = self._wall(window)

    def _wall(self, window):
        """Positions, cells and data of the wall at the end of a window, or at the start for None."""
        wall = self.grains.scene.wall
        kind = ["vertex", "line", "triangle"][np.shape(wall.elements)[1] - 1]
        x, v, force = wall.nodes, np.zeros_like(wall.nodes), np.zeros_like(wall.nodes)
        if window is not None:
            x, v, force = window.wall_x + window.dt * window.wall_v, window.wall_v, window.wall_force
        return x, {kind: wall.elements}, {"velocity": v, "force": force}

    def __exit__(self, kind, error, trace):
        self._bar.close()
        self.history.close()
        if kind is not None:  # perhaps on this rank only: no collective calls
            self._write_report([report.peak_mb()], {"errors": {}, "error": f"{kind.__name__}: {error}"})
        self._timing.end()

    def finish(self, errors, draw=None, **more):
        """Write report.json with ``errors`` (name → number) and ``more`` entries, the figure by ``draw(path)``, and
        five lines to the terminal; returns the report. Call it last inside the ``with``."""
        self._bar.close()
        for option in self.solid.unused_options():
            warnings.warn(f"nobody used the option {option}: is it spelt right?", stacklevel=2)
        figure = self.out / f"{self._case}{self._suffix}.png"
        if draw is not None and self._first:
            draw(figure)
        entries = self._write_report(MPI.COMM_WORLD.allgather(report.peak_mb()),
                                     {**self.solid.describe(), "errors": errors, **more})
        if self._first:
            print("\n".join(self._summary(entries, figure)), flush=True)
        return entries

    def _write_report(self, peaks, more):
        windows = len(self.history)
        entries = {"case": self._case, "parameters": self._parameters, "versions": report.versions(),
                   "ranks": MPI.COMM_WORLD.size, "points": self.solid.count, "windows": windows,
                   "substeps": self._substeps, **self._timing.figures(),
                   "newton_mean": self._newton / max(windows, 1),
                   "coupling_mean": self._counts[0] / max(windows, 1), "retries": int(self._counts[1:].sum()),
                   "failed": int(self._counts[1]), "peak_mb": peaks, **more}
        if self._first:
            report.write(self.out / f"report{self._suffix}.json", entries)
        return entries

    def _summary(self, entries, figure):
        phases = ", ".join(f"{name} {ms:.2f}" for name, ms in entries["phases_ms"].items() if ms >= 0.005)
        pace, coupled = "steps", ""
        if self._ledger:
            pace = f"windows of {entries['substeps']} DEM steps"
            coupled = f", {entries['coupling_mean']:.2f} of the coupling, energy {self.history['energy_error'][-1]:+.2e}"
        return [f"{self._case}: {entries['points']} points, {entries['windows']} {pace}, "
                f"{entries['ranks']} rank(s): {sum(self._timing.windows):.2f} s "
                f"(and {entries['startup_s']:.2f} s to start)",
                f"window {entries['window_ms']['median']:.2f} ms (median): {phases}",
                "errors: " + ", ".join(f"{name} {value:.3g}" for name, value in entries["errors"].items()),
                f"per window {entries['newton_mean']:.2f} Newton iterations{coupled}, memory "
                f"{max(entries['peak_mb']):.0f} MB",
                f"results in {self.out}, figure {figure}"]
