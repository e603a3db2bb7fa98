"""``key=value`` on the command line → typed keyword arguments of a case's ``main``. Words with a dash are PETSc's."""
import inspect
import re
import sys
import typing

from mpi4py import MPI


class UsageError(ValueError):
    """The command line asks for something that does not exist or cannot be read."""


def run(main, presets=None):
    """Call ``main`` with the words of the command line; the script's last line.

    presets: name → keyword arguments, chosen by ``preset=NAME``; explicit keys win over the preset. An error ends the
    run on all ranks with one sentence on rank 0 and exit status 1 (2 for a wrong command line).
    """
    words = sys.argv[1:]
    try:
        if "--help" in words or "-h" in words:
            if MPI.COMM_WORLD.rank == 0:
                print(manual(main, presets))
            return
        main(**parse(main, words, presets))
    except UsageError as error:
        _stop(error, 2)
    except (ValueError, RuntimeError, ImportError, ArithmeticError, OSError) as error:
        _stop(error, 1)
    except KeyboardInterrupt:
        _stop("interrupted; what was written so far is complete up to the last window", 130)


def _stop(message, status):
    comm = MPI.COMM_WORLD
    sys.stdout.flush()
    if comm.rank == 0 or not isinstance(message, Exception):
        print(f"error: {message}", file=sys.stderr, flush=True)
    sys.exit(status)


def parse(main, words, presets=None):
    """Keyword arguments for ``main`` from words such as ``dt=1e-6``; UsageError for an unknown key or a value that does
    not fit its type."""
    hints = typing.get_type_hints(main)
    known = [name for name in inspect.signature(main).parameters]
    given = {}
    skip_value = False
    for word in words:
        if word.startswith("-"):
            skip_value = True  # the value of an option, if it has one, follows as a word of its own
            continue
        key, equals, text = word.partition("=")
        if not equals:
            if skip_value:
                skip_value = False
                continue
            raise UsageError(f"{word!r} is not key=value; known keys: {', '.join(known)}")
        skip_value = False
        if key == "preset" and presets:
            if text not in presets:
                raise UsageError(f"preset={text} does not exist; choose one of {', '.join(presets)}")
            given = {**presets[text], **given}
        elif key not in known:
            raise UsageError(f"unknown key {key!r}; known keys: {', '.join(known + ['preset'] * bool(presets))}")
        else:
            given[key] = convert(key, text, hints[key])
    return given


def convert(key, text, kind):
    """The word ``text`` as a value of the annotation ``kind``."""
    origin, args = typing.get_origin(kind), typing.get_args(kind)
    try:
        if origin is typing.Literal:
            if text not in args:
                raise UsageError(f"{key}={text} does not exist; choose one of {', '.join(args)}")
            return text
        if origin is tuple:
            parts = text.strip("()").split(",")
            if len(parts) != len(args):
                raise ValueError
            return tuple(convert(key, part, arg) for part, arg in zip(parts, args))
        if origin is typing.Union:  # Optional
            return None if text == "none" else convert(key, text, args[0])
        if kind is bool:
            return {"yes": True, "true": True, "1": True, "no": False, "false": False, "0": False}[text.lower()]
        return kind(text)
    except UsageError:
        raise
    except (ValueError, KeyError):
        raise UsageError(f"{key}={text} cannot be read as {_kind_name(kind)}") from None


def _kind_name(kind):
    origin, args = typing.get_origin(kind), typing.get_args(kind)
    if origin is tuple:
        return f"{len(args)} numbers separated by commas, such as {key_example(args)}"
    if origin is typing.Union:
        return _kind_name(args[0]) + " or none"
    return {int: "a whole number", float: "a number", bool: "yes or no", str: "a word"}.get(kind, str(kind))


def key_example(args):
    return ",".join("1" if a is int else "0.1" for a in args)


def manual(main, presets=None):
    """The case's manual: its docstring, and each key with default, unit and meaning (the comment behind it)."""
    source = inspect.getsource(main)
    comments = dict(re.findall(r"^\s+(\w+)\s*:[^\n#]*,\s*#\s*(.*)$", source, re.M))
    lines = [inspect.getdoc(main) or "", "", "keys (key=value):"]
    for name, parameter in inspect.signature(main).parameters.items():
        default = parameter.default
        shown = ",".join(map(str, default)) if isinstance(default, tuple) else default
        lines.append(f"  {name + '=' + str(shown):28} {comments.get(name, '')}")
    for name, values in (presets or {}).items():
        lines.append(f"  preset={name}".ljust(31) + " ".join(f"{k}={v}" for k, v in values.items()))
    lines += ["", "Options with a dash belong to PETSc: -mpm_snes_monitor, -mpm_ksp_type cg, …"]
    return "\n".join(lines)
