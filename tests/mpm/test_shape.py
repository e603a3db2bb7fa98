"""Basis functions at the points, with basix as the oracle; D = 3 cells too, the kernels are one source."""
import basix
import numpy as np
import pytest

from mpm_fenicsx.shape import affine_maps, shapes, vertices_of_axes
from mpm_fenicsx.specialise import specialise

EPS = np.finfo(float).eps
DIMS = {"triangle": 2, "quadrilateral": 2, "tetrahedron": 3, "hexahedron": 3}


@pytest.fixture(params=DIMS)
def sample(request):
    """Random points of one skewed cell: basix' vertices moved by an affine map x = o + J xi, cell name, xi, x, N, G."""
    name, D = request.param, DIMS[request.param]
    random = np.random.default_rng(1)
    J, o = np.eye(D) + random.uniform(-0.4, 0.4, (D, D)), random.normal(size=D)
    corners = basix.geometry(getattr(basix.CellType, name)) @ J.T + o
    xi = random.dirichlet(np.ones(D + 1), 20)[:, :D]  # inside the simplex, hence inside the tensor cell
    x = xi @ J.T + o
    N, G = np.empty((20, len(corners))), np.empty((20, len(corners), D))
    origin, inverse = affine_maps(corners, np.arange(len(corners))[None], name)
    specialise(shapes, D=D, K=len(corners))(np.zeros(20, np.int32), x, origin, inverse, N, G)
    return name, corners, J, xi, x, N, G


def test_partition_of_unity(sample):
    """sum N = 1, sum grad N = 0."""
    *_, N, G = sample
    np.testing.assert_allclose(N.sum(axis=1), 1.0, rtol=0, atol=10 * EPS)
    np.testing.assert_allclose(G.sum(axis=1), 0.0, rtol=0, atol=20 * EPS)


def test_values_and_gradients_are_those_of_basix(sample):
    name, _, J, xi, _, N, G = sample
    element = basix.create_element(basix.ElementFamily.P, getattr(basix.CellType, name), 1)
    table = element.tabulate(1, xi)[..., 0]  # value, then the derivatives along xi
    np.testing.assert_allclose(N, table[0], rtol=0, atol=10 * EPS)
    np.testing.assert_allclose(G, np.einsum("dpk,de->pke", table[1:], np.linalg.inv(J)), rtol=0, atol=30 * EPS)


def test_linear_fields_are_reproduced(sample):
    """sum N x_a = x, sum x_a grad N = I."""
    _, corners, _, _, x, N, G = sample
    np.testing.assert_allclose(N @ corners, x, rtol=0, atol=20 * EPS)
    expected = np.broadcast_to(np.eye(x.shape[1]), (len(x), x.shape[1], x.shape[1]))
    np.testing.assert_allclose(np.einsum("ai,paj->pij", corners, G), expected, rtol=0, atol=30 * EPS)


def test_a_basis_function_is_one_at_its_vertex_alone(sample):
    name, corners, *_ = sample
    n, D = len(corners), corners.shape[1]
    N, G = np.empty((n, n)), np.empty((n, n, D))
    origin, inverse = affine_maps(corners, np.arange(n)[None], name)
    specialise(shapes, D=D, K=n)(np.zeros(n, np.int32), corners, origin, inverse, N, G)
    np.testing.assert_allclose(N, np.eye(n), rtol=0, atol=10 * EPS)


def test_axes_of_the_reference_cell_follow_basix():
    for name, D in DIMS.items():
        corners = basix.geometry(getattr(basix.CellType, name))
        np.testing.assert_array_equal(corners[list(vertices_of_axes(name, D))], np.eye(D))


def test_a_flat_cell_is_refused():
    x = np.array([[0.0, 0.0], [1.0, 1.0], [2.0, 2.0]])
    with pytest.raises(ValueError, match="cell 0 of the grid has no volume"):
        affine_maps(x, np.array([[0, 1, 2]]), "triangle")
