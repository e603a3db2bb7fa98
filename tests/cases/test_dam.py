"""A dam that breaks on a dry bed, beside the experiment of Martin & Moyce 1952."""
import sys

import numpy as np
import pytest

from studies import bed_layer

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


def test_drag_of_the_bed_is_that_of_a_plate():
    """Of water that slides as a whole, also where cells of its tip are empty: 2 rho u (nu u L / pi)^(1/2)."""
    cell, u, dt = 2e-3, 1.0, 1e-9
    x = np.stack(np.meshgrid(np.arange(0.25, 20.0, 0.5), (0.25, 0.75, 1.25)), axis=-1).reshape(-1, 2) * cell
    for kept in (x, x[(x[:, 0] < 12 * cell) | (x[:, 0] > 19.7 * cell)]):
        v, mass = np.full(kept.shape, u), np.full(len(kept), 1e-3)
        bed_layer.slow(kept, v, mass, cell, dt)
        drag = np.sum(mass * (u - v[:, 0])) / dt
        assert drag == pytest.approx(2e3 * u * np.sqrt(1e-6 * u * 20 * cell / np.pi), rel=1e-5)
        assert (v[kept[:, 1] > cell, 0] == u).all() and (v[:, 1] == u).all()


@pytest.mark.parametrize("aspect, cells, most", [
    (1, 8, 0.027), pytest.param(1, 16, 0.02, marks=pytest.mark.validation),
    pytest.param(2, 16, 0.05, marks=pytest.mark.validation)])
def test_front_with_the_boundary_layer_of_the_bed(aspect, cells, most):
    """Its drag has no number to choose. Within 5 %, which the square column on a smooth bed is not."""
    late, off = sys.modules["references.dam"].beside(*bed_layer.front(aspect, cells), aspect)
    assert np.abs(off).max() < most and 0.0 < late < 0.2
