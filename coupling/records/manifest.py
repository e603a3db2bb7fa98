"""manifest.txt: which run a folder's results are of, how far it came, and which files it has written.

Lines "key: value". Every file is named before it is written, so that after the death of a process at any
point a later run knows what to remove. ``state`` is, in this order, ``starting`` (files of an earlier set,
those of ``replaces``, are being removed), ``running`` and then ``complete`` or ``stopped``.
"""
import os
from pathlib import Path
from typing import Dict, Iterable, List, NamedTuple, Optional, Tuple, Union

NAME = "manifest.txt"
HEAD = ("# The results of one run. A later run in this folder replaces these files, and leaves all others "
        "alone.\n")


class Manifest(NamedTuple):
    """run: case, start and process; files: names of this run's files; replaces: those of the set before."""

    run: str
    state: str
    files: Tuple[str, ...]
    replaces: Tuple[str, ...]

    @property
    def names(self) -> Dict[str, None]:
        """All that a later run may remove: those of the set before only as long as it is being removed."""
        return dict.fromkeys([*(self.replaces if self.state == "starting" else ()), *self.files])


def read(folder: Union[str, Path]) -> Optional[Manifest]:
    """The ``Manifest`` of ``folder``, or None where there is none. Names that are no plain file names are
    left out."""
    try:
        text = (Path(folder) / NAME).read_text(encoding="utf-8", errors="replace")
    except (FileNotFoundError, NotADirectoryError):
        return None
    found: Dict[str, List[str]] = {"run": [], "state": [], "file": [], "replaces": []}
    for line in text.rpartition("\n")[0].split("\n"):  # half a line names a file that was never begun
        key, _, value = line.partition(": ")
        if key in found and value:
            found[key].append(value)
    files, replaces = (tuple(name for name in found[key] if plain(name)) for key in ("file", "replaces"))
    run, state = ((found[key] or [""])[-1] for key in ("run", "state"))
    return Manifest(run, state, files, replaces)


def plain(name: str) -> bool:
    """Is it the name of a file right in the folder?"""
    return name not in ("", ".", "..") and not set("/\0\n") & set(name)


def text(run: str, files: Iterable[str], replaces: Iterable[str]) -> str:
    """Of a manifest whose state is ``starting``."""
    return "".join([HEAD, f"run: {run}\n", "state: starting\n", *(f"replaces: {name}\n" for name in replaces),
                    *(f"file: {name}\n" for name in files)])


def append(folder: Union[str, Path], **entries: str) -> None:
    """Add a line for each entry, in one call of the system, which a signal does not cut."""
    line = "".join(f"{key}: {value}\n" for key, value in entries.items())
    number = os.open(Path(folder) / NAME, os.O_WRONLY | os.O_APPEND)
    try:
        os.write(number, line.encode())
    finally:
        os.close(number)
