"""``key=value`` on the command line → typed keyword arguments of a case's ``main``. Words with a dash are PETSc's."""
import difflib
import inspect
import re
import sys
import time
import traceback
import typing
import warnings
from pathlib import Path

from mpi4py import MPI

import mpm_dem_checks as check

from . import signals
from .records.writing import silence, tell
from .signals import SIGNALS  # noqa: F401 - known by this name

EXPECTED = (ValueError, RuntimeError, ImportError, ArithmeticError, OSError, MemoryError)  # anything else is a bug
PATIENCE = 5.0  # [s] for ranks that share an error to arrive at their end
IMPATIENT = 0.5  # [s] after an interrupt: mpirun kills the ranks a second after it has told them
NUMBERS = {float: re.compile(r"[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?", re.ASCII | re.IGNORECASE),
           int: re.compile(r"[+-]?\d+(e\+?\d+)?", re.ASCII | re.IGNORECASE)}  # Python's float() and int() take more


class UsageError(ValueError):
    """The command line asks for something that does not exist or cannot be read."""


def run(main, presets=None):
    """Call ``main`` with the words of the command line; the script's last line.

    presets: name → keyword arguments, chosen by ``preset=NAME``; explicit keys win over the preset. An error ends the
    run on all ranks with one sentence on rank 0 and exit status 1 (2 for a wrong command line); warnings are one line.
    Signals end it like an interrupt, see ``signals``: the ranks get one when mpirun is interrupted or a queue's time is
    over.
    """
    words = sys.argv[1:]
    warnings.showwarning = _show
    if "--help" in words or "-h" in words:
        if MPI.COMM_WORLD.rank == 0:
            tell(manual(main, presets))
        return
    with signals.like_interrupts():
        _run(main, presets, words)


def _run(main, presets, words):
    try:
        main(**parse(main, words, presets))
    except UsageError as error:
        _stop(error, 2)
    except EXPECTED as error:
        _stop(error, 1)
    except KeyboardInterrupt:
        signals.ignore()  # a second one must not cut the end short
        _stop("interrupted; what was written so far is complete up to the last window", 130, IMPATIENT)
    except Exception:
        tell(traceback.format_exc(), sys.stderr)
        _stop("this is a bug in the program: please report the lines above", 1)


def _show(message, category, filename, lineno, file=None, line=None):
    if MPI.COMM_WORLD.rank == 0:
        tell(f"warning: {message}", sys.stderr)


def _stop(message, status, patience=None):
    """End all ranks; those that do not share the error wait somewhere for this one and are aborted after
    ``patience``."""
    comm, sentence = MPI.COMM_WORLD, " ".join(str(message).split())
    try:
        sys.stdout.flush()
    except OSError:
        silence(sys.stdout)
    if comm.rank == 0:
        tell(f"error: {sentence}", sys.stderr)
    if comm.size > 1 and not _all_arrive(comm, PATIENCE if patience is None else patience):
        if comm.rank > 0:
            tell(f"error on rank {comm.rank}: {sentence}", sys.stderr)
        comm.Abort(status)
    sys.exit(status)


def _all_arrive(comm, patience):
    request, end = comm.Ibarrier(), time.monotonic() + patience
    while not request.Test():
        if time.monotonic() > end:
            return False
        time.sleep(0.01)
    return True


def parse(main, words, presets=None):
    """Keyword arguments for ``main`` from words such as ``dt=1e-6``; UsageError for an unknown or repeated key and a
    value that does not fit its type."""
    hints, known = typing.get_type_hints(main), list(inspect.signature(main).parameters)
    preset, given, after_option = {}, {}, False
    for word in words:
        key, equals, text = word.partition("=")
        if word.startswith("-"):
            if word.startswith("--") or equals or key[1:] in known:
                raise UsageError(f"{word!r} starts with a dash, which is for PETSc's options: give a key as "
                                 f"{key.lstrip('-')}={text or '…'}")
            after_option = True  # the value of an option, if it has one, follows as a word of its own
        elif not equals:
            if not after_option:
                raise UsageError(f"{word!r} is not key=value; known keys: {', '.join(known)}")
            after_option = False
        elif key == "preset" and presets:
            once(key, text, {"preset": preset} if preset else {})
            if text not in presets:
                raise UsageError(f"preset={text} does not exist: choose one of {', '.join(presets)}")
            preset = presets[text]
        elif key not in known:
            raise UsageError(_unknown(key, known + ["preset"] * bool(presets)))
        else:
            once(key, text, given)
            given[key] = convert(key, text, hints[key])
    return {**preset, **given}


def once(key, text, given):
    """UsageError when the key is among those ``given`` before: which of two values counts is nothing to guess."""
    if key in given:
        raise UsageError(f"{key}={check.shown(text, plain=True)} repeats the key {key}: give it once")


def _unknown(key, known):
    close = difflib.get_close_matches(key, known, 1)
    hint = f" (did you mean {close[0]}?)" if close else ""
    return f"unknown key {key!r}{hint}; known keys: {', '.join(known)}"


def convert(key, text, kind):
    """The word ``text`` as a value of the annotation ``kind``; UsageError when it is none."""
    origin, args = typing.get_origin(kind), typing.get_args(kind)
    if origin is typing.Literal:
        choices = {str(choice): choice for choice in args}
        if text not in choices:
            raise UsageError(f"{key}={text} does not exist: choose one of {', '.join(choices)}")
        return choices[text]
    if origin is typing.Union:  # Optional
        return None if text == "none" else convert(key, text, args[0])
    if not text:
        raise UsageError(f"{key}= has no value: give {_kind_name(kind)}, or leave {key} out")
    try:
        if origin is tuple:
            parts = re.sub(r"^\((.*)\)$", r"\1", text).split(",")
            if args[-1] is Ellipsis:  # any number of them
                args = args[:1] * len(parts)
            if len(parts) != len(args):
                raise ValueError
            return tuple(_number(key, part, arg) for part, arg in zip(parts, args))
        if kind is bool:
            return {"yes": True, "true": True, "1": True, "no": False, "false": False, "0": False}[text.lower()]
        if kind in (int, float):
            return _number(key, text, kind)
    except UsageError:
        raise
    except (ValueError, KeyError):
        raise UsageError(f"{key}={check.shown(text, plain=True)} cannot be read as {_kind_name(kind)}") from None
    return checked(check.path, key, text) if kind is Path else kind(text)


def _number(key, text, kind):
    """ValueError unless the text is a number in plain digits, for int a whole one such as 20 or 1e9."""
    if not NUMBERS[kind].fullmatch(text):
        raise ValueError
    if kind is int:
        return int(text) if text.lstrip("+-").isdigit() else int(checked(check.finite, key, float(text)))
    return checked(check.finite, key, float(text))


def checked(valid, key, value, **more):
    """What the check ``valid`` makes of the value; UsageError for what it refuses."""
    try:
        return valid(key, value, **more)
    except ValueError as error:
        raise UsageError(str(error)) from None


def _kind_name(kind):
    args = typing.get_args(kind)
    if typing.get_origin(kind) is tuple:
        if args[-1] is Ellipsis:
            return f"numbers separated by commas, such as {','.join(3 * ['2' if args[0] is int else '0.1'])}"
        return f"{len(args)} numbers separated by commas, such as {','.join('2' if a is int else '0.1' for a in args)}"
    return {int: "a whole number", float: "a finite number", bool: "yes or no", str: "a word",
            Path: "a folder"}.get(kind, str(kind))


def manual(main, presets=None):
    """The case's manual: its docstring, and each key with default, meaning (the comment behind it) and choices."""
    comments = dict(re.findall(r"^\s+(\w+)\s*:[^\n#]*,\s*#\s*(.*)$", inspect.getsource(main), re.M))
    hints = typing.get_type_hints(main)
    lines = [inspect.getdoc(main) or "", "", "keys (key=value), with defaults:"]
    for name, parameter in inspect.signature(main).parameters.items():
        meaning = comments.get(name, "")
        hint = typing.get_args(hints[name])[0] if typing.get_origin(hints[name]) is typing.Union else hints[name]
        if typing.get_origin(hint) is typing.Literal:
            meaning += f"; one of {', '.join(map(str, typing.get_args(hint)))}"
        lines.append(f"  {f'{name}={typed(parameter.default)}':26} {meaning}")
    for name, values in (presets or {}).items():
        lines.append(f"  {f'preset={name}':26} " + " ".join(f"{k}={typed(v)}" for k, v in values.items()))
    lines += ["", "Options with a dash belong to PETSc: -mpm_snes_monitor, -mpm_snes_rtol 1e-8, -mpm_pc_type lu, …"]
    return "\n".join(lines)


def typed(value):
    """A value as it is typed on the command line."""
    if isinstance(value, tuple):
        return ",".join(map(typed, value))
    if isinstance(value, float):
        return f"{value:.12g}"
    return "none" if value is None else str(value)
