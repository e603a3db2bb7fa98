"""A single point of a material on a path of strain and stress: a table and a figure of what its law does.

    python -m mpm_fenicsx.element law=mohr_coulomb E=50e6 nu=0.3 friction_angle=30 path=triaxial \\
        pressure=1e5 shortening=0.1
    python -m mpm_fenicsx.element law=own_law.py:damped path=simple_shear --help

The keys besides law=, path=, dimensions= and out= are the parameters of the law and of the path. A law of
one's own is a function of a file, FILE.py:NAME, as is a path of one's own, which gives a list of ``Stage``.
"""
import difflib
import importlib.util
import inspect
import re
import sys
import typing
from typing import Any, Callable, Dict, List, NoReturn, Optional, Sequence, TextIO, Tuple

from mpi4py import MPI

import mpm_dem_checks as check

from .laws import LAWS, Law
from .laws.driver import drive
from .laws.paths import PATHS, Stage
from .output.element_table import Table, draw_table, driven, write_table

OUT = "out/element"
OF_THE_COMMAND = ("law", "path", "dimensions", "out")
DIMENSIONS = "3, or 2: the kernels of plane scenes, where zz is across the plane"
NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?", re.ASCII | re.IGNORECASE)
COMMENT = re.compile(r"^\s+(\w+)\s*:[^\n#]*,\s*#\s*(.*)$", re.M)
EXPECTED = (ValueError, RuntimeError, ArithmeticError, OSError, ImportError)  # anything else is a bug


class UsageError(ValueError):
    """The command line asks for something that does not exist or cannot be read."""


def found(key: str, text: str, known: Dict[str, Callable]) -> Callable:
    """The function that ``text`` names: one of the ``known``, or of a file, FILE.py:NAME."""
    if text in known:
        return known[text]
    file, colon, name = text.rpartition(":")
    if not colon:
        close = difflib.get_close_matches(text, known, 1)
        hint = f" (did you mean {close[0]}?)" if close else ""
        raise UsageError(f"{key}={text} does not exist{hint}: choose one of {', '.join(known)}, or give "
                         "FILE.py:NAME")
    path = check.file(key, file)
    module = sys.modules.get(path.stem)
    if getattr(module, "__file__", None) != str(path.resolve()):
        spec = importlib.util.spec_from_file_location(path.stem, path.resolve())
        if spec is None or spec.loader is None or module is not None:
            raise UsageError(f"{key}={text} cannot be imported: give a file whose name ends in .py and is "
                             "not that of a module that is there already")
        module = sys.modules[path.stem] = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
    function = getattr(module, name, None)
    if not callable(function):
        raise UsageError(f"{key}={text}: {file} has no function {name}, look at its name")
    return function


def keys_of(function: Callable) -> Dict[str, Tuple[Any, Any, str]]:
    """Name → type, default (``inspect.Parameter.empty`` for none) and meaning of each argument."""
    hints = typing.get_type_hints(function)
    try:
        meanings = dict(COMMENT.findall(inspect.getsource(function)))
    except OSError:
        meanings = {}
    return {name: (hints.get(name, str), parameter.default, meanings.get(name, ""))
            for name, parameter in inspect.signature(function).parameters.items()}


def converted(key: str, text: str, kind: Any) -> Any:
    """The word ``text`` as a value of the type ``kind``."""
    if typing.get_origin(kind) is typing.Union:  # Optional
        return None if text == "none" else converted(key, text, typing.get_args(kind)[0])
    if kind not in (int, float):
        return text
    if not NUMBER.fullmatch(text) or (kind is int and float(text) % 1.0):
        raise UsageError(f"{key}={check.shown(text, plain=True)} cannot be read as "
                         f"{'a whole' if kind is int else 'a finite'} number")
    return kind(float(text))


def read(words: Sequence[str]) -> Dict[str, str]:
    """Key → text of words such as ``E=50e6``."""
    given: Dict[str, str] = {}
    for word in words:
        key, equals, text = word.partition("=")
        if not equals or key.startswith("-"):
            raise UsageError(f"{word!r} is not key=value: give law=, path=, dimensions=, out= and the "
                             "parameters of law and path")
        if key in given:
            raise UsageError(f"{key}={check.shown(text, plain=True)} repeats the key {key}: give it once")
        given[key] = text
    return given


def asked(given: Dict[str, str]) -> Tuple[Callable, Callable]:
    """The functions that make the law and the path."""
    for key, known in (("law", LAWS), ("path", PATHS)):
        if not given.get(key):
            raise UsageError(f"{key}= is missing: choose one of {', '.join(known)}, or give FILE.py:NAME")
    return found("law", given["law"], LAWS), found("path", given["path"], PATHS)


def made(given: Dict[str, str]) -> Tuple[Law, List[Stage]]:
    """Law and path that the keys state."""
    functions = asked(given)
    kinds = [keys_of(function) for function in functions]
    known = [*OF_THE_COMMAND, *kinds[0], *kinds[1]]
    twice = sorted(key for key in known if known.count(key) > 1)
    if twice:
        raise UsageError(f"{twice[0]} is a key of two of the law, the path and this command: rename it in "
                         "your file")
    for key in given:
        if key not in known:
            close = difflib.get_close_matches(key, known, 1)
            hint = f" (did you mean {close[0]}?)" if close else ""
            raise UsageError(f"unknown key {key!r}{hint}; known keys: {', '.join(known)}")
    for key, (_, default, meaning) in {**kinds[0], **kinds[1]}.items():
        if default is inspect.Parameter.empty and key not in given:
            raise UsageError(f"{key}= is missing: {meaning or 'it has no default'}")
    law, path = (function(**{key: converted(key, given[key], kind[key][0]) for key in kind if key in given})
                 for function, kind in zip(functions, kinds))
    return law, path


def run(given: Dict[str, str]) -> None:
    """Drive the point, write table and figure, tell a summary. All ranks drive it, as making a law may be
    collective; the first one writes."""
    law, path = made(given)
    table = drive(law, path, converted("dimensions", given.get("dimensions", "3"), int))
    if MPI.COMM_WORLD.rank == 0:
        report(given, table)


def report(given: Dict[str, str], table: Table) -> None:
    """Files and summary of what was driven."""
    out = check.path("out", given.get("out", OUT))
    out.mkdir(parents=True, exist_ok=True)
    stated = " ".join(f"{key}={text}" for key, text in given.items() if key != "out")
    write_table(out / "element.csv", table, [f"python -m mpm_fenicsx.element {stated}"])
    draw_table(out / "element.png", table, stated)
    name, most = driven(table), int(table["q"].argmax())
    for title, row in (("largest q", most), ("end", len(table["q"]) - 1)):
        print(f"{title:10} {name} = {table[name][row]:.4g}, q = {table['q'][row]:.6g} Pa, "
              f"p = {table['p'][row]:.6g} Pa, volume {table['volume'][row]:+.4g}")
    print(f"results in {out}: element.csv, {len(table['q'])} rows, and element.png")


def manual(given: Dict[str, str]) -> str:
    """What --help prints: laws and paths, or the keys of those that are ``given``."""
    lines = [(__doc__ or "").strip(), "", f"  out={OUT}", f"  {'dimensions=3':22} {DIMENSIONS}"]
    for key, known in (("law", LAWS), ("path", PATHS)):
        if not given.get(key):
            lines.append(f"  {key}=…    one of {', '.join(known)}, or FILE.py:NAME")
            continue
        function = found(key, given[key], known)
        lines += ["", f"{key}={given[key]}: {(inspect.getdoc(function) or '').split(chr(10) * 2)[0]}"]
        for name, (_, default, meaning) in keys_of(function).items():
            value = "…" if default is inspect.Parameter.empty else "none" if default is None else default
            lines.append(f"  {f'{name}={value}':22} {meaning}".rstrip())
    return "\n".join(lines)


def main(words: Sequence[str]) -> int:
    """The command with its ``words``; its exit status."""
    try:
        helped = [word for word in words if word not in ("-h", "--help")]
        if len(helped) < len(words):
            _print(manual(read(helped)))
        else:
            run(read(words))
    except UsageError as error:
        return _say(error, 2)
    except EXPECTED as error:
        return _say(error, 1)
    return 0


def _say(error: Exception, status: int) -> int:
    _print(f"error: {' '.join(str(error).split())}", sys.stderr)
    return status


def _print(text: str, file: Optional[TextIO] = None) -> None:
    if MPI.COMM_WORLD.rank == 0:
        print(text, file=file)


def stop(words: Sequence[str]) -> NoReturn:
    """Run the command and end."""
    sys.exit(main(words))


if __name__ == "__main__":
    stop(sys.argv[1:])
