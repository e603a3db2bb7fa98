"""The files that grow with a run: history.csv and the ParaView series, among its results."""
import os
import time
from pathlib import Path
from typing import Any, Callable, Dict, List, NamedTuple, Optional, Sequence

from mpi4py import MPI

from .history import Columns, History
from .paraview import ParaView, Piece
from .results import Results, labelled
from .resumed import Resumed, share_rows
from .sharing import on_first
from .writing import OutputError, writing

LOOK = 1.0  # [s] between two looks at whether the files are still there


class Names(NamedTuple):
    """Of the files in the folder ``out``. case, key: see ``Results``; label: goes into the names when a case
    runs more than once; at_end: files that are written at the end; goes_on: see ``Results``."""

    out: Path
    case: str
    key: str
    label: str
    at_end: Sequence[str]
    goes_on: str


class Files:
    """Opens them: anew, or with what they had where a run is ``resumed``. ``results``: the set that they
    belong to; ``history``: on rank 0 with its file. meanings: of the columns, name → (unit, meaning); notes:
    lines for the head of the history. Collective; OSError when they cannot be written, on all ranks alike."""

    def __init__(self, names: Names, meanings: Columns, notes: Sequence[str],
                 resumed: Optional[Resumed] = None) -> None:
        self._comm, suffix = MPI.COMM_WORLD, f"_{names.label}" if names.label else ""
        self._first, self._looked = self._comm.rank == 0, 0.0
        self._history, self._names, self._resumed = f"history{suffix}.csv", names, resumed
        self.results = Results(names.out, names.case, names.key, [self._history, *names.at_end], self._comm,
                               names.goes_on)
        self._pieces = ParaView(self.results, suffix, self._comm)
        self.written: List[str] = list(resumed.state.get("written", ())) if resumed else []
        try:
            if resumed:
                self._pieces.set_state(resumed.state["paraview"])
            on_first(self._comm, lambda: self._open(meanings, notes))
        except OSError:
            self.results.close()
            raise
        if not self._first:
            self.history = History(None, meanings)
        if resumed:
            share_rows(self.history.rows, self._comm)

    def _open(self, meanings: Columns, notes: Sequence[str]) -> None:
        """The history, whose file is rank 0's."""
        path, resumed = self.results.path(self._history), self._resumed
        with writing(path):
            kept = resumed and resumed.files(self.results, self._pieces, self._history, self._names)
            self.history = History(path, meanings, notes, kept)
        if resumed:
            self._pieces.relist()

    def get_state(self) -> Dict[str, Any]:
        """How far they have come, all rows of the history on the disk itself; on rank 0. Collective."""
        kept = on_first(self._comm, lambda: self.history.sync())
        return {"rows": kept.rows, "size": kept.size, "paraview": self._pieces.get_state(),
                "written": tuple(self.written)}

    def add(self, row: Dict[str, float]) -> None:
        """A row of the history."""
        try:
            with writing(self.results.folder / self._history):
                self.history.add(row)
        except OutputError:
            if self._first:
                self._looked = -LOOK  # which knows better why
                self.look()
            raise

    def add_pieces(self, time: float, parts: Dict[str, Piece]) -> None:
        """One time [s] of the ParaView series, see ``ParaView.add``."""
        self._pieces.add(time, parts)

    def write(self, due: Dict[str, Callable]) -> None:
        """Files of this time: name → function that writes it at a path, on rank 0. One that is there already
        is whole at any moment. Collective."""
        def on_disk() -> None:
            for name, write in due.items():
                path = self.results.path(labelled(name, self._names.label))
                part = path.with_name(path.name + ".part")
                with writing(path):
                    write(part)
                    os.replace(part, path)
                if path.name not in (*self.written, *self._names.at_end):
                    self.written.append(path.name)

        if due:
            on_first(self._comm, on_disk)

    def start(self) -> None:
        """After the first window: the files become those of the folder."""
        if not self.results.started:
            self.results.start()
            self._follow()

    def _follow(self) -> None:
        if self.history.file:
            self.history.file.path = self.results.path(self._history)

    def look(self) -> None:
        """OutputError when somebody has removed what this run writes: it would write into nothing until its
        end."""
        if time.monotonic() - self._looked > LOOK:
            file = self.history.file
            lost = self.results.lost() or (file and file.missing() and f"the file {file.path} has been "
                                           "deleted while the run wrote into it")
            if lost:
                raise OutputError(f"{lost}: leave the results in place until the run has ended")
            self._looked = time.monotonic()

    def prepare_end(self) -> bool:
        """Before the last lines of a run that failed, on rank 0: whether there is a place for them; the
        history is put back where somebody has removed it."""
        with writing(self._names.out):
            there = self.results.make_room()
        if there:
            self._follow()
            if self.history.file and self.history.file.missing():
                self.history.file.restore()
        return there

    def end(self, state: str) -> None:
        """The end of the history, and how the run ended, see ``Results.end``. On rank 0."""
        try:
            with writing(self.results.folder / self._history):
                self.history.close()
        finally:
            self.results.end(state)
