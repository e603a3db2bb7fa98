"""Walls at rest with many elements: motion as on what is cut out of them, and nothing written anew."""
import numpy as np
import pytest

from dem_liggghts import Interaction, Material, Scene, Spheres, Wall
from dem_liggghts.scene.tables import wall_table
from dem_liggghts.search.elements import at_rest
from dem_liggghts.search.neighbours import near_elements, no_neighbours
from dem_liggghts.search.squares import sorted_elements
from mpm_fenicsx import Box, Structure, Terrain

STONE, MEET = Material(1e7, 0.25), Interaction(0.5, 0.4)
LIFT = 0.2  # speed at which a plate is lifted [m/s]


def ground(cells, **more):
    """A rough slope of so many cells of 0.5 m around (0, 0)."""
    area = Box((-0.25 * cells, -0.25 * cells), (0.25 * cells, 0.25 * cells))
    slope = Terrain.function(lambda x, y: 0.3 * x + 0.1 * np.sin(2.0 * x) * np.cos(3.0 * y), area, cell=0.5)
    return slope.structure("ground", friction=0.4, **more)


def opened(cells, backend, moving=False):
    """Four rocks on the ground, one of them on a plate that may move, one beside discs."""
    lift = (lambda t: (0.0, 0.0, LIFT * t)) if moving else None
    plate = Structure.box("plate", Box((0.8, -1.0, 1.0), (1.4, 1.0, 1.2)), friction=0.4, motion=lift)
    x = np.array([[-1.0, -0.6, -0.05], [-1.0, 0.6, 0.0], [1.1, 0.0, 1.45], [0.0, -1.0, 0.35]])
    rocks = Spheres(x, np.zeros_like(x), 0.2, rho=2600.0)
    scene = Scene(rocks, Wall.discs([[0.0, -1.1, 0.05]], 0.04), STONE, STONE, MEET, MEET, (0.0, 0.0, -9.81),
                  structures=[ground(cells), plate])
    return scene.open(backend, 1e-4)


def renewed(dem, k):
    """Other discs in the place of those of now: their number changes."""
    x = np.array([[0.1 * j, -1.1, 0.05 + 0.02 * j] for j in range(1 + k % 3)])
    dem.replace_wall(Wall.discs(x, 0.04), np.arange(len(x)) * 0 - 1)
    return x


def falls(dem, windows=60):
    """Advance with discs that are others in every tenth window; forces on them."""
    x, forces = dem.scene.wall.nodes.copy(), []
    for k in range(windows):
        if k % 10 == 9:
            x = renewed(dem, k)
        forces.append(dem.advance(50, x, np.zeros_like(x)).sum(axis=0))
    return np.array(forces)


@pytest.mark.parametrize("moving", [0, 1])
def test_a_large_wall_and_what_is_cut_out_of_it(backend, moving):
    large, small = (opened(cells, backend, moving) for cells in (64, 12))  # 8192 and 288 triangles
    assert len(large._walls.now.squares.element) and not len(small._walls.now.squares.element)
    forces = [falls(dem) for dem in (large, small)]
    assert forces[0] == pytest.approx(forces[1], rel=1e-9, abs=1e-9) and forces[0].any()
    a, b = large.particles(), small.particles()
    assert a["x"] == pytest.approx(b["x"], abs=1e-12) and a["omega"] == pytest.approx(b["omega"], abs=1e-9)
    sums = [dem.impulses() for dem in (large, small)]
    assert sums[0]["ground"][2] > 1.0 and sums[0]["plate"][2] > 1.0  # both carry rocks
    for name in sums[0]:
        assert sums[0][name] == pytest.approx(sums[1][name], abs=1e-9)
    assert large.energy() == pytest.approx(small.energy(), rel=1e-9, abs=1e-12)
    assert len(large.contact_points()) == len(small.contact_points()) > 0
    large.close(), small.close()


def test_going_back_with_another_interface(backend):
    """A state of few rows, from which the run goes on bit for bit, also where the discs were others."""
    dem = opened(64, backend, moving=True)
    falls(dem, 25)
    state = dem.get_state()
    assert len(state["wall_force"]) == len(state["wall_rows"]) < 100 and state["wall_force"][:-2].any()
    x = np.array(dem.scene.wall.nodes)

    def goes_on():
        dem.advance(50, x, np.zeros_like(x))
        renewed(dem, 1)
        dem.advance(50, np.array(dem.scene.wall.nodes), np.zeros((2, 3)))
        return dem.particles()

    ends = [goes_on()]
    dem.set_state(state)
    ends.append(goes_on())
    assert (ends[0] == ends[1]).all()
    dem.close()


def test_what_is_at_rest_is_not_written_anew(backend):
    dem = opened(64, backend)
    renewed(dem, 2)  # makes room for more discs
    before = dem._walls.now
    falls(dem, 20)
    assert np.shares_memory(before.x, dem._walls.now.x) and np.shares_memory(before.elements,
                                                                            dem._walls.now.elements)
    assert not dem._walls.now.v.any()
    dem.close()


def test_lists_of_elements_in_squares():
    """Those of a search through all, for spheres inside, beside and far from a wall, some of whose triangles
    move and one of which is large."""
    random = np.random.default_rng(3)
    structure = ground(60)
    x = np.concatenate([structure.x, [[-20.0, -20.0, 2.0], [20.0, -20.0, 2.0], [0.0, 20.0, 2.0]]])
    elements = np.concatenate([structure.elements, [[0, 1, 2]] + np.int64(len(structure.x))])
    table = wall_table(Scene(wall=Wall(x, elements, depth=0.3), wall_material=STONE))
    wall = at_rest(table, table.x)
    still = random.random(len(elements)) < 0.9
    squares = sorted_elements(wall, still)
    assert len(elements) - 1 in squares.loose and len(squares.loose) < 0.2 * len(elements)
    p = np.concatenate([random.uniform(-18.0, 18.0, (300, 3)) * (1.0, 1.0, 0.2), [[1e9, 0.0, 0.0]]])
    radius = random.uniform(0.05, 1.0, len(p))
    ends = [near_elements(p, radius, 0.05, one, 0.0, no_neighbours(len(p)), 0)
            for one in (wall, wall._replace(squares=squares))]
    assert len(ends[0].partner) > 500
    assert (ends[0].start == ends[1].start).all() and (ends[0].partner == ends[1].partner).all()
