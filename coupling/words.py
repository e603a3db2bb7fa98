"""Values as words of a command line: ``dt=1e-6`` there, a number here."""
import difflib
import re
import typing
from pathlib import Path
from typing import Any, Callable, Container, Dict, List, Sequence

import mpm_dem_checks as check

# Python's float() and int() take more
NUMBERS = {float: re.compile(r"[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?", re.ASCII | re.IGNORECASE),
           int: re.compile(r"[+-]?\d+(e\+?\d+)?", re.ASCII | re.IGNORECASE)}


class UsageError(ValueError):
    """The command line asks for something that does not exist or cannot be read."""


def parse(words: Sequence[str], kinds: Dict[str, Any], presets: Dict[str, dict]) -> Dict[str, Any]:
    """Values by key from ``words`` such as ``dt=1e-6``; kinds: key → annotation; presets: name → values by
    key, chosen by ``preset=NAME``. UsageError for an unknown or repeated key and a value that does not fit
    its type."""
    known = list(kinds)
    preset: Dict[str, Any] = {}
    given: Dict[str, Any] = {}
    after_option = False
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
            given[key] = convert(key, text, kinds[key])
    return {**preset, **given}


def once(key: str, text: str, given: Container[str]) -> None:
    """UsageError when the key is among those ``given`` before: which of two values counts is nothing to
    guess."""
    if key in given:
        raise UsageError(f"{key}={check.shown(text, plain=True)} repeats the key {key}: give it once")


def _unknown(key: str, known: List[str]) -> str:
    close = difflib.get_close_matches(key, known, 1)
    hint = f" (did you mean {close[0]}?)" if close else ""
    return f"unknown key {key!r}{hint}; known keys: {', '.join(known)}"


def convert(key: str, text: str, kind: Any) -> Any:
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
            return {"yes": True, "true": True, "1": True, "no": False, "false": False,
                    "0": False}[text.lower()]
        if kind in (int, float):
            return _number(key, text, kind)
    except UsageError:
        raise
    except (ValueError, KeyError):
        raise UsageError(
            f"{key}={check.shown(text, plain=True)} cannot be read as {_kind_name(kind)}") from None
    return checked(check.path, key, text) if kind is Path else kind(text)


def _number(key: str, text: str, kind: type) -> float:
    """ValueError unless the text is a number in plain digits, for int a whole one such as 20 or 1e9."""
    if not NUMBERS[kind].fullmatch(text):
        raise ValueError
    if kind is int:
        return int(text) if text.lstrip("+-").isdigit() else int(checked(check.finite, key, float(text)))
    return checked(check.finite, key, float(text))


def checked(valid: Callable, key: str, value: Any, **more: Any) -> Any:
    """What the check ``valid`` makes of the value; UsageError for what it refuses."""
    try:
        return valid(key, value, **more)
    except ValueError as error:
        raise UsageError(str(error)) from None


def _kind_name(kind: Any) -> str:
    args = typing.get_args(kind)
    if typing.get_origin(kind) is tuple:
        if args[-1] is Ellipsis:
            return f"numbers separated by commas, such as {','.join(3 * ['2' if args[0] is int else '0.1'])}"
        sample = ",".join("2" if a is int else "0.1" for a in args)
        return f"{len(args)} numbers separated by commas, such as {sample}"
    return {int: "a whole number", float: "a finite number", bool: "yes or no", str: "a word",
            Path: "a folder"}.get(kind, str(kind))


def typed(value: Any, exact: bool = False) -> str:
    """A value as it is typed on the command line; exact: to the last bit of its numbers."""
    if isinstance(value, tuple):
        return ",".join(typed(one, exact) for one in value)
    if isinstance(value, float):
        return repr(float(value)) if exact else f"{value:.12g}"
    return "none" if value is None else str(value)


def as_texts(values: Dict[str, Any]) -> Dict[str, str]:
    """Keys with their values as they are typed, to the last bit."""
    return {name: typed(value, exact=True) for name, value in values.items()}
