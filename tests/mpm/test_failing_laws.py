"""A law without a stress names the point, and the step is cut."""
import re

import numpy as np
import pytest

from mpm_fenicsx import (
    LAWS,
    MPM,
    Body,
    Box,
    Grid,
    MPMDivergedError,
    Support,
    drucker_prager,
    herschel_bulkley,
    linear,
    mohr_coulomb,
    mu_i,
    neo_hooke,
    softened,
    von_mises,
)
from mpm_fenicsx.laws.cam_clay import cam_clay

SOIL = dict(E=1e6, nu=0.3, friction_angle=30.0, cohesion=1e4)
WEAK = dict(E=1e6, nu=0.3, friction_angle=25.0, cohesion=8e3)
ALL = {"neo_hooke": neo_hooke(1e6, 0.3), "mohr_coulomb": mohr_coulomb(**SOIL),
       "viscous": mohr_coulomb(**SOIL, viscosity=10.0), "drucker_prager": drucker_prager(**SOIL),
       "softening": softened(mohr_coulomb(**SOIL), mohr_coulomb(**WEAK), 0.1, 0.1, 0.1),
       "softening cone": softened(drucker_prager(**SOIL), drucker_prager(**WEAK), 0.1, 0.1, 0.1),
       "von_mises": von_mises(1e6, 0.3, 1e5, 1e4), "mu_i": mu_i(1e6, 0.3, 0.4, 0.65, 0.28, 5e-4, 2450.0),
       "herschel_bulkley": herschel_bulkley(1e6, 20.0, 50.0, 0.4),
       "cam_clay": cam_clay(25.0, 0.1, 0.02, 1e6, 1e5)}


def pressed(law, way, f_bar=False, at=(0.0, 0.0), dim=2, **others):
    """A block of two cells, of 10 cm, whose top goes down by ``way`` cells in a step of 0.01 s."""
    low = np.array([*at, 0.0][:dim])
    size = np.array((0.1, 0.2, 0.1)[:dim])
    body = Body(Box(tuple(low), tuple(low + size)), (1, 2, 1)[:dim], 2, law, 1000.0, f_bar=f_bar, **others)
    ends = [Support(lambda x: x[:, 1] < low[1] + 1e-6, "xyz"[:dim], name="bed"),
            Support(lambda x: x[:, 1] > low[1] + 0.2 - 1e-6, "y", lambda t: -10.0 * way * t, name="top")]
    return MPM(Grid(Box(tuple(low), tuple(low + size)), (1, 2, 1)[:dim]), body, ends, inertia="lumped")


def test_all_laws_that_may_fail_are_here():
    """Of those of the package only ``linear`` has a stress at every F, but in plane stress."""
    names = {law.name for law in ALL.values()}
    assert names >= set(LAWS) - {"linear"}


@pytest.mark.parametrize("f_bar", [False, True])
@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("name", ALL)
def test_point_place_and_state_are_named(name, dim, f_bar):
    """The top would go through the bed, in each of eight parts of a step: the body is as it was."""
    solid = pressed(ALL[name], 40.0, f_bar, dim=dim)
    before = solid.points.copy()
    with pytest.raises(MPMDivergedError) as failed:
        solid.advance(0.01)
    text = str(failed.value)
    assert re.search(rf"{ALL[name].name} has no stress at material point \d+, x = \[.*\] m, where det F goes "
                     "from 1 to (-|nan)", text), text
    assert "nor did" in text and "2, 4 or 8 shorter steps in its place" in text
    for part in ALL[name].state.names:
        scalar = ALL[name].state[part].shape == () and part != "unused"
        assert (f"{part} = 0" in text) == scalar
    after = solid.points.copy()
    assert solid.time == 0.0 and all(after[key].tobytes() == before[key].tobytes() for key in ("x", "v", "F"))
    number = int(re.search(r"material point (\d+)", text)[1])
    place = [float(x) for x in re.search(r"x = \[(.*?)\]", text)[1].split(",")]
    np.testing.assert_allclose(place, solid.points.x[number], rtol=1e-5)
    solid.close()


@pytest.mark.parametrize("name", ALL)
def test_a_shorter_step_goes_on(name):
    """One of 1.1 cells turns the upper one inside out, two of half of that do not."""
    solid = pressed(ALL[name], 1.1)
    with pytest.warns(UserWarning, match="it succeeds with .*shorter steps"):
        solid.advance(0.01)
    assert solid.time == pytest.approx(0.01) and "shorter steps" in solid.helped
    assert np.isfinite(solid.cauchy_stress()).all()
    solid.close()


def test_linear_in_plane_stress():
    """Drawn too far, no stretch across the plane frees it of stress there."""
    solid = pressed(linear(1e6, 0.3), -40.0, stress_state="plane_stress")
    match = r"linear has no stress at material point \d, x = .* det F goes from 1 to .*; nor did"
    with pytest.raises(MPMDivergedError, match=match):
        solid.advance(0.01)
    solid.close()


def test_places_are_those_of_the_user():
    solid = pressed(ALL["von_mises"], 40.0, at=(4.5e5, 5e6))
    with pytest.raises(MPMDivergedError, match=r"x = \[450000.021, 5000000.12\] m"):
        solid.advance(0.01)
    solid.close()


@pytest.mark.mpi
def test_the_same_point_on_several_ranks(on_ranks):
    code = """
from test_failing_laws import ALL, pressed
import numpy as np
solid = pressed(ALL["von_mises"], 40.0)
try:
    solid.advance(0.01)
except Exception as error:
    texts = solid.comm.allgather(str(error))
    if solid.comm.rank == 0:
        print(len(set(texts)), texts[0])
solid.close()
"""
    said = [on_ranks(n, code) for n in (1, 2)]
    for done in said:
        assert done.returncode == 0, done.stderr[-2000:]
    one, two = (re.search(r"(\d) .*(von_mises has no stress at .*?);", done.stdout, re.DOTALL)
                for done in said)
    assert one[1] == two[1] == "1" and one[2] == two[2]
