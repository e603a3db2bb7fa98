"""Calls of compiled kernels that happen again and again, with groups of arrays.

numba looks at the types of all arguments in every call from Python. That takes it 0.1 to 0.4 ms where groups
of arrays, NamedTuples, are among them (measured, numba 0.56): as much as many a kernel runs.
"""
from typing import Any, Callable


def direct(kernel: Any) -> Callable[..., Any]:
    """The compiled ``kernel`` without numba's look at the types of its arguments after the first call. They
    must not change from call to call: numba still refuses arrays of another dimension or size of item, but
    would misread others that are not contiguous."""
    entries: list = []

    def call(*arguments: Any) -> Any:
        if entries:
            return entries[0](*arguments)
        result = kernel(*arguments)
        types = tuple(kernel.typeof_pyval(argument) for argument in arguments)
        entries.append(kernel.overloads[types].entry_point if types in kernel.overloads else kernel)
        return result

    return call
