"""Rocks that overlap the bodies of the solid at the start are refused, whoever computes them."""
import numpy as np
import pytest

from coupling import Output, Run, Scheme
from dem_liggghts import Cluster, Material, Scene, Spheres, Wall
from mpm_fenicsx import MPM, Balls, Body, Box, Grid, Interface, linear

RUBBER = Material(1e7, 0.3)


def solid_with(interface, dim=2):
    """A block of 0.1 m, and another one beside it."""
    blocks = [Body(Box((x,) + (0.0,) * (dim - 1), (x + 0.1,) + (0.1,) * (dim - 1)), (4,) * dim, 2,
                   linear(1e7, 0.3), 1000.0) for x in (0.0, 0.2)]
    return MPM(Grid(Box((-0.05,) * dim, (0.35,) + (0.15,) * (dim - 1)), (16,) + (8,) * (dim - 1)), blocks,
               interface=interface)


def run(solid, wall, backend, out, **rocks):
    grains = Scene(wall=wall, material=RUBBER, wall_material=RUBBER, **rocks)
    return Run("block", solid, grains, Scheme(dt=1e-4, t_end=1e-4, substeps=10, dem=backend), Output(out))


def discs(dim=2):
    return Wall.discs(np.zeros((0, dim)), 0.006)


@pytest.mark.parametrize("depth", [0.0014, 0.0016])
def test_a_sphere_in_the_balls_of_the_soil(backend, tmp_path, depth):
    """A quarter of their radius is allowed."""
    solid = solid_with(Balls(0.006))
    x = solid.matter()[0].x
    top = x[np.argmax(x[:, 1])] + [0.0, 0.026 - depth]
    ball = Spheres([top], [[0.0, 0.0]], 0.02, 2500.0)
    if depth < 0.0015:
        assert len(run(solid, discs(), backend, tmp_path, spheres=ball).go()[backend]) == 1
        return
    told = (r"sphere 1 overlaps the balls of 0.006 m radius of body 1 by 0.0016 m at the start.* move it .*"
            r"Body.without\(rocks, gap=0.006\)")
    with pytest.raises(ValueError, match=told):
        run(solid, discs(), backend, tmp_path, spheres=ball)


def test_a_cluster_in_a_body_in_space(backend, tmp_path):
    solid = solid_with(Balls(0.006), dim=3)
    rock = Cluster.of_spheres([[0.0, 0.0, 0.0], [0.02, 0.0, 0.0]], 0.015, 2500.0, (0.25, 0.05, 0.05))
    with pytest.raises(ValueError, match="cluster 1 overlaps the balls of 0.006 m radius of body 2"):
        run(solid, discs(3), backend, tmp_path, clusters=[rock])


@pytest.mark.parametrize("where", ["surface", "other balls"])
def test_a_sphere_in_a_body_without_balls(backend, tmp_path, where):
    """One with a surface elsewhere, and one that the balls leave out."""
    top = Interface.top(Box((0.0, 0.0), (0.1, 0.1)), (4,))
    solid = solid_with(top if where == "surface" else Balls(0.006, bodies=(0,)))
    wall = Wall(top.x, top.elements) if where == "surface" else discs()
    ball = Spheres([[0.25, 0.05]], [[0.0, 0.0]], 0.02, 2500.0)
    with pytest.raises(ValueError, match=r"sphere 1 overlaps the material points of body 2 by 0.01\d* m"):
        run(solid, wall, backend, tmp_path, spheres=ball)
    beside = Spheres([[0.25, 0.12]], [[0.0, 0.0]], 0.02, 2500.0)
    assert len(run(solid, wall, backend, tmp_path, spheres=beside).go()[backend]) == 1
