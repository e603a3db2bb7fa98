"""Checkpoints of a run: everything from which it goes on, written to a file on the way and read again.

``checkpoint.h5`` in the folder of a run is the newest one, ``checkpoint_before.h5`` the one before. A run
that is killed leaves at least one of them whole, at any moment.
"""
import warnings
from pathlib import Path
from time import perf_counter
from typing import Any, Dict, Iterable, List, NamedTuple, Optional, Tuple

from mpi4py import MPI

import mpm_dem_store as store

from .loop import memory
from .loop.window import Window
from .records import manifest
from .records.record import Record
from .records.report import versions
from .records.results import labelled
from .records.schedule import Schedule
from .records.sharing import on_first
from .records.writing import OutputError

NAME, BEFORE, KIND = "checkpoint.h5", "checkpoint_before.h5", "run"


class Stopped(Exception):  # noqa: N818 - it is no error
    """A run has been stopped in order after its checkpoint was written. Its text says why and where."""


class Saved(NamedTuple):
    """A checkpoint that is whole: its ``path``, and its ``head``: "case", "run", "window", "time" [s],
    "parameters" (key → text), "versions", "ranks"."""

    path: Path
    head: Dict[str, Any]

    def source(self, out: Path) -> Path:
        """The folder with the files of the run: that of its results, or where the checkpoint lies.
        OutputError when they are in neither. Collective."""
        def find() -> Path:
            for folder in (out, self.path.parent):
                found = manifest.read(folder)
                if found is not None and found.run == self.head["run"]:
                    return folder
            raise OutputError(f"the history of {self.path} is neither in {out} nor in {self.path.parent}: "
                              "put the checkpoint back among the files of its run")

        return on_first(MPI.COMM_WORLD, find)


def find(place: Path, label: str = "") -> Optional[Saved]:
    """The newest checkpoint that is whole, in the folder ``place``, or that file; None where there is none.
    label: of a run with several back ends. StoreError when none of them is whole. Collective."""
    files = [place] if place.is_file() else [place / labelled(name, label) for name in (NAME, BEFORE)]
    files = MPI.COMM_WORLD.bcast([path for path in files if path.exists()])
    problems: List[store.StoreError] = []
    for path in files:
        try:
            return Saved(path, _of_a_run(path, store.read_head(path)))
        except store.StoreError as problem:
            problems.append(problem)
            if MPI.COMM_WORLD.rank == 0 and path != files[-1]:
                warnings.warn(f"{problem}; the checkpoint before it is taken", stacklevel=2)
    if problems:
        raise problems[0]
    return None


def found(place: Path) -> Saved:
    """The checkpoint at ``place``, see ``find``, whatever its label; ValueError where there is none."""
    for label in ("", "liggghts"):
        saved = find(place, label)
        if saved is not None:
            return saved
    what = f"has no {NAME}" if place.is_dir() else "does not exist"
    raise ValueError(f"restart={place} {what}: give the folder of a run that had checkpoint=, or one of its "
                     "checkpoints")


def _of_a_run(path: Path, head: Dict[str, Any]) -> Dict[str, Any]:
    if head.get("kind") != KIND:
        raise store.StoreError(f"{path} holds a state of {head.get('kind')} alone, not a run: give a {NAME}")
    return head


class Parts(NamedTuple):
    """Whose states make a checkpoint: both sides (grains: or None), observers that have a ``get_state``, and
    the record. Collective."""

    solid: Any
    grains: Any
    observers: Tuple[Any, ...]
    record: Record

    def get_state(self, window: Window) -> Dict[str, Any]:
        """After the last ``window``."""
        return {"solid": state_of(self.solid), "grains": self.grains and state_of(self.grains),
                "last": memory.to_tree(window), "record": self.record.get_state(),
                "observers": {name: one.get_state() for name, one in self._with_state().items()}}

    def load(self, saved: Saved, out: Path) -> Window:
        """Go on from there, with results in ``out``; returns the last window."""
        source, tree = saved.source(out), store.read(saved.path)
        last = memory.from_tree(tree["last"])
        for side, name in ((self.solid, "solid"), (self.grains, "grains")):
            if (side is None) != (tree[name] is None):
                raise ValueError(f"{saved.path} is of a run {'without' if side else 'with'} grains: restart "
                                 "it with the scene that it had")
            if side is not None:
                getattr(side, "set_checkpoint", side.set_state)(tree[name])
        for name, one in self._with_state().items():
            if name in tree["observers"]:
                one.set_state(tree["observers"][name])
        self.record.resume(tree["record"], last, source)
        return last

    def _with_state(self) -> Dict[str, Any]:
        """Observers by the name of their class and their number among those."""
        named: Dict[str, Any] = {}
        for one in self.observers:
            if hasattr(one, "get_state"):
                kind = type(one).__name__
                named[f"{kind} {sum(name.startswith(f'{kind} ') for name in named)}"] = one
        return named


def state_of(side: Any) -> Any:
    """Of a partition, independent of the ranks where that makes a difference. ValueError for one that has
    none."""
    get = getattr(side, "get_checkpoint", None) or getattr(side, "get_state", None)
    if get is None:
        raise ValueError(f"a {type(side).__name__} has no get_state and set_state: leave out checkpoint= and "
                         "walltime=")
    return get()


class Checkpoints:
    """Observer of a run, the last one: writes a checkpoint when one is due and raises ``Stopped`` when the
    run is to stop. head: what is always in it; label: goes into the names of the files. Collective."""

    def __init__(self, parts: Parts, schedule: Schedule, head: Dict[str, Any], label: str = "") -> None:
        self._parts, self._schedule, self._head = parts, schedule, head
        self._name, self._before = labelled(NAME, label), labelled(BEFORE, label)
        self._last: Optional[Window] = None
        self.wanted: List[Path] = []  # of further ones, at the end of this window
        self._written = self._told = 0
        self._count, self._seconds, self._bytes = 0, 0.0, 0

    def __call__(self, window: Window) -> None:
        """A window has ended."""
        self._last = window
        for path in self.wanted:
            self._save(path, window)
        self.wanted.clear()
        due = self._schedule(window.number)
        if due.checkpoint:
            self._keep(window, must=due.stop is not None)
        if due.stop is not None:
            raise Stopped(f"stopped by the {due.stop} after window {window.number}, t = {window.time:.6g} s")

    def begin(self) -> None:
        """The first window is about to begin."""
        self._schedule.begin()

    def finish(self) -> None:
        """The run has come to its end."""
        if self._last is not None and self._last.number != self._written:
            self._keep(self._last, must=False)

    def _keep(self, window: Window, must: bool) -> None:
        """Write the next checkpoint of the run. must: an OSError ends the run; else a warning tells of the
        first one in a row, and the run goes on."""
        begin, results = perf_counter(), self._parts.record.results
        try:
            self._bytes = self._save(results.scratch(self._name), window)
            on_first(MPI.COMM_WORLD, lambda: results.keep_two(self._name, self._before))
        except OSError as problem:
            if must:
                raise
            if MPI.COMM_WORLD.rank == 0 and not self._told:
                there = f"the last one is of window {self._written}" if self._written else "there is none yet"
                warnings.warn(f"no checkpoint could be written after window {window.number} ({problem}), and "
                              f"{there}: the run goes on", stacklevel=2)
            self._told = window.number
        else:
            self._written, self._told = window.number, 0
        spent = perf_counter() - begin
        self._count, self._seconds = self._count + 1, self._seconds + spent
        self._schedule.wrote(spent)

    def entries(self) -> Dict[str, Any]:
        """For report.json: how many have been written since the last start, the seconds that took, and the
        bytes of the last one."""
        figures = {"count": self._count, "seconds": round(self._seconds, 4), "bytes": self._bytes}
        return {"checkpoints": figures} if self._count else {}

    def _save(self, path: Path, window: Window) -> int:
        """Write the state after the last ``window`` to ``path``; returns the size of the file [bytes]."""
        return store.write(path, self._parts.get_state(window), {
            "kind": KIND, **self._head, "run": self._parts.record.results.run, "window": window.number,
            "time": window.time, "versions": versions(), "ranks": MPI.COMM_WORLD.size})


def contradictions(old: Dict[str, str], new: Dict[str, str], may_change: Dict[str, Any]) -> None:
    """ValueError for the first of the ``new`` keys that is not what it was, key → text. may_change: key →
    None, or a function of old and new ones that gives the reason why it may not, or ""."""
    for name, text in new.items():
        if name not in old or text == old[name]:
            continue
        rule = may_change.get(name, _never)
        reason = rule(old, new) if rule else ""
        if reason:
            raise ValueError(f"{name}={text} contradicts the checkpoint, where it is {old[name]}: {reason}")


def _never(old: Iterable, new: Iterable) -> str:
    return "leave it out, or begin a new run"
