"""Two elastic discs in coarse cells, as in cases/studies/crossing/discs.py."""
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[2] / "cases"))


@pytest.mark.parametrize("basis, energy", [("linear", 0.954), ("ugimp", 0.948)])
def test_discs_bounce(monkeypatch, basis, energy):
    """They keep their momentum, and most of the energy."""
    monkeypatch.setattr("sys.argv", ["scene.py"])
    from studies.crossing import discs

    found = discs.run(basis=basis, h=0.1, cfl=0.2)
    assert found["energy"] == pytest.approx(energy, abs=0.03) and found["momentum"] < 1e-9
    assert 0.9 < found["restitution"] < 1.0 and found["helped"] == 0
