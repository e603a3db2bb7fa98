"""What the ParaView series show of rocks, walls and forces is where it is."""
import functools
import shutil
from types import SimpleNamespace

import meshio
import numpy as np
import pytest

from coupling import Output, Run, Scheme
from coupling.loop.window import Window
from coupling.records.pieces import Pieces
from coupling.shapes import rocks
from dem_liggghts import Cluster, Interaction, Material, Scene, Spheres, Wall, quaternion
from mpm_fenicsx import MPM, Body, Box, Grid, Interface, Structure, Terrain, linear

BRICK = np.array([[k >> d & 1 for d in range(3)] for k in range(8)]) * [0.04, 0.02, 0.01]
SIDES = (0, 4, 6, 2), (1, 3, 7, 5), (0, 1, 5, 4), (2, 6, 7, 3), (0, 2, 3, 1), (4, 5, 7, 6)
TRIANGLES = [t for a, b, c, d in SIDES for t in ((a, b, c), (a, c, d))]
SOLID, STEP = SimpleNamespace(time=0.0), 1e-5


@functools.lru_cache(maxsize=None)
def brick():
    """At zero; filled once for all tests."""
    return Cluster.from_surface(BRICK, TRIANGLES, 2600.0, (0.0, 0.0, 0.0), spheres=40)


def scene(spheres=None, **more):
    """Two bricks that spin, a sphere, a floor that is no interface."""
    turn = quaternion.of_angle(0.5)
    bricks = [brick().changed(x=(0.0, 0.0, 0.1), quaternion=turn, omega=(0.0, 0.0, 20.0)),
              brick().changed(x=(0.5, 0.0, 0.1), v=(0.0, 1.0, 0.0))]
    around = [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)]
    floor = Wall(around, [(0, 1, 2), (0, 2, 3)], material="floor")
    stone = Material(1e7, 0.3)
    return Scene(spheres, Wall.none(3), stone, stone, clusters=bricks, walls=[floor],
                 materials={"floor": stone}, interactions={("spheres", "floor"): Interaction()}, **more)


def test_surfaces_go_with_their_rocks(dem):
    """Turned about the centre of mass by what they spin, moved by what they fly, each vertex as fast as the
    differences of its places."""
    grains = dem(scene(), STEP)
    pieces = Pieces(SOLID, grains)
    start = pieces(0.0, None)["rocks"]
    grains.advance(1000, np.zeros((0, 3)), np.zeros((0, 3)))
    x, cells, data, of_cells = pieces(0.01, None)["rocks"]
    turn = quaternion.matrix(quaternion.of_angle(0.5 + 20.0 * 0.01))
    middle = BRICK.mean(axis=0)
    assert x[:8] == pytest.approx((BRICK - middle) @ turn.T + [0.0, 0.0, 0.1], abs=1e-7)
    assert x[8:] == pytest.approx(BRICK - middle + [0.5, 0.01, 0.1], abs=1e-9)
    assert data["velocity"][:8] == pytest.approx(np.cross([0.0, 0.0, 20.0], x[:8] - [0, 0, 0.1]), abs=1e-6)
    assert data["velocity"][8:] == pytest.approx(np.tile([0.0, 1.0, 0.0], (8, 1)))
    assert cells["triangle"].shape == (24, 3) and np.array_equal(cells["triangle"], start[1]["triangle"])
    assert of_cells["body"].tolist() == [1] * 12 + [2] * 12
    assert of_cells["mass"] == pytest.approx(2600.0 * 8e-6)


def test_a_rock_that_has_left_is_seen_no_more(dem):
    grains = dem(scene(domain=((-1.0, -1.0, -1.0), (1.0, 0.05, 1.0)), outflow={"+y": "remove"}), 2e-5)
    grains.advance(3000, np.zeros((0, 3)), np.zeros((0, 3)))
    faces, bodies = rocks(grains)
    assert len(faces.elements) == 12 and bodies["id"].tolist() == [1]


def test_walls_are_written_once_and_spheres_have_no_surface(dem):
    ball = Spheres([[0.0, 0.5, 0.5]], [[0.0, 0.0, 0.0]], 0.01, 2600.0)
    pieces = Pieces(SOLID, dem(scene(ball), STEP))
    first, second = pieces(0.0, None), pieces(1.0, None)
    assert first["walls"][1]["triangle"].tolist() == [[0, 1, 2], [0, 2, 3]] and "walls" not in second
    assert second["particles"][2]["body"].tolist()[0] == 0 and "structures" not in first
    later = Pieces(SOLID, None)
    later.set_state(pieces.get_state())
    assert later.get_state() == pieces.get_state() and Pieces(SOLID, None)(0.0, None) == {}


def test_contacts_are_the_nodes_that_are_pushed(dem):
    steel, wall = Material(1e7, 0.3), Wall([[-1.0, 0.0], [0.0, 0.0], [1.0, 0.0]], [[0, 1], [1, 2]])
    grains = dem(Scene(Spheres([[0.5, 0.0101]], [[0.0, -1.0]], 0.01, 1000.0), wall, steel, steel), STEP)
    still = np.zeros((3, 2))
    force = grains.advance(50, wall.nodes, still)
    window = Window(1, 5e-4, 5e-4, wall.nodes, still, force, *5 * [still], grains.particles(), {})
    x, _, data = Pieces(SOLID, grains)(5e-4, window)["contacts"]
    assert x.tolist() == [[0.0, 0.0], [1.0, 0.0]]
    assert data["force"] == pytest.approx(force[1:]) and (data["force"][:, 1] < 0.0).all()


def test_structures_are_where_they_have_moved_and_feel_what_the_body_loses():
    """A block that falls onto a sill in two halves, one of them moving away: what both feel is what the
    block's momentum and gravity say."""
    size = Box((0.0, 0.005), (0.2, 0.105))
    block = Body(size, (8, 4), 2, linear(E=1e6, nu=0.3), rho=1000.0, velocity=(0.0, -0.5))
    sill = Structure.box("sill", Box((-0.05, -0.1), (0.25, 0.0)), cells=(2, 1))
    pile = Structure.circle("pile", (0.5, 0.0), 0.1, sides=8).moving((-1.0, 0.0))
    grid = Grid(Box((-0.2, -0.2), (0.7, 0.3)), (36, 20))
    solid = MPM(grid, block, gravity=(0.0, -10.0), inertia="lumped", structures=[sill, pile])
    pieces, before = Pieces(solid, None), solid.momentum()
    first = pieces(0.0, None)["structures"]
    for _ in range(30):
        solid.advance(1e-3)
    x, cells, data, of_cells = pieces(solid.time, None)["structures"]
    assert not first[3]["force_soil"].any() and "force_rock" not in of_cells
    lines = len(sill.elements)
    assert data["displacement"][-8:] == pytest.approx(np.tile([-0.03, 0.0], (8, 1)))
    assert np.array_equal(x[:len(sill.x)], sill.x)
    assert of_cells["structure"].tolist() == [0] * lines + [1] * 8
    assert set(of_cells["cell"][:lines]) == {0, 1} and set(of_cells["cell"][lines:]) == {2}
    force = np.array([of_cells["force_soil"][of_cells["cell"] == k][0] for k in range(3)])
    lost = before - solid.momentum() + 0.03 * np.array([0.0, -10.0]) * 20.0
    # but for what Newton's method leaves of the residual
    assert 0.03 * force.sum(axis=0) == pytest.approx(lost, rel=1e-6, abs=1e-9) and lost[1] < -1.0
    assert (force[:2, 1] < 0.0).all() and not force[2].any()
    around = 2 * (0.15 + 0.1) - 0.1  # of half a sill: without the cut
    assert of_cells["traction_soil"][0] == pytest.approx(of_cells["force_soil"][0] / around)
    solid.close()


def test_a_rock_that_lies_on_a_structure_weighs_on_its_cell(dem):
    """What it loses of the momentum that gravity gives it, the force cell under it takes."""
    table = Structure.box("table", Box((-0.1, -0.1, -0.1), (0.5, 0.0, 0.1)), cells=(2, 1, 1))
    stone = Material(1e7, 0.3)
    lying = brick().changed(x=(0.35, 0.0101, 0.0))
    grains = dem(Scene(None, Wall.none(3), stone, gravity=(0.0, -9.81, 0.0), clusters=[lying],
                       structures=[table], materials={"table": stone},
                       interactions={("spheres", "table"): Interaction(0.2, 0.5)}), 1e-5)
    pieces = Pieces(SOLID, grains)
    pieces(0.0, None)
    grains.advance(3000, np.zeros((0, 3)), np.zeros((0, 3)))
    parts = pieces(0.03, None)
    data, (body,) = parts["structures"][3], grains.bodies()
    force = np.array([data["force_rock"][data["cell"] == k][0] for k in range(2)])
    assert not force[0].any() and "force_soil" not in data and "walls" not in parts
    lost = body["mass"] * (np.array([0.0, -9.81, 0.0]) - body["v"] / 0.03)
    assert force[1] == pytest.approx(lost, abs=1e-9)
    assert force[1, 1] < -0.5 * body["mass"] * 9.81


def test_terrain_that_moves_is_shown_where_it_is():
    """At each time; one that stands still once."""
    terrain = Terrain.function(lambda x, y: 0.5 * x, Box((0.0, 0.0), (2.0, 1.0)), 1.0)
    for motion in (None, lambda t: (t, 0.0, -2.0 * t)):
        solid = SimpleNamespace(time=0.0, structures=[terrain.structure(motion=motion)])
        pieces = Pieces(solid, None, terrain)
        first, later = (pieces(time, None) for time in (0.0, 0.5))
        assert np.array_equal(first["terrain"][0], terrain.x)
        assert ("terrain" in later) == (motion is not None)
    x, _, data = later["terrain"]
    assert np.array_equal(x - terrain.x, np.tile((0.5, 0.0, -1.0), (len(x), 1)))
    assert np.array_equal(data["displacement"], x - terrain.x) and np.array_equal(data["height"], x[:, 2])


def strike(out, backend):
    """A brick falls beside a rubber block that falls onto a moving sill."""
    size, room = Box((0.0, 0.01, 0.0), (0.1, 0.06, 0.1)), Box((-0.05, -0.1, -0.05), (0.15, 0.15, 0.15))
    block = Body(size, (4, 2, 4), 2, linear(E=1e6, nu=0.3), rho=1000.0)
    sill = Structure.box("sill", Box((-0.05, -0.05, -0.05), (0.15, 0.0, 0.15)), cells=(2, 1, 1))
    top = Interface.top(size, (2, 2))
    solid = MPM(Grid(room, (8, 10, 8)), block, [], top, gravity=(0.0, -9.81, 0.0), inertia="lumped",
                structures=[sill.moving((0.0, 0.1, 0.0))])
    stone = Material(1e6, 0.3)
    falling = [brick().changed(x=(0.05, 0.075, 0.05))]
    grains = Scene(None, Wall(top.x, top.elements), stone, stone, gravity=(0.0, -9.81, 0.0), clusters=falling)
    scheme = Scheme(dt=1e-3, t_end=0.06, substeps=50, dem=backend)
    return Run("strike", solid, grains, scheme, Output(out, 10, 1.0, 10, checkpoint="25"))


@pytest.mark.validation
def test_series_and_pictures_go_on_after_a_restart(tmp_path, backend):
    """The files of a run that went on are those of one that went through, to the last bit."""
    strike(tmp_path / "one", backend).go()
    shutil.copytree(tmp_path / "one", tmp_path / "two")
    (tmp_path / "two" / "checkpoint.h5").unlink()  # that of window 50: the one before is taken
    strike(tmp_path / "two", backend).load(tmp_path / "two").go()
    kinds = ".vtu", ".pvd", ".gif", ".png", ".csv"
    names = sorted(path.name for path in (tmp_path / "one").iterdir() if path.suffix in kinds)
    assert {"rocks_00006.vtu", "structures_00006.vtu", "strike_flow.gif"} <= set(names)
    for name in names:
        assert (tmp_path / "one" / name).read_bytes() == (tmp_path / "two" / name).read_bytes(), name


def test_a_ground_that_shakes_is_shown_where_it_is(backend, tmp_path):
    """All series of a scene in its frame say how far it has gone, at each time, also after a restart."""
    def base(t):
        return 3.0 + 6.0 * t, -2.0 * np.cos(9.0 * t)

    def run(t_end, **more):
        box, pull = Box((0.0, 0.0), (0.1, 0.1)), (0.0, -9.81)
        top, rubber = Interface.top(box, (4,)), Material(1e6, 0.3)
        bed = Structure.plane("bed", (0, 0), "+y", Box((-0.05, -0.01), (0.25, 0.2)), friction=0.3)
        solid = MPM(Grid(Box((-0.05, -0.05), (0.25, 0.2)), (12, 10)), Body(box, (4, 4), 2, linear(
            1e6, 0.3), 1000.0), [], top, structures=[bed], gravity=pull, inertia="lumped", base=base)
        floor = Wall([(0.15, 0.0), (0.2, 0.0)], [(0, 1)], material="floor")
        grains = Scene(Spheres([[0.17, 0.05]], [[0.0, 0.0]], 0.01, 2500.0), Wall(top.x, top.elements), rubber,
                       rubber, gravity=pull, base=base, walls=[floor], materials={"floor": rubber},
                       interactions={("spheres", "floor"): Interaction()})
        Run("shaken", solid, grains, Scheme(dt=1e-3, t_end=t_end, substeps=100, dem=backend),
            Output(tmp_path, paraview=10, **more)).go()

    run(0.02, checkpoint="end")
    run(0.03, restart=tmp_path)
    for name in ("points", "particles", "structures", "walls", "interface"):
        for number, t in ((0, 0.0), (1, 0.01), (3, 0.03)):
            file = meshio.read(tmp_path / f"{name}_{number:05d}.vtu")
            away = 1.5 * t**2 + t**3, 2.0 / 81.0 * (np.cos(9.0 * t) - 1.0)
            shown = file.point_data["base_displacement"]
            assert shown[:, :2] == pytest.approx(np.tile(away, (len(file.points), 1)), rel=1e-6, abs=1e-15)
