"""What a case leaves in its folder: history.csv, report.json, ParaView files; and on the terminal: progress, summary."""
import sys
from pathlib import Path
from time import perf_counter

from mpi4py import MPI
from tqdm import tqdm

from . import STARTED, report
from .balance import UNITS, Ledger
from .history import History
from .paraview import Series


class Record:
    """Observer of a coupled run.

    case, parameters: name and keyword arguments of the run; out: folder; columns: name → (unit, function of the
    ``Window``) of the case's own quantities; gravity: vertical component on the particles [m/s^2]; paraview: every how
    many windows the state is written, 0 for never; label: goes into the file names when a case runs more than once.
    Collective; files are written by rank 0.
    """

    def __init__(self, case, parameters, out, solid, grains, *, windows, columns, gravity=0.0, paraview=0, label=""):
        self.solid, self.grains = solid, grains
        self._case, self._parameters, self._columns = case, parameters, columns
        self._first = MPI.COMM_WORLD.rank == 0
        self.out = Path(out)
        if self._first:
            self.out.mkdir(parents=True, exist_ok=True)
        self._suffix = f"_{label}" if label else ""
        self._ledger = Ledger(solid, grains, gravity)
        units = {"time": "s", **{name: unit for name, (unit, _) in columns.items()}, "newton": "1", **UNITS}
        self.history = History(self.out / f"history{self._suffix}.csv" if self._first else None, units,
                               [case, " ".join(f"{k}={v}" for k, v in parameters.items())])
        self._every, self._series = paraview, {}
        self._bar = tqdm(total=windows, disable=not (self._first and sys.stderr.isatty()), leave=False,
                         bar_format="{desc} {percentage:3.0f}%|{bar}| {elapsed} gone, {remaining} to go")
        self._windows, self._newton = windows, 0
        self._paraview(0.0, None)
        self._timing = report.Timing(solid)

    def __call__(self, window):
        self.history.add({"time": window.time, **{name: of(window) for name, (_, of) in self._columns.items()},
                          "newton": self.solid.iterations, **self._ledger(window)})
        self._newton += self.solid.iterations
        if self._every and window.number % self._every == 0:
            self._paraview(window.time, window)
        if not self._bar.disable:
            self._bar.set_description_str(f"t = {window.time:.3e} s", refresh=False)
            self._bar.update()
        self._timing(window)

    def _paraview(self, time, window):
        """Points, grid, wall and particles at one time."""
        if not self._every:
            return
        parts = self.solid.snapshot()  # collective
        particles = self.grains.particles()
        if not self._first:
            return
        parts["particles"] = (particles["x"], {"vertex": [[i] for i in range(len(particles))]},
                              {name: particles[name] for name in ("radius", "v", "omega", "mass")})
        if window is not None:
            x, cells, data = parts["interface"]
            parts["interface"] = x, cells, {**data, "force": window.force}
        for name, (x, cells, data) in parts.items():
            self._series.setdefault(name, Series(self.out, name + self._suffix)).add(time, x, cells, data)

    def __enter__(self):
        return self

    def __exit__(self, kind, error, trace):
        self.close()
        if kind is not None:
            self._write_report({"error": f"{kind.__name__}: {error}"})

    def close(self):
        """End progress bar and history; what is written is complete up to the last window."""
        self._bar.close()
        self.history.close()

    def finish(self, errors, draw=None):
        """Write report.json with ``errors`` (name → number), the figure by ``draw(path)``, and five lines to the
        terminal; returns the report."""
        entries = self._write_report({"errors": errors})
        unused = self.solid.unused_options()
        if self._first:
            figure = self.out / f"{self._case}{self._suffix}.png"
            if draw is not None:
                draw(figure)
            for option in unused:
                print(f"warning: nobody used the option {option}", file=sys.stderr)
            print("\n".join(self._summary(entries, figure)), flush=True)
        return entries

    def _write_report(self, more):
        windows = len(self.history)
        peaks = MPI.COMM_WORLD.gather(report.peak_mb())
        entries = {"case": self._case, "parameters": self._parameters, "versions": report.versions(),
                   "ranks": MPI.COMM_WORLD.size, "points": self.solid.count, "windows": windows,
                   "substeps": self._parameters.get("substeps", 1), "wall_s": round(perf_counter() - STARTED, 3),
                   "startup_s": round(self._timing.startup, 3), **self._timing.figures(),
                   "newton_mean": self._newton / max(windows, 1), "coupling_mean": 1.0, "peak_mb": peaks,
                   "errors": {}, **more}
        if self._first:
            report.write(self.out / f"report{self._suffix}.json", entries)
        return entries

    def _summary(self, entries, figure):
        phases = ", ".join(f"{name} {ms:.2f}" for name, ms in entries["phases_ms"].items() if ms >= 0.005)
        total = sum(self._timing.windows)
        return [f"{self._case}: {entries['points']} points, {entries['windows']} windows of {entries['substeps']} DEM "
                f"steps, {entries['ranks']} rank(s): {total:.2f} s (and {entries['startup_s']:.2f} s to start)",
                f"window {entries['window_ms']['median']:.2f} ms (median): {phases}",
                "errors: " + ", ".join(f"{name} {value:.3g}" for name, value in entries["errors"].items()),
                f"Newton iterations {entries['newton_mean']:.2f} per window, energy "
                f"{self.history['energy_error'][-1]:+.2e}, memory {max(entries['peak_mb']):.0f} MB",
                f"results in {self.out}, figure {figure}"]
