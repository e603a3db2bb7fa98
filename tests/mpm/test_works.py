"""Where energy goes: friction, plastic flow, work of what moves, and what is the scheme's."""
import numpy as np
import pytest

from coupling import Output, Run, Steps
from mpm_fenicsx import LAWS, MPM, Body, Box, Grid, GridWall, Interface, Numerics, Penalty, Support

SOIL, SOFT = LAWS["mohr_coulomb"](2e5, 0.3, 30.0, 0.0, 0.0), LAWS["neo_hooke"](1e6, 0.0)
BOOKED = Numerics(losses=True)


def energies(solid, scheme, folder):
    """Columns of the energies at the end of a run, and what has been lost until then."""
    start = sum(solid.energy().values())
    history = Run("energies", solid, None, scheme, Output(folder)).go()["solid"]
    found = {name: history[name][-1] for name in history.columns if name.startswith("energy_")}
    return found, start - sum(solid.energy().values())


@pytest.mark.parametrize("contact, transfer", [("nodes", "newmark"), ("surface", "tpic")])
def test_friction_takes_what_a_sliding_block_loses(contact, transfer, tmp_path):
    """Its impulse is mu times that of the floor, but for the step by which it is late."""
    block = Body(Box((0.1, 0.1), (0.3, 0.2)), (8, 4), 2, SOFT, 1000.0, velocity=(0.5, 0.0))
    floor = GridWall(lambda x: abs(x[:, 1] - 0.1) < 1e-9, "+y", friction=0.3, separates=True, contact=contact)
    solid = MPM(Grid(Box((0.0, 0.0), (0.8, 0.4)), (32, 16)), block, penalties=[floor], gravity=(0.0, -9.81),
                inertia="lumped", numerics=Numerics(losses=True, transfer=transfer))
    found, lost = energies(solid, Steps(1e-3, 0.1), tmp_path)
    floor = solid.impulses()["grid wall"]
    assert -floor[0] == pytest.approx(0.3 * floor[1], rel=0.015)
    assert found["energy_friction"] == pytest.approx(lost, rel=0.02) and found["energy_plastic"] == 0.0
    assert sum(found.values()) == pytest.approx(lost, rel=1e-10)


def test_plastic_flow_takes_what_a_collapse_loses(tmp_path):
    """On a bed that holds it there is no friction but inside."""
    soil = Body(Box((0.0, 0.0), (0.1, 0.2)), (4, 8), 2, SOIL, 1500.0)
    held = [Support(lambda x: x[:, 1] < 1e-9, "xy"), Support(lambda x: x[:, 0] < 1e-9, "x")]
    solid = MPM(Grid(Box((0.0, 0.0), (0.6, 0.3)), (24, 12)), soil, held, gravity=(0.0, -9.81),
                inertia="lumped", numerics=BOOKED)
    found, lost = energies(solid, Steps(2e-3, 0.3), tmp_path)
    assert found["energy_friction"] == 0.0 and sum(found.values()) == pytest.approx(lost, rel=1e-10)
    assert lost > 10.0 and 0.0 < found["energy_numerical"] < 0.06 * found["energy_plastic"]


@pytest.mark.parametrize("transfer, in_stress, in_transfers", [("newmark", 0.05, 0.05), ("apic", 0.01, 0.4)])
def test_work_of_the_laws_is_that_of_the_balance_on_the_grid(transfer, in_stress, in_transfers, tmp_path):
    """What plastic flow takes is known twice. Points that carry accelerations from step to step have another
    mean of the stress; apic pays in the transfers instead."""
    soil = Body(Box((0.0, 0.0), (0.1, 0.2)), (4, 8), 2, SOIL, 1500.0)
    held = [Support(lambda x: x[:, 1] < 1e-9, "xy"), Support(lambda x: x[:, 0] < 1e-9, "x")]
    solid = MPM(Grid(Box((0.0, 0.0), (0.6, 0.3)), (24, 12)), soil, held, gravity=(0.0, -9.81),
                inertia="lumped", numerics=Numerics(losses=True, transfer=transfer, basis="gimp"))
    found, lost = energies(solid, Steps(2e-3, 0.3), tmp_path)
    assert sum(found.values()) == pytest.approx(lost, rel=1e-10) and found["energy_plastic"] > 10.0
    assert abs(found["energy_stress"]) < in_stress * found["energy_plastic"]
    assert abs(found["energy_numerical"]) < in_transfers * found["energy_plastic"]


def test_an_elastic_bar_keeps_what_is_done_on_it(tmp_path):
    """Pulled at one end by a support, pushed at the other by a wall, both moved."""
    bar = Body(Box((0.1, 0.1), (0.5, 0.2)), (8, 2), 2, SOFT, 1000.0)
    pull = Support(lambda x: x[:, 0] > 0.5 - 1e-9, "x", motion=lambda t: [10.0 * t**2], name="pull")
    hold = Penalty(Interface.line((0.1, 0.1), (0.1, 0.2), 2), (1.0, 0.0), motion=lambda t: (-5.0 * t**2, 0.0))
    solid = MPM(Grid(Box((0.0, 0.0), (0.6, 0.3)), (12, 6)), bar, [pull], penalties=[hold], inertia="lumped",
                numerics=BOOKED)
    found, lost = energies(solid, Steps(2e-4, 0.02), tmp_path)
    done = solid.works()
    assert done["supports"] > 0.0 and done["walls"] > 0.0
    assert -lost + done["springs"] == pytest.approx(done["supports"] + done["walls"], rel=0.03)
    taken = found["energy_numerical"] + found["energy_hits"] + found["energy_springs"]
    np.testing.assert_allclose(taken, lost + done["supports"] + done["walls"], rtol=1e-9)
