"""What this machine can do on one core, and what share of it the kernels of a step reach.

Bandwidth: a triad, a = b + s c, on arrays that no cache holds; 32 bytes per entry, as ``a`` is fetched, too.
For the same reason what a kernel writes counts twice where it does not read it; no array counts more often.
Peak: products that are added, in registers, two independent chains of 32 on each number of an array. Both in
processor time, best of some. ``watch`` looks at the kernels of the body of a scene as it goes on; what they
do is counted by ``operations``.
"""
from time import process_time
from typing import NamedTuple

import numpy as np
import operations
from numba import njit

FAST = dict(error_model="numpy", fastmath={"contract"}, cache=True)
ENTRIES, LANES, TERMS = 1 << 23, 512, 32
CHOSEN = 64  # points for which operations are counted
KERNELS = {"shapes": "search", "to_grid": "to grid", "mean_changes": "residual, volumes of F-bar",
           "residual": "residual", "tangent": "tangent", "to_points": "to points"}


@njit(**FAST)
def triad(a, b, c, s):
    for i in range(len(a)):
        a[i] = b[i] + s * c[i]


@njit(**FAST)
def four(s, p, q):
    """Four times s = s p + q."""
    s = s * p + q
    s = s * p + q
    s = s * p + q
    return s * p + q


@njit(**FAST)
def sixteen(s, p, q):
    return four(four(four(four(s, p, q), p, q), p, q), p, q)


@njit(**FAST)
def lanes(x, y, p, q):
    """In a function of its own, as LLVM packs no loop that stands in another one here."""
    for i in range(len(x)):
        s, t = sixteen(x[i], p, q), sixteen(y[i], p, q)
        x[i] = sixteen(s, p, q)
        y[i] = sixteen(t, p, q)


@njit(**FAST)
def multiply_add(x, y, p, q, rounds):
    for _ in range(rounds):
        lanes(x, y, p, q)


def best(run, repeat=7):
    """Shortest processor time [s]."""
    run()
    times = []
    for _ in range(repeat):
        start = process_time()
        run()
        times.append(process_time() - start)
    return min(times)


class Machine(NamedTuple):
    """Of one core: ``bandwidth`` [B/s], ``peak`` [operations/s]."""

    bandwidth: float
    peak: float

    def shares(self, kernel):
        """Of the bandwidth and of the peak that a ``Kernel`` reaches, and of the smaller of both roofs."""
        memory = kernel.bytes / kernel.seconds / self.bandwidth
        arithmetic = kernel.operations / kernel.seconds / self.peak
        return memory, arithmetic, max(memory, arithmetic)


class Kernel(NamedTuple):
    """Of one point: ``seconds`` of the processor, ``bytes``, ``operations``."""

    name: str
    seconds: float
    bytes: float
    operations: float


def machine():
    """``Machine`` as measured now."""
    a, b, c = (np.full(ENTRIES, value) for value in (0.0, 1.0, 2.0))
    x, y, rounds = np.ones(LANES), np.ones(LANES), 8000
    return Machine(32 * ENTRIES / best(lambda: triad(a, b, c, 3.0)),
                   4 * TERMS * LANES * rounds / best(lambda: multiply_add(x, y, 0.999, 1e-3, rounds)))


class Watch:
    """A ``kernel``, its calls and their processor time [s], and its ``operations.Work``, as of its first."""

    def __init__(self, kernel):
        self.kernel, self.calls, self.seconds, self.work = kernel, 0, 0.0, None

    def __call__(self, *arguments):
        if self.work is None:
            n = len(arguments[0].element if hasattr(arguments[0], "element") else arguments[0])
            chosen = slice(0, n, max(n // CHOSEN, 1))
            self.work = operations.work(_dispatcher(self.kernel), arguments, n, chosen)
        start = process_time()
        found = self.kernel(*arguments)
        self.seconds += process_time() - start
        self.calls += 1
        return found


def _dispatcher(kernel):
    """What ``mpm_dem_direct.direct`` has been given."""
    names = getattr(kernel, "__closure__", None) and kernel.__code__.co_freevars
    return kernel.__closure__[names.index("kernel")].cell_contents if names else kernel


def watch(term):
    """``Watch`` by kernel, from now on, of a ``BodyTerm``."""
    watches = {}
    for owner in ("_on_points", "_kernels"):
        group = getattr(term, owner)
        chosen = {name: Watch(getattr(group, name)) for name in group._fields if name in KERNELS}
        setattr(term, owner, group._replace(**chosen))
        watches |= chosen
    return watches


def measured(watches, n):
    """A ``Kernel`` for each that was called, on ``n`` points."""
    return [Kernel(KERNELS[name], one.seconds / one.calls / n, one.work.read + one.work.written,
                   one.work.operations) for name, one in watches.items() if one.calls]
