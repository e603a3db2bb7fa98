"""The linear solver inside Newton's method: presets, which set PETSc's options where the user has set none.

    direct    cholesky where the tangent is symmetric, else lu
    cholesky  factorisation by CHOLMOD, on several ranks by MUMPS
    lu        factorisation by UMFPACK, on several ranks by MUMPS
    cg        conjugate gradients, incomplete Cholesky factors on each rank; with a smooth basis in space, and
              where the tangent changes with the load, successive over-relaxation: factors of soil that comes
              apart are useless
    gmres     the same for tangents that are not symmetric, with incomplete LU factors
    jacobi    conjugate gradients (gmres) with the diagonal alone: where inertia is lumped and dominates, and
              the tangent changes with the load
    multigrid conjugate gradients (gmres) with geometric multigrid, on regular grids
    gamg      conjugate gradients (gmres) with algebraic multigrid that knows the rigid-body modes
    hypre     conjugate gradients (gmres) with hypre's algebraic multigrid
    auto      direct while that pays: up to DIRECT_UP_TO unknowns where the factor is kept, FRESH_UP_TO where
              it is made in every iteration, LONG_UP_TO where iterations are many as well; beyond that cg
              (gmres) where inertia dominates, and multigrid (gamg where the grid is not regular) where
              stiffness does. Soil has cg (gmres), jacobi while inertia dominates by far, in steps of any
              length, and the others only at rest

Iterative ones stop at -mpm_ksp_rtol 1e-8, but all for a tangent that changes with the load at 1e-3, jacobi at
1e-2, small systems at 1e-6: there Newton's method iterates anyhow (more exactly where that may end its
iterations, see ``tolerance``). They give up after 2000 and 500 iterations (-mpm_ksp_max_it). On several ranks
direct solves systems below REDUNDANT_UP_TO unknowns whole on each rank (-mpm_pc_type redundant).
docs/solvers.md says which one does what."""
from typing import NamedTuple

import numpy as np
from petsc4py import PETSc

from ..grid import compat
from ..scene.numerics import SOLVERS
from .coarse_grids import interpolations

FACTORISATIONS = ("cholesky", "lu")
POSITIVE = "cholesky", "cg"  # what these names say is for tangents that are positive
DIRECT_UP_TO = {2: 100_000, 3: 60_000}  # unknowns: a factor that is kept pays up to here
# And one that is made in every iteration up to here. That of soil, plastic with lumped inertia, never does in
# a step of time: the few iterations of gmres take less.
FRESH_UP_TO = {2: 20_000, 3: 3_000}
# And where stiffness dominates, up to here if the tangent is symmetric: Cholesky takes a third of the time of
# LU, and slender bodies have cheap factors and many iterations.
LONG_UP_TO = {2: 100_000, 3: 20_000}
# Entries per row from which a matrix is wide, as of a smooth basis in space (375; with the linear one 81):
# factors then cost six times as much, incomplete ones too, and successive over-relaxation is the better
# preconditioner.
WIDE, WIDE_DIRECT_UP_TO, WIDE_FRESH_UP_TO = 100, 20_000, 200
REDUNDANT_UP_TO = 4_000  # unknowns: up to here every rank solves the whole system faster than all share it
# Of soil: stiffness over inertia up to which the diagonal preconditions best. In small systems it is as good
# as others for longer, and the same one on any number of ranks.
LIGHT, LIGHT_IF_SMALL, SMALL = 0.5, 5.0, 3_000
# Where iterative solvers stop and give up: one that stalls must not take minutes before a shorter step is
# tried, PETSc's own limit is 10,000 iterations.
EXACT, LOOSE = dict(rtol=1e-8, max_it=2000), dict(rtol=1e-3, max_it=500)
LOOSE_IF_LIGHT = dict(LOOSE, rtol=1e-2)  # where inertia dominates, with as many iterations of Newton's method
# A small system costs little more, and what springs at their limit do, stick or slide, then depends less on
# round-off.
LOOSE_IF_SMALL = dict(LOOSE, rtol=1e-6)
STIFF = 30.0  # stiffness over inertia in the tangent from which simple preconditioners need many iterations
# before an option's name: PETSc's own store keeps under that name what a preset has put in
PRESET = "preset_"


def is_preset(name, text, given):
    """Whether of PETSc's options ``given``, name → text, this one was put in by a preset, or tells of such a
    one."""
    return name.startswith(PRESET) or given.get(PRESET + name) == text


def check(name, symmetric, regular):
    """ValueError unless there is a preset of that name and it suits the tangent and the grid."""
    if name not in SOLVERS:
        raise ValueError(f"solver={name} does not exist: choose one of {', '.join(SOLVERS)}")
    if name == "hypre" and not PETSc.Sys.hasExternalPackage("hypre"):
        raise ValueError("solver=hypre: this PETSc was built without hypre: take gamg")
    if not symmetric and name in ("cholesky", "cg"):
        other = {"cholesky": "lu", "cg": "gmres"}[name]
        raise ValueError(f"solver={name} needs a symmetric tangent, which laws with friction do not have: "
                         f"take {other}")
    if name == "multigrid" and not regular:
        raise ValueError("solver=multigrid needs a regular grid of quadrilaterals or hexahedra: take gamg")


def is_wide(matrix):
    """Whether its rows have that many entries. Collective."""
    return matrix.getInfo()["nz_used"] > WIDE * matrix.getSize()[0]


class System(NamedTuple):
    """What "auto" knows of a linear system: its ``size``, unknowns in ``dim`` dimensions; whether it is
    ``symmetric``; ``fresh``: made in every iteration; ``wide``: see ``is_wide``; ``soil``: of plastic bodies
    with lumped inertia; ``regular``: on such a grid."""

    size: int
    dim: int
    symmetric: bool
    fresh: bool
    wide: bool = False
    soil: bool = False
    regular: bool = False


def automatic(system, stiffness, now=""):
    """The preset that suits a ``system`` with so many times as much stiffness as inertia; ``now``, that in
    use, while it would suit half or twice the stiffness."""
    suits = [_suits(system, times * stiffness) for times in (1.0, 0.5, 2.0)]
    return now if now in suits else suits[0]


def _suits(system, stiffness):
    size, dim, symmetric, fresh, wide, soil, regular = system
    kept, made = (WIDE_DIRECT_UP_TO, WIDE_FRESH_UP_TO) if wide else (DIRECT_UP_TO[dim], FRESH_UP_TO[dim])
    simple = "cg" if symmetric else "gmres"
    if soil and not wide and np.isfinite(stiffness):
        return "jacobi" if stiffness <= (LIGHT_IF_SMALL if size <= SMALL else LIGHT) else simple
    if fresh:
        kept = min(kept, LONG_UP_TO[dim]) if symmetric and stiffness > STIFF else made
    if size <= kept:
        return "direct"
    return simple if stiffness <= STIFF else "multigrid" if regular else "gamg"


def rescue(system, stiffness, now):
    """The preset that may solve a ``system``, see ``automatic``, where ``now`` has stalled: "lu", or "" where
    that takes too long, or now is direct. With inertia shorter steps help sooner."""
    most = LONG_UP_TO if stiffness > STIFF else FRESH_UP_TO
    return "lu" if now != "direct" and system.size <= most[system.dim] else ""


def configure(ksp, prefix, name, nodes, symmetric, changes=False):
    """Set the KSP, which has its matrix, to the preset ``name`` (not "auto"); what the options with
    ``prefix`` say is left to them. nodes: ``coarse_grids.Nodes``; changes: the tangent does, with the load.
    Collective."""
    options = PETSc.Options(prefix)
    asked = options.getString("pc_type", "")
    if asked in FACTORISATIONS or (name in ("direct", *FACTORISATIONS) and not asked):
        _factorise(ksp, options, asked or name, symmetric)
    else:
        general = not symmetric or name == "gmres"
        ksp.setType("gmres" if general else "cg")
        if not options.hasName("ksp_type"):
            # From the right it is the residual itself that becomes small: a preconditioner that is bad for a
            # few rows makes them all that counts in its norm, and gmres ends having done nothing for the rest
            ksp.setPCSide(PETSc.PC.Side.RIGHT if general else PETSc.PC.Side.LEFT)
        small = ksp.getOperators()[1].getSize()[0] <= SMALL
        loose = LOOSE_IF_SMALL if small else LOOSE_IF_LIGHT if name == "jacobi" else LOOSE
        ksp.setTolerances(**(loose if changes or name == "jacobi" else EXACT))
        simple = "sor" if changes or is_wide(ksp.getOperators()[1]) else "bjacobi"
        _precondition(ksp, options, asked or {"cg": simple, "gmres": simple}.get(name, name), nodes,
                      factors=not (changes and general))


def _factorise(ksp, options, kind, symmetric):
    pc, comm = ksp.getPC(), ksp.comm
    size, small = ksp.getOperators()[0].getSize()[0], False
    if kind == "direct":
        kind, small = "cholesky" if symmetric else "lu", size <= REDUNDANT_UP_TO
    package = {"cholesky": "cholmod", "lu": "umfpack"}[kind]
    if not compat.factorises(package, kind):  # a PETSc without SuiteSparse
        package = "mumps"
    ksp.setType("preonly")
    if comm.size > 1 and small:
        pc.setType("redundant")
        _default(options, redundant_ksp_type="preonly", redundant_pc_type=kind,
                 redundant_pc_factor_mat_solver_type=package)
    else:
        pc.setType(kind)
        pc.setFactorSolverType("mumps" if comm.size > 1 else package)
        _default(options, mat_cholmod_print=0)  # a factorisation that fails is not yet the end


def _precondition(ksp, options, kind, nodes, factors):
    """factors: incomplete ones smooth on the grids of multigrid, else successive over-relaxation."""
    incomplete = "icc" if ksp.getType() == "cg" else "ilu"
    # gamg's own smoother, the diagonal, needs eight times the iterations where cells are nearly empty
    smoother = dict(mg_levels_ksp_type="chebyshev", mg_levels_pc_type="bjacobi",
                    mg_levels_sub_pc_type=incomplete) if factors else dict(
                        mg_levels_ksp_type="richardson", mg_levels_pc_type="sor")
    if kind == "multigrid":
        _set_coarse_grids(ksp, nodes)
        _default(options, pc_mg_galerkin="both", **smoother)
        return
    ksp.getPC().setType(kind)
    if kind == "gamg":
        _set_rigid_body_modes(ksp.getOperators()[0], nodes.x)
        _default(options, **smoother)
    elif kind == "hypre":
        _default(options, pc_hypre_type="boomeramg")
    elif kind == "bjacobi":
        _default(options, sub_pc_type=incomplete)


def _set_coarse_grids(ksp, nodes):
    pc, steps = ksp.getPC(), interpolations(ksp.comm.tompi4py(), nodes.lattice())
    pc.setType("mg")
    pc.setMGLevels(len(steps) + 1)
    for level, step in zip(range(len(steps), 0, -1), steps):
        pc.setMGInterpolation(level, step)
        step.destroy()


def _default(options, **values):
    """Put in options that others will read, unless they are the user's; what a solver before put in is
    not."""
    presets = PETSc.Options(PRESET + options.prefix)
    for name, value in values.items():
        ours = presets.hasName(name) and presets.getString(name) == options.getString(name, "")
        if ours or not options.hasName(name):
            options[name] = presets[name] = value


def _set_rigid_body_modes(matrix, coordinates):
    """What multigrid needs to know of elasticity: the motions that cost no energy."""
    x = matrix.createVecRight()
    x.array_w[:] = coordinates.ravel()
    x.setBlockSize(coordinates.shape[1])
    modes = PETSc.NullSpace().createRigidBody(x)
    matrix.setNearNullSpace(modes)
    modes.destroy()
    x.destroy()


def forget_failed_factor(ksp):
    """Neither CHOLMOD nor MUMPS can go on from it."""
    operators = ksp.getOperators()
    ksp.getPC().reset()
    ksp.setOperators(*operators)  # they are gone then, but PETSc 3.22 reads options with a look at them


def describe(ksp):
    """The linear solver in use, in a few words."""
    pc = ksp.getPC()
    package = f" ({pc.getFactorSolverType()})" if pc.getType() in FACTORISATIONS else ""
    return f"{ksp.getType()}, {pc.getType()}{package}"
