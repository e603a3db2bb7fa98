"""The results of a run are one set: a folder never shows files of two runs.

A run holds its folder by a lock. What it writes until its first window is done goes to the hidden folder
HIDDEN in it; then the files of the earlier set, which its manifest names, are removed, and only after that
its own take their place. So a run that fails before leaves the earlier set as it was, and one that is killed
leaves the files of one run, at any moment. Files that no manifest names are never touched.
"""
import os
import shutil
import time
import uuid
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import ClassVar, Dict, List, Optional, Sequence, Tuple, Union

from mpi4py import MPI

from . import manifest
from .lock import Lock
from .sharing import on_first
from .writing import OutputError, replace_text, writing

HIDDEN = ".run"  # in the folder, while a run lasts: its lock, its first files, and room for its last lines
ROOM = 1 << 16  # bytes that are kept free for the report of a run that fills the disk


class Results:
    """The set of files of one run in ``folder``; make it when the scene has been checked, ``close`` it at the
    end.

    case: goes into the manifest; goes_on: name of a run (``run``) whose set is to go on, where that is the
    one in the folder; key: tells one run of this process from another: a further one with the same
    case and key, and ``names`` that the set does not have, adds to the set. names: files that will be
    written. Collective; rank 0 does the work. OutputError when the folder cannot be written, belongs to a run
    that has not ended, or has files of these names that are not of a run.
    """

    _last: ClassVar[dict] = {}  # folder → (id, key, names) of the last set of this process there

    def __init__(self, folder: Union[str, Path], case: str, key: str = "", names: Sequence[str] = (),
                 comm: MPI.Comm = MPI.COMM_WORLD, goes_on: str = "") -> None:
        self.folder, self._comm, self._key, self._before = Path(folder), comm, f"{case} {key}", goes_on
        self._hidden = self.folder / HIDDEN
        self._names: Dict[str, None] = {}
        self._lock: Optional[Lock] = None
        now = time.strftime("%Y-%m-%d %H:%M:%S")
        self._run = f"{case}, {now}, process {os.getpid()}, {uuid.uuid4().hex[:12]}"
        self._run, self.started = on_first(comm, partial(self._take, names))

    @property
    def run(self) -> str:
        """Name of the run: its case, when and as which process it began, and a number of its own."""
        return self._run

    def _take(self, names: Sequence[str]) -> Tuple[str, bool]:
        with writing(f"out={self.folder}"):
            self.folder.mkdir(parents=True, exist_ok=True)
            self._lock = Lock(self.folder, self._hidden / "lock")
            try:
                self._place = os.stat(self.folder)
                before = manifest.read(self.folder)
                self._earlier = list(before.names) if before else []
                continued = self._continues(before, names)
                self._reserve()
                self.started = continued
                self.add(*names)
            except BaseException:
                self._release()
                raise
        return self._run, continued

    def _continues(self, before: Optional[manifest.Manifest], names: Sequence[str]) -> bool:
        """Is the set in the folder the one that goes on, or does this run add to one of the same run of this
        process? Then that is the one to go on with."""
        run, key, others = self._last.get(self.folder.resolve(), (None, None, ()))
        adds = before and (before.run, self._key) == (run, key) and not set(names) & set(others)
        if before is None or not (adds or before.run == self._before):
            return False
        self._run, self._names, self._earlier = before.run, dict.fromkeys(before.files), []
        manifest.append(self.folder, state="running")
        return True

    def _reserve(self) -> None:
        """An empty place for the first files, and room for the last lines."""
        shutil.rmtree(self._hidden / "new", ignore_errors=True)  # of a run that was killed
        (self._hidden / "new").mkdir()
        with open(self._hidden / "room", "wb") as room:
            os.posix_fallocate(room.fileno(), 0, ROOM)

    def add(self, *names: str) -> None:
        """The run is going to write files of these names. On rank 0."""
        for name in names:
            if name in self._names:
                continue
            if not manifest.plain(name):
                raise ValueError(f"{name!r} is no plain file name: the results of a run lie right in "
                                 f"{self.folder}")
            if name not in self._earlier and (self.folder / name).exists():
                raise OutputError(f"{self.folder / name} is not of a run that left a {manifest.NAME}: move "
                                  "it away, or choose another folder with out=")
            self._names[name] = None
            if self.started:
                with writing(self.folder / manifest.NAME):
                    manifest.append(self.folder, file=name)

    def path(self, name: str) -> Path:
        """Where to write the file ``name`` now; rank 0 names it in the manifest."""
        if self._comm.rank == 0:
            self.add(name)
        return (self.folder if self.started else self._hidden / "new") / name

    def remove(self, *names: str) -> None:
        """Files of the set that are those of a time after the one from which the run goes on. On rank 0."""
        for name in set(names) & set(self._names):
            (self.folder / name).unlink(missing_ok=True)

    def files(self) -> List[str]:
        """Names of the files that the set may have."""
        return list(self._names)

    def keep_two(self, name: str, before: str) -> None:
        """The new file ``name``, which lies complete in ``scratch(name)``, takes its place, and that of the
        last time becomes ``before``; at any moment at least one of them is there. On rank 0."""
        self.add(name, before)
        with writing(self.folder / name):
            if (self.folder / name).exists():
                os.replace(self.folder / name, self.folder / before)
            os.replace(self.scratch(name), self.folder / name)

    def scratch(self, name: str) -> Path:
        """A place on the same disk for a file that is not complete yet."""
        return self._hidden / "new" / name

    def replace_text(self, name: str, text: str) -> None:
        """Write ``text`` into the file ``name`` so that it is always whole. On rank 0."""
        replace_text(self.path(name), text, self._hidden / "text")

    # ---------------------------------------------------------------- begin and end

    def start(self) -> None:
        """The first window is done: the files so far take the place of the earlier set. Collective; does
        nothing when called again."""
        if not self.started:
            on_first(self._comm, self._switch)
            self.started = True

    def _switch(self) -> None:
        with writing(self.folder):
            replace_text(self.folder / manifest.NAME, manifest.text(self._run, self._names, self._earlier),
                         self._hidden / "text")
            for name in self._earlier:
                (self.folder / name).unlink(missing_ok=True)
            for name in self._names:
                if (self._hidden / "new" / name).exists():
                    os.replace(self._hidden / "new" / name, self.folder / name)
            manifest.append(self.folder, state="running")
        self.started, self._earlier = True, []
        self._last[self.folder.resolve()] = self._run, self._key, tuple(self._names)

    def lost(self) -> Optional[str]:
        """Why what is written is no longer seen: a sentence, or None. On rank 0."""
        try:
            if not os.path.samestat(os.stat(self.folder), self._place):
                return (f"the folder {self.folder} has been replaced by another one while the run wrote into "
                        "it")
        except FileNotFoundError:
            return f"the folder {self.folder} has been deleted while the run wrote into it"
        held = self._lock is not None and self._lock.held()
        return None if held else f"{self._hidden} has been deleted while the run needed it"

    def end(self, state: str) -> None:
        """Write into the manifest how the run ended: ``complete`` or ``stopped``. On rank 0."""
        if self.started and not self.lost():
            with writing(self.folder / manifest.NAME):
                manifest.append(self.folder, state=state)
            self._last[self.folder.resolve()] = self._run, self._key, tuple(self._names)

    def make_room(self) -> bool:
        """Before the last lines of a run that failed: room on the disk, and the folder again if it is gone.
        On rank 0; returns whether there is a place to write to: not where an earlier set stays, or another
        run has begun."""
        (self._hidden / "room").unlink(missing_ok=True)
        if not self.folder.exists():
            self._make_again()
        elif self.lost():
            return False
        if not self.started and not self._earlier:  # an empty folder may as well show the run that failed
            self._switch()
        return self.started

    def _make_again(self) -> None:
        self._hidden.mkdir(parents=True)
        self._lock, self._place, self._earlier = Lock(self.folder,
                                                      self._hidden / "lock"), os.stat(self.folder), []
        if self.started:
            text = manifest.text(self._run, self._names, ())
            replace_text(self.folder / manifest.NAME, text, self._hidden / "text")

    def close(self) -> None:
        """Give the folder to other runs. On every rank; again without effect."""
        self._release()

    def _release(self) -> None:
        if self._lock is not None and self._lock.held():
            shutil.rmtree(self._hidden / "new", ignore_errors=True)
            for name in ("room", "text"):
                (self._hidden / name).unlink(missing_ok=True)
            self._lock.release()
            with suppress(OSError):  # the next run has just come
                self._hidden.rmdir()
        self._lock = None


def labelled(name: str, label: str) -> str:
    """The name of a file with ``label`` behind its stem.

    >>> labelled("blocks_flow.png", "liggghts")
    'blocks_flow_liggghts.png'
    """
    path = Path(name)
    return f"{path.stem}_{label}{path.suffix}" if label else name
