"""What a run leaves in its folder, history.csv, report.json, ParaView files, and shows: progress and
summary."""
import warnings
from pathlib import Path
from typing import Any, Callable, Dict, List, NamedTuple, Optional, Tuple

from mpi4py import MPI

from .. import signals
from ..loop.window import Window
from ..output import Output
from ..protocols import RecordedGrains, RecordedSolid
from ..scheme import Steps
from ..started import IMPORTED
from . import report
from .base import BaseMotion
from .columns import RecordedColumns
from .files import Files, Names
from .history import History
from .pieces import Pieces
from .progress import Progress
from .results import Results
from .resumed import Resumed
from .writing import OutputError, tell, writing


class Plan(NamedTuple):
    """What is recorded of a run.

    case: its name; parameters: of the report; columns: name → (unit, meaning, function of the ``Window``);
    pictures: file name → function that draws it at a path, at the end, unless the run is only interrupted;
    label: goes into the names of the other files when a case runs more than once; closed: see
    ``RecordedColumns``; began: moment from which the start-up time counts; goes_on: see ``Results``; due:
    functions that give the files of now, file name → function that writes it at a path, after each window;
    ground: a terrain, shown in ParaView.
    """

    case: str
    parameters: Dict[str, Any]
    output: Output
    scheme: Steps
    columns: Dict[str, tuple]
    pictures: Dict[str, Callable]
    label: str = ""
    closed: bool = False
    began: float = IMPORTED
    goes_on: str = ""
    due: Tuple[Callable, ...] = ()
    ground: Any = None


class Record:
    """Observer of a run: ``with Record(…) as record: couple(…, on_window=[record]); record.finish(…)``.

    grains: None for a solid alone, which has no ledger. Make it when both are at their start, also of a run
    that is restarted, call ``resume`` then. Collective; files are written by rank 0, the ParaView files of
    points and grid by every rank. An error inside leaves the history so far and a report that names it;
    before the first window is done, it leaves the results of an earlier run as they were, see ``results``.
    ``with`` raises OSError when the folder cannot be written.
    """

    def __init__(self, plan: Plan, solid: RecordedSolid, grains: Optional[RecordedGrains]) -> None:
        self._plan, self.solid, self.grains, self.out = plan, solid, grains, Path(plan.output.out)
        self._first, suffix = MPI.COMM_WORLD.rank == 0, f"_{plan.label}" if plan.label else ""
        self._columns = RecordedColumns(plan.columns, solid, grains, plan.closed)
        self._progress: Optional[Progress] = None
        self._complete, self._begun, self._pictures = False, False, plan.pictures
        self._resolution: Dict[str, Any] = {}
        self._figure, self._report = f"{plan.case}{suffix}.png", f"report{suffix}.json"
        self._base = BaseMotion(solid, grains)
        self._pieces = Pieces(solid, grains, plan.ground, self._base.moves) if plan.output.paraview else None
        self._resumed: Optional[Resumed] = None
        self._restarts: Tuple[dict, ...] = ()

    @property
    def results(self) -> Results:
        """The set of files, inside the ``with``."""
        return self._files.results

    @property
    def history(self) -> History:
        """Rows of the windows so far, inside the ``with`` and after it."""
        return self._files.history

    # ---------------------------------------------------------------- a run that goes on

    def get_state(self) -> Dict[str, Any]:
        """What the record goes on from, as plain data, that of rank 0. Collective."""
        return {"columns": self._columns.get_state(), "seconds": self._timing.sums(),
                "restarts": self._restarts, "pieces": self._pieces and self._pieces.get_state(),
                "base": self._base.get_state(),
                **self._files.get_state()}

    def resume(self, state: Dict[str, Any], last: Window, source: Path) -> None:
        """Before ``with``: go on after the ``last`` window with what ``get_state`` gave; the files so far are
        in the folder ``source``."""
        self._columns.set_state(state["columns"], last)
        if self._pieces and state.get("pieces"):
            self._pieces.set_state(state["pieces"])
        self._base.set_state(state["base"])
        self._resumed = Resumed(state, source)
        self._restarts = (*state["restarts"], {"window": last.number, "time": last.time,
                                               "ranks": MPI.COMM_WORLD.size})

    # ---------------------------------------------------------------- begin

    def __enter__(self) -> "Record":
        plan = self._plan
        names = Names(self.out, plan.case, repr(plan.parameters), plan.label,
                      (self._report, self._figure, *self._pictures), plan.goes_on)
        notes = [plan.case, " ".join(f"{k}={v}" for k, v in plan.parameters.items())]
        self._files = Files(names, self._columns.meanings, notes, self._resumed)
        self._timing = report.Timing(self.solid, began=plan.began)
        try:
            if self._resumed is None:
                self._paraview(self.solid.time, None)
        except BaseException as error:
            self.__exit__(type(error), error, None)
            raise
        self._timing = report.Timing(self.solid, self.results.folder if self._first else None, plan.began)
        if self._resumed:
            self._timing.earlier = self._resumed.state["seconds"]
        return self

    def begin(self) -> None:
        """The loop has checked its keywords and begins: what the scene is like, on the terminal.
        Collective."""
        if self._begun:
            return
        self._begun, self._resolution = True, getattr(self.solid, "resolution", dict)()
        if self._first:
            if self._resolution:
                tell(report.resolution(**self._resolution))
            number, total = len(self.history), self._plan.scheme.windows
            done = total * self.solid.time / self._plan.scheme.t_end if number else 0.0
            self._progress = Progress(total, done, number)

    def __call__(self, window: Window) -> None:
        """Record a window."""
        self._files.add(self._columns(window))
        self._columns.check(window.time)
        self._base.follow(window.time)
        self._files.start()
        for due in self._plan.due:
            self._files.write(due())
        if self._plan.output.paraview and window.number % self._plan.output.paraview == 0:
            self._paraview(window.time, window)
        self.begin()
        if self._progress is not None:
            self._progress(window.time, window.fraction, self.solid.iterations)
            self._files.look()
        with writing(self.results.folder):
            self._timing(window)
        signals.raise_again()

    def _paraview(self, time: float, window: Optional[Window]) -> None:
        """Points, grid and interface by the ranks that have them, all else by rank 0, at one time [s]."""
        if self._pieces is None:
            return
        parts, more = self.solid.snapshot(), self._pieces(time, window)  # both collective
        parts.update(more if self._first else {})
        self._base.show(parts)
        self._files.add_pieces(time, parts)

    def __exit__(self, kind: Optional[type], error: Optional[BaseException], trace: Any) -> None:
        if self._progress is not None:
            self._progress.close()
        try:
            # perhaps on this rank only: no collective calls
            if kind is not None and self._first and not self._complete:
                self._leave(f"{kind.__name__}: {error}")
            self.history.close()
        except OSError as problem:
            if not isinstance(error, OutputError):  # which has said it already
                warnings.warn(f"the end of this run's history and report is lost: {problem}", stacklevel=2)
        finally:
            self.results.close()

    def _leave(self, error: str) -> None:
        """What there is of a run that failed."""
        if not self._files.prepare_end():
            warnings.warn(f"the results in {self.out} are those of another run, which have been left as they "
                          "were", stacklevel=2)
            return
        # first: the history may need all the room
        self._write_report([report.peak_mb()], {"errors": {}, "error": error})
        self._files.end("stopped")
        try:
            self._draw()
        # such as a flow that has not begun: the error that ended the run says more
        except Exception as problem:
            warnings.warn(f"not all pictures could be drawn ({problem})", stacklevel=2)

    def finish(self, errors: Dict[str, float], draw: Optional[Callable] = None, **more: Any) -> dict:
        """Write report.json with ``errors`` (name → number) and ``more`` entries, the figure by
        ``draw(path)``, and five lines to the terminal; returns the report. Call it last inside the
        ``with``."""
        for option in self.solid.unused_options():
            warnings.warn(f"nobody used the option {option}: is it spelt right?", stacklevel=2)
        self._files.start()
        if draw is not None:
            self._pictures = {**self._pictures, self._figure: draw}
        self._draw()
        entries = self._end("complete", {"errors": errors, **more})
        if self._first:
            tell("\n".join(self._summary(entries)))
        return entries

    def interrupt(self, why: str, **more: Any) -> None:
        """In the place of ``finish``: the run stops here, and is to go on from its checkpoint."""
        self._end("stopped", {"errors": {}, "stopped": why, **more})

    def _end(self, state: str, more: Dict[str, Any]) -> dict:
        """The report, and the end of the history."""
        entries = self._write_report(MPI.COMM_WORLD.allgather(report.peak_mb()),
                                     {**self.solid.describe(), **more})
        if self._first:
            self._files.end(state)
            self._complete = True
            if self._progress is not None:
                self._progress.close()
        return entries

    def _draw(self) -> None:
        """The pictures; by rank 0."""
        for name, draw in self._pictures.items() if self._first else ():
            path = self.results.path(name)
            with writing(path):
                draw(path)

    def _write_report(self, peaks: List[float], more: dict) -> dict:
        windows = len(self.history)
        entries = {"case": self._plan.case, "parameters": self._plan.parameters,
                   "versions": report.versions(), "ranks": MPI.COMM_WORLD.size, "points": self.solid.count,
                   "windows": windows, "substeps": self._plan.scheme.substeps, **self._timing.figures(),
                   **self._columns.means(windows), "peak_mb": peaks, **self._resolution,
                   **({"restarts": self._restarts} if self._restarts else {}),
                   "options": getattr(self.solid, "options", dict)(), **more}
        if self._first:
            self.results.replace_text(self._report, report.text(entries))
        return entries

    def _summary(self, entries: dict) -> List[str]:
        """Five lines for the terminal."""
        balance = "balance_error" if "balance_error" in self.history.columns else "energy_error"
        energy = None if self.grains is None else self.history[balance][-1]
        figure = self.results.path(self._figure)
        return [*report.summary(entries, energy),
                f"results in {self.out}" + (f", figure {figure}" if figure.exists() else "")]
