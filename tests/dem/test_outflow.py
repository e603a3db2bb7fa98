"""What leaves the domain of a scene: stop, hold, remove; its books (both back ends)."""
from dataclasses import replace

import numpy as np
import pytest

from dem_liggghts import Cluster, Interaction, Material, Scene, Spheres, Wall, open_dem

DT, SOFT, NONE = 1e-5, Material(1e7, 0.3), {dim: np.zeros((0, dim)) for dim in (2, 3)}
DOMAIN = ((-1.0, -1.0), (1.0, 1.0))


def scene(x, v, outflow="remove", **more):
    return Scene(Spheres(x, v, 0.01, 2500.0), Wall.none(2), SOFT, domain=DOMAIN, outflow=outflow, **more)


def total(dem):
    return sum(dem.energy().values()) + dem.removed["energy"]


def momentum(dem):
    p, b = dem.particles(), dem.bodies()
    p = p[p["body"] == 0]
    there = (p["mass"] @ p["v"] + b["mass"] @ b["v"])[:dem.scene.dim]
    return there + dem.removed["momentum"]


def test_nothing_leaves_without_a_domain(dem):
    ball = dem(replace(scene([[0.9, 0.0]], [[100.0, 0.0]], "stop"), domain=None), DT)
    ball.advance(10000, NONE[2], NONE[2])
    assert ball.particles()["x"][0, 0] == pytest.approx(10.9) and ball.particles()["mass"][0] > 0
    assert ball.removed["count"] == 0 and ball.removed["mass"] == 0.0 == ball.removed["energy"]
    assert ball.removed["momentum"].tolist() == [0.0, 0.0]


@pytest.mark.parametrize("outflow", ["hold", "remove"])
def test_what_leaves_is_booked(dem, outflow):
    """Three of five fly out, each on another side; mass, momentum and energy of all stay in the books."""
    x = [[0.9, 0.0], [0.0, 0.9], [0.0, 0.0], [-0.9, 0.1], [0.3, 0.0]]
    v = [[5.0, 0.0], [1.0, 4.0], [0.1, 0.0], [-3.0, 0.0], [0.0, 0.2]]
    made = scene(x, v, outflow, gravity=(0.0, -9.81))
    five = dem(made, DT)
    energy, pushed, mass = total(five), momentum(five), made.spheres.mass[0]
    for _ in range(60):
        pushed = pushed + five.particles()["mass"].sum() * np.array([0.0, -9.81]) * 100 * DT
        five.advance(100, NONE[2], NONE[2])
        left = (five.particles()["mass"] == 0.0).tolist()
        assert five.removed["count"] == sum(left)
        assert total(five) == pytest.approx(energy, rel=1e-9)
        assert momentum(five) == pytest.approx(pushed, rel=1e-9)
    p = five.particles()
    assert left == [True, True, False, True, False] and five.removed["mass"] == pytest.approx(3 * mass)
    assert p["id"].tolist() == [1, 2, 3, 4, 5] and not p["v"][left].any() and not p["omega"][left].any()
    if outflow == "hold":
        assert p["x"][0, 0] == 1.0 and p["x"][1, 1] == 1.0 and p["x"][3,
                                                                      0] == -1.0 and (p["radius"]
                                                                                      == 0.01).all()
    else:
        assert (p["radius"] == [0.0, 0.0, 0.01, 0.0, 0.01]).all() and 1.0 < p["x"][0, 0] < 1.01
    assert p["x"][2, 0] == pytest.approx(0.1 * five.time, rel=1e-12)


def test_end_of_the_run(dem):
    ball = dem(scene([[0.0, 0.0], [0.9, 0.5]], [[0.0, 0.0], [3.0, 0.0]], {"-x": "remove"}), DT)
    with pytest.raises(RuntimeError,
                       match=r"sphere 2 has left the domain, \[-1. -1.\] to \[1. 1.\] m, and is at .* m "
                       "at t = 0.04 s: enlarge the domain, or .* outflow=hold or outflow=remove"):
        ball.advance(4000, NONE[2], NONE[2])


def test_each_side_has_its_way(dem):
    x, v = [[0.9, 0.0], [-0.9, 0.0]], [[3.0, 0.0], [-3.0, 0.0]]
    two = dem(scene(x, v, {"+x": "hold", "-x": "remove"}), DT)
    two.advance(5000, NONE[2], NONE[2])
    assert two.particles()["radius"].tolist() == [0.01, 0.0] and two.removed["count"] == 2


def with_clusters(outflow):
    """A pile in the plane of which one cluster slides out and a sphere rests on another one that stays."""
    floor = Wall([[-2.0, 0.0], [2.0, 0.0]], [[0, 1]])
    block = lambda x, v: Cluster.box((0.04, 0.02), (4, 2), (x, 0.0105), 800.0, 0.1, v=(v, 0.0))  # noqa: E731
    meet = Interaction(0.5, 0.2)
    balls = Spheres([[0.1, 0.0315], [0.95, 0.035]], [[0.0, 0.0], [1.5, 0.0]], 0.01, 2500.0)
    return Scene(balls, floor, SOFT, SOFT, meet, meet, (0.0, -9.81), [block(0.94, 2.0), block(0.1, 0.0)],
                 domain=((-1.0, -0.5), (1.0, 1.0)), outflow=outflow)


def run(dem, windows, steps=50):
    nodes = np.array(dem.scene.wall.nodes)
    return np.array([dem.advance(steps, nodes, 0 * nodes) for _ in range(windows)])


@pytest.mark.parametrize("outflow", ["hold", "remove"])
def test_clusters_leave_in_mid_contact(dem, outflow):
    """Impulse on the wall + change of momentum, booked too = weight x time, with the wall's force of every
    window."""
    pile = dem(with_clusters(outflow), DT)
    before, g, left = momentum(pile), np.array([0.0, -9.81]), []
    for _ in range(150):
        p, b = pile.particles(), pile.bodies()
        weight = (p["mass"][p["body"] == 0].sum() + b["mass"].sum()) * g * 50 * DT
        impulse = run(pile, 1)[0].sum(axis=0) * 50 * DT
        now = momentum(pile)
        assert impulse + now - before == pytest.approx(weight, abs=1e-12)
        before = now
        left.append(pile.removed["count"])
    b = pile.bodies()
    assert left[-1] == 2 and left[0] == 0 and b["id"].tolist() == [1,
                                                                   2] and (b["mass"] > 0).tolist() == [False,
                                                                                                       True]
    assert not b["v"][0].any() and b["x"][0, 0] == pytest.approx(1.0, abs=2e-3)
    p = pile.particles()
    assert (p["radius"][p["body"] == 1] == (0.0 if outflow == "remove" else 0.005)).all()
    assert pile.removed["mass"] == pytest.approx(pile.scene.clusters[0].mass + pile.scene.spheres.mass[1])
    # rests on the other one
    assert p["x"][0, 1] == pytest.approx(0.03, abs=1e-3) and np.abs(p["v"][0]).max() < 0.1


def test_back_ends_agree(both):
    dems = both(with_clusters("remove"), DT)
    forces = [run(one, 150) for one in dems]
    assert np.abs(forces[0] - forces[1]).max() < 1e-6 * np.abs(forces[0]).max()
    a, b = (one.removed for one in dems)
    assert a["count"] == b["count"] == 2 and a["energy"] == pytest.approx(b["energy"], rel=1e-6)
    assert a["momentum"] == pytest.approx(b["momentum"], rel=1e-6)
    dems[1].close()


def test_state_with_and_without_what_left(dem):
    """Bit for bit, forwards and backwards, in the same and a fresh instance."""
    first = dem(with_clusters("remove"), DT)
    states = [first.get_state()]
    run(first, 150)
    states.append(first.get_state())
    ends = []
    for one in (first, dem(with_clusters("remove"), DT)):
        for state in (states[1], states[0], states[1]):
            one.set_state(state)
            forces = run(one, 20)
            ends.append((forces, one.particles(), one.bodies(), one.removed))
    for k in (2, 3, 5):
        assert all(np.array_equal(a, b) for a, b in zip(ends[0][:3], ends[k][:3]))
        assert ends[0][3]["energy"] == ends[k][3]["energy"] and ends[k][3]["count"] == 2
    assert ends[1][3]["count"] == ends[4][3]["count"] == 0 and np.array_equal(ends[1][1], ends[4][1])
    with pytest.raises(ValueError, match="domain and outflow differ"):
        dem(with_clusters("hold"), DT).set_state(states[1])


def test_everything_leaves(dem):
    two = dem(scene([[0.9, 0.0], [-0.9, 0.0]], [[3.0, 0.0], [-3.0, 0.0]]), DT)
    for _ in range(3):
        two.advance(4000, NONE[2], NONE[2])
    assert two.removed["count"] == 2 and sum(two.energy().values()) == 0.0


def test_all_clusters_leave(dem):
    """Spheres that stay go on; back in a state with clusters, these do."""
    rock = Cluster.box([0.02] * 2, [2] * 2, (0.9, 0.3), 800.0, v=(50.0, 0.0), depth=0.02, material="spheres")
    some = dem(scene([[0.0, 0.0]], [[1.0, 0.0]], clusters=[rock]), DT)
    start = some.get_state()
    for _ in range(2):
        for _ in range(10):
            some.advance(100, NONE[2], NONE[2])
        assert some.removed["count"] == 1 and not some.bodies()["mass"].any()
        assert some.particles()["x"][0, 0] == pytest.approx(0.01, rel=1e-12)
        some.set_state(start)
        assert some.bodies()["mass"].all()


@pytest.mark.parametrize("more, message", [
    (dict(outflow="gone"), "outflow is 'gone': choose one of stop, hold, remove"),
    (dict(outflow={"x": "hold"}), "outflow has a side 'x': choose from -x, [+]x, -y, [+]y"),
    (dict(outflow={"-y": None}), "outflow at -y is None: choose one of stop, hold, remove"),
    (dict(domain=None), "outflow is 'remove' without a domain to leave: give domain="),
    (dict(domain=((0, 0), (1, 0))), r"domain is \[0. 0.\] to \[1. 0.\] m: give its lower and upper corner"),
    (dict(domain=((0, 0), (1, np.nan))), "domain .*nan.* give finite numbers"),
    (dict(domain=(0, 1)), r"domain is \(0, 1\): give numbers of shape \(2, 2\)")])
def test_what_is_no_domain_or_way_out(more, message):
    with pytest.raises(ValueError, match=message):
        replace(scene([[0.0, 0.0]], [[0.0, 0.0]]), **more)


def test_start_outside_the_domain():
    with pytest.raises(ValueError,
                       match=r"sphere 2 at \[1.5 0. \] m starts outside the domain, .* move it inside"):
        open_dem("reference", scene([[0.0, 0.0], [1.5, 0.0]], [[0.0, 0.0]] * 2), DT)


TWO_RANKS = """
import sys
import numpy as np
import test_outflow as scenes
from mpi4py import MPI
from dem_liggghts.liggghts import LiggghtsDEM
dem = LiggghtsDEM(scenes.with_clusters("remove"), scenes.DT)
forces = scenes.run(dem, 150)
dem.set_state(dem.get_state())
result = np.concatenate([forces.ravel(), dem.particles()["x"].ravel(), dem.bodies()["v"].ravel(),
                         dem.removed["momentum"], [dem.removed["energy"], dem.removed["count"]]])
assert len({bytes(r) for r in MPI.COMM_WORLD.allgather(result)}) == 1, "ranks differ"
if MPI.COMM_WORLD.rank == 0:
    np.save(sys.argv[1], result)
"""


@pytest.mark.mpi
def test_two_ranks_give_what_one_gives(tmp_path, liggghts, on_ranks):
    results = []
    for ranks in (1, 2):
        file = tmp_path / f"{ranks}.npy"
        done = on_ranks(ranks, TWO_RANKS, file)
        assert done.returncode == 0, done.stderr
        results.append(np.load(file))
    assert results[1][-1] == 2 and np.abs(results[0] - results[1]).max() < 1e-9 * np.abs(results[0]).max()
