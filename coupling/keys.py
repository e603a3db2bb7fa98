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
