"""Keys of a case that have no effect beside the others."""
import inspect

from .cli import typed


def refuse_unused(main, keys, uses):
    """ValueError for a key that was given, which is: has another value than its default, and would change nothing.

    main: of the case; keys: its keyword arguments; uses: name → (whether it has an effect, when it has one).
    """
    parameters = inspect.signature(main).parameters
    for name, (used, when) in uses.items():
        if not used and keys[name] != parameters[name].default:
            raise ValueError(f"{name}={typed(keys[name])} has no effect here, it counts {when}: leave it out")


def of_iteration(iterate):
    """For ``refuse_unused``: the keys of the coupling that only a repetition of windows uses."""
    return {name: (iterate != 0, "where windows are repeated, iterate=20") for name in ("tol", "relax")}
