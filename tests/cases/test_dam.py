"""A dam that breaks on a dry bed, beside the experiment of Martin & Moyce 1952."""
import sys

import numpy as np
import pytest

pytestmark = pytest.mark.filterwarnings("ignore:Newton's method failed")  # one step in hundreds


@pytest.fixture
def front(dam_break, tmp_path):
    """``front(aspect, floor, cells)``: delay of the gate and largest error of the front."""
    def run(aspect, floor, cells):
        history = dam_break.main(aspect=aspect, floor=floor, cells=cells, dt=0.02 / cells, out=tmp_path)
        return sys.modules["references.dam"].errors(history, aspect, 0.05715 / cells)

    return run


def test_water_on_a_coarse_grid(front):
    """Twice as high as wide: pinned, and within 5 % of the experiment's front."""
    found = front(2, "slip", 8)
    assert found["front"] < 0.05 and found["volume"] < 0.02
    assert found["front"] == pytest.approx(0.0119, abs=2e-3)
    assert found["late"] == pytest.approx(0.211, abs=0.01)


@pytest.mark.validation
@pytest.mark.parametrize("aspect, floor, most", [(1, "slip", 0.057), (1, "stick", 0.03), (2, "slip", 0.03)])
def test_front_of_water(front, aspect, floor, most):
    """16 cells across the width. A square column comes to run ahead: docs/flows.md."""
    assert front(aspect, floor, 16)["front"] < most


def test_delay_is_found(dam_break):
    """A run that is the experiment itself, 0.1 earlier, is so late and has no error."""
    dam = sys.modules["references.dam"]
    late, off = dam.beside(dam.AT[1] - 0.1, dam.FRONT, 1)
    assert late == pytest.approx(0.1, abs=1e-4) and np.abs(off).max() < 1e-4
    assert len(off) == 11  # from Z = 1.44 to T = 2.5
