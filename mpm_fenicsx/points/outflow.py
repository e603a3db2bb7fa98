"""Outflow: material that leaves the grid ends the run, is held at the edge at rest, or is removed.

A material point that is held or removed takes part no more. Its mass, momentum and energy are added up, so
that mass and momentum of what is left and of what has left are those at the start. Boundary particles are
never removed, since the interface keeps its numbers: they are held at the edge, at rest, and a load on them
reaches no node.
"""
import numpy as np

from mpm_dem_store import Table

from ..collective import somewhere
from ..errors import MPMError
from ..scene.bodies import AXES, Grid
from .columns import columns, from_columns
from .passed import Passed
from .points import Points

WAYS = ("stop", "hold", "remove")
BISECTIONS = 40  # to find an edge


def read_ways(outflow, dim):
    """Ways by axis and end, shape (dim, 2), of a word for all sides or a dict by side, such as {"+x":
    "remove"}, whose other sides stop. Raises ValueError for another word or side."""
    sides = [sign + axis for axis in AXES[:dim] for sign in "-+"]
    given = outflow if isinstance(outflow, dict) else dict.fromkeys(sides, outflow)
    for side, way in given.items():
        if side not in sides:
            raise ValueError(f"outflow has a side {side!r}: choose from {', '.join(sides)}")
        if way not in WAYS:
            raise ValueError(f"outflow is {way!r}{f' at {side}' if given is outflow else ''}: choose one of "
                             f"{', '.join(WAYS)}")
    return np.array([given.get(side, "stop") for side in sides]).reshape(dim, 2)


class Outflow:
    """Holds or removes what leaves the ``grid`` by the ``ways`` of ``read_ways``. ``active``: something may
    leave without an end of the run; ``removed``: sums of what has been held or removed since the start, the
    same on every rank; ``held``: the material points of this rank that are held, one ``Points`` for each
    body."""

    def __init__(self, ways, grid, comm, gravity, inside=False):
        """gravity: [m/s^2], shape (D,); inside: material may leave within the grid, too, see ``outlets``."""
        self._ways, self._grid, self._box, self._comm, self._gravity = ways, grid, grid.box, comm, gravity
        self.active = inside or bool((ways != "stop").any())
        self.held, self.books = [], ()  # whose ``leave`` is told of a body and its points that leave
        self._passed = Passed(gravity, comm)

    @property
    def removed(self):
        """See ``Passed.by_name``."""
        return self._passed.by_name()

    def _way(self, points):
        """What happens to each point that is outside the grid, shape (n,): by the side beyond which it is
        farthest, or of a grid with holes to which it flies."""
        low, high = np.asarray(self._box.lower) - points.x, points.x - np.asarray(self._box.upper)
        beyond = np.stack([low, high], axis=2).reshape(len(points), self._ways.size)
        flight = np.stack([-points.v, points.v], axis=2).reshape(len(points), self._ways.size)
        side = np.argmax(np.where(beyond.max(axis=1, keepdims=True) > 0.0, beyond, flight), axis=1)
        return np.where(np.isfinite(points.x).all(axis=1), self._ways.ravel()[side], "stop")

    def of_material(self, body):
        """For ``sets.Set``: what becomes of points of ``body`` without a rank. None: they end the run."""
        if not self.active:
            return None
        points, held = body.points, Points(**{name: values[:0]
                                              for name, values in body.points.copy().items()})
        self.held.append(held)

        def leave(rank, number, search):
            """Rank and number of the points that stay. Collective."""
            way = np.where(rank < 0, self._way(points), "stay")
            goes = (way == "hold") | (way == "remove")
            self.add_up(body, np.flatnonzero(goes))
            self._hold(points, held, way == "hold")
            points.take(~goes)
            return rank[~goes], number[~goes]

        return leave

    def add_up(self, body, chosen):
        """Add the ``chosen`` points to the sums of what has left."""
        self._passed.add(body, chosen)
        for book in self.books:
            book.leave(body, chosen, self._gravity)

    def _hold(self, points, held, mask):
        """Add the points of the ``mask`` to those ``held``, on the edge and at rest."""
        order = np.argsort(np.concatenate([held.gid, points.gid[mask]]))
        for name in held.names:
            both = np.concatenate([getattr(held, name), getattr(points, name)[mask]])
            setattr(held, name, both[order])
        held.cell[:] = 0  # they are in none
        np.clip(held.x, self._box.lower, self._box.upper, out=held.x)
        for name in {"v", "a", "B", "C"} & set(held.names):
            getattr(held, name)[:] = 0.0

    def of_boundary(self, points):
        """The same for boundary particles, which get a field ``off``: they are at the edge for good."""
        if not self.active:
            return None
        points.names = (*points.names, "off")
        points.off = np.zeros(len(points), np.bool_)

        def leave(rank, number, search):
            outside = np.flatnonzero((rank < 0) & (self._way(points) != "stop"))
            everybody = self._comm.allgather(points.x[outside])
            field = self._comm.allgather(np.broadcast_to(points.field, len(points))[outside])
            start = sum(map(len, everybody[:self._comm.rank]))
            mine, x = slice(start, start + len(outside)), edge(self._grid, np.concatenate(everybody), search)
            points.x[outside] = x[mine]
            rank[outside], number[outside] = (
                found[mine] for found in search.assign(x, np.concatenate(field)))
            switch_off(points, outside)
            return rank, number

        return leave

    def first_lost(self, points, N):
        """Boundary particles without a node of mass, in cells with basis values N, shape (n, K): once
        material has left they are switched off, too. Returns the first that has lost its material otherwise,
        or -1. Collective."""
        lost = ~points.off & (N.sum(axis=1) == 0.0)
        if self._passed.count and somewhere(self._comm, lost.any())[0]:
            switch_off(points, np.flatnonzero(lost))
            lost[:] = False
        N[points.off] = 0.0
        return int(np.argmax(lost)) if lost.any() else -1

    def check_left(self, count, time):
        """MPMError when of ``count`` points none is left."""
        if count <= self._passed.count:
            raise MPMError(f"all {count} material points have left the grid at t = {time:.6g} s: enlarge it, "
                           "or end the run earlier")

    def get_checkpoint(self):
        """The same as numbers, and a ``Table`` of those held of each body."""
        return {"removed": self._passed.values.copy(),
                "held": {str(n): Table(columns(points), points.gid) for n, points in enumerate(self.held)}}

    def set_checkpoint(self, tree):
        """Go back to what ``get_checkpoint`` gave; who is held is shared out as it comes."""
        self._passed.values = tree["removed"].copy()
        for n, points in enumerate(self.held):
            points.restore(from_columns(points, tree["held"][str(n)].fields))

    def get_state(self):
        """As name → array copy."""
        held = {f"held{n or ''}.{name}": values for n, points in enumerate(self.held)
                for name, values in points.copy().items()}
        return {"removed": self._passed.values.copy(), **held} if self.active else {}

    def set_state(self, state):
        """Go back to what ``get_state`` gave."""
        if self.active:
            self._passed.values = state["removed"].copy()
            for n, points in enumerate(self.held):
                points.restore({name: state[f"held{n or ''}.{name}"] for name in points.names})


def edge(grid, x, search):
    """Places where straight lines from the middles of the nearest cells to x [m], shape (n, D), leave the
    grid; x: the same on every rank. Collective."""
    if isinstance(grid, Grid):
        return np.clip(x, grid.box.lower, grid.box.upper)
    from scipy.spatial import cKDTree  # takes time to import, and few scenes need it

    middles = search.middles()
    inside, outside = middles[cKDTree(middles).query(x)[1]] if len(x) else x.copy(), x.copy()
    for _ in range(BISECTIONS):
        middle = 0.5 * (inside + outside)
        there = search.assign(middle)[0] >= 0
        inside[there], outside[~there] = middle[there], middle[~there]
    return inside


def switch_off(points, index):
    """Boundary particles at the edge for good: at rest, and no more loads."""
    points.off[index] = True
    points.v[index], points.a[index] = 0.0, 0.0
