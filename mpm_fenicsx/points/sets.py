"""All points of a scene together: they find their cells, travel between ranks, and are the state."""
from typing import Callable, NamedTuple, Optional

import numpy as np

from ..collective import somewhere, total
from ..errors import MPMError
from .columns import columns, from_columns
from .points import Points


class Set(NamedTuple):
    """Points with their name in the state; active: the cells that they are in are active; moves: they can
    change cells; leave: what becomes of those that left the grid, see ``outflow``, None: they end the run."""

    name: str
    points: Points
    active: bool = True
    moves: bool = True
    leave: Optional[Callable] = None


class Sets:
    """The ``Set`` records of a scene; names of material points start with "points". origin: of their
    coordinates, see ``frame``. All methods but ``filled`` and the state's are collective."""

    def __init__(self, comm, sets, origin):
        self._comm, self._sets, self._origin = comm, tuple(sets), origin

    def locate(self, search, row, router, time):
        """Phase I: cell of every point; points travel to the rank of their cell. row: of each local cell in
        the element matrices, -1 where it is inactive. Returns whether any point travelled, and whether any is
        in an inactive cell."""
        anywhere = row if all(s.active for s in self._sets) else np.zeros_like(row)
        moving = [(s, row if s.active else anywhere) for s in self._sets if s.moves]
        leaving, inactive = np.array([search.locate(s.points, rows) for s, rows in moving]).T
        flags = somewhere(self._comm, *leaving, inactive.max())
        for (s, rows), somebody in zip(moving, flags):
            if somebody:
                self._send(s, search.destinations(s.points), search, router, time)
                flags[-1] |= somewhere(self._comm, (rows[s.points.cell] < 0).any())[0]
        return flags[:-1].any(), bool(flags[-1])

    def relocate(self, search, router, time):
        """Cells and ranks on another distribution of the grid."""
        for s in self._sets:
            self._send(s, search.relocate(s.points), search, router, time)

    def _send(self, s, destinations, search, router, time):
        (rank, number), points = destinations, s.points
        if s.leave is not None:
            rank, number = s.leave(rank, number, search)
        self._raise_if_outside(points, rank, time)
        points.cell[:] = search.local(points.migrate(router, rank, number))

    def _raise_if_outside(self, points, rank, time):
        """Name the first point that left the grid, on all ranks alike."""
        found = [(int(points.gid[p]), (points.x[p] + self._origin).tolist())
                 for p in np.flatnonzero(rank < 0)[:1]]
        found = sum(self._comm.allgather(found), [])
        if found:
            number, x = min(found)
            material = any(points is s.points and s.name.startswith("points") for s in self._sets)
            kind = "material point" if material else "boundary particle"
            raise MPMError(f"{kind} {number} left the grid at x = {x} m, t = {time:.6g} s: enlarge the grid, "
                           "or look for the cause in an unstable step")

    def places(self):
        """Of all points of this rank that need cells [m], shape (n, D)."""
        return np.concatenate([s.points.x for s in self._sets])

    def all_in(self, hold):
        """Whether ``hold``, a function of places [m], shape (n, D), is true of all points of this rank."""
        return all(hold(s.points.x) for s in self._sets)

    def names(self):
        """Name of each set, with the number of its points. Collective."""
        return [(s.name, int(total(self._comm, len(s.points)))) for s in self._sets]

    def filled(self):
        """Cells of this rank that make cells active: they and their neighbours take part in a step."""
        return np.unique(np.concatenate([s.points.cell for s in self._sets if s.active]))

    def stop(self):
        """All points are at rest, and stay so as far as they know."""
        for s in self._sets:
            for name in {"v", "a", "B", "C"} & set(s.points.names):
                getattr(s.points, name)[:] = 0.0

    def get_checkpoint(self, numbered):
        """A ``Table`` of each set by name. numbered: see ``numbered.Numbered``."""
        return {s.name: numbered.points(columns(s.points)) for s in self._sets}

    def set_checkpoint(self, tree, numbered):
        """Go back to what ``get_checkpoint`` gave, on this distribution of the grid. Collective."""
        for s in self._sets:
            s.points.restore(from_columns(s.points, numbered.take_points(tree[s.name])))

    def get_state(self):
        """Fields of this rank's points as name → array copy."""
        return {f"{s.name}.{field}": values for s in self._sets for field, values in s.points.copy().items()}

    def set_state(self, state):
        """Go back to what ``get_state`` gave."""
        for s in self._sets:
            s.points.restore({field: state[f"{s.name}.{field}"] for field in s.points.names})
