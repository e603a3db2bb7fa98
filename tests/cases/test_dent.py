"""A sphere at rest on a soft elastic bed sinks as deep as on the bed itself, whatever the cells."""
import json

import pytest

BED = dict(scene="rest", length=0.04, height=0.02, E=1e6, gravity=9.81, restitution=0.3, inertia="lumped",
           at=(1e-3,), per_contact=40, windows=110, iterate=30)
R = 0.01
# Hertz' depth, and what the bar under the sphere, 4R x 2R x R and held at its bottom, gives way more than a
# half space: 34 (1 - nu^2)/E times the force, from cells of R/2, R/4, R/8 in space, less what is in
# proportion to 1/h
DEPTH = 1.037


@pytest.fixture
def sink(extreme, tmp_path):
    """``sink(key=value, …)``: depth over Hertz' depth."""
    def run(**keys):
        extreme.main(**BED, out=str(tmp_path), **keys)
        return 1.0 + json.loads((tmp_path / "report.json").read_text())["errors"]["sag"]

    return run


@pytest.mark.parametrize("dim, cells", [(2, 1), (2, 4), (3, 1),
                                       pytest.param(3, 2, marks=pytest.mark.validation)])
def test_depth_is_that_of_the_bed(sink, dim, cells):
    """With the force spread over R and the dent taken out, on cells of R, R/2 and R/4; with only the former
    1.11."""
    assert sink(dim=dim, h=R / cells, spread=R, take_out=True) == pytest.approx(DEPTH, abs=0.012)


def test_depth_is_larger_without(sink):
    assert sink(h=R / 4) > 1.2 and sink(h=R / 4, spread=R) == pytest.approx(1.11, abs=0.01)


def test_beam_with_a_spread_force(run, case):
    """Impulse and books stay exact; the force, over 4 mm, changes by less than a hundredth."""
    from coupling.ledger import exchange
    plain, spread = (list(run(spread=radius, take_out=radius > 0, iterate=0).values())[-1]
                     for radius in (0.0, 6e-3))
    assert exchange.impulse_error(spread) < 1e-12
    assert 0 < abs(spread["force"] - plain["force"]).max() < 0.02 * plain["force"].max()
    assert abs(spread["interface_error"][-1]) < 1e-3 and abs(spread["energy_error"][-1]
                                                             - plain["energy_error"][-1]) < 1e-3
