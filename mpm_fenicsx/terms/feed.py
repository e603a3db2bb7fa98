"""Material that comes in: points of an ``Inflow`` are made, layer by layer, upstream of its plane.

Behind the plane stands a column whose points move with the speed of the inflow, as all nodes that they reach
are held to it. Layer k of it comes through the plane while the flow travels from k s to (k + 1) s, with s
the spacing of the points along the flow; its volume is the discharge in that time, its depth what follows. It
is made as soon as the column, of a given length, has room for it, with the stress of its depth. So what is
beyond the plane is the integral of the discharge at any time, and nothing is deformed before it is there.
"""
import math
from dataclasses import replace

import numpy as np

from ..collective import total
from ..points.points import half_widths
from ..scene.bodies import Cloud
from ..scene.geostatic import at_rest
from ..scene.supports import Support

COLUMN = 2.0  # cells, its length
ROUND = 1e-9  # of a layer or a cell: less than that is round-off
NOTHING = 1e-12  # of a layer as deep as one point: less than that is no volume


def mean_half_widths(term, comm):
    """Of the points of a body at the start [m], shape (D,), see ``half_widths``. Collective."""
    return total(comm, half_widths(term.body, term.points.V0, term.part).sum(axis=0)) / term.total


class Feed:
    """Makes the points of an ``inflow`` by ``make``, with arguments as of ``BodyTerm``, for the ``term`` of
    its body. sizes: of a cell, and half of those of a point [m], shape (D,) both; gravity: [m/s^2], shape
    (D,). ``made``: number of layers so far; ``width`` [m]; ``spacing`` of the points along, deep and across
    [m]."""

    def __init__(self, inflow, term, make, sizes, gravity):
        self.inflow, self.term, self.made, self._make = inflow, term, 0, make
        h, half = sizes
        self._h = h
        self._gravity = gravity
        self.width = inflow.width or term.thickness
        self.flow = inflow.hydrograph(self.width)
        self._axes = inflow.axes
        self.spacings = 2.0 * np.sqrt(self._axes**2 @ half**2)
        self._reach = abs(self._axes) @ h  # of a cell, along the axes of the inlet
        self.length = inflow.length or COLUMN * self._reach[0]
        area = self.flow.discharge / np.where(self.flow.speed > 0.0, self.flow.speed, np.inf)
        self._deepest = float(area.max() / self.width)

    # ---------------------------------------------------------------- where it is

    def extent(self):
        """From where to where points of the column may be along the axes of the inlet [m], shape (D,)
        both."""
        D, half = len(self.inflow.at), 0.5 * self.width
        return np.array([-self.length, 0.0, -half][:D]), np.array([0.0, self._deepest, half][:D])

    def places(self):
        """Of the column, at most a cell apart [m], shape (n, D)."""
        lines = [np.linspace(low, high, 2 + int((high - low) / step))
                 for low, high, step in zip(*self.extent(), self._reach)]
        return np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1).reshape(-1, len(lines)) @ self._axes + (
            self.inflow.at)

    def _seen(self, x):
        """Places x [m], shape (n, D), from the inlet along its axes."""
        return (x - self.inflow.at) @ self._axes.T

    def check_inside(self, box, origin):
        """ValueError where the column is not inside the ``box`` of the grid; origin: see ``frame``."""
        inflow, slack = self.inflow, ROUND * self._h
        places = self.places()
        low, high = places.min(axis=0), places.max(axis=0)
        for axis in range(len(inflow.at)):
            if box.lower[axis] - slack[axis] <= low[axis] and high[axis] <= box.upper[axis] + slack[axis]:
                continue
            ends = f"from {low[axis] + origin[axis]:.6g} to {high[axis] + origin[axis]:.6g} m"
            grid = f"{box.lower[axis] + origin[axis]:.6g} to {box.upper[axis] + origin[axis]:.6g} m"
            what = ("its points come from a column upstream", "it is deep", "it is wide")[
                np.argmax(abs(self._axes[:, axis]))]
            raise ValueError(f"{inflow.name} does not fit into the grid: along {'xyz'[axis]} {what} {ends}, "
                             f"and the grid covers {grid}, move the inlet or enlarge the grid")

    def support(self):
        """What holds the nodes that points of the column reach, those of all cells that reach behind the
        plane: of a plane along nodes none beyond it."""
        low, high = self.extent()
        low, high = low - (1.0 - ROUND) * self._reach, high + (1.0 - ROUND) * self._reach

        def where(x):
            seen = self._seen(x)
            return ((seen >= low) & (seen <= high)).all(axis=1)

        return Support(where, "xyz"[:len(low)], lambda time: self._axes[0] * self._place(time),
                       self.inflow.name)

    def _place(self, time):
        """Of the column [m]: after the end it goes on until its last layer has left the plane's cells."""
        late = max(time - self.flow.times[-1], 0.0)
        return self.flow.travelled(time) + min(self.flow.speed[-1] * late, self.length)

    # ---------------------------------------------------------------- layers

    def due(self, time):
        """Numbers of the layers that have room at ``time`` [s] and are not made yet."""
        s, end = self.spacings[0], self.flow.travel[-1]
        room = (self.flow.travelled(time) + self.length) / s + ROUND
        last = math.floor(room)
        if end / s <= room:  # the last one is thinner
            last = math.ceil(end / s - ROUND)
        return range(self.made, last)

    def layer(self, number, time, first):
        """``Points`` of a layer at ``time`` [s], numbered from ``first`` on; None where it has no volume."""
        s, inflow, flow = self.spacings, self.inflow, self.flow
        begin, end = number * s[0], min((number + 1) * s[0], flow.travel[-1])
        volume = flow.discharged(flow.when(end)) - flow.discharged(flow.when(begin))
        depth = volume / (self.width * (end - begin))
        if depth <= NOTHING * s[1]:
            return None
        counts = [1, max(1, round(depth / s[1])), *(max(1, round(self.width / width)) for width in s[2:])]
        sizes = np.array([end - begin, depth, self.width])[:len(s)]
        D = len(s)
        places = np.stack(np.meshgrid(*[(np.arange(n) + 0.5) / n for n in counts], indexing="ij"),
                          axis=-1).reshape(-1, D) * sizes
        places[:, 0] = flow.travelled(time) - 0.5 * (begin + end)
        if D == 3:
            places[:, 2] -= 0.5 * self.width
        half = np.tile(self._turned(0.5 * sizes / counts), (len(places), 1))
        velocity = self._axes[0] * np.interp(time, flow.times, flow.speed)
        cloud = Cloud(places @ self._axes + inflow.at,
                      np.full(len(places), volume / len(places) / self.term.thickness), half)
        points = self._make(self._body(cloud, velocity, depth), first).points
        points.add(half=half)
        points.a[:] = self._axes[0] * flow.acceleration(time)
        return points

    def _turned(self, half):
        """Half-widths along the axes of the grid of points whose ones along those of the inlet are ``half``
        [m], shape (D,): of the ellipsoid in it, with the volume kept."""
        found = np.sqrt(half**2 @ self._axes**2)
        return found * (half.prod() / found.prod()) ** (1.0 / len(half))

    def _body(self, cloud, velocity, depth):
        """The body of a layer, with the stress of its depth."""
        record, stress = self.term.body, self.inflow.stress
        if "plastic" not in (record.law.state.names or ()):
            stress = None
        elif stress is None and self._axes[1] @ self._gravity < 0.0:
            stress = self._at_rest(depth, record)
        return replace(record, shape=cloud, cells=None, points=None, cell=None, velocity=tuple(velocity),
                       stress=stress)

    def _at_rest(self, depth, record):
        """``at_rest`` of a layer as deep as that [m], along the axes of the inlet, as tensors along those of
        the grid."""
        turned, D = np.eye(3), len(self._axes)
        turned[:D, :D] = self._axes
        along = at_rest(depth, record.rho, self._axes @ self._gravity, *ratio(self.inflow, record))
        return lambda x: np.einsum("ki,nkl,lj->nij", turned, along(self._seen(x)), turned)

    def upstream(self, first):
        """Volume of this rank's points from number ``first`` on that has not come through the plane [m^3]."""
        p, (low, high) = self.term.points, self.extent()
        seen = self._seen(p.x)
        low[0], high[0] = -np.inf, self.spacings[0]
        here = (p.gid >= first) & ((seen >= low - self._reach) & (seen <= high + self._reach)).all(axis=1)
        return float(p.V0[here] @ np.clip(0.5 - seen[here, 0] / self.spacings[0], 0.0, 1.0))


def ratio(inflow, record):
    """Arguments ``ratio`` and ``phi`` of ``at_rest`` for the law of the body ``record``."""
    p = record.law.params
    given = p.lam / (p.lam + 2.0 * p.mu) if inflow.ratio is None else inflow.ratio
    if "mohr_coulomb" not in record.law.name or p.S > 0.0 or p.N <= 1.0:
        return given, None
    return given, math.degrees(math.asin((p.N - 1.0) / (p.N + 1.0)))
