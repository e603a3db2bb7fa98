"""Where an error comes from: a line of the user's own script, or this program."""
import traceback
import typing
from pathlib import Path

__all__ = ["in_program", "with_line"]

ROOT = Path(__file__).resolve().parents[1]
PROGRAM = "mpm_fenicsx", "dem_liggghts", "coupling", "cases"


def with_line(error: BaseException, script: str) -> str:
    """What ``error`` says, with the line of the user's own ``script``, a path, in which it came up. Cases of
    the program have keys, and so no line.

    >>> try:
    ...     raise ValueError("dt is 0")
    ... except ValueError as error:
    ...     with_line(error, "another.py")
    'dt is 0'
    """
    own = Path(script).resolve()
    lines = [line for file, line in _places(error) if file == own]
    return f"{error} (line {lines[-1]} of {own.name})" if lines and not _of_program(own) else str(error)


def in_program(error: BaseException, script: str) -> bool:
    """Whether ``error`` came up in this program, or in what it calls, and not in the user's ``script``."""
    own = Path(script).resolve()
    told = [file for file, _ in _places(error) if file == own or _of_program(file)]
    return not told or _of_program(told[-1])


def _places(error: BaseException) -> typing.List[typing.Tuple[Path, int]]:
    """Files and lines through which ``error`` went, the innermost last."""
    return [(Path(frame.filename).resolve(), frame.lineno or 0)
            for frame in traceback.extract_tb(error.__traceback__)]


def _of_program(file: Path) -> bool:
    return ROOT in file.parents and file.relative_to(ROOT).parts[0] in PROGRAM
