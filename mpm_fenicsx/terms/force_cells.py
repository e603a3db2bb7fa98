"""The force cells of the named bodies of a scene, and what others do to them.

Material points have the number of their cell from the start on, and carry it along. A force on a point or a
boundary particle acts on its cell. Of two bodies in contact one has the springs at its points, see
``body_contact``: on it a force acts on the cell of the spring's point, on the other one on the cell that
gives most of the mass of the nodes on which the spring pulls, with its weights. Between two cells that is
where they meet, to a tenth of a cell of the grid."""
import numpy as np

from ..collective import together
from ..points.moments import wrenches
from ..scene.force_cells import names_of, numbers

TIE = 1e-9  # of the whole mass: of two cells that give as much the first one counts


class ForceCells:
    """Those of the ``bodies``, terms at the start. ``names``: of the cells of all bodies, by number; with any
    of them every material point has ``force_cell``, its number from 1 on, 0 in a body without a name. Raises
    ValueError for a name that is taken in the ``scene``, and for a named body into which material flows.
    Collective."""

    def __init__(self, bodies, scene, comm):
        self._bodies, self.names, self._first = bodies, [], []
        found = together(comm, lambda: [numbers(body.body, body.points.x) for body in bodies])
        for body, of_points in zip(bodies, found):
            self._first.append(len(self.names))
            if body.body.name is not None:
                of_all = np.concatenate(comm.allgather(np.unique(of_points)))
                self.names += names_of(body.body, of_all)
        for name in self.names:
            if name in scene.names or self.names.count(name) > 1:
                raise ValueError(f"{name!r} is the name of a body or of one of its force cells, and of "
                                 "another one or of a support, penalty, load or structure: give each its "
                                 "own, as forces are told by name")
        for body in (bodies[inflow.body].body for inflow in scene.inflows):
            if body.name is not None:
                raise ValueError(f"material flows into {body.name}, and force cells are those of the points "
                                 "at the start: give that body no name")
        for body, first, of_points in zip(bodies, self._first, found) if self.names else ():
            body.points.add(force_cell=self._of(body, first, of_points))

    @staticmethod
    def _of(body, first, number):
        return np.zeros_like(number) if body.body.name is None else 1 + first + number

    def mark(self, points, start):
        """Give boundary particles, ``points``, the ``force_cell`` of the body to which they belong; start:
        see ``start.Start``."""
        if not self.names:
            return
        owner, cell = start.body(points.x), np.zeros(len(points), np.int64)
        for n, (body, first) in enumerate(zip(self._bodies, self._first)):
            mine = owner == n
            cell[mine] = self._of(body, first, numbers(body.body, points.x[mine]))
        points.add(force_cell=cell)

    def touched(self, contact):
        """Whether the ``BodyContact`` is one of a named body."""
        fields = set(sum(contact.pairs, ()))
        return any(body.field in fields and body.body.name is not None for body in self._bodies)

    def add_contact(self, grid, contact, answer, places, rows):
        """Add what the springs of a ``BodyContact`` do by the ``answer`` to the ``rows`` of ``wrenches`` of
        the cells, shape (cells, …), at the ``places`` of the nodes, (nodes, D) [m]. Collective."""
        points, number, nodes, weights = contact.springs_now(grid)
        K = nodes.shape[1] // 2
        near = self._of_nodes(grid, contact, nodes[:, K:], -weights[:, K:])
        for cell, half in (points.force_cell[number], slice(K)), (near, slice(K, None)):
            at = np.einsum("mk,mki->mi", weights[:, half], places[nodes[:, half]])
            of_cell = wrenches(at, answer.force)
            of_cell[:, :places.shape[1]] *= weights[:, half].sum(axis=1)[:, None]
            add_by_cell(rows, cell, of_cell)

    def _of_nodes(self, grid, contact, nodes, weights):
        """Number of the cell of which ``nodes`` with these ``weights``, shape (m, K) each, have most, 0 of a
        body without a name, shape (m,). Collective."""
        fields = {other for _, other in contact.pairs}
        bodies = [body for body in self._bodies if body.field in fields]
        mass = np.zeros((len(grid.mass), 1 + len(self.names)))  # by cell, the first of bodies without a name
        for body in bodies:
            body.add_mass_by(body.points.force_cell, mass)
        grid.active_cells.accumulate(mass)
        shares = mass / np.maximum(mass.sum(axis=1), 1e-300)[:, None]
        of_springs = np.einsum("mk,mkc->mc", weights, shares[nodes])
        return np.argmax(of_springs >= of_springs.max(axis=1, initial=0.0)[:, None] - TIE, axis=1)


def add_by_cell(rows, cell, wrench):
    """Add each ``wrench``, shape (n, …), to the row of its ``cell``, (n,), if it has one."""
    np.add.at(rows, cell[cell > 0] - 1, wrench[cell > 0])
