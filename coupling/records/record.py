"""What a case leaves in its folder, history.csv, report.json, ParaView files, and shows: progress and summary."""
import time
import warnings
from functools import partial
from pathlib import Path
from typing import Any, Callable, Dict, List, Optional, Sequence, Union

import numpy as np
from mpi4py import MPI

from .. import signals
from ..ledger import exchange
from ..ledger.departures import Departures
from ..loop.window import Window
from ..protocols import RecordedGrains, RecordedSolid
from ..started import IMPORTED
from . import report
from .history import Columns, History
from .paraview import ParaView, particles_and_wall
from .progress import Progress
from .results import Results
from .sharing import on_first
from .writing import OutputError, tell, writing

LOOK = 1.0  # [s] between two looks at whether the files are still there
WINDOW = {  # name → (unit, meaning)
    "newton": ("1", "Newton iterations of the MPM, in the last computation of the window"),
    "window": ("s", "length of the window"),
    "iterations": ("1", "computations of the window by both partitions until they agreed; 1 when weakly coupled"),
    "retries": ("1", "attempts at the window that were given up"),
}


class Record:
    """Observer of a run: ``with Record(…) as record: couple(…, on_window=[record]); record.finish(…)``.

    case, parameters: name and keyword arguments of the run; out: folder; grains: None for a solid alone (``march``),
    which has no ledger; columns: name → (unit, meaning, function of the ``Window``) of the case's own quantities;
    gravity: on the particles [m/s^2], upward (along y) or all components; paraview: every how many windows the state
    is written, 0 for never; label: goes into the file names when a case runs more than once; closed: nothing but the
    two exchanges energy, so that a run which gains some is stopped (``exchange.UnstableError``); pictures: name → function
    that draws it into the file at a path, at the end, however the run ends. Collective; files are written by rank 0,
    the ParaView files of points and grid by every rank. An error inside leaves the history so far and a report that
    names it; before the first window is done, it leaves the results of an earlier run as they were, see ``results``.
    Raises ValueError for a negative ``paraview`` and OSError when ``out`` cannot be written.
    """

    def __init__(self, case: str, parameters: dict, out: Union[str, Path], solid: RecordedSolid,
                 grains: Optional[RecordedGrains], *, windows: float, columns: Dict[str, tuple],
                 gravity: Union[float, Sequence[float]] = 0.0, paraview: int = 0, label: str = "",
                 closed: bool = False, pictures: Optional[Dict[str, Callable]] = None,
                 began: float = IMPORTED) -> None:
        if paraview < 0:
            raise ValueError(f"paraview is {paraview}: give the number of windows from file to file, or 0 for none")
        self.solid, self.grains, self.out = solid, grains, Path(out)
        self._case, self._parameters, self._columns = case, parameters, columns
        self._began = began
        self._first, self._suffix = MPI.COMM_WORLD.rank == 0, f"_{label}" if label else ""
        self._ledger = None if grains is None else exchange.Ledger(solid, grains, gravity)
        self._newton, self._counts, self._substeps = 0, np.zeros(3, int), parameters.get("substeps", 1)
        self._closed, self._every, self._total, self._looked = closed, paraview, windows, 0.0
        self._progress: Optional[Progress] = None
        self._complete = self._begun = False
        self._pictures, self._departures = pictures or {}, Departures(solid, grains)
        self._fine: Dict[str, Any] = {}
        own = {**WINDOW, **(self._ledger.columns if self._ledger else {}), **self._departures.columns}
        self._of_solid: Dict[str, tuple] = getattr(solid, "columns", dict)()
        own |= {name: (unit, meaning) for name, (unit, meaning, _) in self._of_solid.items()}
        self._figure, self._history, self._report = (f"{name}{self._suffix}.{kind}" for name, kind in (
            (case, "png"), ("history", "csv"), ("report", "json")))
        self.results = Results(out, case, repr(parameters), [self._history, self._report, self._figure, *self._pictures])
        self._pieces = ParaView(self.results, self._suffix, MPI.COMM_WORLD)
        columns = {"time": ("s", "end of the window"),
                   **{name: (unit, meaning) for name, (unit, meaning, _) in columns.items()}, **own}
        try:
            on_first(MPI.COMM_WORLD, partial(self._open, columns))
        except OSError:
            self.results.close()
            raise
        if not self._first:
            self.history = History(None, columns)

    def _open(self, columns: Columns) -> None:
        """The history, whose file is rank 0's."""
        path = self.results.path(self._history)
        notes = [self._case, " ".join(f"{k}={v}" for k, v in self._parameters.items())]
        with writing(path):
            self.history = History(path, columns, notes)

    def path(self, name: str) -> Path:
        """Where to write the file ``name``, which becomes one of the results of this run. On rank 0."""
        return self.results.path(name)

    def __enter__(self) -> "Record":
        self._timing = report.Timing(self.solid, began=self._began)
        try:
            self._paraview(self.solid.time, None)
        except BaseException as error:
            self.__exit__(type(error), error, None)
            raise
        self._timing = report.Timing(self.solid, self.results.folder if self._first else None, self._began)
        return self

    def begin(self) -> None:
        """The loop has checked its keywords and begins: what the scene is like, on the terminal. Collective."""
        if self._begun:
            return
        self._begun, self._fine = True, getattr(self.solid, "resolution", dict)()
        if self._first:
            if self._fine:
                tell(report.resolution(**self._fine))
            self._progress = Progress(self._total)

    def __call__(self, window: Window) -> None:
        """A window has ended."""
        self._last = self._coupling(window)
        row = {"time": window.time, **{name: of(window) for name, (_, _, of) in self._columns.items()},
               "newton": self.solid.iterations, **self._last, **self._departures.entries(),
               **{name: value() for name, (_, _, value) in self._of_solid.items()}}
        self._add(row)
        self._newton += self.solid.iterations
        if self._closed:
            exchange.check_closed(self._last, window.time)
        self._counts += window.iterations, window.failed, window.refused
        self._start()
        if self._every and window.number % self._every == 0:
            self._paraview(window.time, window)
        self.begin()
        if self._progress is not None:
            self._progress(window.time, window.fraction, self.solid.iterations)
            self._look()
        with writing(self.results.folder):
            self._timing(window)
        signals.raise_again()

    def _add(self, row: Dict[str, float]) -> None:
        """A row of the history."""
        try:
            with writing(self.results.folder / self._history):
                self.history.add(row)
        except OutputError:
            if self._first:
                self._looked = -LOOK  # which knows better why
                self._look()
            raise

    def _start(self) -> None:
        """After the first window: the files become those of the folder."""
        if not self.results.started:
            self.results.start()
            if self.history.file:
                self.history.file.path = self.results.path(self._history)

    def _look(self) -> None:
        """OutputError when somebody has removed what this run writes: it would write into nothing until its end."""
        if time.monotonic() - self._looked > LOOK:
            file = self.history.file
            lost = self.results.lost() or (file and file.missing() and f"the file {file.path} has been deleted while the run "
                                           "wrote into it")
            if lost:
                raise OutputError(f"{lost}: leave the results in place until the run has ended")
            self._looked = time.monotonic()

    def _coupling(self, window: Window) -> Dict[str, float]:
        return {"window": window.dt, "iterations": window.iterations, "retries": window.failed + window.refused,
                **(self._ledger(window) if self._ledger else {})}

    def _paraview(self, time: float, window: Optional[Window]) -> None:
        """Points, grid and interface by the ranks that have them, wall and particles by rank 0, at one time [s]."""
        if not self._every:
            return
        parts = self.solid.snapshot()  # collective
        if self.grains is not None:
            more = particles_and_wall(self.grains, window)  # collective
            parts.update(more if self._first else {})
        self._pieces.add(time, parts)

    def __exit__(self, kind: Optional[type], error: Optional[BaseException], trace: Any) -> None:
        if self._progress is not None:
            self._progress.close()
        try:
            if kind is not None and self._first and not self._complete:  # perhaps on this rank only: no collective calls
                self._leave(f"{kind.__name__}: {error}")
            self.history.close()
        except OSError as problem:
            if not isinstance(error, OutputError):  # which has said it already
                warnings.warn(f"the end of this run's history and report is lost: {problem}", stacklevel=2)
        finally:
            self.results.close()

    def _leave(self, error: str) -> None:
        """What there is of a run that failed."""
        with writing(self.out):
            there = self.results.make_room()
        if not there:
            warnings.warn(f"the results in {self.out} are those of another run, which have been left as they were",
                          stacklevel=2)
            return
        if self.history.file:
            self.history.file.path = self.results.path(self._history)
            if self.history.file.missing():
                self.history.file.restore()
        self._write_report([report.peak_mb()], {"errors": {}, "error": error})  # first: the history may need all the room
        try:
            with writing(self.results.folder / self._history):
                self.history.close()
        finally:
            self.results.end("stopped")
        try:
            self._draw()
        except Exception as problem:  # such as a flow that has not begun: the error that ended the run says more
            warnings.warn(f"not all pictures could be drawn ({problem})", stacklevel=2)

    def finish(self, errors: Dict[str, float], draw: Optional[Callable] = None, **more: Any) -> dict:
        """Write report.json with ``errors`` (name → number) and ``more`` entries, the figure by ``draw(path)``, and
        five lines to the terminal; returns the report. Call it last inside the ``with``."""
        for option in self.solid.unused_options():
            warnings.warn(f"nobody used the option {option}: is it spelt right?", stacklevel=2)
        self._start()
        if draw is not None:
            self._pictures = {**self._pictures, self._figure: draw}
        self._draw()
        entries = self._write_report(MPI.COMM_WORLD.allgather(report.peak_mb()),
                                     {**self.solid.describe(), "errors": errors, **more})
        if self._first:
            with writing(self.results.folder / self._history):
                self.history.close()
            self.results.end("complete")
            self._complete = True
            if self._progress is not None:
                self._progress.close()
            tell("\n".join(self._summary(entries)))
        return entries

    def _draw(self) -> None:
        """The pictures; by rank 0."""
        for name, draw in self._pictures.items() if self._first else ():
            path = self.results.path(name)
            with writing(path):
                draw(path)

    def _write_report(self, peaks: List[float], more: dict) -> dict:
        windows = len(self.history)
        entries = {"case": self._case, "parameters": self._parameters, "versions": report.versions(),
                   "ranks": MPI.COMM_WORLD.size, "points": self.solid.count, "windows": windows,
                   "substeps": self._substeps, **self._timing.figures(),
                   "newton_mean": self._newton / max(windows, 1),
                   "coupling_mean": self._counts[0] / max(windows, 1), "retries": int(self._counts[1:].sum()),
                   "failed": int(self._counts[1]), "peak_mb": peaks, **self._fine,
                   "options": getattr(self.solid, "options", dict)(), **more}
        if self._first:
            self.results.replace_text(self._report, report.text(entries))
        return entries

    def _summary(self, entries: dict) -> List[str]:
        phases = ", ".join(f"{name} {ms:.2f}" for name, ms in entries["phases_ms"].items() if ms >= 0.005)
        pace, coupled, figure = "steps", "", self.results.path(self._figure)
        if self._ledger:
            pace = f"windows of {entries['substeps']} DEM steps"
            coupled = f", {entries['coupling_mean']:.2f} of the coupling, energy {self.history['energy_error'][-1]:+.2e}"
        return [f"{self._case}: {entries['points']} points, {entries['windows']} {pace}, "
                f"{entries['ranks']} rank(s): {self._timing.spent:.2f} s "
                f"(and {entries['startup_s']:.2f} s to start)",
                f"window {entries['window_ms']['median']:.2f} ms (median): {phases}",
                "errors: " + ", ".join(f"{name} {value:.3g}" for name, value in entries["errors"].items()),
                f"per window {entries['newton_mean']:.2f} Newton iterations{coupled}, memory "
                f"{max(entries['peak_mb']):.0f} MB",
                f"results in {self.out}" + (f", figure {figure}" if figure.exists() else "")]
