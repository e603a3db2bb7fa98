"""Soil that flows against clusters: the outline is resampled, the wall of both back ends follows, nothing is
lost."""
import numpy as np
import pytest

from coupling import Scheme, couple, nearest
from coupling.ledger.exchange import Ledger
from dem_liggghts import Cluster, Interaction, Material, Scene, Wall, open_dem
from mpm_fenicsx import MPM, Body, Box, Grid, Interface, Support, mohr_coulomb

DT, SUBSTEPS, R = 1e-3, 50, 0.0025
G = (0.0, -9.81)


def heap(comm=None, **rule):
    """Column of soil, 4 cm x 6 cm, on a floor and beside a wall."""
    law = mohr_coulomb(50e3, 0.4, friction_angle=22.0, cohesion=0.0)
    soil = Body(Box((0.0, 0.0), (0.04, 0.06)), (8, 12), 2, law, 1300.0, f_bar=True, thickness=0.1)
    grid = Grid(Box((0.0, 0.0), (0.14, 0.1)), (14, 10))
    outline = Interface.around(soil, open_sides=("x-", "y-"), floor="y-", **rule)
    held = [Support.column("x", 0.0, grid, "x"), Support.column("y", 0.0, grid, "xy")]
    return MPM(grid, soil, held, outline, gravity=G, inertia="lumped",
               **({} if comm is None else dict(comm=comm)))


def scene(solid, clusters, **more):
    soft = Interaction(1.0, 0.3)
    wall = Wall(solid.interface.x, solid.interface.elements, depth=0.003, material="soil")
    return Scene(wall=wall, clusters=clusters, materials={"wood": Material(5e6, 0.3),
                                                          "soil": Material(5e5, 0.4)},
                 interactions={("wood", "wood"): soft, ("wood", "soil"): soft}, **more)


def block(free, x=0.062):
    """Lopsided: its centre of mass is not that of its spheres."""
    places = R * np.array([(-3, -3), (-1, -3), (1, -3), (-3, -1), (-3, 1), (-3, 3), (-3, 5), (-3, 7)])
    return Cluster(places, R, (x, 0.012), 0.02, 2e-6, (R, -R), free=free, material="wood")


def run(solid, grains, windows, **more):
    x = solid.surface()[0]
    couple(solid, grains, nearest(x, x), Scheme(DT, solid.time + windows * DT, substeps=SUBSTEPS), **more)


def behind(outline, elements, centres):
    """Which centres lie behind the outline, closed around the corner at the origin."""
    a, b = outline[elements].transpose(1, 0, 2)
    last, first = outline[elements[-1, 1]], outline[elements[0, 0]]
    a, b = np.concatenate([a, [last, (0, 0)]]), np.concatenate([b, [(0, 0), first]])
    u, w = a - centres[:, None], b - centres[:, None]
    turn = np.arctan2(u[..., 0] * w[..., 1] - u[..., 1] * w[..., 0], (u * w).sum(axis=-1)).sum(axis=1)
    return np.abs(turn) > np.pi


def test_flow_pushes_a_free_cluster_with_exact_momentum(dem):
    """No gravity on the cluster and nothing else that it touches: all its momentum comes from the soil."""
    solid = heap()
    grains = dem(scene(solid, [block(True)]), DT / SUBSTEPS)
    ledger, impulse, worst, sizes, replaced = Ledger(solid, grains), np.zeros(2), [], [], 0

    def momentum():
        bodies = grains.bodies()
        return bodies["mass"] @ bodies["v"][:, :2]

    def look(window):
        nonlocal impulse, replaced
        impulse = impulse + solid.applied * window.dt
        books = ledger(window)
        worst.append([np.abs(impulse + momentum()).max(),
                      abs(books["impulse_grains"] + books["impulse_solid"])])
        replaced += window.change is not None and not window.change.keeps_numbers and bool(impulse.any())
        sizes.append(len(window.x))
        assert not behind(window.x, solid.interface.elements, grains.particles()["x"][:, :2]).any()

    run(solid, grains, 125, on_window=[look])
    assert replaced >= 5 and max(sizes) != min(sizes)
    assert momentum()[0] > 1e-3 and np.max(worst) < 1e-12 * np.abs(momentum()).max()
    x, e = solid.surface()[0], solid.interface.elements
    # the foot follows
    assert x[-1] == pytest.approx([x[-2, 0], solid.interface.resampling.feet[1][1]], abs=2e-3)
    assert x[-1, 0] > 0.05 and np.array_equal(grains.scene.wall.elements, e)
    lengths = np.linalg.norm(x[e[:, 1]] - x[e[:, 0]], axis=1)
    assert lengths.max() < 2.5 * 2.0 * 0.0025


def test_flow_is_stopped_by_a_fixed_cluster(dem):
    solid = heap()
    grains = dem(scene(solid, [block(False)]), DT / SUBSTEPS)
    pushed = []

    def look(window):
        assert solid.applied == pytest.approx(window.wall_force.sum(axis=0), rel=1e-12, abs=1e-14)
        assert not behind(window.x, solid.interface.elements, grains.particles()["x"][:, :2]).any()
        pushed.append(-window.wall_force.sum(axis=0)[0])

    run(solid, grains, 140, on_window=[look])
    weight = 0.04 * 0.06 * 0.1 * 1300.0 * 9.81
    assert 0.02 * weight < max(pushed) < 2 * weight and max(pushed[-20:]) > 0.01 * weight
    assert solid.points.x[:, 0].max() < 0.062 + 2 * R


def test_goes_on_bit_for_bit(dem):
    """Also with another instance, and after a run that went on otherwise."""
    solid, windows = heap(), []
    grains = dem(scene(solid, [block(True)]), DT / SUBSTEPS)
    run(solid, grains, 60, on_window=[windows.append])
    states = solid.get_state(), grains.get_state()
    run(solid, grains, 22, on_window=[windows.append], last=windows[-1])
    assert sum(w.change is not None and not w.change.keeps_numbers for w in windows[60:]) >= 3
    assert sum(w.wall_force.any() for w in windows[60:]) > 5
    expected = *solid.surface(), solid.points.x.copy(), grains.particles(), solid.interface.elements
    other = heap()
    for one, rest in ((solid, grains), (other, dem(scene(other, [block(True)]), DT / SUBSTEPS))):
        one.set_state(states[0]), rest.set_state(states[1])
        assert len(one.surface()[0]) == len(windows[59].x)
        run(one, rest, 22, last=windows[59])
        found = *one.surface(), one.points.x, rest.particles(), one.interface.elements
        assert all(np.array_equal(a, b) for a, b in zip(found, expected))


def test_resampling_changes_nothing_while_nothing_stretches(backend):
    """A block of soil that flies against a cluster: with a rule and without one."""
    found = []
    for resampled in (False, True):
        law = mohr_coulomb(50e3, 0.4, friction_angle=22.0, cohesion=1e5)
        soil = Body(Box((0.01, 0.02), (0.04, 0.05)), (6, 6), 2, law, 1300.0, f_bar=True, thickness=0.1,
                    velocity=(0.5, 0.0))
        outline = Interface.around(soil)
        plain = Interface(outline.x, outline.elements)
        solid = MPM(Grid(Box((0.0, 0.0), (0.1, 0.07)), (10, 7)), soil, (), outline if resampled else plain,
                    inertia="lumped")
        grains = open_dem(backend, scene(solid, [block(True, 0.0525)]), DT / SUBSTEPS)
        forces = []
        run(solid, grains, 20, on_window=[lambda w, forces=forces: forces.append(w.wall_force)])
        assert abs(forces[-1]).max() + abs(forces[10]).max() > 0
        found.append((np.array(forces), grains.particles()))
        grains.close()
    assert all(np.array_equal(a, b) for a, b in zip(*found))


def test_a_wall_with_nodes_of_its_own_is_refused():
    solid = heap()
    x = solid.surface()[0]
    grains = open_dem("reference", scene(solid, [block(True)]), DT / SUBSTEPS)
    with pytest.raises(ValueError, match="the interface is resampled, but the wall has nodes of its own"):
        couple(solid, grains, nearest(x, x + 1e-4), Scheme(DT, 5 * DT, substeps=SUBSTEPS))


RANKS = """
import sys
import numpy as np
import test_outline as scenes
from dem_liggghts import open_dem
solid, sizes = scenes.heap(), []
grains = open_dem(sys.argv[2], scenes.scene(solid, [scenes.block(True)]), scenes.DT / scenes.SUBSTEPS)
solid.rebalance_every = 10
scenes.run(solid, grains, 66, on_window=[lambda w: sizes.append(len(w.x))])
(x, v), block = solid.surface(), grains.bodies()["x"]
if solid.comm.rank == 0:
    np.savez(sys.argv[1], x=x, v=v, sizes=sizes, elements=solid.interface.elements, block=block,
             shared=solid.comm.size)
"""


@pytest.mark.mpi
def test_two_ranks_give_what_one_gives(on_ranks, liggghts, tmp_path):
    found = []
    for ranks in (1, 2):
        done = on_ranks(ranks, RANKS, tmp_path / f"{ranks}.npz", "liggghts", "-mpm_snes_rtol", "1e-8")
        assert done.returncode == 0, done.stderr[-2000:]
        found.append(np.load(tmp_path / f"{ranks}.npz"))
    one, two = found
    assert two["shared"] == 2 and np.array_equal(one["sizes"], two["sizes"]) and len(set(one["sizes"])) > 2
    assert np.array_equal(one["elements"], two["elements"])
    for name in ("x", "v", "block"):
        np.testing.assert_allclose(two[name], one[name], rtol=0, atol=1e-6 * abs(one[name]).max(),
                                   err_msg=name)
