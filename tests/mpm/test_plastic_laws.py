"""Laws with a yield surface: return mapping against what defines it, tangents in every region, invariance."""
import itertools

import numpy as np
import pytest
from numba import njit
from numba.core.runtime import _nrt_python, rtsys
from scipy.optimize import nnls

from mpm_fenicsx import cam_clay, drucker_prager, herschel_bulkley, mohr_coulomb, mu_i, softened, von_mises
from mpm_fenicsx.laws import kernels
from mpm_fenicsx.laws.algebra import stored, whole
from mpm_fenicsx.laws.drucker_prager import CONE
from mpm_fenicsx.laws.law import compiled_parts
from mpm_fenicsx.laws.mohr_coulomb import (
    COMPRESSION_EDGE,
    CORNER,
    EXTENSION_EDGE,
    SHEAR,
    SHEAR_TENSION,
    TENSION,
    TENSION_EDGE,
)
from mpm_fenicsx.laws.plastic_state import ELASTIC, OPEN
from mpm_fenicsx.laws.von_mises import FLOW

DT = 0.1  # as of ``Element``
MC = dict(E=1.0, nu=0.3, friction_angle=30.0, dilation_angle=10.0, cohesion=0.01)
WEAK = dict(E=1.0, nu=0.3, friction_angle=20.0, cohesion=0.003)
CUT = dict(E=1.0, nu=0.2, friction_angle=30.0, dilation_angle=10.0, cohesion=0.01)


def soft(make, cell=0.1, peak=MC, residual=WEAK, **both):
    """Softens within plastic strains of about those that are tested."""
    return softened(make(**peak, **both), make(**residual, **both), 0.4, 0.1, cell)


def soft_cut(make):
    """The same with a cut-off that falls."""
    return softened(make(**CUT, tension_cutoff=0.004),
                    make(**{**CUT, "dilation_angle": 0.0}, tension_cutoff=0.001), 0.4, 0.1, 0.1)


LAWS = {"pyramid": (mohr_coulomb(**MC), (ELASTIC, SHEAR, COMPRESSION_EDGE, EXTENSION_EDGE, OPEN)),
        "no dilation": (mohr_coulomb(1.0, 0.4, 22.0, 0.0, 0.01), (ELASTIC, SHEAR, COMPRESSION_EDGE,
                                                                  EXTENSION_EDGE, OPEN)),
        "no friction": (mohr_coulomb(1.0, 0.2, 0.0, 0.0, 0.01), (ELASTIC, SHEAR, COMPRESSION_EDGE,
                                                                 EXTENSION_EDGE)),
        "cut pyramid": (mohr_coulomb(1.0, 0.2, 30.0, 10.0, 0.01, tension_cutoff=0.004),
                        (ELASTIC, SHEAR, COMPRESSION_EDGE, EXTENSION_EDGE, TENSION, TENSION_EDGE,
                         SHEAR_TENSION, CORNER, OPEN)), "cone": (drucker_prager(**MC), (ELASTIC, CONE, OPEN)),
        "cut cone": (drucker_prager(**MC, tension_cutoff=0.004, match="plane_strain"), (ELASTIC, CONE, OPEN)),
        "metal": (von_mises(1.0, 0.3, 0.03), (ELASTIC, FLOW)),
        "hard metal": (von_mises(1.0, 0.3, 0.03, 0.2), (ELASTIC, FLOW)),
        "viscous pyramid": (mohr_coulomb(**MC, viscosity=0.02),
                            (ELASTIC, SHEAR, COMPRESSION_EDGE, EXTENSION_EDGE, OPEN)),
        "viscous metal": (von_mises(1.0, 0.3, 0.03, 0.2, 0.02), (ELASTIC, FLOW)),
        "clay": (cam_clay(25.0, 0.1, 0.02, 0.4, 0.01, 0.005), (ELASTIC, FLOW)),
        "grains": (mu_i(1.0, 0.3, 0.38, 0.64, 0.28, 0.1, 1.0), (ELASTIC, FLOW, OPEN)),
        "mud": (herschel_bulkley(0.8, 0.02, 0.01, 0.5, 0.4), (ELASTIC, FLOW, OPEN)),
        "paste": (herschel_bulkley(0.8, 0.05, 0.01, 1.7, 0.4, 0.01), (ELASTIC, FLOW, OPEN)),
        "Bingham": (herschel_bulkley(0.8, 0.02, 0.01, 1.0, 0.4), (ELASTIC, FLOW, OPEN)),
        "soft soil": (soft(mohr_coulomb), (ELASTIC, SHEAR, COMPRESSION_EDGE, EXTENSION_EDGE, OPEN)),
        "cut soft soil": (soft_cut(mohr_coulomb), (ELASTIC, SHEAR, COMPRESSION_EDGE, EXTENSION_EDGE, TENSION,
                                                   TENSION_EDGE, SHEAR_TENSION, CORNER, OPEN)),
        "viscous soft soil": (soft(mohr_coulomb, viscosity=0.02), (ELASTIC, SHEAR, COMPRESSION_EDGE,
                                                                   EXTENSION_EDGE, OPEN)),
        "soft cone": (soft(drucker_prager), (ELASTIC, CONE, OPEN)),
        "cut soft cone": (soft_cut(drucker_prager), (ELASTIC, CONE, OPEN)),
        "Newton": (herschel_bulkley(0.8, 0.02, shear_modulus=0.4), (FLOW, OPEN))}
IN_REGIONS = [pytest.param(law, region, dim, id=f"{name}-{region}-{dim}D") for name, (law, regions)
              in LAWS.items() for region in regions for dim in (2, 3)]


@pytest.fixture(params=LAWS)
def plastic_law(request):
    return LAWS[request.param][0]


@pytest.fixture(params=[2, 3])
def dim(request):
    return request.param


def principal(law):
    """Return mapping and moduli of a law as functions of three sorted strains."""
    soil = dict(law.parts).get("soil", law)  # without viscosity
    parts = compiled_parts(soil, dict(D=2))

    def stress(e):
        *t, region = parts["return_map"](law.params, 0.0, DT, *e)
        return np.array(t), region
    return stress, lambda e, region: np.array(parts["moduli"](law.params, 0.0, DT, *e, region))


def sorted_strains(seed, n=4000, size=0.04):
    """Trial strains on all sides of the yield surfaces, in descending order."""
    random = np.random.default_rng(seed)
    e = random.normal(0, size, (n, 3)) + random.normal(0, size, (n, 1))
    return -np.sort(-e) * 10 ** random.uniform(-1, 0.5, (n, 1))


def led_to(element, law, dim, region, seed):
    """An element with some history and a deformation that leads to ``region``, with a direction to change it
    in."""
    random, point = np.random.default_rng(seed), element(law, dim)
    for _ in range(20000):
        point.states[:] = 0
        stretch, history, change = 10 ** random.uniform(-2.5, -1, 3)
        point.step(np.eye(dim) + history * random.normal(size=(dim, dim)))
        point.old["plastic"][2] += history * random.normal()  # the plane alone reaches few regions
        F = np.eye(dim) * (1 + stretch * random.normal()) + change * random.normal(size=(dim, dim))
        point.P(F)
        if point.region == region:
            return point, F, random.uniform(-1, 1, (dim, dim))
    raise AssertionError("no way into this region")


# ---------------------------------------------------------------- the return mapping in principal space

SETS = [dict(friction_angle=phi, dilation_angle=psi, cohesion=c, nu=nu, tension_cutoff=cut)
        for (phi, psi), (c, cut), nu in itertools.product(
            [(30.0, 30.0), (30.0, 10.0), (45.0, 0.0), (22.0, 0.0), (0.0, 0.0), (70.0, 5.0)],
            [(0.02, None), (0.02, 0.003), (0.02, 0.0), (0.0, None)], [-0.3, 0.0, 0.3, 0.49])
        if phi + c > 0]


@pytest.mark.parametrize("parameters", SETS, ids=lambda s: "-".join(f"{value}" for value in s.values()))
def test_pyramid_returns_by_plastic_flow_of_active_planes(parameters):
    """The stress is sorted and admissible, and what the return takes from the strain is a sum of the flow
    directions of the planes it lies on, none of them negative: this defines the return, and it is unique."""
    law = mohr_coulomb(1.0, **parameters)
    p, (stress, _) = law.params, principal(law)
    compliance = (1 + parameters["nu"]) * np.eye(3) - parameters["nu"]
    shear = list(itertools.permutations(range(3), 2))
    for e in sorted_strains(1, 500):
        t, region = stress(e)
        assert t[0] >= t[1] >= t[2]
        size = abs(e).max() + abs(t).max()
        gaps = [p.N * t[i] - t[j] - p.S for i, j in shear] + [t[i] - p.T for i in range(3)]
        assert max(gaps) < 1e-13 * (1 + p.N) * size
        flows = [p.M * np.eye(3)[i] - np.eye(3)[j] for i, j in shear] + list(np.eye(3))
        active = [flow for gap, flow in zip(gaps, flows) if gap > -1e-12 * (1 + p.N) * size]
        rest = e - compliance @ t
        if active:
            rest = nnls(np.array(active).T, rest)[1]
        assert np.linalg.norm(rest) < 1e-12 * (1 + p.N) * size


@pytest.mark.parametrize("name", LAWS)
def test_all_regions_are_met_and_their_moduli_are_derivatives(name, taylor_rate):
    law, regions = LAWS[name]
    stress, moduli = principal(law)
    met, random = {}, np.random.default_rng(3)
    for e in sorted_strains(2):
        t, region = stress(e)
        de = random.normal(0, 1e-3, 3) * abs(e).max()
        if stress(e + de)[1] != region or met.get(region, 0) >= 5 or np.diff(e + de).max() > 0:
            continue
        met[region] = met.get(region, 0) + 1
        change, linear = stress(e + de)[0] - t, moduli(e, region) @ de
        if "pyramid" in name or name.startswith("no"):  # made of planes: linear in each region
            np.testing.assert_allclose(change, linear, rtol=0, atol=1e-14)
        elif np.linalg.norm(change - linear) > 1e-13:
            assert taylor_rate(lambda h, e=e, de=de: stress(e + h * de)[0], linear,
                               h=1.0) == pytest.approx(2.0, abs=0.02)
    assert sorted(met) == sorted(regions) and min(met.values()) == 5


# ---------------------------------------------------------------- the law at a point

@pytest.mark.parametrize("law, region, dim", IN_REGIONS)
@pytest.mark.parametrize("seed", range(3))
def test_tangent_is_the_derivative_in_every_region(element, law, region, dim, seed, taylor_rate):
    point, F, dF = led_to(element, law, dim, region, seed)
    if not point.P(F).any():  # separated, and so around it
        assert region == OPEN and not point.P(F + 2e-6 * dF).any() and not point.A(F).any()
        return
    rate = taylor_rate(lambda h: point.P(F + h * dF), np.einsum("ijkl,kl", point.A(F), dF), h=2e-6)
    assert rate == pytest.approx(2.0, abs=0.05)


@pytest.mark.parametrize("make", [mohr_coulomb, drucker_prager])
@pytest.mark.parametrize("match", ["compression", "plane_strain"])
def test_tangent_is_symmetric_when_dilation_equals_friction(element, make, match, dim):
    others, random = dict(match=match) if make is drucker_prager else {}, np.random.default_rng(0)
    for psi in (30.0, 10.0):
        law, largest = make(1.0, 0.3, 30.0, psi, 0.01, 0.004, **others), 0.0
        for _ in range(50):
            A = element(law, dim).A(np.eye(dim) + random.normal(0, 0.03, (dim, dim)))
            largest = max(largest, abs(A - A.transpose(2, 3, 0, 1)).max())
        assert law.symmetric == (largest < 1e-13)


@pytest.mark.parametrize("law, region, dim", IN_REGIONS)
def test_rotating_the_deformed_body_rotates_the_stress(element, law, region, dim):
    """P(QF) = Q P(F) with the same history, and the new history does not notice."""
    point, F, _ = led_to(element, law, dim, region, 7)
    Q = np.linalg.qr(np.random.default_rng(1).normal(size=(dim, dim)))[0]
    Q[:, 0] *= np.linalg.det(Q)
    P, new, turn = point.P(F), point.new.copy(), np.eye(3)
    turn[:dim, :dim] = Q
    for state in (point.old, new):  # the one part that belongs to the deformed body
        state["kirchhoff_stress"] = stored(turn @ whole(state["kirchhoff_stress"]) @ turn.T)
    np.testing.assert_allclose(point.P(Q @ F), Q @ P, rtol=0, atol=1e-14)
    for name in point.new.dtype.names:
        np.testing.assert_allclose(point.new[name], new[name], rtol=0, atol=1e-14)


@pytest.mark.parametrize("seed", range(20))
def test_the_plane_is_a_slice_of_space(element, plastic_law, seed):
    """Plane strain equals three dimensions with F33 = 1 along a path, wherever the stress across the plane
    ranks."""
    plane, space, random = element(plastic_law, 2), element(plastic_law, 3), np.random.default_rng(seed)
    for _ in range(4):
        F, full = np.eye(2) + random.normal(0, 0.04, (2, 2)) + random.normal(0, 0.03) * np.eye(2), np.eye(3)
        full[:2, :2] = F
        if np.ptp(np.linalg.svd(full)[1]) < 1e-3:
            continue
        np.testing.assert_allclose(plane.A(F), space.A(full)[:2, :2, :2, :2], rtol=0, atol=1e-11)
        np.testing.assert_allclose(plane.step(F), space.step(full), rtol=0, atol=1e-14)
        for name in plane.old.dtype.names:
            np.testing.assert_allclose(plane.old[name], space.old[name], rtol=0, atol=1e-14)


def test_state_is_filled_alike_by_stress_and_tangent_and_old_stays(element, plastic_law, dim):
    """To round-off, as both are compiled apart."""
    point = element(plastic_law, dim)
    random = np.random.default_rng(0)
    for _ in range(10):
        point.step(np.eye(dim) + random.normal(0, 0.03, (dim, dim)))
        F, before = np.eye(dim) + random.normal(0, 0.03, (dim, dim)), point.old.tobytes()
        point.P(F)
        first = point.new.copy()
        point.new["plastic"] = 7.0
        if dim == 2:  # what a plane body never uses
            point.new["plastic"] = 0.0
        point.A(F)
        for name in first.dtype.names:
            np.testing.assert_allclose(point.new[name], first[name], rtol=0, atol=1e-15)
        assert point.old.tobytes() == before


def test_stress_at_the_end_of_a_step_is_found_again_from_its_state(element, plastic_law, dim):
    random = np.random.default_rng(5)
    for _ in range(20):
        point, F = element(plastic_law, dim), np.eye(dim) + random.normal(0, 0.03, (dim, dim))
        if "soil" in dict(plastic_law.parts):
            point.dt = np.inf  # else there is a viscous part, which needs a rate
        tau = point.step(F)
        point.dt = 0.0
        np.testing.assert_allclose(point.tau(F), tau, rtol=0, atol=1e-14)
        for name in point.new.dtype.names:
            np.testing.assert_allclose(point.new[name], point.old[name], rtol=0, atol=1e-14)


@pytest.mark.parametrize("gap", [1e-3, 1e-4, 1.1e-5, 0.9e-5, 1e-6, 1e-9, 1e-14])
def test_tangent_where_stretches_meet(element, plastic_law, dim, gap):
    """It varies smoothly with the stretches, so the nearly equal ones have the tangent of the equal ones."""
    steep = 100 if plastic_law.name == "cam_clay" else 10  # its stiffness grows as exp(strain / kappa*)
    R = np.linalg.qr(np.random.default_rng(2).normal(size=(dim, dim)))[0]
    A = [element(plastic_law, dim).A(R @ np.diag([0.99, 0.99 * (1 + g), 0.9][:dim]) @ R.T)
         for g in (gap, 0.0)]
    np.testing.assert_allclose(A[0], A[1], rtol=0, atol=steep * gap + 1e-10)


@pytest.mark.parametrize("make", [mohr_coulomb, drucker_prager])
def test_pulled_soil_without_cohesion_has_exactly_no_stress(element, make, dim):
    random = np.random.default_rng(0)
    for angle in (0.0, 15.0):
        point = element(make(5e4, 0.4, 30.0, angle), dim)
        for _ in range(20):
            F = 1.2 * np.eye(dim) + random.normal(0, 0.02, (dim, dim))
            assert not point.A(F).any() and not point.step(F).any() and point.old["opened"] > 0


@pytest.mark.parametrize("name", ["hard metal", "metal", "cone", "viscous metal"])
@pytest.mark.parametrize("seed", range(3))
def test_plane_stress_by_the_general_route(name, seed, at_point, taylor_rate):
    point, random = at_point(LAWS[name][0], "plane_stress"), np.random.default_rng(seed)
    F, dF = np.array([[0.95, 0.03], [-0.02, 0.98]]) + random.normal(0, 0.01,
                                                                    (2, 2)), random.normal(size=(2, 2))
    assert abs(point.P33(F)) < 1e-14
    rate = taylor_rate(lambda h: point.P(F + h * dF), np.einsum("ijkl,kl", point.A(F), dF), h=1e-5)
    assert rate == pytest.approx(2.0, abs=0.05)


def test_a_body_turned_inside_out_has_no_stress(plastic_law, element, dim):
    F = np.eye(dim)
    F[0, 0] = -0.5
    assert np.isnan(element(plastic_law, dim).P(F)).all() and np.isnan(element(plastic_law, dim).A(F)).any()


def test_cauchy_stress_leaves_the_state_of_the_points(make_mpm):
    solid = make_mpm(law=mohr_coulomb(1e3, 0.3, 30.0, 5.0, 1.0))
    solid.points.F += np.random.default_rng(0).uniform(-0.1, 0.1, solid.points.F.shape)
    before = solid.points.state.tobytes()
    assert np.isfinite(solid.cauchy_stress()).all() and solid.points.state.tobytes() == before


def test_kernels_make_no_arrays(plastic_law, dim):
    _, tangent = kernels(plastic_law, dim)

    @njit
    def repeat(times, p, F, state, P, A):
        for _ in range(times):
            tangent(p, F, 1.0, 0.1, state[0], state[1], P, A)

    F, n = 0.98 * np.eye(dim) + 0.03 * np.random.default_rng(0).normal(size=(dim, dim)), dim * dim + 1
    getattr(_nrt_python, "memsys_enable_stats", lambda: None)()  # off by default since numba 0.57
    made = []
    for times in (1, 1, 100):
        before = rtsys.get_allocation_stats().alloc
        repeat(times, plastic_law.params, F, np.zeros(2, plastic_law.state), np.zeros(n), np.zeros((n, n)))
        made.append(rtsys.get_allocation_stats().alloc - before)
    assert made[2] == made[1]
