"""Two elastic discs that bounce, as in cases/studies/crossing/discs.py: their energy, when they feel each
other, and that no set-up fails."""
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "cases"))
SIZES = 0.1, 0.05, 0.025
pytestmark = [pytest.mark.validation, pytest.mark.filterwarnings("ignore:bodies 1 and 2")]


@pytest.fixture
def discs(monkeypatch):
    """The scene; PETSc's options are those of the scene, not those of pytest."""
    monkeypatch.setattr("sys.argv", ["scene.py"])
    from studies.crossing import discs as scene

    return scene


def test_energy_after_the_bounce(discs):
    """With GIMP and consistent inertia 0.983, 0.995 and 0.998 of it are left in cells of 0.1, 0.05 and
    0.025 m; what is missing falls. (At most there are 1.041, 1.012 and 1.014 on the way: the transfers are
    made for lumped inertia.)"""
    found = [discs.run(basis="ugimp", h=h) for h in SIZES]
    assert all(one["energy"] > 0.99 for one in found[1:]) and found[0]["energy"] > 0.98
    losses = [one["loss"] for one in found]
    assert losses == sorted(losses, reverse=True) and losses[-1] < 0.2 * losses[0]
    assert all(one["momentum"] < 1e-9 and one["helped"] == 0 for one in found)
    assert all(one["largest"] < 1.05 for one in found)


def test_lumped_inertia_never_gains(discs):
    """0.933, 0.973, 0.985: it loses more, and gains nothing on the way."""
    found = [discs.run(basis="ugimp", h=h, inertia="lumped") for h in SIZES]
    losses = [one["loss"] for one in found]
    assert losses == sorted(losses, reverse=True) and losses[-1] < 0.02
    assert all(one["energy"] < 1.0 and one["largest"] < 1.002 for one in found)


@pytest.mark.parametrize("basis, most", [("linear", 1.9), ("ugimp", 1.95)])
def test_discs_feel_each_other_early(discs, basis, most):
    """There is no contact at their surfaces: they feel each other as soon as they share a node, with the rims
    1.4 to 1.8 cells apart, so that the time goes to the right one with the size of the cells."""
    early = [discs.run(basis=basis, h=h, cfl=0.2)["early"] for h in SIZES]
    assert all(1.2 < cells < most for cells in early)


@pytest.mark.parametrize("inertia", ["consistent", "lumped", "ghost"])
@pytest.mark.parametrize("basis", ["linear", "ugimp"])
def test_no_set_up_fails(discs, basis, inertia):
    """Down to cells of 0.0125 m. With the linear basis consistent inertia gets its ghost penalty on the
    way. Momentum stays, though points come to lie on the edges of cells."""
    for h in (*SIZES, 0.0125):
        found = discs.run(basis=basis, h=h, inertia=inertia, cfl=0.5)
        assert 0.6 < found["energy"] < 1.05 and found["momentum"] < 1e-8
        assert (found["helped"] == 0) or (basis, inertia) == ("linear", "consistent")
