"""Soil on a terrain slides and rests as on a plane, whatever the surface is made of, wherever the map is."""
import meshio
import numpy as np
import pytest

from mpm_fenicsx import LAWS, MPM, Body, Box, Structure, Terrain, linear

G, H = 9.81, 0.05
FIRM, SAND = (LAWS["mohr_coulomb"](1e6, 0.3, 35.0, 0.0, cohesion) for cohesion in (1000.0, 0.0))
SOIL = linear(1e6, 0.3)


def inclined(angle, dim, cell, wave=0.0):
    """Falls along x by that angle [degrees], with bumps of a height [m]."""
    slope = np.tan(np.radians(angle))
    if dim == 2:
        return Terrain.function(lambda x: -slope * x + wave * np.sin(40.0 * x), (0.0, 1.5), cell)
    return Terrain.function(lambda x, y: -slope * x, Box((0.0, 0.0), (1.0, 0.4)), cell)


def square(*ends):
    return [(ends[0], ends[2]), (ends[1], ends[2]), (ends[1], ends[3]), (ends[0], ends[3])]


def solid_on(terrain, where, law, structure, depth=0.2, above=0.4):
    cloud = terrain.release(depth, where, H)
    body = Body(cloud, None, None, law, 1000.0, f_bar=law is not SOIL)
    gravity = (0.0,) * (terrain.dim - 1) + (-G,)
    return MPM(terrain.grid(H, above), body, structures=[structure], gravity=gravity, inertia="lumped")


def lowest(solid, terrain):
    """Least height of a point over the terrain [m]."""
    x = solid.points.x
    return np.min(x[:, -1] - terrain.height(x[:, :-1]))


def acceleration(solid, terrain, angle, t_end):
    """Along the slope, by a straight line through the velocities of the last two thirds [m/s^2]."""
    a = np.radians(angle)
    down = np.array([np.cos(a), *[0.0] * (terrain.dim - 2), -np.sin(a)])
    time, speed = [], []
    while solid.time < t_end - 1e-9:
        solid.advance(2e-3)
        time.append(solid.time)
        speed.append(solid.momentum() @ down)
        assert lowest(solid, terrain) > 0.2 * H
    assert solid.behind() == {"terrain": 0}
    mass = 1000.0 * 0.04 * (1.0 if terrain.dim == 2 else 0.1)
    solid.close()
    return np.polyfit(time[len(time) // 3:], speed[len(time) // 3:], 1)[0] / mass


@pytest.mark.parametrize("cells", [0.25, 1.0, 8.0, None])
def test_a_block_slides_as_on_a_plane(cells):
    """Segments from a quarter of a cell to eight cells long, and a plane."""
    terrain = inclined(30.0, 2, H * (cells or 1.0))
    bed = terrain.structure(friction=0.3) if cells else Structure.plane(
        "terrain", (0.0, 0.0), (np.tan(np.radians(30.0)), 1.0), terrain.grid(H, 0.4).box, friction=0.3)
    found = acceleration(solid_on(terrain, (0.4, 0.6), SOIL, bed), terrain, 30.0, 0.3)
    a = np.radians(30.0)
    assert found == pytest.approx(G * (np.sin(a) - 0.3 * np.cos(a)), rel=1e-3)


@pytest.mark.parametrize("kind", ["function", "stl"])
def test_a_block_slides_in_space_as_on_a_plane(kind, tmp_path):
    terrain = bed = inclined(30.0, 3, 0.1)
    if kind == "stl":
        meshio.write_points_cells(tmp_path / "bed.stl", bed.x, [("triangle", bed.elements)])
        bed = Terrain.read(tmp_path / "bed.stl")
    plane = Structure.plane("terrain", (0.0, 0.0, 0.0), (np.tan(np.radians(30.0)), 0.0, 1.0),
                            terrain.grid(H, 0.4).box, friction=0.3)
    found, on_plane = (acceleration(solid_on(terrain, square(0.3, 0.5, 0.15, 0.25), SOIL, one), terrain, 30.0,
                                    0.05) for one in (bed.structure(friction=0.3), plane))
    assert found == pytest.approx(on_plane, rel=1e-5 if kind == "stl" else 1e-9)


@pytest.mark.validation
@pytest.mark.parametrize("cells", [0.5, 8.0])
def test_a_block_slides_in_space(cells):
    terrain = inclined(30.0, 3, cells * H)
    solid = solid_on(terrain, square(0.3, 0.5, 0.15, 0.25), SOIL, terrain.structure(friction=0.3))
    a = np.radians(30.0)
    found = acceleration(solid, terrain, 30.0, 0.3)
    assert found == pytest.approx(G * (np.sin(a) - 0.3 * np.cos(a)), rel=1e-3)


@pytest.mark.parametrize("wave, cell", [(0.0, 0.1), (0.01, 0.0125)])
def test_soil_rests_below_the_angle_of_friction(wave, cell):
    """Also on bumps finer than the cells; it creeps by less than 1e-4 cells per second."""
    terrain = inclined(15.0, 2, cell, wave)
    solid = solid_on(terrain, (0.4, 0.6), FIRM, terrain.structure(friction=0.6), depth=0.1)
    while solid.time < 0.8:
        solid.advance(4e-3)
    before = solid.points.x.copy()
    while solid.time < 1.0:
        solid.advance(4e-3)
    assert abs(solid.points.x - before).max() / 0.2 < 1e-4 * H
    assert solid.reaction("terrain") == pytest.approx([0.0, 1000.0 * 0.02 * G], abs=2e-3)
    assert lowest(solid, terrain) > 0.2 * H
    solid.close()


def creep(solid, inside, dt, start, end):
    """Most that a point ``inside`` goes from ``start`` to ``end`` [s], in cells per second."""
    before = None
    while solid.time < end - 1e-9:
        solid.advance(dt)
        if before is None and solid.time > start - 1e-9:
            before = solid.points.x[inside].copy()
    moved = np.linalg.norm(solid.points.x[inside] - before, axis=1)
    solid.close()
    return moved.max() / (end - start) / H


def test_dry_sand_rests_below_the_angle_of_friction():
    """A deposit that thins out toward both rims, with faces of up to 25 degrees, in all its depth."""
    depth = lambda x: 0.2 * np.clip(np.minimum((x.ravel() - 0.3) / 0.4, (2.5 - x.ravel()) / 1.2), 0.0, 1.0)
    terrain = Terrain.function(lambda x: -np.tan(np.radians(15.0)) * x, (0.0, 3.0), 0.1)
    solid = solid_on(terrain, None, SAND, terrain.structure(friction=0.6), depth)
    inside = (solid.points.x[:, 0] > 0.5) & (solid.points.x[:, 0] < 2.0)
    assert creep(solid, inside, 4e-3, 2.4, 2.8) < 1e-4


@pytest.mark.parametrize("left, right", [(30.0, 30.0), (50.0, 30.0)])
def test_no_point_sinks_into_a_valley(left, right):
    """A thin layer flows together where two smooth flanks meet; the mean force is the weight."""
    left, right = np.tan(np.radians([left, right]))
    terrain = Terrain.profile([0.0, 0.987, 2.0], [0.987 * left, 0.0, 1.013 * right])
    solid, force = solid_on(terrain, (0.9, 1.1), SAND, terrain.structure(), depth=0.05), []
    while solid.time < 0.4:
        solid.advance(2e-3)
        force.append(solid.reaction("terrain"))
        assert lowest(solid, terrain) > 0.05 * H
    assert np.mean(force[-100:], axis=0) == pytest.approx([0.0, 10.0 * G], abs=0.05 * 10.0 * G)
    assert solid.behind() == {"terrain": 0}
    solid.close()


def test_a_point_near_a_ridge_has_the_normal_of_the_nearest_triangle():
    rng = np.random.default_rng(5)
    terrain = Terrain.raster(0.03 * rng.random((9, 9)), 0.1, (0.0, 0.0))
    solid = solid_on(terrain, None, SOIL, terrain.structure(), depth=0.05, above=0.3)
    contact, = solid._contacts
    feet = contact._find_feet()[0]
    point, first = np.unique(feet.point, return_index=True)  # others are on other flanks
    assert len(point) >= 256
    feet = type(feet)(*(values[first] for values in feet))
    corner = terrain.x[terrain.elements]
    unit = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    unit /= np.linalg.norm(unit, axis=1)[:, None]
    assert (np.sum(unit[feet.element] * feet.normal, axis=1) > 1.0 - 1e-12).all()
    foot = np.einsum("qk,qki->qi", feet.weight, corner[feet.element])
    far = np.linalg.norm(solid.points.x[feet.point] - foot, axis=1)
    weight = rng.dirichlet((1.0, 1.0, 1.0), 2000)
    places = np.einsum("sk,eki->esi", weight[:40], corner).reshape(-1, 3)
    others = np.linalg.norm(solid.points.x[feet.point][:, None] - places[None, ::7], axis=2).min(axis=1)
    assert (far <= others + 1e-12).all()
    solid.close()


def test_regions_have_their_own_friction_and_force():
    """A block slides from ice onto rough ground, where it stops."""
    terrain = inclined(20.0, 2, 0.05)
    bed = terrain.structure(regions={"ice": ((0.0, 0.7), 0.0)}, friction=1.5)
    solid = solid_on(terrain, (0.4, 0.6), SOIL, bed, depth=0.1)
    while solid.time < 0.1:
        solid.advance(2e-3)
    on_ice, on_rest = (solid.reaction(name) for name in ("terrain_ice", "terrain_rest"))
    a = np.radians(20.0)
    assert abs(on_ice @ (np.cos(a), -np.sin(a))) < 1e-9 * np.linalg.norm(on_ice) and not on_rest.any()
    while solid.time < 0.8:
        solid.advance(4e-3)
    speed = np.linalg.norm(solid.momentum()) / 20.0
    total = sum(solid.reaction(name) for name in ("terrain_ice", "terrain_rest"))
    assert total == pytest.approx(solid.reaction("terrain"), abs=1e-9)
    assert solid.reaction("terrain_rest")[1] > 0.0
    assert speed < 0.05 and 0.6 < solid.points.x[:, 0].mean() < 1.0
    solid.close()


@pytest.mark.parametrize("dim", [2, pytest.param(3, marks=pytest.mark.validation)])
def test_a_run_is_the_same_at_coordinates_of_a_map(dim):
    """Cells of a whole number of 1/16 m, so that nothing of the places is rounded."""
    def run(origin):
        x, y = np.arange(25) / 16.0, np.arange(11) / 16.0
        z = -0.577 * x[:, None] + 0.02 * np.sin(5.0 * x[:, None]) * np.cos(4.0 * y)
        z = np.round(2**20 * z) / 2**20
        terrain = Terrain.raster((z if dim == 3 else z[:, 0]) + origin[-1], 1.0 / 16.0, origin[:-1])
        where = np.add(square(0.375, 0.625, 0.125, 0.375), origin[:-1]) if dim == 3 else np.add(
            (0.375, 0.625), origin[0])
        soil = terrain.release(0.1875, where, 1.0 / 16.0)
        body = Body(soil, None, None, SAND, 1000.0, f_bar=True)
        solid = MPM(terrain.grid(1.0 / 16.0, 0.375), body, structures=[terrain.structure(friction=0.3)],
                    gravity=(0.0,) * (dim - 1) + (-G,), inertia="lumped")
        for _ in range(40):
            solid.advance(2e-3)
        found = solid.points.x - np.array(origin), solid.points.v.copy(), solid.reaction("terrain")
        solid.close()
        return found

    for near, far in zip(run((0.0,) * dim), run(((4.5e5, 5.2e6, 1500.0) if dim == 3 else (4.5e5, 1500.0)))):
        assert abs(near - far).max() < 1e-9 * abs(near).max()
