"""All four kinds of cells, bent ones too: patch and rigid motion, derivative of the whole residual, search,
state."""
import numpy as np
import pytest
from mpi4py import MPI

from mpm_fenicsx import LAWS, MPM, Body, Box, Grid, Interface, Mesh, Support, linear, neo_hooke
from mpm_fenicsx.basis.shape import ReferencePoint, reference
from mpm_fenicsx.compiled import specialise
from mpm_fenicsx.grid.background import Background, whole_mesh
from mpm_fenicsx.points.points import Points, gauss_rule

POINTS = {"quadrilateral": 2, "triangle": 3, "hexahedron": 2, "tetrahedron": 4}


@pytest.fixture(params=["linear", "neo_hooke"])
def law(request):
    """Elastic laws: how a body yields does not depend on its cells."""
    return LAWS[request.param](1.0, 0.3)



def dim(cell):
    return 2 if cell in ("quadrilateral", "triangle") else 3


def held(mesh, H):
    """One support for each vertex of the boundary, moved to H x within 1 s."""
    return [Support(lambda x, at=at: np.linalg.norm(x - at, axis=1) < 1e-6, "xyz"[:mesh.dim],
                    lambda t, at=at: t * (H @ at)) for at in mesh.vertices[np.unique(mesh.boundary())]]


def driven(mesh, law, H, options):
    """A body in the cells of the grid after a step in which its surface is displaced by H x, without
    inertia."""
    options(snes_rtol=1e-14, snes_atol=1e-15)
    solid = MPM(mesh, Body(mesh, None, POINTS[mesh.cell], law, 1e-16), held(mesh, H))
    old = solid.points.x.copy()
    solid.advance(1.0)
    solid.close()
    return solid, old


@pytest.mark.parametrize("counts", [None, 4])
def test_patch(distorted, options, any_cell, law, at_point, counts):
    """Linear displacement of the surface, by 10 %, makes the same stress at every point of bent cells, to
    round-off."""
    D = dim(any_cell)
    H = np.array([[0.1, 0.05, 0.02], [-0.03, -0.08, 0.04], [0.06, -0.01, 0.03]])[:D, :D]
    solid, old = driven(distorted(any_cell, counts and (counts,) * D), LAWS[law.name](1.0, 0.3), H, options)
    F, p = np.eye(D) + H, solid.points
    point = at_point(LAWS[law.name](1.0, 0.3), "plane_strain" if D == 2 else "three_dimensional")
    sigma = point.P(F) @ F.T / np.linalg.det(F)
    np.testing.assert_allclose(p.F, np.broadcast_to(F, p.F.shape), rtol=0, atol=1e-12)
    np.testing.assert_allclose(p.x, old @ F.T, rtol=0, atol=1e-12)
    np.testing.assert_allclose(solid.cauchy_stress(), np.broadcast_to(sigma, p.F.shape), rtol=0, atol=1e-12)


def test_rigid_rotation_leaves_no_stress(distorted, options, any_cell):
    """By 0.2 rad within one step, about an axis across all of space."""
    D, angle = dim(any_cell), 0.2
    axis = np.array([1.0, 2.0, 2.0]) / 3 if D == 3 else np.array([0.0, 0.0, 1.0])
    W = np.cross(np.eye(3), axis) * -1.0
    R = (np.eye(3) + np.sin(angle) * W + (1 - np.cos(angle)) * W @ W)[:D, :D]
    solid, old = driven(distorted(any_cell), neo_hooke(1.0, 0.3), R - np.eye(D), options)
    assert abs(R @ R.T - np.eye(D)).max() < 1e-15
    np.testing.assert_allclose(solid.points.x, old @ R.T, rtol=0, atol=1e-12)
    assert abs(solid.cauchy_stress()).max() < 1e-12


@pytest.mark.parametrize("inertia", ["consistent", "lumped"])
def test_uniform_motion_through_bent_cells(distorted, any_cell, inertia):
    """Across four to five cells: no stress, same momentum; boundary particles go along."""
    D = dim(any_cell)
    mesh = distorted(any_cell, (8, 4, 4)[:D], box=Box((0.0,) * D, (4.0, 2.0, 2.0)[:D]))
    box = Box((0.6,) * D, (1.4,) * D)
    v = np.array([1.0, 0.2, 0.1])[:D]
    x = np.array([np.full(D, 1.0), np.full(D, 1.3)])
    solid = MPM(mesh, Body(box, (2,) * D, POINTS[any_cell], linear(1e3, 0.3), 1.0, cell=any_cell, velocity=v),
                interface=Interface(x, np.zeros((0, D), int)), inertia=inertia)
    start, momentum = solid.points.x.copy(), solid.momentum()
    for _ in range(16):
        solid.advance(0.14)
    np.testing.assert_allclose(solid.points.x, start + 2.24 * v, rtol=0, atol=1e-12)
    np.testing.assert_allclose(solid.surface()[0], x + 2.24 * v, rtol=0, atol=1e-12)
    np.testing.assert_allclose(solid.momentum(), momentum, rtol=1e-12)
    assert abs(solid.cauchy_stress()).max() < 1e-11 * 1e3
    solid.close()


@pytest.mark.parametrize("inertia", ["consistent", "lumped"])
def test_matrix_is_the_derivative_of_the_residual(distorted, any_cell, law, taylor_rate, inertia):
    """r(u + h du) = r(u) + h K du + O(h^2), with random deformation, velocity, acceleration and load, on bent
    cells."""
    D, random = dim(any_cell), np.random.default_rng(2)
    mesh = distorted(any_cell)
    box = Box((0.3,) * D, (1.6, 1.2, 0.7)[:D])
    solid = MPM(mesh, Body(box, (3, 2, 2)[:D], POINTS[any_cell], LAWS[law.name](1e3, 0.3), 1.0,
                           cell=any_cell), [Support(lambda x: x[:, 0] < 0.1, "xyz"[:D])],
                Interface(np.full((1, D), 0.6), np.zeros((0, D), int)), inertia=inertia)
    p, step = solid.points, solid.step
    p.F += random.uniform(-0.1, 0.1, p.F.shape)
    p.v += random.normal(size=p.v.shape)
    p.a += random.normal(size=p.a.shape)
    step.begin(0.02, 0.0, random.normal(size=(1, D)))
    free = ~step.active_cells.fixed & step.active[:, None]
    u, du = np.where(free, random.uniform(-0.02, 0.02, (2, *free.shape)), 0.0)

    def residual(at):
        r = np.empty(free.shape)
        step.equations.residual(at, r)
        return r.ravel()

    step.newton.make_tangent(step.equations.residual(u, np.empty(free.shape)))
    K = step.active_cells.matrix.convert("dense").getDenseArray().copy()
    rate = taylor_rate(lambda h: residual(u + h * du), K @ du.ravel(), h=1e-2)
    assert rate == pytest.approx(2.0, abs=0.02) and free.sum() > 10
    np.testing.assert_allclose(K, K.T, rtol=0, atol=1e-13 * abs(K).max())
    solid.close()


# ---------------------------------------------------------------- search


def inside_points(mesh, n=500, seed=3):
    """Positions [m], shape (n, D), well inside known cells, and these cells."""
    random = np.random.default_rng(seed)
    cell = random.integers(len(mesh.cells), size=n)
    xi, w = gauss_rule(mesh.cell, 3 if mesh.dim == 2 or mesh.cell == "hexahedron" else 4)
    corner, D = mesh.vertices[mesh.cells[cell]], mesh.dim
    xi = xi[random.integers(len(xi), size=n)]
    if len(mesh.cells[0]) == D + 1:
        N = np.column_stack([1 - xi.sum(axis=1), xi])
    else:
        N = np.stack([np.prod([xi[:, d] if (a >> d) & 1 else 1 - xi[:, d] for d in range(D)], axis=0)
                      for a in range(2**D)], axis=1)
    return np.einsum("pa,pai->pi", N, corner), cell


def points_at(x):
    return Points(gid=np.arange(len(x)), cell=np.zeros(len(x), np.int32), x=x)


@pytest.fixture
def bent(distorted, any_cell):
    mesh = distorted(any_cell, (7, 6, 5)[:dim(any_cell)])
    return mesh, Background(mesh, MPI.COMM_SELF, np.zeros((0, mesh.dim)))


def test_the_tree_finds_the_cell_of_every_point(bent):
    mesh, background = bent
    x, cell = inside_points(mesh)
    rank, number = background.search.relocate(points_at(x))
    assert (rank == 0).all()
    np.testing.assert_array_equal(background.original_cell[background.search.local(number)], cell)


def test_the_walk_finds_the_cell_of_every_point(bent):
    """From the cell of another point at random; what the walk loses, Newton's inverse map having failed far
    away or the way being barred by the boundary, the tree finds. Between neighbours the walk alone is
    enough."""
    mesh, background = bent
    (x, cell), (other, _) = inside_points(mesh), inside_points(mesh, seed=4)
    points = points_at(other)
    points.cell[:] = background.search.local(background.search.relocate(points)[1])
    points.x = np.ascontiguousarray(x)
    found = background.search._found(points)
    reached = found >= 0
    np.testing.assert_array_equal(background.original_cell[found[reached]], cell[reached])
    assert reached.mean() > 0.9
    rank, number = background.search.destinations(points)
    np.testing.assert_array_equal(background.original_cell[background.search.local(number)], cell)


def test_a_kuhn_lattice_is_found_as_by_walking():
    grid = Grid(Box((0.0, 0.0, 0.0), (2.0, 1.5, 1.0)), (5, 4, 3), "tetrahedron")
    mesh = Mesh(*whole_mesh(grid), "tetrahedron")
    x, cell = inside_points(mesh)
    for scene in (grid, mesh):
        background = Background(scene, MPI.COMM_SELF, np.zeros((0, 3)))
        points = points_at(x)
        rank, number = background.search.relocate(points)
        np.testing.assert_array_equal(background.original_cell[background.search.local(number)], cell)


@pytest.mark.parametrize("x", [(2.1, 1.0, 0.5), (-1e-6, 1.0, 0.5), (np.nan, 1.0, 0.5)])
def test_outside_is_nowhere(bent, x):
    mesh, background = bent
    points = points_at(np.array([x[:mesh.dim]]))
    assert background.search.locate(points, np.zeros(len(background.cells), np.int32))[0]
    assert background.search.destinations(points)[0][0] == -1


def test_the_inverse_map_of_bent_cells(bent):
    """The map of the reference coordinates found is the point, to round-off."""
    mesh, background = bent
    x, cell = inside_points(mesh, 50)
    D, K = mesh.dim, mesh.cells.shape[1]
    kernel = specialise(reference, D=D, K=K, AFFINE=background.affine)
    assert background.affine == (K == D + 1)
    local = np.argsort(background.original_cell)[cell]
    found = ReferencePoint(np.empty(D), np.empty((D, D)), np.empty(K), np.empty((K, D)), np.empty((D, D)))
    for p in range(len(x)):
        kernel(p, local[p], x, background.maps, found)
        np.testing.assert_allclose(found.value @ mesh.vertices[mesh.cells[cell[p]]], x[p], rtol=0, atol=1e-14)


# ---------------------------------------------------------------- state


@pytest.mark.parametrize("kind", ["lattice", "bent"])
@pytest.mark.parametrize("cell", ["hexahedron", "tetrahedron"])
def test_going_back_repeats_the_run_in_space(distorted, cell, kind):
    """Bit for bit, over a change of the active cells."""
    box = Box((0.0, 0.0, 0.0), (4.0, 2.0, 2.0))
    grid = Grid(box, (8, 4, 4), cell) if kind == "lattice" else distorted(cell, (8, 4, 4), box=box)
    body = Body(Box((0.6, 0.6, 0.6), (1.4, 1.4, 1.4)), (2, 2, 2), POINTS[cell], neo_hooke(1e3, 0.3), 1.0,
                cell=cell, velocity=lambda x: np.column_stack([2.0 + x[:, 1], -x[:, 0], 0.3 * x[:, 2]]))
    solid = MPM(grid, body, inertia="lumped", gravity=(0.0, 0.0, -1.0))
    for _ in range(2):
        solid.advance(0.02)
    state, filled, ends = solid.get_state(), solid.step.filled.copy(), []
    for _ in range(2):
        solid.set_state(state)
        for _ in range(12):
            solid.advance(0.02)
        ends.append(solid.get_state())
    assert not np.array_equal(filled, solid.step.filled)
    for name in ends[0].keys() - {"tangent"}:
        assert ends[0][name].tobytes() == ends[1][name].tobytes(), name
    solid.close()
