"""The keys of a case: arguments of its ``main``, and the fields of those that are dataclasses."""
import dataclasses
import inspect
import re
import typing

from .words import typed

REQUIRED = inspect.Parameter.empty
ARGUMENT = re.compile(r"^\s+(\w+)\s*:[^\n#]*,\s*#\s*(.*)$", re.M)
FIELD = re.compile(r"^\s+(\w+)\s*:[^\n#]*#\s*(.*)$", re.M)


class Key(typing.NamedTuple):
    """kind: annotation; default: REQUIRED where there is none; meaning: the comment behind it; argument: of
    ``main`` whose field it is, or its own name."""

    kind: object
    default: object
    meaning: str
    argument: str


def keys_of(main: typing.Callable) -> typing.Tuple[typing.Dict[str, Key], typing.Dict[str, type]]:
    """Name → ``Key`` of a function, in the order of its arguments, and argument → class of those that are
    dataclasses. TypeError for a name that is there twice."""
    hints, meanings = typing.get_type_hints(main), comments(main, ARGUMENT)
    keys: typing.Dict[str, Key] = {}
    classes: typing.Dict[str, typing.Any] = {}
    for name, parameter in inspect.signature(main).parameters.items():
        kind: typing.Any = hints.get(name, str)
        default: typing.Any = parameter.default
        if dataclasses.is_dataclass(kind):
            classes[name] = type(default) if dataclasses.is_dataclass(default) else kind
            found = _fields(classes[name], default, name)
        else:
            found = {name: Key(kind, default, meanings.get(name, ""), name)}
        for key in set(found) & set(keys):
            raise TypeError(f"the key {key} of {main.__name__} is an argument or a field twice: rename one")
        keys.update(found)
    return keys, classes


def _fields(kind: type, default: typing.Any, argument: str) -> typing.Dict[str, Key]:
    hints = typing.get_type_hints(kind)
    meanings: typing.Dict[str, str] = {}
    for one in reversed(kind.__mro__):
        meanings.update(comments(one, FIELD) if dataclasses.is_dataclass(one) else {})
    return {field.name: Key(hints[field.name], field.default if default is REQUIRED
                            else getattr(default, field.name), meanings.get(field.name, ""), argument)
            for field in dataclasses.fields(kind)}


def comments(thing: typing.Any, pattern: re.Pattern) -> typing.Dict[str, str]:
    """Name → the comment behind it, of the arguments of a function or the fields of a class."""
    try:
        return dict(pattern.findall(inspect.getsource(thing)))
    except (OSError, TypeError):  # typed at a prompt
        return {}


def refuse_without_effect(values: dict, keys: typing.Dict[str, Key], counts: dict) -> None:
    """ValueError for a key that was given, which is: has another value than its default, and would change
    nothing.

    values, keys: name → value, name → ``Key``; counts: name → (function of the values that tells whether it
    has an effect, when it has one).
    """
    for name, (used, when) in counts.items():
        if values[name] != keys[name].default and not used(values):
            raise ValueError(f"{name}={typed(values[name])} has no effect here, it counts {when}: leave it "
                             "out")
