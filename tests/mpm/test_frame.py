"""Coordinates as in maps: a scene there is the scene near zero, to the round-off of what goes in and comes
out."""
from dataclasses import replace

import numpy as np
import pytest
from mpi4py import MPI

from mpm_fenicsx import (
    MPM,
    Body,
    Box,
    Grid,
    GridWall,
    Interface,
    Load,
    Mesh,
    MPMError,
    Penalty,
    Resampling,
    Support,
    at_rest,
    linear,
    mohr_coulomb,
)
from mpm_fenicsx.grid.background import Background
from mpm_fenicsx.points.points import Points
from mpm_fenicsx.scene.frame import Frame, find_origin, shifted
from mpm_fenicsx.scene.lattice import lattice

MAP = np.array([4.5e5, 5.2e6, 1.2e3])  # [m], easting, northing, height
ULP = np.spacing(5.2e6)
LAW = linear(1e5, 0.3)


@pytest.mark.parametrize("lower, upper, origin", [
    ((0.0, -1.0), (2.0, 1.0), (0.0, 0.0)),
    ((100.0, -100.0), (102.0, -98.0), (0.0, 0.0)),  # bits of scenes near zero stay
    ((4.5e5, 5.2e6), (4.5e5 + 2.0, 5.2e6 + 1.0), (4.5e5, 5.2e6)),
    ((4.5e5 - 2.0, 5.2e6 - 1.0), (4.5e5, 5.2e6), (4.5e5, 5.2e6)),  # as a scene beside zero
    ((4.5e5, 5.2e6), (4.5e5 + 800.0, 5.2e6 + 300.0), (4.5e5, 5.2e6)),
    ((-4.5e5 - 2.0, -1.0), (-4.5e5, 1.0), (-4.5e5, 0.0)),
    ((4.5e5 + 0.7, 300.0), (4.5e5 + 3.2, 301.3), (4.5e5, 300.0)),
])
def test_origin_moves_only_far_from_zero_and_exactly(lower, upper, origin):
    box = Box(lower, upper)
    found = find_origin(box)
    np.testing.assert_array_equal(found, origin)
    inside = np.random.default_rng(0).uniform(lower, upper, (1000, 2))
    np.testing.assert_array_equal((inside - found) + found, inside)


def scene(at, cell, counts, D, regular):
    """A body between walls with everything that has a place, moved by ``at``."""
    place = lambda *x: tuple(np.array(x[:D]) + at[:D])  # noqa: E731
    box = Box(place(-0.5, -0.5, -0.5), place(2.0, 1.5, 1.0))
    grid = Grid(box, counts, cell)
    if not regular:
        vertices, cells = lattice(Box((-0.5,) * D, (2.0, 1.5, 1.0)[:D]), counts, grid.cell)
        vertices += 0.04 * np.sin(5.0 * vertices[:, ::-1])
        grid = Mesh(vertices + at[:D], cells, grid.cell)
    body = Body(Box(place(0.0, 0.0, 0.0), place(1.0, 0.5, 0.5)), (4, 2, 2)[:D], 2, LAW, 1000.0,
                velocity=lambda x: 0.1 * (x - at[:D])[:, ::-1])
    top = Interface(np.array([place(0.1, 0.45, 0.2), place(0.9, 0.45, 0.2), place(0.5, 0.45, 0.4)]),
                    np.array([[0, 1], [1, 2]]) if D == 2 else np.array([[0, 2, 1]]))
    sole = replace(top, x=top.x - 0.4 * np.eye(D)[1])
    return MPM(grid, body, [Support(lambda x: x[:, 1] < at[1] + 0.1, "y")], top,
               gravity=(0.0, -9.81, 0.0)[:D], loads=[Load(top, pressure=100.0)],
               penalties=[Penalty(sole, (0.0, 1.0, 0.0)[:D], friction=0.3, follows=True,
                                  at=place(0.0, 0.0, 0.0)),
                          Penalty(replace(top, x=top.x - np.eye(D)[1] * 0.44), (0.0, 1.0, 0.0)[:D],
                                  motion=lambda t: (0.0, 0.01 * t, 0.0)[:D], name="moving"),
                          GridWall(lambda x: x[:, 0] < at[0] + 0.1, "+x", 0.2, name="side")],
               body_force=lambda x, t: 3.0 * (x - at[:D])[:, ::-1] + t)


CASES = [("quadrilateral", (9, 7), 2, True), ("triangle", (9, 7), 2, False),
         ("quadrilateral", (9, 7), 2, False), ("hexahedron", (5, 4, 3), 3, False)]


@pytest.mark.parametrize("cell, counts, D, regular", CASES)
def test_a_scene_on_the_map_is_the_scene_near_zero(cell, counts, D, regular):
    """Motion and forces agree to the round-off of the coordinates that go in; those that come out are
    true."""
    near, far = (scene(at, cell, counts, D, regular) for at in (np.zeros(3), MAP))
    assert not near.origin.any() and (far.origin == MAP[:D]).all()
    force = np.zeros((3, D))
    force[:, 1] = -50.0
    for _ in range(4):
        for solid in (near, far):
            solid.advance(1e-3, force)
    at = MAP[:D]
    assert np.abs(far.points.x - near.points.x - at).max() < 2 * ULP
    assert np.abs(far.surface()[0] - near.surface()[0] - at).max() < 2 * ULP
    assert np.abs(far.displacement() - near.displacement()).max() < 1e-5 * np.abs(near.displacement()).max()
    np.testing.assert_allclose(far.points.v, near.points.v, rtol=0, atol=1e-5 * np.abs(near.points.v).max())
    for name in ("penalty", "moving", "side"):
        np.testing.assert_allclose(far.reaction(name), near.reaction(name), rtol=1e-4, atol=1e-3)
    kinds = far.energy(), near.energy()
    assert kinds[0]["kinetic"] == pytest.approx(kinds[1]["kinetic"], rel=1e-5)
    shown, expected = far.snapshot(), near.snapshot()
    for name, (x, _, _) in expected.items():
        assert np.abs(shown[name][0] - x - at).max() < 2 * ULP, name
    for solid in (near, far):
        solid.close()


@pytest.mark.parametrize("cell, D", [("quadrilateral", 2), ("triangle", 2), ("hexahedron", 3),
                                     ("tetrahedron", 3)])
@pytest.mark.parametrize("regular", [True, False], ids=["grid", "mesh"])
def test_points_on_faces_and_inside_are_found(cell, D, regular):
    """Cells of 1 cm; points on their faces, which no double hits exactly, and inside. Outer faces count,
    too."""
    counts = (12, 10, 8)[:D]
    box = Box(tuple(MAP[:D]), tuple(MAP[:D] + 0.01 * np.array(counts)))
    vertices, cells = lattice(box, counts, cell)
    middle = 0.5 * (vertices.min(axis=0) + vertices.max(axis=0))
    if not regular:
        inner = (np.abs(vertices - middle) < 0.49 * box.size - 0.005).all(axis=1)
        vertices[inner] += 0.002 * np.random.default_rng(1).uniform(-1, 1, (inner.sum(), D))
    scene = Grid(box, counts, cell) if regular else Mesh(vertices, cells, cell)
    frame = Frame(scene.box)
    background = Background(frame.enter(scene), MPI.COMM_SELF, np.zeros((0, D)), origin=frame.origin)
    corner = vertices[cells]
    weights = np.random.default_rng(2).dirichlet(np.ones(cells.shape[1]), len(cells))
    half = corner[:, :2 ** (D - 1)] if cell in ("quadrilateral", "hexahedron") else corner[:, :D]
    for x in (np.einsum("ck,ckd->cd", weights, corner), half.mean(axis=1), corner.mean(axis=1), vertices):
        points = Points(gid=np.arange(len(x)), cell=np.zeros(len(x), np.int32), x=x - frame.origin)
        rank, number = background.search.assign(points.x)
        assert (rank == 0).all()
        points.cell[:] = background.search.local(number)
        assert background.search.locate(points, np.zeros(len(background.cells), np.int32)) == (0, 0)


def test_a_creeping_point_is_not_held_by_round_off():
    """Motion of a thousandth of the distance between doubles in each step adds up."""
    body = Body(Box(tuple(MAP[:2]), tuple(MAP[:2] + 0.1)), (2, 2), 2, LAW, 1000.0,
                velocity=np.array([0.0, 1e-9]))
    solid = MPM(Grid(Box(tuple(MAP[:2] - 0.1), tuple(MAP[:2] + 0.2)), (6, 6)), body, gravity=(0.0, 0.0))
    start = solid.get_state()["points.x"]
    for _ in range(20):
        solid.advance(1e-3)
    np.testing.assert_allclose(solid.get_state()["points.x"][:, 1] - start[:, 1], 2e-11, rtol=1e-4)
    with pytest.raises(ValueError, match="read-only"):
        solid.points.x[0] = 0.0
    solid.points.v[:] = 1.0  # other fields are its own
    np.testing.assert_allclose(solid.momentum(), 10.0, rtol=1e-7)
    solid.close()


def test_messages_have_true_coordinates():
    grid, size = Grid(Box(tuple(MAP[:2]), tuple(MAP[:2] + 1.0)), (4, 4)), np.array([0.5, 0.5])
    body = Body(Box(tuple(MAP[:2] + 0.25), tuple(MAP[:2] + 0.25 + size)), (2, 2), 2, LAW, 1.0,
                velocity=(9.0, 0.0))
    with pytest.raises(ValueError,
                       match=r"lies at \[ *450001.0\d* .*the grid covers \(450000.0, 5200000.0\)"):
        MPM(grid, replace(body, shape=Box(body.box.lower, tuple(MAP[:2] + 1.5))))
    with pytest.raises(ValueError, match=r"particle 0 of floor lies at \[ *449999.+ outside the grid"):
        MPM(grid, body, penalties=[Penalty(Interface(MAP[None, :2] - 1.0, np.zeros((0, 2), int)),
                                           name="floor")])
    solid = MPM(grid, body)
    with pytest.raises(MPMError, match=r"left the grid at x = \[45000\d\.\d+, 5200000\.\d+\] m"):
        for _ in range(10):
            solid.advance(0.01)
    solid.close()


def test_stress_and_resampling_move_along():
    """The rule of an outline and the initial stress are given in true coordinates."""
    soil = Body(Box(tuple(MAP[:2]), tuple(MAP[:2] + 0.2)), (4, 4), 3, mohr_coulomb(1e5, 0.3, 30.0), 1500.0,
                cell="triangle", stress=at_rest(MAP[1] + 0.2, 1500.0, 9.81, 0.5))
    outline = Interface.around(soil, open_sides=("x-", "y-"), floor="y-")
    solid = MPM(Grid(Box(tuple(MAP[:2]), tuple(MAP[:2] + 0.4)), (8, 8)), soil, interface=outline,
                gravity=(0.0, -9.81), supports=[Support(lambda x: x[:, 1] < MAP[1] + 0.01, "xy"),
                                                Support(lambda x: x[:, 0] < MAP[0] + 0.01, "x")],
                inertia="lumped")
    stress, depth = solid.cauchy_stress()[:, 1, 1], MAP[1] + 0.2 - solid.points.x[:, 1]
    np.testing.assert_allclose(stress, -1500.0 * 9.81 * depth, rtol=1e-2, atol=1.0)
    assert solid.interface.resampling.feet == outline.resampling.feet and isinstance(outline.resampling,
                                                                                     Resampling)
    np.testing.assert_array_equal(solid.interface.x, outline.x)
    solid.advance(1e-3)
    change = solid.resample()
    assert change is None or np.abs(change.x - MAP[:2]).max() < 0.4
    solid.close()


def test_what_is_no_part_of_a_scene_is_refused():
    with pytest.raises(TypeError, match="str is no part of a scene"):
        shifted("floor", np.zeros(2))
