"""Clusters, single spheres and walls together: agreement of the back ends, balance, states, ranks."""
import ctypes
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

DT = 1.5e-5
PERTURB = -6  # M_PERTURB of malloc.h


def run(dem, window, windows, steps=20):
    return np.array([dem.advance(steps, *window(dem.time, steps * dem.dt)) for _ in range(windows)])


def test_back_ends_agree_on_a_heap(both, heap, dim, record_property, capsys):
    """Contacts of all kinds for 48 ms, short enough that round-off does not grow."""
    scene, window = heap(dim)
    dems = both(scene, DT)
    forces = [run(dem, window, 160) for dem in dems]
    difference = np.abs(forces[0] - forces[1]).max() / np.abs(forces[0]).max()
    a, b = (dem.bodies() for dem in dems)
    state = max(np.abs(a[name] - b[name]).max() / np.abs(a[name]).max() for name in ("x", "v", "omega",
                                                                                     "quaternion"))
    energies = [dem.energy() for dem in dems]
    dems[1].close()
    record_property("relative difference of the back ends", float(difference))
    with capsys.disabled():
        print(f"\nheap, {dim}D: the back ends differ by {difference:.1e} of the largest force, {state:.1e} "
              "of the "
              "state")
    assert difference < 1e-6 and state < 1e-6
    for name in energies[0]:
        assert energies[0][name] == pytest.approx(energies[1][name], rel=1e-6, abs=1e-9)
    assert np.abs(a["omega"][1, 2 if dim == 2 else slice(None)]).max() > 1.0  # the box was hit


def test_impulses_balance(dem, heap, dim):
    """In the windows in which no fixed wall and no held body is touched: wall impulse + change of momentum =
    weight x time, counted by the bodies and by the single spheres."""
    scene, window = heap(dim)
    free = dem(replace(scene, clusters=scene.clusters[:2], walls=()), DT)
    g = np.array(scene.gravity)

    def momentum():
        single = free.particles()
        single = single[single["body"] == 0]
        return sum((p["mass"][:, None] * p["v"])[:, :dim].sum(axis=0) for p in (single, free.bodies()))

    mass = free.particles()["mass"].sum()
    before, total = momentum(), 0.0
    for _ in range(160):
        impulse = run(free, window, 1)[0].sum(axis=0) * 20 * DT
        now = momentum()
        total = max(total, np.abs(impulse).max())
        assert np.abs(impulse + now - before - mass * g * 20 * DT).max() < 1e-12 * max(total,
                                                                                       np.abs(before).max())
        before = now
    assert total > 0.0


def test_restored_state_continues_bit_for_bit(dem, heap, dim):
    """In mid-contact of all kinds, in the same and in a fresh instance."""
    scene, window = heap(dim)
    first = dem(scene, DT)
    run(first, window, 60)
    while not (first.get_state()["wall_force"].any() and first.energy()["contact"]) and first.time < 0.06:
        run(first, window, 1, steps=7)
    state, time = first.get_state(), first.time
    kept = {name: np.array(value) for name, value in state.items()}
    forces, particles, bodies, energy = run(first, window,
                                            30), first.particles(), first.bodies(), first.energy()
    assert state["wall_force"].any() and forces.any()
    for other in (first, dem(scene, DT)):
        other.set_state(state)
        assert other.time == time
        assert np.array_equal(run(other, window, 30), forces)
        assert np.array_equal(other.particles(), particles) and np.array_equal(other.bodies(), bodies)
        assert other.energy() == energy
    assert all(np.array_equal(kept[name], state[name]) for name in state)  # a state is not changed by its use


def test_a_state_holds_no_memory_that_nobody_set(dem, heap, dim):
    """The same state whatever the allocator hands out."""
    allocator = ctypes.CDLL(None)
    states = []
    try:
        for byte in (0x55, 0xAA):
            allocator.mallopt(PERTURB, byte)  # glibc fills what it hands out
            scene, window = heap(dim)
            grains = dem(scene, DT)
            states.append(grains.get_state())
            run(grains, window, 60)
            states.append(grains.get_state())
    finally:
        allocator.mallopt(PERTURB, 0)
    for a, b in zip(states[:2], states[2:]):
        assert all(a[name].tobytes() == b[name].tobytes() for name in a)


def test_ids_and_shares(dem, heap, dim):
    """Single spheres first; the shares of the mass add up; bodies start where the scene puts them."""
    scene, _ = heap(dim)
    grains = dem(scene, DT)
    p, bodies = grains.particles(), grains.bodies()
    assert p["id"].tolist() == list(range(1, len(p) + 1))
    assert p["body"].tolist() == [0, 0] + sum(([b + 1] * len(c.radii) for b, c in enumerate(scene.clusters)),
                                              [])
    for body, cluster in zip(bodies, scene.clusters):
        assert p["mass"][p["body"] == body["id"]].sum() == pytest.approx(cluster.mass, rel=1e-14)
        assert body["x"][:dim] == pytest.approx(cluster.x, abs=1e-16) and body["mass"] == cluster.mass
        assert body["quaternion"] == pytest.approx(cluster.quaternion, abs=1e-15)
        assert body["omega"] == pytest.approx(cluster.omega, rel=1e-12)
        assert p["x"][p["body"] == body["id"]] == pytest.approx(cluster.places, abs=1e-16)


TWO_RANKS = """
import importlib.util
import sys
import numpy as np
from mpi4py import MPI
from dem_liggghts.liggghts import LiggghtsDEM
spec = importlib.util.spec_from_file_location("scenes", sys.argv[2])
scenes = importlib.util.module_from_spec(spec)
spec.loader.exec_module(scenes)
result = []
for dim in (2, 3):
    scene, window = scenes.make_heap(dim)
    dem, own = LiggghtsDEM(scene, 1.5e-5), set()
    for k in range(160):
        own.add((dem._instance.count("dem_count"), dem._instance.count("dem_count_bodies")))
        if k == 60:
            dem.set_state(dem.get_state())
        force = dem.advance(20, *window(dem.time, 20 * dem.dt))
    bodies = dem.bodies()
    result += [force.ravel()] + [bodies[name].ravel() for name in ("x", "v", "quaternion")]
    assert MPI.COMM_WORLD.size == int(sys.argv[3]), "not as many ranks as asked for"
    assert dem.comm.size == 1 or len(own) > 1, "no sphere changed its rank"
result = np.concatenate(result)
assert len({bytes(r) for r in MPI.COMM_WORLD.allgather(result)}) == 1, "ranks differ"
if MPI.COMM_WORLD.rank == 0:
    np.save(sys.argv[1], result)
"""


@pytest.mark.mpi
def test_two_ranks_give_what_one_gives(tmp_path, both, capsys, on_ranks):
    """Clusters across the border of the ranks, a state restored half way: round-off remains."""
    results = []
    for ranks in (1, 2):
        file = tmp_path / f"{ranks}.npy"
        done = on_ranks(ranks, TWO_RANKS, file, Path(__file__).with_name("conftest.py"), ranks)
        assert done.returncode == 0, done.stderr
        results.append(np.load(file))
    difference = np.abs(results[0] - results[1]).max() / np.abs(results[0]).max()
    with capsys.disabled():
        print(f"\nheap: two ranks differ by {difference:.1e} from one")
    assert difference < 1e-8
