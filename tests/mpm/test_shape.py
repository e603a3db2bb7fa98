"""Basis functions at the points, with basix as the oracle; D = 3 cells too, the kernels are one source."""
import basix
import numpy as np
import pytest

from mpm_fenicsx.basis.shape import affine_shapes, cell_maps, reference, shapes
from mpm_fenicsx.compiled import specialise

EPS = np.finfo(float).eps
DIMS = {"triangle": 2, "quadrilateral": 2, "tetrahedron": 3, "hexahedron": 3}


def tabulate(cells, corners, cell, x):
    """N and G at points x in cells of vertices ``corners``, by the project's kernels."""
    D, K = corners.shape[1], cells.shape[1]
    maps, affine = cell_maps(corners, cells)
    N, G = np.empty((len(x), K)), np.empty((len(x), D, K))
    if affine:
        kernel = specialise(affine_shapes, D=D, K=K)
    else:
        kernel = specialise(shapes, D=D, K=K, to_reference=specialise(reference, D=D, K=K, AFFINE=False))
    kernel(cell, x, maps, N, G)
    return N, G, affine


@pytest.fixture(params=[(name, bent) for name in DIMS for bent in (False, True) if not bent
                        or name[0] in "qh"], ids=lambda p: p[0] + " bent" * p[1])
def sample(request):
    """Random points of one cell: basix' vertices moved by an affine map o + J xi, and for a bent cell each by
    up to
    0.15 more. Cell name, vertices, xi, x, N, G."""
    (name, bent), D = request.param, DIMS[request.param[0]]
    random = np.random.default_rng(1)
    J, o = np.eye(D) + random.uniform(-0.4, 0.4, (D, D)), random.normal(size=D)
    corners = basix.geometry(getattr(basix.CellType, name)) @ J.T + o
    corners += bent * random.uniform(-0.15, 0.15, corners.shape)
    xi = random.dirichlet(np.ones(D + 1), 20)[:, :D]  # inside the simplex, hence inside the tensor cell
    x = table_of(name, xi)[0] @ corners
    N, G, affine = tabulate(np.arange(len(corners))[None], corners, np.zeros(20, np.int32), x)
    assert affine is not bent
    return name, corners, xi, x, N, G


def table_of(name, xi):
    """Values and derivatives along xi by basix, (1 + D, points, K)."""
    return basix.create_element(basix.ElementFamily.P, getattr(basix.CellType, name), 1).tabulate(1, xi)[...,
                                                                                                         0]


def test_partition_of_unity(sample):
    """sum N = 1, sum grad N = 0."""
    *_, N, G = sample
    np.testing.assert_allclose(N.sum(axis=1), 1.0, rtol=0, atol=10 * EPS)
    np.testing.assert_allclose(G.sum(axis=2), 0.0, rtol=0, atol=20 * EPS)


def test_values_and_gradients_are_those_of_basix(sample):
    name, corners, xi, _, N, G = sample
    table = table_of(name, xi)
    J = np.einsum("ai,dpa->pid", corners, table[1:])
    np.testing.assert_allclose(N, table[0], rtol=0, atol=30 * EPS)
    np.testing.assert_allclose(G, np.einsum("dpk,pde->pek", table[1:], np.linalg.inv(J)), rtol=0,
                               atol=300 * EPS)


def test_linear_fields_are_reproduced(sample):
    """sum N x_a = x, sum x_a grad N = I."""
    _, corners, _, x, N, G = sample
    np.testing.assert_allclose(N @ corners, x, rtol=0, atol=20 * EPS)
    expected = np.broadcast_to(np.eye(x.shape[1]), (len(x), x.shape[1], x.shape[1]))
    np.testing.assert_allclose(np.einsum("ai,pja->pij", corners, G), expected, rtol=0, atol=100 * EPS)


def test_a_basis_function_is_one_at_its_vertex_alone(sample):
    _, corners, *_ = sample
    n = len(corners)
    N, _, _ = tabulate(np.arange(n)[None], corners, np.zeros(n, np.int32), corners)
    np.testing.assert_allclose(N, np.eye(n), rtol=0, atol=30 * EPS)
