"""Modified Cam clay against closed forms, which are exact in Kirchhoff's stress."""
import numpy as np
import pytest
from scipy.optimize import brentq

from mpm_fenicsx import PATHS, Body, Box, Grid, Stage, at_rest, cam_clay, drive, neo_hooke
from mpm_fenicsx.compiled import specialise
from mpm_fenicsx.laws.cam_clay import FLOW
from mpm_fenicsx.laws.plastic_parts import strains_of

PHI, LAM, KAPPA, G, P_C, P_R = 25.0, 0.1, 0.02, 2e6, 1e5, 10.0
M = 6 * np.sin(np.radians(PHI)) / (3 - np.sin(np.radians(PHI)))


def clay(**changed):
    return cam_clay(**{**dict(friction_angle=PHI, compression=LAM, swelling=KAPPA, shear_modulus=G,
                              preconsolidation=P_C, reference_pressure=P_R), **changed})


def led(name, **keys):
    """Table of a named path, and P, Q and P_c of Kirchhoff's stress."""
    table = drive(clay(), PATHS[name](**keys))
    J = np.exp(table["volume"])
    return table, J * table["p"], J * table["q"], P_C * np.exp(table["compaction"] / (LAM - KAPPA))


def test_first_compression_and_swelling():
    """ln V falls by kappa* ln P up to P_c0, then by lambda* ln P, and rises by kappa* ln P."""
    pressure = 4e5
    path = [*PATHS["isotropic"](pressure), Stage(stress=dict.fromkeys(("xx", "yy", "zz"), -1e4))]
    table = drive(clay(), path)
    P, P_c = np.exp(table["volume"]) * table["p"], P_C * np.exp(table["compaction"] / (LAM - KAPPA))
    largest = np.maximum.accumulate(np.maximum(P, P_C))
    exact = -KAPPA * np.log1p(P / P_R) - (LAM - KAPPA) * np.log(largest / P_C)
    np.testing.assert_allclose(table["volume"], exact, rtol=1e-9, atol=1e-12)
    assert P_c[-1] == pytest.approx(P.max(), rel=1e-9) and P_c[-1] > 2.9 * P_C


@pytest.mark.parametrize("pressure", [2e5, 2e4], ids=["normally consolidated", "overconsolidated"])
def test_drained_to_the_critical_state(pressure):
    """q = M P, P = P_c / 2, no change of volume; wet clay is compacted on the way, dry clay has a peak."""
    table, P, q, P_c = led("triaxial", shortening=1.0, pressure=pressure, steps=100)
    assert q[-1] == pytest.approx(M * P[-1], rel=2e-3) and P_c[-1] == pytest.approx(2 * P[-1], rel=5e-3)
    change = np.diff(table["volume"][101:])
    assert abs(change[-1]) < 1e-2 * abs(np.diff(table["e_yy"])[-1]) and abs(change[-1]) < abs(change).max()
    compacted = table["compaction"][-1] > table["compaction"][100]
    assert compacted == (pressure > P_C) and (q.max() > 1.02 * q[-1]) == (pressure < P_C)
    assert table["p"][-1] == pytest.approx(pressure / (1 - M / 3), rel=2e-3)  # dq = 3 dp


def test_undrained_path():
    """From first compression P = P_0 (1 + (eta / M)^2)^(-(lambda* - kappa*) / lambda*), to q = M P there."""
    table, P, q, _ = led("undrained", shortening=0.5, pressure=2e5, steps=100)
    sheared = slice(101, None)
    exact = P[100] * (1 + (q[sheared] / (M * P[sheared])) ** 2) ** (KAPPA / LAM - 1)
    np.testing.assert_allclose(P[sheared], exact, rtol=1e-4)  # P_R is small but there
    assert q[-1] == pytest.approx(M * P[-1], rel=1e-5)
    assert P[-1] == pytest.approx(P[100] * 2 ** (KAPPA / LAM - 1), rel=1e-4)
    np.testing.assert_allclose(table["volume"][100:], table["volume"][100], rtol=1e-12)


@pytest.mark.parametrize("pressure", [2e4, 6e4, 2e5, 1e6])
def test_undrained_strength(pressure):
    """Whatever the history: kappa* ln (P + P_r) + (lambda* - kappa*) ln 2 P is that of the start."""
    table, P, q, P_c = led("undrained", shortening=0.8, pressure=pressure, steps=80)
    start = KAPPA * np.log(P[80] + P_R) + (LAM - KAPPA) * np.log(P_c[80])
    end = brentq(lambda x: KAPPA * np.log(x + P_R) + (LAM - KAPPA) * np.log(2 * x) - start, 1.0, 1e8)
    assert P[-1] == pytest.approx(end, rel=1e-6) and q[-1] == pytest.approx(M * end, rel=1e-6)


@pytest.mark.parametrize("name, keys", [("triaxial", dict(shortening=0.3, pressure=2e4)),
                                        ("oedometer", dict(shortening=0.3, pressure=1e3)),
                                        ("simple_shear", dict(shear=1.0, pressure=3e5)),
                                        ("cyclic", dict(shortening=0.03, pressure=2e5, cycles=2)),
                                        ("plane_strain", dict(shortening=0.4, pressure=5e4))])
def test_the_stress_stays_on_the_ellipse_or_within(name, keys):
    table, P, q, P_c = led(name, steps=25, **keys)
    excess = (q / M) ** 2 + P * (P - P_c)
    flows = np.diff(table["plastic_strain"], prepend=0.0) > 0
    assert (excess <= 1e-9 * P_c**2).all() and flows.sum() > 10
    np.testing.assert_allclose(excess[flows] / P_c[flows] ** 2, 0.0, atol=1e-9)
    assert (np.diff(table["plastic_work"]) >= -1e-9 * table["plastic_work"][-1]).all()
    assert table["work"][-1] == pytest.approx(table["energy"][-1] + table["plastic_work"][-1], rel=0.05)


def test_the_return_finds_the_ellipse_from_far_away():
    """From trial strains of any kind, as large as Newton's method may try: P of the exponential elasticity is
    then beyond any stress that there is."""
    law, random, least = clay(), np.random.default_rng(0), 1e-3  # [Pa]: below it P is round-off of the strain
    parts, flowing = dict(law.parts), 0
    return_map = specialise(parts["return_map"], D=2)
    for _ in range(5000):
        shape, volume = 10 ** random.uniform(-6, -0.5), 10 ** random.uniform(-6, -0.3)
        e = random.normal(0, shape, 3) + random.normal(0, volume)
        before = random.normal(0, 0.2)
        *t, region = return_map(law.params, before, 0.1, *-np.sort(-e))
        P = -np.mean(t)
        q = np.sqrt(1.5 * np.sum((t + P) ** 2))
        assert np.isfinite(t).all()
        if region == FLOW and least < P:
            P_c = P_C * np.exp((before - e.sum() - KAPPA * np.log1p(P / P_R)) / (LAM - KAPPA))
            assert (q / M) ** 2 + P * (P - P_c) == pytest.approx(0.0, abs=1e-8 * P_c**2)
            flowing += 1
    assert flowing > 2000


def test_what_was_pulled_apart_is_as_hard_when_it_is_as_dense():
    """It has no stress in between; pressed beyond P_c0 it is as if it had not been."""
    sides = ("xx", "yy", "zz")
    plain = drive(clay(), [Stage(dict.fromkeys(sides, -0.08), steps=10)])
    table = drive(clay(), [Stage(dict.fromkeys(sides, change), steps=steps)
                           for change, steps in ((0.3, 5), (-0.3, 5), (-0.08, 10))])
    assert abs(table["p"][5]) < 1e-3 and table["compaction"][5] == pytest.approx(-0.9, rel=1e-9)
    beyond = plain["p"][1:] > 1.2 * P_C
    assert beyond.sum() == 3 and (table["p"][11:] > 0.99 * plain["p"][1:]).all()
    for name in ("p", "compaction"):
        np.testing.assert_allclose(table[name][11:][beyond], plain[name][1:][beyond], rtol=1e-6)


def test_it_starts_with_the_stress_of_its_weight(start):
    """Not with a tension that it never has; an elastic law has no state for it."""
    box = Box((0.0, 0.0), (1.0, 1.0))
    body = Body(box, (4, 4), 2, clay(), 1800.0, stress=at_rest(1.0, 1800.0, 9.81, 0.6))
    solid = start(Grid(Box((-0.5, -0.5), (1.5, 1.5)), (8, 8)), body, gravity=(0.0, -9.81), inertia="lumped")
    sigma, depth = solid.cauchy_stress(), 1.0 - solid.points.x[:, 1]
    J = np.ones(len(depth))
    np.testing.assert_allclose(sigma[:, 1, 1], -1800.0 * 9.81 * depth / J, rtol=1e-9)
    np.testing.assert_allclose(sigma[:, 0, 0], 0.6 * sigma[:, 1, 1], rtol=1e-9)
    with pytest.raises(ValueError, match=r"cam_clay has no state with the principal stresses \[50.0,"):
        strains_of(clay(), np.full((1, 3), 50.0))
    with pytest.raises(ValueError, match="the law neo_hooke cannot start with a stress"):
        strains_of(neo_hooke(1e6, 0.3), np.zeros((1, 3)))


@pytest.mark.parametrize("changed, words", [
    (dict(friction_angle=0.0), "friction_angle is 0.0 degrees: give more than 0 and less than 90"),
    (dict(compression=0.01), "compression is 0.01: give more than the swelling index, 0.02, and at most 2"),
    (dict(swelling=0.0), "swelling is 0.0: give a number from 1e-5 to 1"),
    (dict(shear_modulus=-1.0), "shear_modulus is -1.0 Pa: give a positive number"),
    (dict(preconsolidation=0.0), "preconsolidation is 0.0 Pa"),
    (dict(reference_pressure=np.nan), "reference_pressure is nan Pa")],
    ids=["angle", "compression", "swelling", "shear", "preconsolidation", "reference"])
def test_impossible_clays(changed, words):
    with pytest.raises(ValueError, match=words):
        clay(**changed)


def test_of_several_solutions_it_takes_the_next_one():
    """Brittle clay dry of critical: as it begins to yield, the stress does not jump to another one."""
    brittle = cam_clay(35.0, 0.0247, 0.00935, 4e5, 6.9e5)
    table = drive(brittle, PATHS["undrained"](shortening=0.7, pressure=1.245e5, steps=2000))
    q = table["q"][2001:]
    yields = np.flatnonzero(np.diff(table["compaction"][2001:]))[0]
    assert abs(np.diff(q[yields - 1:yields + 3])).max() < 2e-3 * q.max()
