"""Smooth bases: the functions themselves, the derivative of the whole residual, motion that they must
reproduce, states, and what they refuse."""
import numpy as np
import pytest

from mpm_fenicsx import MPM, Body, Box, Grid, Mesh, Numerics, Support, mohr_coulomb, neo_hooke
from mpm_fenicsx.basis.smooth import StencilGrid, shapes
from mpm_fenicsx.compiled import specialise
from mpm_fenicsx.scene.lattice import lattice

BASES = ["ugimp", "gimp", "bspline"]


@pytest.fixture(params=[2, 3])
def dim(request):
    return request.param


def at(x, domain, F=None):
    """Stencils, values and gradients at places x [m] in a grid of 4 x 3 [x 3] cells of 0.5 x 0.4 [x 0.3] m,
    and the positions of its nodes."""
    D = x.shape[1]
    counts, h = np.array([4, 3, 3][:D]), np.array([0.5, 0.4, 0.3][:D])
    nodes, cells = lattice(Box((0.0,) * D, tuple(counts * h)), counts, ["quadrilateral", "hexahedron"][D - 2])
    index = np.clip(np.floor(x / h).astype(int), 0, counts - 1)
    cell = (index @ np.cumprod([1, *counts[:-1]])).astype(np.int32)
    grid = StencilGrid(np.zeros(D), counts * h, h, nodes[cells], cells.astype(np.int32))
    n, K = len(x), 3**D
    element, N, G = np.empty(n, np.int32), np.empty((n, K)), np.empty((n, D, K))
    kernel = specialise(shapes, D=D, FOLLOWS=F is not None)
    kernel(cell, x, domain, np.tile(np.eye(D), (n, 1, 1)) if F is None else F, grid, element, N, G)
    steps = np.stack(np.meshgrid(*[[-1, 0, 1]] * D, indexing="ij"), -1).reshape(-1, D)[:, ::-1]
    return element, N, G, nodes[element][:, None] + steps * h, h


def inside(dim, n=200, seed=1):
    """Places [m] one cell away from the edges."""
    h, counts = np.array([0.5, 0.4, 0.3][:dim]), np.array([4, 3, 3][:dim])
    return h + np.random.default_rng(seed).uniform(size=(n, dim)) * (counts - 2) * h


def test_functions_sum_to_one_and_reproduce_linear_fields(dim):
    x = inside(dim)
    domain = np.random.default_rng(2).uniform(0.02, 0.15, x.shape)
    _, N, G, place, _ = at(x, domain)
    np.testing.assert_allclose(N.sum(axis=1), 1.0, atol=1e-14)
    np.testing.assert_allclose(G.sum(axis=2), 0.0, atol=1e-12)
    np.testing.assert_allclose(np.einsum("pa,pai->pi", N, place), x, atol=1e-14)
    np.testing.assert_allclose(np.einsum("pai,pja->pij", place, G), np.tile(np.eye(dim), (len(x), 1, 1)),
                               atol=1e-12)
    assert (N >= 0.0).all()


def test_functions_are_means_over_the_domain(dim):
    """By a midpoint rule, of the hats max(0, 1 - |x| / h)."""
    x, domain, m = inside(dim, 20), np.full((20, dim), 0.08), 4000
    _, N, G, place, h = at(x, domain)
    part = (np.arange(m) + 0.5) / m * 2.0 - 1.0
    means, slopes = np.ones(N.shape), np.ones(G.shape)
    for d in range(dim):
        r = (x[:, None, d] - place[..., d])[..., None] + 0.08 * part
        mean = np.maximum(0.0, 1.0 - np.abs(r) / h[d]).mean(axis=2)
        hats = [np.maximum(0.0, 1.0 - np.abs(x[:, None, d] - place[..., d] + s * 0.08) / h[d])
                for s in (1, -1)]
        means *= mean
        for i in range(dim):
            slopes[:, i] *= (hats[0] - hats[1]) / 0.16 if i == d else mean
    np.testing.assert_allclose(N, means, atol=1e-6)
    np.testing.assert_allclose(G, slopes, atol=1e-5)


def test_half_a_cell_gives_quadratic_b_splines(dim):
    x, h = inside(dim), np.array([0.5, 0.4, 0.3][:dim])
    _, N, _, place, _ = at(x, np.tile(0.5 * h, (len(x), 1)))
    r = np.abs(x[:, None] - place) / h
    spline = np.where(r < 0.5, 0.75 - r**2, 0.5 * np.maximum(0.0, 1.5 - r) ** 2)
    np.testing.assert_allclose(N, spline.prod(axis=2), atol=1e-14)


def test_gradients_are_continuous_over_cell_borders(dim):
    """The linear basis jumps there by as much as its gradients are."""
    h = np.array([0.5, 0.4, 0.3][:dim])
    x = np.tile(2.0 * h[:dim] * 0.999999, (2, 1))
    x[1] = 2.0 * h[:dim] * 1.000001
    x = np.minimum(x, np.array([4, 3, 3][:dim]) * h - 0.9 * h)
    element, _, G, _, _ = at(x, np.full(x.shape, 0.07))
    assert element[0] == element[1]
    np.testing.assert_allclose(G[0], G[1], atol=1e-3)


def test_domains_follow_the_second_moments(dim):
    """A turned square box stays what it is; a stretched one is as wide as its image."""
    x, half = inside(dim, 50), 0.06
    c, s = np.cos(0.7), np.sin(0.7)
    turn = np.eye(dim)
    turn[:2, :2] = [[c, -s], [s, c]]
    stretch = np.diag([1.5, 0.8, 1.1][:dim])
    for F, wanted in ((turn, np.full(dim, half)), (stretch, half * np.diag(stretch))):
        _, N, _, _, _ = at(x, np.full(x.shape, half), np.tile(F, (len(x), 1, 1)))
        _, own, _, _, _ = at(x, np.tile(wanted, (len(x), 1)))
        np.testing.assert_allclose(N, own, atol=1e-14)


def test_at_the_edge_of_the_grid_nothing_leaves(dim):
    """A domain shrinks with the distance to the edge, on which a point hangs on the nodes there alone; beyond
    it, within the margin, the linear field goes on."""
    h, counts = np.array([0.5, 0.4, 0.3][:dim]), np.array([4, 3, 3][:dim])
    for edge, node in ((0.0, 0.0), (1.0, 1.0)):
        x = np.tile(0.4 * counts * h, (3, 1))
        x[:, 0] = edge * counts[0] * h[0] + np.array([0.0, 0.01, -0.01]) * (1.0 - 2.0 * edge)
        _, N, G, place, _ = at(x, np.full(x.shape, 0.07))
        np.testing.assert_allclose(N.sum(axis=1), 1.0, atol=1e-14)
        np.testing.assert_allclose(np.einsum("pa,pai->pi", N, place), x, atol=1e-14)
        on_edge = np.abs(place[0, :, 0] - node * counts[0] * h[0]) < 1e-12
        np.testing.assert_allclose(N[0][~on_edge], 0.0, atol=1e-15)
        np.testing.assert_allclose(np.einsum("pa,pa->p", G[:, 0], place[:, :, 0]), 1.0, atol=1e-12)


# ---------------------------------------------------------------- the MPM with them


def block(dim, basis, law=None, inertia="consistent", f_bar=False, velocity=0.0, **scene):
    """A body of 3 x 2 [x 1] cells in a wide grid."""
    size = (0.3, 0.2, 0.1)[:dim]
    body = Body(Box((0.2,) * dim, tuple(np.add(size, 0.2))), (3, 2, 1)[:dim], 2,
                law or neo_hooke(1e4, 0.3), 1000.0, f_bar=f_bar, velocity=velocity)
    return MPM(Grid(Box((0.0,) * dim, (0.8, 0.7, 0.5)[:dim]), (8, 7, 5)[:dim]), body, inertia=inertia,
               basis=basis, **scene)


def spin(x):
    v = np.zeros(x.shape)
    v[:, 0], v[:, 1] = -(x[:, 1] - 0.3), x[:, 0] - 0.35
    return v


@pytest.mark.parametrize("basis", BASES)
def test_free_fall_and_momentum(dim, basis, options):
    options(snes_rtol=1e-13, snes_atol=1e-13)
    g = (0.5, -9.0, 1.0)[:dim]
    solid = block(dim, basis, gravity=g, velocity=spin)
    before, mass = solid.momentum(), solid.points.mass.sum()
    for _ in range(5):
        solid.advance(2e-3)
    np.testing.assert_allclose(solid.momentum() - before, mass * np.array(g) * 0.01, rtol=1e-9, atol=1e-10)
    solid.close()


@pytest.mark.parametrize("f_bar", [False, True])
@pytest.mark.parametrize("inertia", ["consistent", "lumped", "ghost"])
@pytest.mark.parametrize("basis", BASES)
def test_tangent_is_the_derivative_of_the_residual(dim, basis, inertia, f_bar):
    """By central differences, after a step in which the body has deformed."""
    solid = block(dim, basis, inertia=inertia, f_bar=f_bar, velocity=lambda x: spin(x) * (1.0 + x[:, :1]))
    for _ in range(3):
        solid.advance(5e-2)
    solid._locate()
    step = solid.step
    step.begin(5e-2, solid.time, np.zeros((0, dim)))
    equations, n = step.equations, step.active_cells.owned
    rng = np.random.default_rng(3)
    u = 5e-2 * step.grid.v[:n] + rng.uniform(-2e-3, 2e-3, (n, dim))
    u[equations.known.idle] = 0.0
    du = rng.uniform(-1.0, 1.0, (n, dim))
    du[equations.known.idle] = 0.0
    r = np.empty((n, dim))
    trial = equations.residual(u, r)
    equations.tangent(trial)
    x, y = step.active_cells.matrix.createVecs()
    x.array_w[:] = du.ravel()
    step.active_cells.matrix.mult(x, y)
    slopes, eps = [], 1e-6
    for sign in (1.0, -1.0):
        equations.residual(u + sign * eps * du, r)
        slopes.append(r.copy())
    slope = (slopes[0] - slopes[1]) / (2.0 * eps)
    np.testing.assert_allclose(y.array.reshape(n, dim), slope, rtol=0, atol=2e-7 * np.abs(slope).max())
    solid.close()


@pytest.mark.parametrize("basis", BASES)
def test_state_continues_bit_for_bit(dim, basis):
    solid = block(dim, basis, law=mohr_coulomb(1e5, 0.3, friction_angle=30.0), inertia="lumped", f_bar=True,
                  velocity=spin)
    for _ in range(3):
        solid.advance(1e-2)
    state = solid.get_state()
    for _ in range(3):
        solid.advance(1e-2)
    after = solid.points.copy()
    other = solid.anew()
    other.set_state(state)
    for _ in range(3):
        other.advance(1e-2)
    for name, values in after.items():
        assert np.array_equal(getattr(other.points, name), values), name


def test_points_do_not_pass_held_nodes_at_the_edge():
    """A drop falls on a floor that is the edge of the grid."""
    body = Body(Box((0.2, 0.02), (0.5, 0.22)), (6, 4), 2, mohr_coulomb(1e5, 0.3, friction_angle=30.0), 1000.0,
                f_bar=True)
    solid = MPM(Grid(Box((0.0, 0.0), (0.8, 0.4)), (16, 8)), body, [Support(lambda x: x[:, 1] < 1e-9, "y")],
                gravity=(0.0, -9.81), inertia="lumped", basis="ugimp")
    for _ in range(60):
        solid.advance(2e-3)
    assert solid.points.x[:, 1].min() > 0.0


def test_seeded_evenly_with_domains_that_fill_the_body(dim):
    solid = block(dim, "ugimp")
    p = solid.points
    np.testing.assert_allclose(p.domain, np.tile(0.998 * 0.025, p.x.shape))
    np.testing.assert_allclose(np.prod(2.0 * p.domain / 0.998, axis=1), p.V0)
    np.testing.assert_allclose(np.diff(np.unique(p.x[:, 0].round(12))), 0.05)


def test_refuses_other_grids_in_one_sentence():
    body = Body(Box((0.0, 0.0), (1.0, 1.0)), (2, 2), 2, neo_hooke(1.0, 0.3), 1.0)
    box = Box((0.0, 0.0), (1.0, 1.0))
    vertices, cells = lattice(box, (2, 2), "quadrilateral")
    for grid, what in ((Grid(box, (2, 2), "triangle"), "Grid of triangle cells"),
                       (Mesh(vertices, cells, "quadrilateral"), "Mesh")):
        with pytest.raises(ValueError, match=f"basis=ugimp needs a regular Grid.*{what}"):
            MPM(grid, body, basis="ugimp")
    with pytest.raises(ValueError, match="basis is 'spline': choose one of linear, gimp"):
        Numerics(basis="spline")
