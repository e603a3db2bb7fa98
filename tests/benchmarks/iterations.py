"""Iterations of linear solvers as the grid is refined, with nearly empty cells: a table of docs/solvers.md.

    ./dev run python tests/benchmarks/iterations.py [cells=4,8,16,32] [limits=1,10,100] [solvers=...]

An elastic cube in space, lumped inertia, lies across its grid so that points at three of its sides are a
twentieth of a cell deep in theirs. One tangent is made with a time step of so many explicit limits, h
over the speed of pressure waves, and a system with a random right-hand side is solved to 1e-8 by
conjugate gradients. The number of iterations is followed by processor time, set-up and all iterations
[ms].
"""
import sys
from time import process_time

import petsc4py

petsc4py.init(sys.argv[:1])
import numpy as np  # noqa: E402
from petsc4py import PETSc  # noqa: E402

from mpm_fenicsx import MPM, Body, Box, Grid, Numerics, neo_hooke  # noqa: E402
from mpm_fenicsx.solve import solvers  # noqa: E402

WORDS = dict(word.split("=", 1) for word in sys.argv[1:])
SOLVERS = {"jacobi": "jacobi", "icc": "cg", "multigrid": "multigrid", "gamg": "gamg", "hypre": "hypre"}
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


def solve(matrix, name, nodes):
    """Iterations and processor time [s] of one solution."""
    ksp = PETSc.KSP().create(matrix.comm)
    ksp.setOptionsPrefix(f"try_{name}_")
    ksp.setOperators(matrix)
    start = process_time()
    solvers.configure(ksp, ksp.getOptionsPrefix(), SOLVERS[name], nodes, True)
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
        rows = {name: [] for name in WORDS.get("solvers", ",".join(SOLVERS)).split(",")}
        for n in cells:
            solid = tangent(n, limits)
            step = solid.step
            for name, row in rows.items():
                count, seconds = solve(step.active_cells.matrix, name, step.newton._nodes)
                row.append(f"{'no solution' if count is None else count}, {1e3 * seconds:.0f} ms")
        for name, row in rows.items():
            print(f"| {limits:g} | {name} | " + " | ".join(row) + " |", flush=True)


if __name__ == "__main__":
    main()
