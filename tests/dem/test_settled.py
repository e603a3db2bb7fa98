"""Particles that fall until they are at rest, and scenes that start with them there."""
import zlib
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from dem_liggghts import Cluster, Interaction, Material, Scene, Spheres, Wall, check_start, critical_step
from dem_liggghts.scene.contacts import Contacts
from dem_liggghts.settling import NotSettledError
from mpm_fenicsx import Body, Box, Structure, linear

G, RHO, R = 9.81, 2600.0, 0.03
STONE, MEET = Material(1e7, 0.25), Interaction(0.5, 0.5)
WEIGHT = 4.0 / 3.0 * np.pi * R**3 * RHO * G


def room(*upper, lower=None):
    return SimpleNamespace(lower=lower or (0.0,) * len(upper), upper=upper)


def floor(dim, slope=0.0, size=1.0):
    """Through the origin; of this half width, rising along x."""
    rise = slope * size
    if dim == 2:
        return Wall([[-size, -rise], [size, rise]], [[0, 1]])
    return Wall([[-size, -size, -rise], [size, -size, rise], [size, size, rise], [-size, size, -rise]],
                [[0, 1, 2], [0, 2, 3]])


def tray(dim, width):
    """Open above, of walls that all belong together."""
    if dim == 2:
        return Wall([[0, 3], [0, 0], [width, 0], [width, 3]], [[0, 1], [1, 2], [2, 3]])
    x = [(i, j, k) for k in (0, 3) for j in (0, width) for i in (0, width)]
    sides = [(0, 1, 3), (0, 3, 2), (0, 4, 5), (0, 5, 1), (1, 5, 7), (1, 7, 3), (3, 7, 6), (3, 6, 2),
             (2, 6, 4), (2, 4, 0)]
    return Wall(x, sides)


def scene(spheres, wall, clusters=(), meet=MEET, **more):
    return Scene(spheres, wall, STONE, STONE, meet, meet, -G * np.eye(wall.dim)[-1], clusters, **more)


def balls(*heights, dim=3):
    x = np.zeros((len(heights), dim))
    x[:, -1] = heights
    return Spheres(x, 0 * x, R, RHO)


def heap(dim, spheres=10, clusters=2, seed=1):
    """So many spheres over so many clusters over a tray."""
    width = (0.25 if dim == 3 else 0.5) * (1.0 if spheres > 10 else 0.7)
    corners = 0.015 * np.array([(1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)])[:dim + 1, :dim]
    rock = Cluster.of_spheres(corners, 0.025, RHO, (0,) * dim)
    sides = (width,) * (dim - 1)
    rocks = Cluster.packed([rock] * clusters, room(*sides, 0.4), seed)
    above = room(*sides, 1.1, lower=(0.0,) * (dim - 1) + (0.4,))
    gravel = Spheres.packed(spheres, (0.02, R), above, RHO, seed)
    return scene(gravel, tray(dim, width), rocks)


def hertz(force, radius):
    """Overlap [m] of two bodies of STONE under ``force`` [N]; radius: effective one [m]."""
    modulus = STONE.E / (2.0 * (1.0 - STONE.nu**2))
    return (0.75 * force / (modulus * np.sqrt(radius)))**(2.0 / 3.0)


def left(start, backend, time=0.5, parts=10):
    """What ``time`` [s] does to a scene that is at rest: largest way of a sphere in radii, and the mean force
    on its moving wall over its weight."""
    dt = min(critical_step(start))
    dem, nodes = start.open(backend, dt), np.array(start.wall.nodes)
    before, steps = dem.particles(), int(time / dt / parts)
    force = np.mean([dem.advance(steps, nodes, 0 * nodes).sum(axis=0) for _ in range(parts)], axis=0)
    way = np.linalg.norm(dem.particles()["x"] - before["x"], axis=1) / before["radius"]
    dem.close()
    return way.max(), force / (before["mass"].sum() * G)


def test_a_sphere_rests_as_deep_as_hertz_says(backend, dim):
    rest = scene(balls(0.1, dim=dim), floor(dim)).settled(dem=backend)
    assert R - rest.spheres.x[0, -1] == pytest.approx(hertz(WEIGHT, R), rel=1e-6)
    assert rest.contacts.walls.overlap == pytest.approx(hertz(WEIGHT, R), rel=1e-6)
    assert rest.spheres.x[0, 0] == 0.0 and rest.spheres.v.tolist() == [[0.0] * dim]
    assert left(rest, backend, 0.05)[0] < 1e-9


def test_a_stack_of_two(backend, dim):
    rest = scene(balls(0.05, 0.15, dim=dim), floor(dim)).settled(dem=backend)
    below, above = rest.spheres.x[:, -1]
    assert R - below == pytest.approx(hertz(2.0 * WEIGHT, R), rel=1e-6)
    assert 2.0 * R - (above - below) == pytest.approx(hertz(WEIGHT, 0.5 * R), rel=1e-6)


def test_a_cluster_rests_on_three_spheres(backend):
    corners = 0.02 * np.array([(1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)])
    rock = Cluster.of_spheres(corners, R, RHO, (0.0, 0.0, 0.2), quaternion=(0.8, 0.6, 0.0, 0.0))
    rest = scene(None, floor(3), [rock]).settled(dem=backend)
    assert len(rest.contacts.walls.overlap) == 3
    assert rest.contacts.walls.overlap == pytest.approx(hertz(4.0 * WEIGHT / 3.0, R), rel=1e-2)
    way, force = left(rest, backend)
    assert way < 1e-3 and force == pytest.approx([0.0, 0.0, -1.0], abs=1e-6)


@pytest.mark.parametrize("count", [(10, 2), pytest.param((30, 5), marks=pytest.mark.validation)])
def test_a_heap_stays_at_rest(backend, dim, count, capsys, record_property):
    """Its friction carries. Alike from the same seed."""
    rest, again = (heap(dim, *count).settled(dem=backend) for _ in range(2))
    said = capsys.readouterr().out.splitlines()
    assert len(said) == 2 and said[0] == said[1]
    assert said[0].startswith(f"{sum(count)} particles settled in ")
    for a, b in ((rest.spheres.x, again.spheres.x), *((c.places, d.places) for c, d in
                                                      zip(rest.clusters, again.clusters))):
        assert (a == b).all()
    way, force = left(rest, backend, 0.5 if sum(count) > 12 else 0.1)
    record_property("largest way [radii]", float(way))
    assert way < 1e-3 and force == pytest.approx([*[0.0] * (dim - 1), -1.0], abs=1e-5)
    assert (np.linalg.norm(rest.contacts.spheres.springs[:, :3], axis=1) > 0.0).mean() > 0.8


def test_without_the_springs_a_heap_gives_way():
    rest = heap(3).settled()
    between, at_walls = (table._replace(springs=0.0 * table.springs) for table in rest.contacts)
    assert left(rest, "reference")[0] < 1e-4
    assert left(replace(rest, contacts=Contacts(between, at_walls)), "reference")[0] > 3e-3


def test_a_scene_that_one_back_end_has_settled_rests_in_the_other(liggghts):
    for one, other in (("reference", "liggghts"), ("liggghts", "reference")):
        rest = heap(3).settled(dem=one)
        dem = rest.open(other, 1e-5)
        for mine, theirs in zip(dem.contacts(), rest.contacts):
            assert (mine.partners == theirs.partners).all()
            assert mine.springs == pytest.approx(theirs.springs, abs=1e-15)
            assert mine.overlap == pytest.approx(theirs.overlap, abs=1e-15)
        dem.close()
        assert left(rest, other)[0] < 1e-3


PROGRAM = """
import sys
sys.path.insert(0, {folder!r})
from mpi4py import MPI
from test_settled import fingerprint, heap
sums = MPI.COMM_WORLD.gather([fingerprint(heap(3).settled(dem=one)) for one in ("reference", "liggghts")])
if sums:
    print(*sums[0], *sums[1])
"""


def fingerprint(rest):
    return zlib.crc32(b"".join([rest.spheres.x.tobytes(), *(c.places.tobytes() for c in rest.clusters)]))


@pytest.mark.mpi
@pytest.mark.validation
def test_every_number_of_ranks_gives_the_same(liggghts, run_ranks, capsys):
    """Each rank settles the whole scene; the line is printed once."""
    sums = [str(fingerprint(heap(3).settled(dem=one))) for one in ("reference", "liggghts")]
    done = run_ranks(2, "-c", PROGRAM.format(folder=str(Path(__file__).parent)))
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines() == [*capsys.readouterr().out.splitlines(), " ".join(sums + sums)]


def test_structures_and_what_is_held(backend):
    """A sphere on a block that will move and one on a cluster that is held: both wait at their first place
    while others settle, and so does the ground; they have their motion in the new scene."""
    block = Structure.box("block", Box((-0.1, -0.1, 0.0), (0.1, 0.1, 0.1)), friction=0.5).moving((0, 0, 1.0))
    held = Cluster.of_spheres([(0.0, 0.0, 0.0)], 0.1, RHO, (1.0, 0.0, 0.0), v=(0.0, 0.2, 0.0), free=False)
    spheres = Spheres([(0.0, 0.0, 0.15), (1.0, 0.0, 0.14)], np.zeros((2, 3)), R, RHO)
    rest = scene(spheres, Wall.none(3), [held], structures=[block], base=lambda t: (5.0, 0.0, 0.0))
    rest = rest.settled(dem=backend)
    assert rest.structures == (block,) and rest.clusters[0].v.tolist() == [0.0, 0.2, 0.0]
    assert rest.spheres.x[0, 2] == pytest.approx(0.1 + R - hertz(WEIGHT, R), rel=1e-9)
    assert rest.spheres.x[1, 2] == pytest.approx(0.1 + R - hertz(WEIGHT, 0.1 * R / (0.1 + R)), rel=1e-6)
    check_start(rest)


def test_far_from_the_origin(backend):
    """The overlap has the digits that are left there."""
    far = np.array([5e4, -5e4, 5e4])
    wall, ball = floor(3), balls(0.1)
    rest = scene(replace(ball, x=ball.x + far), replace(wall, nodes=wall.nodes + far)).settled(dem=backend)
    assert far[2] + R - rest.spheres.x[0, 2] == pytest.approx(hertz(WEIGHT, R), abs=3e-11)
    assert left(rest, backend, 0.05)[0] < 1e-6


def test_soil_around_what_has_settled():
    rest = scene(balls(0.1, 0.2, dim=2), floor(2)).settled()
    soil = Body(Box((-0.1, 0.0), (0.1, 0.2)), (20, 20), 2, linear(1e6, 0.3), 1600.0)
    left_out = soil.without([rest.spheres], gap=2e-3)
    assert np.linalg.norm(left_out.shape.x[:, None] - rest.spheres.x, axis=2).min() > R + 2e-3 - 1e-12


def test_settled_once_more_it_stays():
    rest = scene(balls(0.1, 0.2), floor(3)).settled()
    again = rest.settled()
    assert again.spheres.x == pytest.approx(rest.spheres.x, abs=1e-12)


@pytest.mark.parametrize("change, message", [
    (lambda s: replace(s, contacts=None), "spheres 1 and 2 overlap by .* m at the start: move them apart"),
    (lambda s: replace(s, spheres=replace(s.spheres, x=s.spheres.x - [0, 0, 1e-5])),
     "sphere 1 overlaps the wall by .* m at the start: not by .* as the contacts of the scene say: settle"),
    (lambda s: replace(s, spheres=replace(s.spheres, x=s.spheres.x + [0, 0, 1e-5])), "not by"),
    (lambda s: replace(s, spheres=replace(s.spheres, x=s.spheres.x + [[0, 0, 0], [0, 0, 1e-6]])),
     "spheres 1 and 2 overlap by .* m at the start: not by .* m as its contacts say: settle it anew"),
    (lambda s: replace(s, spheres=balls(0.2)), "name sphere 2 of 1"),
    (lambda s: replace(s, wall=Wall.none(3)), "and element 1 of 0 of its walls: settle it anew"),
    (lambda s: replace(s, contacts=3), "contacts is 3: give a Contacts or None")])
def test_a_settled_scene_that_was_changed(change, message):
    rest = scene(balls(0.05, 0.15), floor(3)).settled()
    check_start(rest)
    with pytest.raises(ValueError, match=message):
        check_start(change(rest))


@pytest.mark.parametrize("wall, keys, kind, message", [
    (floor(3, slope=1.0), {}, NotSettledError, "sphere 1 has fallen past all walls at t = .* s: give the"),
    (floor(3, slope=1.0, size=40.0), dict(time=0.5), NotSettledError,
     "sphere 1 still moves with .* m/s after 0.5.* s of settling, at rest it is below .*: give more"),
    (Wall.none(3), {}, ValueError, "the scene has 1 spheres and 0 walls: give it particles and something"),
    (floor(3), dict(time=-1), ValueError, "time to settle is -1 s"),
    (floor(3), dict(speed=0), ValueError, "speed is 0 m/s"),
    (floor(3), dict(dem="yade"), ValueError, "dem is 'yade': the back ends are reference and liggghts")])
def test_what_does_not_settle(wall, keys, kind, message):
    with pytest.raises(kind, match=message):
        scene(balls(0.1), wall).settled(**keys)


def test_nothing_settles_without_gravity():
    with pytest.raises(ValueError, match="gravity is 0 m/s.2: give the scene one"):
        Scene(balls(0.1), floor(3), STONE, STONE).settled()
