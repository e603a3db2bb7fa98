"""Walls for the DEM tests."""
import numpy as np
import pytest

from dem_liggghts import Wall


@pytest.fixture
def sheet():
    """``sheet(dim, cells, size, height)``: wall over [-size/2, size/2] (^2 in space) facing up the last axis, ``cells``
    segments or squares of two triangles, at height(x)."""
    return make_sheet


def make_sheet(dim=2, cells=8, size=0.1, height=None):
    x = np.linspace(-size / 2, size / 2, cells + 1)
    height = height or np.zeros_like
    if dim == 2:
        return Wall(np.column_stack([x, height(x)]), np.column_stack([np.arange(cells), np.arange(1, cells + 1)]))
    X, Y = (a.ravel() for a in np.meshgrid(x, x, indexing="ij"))
    a = (np.arange(cells)[:, None] * (cells + 1) + np.arange(cells)).ravel()
    b, c, d = a + cells + 1, a + cells + 2, a + 1
    return Wall(np.column_stack([X, Y, height(X)]), np.concatenate([np.column_stack([a, b, c]),
                                                                    np.column_stack([a, c, d])]))


@pytest.fixture(params=[2, 3], ids=["plane", "space"])
def dim(request):
    return request.param
