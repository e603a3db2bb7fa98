"""Residual and tangent of a whole step, on a body with random deformation, velocity and acceleration."""
import numpy as np
import pytest

from mpm_fenicsx import Box, Grid, Interface, Support, linear, mohr_coulomb
from mpm_fenicsx.compiled import specialise
from mpm_fenicsx.laws.batches import batch_functions
from mpm_fenicsx.terms import groups, weakform
from mpm_fenicsx.terms.fields import Patches

DT = 0.02


class Problem:
    """The equations of one step as functions of u; ``free`` masks the unknowns. The left side of the body is
    held."""

    def __init__(self, solid):
        random, p, self.solid, self.step = np.random.default_rng(2), solid.points, solid, solid.step
        p.F += random.uniform(-0.1, 0.1, p.F.shape)
        p.v += random.normal(size=p.v.shape)
        p.a += random.normal(size=p.a.shape)
        self.step.begin(DT, 0.0, random.normal(size=solid.boundary.x.shape))
        self.F_old, self.F33_old = p.F.copy(), p.F33.copy()
        self.shape = self.step.active_cells.node.size, solid.dim
        self.free = (~self.step.active_cells.fixed & self.step.active[:, None]).ravel()
        self.u, self.du = np.where(self.free.reshape(self.shape),
                                   random.uniform(-0.05, 0.05, (2, *self.shape)), 0.0)
        self.residual(self.u)
        self.step.newton.make_tangent(self.trial)
        self.K = self.step.active_cells.matrix.convert("dense").getDenseArray().copy()

    def residual(self, u):
        r = np.empty(self.shape)
        self.trial = self.step.equations.residual(u.reshape(self.shape), r)
        return r.ravel()


@pytest.fixture(params=["consistent", "lumped"])
def problem(request, make_mpm, cell, make_law, plane):
    """All combinations of cell, law, stress state and inertia."""
    law = make_law(1e3, 0.3)
    hold = Support(lambda x: x[:, 0] < 0.1, "xy")
    return Problem(make_mpm(cell, law=law, stress_state=plane, inertia=request.param, supports=[hold],
                            thickness=0.7))


@pytest.fixture(params=["plane_strain", "plane_stress"])
def plane(request):
    return request.param


def test_matrix_is_the_derivative_of_the_residual(problem, taylor_rate):
    """r(u + h du) = r(u) + h K du + O(h^2)."""
    u, du = problem.u.ravel(), problem.du.ravel()
    rate = taylor_rate(lambda h: problem.residual(u + h * du), problem.K @ du, h=1e-2)
    assert rate == pytest.approx(2.0, abs=0.02)


@pytest.fixture(params=["lattice", "mesh"])
def averaged(request, make_mpm, distorted, any_cell):
    """``averaged(law)``: a problem with F-bar on each kind of cell, in a regular and an irregular grid."""
    D = 2 if any_cell in ("quadrilateral", "triangle") else 3
    body = Box((0.0,) * D, (1.0, 0.8, 0.6)[:D])
    around = Box((-0.4,) * D, (1.4, 1.2, 1.0)[:D])
    grid = Grid(around, (5, 4, 3)[:D], any_cell)
    if request.param == "mesh":
        grid = distorted(any_cell, grid.cells, box=around)
    top = Interface(np.full((1, D), 0.3), np.zeros((0, D), int))
    hold = Support(lambda x: x[:, 0] < 0.1, "xyz"[:D])

    def make(law):
        return Problem(make_mpm(any_cell, box=(body.lower, body.upper), h=0.5, grid=grid, law=law, f_bar=True,
                                interface=top, supports=[hold]))
    return make


@pytest.mark.parametrize("law", [linear(1e3, 0.3), mohr_coulomb(1e3, 0.3, 30.0, 10.0, cohesion=1.0)],
                         ids=["linear", "mohr_coulomb"])
def test_matrix_with_f_bar_is_the_derivative_too(averaged, law, taylor_rate):
    problem = averaged(law)
    u, du = problem.u.ravel(), problem.du.ravel()
    rate = taylor_rate(lambda h: problem.residual(u + h * du), problem.K @ du, h=1e-3)
    assert rate == pytest.approx(2.0, abs=0.05)


def test_forces_with_f_bar_are_the_derivative_of_the_energy(averaged, taylor_rate):
    """Of sum V0 W(F) at the averaged F, whatever the points of a patch have been through; so the matrix is
    symmetric."""
    problem = averaged(linear(1e3, 0.3))
    body, p, step = problem.solid.bodies[0], problem.solid.points, problem.step
    trials = []

    def forces(u):
        R = np.zeros(problem.shape)
        still = step.equations.increment(u)._replace(a=np.zeros(problem.shape))
        trials.append(body.residual(step.grid, still, R))
        return R

    def energy(h):
        forces(problem.u + h * problem.du)
        now = trials[-1].new._replace(state=p.state)
        return body._kernels.energies(p.mass, p.V0, p.v, now, body._params)[1]

    slope = np.vdot(forces(problem.u), problem.du)
    assert taylor_rate(energy, slope, h=1e-2) == pytest.approx(2.0, abs=0.05)
    np.testing.assert_allclose(problem.K, problem.K.T, rtol=0, atol=1e-13 * abs(problem.K).max())


def test_f_bar_keeps_one_volume_change_per_patch(averaged):
    """After a step det F / det F_old is the same for all points of a patch, and the patch's volume is what it
    was without the mean."""
    problem = averaged(linear(1e3, 0.3))
    body, background = problem.solid.bodies[0], problem.solid.background
    patch = np.arange(len(background.cells)) if background.patch is None else background.patch[
        background.original_cell]
    of_point = patch[body.points.cell]
    assert background.patch is None or len(np.unique(of_point)) < len(np.unique(body.points.cell))
    start = body.points.V0 * np.linalg.det(problem.F_old)
    H = np.einsum("qbi,qjb->qij", problem.u[problem.step.active_cells.cells[body.points.cell]], body._G)
    moved = start * np.linalg.det(np.eye(problem.solid.dim) + H)
    change = np.linalg.det(problem.trial.of_terms[0].new.F) / np.linalg.det(problem.F_old)
    for number in np.unique(of_point):
        here = of_point == number
        np.testing.assert_allclose(change[here], moved[here].sum() / start[here].sum(), rtol=1e-13)


def test_matrix_of_a_yielding_body_is_the_derivative_too(make_mpm, cell, taylor_rate):
    """Not symmetric, since the soil dilates less than it rubs."""
    hold = Support(lambda x: x[:, 0] < 0.1, "xy")
    problem = Problem(make_mpm(cell, law=mohr_coulomb(1e3, 0.3, 30.0, 10.0, cohesion=1.0), supports=[hold]))
    u, du, K = problem.u.ravel(), problem.du.ravel(), problem.K
    assert np.mean(problem.trial.of_terms[0].new.state["plastic_strain"] > 0) > 0.5
    assert taylor_rate(lambda h: problem.residual(u + h * du), K @ du, h=1e-4) == pytest.approx(2.0, abs=0.05)
    assert abs(K - K.T).max() > 1e-3 * abs(K).max()


def test_matrix_is_symmetric_and_positive_definite(problem):
    K = problem.K
    np.testing.assert_allclose(K, K.T, rtol=0, atol=1e-14 * abs(K).max())
    assert np.linalg.eigvalsh(K).min() > 0


def test_matrix_has_identity_rows_for_supports_and_empty_nodes(problem):
    idle = ~problem.free
    assert 0 < idle.sum() < idle.size
    rest = problem.K - np.diag(np.diag(problem.K))
    assert not rest[idle].any() and not rest[:, idle].any()
    np.testing.assert_allclose(np.diag(problem.K)[idle], problem.step.tangents.now.idle_scale)


def test_matrix_equals_a_dense_assembly(problem, at_point, plane):
    """K = sum_p V0 B^T A B + alpha m N^T N, with dF_iM = B_iM,Jk du_Jk = delta_ik (grad N_J . F_old)_M
    du_Jk."""
    solid, (nodes, D) = problem.solid, problem.shape
    point, p, cells = at_point(solid.bodies[0].body.law, plane), solid.points, problem.step.active_cells.cells
    values, gradients = np.empty((len(p), cells.shape[1])), np.empty((len(p), D, cells.shape[1]))
    solid.kernels.shapes(p.cell, p.x, solid.background.maps, values, gradients)
    K, alpha, mass = np.zeros((nodes, D, nodes, D)), 4 / DT**2, problem.step.grid.mass
    for q in range(len(p)):
        on, N, G = cells[p.cell[q]], values[q], gradients[q].T
        F = (np.eye(D) + problem.u[on].T @ G) @ problem.F_old[q]
        B = np.einsum("ik,JM->iMJk", np.eye(D), G @ problem.F_old[q])
        stiffness = p.V0[q] * np.einsum("iMIa,iMkN,kNJb->IaJb", B, point.A(F), B)
        inertia = alpha * p.mass[q] * np.einsum("I,J,ab->IaJb", N, N,
                                                np.eye(D)) if solid.step.problem.consistent else 0.0
        K[np.ix_(on, range(D), on, range(D))] += stiffness + inertia
    K = K.reshape(nodes * D, -1)
    if not solid.step.problem.consistent:
        K += np.diag(np.repeat(alpha * mass, D))
    used = np.ix_(problem.free, problem.free)
    np.testing.assert_allclose(problem.K[used], K[used], rtol=0, atol=1e-13 * abs(K).max())


def test_inner_forces_add_up_to_nothing(make_mpm, cell):
    """sum_I grad N_I = 0: on a body without inertia force the residual's sum is minus the load."""
    solid = make_mpm(cell)
    solid.points.F += np.random.default_rng(0).uniform(-0.1, 0.1, solid.points.F.shape)
    force = np.random.default_rng(1).normal(size=solid.boundary.x.shape)
    solid.step.begin(DT, 0.0, force)
    solid.step.grid.a[:] = 0.0  # without the jump that the load makes
    r = np.empty((solid.step.active_cells.owned, 2))
    solid.step.equations.residual(np.zeros_like(r), r)
    assert abs(r).max() > 10  # the inner forces are there
    np.testing.assert_allclose(r.sum(axis=0), -force.sum(axis=0), rtol=0, atol=1e-12)
    np.testing.assert_allclose(solid.applied, force.sum(axis=0), rtol=0, atol=1e-14)


def test_thickness_and_density_scale_the_matrix(make_mpm):
    """A body twice as thick is twice as stiff and heavy."""
    thin, thick = (Problem(make_mpm(thickness=t)).K for t in (1.0, 2.0))
    np.testing.assert_allclose(thick, 2 * thin, rtol=1e-14)


def _forces(problem):
    """At the nodes, and F at the points, from the residual of the first body."""
    body, R = problem.solid.bodies[0], np.zeros(problem.shape)
    trial = body.residual(problem.step.grid, problem.trial.increment, R)
    return R, trial.new.F.copy()


def _in_groups(body, elements, **form):
    """The residual of ``weakform`` for a body."""
    size = dict(D=body.body.dim, K=elements.nodes.shape[1])
    strain, load = (specialise(part, **size, **form) for part in (groups.strain, groups.load))
    batch = batch_functions(body.body.law, body.body.stress_state, size["D"])
    return specialise(weakform.residual, **size, FBAR=form["FBAR"], strain=strain, load=load,
                      batch_stress=batch.stress, new_work=batch.work)


def test_forces_in_the_plane_are_those_of_any_dimension(make_mpm, cell):
    """``plane_form`` against ``weakform``, which keeps no nodes in registers."""
    problem = Problem(make_mpm(cell, law=linear(1e3, 0.3)))
    body, found = problem.solid.bodies[0], _forces(problem)
    body._kernels = body._kernels._replace(residual=_in_groups(
        body, problem.step.active_cells.elements, CONSISTENT=True, FBAR=False))
    for one, other in zip(found, _forces(problem)):
        assert np.abs(one - other).max() < 1e-12 * np.abs(other).max()


def test_forces_of_cells_that_are_patches_are_those_of_patches(make_mpm):
    """F-bar in one pass over the cells against a pass for the volumes and one for the pressure."""
    problem = Problem(make_mpm("quadrilateral", law=linear(1e3, 0.3), f_bar=True))
    body, cells, found = problem.solid.bodies[0], problem.step.active_cells, _forces(problem)
    body._kernels = body._kernels._replace(residual=_in_groups(
        body, cells.elements, CONSISTENT=True, FBAR=True, CELLS_ARE_PATCHES=False))
    (count, M), D = cells.nodes_of_patch.shape, problem.shape[1]
    body._cells_are_patches, body._patches = False, Patches(
        np.zeros((count, 2)), np.zeros((count, D, M)), np.zeros((count, 2)), *np.zeros((2, count, D, M)))
    body._own_patches = cells.nodes_of_patch, body._patches
    for one, other in zip(found, _forces(problem)):
        assert np.abs(one - other).max() < 1e-12 * np.abs(other).max()

