"""Sums over the nodes equal sums over the points, to round-off."""
import numpy as np
import pytest

from mpm_fenicsx import Box, Grid
from mpm_fenicsx.basis.shape import cell_maps, reference, shapes
from mpm_fenicsx.compiled import specialise
from mpm_fenicsx.grid.background import whole_mesh
from mpm_fenicsx.points import transfer
from mpm_fenicsx.terms.newmark import Increment, alpha

EPS = np.finfo(float).eps


class Cloud:
    """Forty points at random in the lower left quarter of 4 x 4 cells, with random mass, v and a: nodes
    further up or right have no mass."""

    def __init__(self, cell):
        grid = Grid(Box((0.0, 0.0), (4.0, 4.0)), (4, 4), cell)
        self.nodes, self.cells = whole_mesh(grid)
        random, n, K = np.random.default_rng(7), 40, self.cells.shape[1]
        self.kernel = lambda name, **size: specialise(getattr(transfer, name), **(size or dict(D=2, K=K)))
        self.x, self.v, self.a = random.uniform(0, 2, (n, 2)), *random.normal(size=(2, n, 2))
        self.mass, self.random, self.K = random.uniform(0.5, 2, n), random, K
        column = (self.x[:, 1].astype(int) * 4 + self.x[:, 0].astype(int)).astype(np.int32)
        above = np.subtract(*(self.x % 1).T) < 0
        self.cell = column if cell == "quadrilateral" else (2 * column + above).astype(np.int32)
        self.N, G = np.empty((n, K)), np.empty((n, 2, K))
        maps, _ = cell_maps(self.nodes, self.cells)
        to_reference = specialise(reference, D=2, K=K, AFFINE=True)
        specialise(shapes, D=2, K=K, to_reference=to_reference)(self.cell, self.x, maps, self.N, G)
        assert (self.N >= 0).all()  # every point really lies in its cell

    def to_grid(self):
        nodal = np.zeros((len(self.nodes), 5))
        self.kernel("to_grid")(self.cell, self.cells, self.N, self.mass, self.v, self.a, nodal)
        return nodal[:, 0], nodal[:, 1:3], nodal[:, 3:]


@pytest.fixture
def cloud(cell):
    return Cloud(cell)


def test_the_grid_takes_up_mass_momentum_and_inertia_force(cloud):
    m, p, f = cloud.to_grid()
    assert m.sum() == pytest.approx(cloud.mass.sum(), rel=10 * EPS)
    np.testing.assert_allclose(p.sum(axis=0), cloud.mass @ cloud.v, rtol=0, atol=100 * EPS)
    np.testing.assert_allclose(f.sum(axis=0), cloud.mass @ cloud.a, rtol=0, atol=100 * EPS)


def test_the_grid_takes_up_the_first_moment_of_mass(cloud):
    """sum m_I x_I = sum m_p x_p: the basis reproduces positions."""
    m = cloud.to_grid()[0]
    np.testing.assert_allclose(m @ cloud.nodes, cloud.mass @ cloud.x, rtol=20 * EPS)


def test_nodes_away_from_all_points_stay_empty(cloud):
    m, p, f = cloud.to_grid()
    far = (cloud.nodes > 2.0).any(axis=1)
    assert not m[far].any() and not p[far].any() and not f[far].any()
    assert (m[~far] > 0).all()


def test_projected_velocity_has_no_more_kinetic_energy(cloud):
    """By Cauchy–Schwarz sum m_I v_I^2 <= sum m_p v_p^2, equal for a uniform velocity."""
    energy = cloud.mass @ (cloud.v**2).sum(axis=1)
    m, p, _ = cloud.to_grid()
    assert ((p**2).sum(axis=1)[m > 0] / m[m > 0]).sum() < 0.9 * energy
    cloud.v[:] = 2.0, -1.0
    m, p, _ = cloud.to_grid()
    np.testing.assert_allclose(p[m > 0] / m[m > 0, None], np.tile(cloud.v[0], (np.count_nonzero(m), 1)),
                               rtol=10 * EPS)


def test_points_gain_the_momentum_of_the_grid(cloud):
    """v += dt/2 (a_old + a_new): the points' gain is dt/2 (sum m a_old + sum m_I a_I)."""
    dt, m = 0.1, cloud.to_grid()[0]
    u, a_nodes = cloud.random.normal(size=(2, len(cloud.nodes), 2))
    expected = cloud.mass @ cloud.v + 0.5 * dt * (cloud.mass @ cloud.a + m @ a_nodes)
    centre = cloud.mass @ cloud.x + m @ u
    increment = Increment(dt, alpha(dt), u, a_nodes)
    cloud.kernel("to_points")(cloud.cell, cloud.cells, cloud.N, increment, cloud.x, cloud.v, cloud.a)
    np.testing.assert_allclose(cloud.mass @ cloud.v, expected, rtol=0, atol=100 * EPS)
    np.testing.assert_allclose(cloud.mass @ cloud.x, centre, rtol=100 * EPS)
    np.testing.assert_allclose(cloud.mass @ cloud.a, m @ a_nodes, rtol=0, atol=100 * EPS)


def test_points_follow_a_linear_field_exactly(cloud):
    x, H = cloud.x.copy(), np.array([[0.1, -0.2], [0.3, 0.4]])
    u, a = cloud.nodes @ H.T, np.zeros_like(cloud.nodes)
    increment = Increment(1.0, alpha(1.0), u, a)
    cloud.kernel("to_points")(cloud.cell, cloud.cells, cloud.N, increment, cloud.x, cloud.v, cloud.a)
    np.testing.assert_allclose(cloud.x, x + x @ H.T, rtol=0, atol=20 * EPS)


def test_interpolation_adds_the_nodal_field(cloud):
    values = np.ones((40, 2))
    cloud.kernel("interpolate")(cloud.cell, cloud.cells, cloud.N, cloud.nodes, values)
    np.testing.assert_allclose(values, 1.0 + cloud.x, rtol=10 * EPS)


@pytest.mark.parametrize("bare", [False, True], ids=["full", "some nodes bare"])
def test_spread_keeps_the_sum_of_the_forces(cloud, bare):
    """Eq. 13, with the basis of eq. 14 where nodes have no mass."""
    active = cloud.nodes[:, 0] < 1.5 if bare else np.ones(len(cloud.nodes), bool)
    force, nodal = cloud.random.normal(size=(40, 2)), np.zeros_like(cloud.nodes)
    only_active(cloud, active)
    cloud.kernel("spread")(cloud.cell, cloud.cells, cloud.N, force, nodal)
    np.testing.assert_allclose(nodal.sum(axis=0), force.sum(axis=0), rtol=0, atol=50 * EPS)
    assert not nodal[~active].any()


def only_active(cloud, active):
    return cloud.kernel("only_active", K=cloud.K)(cloud.cell, cloud.cells, active, cloud.N)


def test_modified_basis_sums_to_one_over_nodes_with_mass(cloud):
    """Eq. 14: N_I / sum N over the active nodes; the values keep their ratio."""
    active, old = cloud.nodes[:, 0] < 1.5, cloud.N.copy()
    assert only_active(cloud, active) == -1
    on = active[cloud.cells[cloud.cell]]
    np.testing.assert_allclose(cloud.N.sum(axis=1), 1.0, rtol=0, atol=4 * EPS)
    assert not cloud.N[~on].any() and on.all(axis=1).any() and not on.all(axis=1).all()
    np.testing.assert_allclose(cloud.N, np.where(on, old, 0.0) / (old * on).sum(axis=1)[:, None],
                               rtol=10 * EPS)


def test_modified_basis_changes_nothing_where_all_nodes_have_mass(cloud):
    old = cloud.N.copy()
    assert only_active(cloud, np.ones(len(cloud.nodes), bool)) == -1
    np.testing.assert_allclose(cloud.N, old, rtol=4 * EPS)


def test_modified_basis_names_the_first_point_without_any_node(cloud):
    active = cloud.nodes[:, 0] < 0.5
    assert only_active(cloud, active) == np.flatnonzero(~active[cloud.cells[cloud.cell]].any(axis=1))[0]
