"""How full the cells of a grid are: with the linear basis of the points in them, with a smooth basis of the
domains of the points, which reach into cells that hold no point and give their nodes mass."""
import numpy as np
from petsc4py import PETSc

from ..basis.smooth import StencilGrid, half_width
from ..compiled import specialise
from ..grid.active_cells import ghosted_vector
from ..grid.elements import around

TOUCHED = 1e-3  # a cell that the domains fill less is empty: they end at its edge, but for round-off
D = 2  # fixed by specialise
FOLLOWS = False  # whether domains follow the stretch


def share_out(cell, x, domain, F, V, grid: StencilGrid, neighbours, fill):
    """Add the volumes V [m^D], shape (n,), of points to the cells that their domains overlap, in proportion.

    cell, x, domain, F, grid: see ``smooth.shapes``; neighbours: (cells, 3^D) the cells around each, first
    direction fastest; fill: (cells,) [m^D].
    """
    h, corner = grid.h, grid.corner
    share = np.empty((D, 3))
    for p in range(len(cell)):
        c = cell[p]
        for i in range(D):
            half = half_width(p, i, x, domain, F, grid, D, FOLLOWS)
            s = x[p, i] - corner[c, 0, i]
            share[i, 0] = share[i, 2] = 0.0
            if half > s:
                share[i, 0] = (half - s) / (2.0 * half)
            if half > h[i] - s:
                share[i, 2] = (half - h[i] + s) / (2.0 * half)
            share[i, 1] = 1.0 - share[i, 0] - share[i, 2]
        for a in range(3**D):
            part = V[p] * share[0, a % 3] * share[1, (a // 3) % 3]
            if D == 3:
                part *= share[D - 1, a // 9]
            if part > 0.0:
                fill[neighbours[c, a]] += part


class Filling:
    """Of this rank's cells of ``background``, whose ``volume`` [m^D] is given; ``smooth``: so is the basis.
    Collective."""

    def __init__(self, background, volume):
        self._background, self._volume, self.smooth = background, volume, background.basis.smooth
        shared, self._values = background.comm.size > 1, None
        if shared:
            self._values = ghosted_vector(background.cell_numbering, background.comm)
        if self.smooth:
            counts = np.asarray(background.grid.cells)
            self._neighbours = around(counts, background.original_cell, 3)  # -1 where none is here
            self._share_out = specialise(share_out, D=background.dim, FOLLOWS=background.basis.follows)

    def __call__(self, bodies):
        """Volume of the points of ``bodies``, terms, in each cell over its own, shape (cells,)."""
        fill, background = np.zeros(len(self._volume)), self._background
        for body in bodies:
            p, V = body.points, body.points.V0 / body.thickness
            if self.smooth:
                grid = background.stencil_grid(background.cells)
                self._share_out(p.cell, p.x, p.domain, p.F, V, grid, self._neighbours, fill)
            else:
                fill += np.bincount(p.cell, V, len(fill))
        if self.smooth and self._values is not None:
            fill = self._to_owners(fill)
        fill /= self._volume
        return self.with_ghosts(np.where(fill < TOUCHED, 0.0, fill) if self.smooth else fill)

    def _to_owners(self, values):
        with self._values.localForm() as local:
            local.array_w[:] = values
        self._values.ghostUpdate(PETSc.InsertMode.ADD, PETSc.ScatterMode.REVERSE)
        with self._values.localForm() as local:
            return local.array_r.copy()

    def with_ghosts(self, values):
        """Values of this rank's cells, shape (m,), those of ghosts from the ranks that own them."""
        if self._values is None:
            return values
        self._values.array_w[:] = values[:self._background.cells_owned]
        self._values.ghostUpdate(PETSc.InsertMode.INSERT, PETSc.ScatterMode.FORWARD)
        with self._values.localForm() as local:
            return local.array_r.astype(values.dtype)
