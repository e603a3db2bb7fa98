"""Forces on regions in the history, and the books of momentum that they come from."""
import numpy as np
import pytest

from coupling import Output, Run, Scheme, Steps
from coupling.ledger.books import Books, regions
from dem_liggghts import Cluster, Material, Scene, Spheres, Wall
from dem_liggghts.common.booking import WallBooks
from mpm_fenicsx import LAWS, MPM, Balls, Body, Box, Grid, GridWall, Interface, Structure, Support
from mpm_fenicsx.terms.loads import PointForces

SOIL = LAWS["mohr_coulomb"](2e5, 0.3, 30.0, 0.0, 0.0)


def column(**more):
    """Soil that collapses between a wall and a floor."""
    body = Body(Box((0.0, 0.0), (0.1, 0.2)), (4, 8), 2, SOIL, 1500.0)
    floor = GridWall(lambda x: x[:, 1] < 1e-9, "+y", friction=0.4, separates=True, name="bed, rough")
    wall = Support(lambda x: x[:, 0] < 1e-9, "x", name="wall")
    return MPM(Grid(Box((0.0, 0.0), (0.4, 0.3)), (16, 12)), body, [wall], penalties=[floor],
               gravity=(0.0, -9.81), inertia="lumped", **more)


def test_a_solid_alone_has_forces_on_its_regions(tmp_path):
    """Impulses are the sums of mean forces, gravity's with theirs is the momentum, and all is booked; a run
    that goes on has the same rows."""
    solid = column()
    history = Run("column", solid, None, Steps(2e-3, 0.04), Output(
        tmp_path, checkpoint="end")).go()["solid"]
    impulse = np.cumsum(history["force_soil_bed_rough_y"]) * 2e-3
    np.testing.assert_allclose(history["impulse_bed_rough_y"], impulse, rtol=1e-12)
    given = history["impulse_bed_rough_x"][-1] + history["impulse_wall_x"][-1]
    left = solid.impulses()["numerical"][0]  # by Newton's method
    assert abs(left) < 1e-6 * abs(given) and solid.momentum()[0] == pytest.approx(left - given, rel=1e-12)
    assert history["momentum_error"].max() < 1e-12 and history["angular_error"].max() < 1e-12
    again = Run("column", column(), None, Steps(2e-3, 0.06), Output(tmp_path, restart=tmp_path)).go()["solid"]
    assert len(again) == 30 and list(again.columns) == list(history.columns)
    np.testing.assert_array_equal(again["force_soil_wall_x"][:20], history["force_soil_wall_x"])
    assert again["momentum_error"].max() < 1e-12


class Lying:
    """A solid that forgets the impulse of its wall."""

    dim, regions, given = 2, ("wall",), 0.0

    def momenta(self):
        return np.array([1.0 + self.given, 0.0, 0.0])

    def impulses(self):
        return {"wall": np.array([0.5 * self.given, 0.0, 0.0]), "gravity": np.zeros(3)}


class Stop:
    """Of a window, what the books ask for."""

    number, time, dt, particles = 3, 0.25, 0.1, None


def test_books_that_do_not_close_are_told_once():
    solid = Lying()
    books = Books(solid, None)
    assert books(Stop)["momentum_error"] == 0.0
    solid.given = 1.0
    with pytest.warns(UserWarning, match=r"until t = 0.25 s \(window 3\) 0.25 of .* at the solid"):
        row = books(Stop)
    assert row["momentum_error"] == 0.25 and row["force_soil_wall_x"] == -5.0
    assert row["impulse_wall_x"] == -0.5
    books(Stop)


def test_names_of_regions_become_names_of_columns():
    """Those that read alike are one, and none reads like another column."""
    solid = Lying()
    solid.regions = ("wall", "grid wall", "grid-wall", "solid")
    assert regions(solid, None) == {"wall": ("wall",), "grid_wall": ("grid wall", "grid-wall"),
                                    "region_solid": ("solid",)}
    assert Books(object(), None).columns == {} and Books(object(), None)(Stop) == {}


class Rocks:
    """Grains that got ``given`` from the wall along x, and gave a floor as much."""

    def __init__(self):
        self.given, wall = 0.0, type("", (), {"nodes": np.zeros((1, 2))})
        self.scene = type("", (), {"wall": wall, "gravity": (0.0, 0.0)})

    def particles(self):
        out = np.zeros(1, [("x", float, 2), ("v", float, 2), ("mass", float)])
        out["mass"], out["v"][0, 1] = 2.0, 0.5 * self.given
        return out

    def impulses(self):
        return {"interface": np.array([self.given, 0.0, 0.0]), "gravity": np.zeros(3),
                "floor": np.array([-self.given, self.given, 0.0])}


class Soil:
    """A solid that got as much from them as they from it, but for a part that is ``lost``."""

    regions, lost, rocks = ("floor",), 0.0, None

    def momenta(self):
        return np.array([self.lost - self.rocks.given, 0.0, 0.0])

    def impulses(self):
        return {"interface": np.array([self.lost - self.rocks.given, 0.0, 0.0]), "floor": np.zeros(3)}


def test_soil_and_rocks_push_the_same_floor():
    """Columns of both; the books of two sides close, and tell where the exchange does not."""
    solid, grains = Soil(), Rocks()
    solid.rocks = grains
    books = Books(solid, grains)
    grains.given = 3.0
    window = type("", (), {"number": 1, "time": 0.1, "dt": 0.1, "particles": grains.particles()})
    row = books(window)
    assert list(row) == list(books.columns)
    assert row["force_rock_floor_x"] == pytest.approx(30.0) and row["force_soil_floor_x"] == 0.0
    assert row["impulse_floor_x"] == 3.0 and row["impulse_floor_y"] == -3.0
    assert row["momentum_error"] == 0.0
    solid.lost = 0.3
    with pytest.warns(UserWarning, match="0.1 of the largest impulse came from nowhere, at the interface"):
        assert books(window)["momentum_error"] == pytest.approx(0.1)


def test_a_ball_that_bounces_is_booked_on_both_sides(backend, tmp_path):
    """In every window, while it touches and before."""
    box, rubber = Box((0.0, 0.0), (0.1, 0.1)), Material(1e7, 0.3)
    block = Body(box, (4, 4), 2, LAWS["linear"](1e7, 0.3), 1000.0)
    top, bottom = Interface.top(box, (4,)), Support(lambda x: x[:, 1] < 1e-9, "xy", name="bottom")
    solid = MPM(Grid(Box((-0.05, 0.0), (0.15, 0.2)), (8, 8)), block, [bottom], top, gravity=(0.0, -9.81))
    ball = Spheres([[0.05, 0.111]], [[0.3, -1.0]], 0.01, 2500.0)
    grains = Scene(ball, Wall(top.x, top.elements), rubber, rubber, gravity=(0.0, -9.81))
    scheme = Scheme(dt=1e-4, t_end=3e-3, substeps=10, dem=backend)
    history = Run("ball", solid, grains, scheme, Output(tmp_path)).go()[backend]
    assert history["impulse_grains"].max() > 0.015 and history["force_soil_bottom_y"].min() < 0.0
    assert history["momentum_error"].max() < 1e-10
    whole = sum(history[name] for name in history.columns
                if name.startswith("energy_") and name != "energy_error")  # what is there, and what was spent
    np.testing.assert_allclose(whole, whole[0], rtol=1e-9)


def on_one_bed(backend, out, **more):
    """History of a block and a ball that stand on a bed, while another ball falls on the block."""
    bed = Structure.plane("bed", (0, 0), "+y", Box((-0.05, -0.01), (0.25, 0.2)), friction=0.3)
    box, rubber, pull = Box((0.0, 0.0), (0.1, 0.1)), Material(1e6, 0.3), (0.0, -9.81)
    top = Interface.top(box, (4,))
    solid = MPM(Grid(Box((-0.05, -0.05), (0.25, 0.2)), (12, 10)), Body(box, (4, 4), 2, LAWS["linear"](
        1e6, 0.3), 1000.0), [], top, structures=[bed], gravity=pull, inertia="lumped")
    balls = Spheres([[0.06, 0.111], [0.17, 0.011]], [[0.2, -1.0], [0.3, -1.0]], 0.01, 2500.0)
    grains = Scene(balls, Wall(top.x, top.elements), rubber, rubber, structures=[bed], gravity=pull)
    scheme = Scheme(dt=1e-4, t_end=5e-3, substeps=10, dem=backend, **more)
    return Run("bed", solid, grains, scheme, Output(out)).go()[backend]


@pytest.mark.parametrize("iterate", [0, 20])
def test_soil_and_rocks_on_one_structure(backend, tmp_path, iterate):
    """Momentum and angular momentum of both, to round-off, with a row of what the exchange itself turns."""
    history = on_one_bed(backend, tmp_path, iterate=iterate)
    assert history["force_rock_bed_y"].min() < -1.0 and history["force_soil_bed_y"].min() < -1.0
    mean = history["force_rock_bed_y"] + history["force_soil_bed_y"]
    np.testing.assert_allclose(history["impulse_bed_y"], np.cumsum(mean) * 1e-4, rtol=1e-9)
    assert history["momentum_error"].max() < 1e-12 and history["angular_error"].max() < 1e-12
    turned, whole = np.abs(history["angular_exchange_z"]), np.abs(history["angular_solid_z"]).max()
    assert 1e-12 * whole < turned.max() < 1e-6 * whole
    owed = np.abs(history["impulse_exchange_y"]).max()
    assert owed == 0.0 if not iterate else owed < 1e-3 * history["impulse_grains"].max()


@pytest.mark.parametrize("side", ["grains", "solid"])
def test_a_force_at_a_wrong_place_is_told(backend, tmp_path, monkeypatch, side):
    """A side that books the force of the interface 1 mm beside where it acts: linear books do not see it."""
    if side == "grains":
        add = WallBooks.add
        monkeypatch.setattr(WallBooks, "add", lambda self, hits, *more: add(
            self, hits._replace(middle=hits.middle + 1e-3 * np.eye(3)[0]), *more))
    else:
        own = PointForces._own
        monkeypatch.setattr(PointForces, "_own", lambda self, *a: (own(self, *a)[0] + [1e-3, 0.0],
                                                                   own(self, *a)[1]))
    with pytest.warns(UserWarning, match="books of momentum do not close.* at the interface"):
        history = on_one_bed(backend, tmp_path)
    assert history["momentum_error"].max() < 1e-12 and 1e-4 < history["angular_error"].max() < 0.1


def test_the_exchange_is_booked_in_space(backend, tmp_path):
    """A rock of two spheres falls obliquely on material points as balls, which are chosen anew."""
    box, stone, pull = Box((0.0,) * 3, (0.1, 0.05, 0.1)), Material(1e6, 0.3), (0.0, -9.81, 0.0)
    soil = Body(box, (4, 2, 4), 2, LAWS["neo_hooke"](1e5, 0.3), 1500.0)
    floor = Support(lambda x: x[:, 1] < 1e-9, "xyz", name="floor")
    solid = MPM(Grid(Box((-0.05, 0.0, -0.05), (0.15, 0.15, 0.15)), (8, 6, 8)), soil, [floor], Balls(6e-3),
                gravity=pull, inertia="lumped")
    rock = Cluster.of_spheres([[0.0, 0.0, 0.0], [0.018, 0.003, 0.005]], 0.012, 2500.0, (0.05, 0.066, 0.05),
                              v=(0.3, -1.0, 0.2))
    grains = Scene(clusters=[rock], material=stone, wall_material=stone, gravity=pull)
    scheme = Scheme(dt=2e-4, t_end=8e-3, substeps=20, dem=backend)
    history = Run("rock", solid, grains, scheme, Output(tmp_path)).go()[backend]
    assert history["impulse_grains"].max() > 0.01
    assert history["momentum_error"].max() < 1e-12 and history["angular_error"].max() < 1e-12
    assert np.abs(history["angular_exchange_x"]).max() > 0.0
