"""Presets of the linear solver: the same motion with each, the user's options win, and what does not fit is
said."""
import numpy as np
import pytest
from mpi4py import MPI
from petsc4py import PETSc

from mpm_fenicsx import SOLVERS, MPMDivergedError, Numerics, drucker_prager
from mpm_fenicsx.grid import compat
from mpm_fenicsx.solve import solvers
from mpm_fenicsx.solve.coarse_grids import interpolations
from mpm_fenicsx.solve.divergence import FACTOR

# By what the PETSc at hand was built with: wheels have no SuiteSparse and no hypre.
CHOLESKY, LU = (f"preonly, {kind} ({package if compat.factorises(package, kind) else 'mumps'})"
                for kind, package in (("cholesky", "cholmod"), ("lu", "umfpack")))
HYPRE = pytest.mark.skipif(not PETSc.Sys.hasExternalPackage("hypre"), reason="this PETSc has no hypre")
BLOCK = dict(h=0.25, margin=1, gravity=(0.0, -1.0), velocity=(0.0, -0.1))
SOIL = dict(law=drucker_prager(1e3, 0.3, friction_angle=30.0, cohesion=1e9), inertia="lumped")
SHEARED = {**BLOCK, **SOIL, "velocity": lambda x: 0.1 * x[:, ::-1]}

SHARED = """
import sys
import numpy as np
from petsc4py import PETSc
from mpm_fenicsx import LAWS, MPM, Body, Box, Grid, Numerics

for name in ("snes_rtol", "snes_atol"):
    PETSc.Options()["mpm_" + name] = 1e-12
body = Body(Box((0.1,) * 3, (1.1,) * 3), (8,) * 3, 2, LAWS["neo_hooke"](1e4, 0.3), 1.0,
            velocity=lambda x: 0.1 * x[:, ::-1])
solid = MPM(Grid(Box((-0.25,) * 3, (1.5,) * 3), (14,) * 3), body, gravity=(0.0, -1.0, 0.0),
            inertia="lumped", numerics=Numerics("multigrid"))
for _ in range(3):
    solid.advance(0.02)
gid, x = (np.concatenate(solid.comm.allgather(values)) for values in (solid.points.gid, solid.points.x))
if solid.comm.rank == 0:
    assert ", mg" in solid.step.newton.describe()
    np.save(sys.argv[1], x[np.argsort(gid)])
solid.close()
"""


def motion(solid, dt=0.01, steps=3):
    """Positions of the points after a few steps [m]."""
    x = np.zeros_like(solid.points.x)
    for _ in range(steps):
        solid.advance(dt)
    x[solid.points.gid] = solid.points.x
    return x


@pytest.mark.parametrize("solver, described", [
    ("direct", CHOLESKY), ("cholesky", CHOLESKY), ("lu", LU), ("cg", "cg, bjacobi"),
    ("gmres", "gmres, bjacobi"), ("jacobi", "cg, jacobi"), ("multigrid", "cg, mg"),
    ("gamg", "cg, gamg"), pytest.param("hypre", "cg, hypre", marks=HYPRE)])
def test_every_solver_gives_the_same_motion(make_mpm, options, solver, described):
    options(snes_rtol=1e-12, snes_atol=1e-12)
    automatic, solid = make_mpm(**BLOCK), make_mpm(**BLOCK, numerics=Numerics(solver))
    expected, fall = motion(automatic), 0.01 * 3 * 0.1
    assert np.abs(motion(solid) - expected).max() < 1e-9 * fall
    assert described in solid.step.newton.describe()
    assert CHOLESKY in automatic.step.newton.describe()


@pytest.mark.parametrize("solver, described", [
    ("auto", "gmres, jacobi"), ("direct", LU), ("gmres", "gmres, sor"), ("multigrid", "gmres, mg"),
    ("gamg", "gmres, gamg")])
def test_a_tangent_that_is_not_symmetric(make_mpm, options, solver, described):
    options(snes_rtol=1e-12, snes_atol=1e-12)
    solid = make_mpm(**BLOCK, **SOIL, numerics=Numerics(solver))
    assert np.abs(motion(solid) - motion(make_mpm(**BLOCK, **SOIL, numerics=Numerics("lu")))).max() < 1e-11
    assert described in solid.step.newton.describe()


def test_what_is_chosen_follows_the_stiffness_of_soil(make_mpm):
    """And stays while it would suit half or twice the stiffness."""
    solid = make_mpm(**SHEARED)
    for dt, described in ((1e-3, "gmres, jacobi"), (0.025, "gmres, jacobi"), (0.04, "gmres, sor"),
                          (0.025, "gmres, sor"), (0.16, "gmres, sor"), (1e-3, "gmres, jacobi")):
        motion(solid, dt=dt, steps=1)
        assert described in solid.step.newton.describe()


@pytest.mark.parametrize("size, light", [(solvers.SMALL, solvers.LIGHT_IF_SMALL),
                                         (solvers.SMALL + 1, solvers.LIGHT)])
@pytest.mark.parametrize("dim", [2, 3])
def test_the_automatic_choice_for_soil(size, light, dim):
    soil = dict(symmetric=False, fresh=True, soil=True)
    found = [chosen(size, dim, stiffness=stiffness, **soil)
             for stiffness in (light, 1.01 * light, 100.0 * solvers.STIFF)]
    assert found == ["jacobi", "gmres", "gmres"]


@pytest.mark.parametrize("soil", [True, False])
@pytest.mark.parametrize("dim", [2, 3])
def test_the_automatic_choice_at_rest(soil, dim):
    """Cholesky's factors pay for longer than those of LU."""
    for symmetric, most in ((False, solvers.FRESH_UP_TO[dim]), (True, solvers.LONG_UP_TO[dim])):
        found = [chosen(size, dim, symmetric, fresh=True, soil=soil, stiffness=np.inf, regular=regular)
                 for size, regular in ((most, True), (most + 1, True), (most + 1, False))]
        assert found == ["direct", "multigrid", "gamg"]


def test_a_factorisation_where_an_iterative_solver_stalls(make_mpm, options):
    """In this step only: the next one begins with the iterative one again."""
    expected = motion(make_mpm(**SHEARED, numerics=Numerics("lu")), dt=0.04)
    options(ksp_max_it=1)
    solid = make_mpm(**SHEARED)
    with pytest.warns(UserWarning, match=f"it succeeds with {FACTOR}"):
        found = motion(solid, dt=0.04)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-9)
    assert list(solid.helped) == [FACTOR] and solid.helped[FACTOR][1] == 3
    assert "gmres" in solid.step.newton.describe()


def test_what_the_user_has_chosen_stays_where_it_stalls(make_mpm, options):
    options(ksp_max_it=1)
    solid = make_mpm(**SHEARED, numerics=Numerics("gmres"))
    with pytest.raises(MPMDivergedError, match="the linear solver failed, try solver=lu"):
        motion(solid, dt=0.04)


def test_the_systems_that_a_factorisation_may_rescue():
    system = solvers.System(3_001, 3, symmetric=False, fresh=True)
    assert [solvers.rescue(system, stiffness, "gmres") for stiffness in (1.0, 1e3)] == ["", "lu"]
    assert solvers.rescue(system._replace(size=3_000), 1.0, "gmres") == "lu"
    assert solvers.rescue(system._replace(size=20_001), np.inf, "gamg") == ""
    assert solvers.rescue(system, 1e3, "direct") == ""


@pytest.mark.parametrize("solver", ["jacobi", "gmres", "gamg", "multigrid"])
@pytest.mark.parametrize("inertia", ["consistent", "lumped"])
def test_systems_that_are_solved_loosely_keep_momentum(make_mpm, options, solver, inertia):
    """Of a free body, exactly: the rest has no part in the translations."""
    options(snes_lag_jacobian=1, ksp_rtol=0.1, snes_rtol=1e-2)
    soil = {**SOIL, "inertia": inertia, "velocity": lambda x: 0.3 * x[:, ::-1] + 0.1}
    solid = make_mpm(**soil, numerics=Numerics(solver))
    start, given, random = solid.momentum(), np.zeros(2), np.random.default_rng(5)
    for dt in (0.01, 0.02, 0.005):
        force = random.normal(size=solid.interface.x.shape)
        solid.advance(dt, force)
        given += dt * force.sum(axis=0)
        np.testing.assert_allclose(solid.momentum() - start, given, rtol=0, atol=1e-12 * abs(given).max())


def test_one_preset_leaves_nothing_behind_for_the_next(make_mpm, options):
    """The factors inside block Jacobi are an option in PETSc's data base, which outlives the first body."""
    options(snes_rtol=1e-12, snes_atol=1e-12)
    motion(make_mpm(**BLOCK, numerics=Numerics("cg")))
    motion(make_mpm(**BLOCK, numerics=Numerics("gmres")))
    assert PETSc.Options("mpm_").getString("sub_pc_type") == "ilu"


@pytest.mark.parametrize("solver", ["multigrid", "gamg"])
def test_grids_of_soil_are_smoothed_without_factors(make_mpm, solver):
    """Incomplete ones of soil that comes apart are useless."""
    for more, smoother in ((SOIL, "sor"), ({}, "bjacobi"), (SOIL, "sor")):
        motion(make_mpm(**BLOCK, **more, numerics=Numerics(solver)))
        assert PETSc.Options("mpm_").getString("mg_levels_pc_type") == smoother


def test_options_win_over_the_preset(make_mpm, options):
    options(pc_type="jacobi", ksp_rtol=1e-4)
    solid = make_mpm(**BLOCK, numerics=Numerics("direct"))
    motion(solid)
    assert "cg, jacobi" in solid.step.newton.describe() and solid.step.newton.snes.getKSP().getTolerances()[
        0] == 1e-4
    options(pc_type="lu", pc_factor_mat_solver_type="petsc")
    solid = make_mpm(**BLOCK, numerics=Numerics("gamg"))
    motion(solid)
    assert "preonly, lu (petsc)" in solid.step.newton.describe()


def test_a_solver_that_stalls_gives_up():
    """gmres gains nothing from a cyclic shift of the unknowns before it has been round once."""
    n, ksp = 900, PETSc.KSP().create(PETSc.COMM_SELF)
    shift = PETSc.Mat().createAIJ((n, n), nnz=1, comm=PETSc.COMM_SELF)
    for row in range(n):
        shift.setValue(row, (row + 1) % n, 1.0)
    shift.assemble()
    ksp.setOperators(shift)
    solvers.configure(ksp, "mpm_", "jacobi", np.zeros((n // 3, 3)), symmetric=False, changes=True)
    x, b = shift.createVecs()
    b.setValue(0, 1.0)
    b.assemble()
    ksp.solve(b, x)
    assert ksp.getConvergedReason() == PETSc.KSP.ConvergedReason.DIVERGED_MAX_IT
    assert ksp.getIterationNumber() == solvers.LOOSE["max_it"]


def test_a_bad_preconditioner_of_one_row_spoils_no_other():
    """That row alone would decide when gmres, preconditioned from the left, believes to have converged."""
    n, ksp = 300, PETSc.KSP().create(PETSc.COMM_SELF)
    matrix = PETSc.Mat().createAIJ((n, n), nnz=3, comm=PETSc.COMM_SELF)
    for row in range(n):
        matrix.setValue(row, row, 1e-6 if row == 0 else 2.0 + row % 7)
        matrix.setValue(row, (row + 1) % n, -0.9)
        matrix.setValue(row, row - 1 if row else n - 1, -0.5)
    matrix.assemble()
    ksp.setOperators(matrix)
    solvers.configure(ksp, "mpm_", "gmres", np.zeros((n // 3, 3)), symmetric=False, changes=True)
    x, b = matrix.createVecs()
    b.array_w[:] = np.sin(np.arange(n))
    ksp.solve(b, x)
    assert ksp.getConvergedReason() > 0 and ksp.getPC().getType() == "sor"
    assert (matrix * x - b).norm() < 2.0 * solvers.LOOSE["rtol"] * b.norm()


def chosen(size, dim, symmetric, fresh, stiffness, now="", **more):
    return solvers.automatic(solvers.System(size, dim, symmetric, fresh, **more), stiffness, now)


def test_the_automatic_choice():
    kept, fresh = dict(symmetric=True, fresh=False), dict(symmetric=True, fresh=True)
    assert chosen(100_000, 2, stiffness=1.0, **kept) == "direct"
    assert chosen(60_000, 3, stiffness=1e3, **kept) == "direct"
    assert chosen(100_001, 2, stiffness=1.0, **kept) == "cg"
    assert chosen(60_001, 3, stiffness=1e3, **kept) == "gamg"
    assert chosen(60_001, 3, stiffness=1e3, regular=True, **kept) == "multigrid"
    assert [chosen(n, 3, stiffness=1.0, **fresh) for n in (3_000, 3_001)] == ["direct", "cg"]
    assert [chosen(n, 3, stiffness=1e3, **fresh) for n in (20_000, 20_001)] == ["direct", "gamg"]
    assert chosen(30_000, 2, symmetric=False, fresh=True, stiffness=1.0) == "gmres"
    assert chosen(30_000, 3, symmetric=False, fresh=True, stiffness=0.5) == "gmres"
    assert [chosen(60_001, 3, stiffness=stiffness, now="gamg", **kept) for stiffness in (15.1, 14.9)] == [
        "gamg", "cg"]


@pytest.mark.parametrize("solver, law, sentence", [
    ("pardiso", {}, "solver is 'pardiso': choose one of auto, direct, "),
    ("cholesky", SOIL, "solver=cholesky needs a symmetric tangent.*take lu"),
    ("cg", SOIL, "solver=cg needs a symmetric tangent.*take gmres")])
def test_a_solver_that_does_not_exist_or_fit(make_mpm, solver, law, sentence):
    with pytest.raises(ValueError, match=sentence):
        make_mpm(**BLOCK, **law, numerics=Numerics(solver))


def test_multigrid_needs_a_regular_grid(make_mpm):
    with pytest.raises(ValueError, match="solver=multigrid needs a regular grid.*take gamg"):
        motion(make_mpm("triangle", **BLOCK, numerics=Numerics("multigrid")))


@pytest.mark.parametrize("fields", [1, 2])
@pytest.mark.parametrize("D", [2, 3])
def test_interpolation_between_grids(D, fields):
    """Linear functions are kept, each node has one coarse number, and fields stay apart."""
    sides = [range(4), range(3, 12), range(7)][:D]
    places = np.stack(np.meshgrid(*sides, range(fields), indexing="ij"), -1).reshape(-1, D + 1)
    for step in interpolations(MPI.COMM_SELF, places):
        start, columns, values = step.getValuesCSR()
        rows, size = step.getSize()
        assert rows == D * len(places) and size % D == 0
        whole = np.zeros((rows, size))
        whole[np.repeat(np.arange(rows), np.diff(start)), columns] = values
        coarse = np.unique(np.concatenate([(places + [*side, 0]) // [*[2] * D, 1]
                                           for side in np.ndindex(*[2] * D)]), axis=0)
        assert size == D * len(coarse)
        for there, here in ((coarse[:, :D], 0.5 * places[:, :D]), (coarse[:, [D] * D], places[:, [D] * D])):
            np.testing.assert_allclose(whole @ there.ravel(), here.ravel(), rtol=0, atol=1e-14)
        places = coarse


@pytest.mark.mpi
def test_multigrid_on_several_ranks(on_ranks, tmp_path):
    """The coarse grids are shared out, too; three ranks have an uneven number of nodes."""
    found = []
    for ranks in (1, 2, 3):
        path = tmp_path / f"{ranks}.npy"
        done = on_ranks(ranks, SHARED, path)
        assert done.returncode == 0, done.stderr
        found.append(np.load(path))
    for other in found[1:]:
        np.testing.assert_allclose(other, found[0], rtol=0, atol=1e-10)


def test_f_bar_keeps_the_tangent_symmetric(make_mpm):
    """So an elastic body with F-bar takes a Cholesky factor."""
    solid = make_mpm(f_bar=True, **BLOCK)
    motion(solid, steps=1)
    assert "cholesky" in solid.step.newton.describe()


def test_all_presets_are_documented():
    assert all(f"    {name} " in solvers.__doc__ for name in SOLVERS)


def test_round_off_does_not_depend_on_where_vectors_lie_in_memory():
    """With the newer VecMDot it did, by the rigid-body modes: so multigrid differed from run to run."""
    modes = np.linalg.qr(np.random.default_rng(1).standard_normal((70, 3)))[0].T
    memory, left = np.zeros(500), []
    for starts in ((0, 100, 200), (0, 100, 210)):  # at one distance, as chance would have it, and not
        vectors = []
        for start, mode in zip(starts, modes):
            memory[start:start + 70] = mode
            vectors.append(PETSc.Vec().createWithArray(memory[start:start + 70], comm=PETSc.COMM_SELF))
        x = PETSc.Vec().createWithArray(np.linspace(0.0, 1.0, 70), comm=PETSc.COMM_SELF)
        PETSc.NullSpace().create(vectors=vectors, comm=PETSc.COMM_SELF).remove(x)
        left.append(x.array.copy())
    assert np.array_equal(*left)
