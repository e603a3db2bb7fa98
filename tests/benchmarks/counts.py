"""What a step of the MPM sends and keeps, counted, beside the formulas of docs/cost_model.md.

    ./dev run mpirun --oversubscribe -n 4 python tests/benchmarks/counts.py [dim=3] [cells=12] [cg=1] [new=1]

An elastic block of ``cells`` cells per direction, 2 points per direction in each, with an interface on top,
on which a force acts; cg: conjugate gradients; new: a new tangent in every iteration. Counts do not depend on
how many ranks share a processor. Messages and bytes are those that PETSc sends in a step, of the rank with
most; beside them what the formula makes of that rank's nodes and neighbours.
"""
import ctypes
import sys
from typing import NamedTuple

import numpy as np
from mpi4py import MPI

WORDS = dict(word.split("=") for word in sys.argv[1:] if "=" in word)
OPTIONS = {"cg": ["-mpm_ksp_type", "cg", "-mpm_pc_type", "bjacobi", "-mpm_ksp_rtol", "1e-8"],
           "new": ["-mpm_snes_lag_jacobian", "1"]}
if WORDS:
    sys.argv[1:] = [option for word in WORDS for option in OPTIONS.get(word, [])]

from mpm_fenicsx import MPM, Body, Box, Grid, Interface, linear  # noqa: E402, I001 - it reads the options
from petsc4py import PETSc  # noqa: E402

H, STEPS = 0.1, 5
_petsc = ctypes.CDLL(PETSc.__file__)


class Calls(dict):
    """How often collective methods of communicators are called, by name, while it is entered."""

    def __enter__(self):
        sys.setprofile(self._see)
        return self

    def __exit__(self, *_):
        sys.setprofile(None)

    def _see(self, _, event, called):
        if event == "c_call" and isinstance(getattr(called, "__self__", None), MPI.Comm):
            name = called.__name__
            if name[0].isupper() or name in ("allreduce", "allgather"):
                self[name] = self.get(name, 0) + 1


class Shared(NamedTuple):
    """Nodes of other ranks that this one has, copies of its own on others; ranks that it has nodes of, and
    that have its own."""

    ghosts: int
    copies: int
    up: int
    down: int


def made(dim, n):
    """The scene, and forces on its boundary particles."""
    body = Body(Box((0.0,) * dim, (n * H,) * dim), (n,) * dim, 2, linear(1e6, 0.3), 1000.0)
    grid = Grid(Box((-2 * H,) * dim, ((n + 2) * H,) * dim), (n + 4,) * dim)
    top = Interface.top(body.box, n if dim == 2 else (n, n))
    gravity, force = np.zeros(dim), np.zeros((len(top.x), dim))
    gravity[1], force[:, 1] = -9.81, -1.0
    return MPM(grid, body, interface=top, gravity=gravity), force


def shared(solid):
    """``Shared`` nodes of this rank."""
    cells, comm = solid.step.active_cells, MPI.COMM_WORLD
    ghosts, ends = cells.number[cells.owned:], np.cumsum(comm.allgather(cells.owned))
    to = np.bincount(np.searchsorted(ends, ghosts, side="right"), minlength=comm.size)
    back = np.array(comm.alltoall(to.tolist()))
    return Shared(int(to.sum()), int(back.sum()), np.count_nonzero(to), np.count_nonzero(back))


def formulas(at, dim, iterations):
    """Messages and bytes of a step by phase, of a rank with the nodes ``at``, see ``Shared``."""
    both, each_way = (at.up + at.down, 8 * (at.ghosts + at.copies)), (at.down, 8 * at.copies)
    evaluations = iterations + 1
    return {"to grid": (2 * both[0], (1 + 2 * dim + dim) * both[1]),  # mass, v, a; the force
            "residual": (evaluations * (both[0] + each_way[0]), evaluations * dim * (both[1] + each_way[1])),
            "new tangent": (at.up, 8 * at.ghosts * 2 * 3**(dim - 1) * dim**2)}


class Counts(NamedTuple):
    """Of a step: ``traffic``, phase → messages and bytes of this rank; numbers of Newton iterations, of those
    of the linear solver, of PETSc's reductions and of other collective calls by name."""

    traffic: dict
    iterations: float
    linear: float
    reductions: float
    calls: dict


def reductions():
    """Those of PETSc so far."""
    return ctypes.c_double.in_dll(_petsc, "petsc_allreduce_ct").value


def counted(solid, force):
    """``Counts`` of the mean step."""
    solid.advance(1e-3, force)
    for sums in solid.step.clock.traffic.values():
        sums[:] = 0.0
    before, iterations, linear = reductions(), 0, 0
    with Calls() as calls:
        for _ in range(STEPS):
            solid.advance(1e-3, force)
            iterations += solid.iterations
            linear += solid.step.newton.snes.getLinearSolveIterations()
    return Counts({name: sums / STEPS for name, sums in solid.step.clock.traffic.items()}, iterations / STEPS,
                  linear / STEPS, (reductions() - before) / STEPS,
                  {name: count / STEPS for name, count in calls.items()})


def bytes_of_points(body):
    """Of one point: its fields, these and work arrays, and what travels when it crosses to another rank."""
    p = body.points
    kept = sum(getattr(p, name).nbytes for name in p.names)
    work = sum(a.nbytes for a in (body._N, body._G, body._element, *body._new))
    return kept / len(p), (kept + work) / len(p), p.record().itemsize


def main(dim=3, n=12):
    """Print the counts of the rank that sends most."""
    comm, (solid, force) = MPI.COMM_WORLD, made(dim, n)
    found, at, body = counted(solid, force), shared(solid), solid.bodies[0]
    mine = found, at, formulas(at, dim, found.iterations), bytes_of_points(body)
    everybody = comm.gather(mine)
    got = comm.allreduce(solid.exchanged, MPI.MAX) / solid.steps
    if comm.rank == 0:
        found, at, expected, sizes = max(
            everybody, key=lambda one: sum(v[1] for v in one[0].traffic.values()))
        print(f"{comm.size} ranks, {solid.count} points, {solid.step.newton.describe()}, {at}, "
              f"{found.iterations} Newton and {found.linear} linear iterations")
        for name, (messages, size) in found.traffic.items():
            of = expected.get("new tangent" if name == "tangent" else name)
            more = f"; formula {of[0]:.1f}, {of[1]:.0f}" if of else ""
            print(f"  {name}: {messages:.1f} messages, {size:.0f} bytes{more}")
        print(f"  reductions of PETSc {found.reductions:.1f}, others {found.calls}")
        print("  bytes per point {:.0f}, with work arrays {:.0f}, travelling {}".format(*sizes))
        print(f"  interface {got:.0f} bytes got, 16 b D {16 * force.size}")
    solid.close()


if __name__ == "__main__":
    main(int(WORDS.get("dim", 3)), int(WORDS.get("cells", 12)))
