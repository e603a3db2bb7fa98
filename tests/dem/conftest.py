"""Walls and scenes for the DEM tests."""
import numpy as np
import pytest

from dem_liggghts import Cluster, Interaction, Material, Scene, Spheres, Wall


@pytest.fixture
def sheet():
    """``sheet(dim, cells, size, height)``: wall over [-size/2, size/2] (^2 in space) facing up the last axis,
    ``cells`` segments or squares of two triangles, at height(x)."""
    return make_sheet


def make_sheet(dim=2, cells=8, size=0.1, height=None):
    x = np.linspace(-size / 2, size / 2, cells + 1)
    height = height or np.zeros_like
    if dim == 2:
        return Wall(np.column_stack([x, height(x)]),
                    np.column_stack([np.arange(cells), np.arange(1, cells + 1)]))
    X, Y = (a.ravel() for a in np.meshgrid(x, x, indexing="ij"))
    a = (np.arange(cells)[:, None] * (cells + 1) + np.arange(cells)).ravel()
    b, c, d = a + cells + 1, a + cells + 2, a + 1
    return Wall(np.column_stack([X, Y, height(X)]), np.concatenate([np.column_stack([a, b, c]),
                                                                    np.column_stack([a, c, d])]))


@pytest.fixture(params=[2, 3], ids=["plane", "space"])
def dim(request):
    return request.param


@pytest.fixture
def tumble():
    """``tumble(dim, friction)``: a scene of five spheres of two sizes thrown at each other and at a bent
    wall, and how the wall waves and stretches: ``window(t, length)`` gives its nodes and velocities."""
    return make_tumble


def make_tumble(dim, friction=0.3, restitution=0.7):
    random, up = np.random.default_rng(3), np.eye(dim)[-1]
    wall = make_sheet(dim, 9, 0.2, height=lambda x: 1e-3 * np.cos(40 * x))
    x, v, omega = np.zeros((5, dim)), 0.3 * random.normal(size=(5, dim)), np.zeros((5, 3))
    x[:, 0] = np.linspace(-0.03, 0.03, 5) + 1e-3 * random.normal(size=5)
    x[:, -1], v[:, -1] = 0.013 + 0.002 * random.random(5), -0.4
    omega[:, 2 if dim == 2 else 1] = 30 * random.normal(size=5)
    meet = Interaction(restitution, friction)
    balls = Spheres(x, v, [7e-3, 6e-3, 7e-3, 6e-3, 7e-3], 2500.0, omega)
    scene = Scene(balls, wall, Material(1e7, 0.3), Material(2e7, 0.2), meet, meet, gravity=-9.81 * up)

    def window(t, length):
        at = [wall.nodes * (1 + 0.05 * np.sin(30 * s)) + 1e-3 * np.sin(200 * s) * up for s in (t, t + length)]
        return at[0], (at[1] - at[0]) / length
    return scene, window


@pytest.fixture
def heap():
    """``heap(dim)``: as ``tumble``, with three clusters (a crooked one in space, one held) and two single
    spheres between a waving wall below, a fixed wall at the side, three materials, friction and adhesion."""
    return make_heap


def make_heap(dim):
    up, along = np.eye(dim)[-1], np.eye(dim)[0]
    wall = make_sheet(dim, 9, 0.2, height=lambda x: 1e-3 * np.cos(40 * x))
    side = make_sheet(dim, 1, 0.2)
    turned = np.roll(side.nodes, 1, axis=1) * ([1] * (dim - 1) + [-1])  # faces -x
    side = Wall(turned + 0.06 * along, side.elements if dim == 3 else side.elements[:, ::-1],
                material="steel")
    centres = np.zeros((4, dim))
    centres[1:, 0], centres[2:, -1] = 0.008, 0.008
    centres[3, dim - 2] += 0.008
    spin = 30.0 if dim == 2 else (10.0, 20.0, -30.0)
    clusters = [Cluster.of_spheres(centres, 5e-3, 1500.0, 0.028 * up - 0.035 * along,
                                   v=0.3 * along - 0.4 * up, omega=spin, material="wood"),
                Cluster.box([0.02] * dim, [3] * dim, 0.03 * up + 0.02 * along, 800.0, depth=0.02, v=-0.5 * up,
                            material="wood", **(dict(angle=0.4) if dim == 2 else {})),
                Cluster.box([0.01] * dim, [2] * dim, 0.016 * up - 0.005 * along, 800.0, depth=0.02,
                            free=False, material="steel")]
    balls = Spheres([0.05 * up, 0.016 * up + 0.047 * along], [-0.6 * up, 0.2 * along], 6e-3, 2500.0)
    rough, sticky = Interaction(0.6, 0.4), Interaction(0.3, 0.3, 2e4)
    names = ("spheres", "wood", "steel", "wall")
    scene = Scene(balls, wall, Material(1e7, 0.3), Material(2e7, 0.2), gravity=-9.81 * up, clusters=clusters,
                  walls=[side], materials={"wood": Material(8e6, 0.4), "steel": Material(3e7, 0.3)},
                  between=rough, at_wall=rough, interactions={(a, b): sticky if "wood" in (a, b) else rough
                                                              for a in names[1:] for b in names})

    def window(t, length):
        at = [wall.nodes * (1 + 0.05 * np.sin(30 * s)) + 1e-3 * np.sin(200 * s) * up for s in (t, t + length)]
        return at[0], (at[1] - at[0]) / length
    return scene, window
