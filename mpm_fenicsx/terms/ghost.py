"""Ghost penalty on inertia, and on stiffness, for bodies whose rim would make them singular.

In a cell with one or two points the consistent mass has rank one or two, and soil that bears no stress adds
nothing. On facets between filled cells of which at least one is filled less than ``FULL`` the acceleration's
gradient is kept together (as on the mass of cut finite elements in Sticko, Ludvigsson & Kreiss 2020, doi
10.1007/s10444-020-09785-z):

    sum over facets of  GAMMA rho h^3 integral of [grad a . n] [grad w . n],

[.] being the jump over the facet: the inertia of fields that are linear, rigid motions among them, stays what
it is. Cells from which no chain of filled cells leads to a full one (drops, single fliers) get lumped
inertia.

On stiffness the same penalty acts on the displacement u over a step, with the weight STIFF GAMMA E h: a
viscosity that goes to zero with the step."""
import numpy as np

from ..collective import somewhere
from ..compiled import compiled
from ..grid.joined import join
from .filling import Filling

GAMMA = 0.1
STIFF = 1.0 / 3.0  # weight of the penalty on stiffness over that on inertia
FULL = 0.6  # of a cell's volume
LIGHT = 0.05  # of a full cell's mass, that of a node with hardly any
NEARLY_NONE = 1e-3  # the same, below which the penalty grows
# Than inertia, in load steps: with 3 a cantilever of coarse cells bends 2 % less, with 300 its rim creeps.
SOFTER = 30.0
GAUSS = 0.5 - 0.5 / np.sqrt(3.0), 0.5 + 0.5 / np.sqrt(3.0)


def local_facets(D, K):
    """Nodes of the facets of a cell, shape (facets, nodes of each)."""
    if K == D + 1:
        return np.array([[a for a in range(K) if a != b] for b in range(K)])
    return np.array([[a for a in range(K) if (a >> i) & 1 == side] for i in range(D) for side in (0, 1)])


@compiled
def add_residual(nodes, matrix, weight, a, R):
    """Add the penalty's force [N] to R for accelerations a [m/s^2], both (nodes, D); nodes: (facets, M),
    matrix: (facets, M, M), weight: (facets,)."""
    for f in range(len(nodes)):
        if weight[f] != 0.0:
            for p in range(nodes.shape[1]):
                for i in range(a.shape[1]):
                    s = 0.0
                    for q in range(nodes.shape[1]):
                        s += matrix[f, p, q] * a[nodes[f, q], i]
                    R[nodes[f, p], i] += weight[f] * s


class Facets:
    """Inner facets of a grid, each on the rank of one of its cells: ``cells`` (n, 2) on both sides, ``nodes``
    (n, M) of both, and ``matrix`` (n, M, M), the integral of the products of the jumps of the normal
    derivatives [m^(D-3)]. ``links`` (k, 2): the cells beside all facets that touch a cell of this rank;
    ``volume`` (m,) of the cells [m^D], ``filling``: how full they are, see there."""

    def __init__(self, background, shapes):
        """shapes: the kernel of that name, see ``shape``. Collective."""
        self._background, self._shapes, D = background, shapes, background.dim
        K = background.cells.shape[1]
        of_one = 1.0 / np.abs(np.linalg.det(background.maps.inverse)) / (1.0 if K == 2**D
                                                                         else [2.0, 6.0][D - 2])
        self.volume = np.broadcast_to(of_one, len(background.cells))
        local = local_facets(D, K)
        facets = background.cells[:, local].reshape(-1, local.shape[1])
        order = np.lexsort(np.sort(facets, axis=1).T)
        same = np.flatnonzero((np.diff(np.sort(facets[order], axis=1), axis=0) == 0).all(axis=1))
        first, second = order[same], order[same + 1]
        cells = np.column_stack([first, second]) // len(local)
        owned = cells < background.cells_owned
        self.links = cells[owned.any(axis=1)]
        number = background.original_cell[cells]  # the same on every rank
        mine = np.where(number[:, 0] < number[:, 1], owned[:, 0], owned[:, 1])
        self.cells, self._facet = cells[mine], facets[first[mine]]
        self.nodes, place = self._all_nodes(background.cells[self.cells])
        self.matrix, self.filling = self._integrate(place), Filling(background, self.volume)

    def _all_nodes(self, cells):
        """Nodes of both cells without repetition, shape (n, M), and the places of the cells' own among them;
        cells: (n, 2, K)."""
        n, _, K = cells.shape
        both = np.sort(cells.reshape(n, 2 * K), axis=1)
        new = np.column_stack([np.ones(n, bool), np.diff(both, axis=1) != 0])
        nodes = both[new].reshape(n, 2 * K - self._facet.shape[1])
        place = (nodes[:, None, None, :] == cells[..., None]).argmax(axis=-1)
        return nodes, place

    def within(self, active):
        """Mask of the facets between cells of the mask ``active``, shape (m,)."""
        return active[self.cells].all(axis=1)

    def _points(self):
        """Quadrature points [m], list of (n, D), and unit normals times the root of their weights, shape (n,
        D)."""
        x = self._background.x[self._facet]
        if x.shape[2] == 2:
            along = x[:, 1] - x[:, 0]
            normal, points = np.column_stack([-along[:, 1], along[:, 0]]), [x[:, 0] + s * along
                                                                            for s in GAUSS]
            area = np.linalg.norm(along, axis=1)
        else:
            first, second = x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]
            normal, triangle = np.cross(first, second), x.shape[1] == 3
            points = [x.mean(axis=1)] if triangle else [x[:, 0] + s * first + t * second for s in GAUSS
                                                        for t in GAUSS]
            area = np.linalg.norm(normal, axis=1) * (0.5 if triangle else 1.0)
        return points, normal / np.linalg.norm(normal, axis=1)[:, None] * np.sqrt(area / len(points))[:, None]

    def _integrate(self, place):
        b, n = self._background, len(self.cells)
        K, D = b.cells.shape[1], b.dim
        M = self.nodes.shape[1]
        matrix, N, G = np.zeros((n, M, M)), np.empty((n, K)), np.empty((n, D, K))
        points, normal = self._points()
        for x in points:
            jump = np.zeros(self.nodes.shape)
            for side, sign in ((0, 1.0), (1, -1.0)):
                cell = self.cells[:, side].astype(np.int32)
                self._shapes(cell, np.ascontiguousarray(x), b.maps, N, G)
                np.add.at(jump, (np.arange(n)[:, None], place[:, side]), sign * np.einsum("nik,ni->nk", G,
                                                                                          normal))
            matrix += jump[:, :, None] * jump[:, None, :]
        return matrix


class Ghost:
    """The penalty in the active cells as a term of a step, see ``grid_state``. ``cells``: on both sides of
    each facet, shape (facets, 2). After ``begin``, ``consistent`` is a mask over the grid's cells with
    consistent inertia, and ``weight`` that of each facet, shape (facets,), never changed in place."""

    def __init__(self, facets, active_cells, h, per_volume, inertia=True):
        """h: size of a cell [m]; per_volume: density [kg/m^D] of the lightest body, modulus [N/m^(D-1)] of
        the softest; inertia: whether there is a penalty on that."""
        inside = facets.within(active_cells.active)
        self._nodes, self._facets, self._comm = active_cells.nodes_of_facets, facets, active_cells.comm
        self.cells, self._matrix = facets.cells[inside], np.ascontiguousarray(facets.matrix[inside])
        density, modulus = per_volume
        self._scale = GAMMA * density * h**3
        self._of_a, self._stiffness = float(inertia), STIFF * modulus / (density * h**2)
        self.weight, self.of_u = np.zeros(len(self.cells)), 0.0

    def begin(self, grid, load=None, stiff=False):
        """Find the facets to penalise, with stiffness where it is to be ``stiff``; returns whether the
        penalty is another than before. There is no load. Collective."""
        fill = self._facets.filling(grid.bodies)
        beside = fill[self.cells]
        at_rim = (beside.min(axis=1) < FULL) & (beside > 0.0).all(axis=1)
        if self._facets.filling.smooth:  # the far corners of a cell that a domain just reaches have no mass
            at_rim &= grid.active[self._nodes].all(axis=1)
        weight = np.where(at_rim, self._scale, 0.0)
        of_u = self._stiffness if stiff else 0.0
        other = of_u != self.of_u or not np.array_equal(weight, self.weight)
        changed, self.weight, self.of_u = somewhere(self._comm, other)[0], weight, of_u
        self.consistent = self._anchored(fill)
        return changed

    def _anchored(self, fill):
        """Mask of the cells that are full or linked to a full one, shape (cells,). Rank by rank, until
        nothing more comes over a border."""
        n, links = len(fill), self._facets.links
        links = links[(fill[links] > 0.0).all(axis=1)]
        count, label = join(links[:, 0], links[:, 1], n)
        linked, more = fill >= FULL, True
        while more:
            anchored = np.zeros(count, bool)
            anchored[label[linked]] = True
            reached = self._facets.filling.with_ghosts(anchored[label])
            linked, more = reached, somewhere(self._comm, (reached != linked).any())[0]
        return linked

    def first_trial(self, grid, increment):
        """Nothing but the ``increment`` is needed for a tangent."""
        return increment

    def residual(self, grid, increment, R):
        """Add the forces for the accelerations of the increment to R [N], shape (nodes, D)."""
        kept = increment.a
        if self.of_u:
            kept = self._of_a * increment.a + self.of_u * increment.u
        elif not self._of_a:
            return increment
        add_residual(self._nodes, self._matrix, self.weight, kept, R)
        return increment

    def tangent(self, grid, increment):
        """Fill the facets' matrices [N/m], each direction on its own."""
        factor = self._of_a * increment.alpha + self.of_u  # d kept / du
        matrices = factor * self.weight[:, None, None] * self._matrix
        grid.active_cells.facet_matrices[:] = matrices[:, None]

    def finish(self, grid, increment, solution):
        """There are no points."""


class GhostStiffness(Ghost):
    """The same for load steps without inertia, on the displacement over the step instead of the acceleration
    (Coombs 2023, doi 10.1002/nme.7332), with the stiffness GAMMA E h / SOFTER in the place of GAMMA rho h^3,
    on facets between cells with mass at all nodes, at one of them hardly any. It is new in every step and
    remembers nothing."""

    def __init__(self, facets, active_cells, modulus, h):
        """modulus: of the softest body times its thickness [Pa m^(3-D)]; h: size of a cell [m]."""
        super().__init__(facets, active_cells, h, (modulus / (SOFTER * h**2), modulus))

    def begin(self, grid, load=None):
        """Find the facets to penalise; returns whether they are others than before. Collective."""
        mass = np.where(grid.active, grid.mass, np.inf)[self._nodes].min(axis=1, initial=np.inf)
        full = grid.full_mass
        penalised = (mass < LIGHT * full) & grid.active[self._nodes].all(axis=1)
        weight = np.where(penalised, self._scale * np.clip(NEARLY_NONE * full / mass, 1.0, SOFTER), 0.0)
        changed, self.weight = somewhere(self._comm, not np.array_equal(weight, self.weight))[0], weight
        return changed

    def residual(self, grid, increment, R):
        """Add the forces for the displacements of the increment to R [N], shape (nodes, D)."""
        return super().residual(grid, increment._replace(a=increment.u), R)

    def tangent(self, grid, increment):
        """Fill the facets' matrices [N/m], each direction on its own."""
        super().tangent(grid, increment._replace(alpha=1.0))
