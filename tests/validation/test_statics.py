"""Load steps without inertia against references: compaction, cantilever, strip footing; docs/quasi_static.md
has the table."""
import importlib
import sys
from pathlib import Path

import numpy as np
import pytest

from mpm_fenicsx import MPM, Body, Box, Grid, Interface, Load, MPMDivergedError, Support, von_mises

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "cases"))


@pytest.fixture(autouse=True)
def no_words(monkeypatch):
    """PETSc's options are those of the scene, not those of pytest."""
    monkeypatch.setattr("sys.argv", ["scene.py"])


def run(name, *words, **given):
    return importlib.import_module(f"studies.crossing.{name}").run(*words, **given)


@pytest.mark.validation
def test_compaction_reaches_the_published_errors():
    """AMPLE (Coombs & Augarde 2020): 1.3e-2, 3.6e-3, 1.0e-3 and 4.4e-4, slope 2, then 1."""
    errors = [run("compaction", "gimp", cells=n)["error"] for n in (8, 16, 32, 64)]
    assert (np.array(errors) <= (1.3e-2, 3.6e-3, 1.0e-3, 4.4e-4)).all(), errors
    slopes = np.log2(np.divide(errors[:-1], errors[1:]))
    assert slopes[0] > 1.5 and slopes[1] > 1.5 and slopes[2] > 0.9


@pytest.mark.validation
def test_compaction_with_other_bases():
    """The linear one stays at 3 to 6 %; domains as at the start overlap, and the error stops at 0.25 %."""
    assert all(run("compaction", "linear", cells=n)["error"] > 0.03 for n in (8, 16, 32, 64))
    assert 0.002 < run("compaction", "ugimp", cells=64)["error"] < 0.003
    stiff = [run("compaction", "gimp", cells=n, E=1e6)["error"] for n in (8, 16, 32, 64)]
    assert all(a > 2.4 * b for a, b in zip(stiff, stiff[1:])) and stiff[-1] < 8e-4


@pytest.mark.validation
@pytest.mark.parametrize("basis", ["ugimp", "gimp", "bspline"])
@pytest.mark.parametrize("h, points", [(0.5, 2), (0.5, 4), (0.5, 6), (0.25, 2), (0.25, 4), (0.25, 6),
                                       (0.125, 2)])
def test_cantilever_comes_to_ten(basis, h, points):
    """The deflection is within 1 % of that of finite elements of the same law; no load step is shortened."""
    found = run("cantilever", basis, h=h, points=points)
    assert abs(found["error"]) < 0.01 and found["shortest"] == 1.0


@pytest.mark.validation
def test_cantilever_of_fine_cells_follows_all_the_way():
    """k = 1, 5 and 10 within 0.2 %."""
    found = run("cantilever", "gimp", h=0.125, points=2)
    assert max(abs(found[name]) for name in ("error", "error_1", "error_5")) < 2e-3


@pytest.mark.validation
def test_finite_elements_of_the_cantilever_converge():
    """To the numbers that the scene is compared with, of 80 x 8 elements."""
    scene, reference = (importlib.import_module(name) for name in ("studies.crossing.cantilever",
                                                                   "references.cantilever"))
    found = reference.finite_elements((40, 4))
    for factor, (v, u) in scene.FINE.items():
        at = np.argmin(abs(found.factor - factor))
        assert (found.v[at], found.u[at]) == pytest.approx((v, u), rel=3e-4)


@pytest.mark.validation
def test_a_strip_footing_sinks_away_at_prandtls_load():
    """Clay without weight carries (2 + pi) c = 5.14 c under a smooth strip, of which the load steps find the
    end: the last equilibrium; cells of an eighth of the strip."""
    c, h, width, q = 1e4, 0.125, 0.5, 6.0
    size = (4.0, 2.0)
    clay = von_mises(1e7, 0.49, yield_stress=np.sqrt(3) * c)
    body = Body(Box((0.0, 0.0), size), Grid.counts(size, h), 2, clay, 2000.0, f_bar=True)
    supports = [Support(lambda x: x[:, 1] < 1e-9, "xy"),
                Support(lambda x: (x[:, 0] < 1e-9) | (x[:, 0] > size[0] - 1e-9), "x")]
    strip = Interface.line((0.0, size[1] - 1e-6), (width, size[1] - 1e-6), 16)
    solid = MPM(Grid(Box((0.0, 0.0), (4.0, 2.5)), Grid.counts((4.0, 2.5), h)), body, supports, strip,
                loads=[Load(strip, traction=(0.0, -q * c))])
    reached = []
    with pytest.raises(MPMDivergedError, match="there is no equilibrium"):
        solid.settle(12, on_step=reached.append)
    solid.close()
    assert q * reached[-1] == pytest.approx(2.0 + np.pi, rel=0.05)
