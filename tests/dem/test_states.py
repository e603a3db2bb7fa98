"""States that do not fit, use after the end, and what instances leave behind (both back ends)."""
import os
from dataclasses import replace

import numpy as np
import pytest

from dem_liggghts import Cluster, Interaction, Material, Scene, Spheres, Wall, open_dem

DT, SOFT = 1e-6, Material(1e7, 0.3)
MEET = Interaction(0.9, 0.3)


def scene(x=((0.0, 0.011), (0.03, 0.011)), radius=0.01, rho=2500.0, meet=MEET, **more):
    floor = Wall([[-1.0, 0.0], [0.0, 0.0], [1.0, 0.0]], [[0, 1], [1, 2]])
    return Scene(Spheres(x, np.zeros_like(np.array(x, float)), radius, rho), floor, SOFT, SOFT, meet, meet,
                 **more)


def body(**more):
    return Cluster.box((0.02, 0.018), (4, 4), (0.1, 0.03), 500.0, 0.1, **more)


@pytest.mark.parametrize("first, other, what", [
    (scene(), scene(x=((0.0, 0.011),)), "number of spheres is 2, here it is 1"),
    (scene(), scene(radius=(0.01, 0.009)), "radii differ"),
    (scene(), scene(rho=2600.0), "masses differ"),
    (scene(), scene(walls=[Wall([[0.2, 0.0], [0.2, 1.0]], [[0, 1]])]), "fixed walls differ"),
    (scene(), scene(meet=Interaction(0.9)), "springs of friction differ"),
    (scene(clusters=[body()]), scene(clusters=[body(free=False)]), "clusters differ")])
def test_state_of_another_scene_is_refused(dem, first, other, what):
    state, other = dem(first, DT).get_state(), dem(other, DT)
    before = other.get_state()
    with pytest.raises(ValueError, match=f"the state belongs to another scene: its {what}.*give a state of "
                       "this scene"):
        other.set_state(state)
    after = other.get_state()
    assert all(np.array_equal(before[name], after[name]) for name in before)


def test_state_of_another_step_is_refused(dem):
    """Its time would be another one."""
    with pytest.raises(ValueError, match="its time step is 2e-06, here it is 1e-06"):
        dem(scene(), DT).set_state(dem(scene(), 2 * DT).get_state())


def test_state_of_another_back_end_is_refused(both):
    one, other = both(scene(), DT)
    for a, b in ((one, other), (other, one)):
        with pytest.raises(ValueError, match="the state has no '.*': give one that this back end has made"):
            a.set_state(b.get_state())
    other.close()


def test_state_of_the_same_particles_elsewhere_is_taken(dem):
    """Where they were at the start and how the wall was does not matter: the state holds it."""
    first = dem(scene(gravity=(0.0, -9.81)), DT)
    nodes = first.scene.wall.nodes
    first.advance(200, nodes, 0 * nodes)
    other = dem(replace(scene(x=((0.1, 0.02), (0.2, 0.011))), gravity=(0.0, -9.81)), DT)
    other.set_state(first.get_state())
    assert np.array_equal(first.particles(), other.particles())
    assert np.array_equal(first.advance(100, nodes, 0 * nodes), other.advance(100, nodes, 0 * nodes))


@pytest.mark.parametrize("clusters", [(), (body(),)])
def test_use_after_close_is_a_sentence(dem, clusters):
    made = scene(clusters=clusters)
    one, nodes = dem(made, DT), made.wall.nodes
    state = one.get_state()
    one.close()
    one.close()
    for use in (lambda: one.advance(1, nodes, nodes), one.particles, one.bodies, one.energy, one.get_state,
                lambda: one.set_state(state), lambda: one.replace_wall(made.wall)):
        with pytest.raises(RuntimeError, match="closed.*new one"):
            use()


def test_instances_leave_no_open_files(backend):
    """Closed, forgotten or lost in an error."""
    def opened():
        return len(os.listdir("/proc/self/fd"))

    kept = [open_dem(backend, scene(), DT)]
    before = opened()
    for k in range(6):
        kept.append(open_dem(backend, scene(), DT))
        if k % 3 == 0:
            kept[-1].close()
        elif k % 3 == 1 and backend == "liggghts":
            with pytest.raises(RuntimeError, match="Invalid fix style"):
                kept[-1]._instance.command("fix a all nonsense")
    assert opened() == before
    for one in kept:
        one.close()


def test_remembering_changes_nothing_and_leads_back(liggghts, heap, dim):
    """Friction and adhesion, in contact; back to round-off, as lists of neighbours are made anew."""
    scene, window = heap(dim)
    runs = []
    for remembers in (False, True):
        grains, back = open_dem("liggghts", scene, DT), None
        for k in range(12):
            if remembers:
                back = grains.remember()
            grains.advance(200, *window(200 * k * DT, 200 * DT))
        runs.append(grains.particles())
    assert np.array_equal(*runs)
    back()
    assert grains.time == pytest.approx(11 * 200 * DT)
    grains.advance(200, *window(2200 * DT, 200 * DT))
    for name in ("x", "v", "omega"):
        assert grains.particles()[name] == pytest.approx(runs[1][name], abs=1e-9 * abs(runs[1][name]).max())
    grains.close()
