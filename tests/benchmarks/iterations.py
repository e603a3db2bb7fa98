"""Iterations of linear solvers as the grid is refined, with nearly empty cells: a table of docs/solvers.md.

    ./dev run python tests/benchmarks/iterations.py [cells=4,8,16,32] [limits=1,10,100]

An elastic cube in space, lumped inertia, lies across its grid so that points at three of its sides are a
twentieth of a cell deep in theirs. One tangent is made with a time step of so many explicit limits, h
over the speed of pressure waves, and a system with a random right-hand side is solved to 1e-8 by
conjugate gradients. The number of iterations is followed by processor time, set-up and all iterations
[ms].

"geometric" is multigrid on grids of twice, four times ... the cells, with trilinear interpolation between
them, Galerkin's matrices and the smoother of the preset gamg. It is no preset: see docs/solvers.md.
"""
import sys
from itertools import product
from time import process_time

import petsc4py

petsc4py.init(sys.argv[:1])
import numpy as np  # noqa: E402
from petsc4py import PETSc  # noqa: E402
from scipy import sparse  # noqa: E402

from mpm_fenicsx import MPM, Body, Box, Grid, Numerics, neo_hooke  # noqa: E402
from mpm_fenicsx.solve import solvers  # noqa: E402

WORDS = dict(word.split("=", 1) for word in sys.argv[1:])
SOLVERS = {"jacobi": "jacobi", "icc": "cg", "gamg": "gamg", "hypre": "hypre", "geometric": None}
COARSEST = 100  # nodes, of which a grid is coarse enough
E, NU, RHO, OFFSET = 1e6, 0.3, 1600.0, 0.3  # OFFSET: of the cube in the grid, in cells


def tangent(n, limits):
    """An MPM with the tangent of a step in its matrix; n: cells along the cube of 1 m."""
    h, law = 1.0 / n, neo_hooke(E, NU)
    low, high = OFFSET * h, 1.0 + OFFSET * h
    body = Body(Box((low,) * 3, (high,) * 3), (n,) * 3, 2, law, RHO)
    grid = Grid(Box((-h,) * 3, (1.0 + 2 * h,) * 3), (n + 3,) * 3)
    solid = MPM(grid, body, gravity=(0.0, -9.81, 0.0), inertia="lumped", numerics=Numerics(solver="cg"))
    speed = ((law.params.lam + 2 * law.params.mu) / RHO) ** 0.5
    solid.advance(limits * h / speed)
    return solid


def interpolations(places, h, free):
    """From each grid to the one with half its cells, from the finest on: matrices (nodes, coarse nodes),
    trilinear. places: of the finest nodes [m], shape (n, 3), h apart; those that are not ``free``, a mask,
    take no part."""
    at, found = np.rint((places - places.min(axis=0)) / h).astype(int), []
    while len(at) > COARSEST:
        # (i + 0) // 2 and (i + 1) // 2 are the nodes on both sides of an odd i, and twice that at an even one
        parents = np.concatenate([(at + side) // 2 for side in product((0, 1), repeat=3)])
        coarse, column = np.unique(parents, axis=0, return_inverse=True)
        weights, rows = np.tile(free / 8.0, 8), np.tile(np.arange(len(at)), 8)
        matrix = sparse.coo_matrix((weights, (rows, column.ravel()))).tocsc()
        used = np.flatnonzero(matrix.sum(axis=0))
        found.append(matrix[:, used].tocsr())
        at, free = coarse[used], np.ones(len(used), bool)
    return found


def set_geometric(ksp, matrix, places, h):
    """Multigrid with these grids in the ``ksp``."""
    start, columns, values = matrix.getValuesCSR()
    rows = sparse.csr_matrix((values, columns, start))
    alone = abs(rows).sum(axis=1).A1 == abs(rows.diagonal())
    steps = interpolations(places, h, ~alone.reshape(-1, 3).any(axis=1))
    options, pc = PETSc.Options(ksp.getOptionsPrefix()), ksp.getPC()
    for name, value in dict(pc_mg_galerkin="both", mg_levels_ksp_type="chebyshev",
                            mg_levels_pc_type="bjacobi", mg_levels_sub_pc_type="icc").items():
        options[name] = value
    ksp.setType("cg")
    pc.setType("mg")
    pc.setMGLevels(len(steps) + 1)
    for level, step in zip(range(len(steps), 0, -1), steps):
        whole = sparse.kron(step, sparse.identity(3)).tocsr()
        pc.setMGInterpolation(level, PETSc.Mat().createAIJ(
            whole.shape, csr=(whole.indptr, whole.indices, whole.data), comm=matrix.comm))


def solve(matrix, name, places, h):
    """Iterations and processor time [s] of one solution."""
    ksp = PETSc.KSP().create(matrix.comm)
    ksp.setOptionsPrefix(f"try_{name}_")
    ksp.setOperators(matrix)
    start = process_time()
    if name == "geometric":
        set_geometric(ksp, matrix, places, h)
    else:
        solvers.configure(ksp, ksp.getOptionsPrefix(), SOLVERS[name], places, True)
    ksp.setTolerances(rtol=1e-8, max_it=5000)
    ksp.setFromOptions()
    b, x = matrix.createVecRight(), matrix.createVecRight()
    b.array_w[:] = np.random.default_rng(0).standard_normal(b.getLocalSize())
    ksp.solve(b, x)
    return ksp.getIterationNumber() if ksp.getConvergedReason() > 0 else None, process_time() - start


def main():
    """Print the table."""
    cells = [int(text) for text in WORDS.get("cells", "4,8,16,32").split(",")]
    print("| dt / limit | " + " | ".join(["solver", *(f"h = 1/{n}" for n in cells)]) + " |")
    print("| --- " * (2 + len(cells)) + "|")
    for limits in (float(text) for text in WORDS.get("limits", "1,10,100").split(",")):
        rows = {name: [] for name in SOLVERS}
        for n in cells:
            solid = tangent(n, limits)
            step = solid.step
            for name, row in rows.items():
                count, seconds = solve(step.active_cells.matrix, name, step.newton._coordinates, 1.0 / n)
                row.append(f"{'no solution' if count is None else count}, {1e3 * seconds:.0f} ms")
        for name, row in rows.items():
            print(f"| {limits:g} | {name} | " + " | ".join(row) + " |", flush=True)


if __name__ == "__main__":
    main()
