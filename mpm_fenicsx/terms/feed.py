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

from ..points.points import half_widths
from ..scene.bodies import Cloud, Support
from ..scene.geostatic import at_rest

COLUMN = 2.0  # cells, its length
ROUND = 1e-9  # of a layer or a cell: less than that is round-off
NOTHING = 1e-12  # of a layer as deep as one point: less than that is no volume


class Feed:
    """Makes the points of an ``inflow`` by ``make``, with arguments as of ``BodyTerm``, for the ``term`` of
    its body. h: size of a cell [m], shape (D,); gravity: [m/s^2], shape (D,). ``made``: number of layers so
    far; ``width`` [m]; ``spacing`` of the points along, deep and across [m]."""

    def __init__(self, inflow, term, make, h, gravity):
        self.inflow, self.term, self.made, self._make, self._h = inflow, term, 0, make, h
        self._gravity = gravity
        self.width = inflow.width or term.thickness
        self.flow = inflow.hydrograph(self.width)
        self.spacings = 2.0 * half_widths(term.body, term.points.V0).mean(axis=0)[list(inflow.axes)]
        self.length = inflow.length or COLUMN * h[inflow.axes[0]]
        area = self.flow.discharge / np.where(self.flow.speed > 0.0, self.flow.speed, np.inf)
        self._deepest = float(area.max() / self.width)

    # ---------------------------------------------------------------- where it is

    def box(self):
        """Lower and upper corner of what may hold points of the column [m]."""
        inflow = self.inflow
        low, high = inflow.at.copy(), inflow.at.copy()
        (low if inflow.sign > 0 else high)[inflow.axes[0]] -= inflow.sign * self.length
        high[inflow.axes[1]] += self._deepest
        for axis in inflow.axes[2:]:
            low[axis], high[axis] = low[axis] - 0.5 * self.width, high[axis] + 0.5 * self.width
        return low, high

    def check_inside(self, box, origin):
        """ValueError where the column is not inside the ``box`` of the grid; origin: see ``frame``."""
        (low, high), inflow = self.box(), self.inflow
        slack = ROUND * self._h
        for axis in range(len(inflow.at)):
            if box.lower[axis] - slack[axis] <= low[axis] and high[axis] <= box.upper[axis] + slack[axis]:
                continue
            ends = f"from {low[axis] + origin[axis]:.6g} to {high[axis] + origin[axis]:.6g} m"
            grid = f"{box.lower[axis] + origin[axis]:.6g} to {box.upper[axis] + origin[axis]:.6g} m"
            what = ("its points come from a column upstream", "it is deep", "it is wide")[
                inflow.axes.index(axis)]
            raise ValueError(f"{inflow.name} does not fit into the grid: along {'xyz'[axis]} {what} {ends}, "
                             f"and the grid covers {grid}, move the inlet or enlarge the grid")

    def support(self):
        """What holds the nodes that points of the column reach, from the plane upstream."""
        (low, high), along = self.box(), self.inflow.axes[0]
        reach = (1.0 - ROUND) * self._h
        low, high = low - reach, high + reach
        (high if self.inflow.sign > 0 else low)[along] = self.inflow.at[along] + (
            self.inflow.sign * ROUND * self._h[along])
        way = np.eye(len(low))[along] * self.inflow.sign
        return Support(lambda x: ((x >= low) & (x <= high)).all(axis=1), "xyz"[:len(low)],
                       lambda time: way * self._place(time), self.inflow.name)

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
        D, axes = len(s), list(inflow.axes)
        places = np.stack(np.meshgrid(*[(np.arange(n) + 0.5) / n for n in counts], indexing="ij"),
                          axis=-1).reshape(-1, D) * sizes
        places[:, 0] = inflow.sign * (flow.travelled(time) - 0.5 * (begin + end))
        if D == 3:
            places[:, 2] -= 0.5 * self.width
        x, half, velocity = np.empty_like(places), np.empty_like(places), np.zeros(D)
        x[:, axes], half[:, axes] = places, 0.5 * sizes / counts
        velocity[axes[0]] = inflow.sign * np.interp(time, flow.times, flow.speed)
        cloud = Cloud(x + inflow.at, np.full(len(x), volume / len(x) / self.term.thickness), half)
        points = self._make(self._body(cloud, velocity, depth), first).points
        points.add(half=half)
        points.a[:] = 0.0
        points.a[:, axes[0]] = inflow.sign * flow.acceleration(time)
        return points

    def _body(self, cloud, velocity, depth):
        """The body of a layer, with the stress of its depth."""
        record, stress = self.term.body, self.inflow.stress
        if "plastic" not in (record.law.state.names or ()):
            stress = None
        elif stress is None and self.inflow.axes[1] == 1 and self._gravity[1] < 0.0:
            stress = at_rest(self.inflow.at[1] + depth, record.rho, self._gravity,
                             *ratio(self.inflow, record))
        return replace(record, shape=cloud, cells=None, points=None, cell=None, velocity=tuple(velocity),
                       stress=stress)

    def upstream(self, first):
        """Volume of this rank's points from number ``first`` on that has not come through the plane [m^3]."""
        p, (low, high), along = self.term.points, self.box(), self.inflow.axes[0]
        past = self.inflow.sign * (p.x[:, along] - self.inflow.at[along]) / self.spacings[0]
        (low if self.inflow.sign > 0 else high)[along] = -self.inflow.sign * np.inf
        (high if self.inflow.sign > 0 else low)[along] += self.inflow.sign * self.spacings[0]
        here = (p.gid >= first) & ((p.x >= low - self._h) & (p.x <= high + self._h)).all(axis=1)
        return float(p.V0[here] @ np.clip(0.5 - past[here], 0.0, 1.0))


def ratio(inflow, record):
    """Arguments ``ratio`` and ``phi`` of ``at_rest`` for the law of the body ``record``."""
    p = record.law.params
    given = p.lam / (p.lam + 2.0 * p.mu) if inflow.ratio is None else inflow.ratio
    if record.law.name != "mohr_coulomb" or p.S > 0.0 or p.N <= 1.0:
        return given, None
    return given, math.degrees(math.asin((p.N - 1.0) / (p.N + 1.0)))
