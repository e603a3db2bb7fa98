"""Transfers with a velocity that varies around the points (APIC, TPIC) and the midpoint rule: what they
keep."""
import numpy as np
import pytest

from mpm_fenicsx import (
    MPM,
    Body,
    Box,
    Grid,
    Interface,
    Numerics,
    Support,
    linear,
    mohr_coulomb,
    neo_hooke,
)
from mpm_fenicsx.compiled import specialise
from mpm_fenicsx.points import affine, transfer
from mpm_fenicsx.points.moments import moment, skew
from mpm_fenicsx.terms import midpoint
from mpm_fenicsx.terms.newmark import Increment

EPS = np.finfo(float).eps


class Splines:
    """Thirty points at random on a lattice of 7^D nodes, 0.5 m apart, with the quadratic B-splines of the 3^D
    nodes around each, random mass, velocity and affine moment."""

    def __init__(self, D):
        self.D, self.h, n = D, 0.5, 30
        self.random = np.random.default_rng(3)
        lattice = np.stack(np.meshgrid(*[np.arange(7)] * D, indexing="ij"), -1).reshape(-1, D)
        self.places, strides = self.h * lattice - 1.3, 7 ** np.arange(D)[::-1]
        self.x = self.random.uniform(self.places.min() + 1.0, self.places.max() - 1.0, (n, D))
        nearest = np.rint((self.x - self.places.min()) / self.h).astype(int)
        self.element = np.arange(n, dtype=np.int32)
        shift = np.stack(np.meshgrid(*[[-1, 0, 1]] * D, indexing="ij"), -1).reshape(-1, D)
        self.nodes = ((nearest[:, None] + shift) @ strides).astype(np.int32)
        s = (self.x[:, None] - self.places[self.nodes]) / self.h
        r = np.abs(s)
        value = np.where(r < 0.5, 0.75 - r**2, 0.5 * (1.5 - r) ** 2)
        slope = np.where(r < 0.5, -2.0 * s, -(1.5 - r) * np.sign(s)) / self.h
        self.N = value.prod(axis=2)
        self.G = np.stack([np.where(np.arange(D) == i, slope, value).prod(axis=2) for i in range(D)], axis=1)
        self.mass, self.v = self.random.uniform(0.5, 2.0, n), self.random.normal(size=(n, D))
        self.B = self.h**2 * self.random.normal(size=(n, D, D))
        self.C = self.B / (0.25 * self.h**2)  # D_p = h^2/4 I

    def to_grid(self, apic):
        """Masses and velocities of the nodes."""
        nodal, size = np.zeros((len(self.places), 1 + 2 * self.D)), dict(D=self.D, K=3**self.D)
        still = np.zeros_like(self.v)
        specialise(transfer.to_grid, **size)(self.element, self.nodes, self.N, self.mass, self.v, still,
                                             nodal)
        specialise(affine.to_grid, **size, APIC=apic)(self.element, self.nodes, self.N, self.places, self.x,
                                                      self.mass, self.B if apic else self.C, nodal)
        mass = nodal[:, 0]
        return mass, nodal[:, 1:1 + self.D] / np.where(mass > 0.0, mass, 1.0)[:, None]

    def to_points(self, apic, increment):
        """The points move and take the velocity of the nodes."""
        size = dict(D=self.D, K=3**self.D)
        specialise(affine.to_points, **size, APIC=apic)(self.element, self.nodes, self.N, self.G, self.places,
                                                        increment, self.C, self.B)
        specialise(transfer.to_points_midpoint, **size)(self.element, self.nodes, self.N, increment, self.x,
                                                        self.v, 0.0 * self.v)

    def angular(self):
        return moment(self.x, self.mass[:, None] * self.v) + skew(np.tensordot(self.mass, self.B, 1))

    def kinetic(self):
        around = (self.C * self.B).sum(axis=(1, 2))
        return 0.5 * self.mass @ ((self.v**2).sum(axis=1) + around)


@pytest.fixture(params=[2, 3], ids=["plane", "space"])
def splines(request):
    return Splines(request.param)


def motion(splines, dt=0.1):
    """A random motion of the nodes over a step, with their velocity at its end."""
    v, u = splines.random.normal(size=(2, *splines.places.shape))
    increment = Increment(dt, midpoint.alpha(dt), 0.1 * u, midpoint.acceleration(0.1 * u, v, None, dt))
    return increment, midpoint.velocity(None, increment), 2.0 * 0.1 * u / dt - v


def test_apic_gives_the_nodes_momentum_and_angular_momentum_of_the_points(splines):
    mass, v = splines.to_grid(True)
    np.testing.assert_allclose(mass @ v, splines.mass @ splines.v, rtol=0, atol=200 * EPS)
    np.testing.assert_allclose(moment(splines.places, mass[:, None] * v), splines.angular(), rtol=0,
                               atol=1e3 * EPS)
    assert 0.5 * mass @ (v**2).sum(axis=1) < splines.kinetic()


@pytest.mark.parametrize("apic", [True, False], ids=["apic", "tpic"])
def test_nodes_get_the_velocity_of_a_rigid_body_back(splines, apic):
    """v = v_0 + W x is the same on points, nodes and points again."""
    W = splines.random.normal(size=(splines.D, splines.D))
    W -= W.T
    splines.v, splines.C[:] = 1.0 + splines.x @ W.T, W
    size = dict(D=splines.D, K=3**splines.D)
    specialise(affine.start, **size)(splines.element, splines.nodes, splines.N, splines.places, splines.x,
                                     splines.C, splines.B)
    np.testing.assert_allclose(splines.B, 0.25 * splines.h**2 * splines.C, rtol=0, atol=20 * EPS)
    mass, v = splines.to_grid(apic)
    np.testing.assert_allclose(v[mass > 0], (1.0 + splines.places @ W.T)[mass > 0], rtol=0, atol=100 * EPS)
    still = Increment(1.0, 2.0, 0.0 * v, 2.0 * (1.0 + splines.places @ W.T))  # v' = dt/2 a
    splines.to_points(apic, still)
    np.testing.assert_allclose(splines.C, np.broadcast_to(W, splines.C.shape), rtol=0, atol=500 * EPS)


def test_apic_gives_the_points_momentum_and_angular_momentum_of_the_moved_nodes(splines):
    mass = splines.to_grid(True)[0]
    increment, v, expected = motion(splines)
    np.testing.assert_allclose(v, expected, rtol=0, atol=1e3 * EPS)
    splines.to_points(True, increment)
    np.testing.assert_allclose(splines.mass @ splines.v, mass @ v, rtol=0, atol=1e3 * EPS)
    turned = moment(splines.places + increment.u, mass[:, None] * v)
    np.testing.assert_allclose(splines.angular(), turned, rtol=0, atol=5e3 * EPS)
    assert splines.kinetic() < 0.5 * mass @ (v**2).sum(axis=1)


def test_gradients_are_those_of_a_linear_velocity_on_the_moved_grid(splines):
    """u = H x, v' = A (x + u): TPIC finds C = A for any H, APIC too, and B = A (I + H) h^2/4 (I + H)^T."""
    D = splines.D
    H, A = 0.2 * splines.random.normal(size=(2, D, D))
    u = splines.places @ H.T
    a = 2.0 * ((splines.places + u) @ A.T - u)  # dt = 1: v' = u + a / 2
    for apic in (True, False):
        splines.x = np.einsum("pk,pkd->pd", splines.N, splines.places[splines.nodes])
        splines.to_points(apic, Increment(1.0, 2.0, u, a))
        np.testing.assert_allclose(splines.C, np.broadcast_to(A, splines.C.shape), rtol=0, atol=1e-13)
        moved = (np.eye(D) + H) @ (np.eye(D) + H).T * 0.25 * splines.h**2
        np.testing.assert_allclose(splines.B, np.broadcast_to(A @ moved, splines.B.shape), rtol=0, atol=1e-13)


@pytest.mark.parametrize("D", [2, 3])
def test_a_point_on_the_edge_of_the_grid_has_no_variation_across_it(D):
    """There D_p is singular: the velocity varies along the edge alone."""
    element, nodes = np.zeros(1, np.int32), np.arange(2, dtype=np.int32)[None]
    places, x, N = np.zeros((2, D)), np.zeros((1, D)), np.array([[0.25, 0.75]])
    places[:, 0] = -0.75, 0.25
    nodal, B = np.zeros((2, 1 + 2 * D)), np.ones((1, D, D))
    specialise(affine.to_grid, D=D, K=2, APIC=True)(element, nodes, N, places, x, np.ones(1), B, nodal)
    np.testing.assert_allclose(nodal[:, 1:1 + D], np.outer([-1.0, 1.0], np.ones(D)), rtol=1e-14)
    np.testing.assert_allclose((nodal[:, 1:1 + D].T @ places)[:, 0], B[0, :, 0], rtol=1e-14)


# ---------------------------------------------------------------- a step of the MPM


def spin(x):
    """Rigid, about the middle of ``spinning``, with some stretch."""
    r = x - np.array([0.13, 0.21, 0.05])[:x.shape[1]]
    v = 0.3 * r
    v[:, 0] -= 2.0 * r[:, 1]
    v[:, 1] += 2.0 * r[:, 0]
    v[:, -1] += 0.5 * r[:, 0] if x.shape[1] == 3 else 0.0
    return v


def spinning(D=2, law=None, numerics=None, inertia="lumped", **of_body):
    """A square or cube that spins and stretches in a grid without supports."""
    centre = np.array([0.13, 0.21, 0.05])[:D]
    body = Body(Box(tuple(centre - 0.5), tuple(centre + 0.5)), (3,) * D, 2, law or neo_hooke(1e3, 0.3), 10.0,
                velocity=spin, **of_body)
    numerics = numerics or Numerics(transfer="tpic", losses=True)
    return MPM(Grid(Box((-1.5,) * D, (1.5,) * D), (9,) * D), body, inertia=inertia, numerics=numerics)


def size_of(moment_):
    return np.linalg.norm(np.atleast_1d(moment_))


KINDS = {"plane strain": {}, "plane stress": dict(stress_state="plane_stress"), "F-bar": dict(f_bar=True),
         "linear": dict(law=linear(1e3, 0.3)), "space": dict(D=3),
         "soil": dict(law=mohr_coulomb(1e3, 0.3, 30.0, 10.0, cohesion=20.0))}


@pytest.mark.parametrize("kind", KINDS)
def test_the_midpoint_rule_keeps_angular_momentum(kind, options):
    """Whatever the law, over steps in which the body turns by a tenth; momentum too."""
    options(snes_rtol=1e-13, snes_atol=1e-12)
    solid = spinning(**KINDS[kind])
    L = size_of(solid.angular_momentum())
    for _ in range(4):
        solid.advance(0.05)
    lost = solid.transfer_losses
    assert size_of(lost["solve"]["angular_momentum"]) < 1e-12 * L
    assert max(np.abs(way["momentum"]).max() for way in lost.values()) < 1e-12 * L
    assert size_of(lost["to_grid"]["angular_momentum"]) < 0.1 * L  # points start anew in their cells
    solid.close()


def test_newmark_turns_a_body_in_the_solve(options):
    options(snes_rtol=1e-13, snes_atol=1e-12)
    solid = spinning(numerics=Numerics(losses=True))
    L = solid.angular_momentum()
    for _ in range(4):
        solid.advance(0.05)
    lost = solid.transfer_losses
    assert abs(lost["solve"]["angular_momentum"]) > 1e-4 * L
    assert abs(lost["to_grid"]["angular_momentum"]) < 1e-13 * L  # without a field around the points
    assert lost["to_grid"]["kinetic_energy"] < 0.0 < lost["to_points"]["kinetic_energy"]
    solid.close()


def test_losses_and_solve_make_the_change_of_angular_momentum_and_kinetic_energy():
    solid = spinning()
    L, energy = solid.angular_momentum(), solid.energy()["kinetic"]
    for _ in range(5):
        solid.advance(0.05)
    total = {name: sum(way[name] for way in solid.transfer_losses.values())
             for name in ("angular_momentum", "kinetic_energy")}
    assert total["angular_momentum"] == pytest.approx(solid.angular_momentum() - L, rel=1e-10, abs=1e-13 * L)
    assert total["kinetic_energy"] == pytest.approx(solid.energy()["kinetic"] - energy, rel=1e-10)
    columns = solid.columns()
    assert columns["angular_momentum_z"][2]() == solid.angular_momentum()
    assert columns["kinetic_to_grid"][2]() == solid.transfer_losses["to_grid"]["kinetic_energy"]
    solid.close()


def test_nobody_pays_for_losses_that_are_not_asked_for():
    solid = spinning(numerics=Numerics(transfer="tpic"))
    solid.advance(0.05)
    assert solid.transfer_losses is None and not solid.columns() and "losses" not in solid.get_state()
    assert solid.describe()["transfer_losses"] is None
    solid.close()


def test_angular_momentum_is_about_the_origin_of_the_user():
    """About zero it is that about the centre of mass and that of the momentum there, also where the frame is
    another."""
    def make(at):
        body = Body(Box(tuple(at), tuple(at + 1.0)), (3, 3), 2, neo_hooke(1e3, 0.3), 10.0,
                    velocity=lambda x: np.column_stack([1.0 - (x[:, 1] - at[1]), 2.0 + (x[:, 0] - at[0])]))
        return MPM(Grid(Box(tuple(at - 1.0), tuple(at + 2.0)), (9, 9)), body, inertia="lumped",
                   numerics=Numerics(transfer="tpic", losses=True))
    near, far = make(np.zeros(2)), make(np.array([4096.0, 8192.0]))
    moved = near.angular_momentum() + 4096.0 * near.momentum()[1] - 8192.0 * near.momentum()[0]
    assert far.angular_momentum() == pytest.approx(moved, rel=1e-14)
    for solid in (near, far):
        solid.advance(0.01)
        lost = solid.transfer_losses["to_grid"]["angular_momentum"]
        assert abs(lost) < 1e-9
        solid.close()


def test_a_free_fall_is_exact():
    body = Body(Box((0.0, 0.0), (1.0, 1.0)), (3, 3), 2, neo_hooke(1e3, 0.3), 10.0, velocity=(1.0, 0.0))
    solid = MPM(Grid(Box((-1.0, -3.0), (3.0, 2.0)), (12, 15)), body, gravity=(0.0, -10.0), inertia="lumped",
                interface=Interface.top(body.box, 2, 0.1), numerics=Numerics(transfer="tpic"))
    start, top = solid.points.x.copy(), solid.surface()[0]
    for _ in range(10):
        x, v = solid.advance(0.05)
    fallen = np.array([0.5, -0.5 * 10.0 * 0.25])
    np.testing.assert_allclose(solid.points.x - start, np.tile(fallen, (len(start), 1)), rtol=0, atol=1e-12)
    np.testing.assert_allclose(x - top, np.tile(fallen, (3, 1)), rtol=0, atol=1e-12)
    np.testing.assert_allclose(v, np.tile([1.0, -5.0], (3, 1)), rtol=0, atol=1e-12)
    solid.close()


@pytest.mark.parametrize("kind", ["plane strain", "plane stress", "F-bar", "soil"])
def test_the_matrix_is_the_derivative_of_the_residual_at_half_the_displacement(kind, taylor_rate):
    solid = spinning(**KINDS[kind], inertia="consistent")
    solid.advance(0.02)
    step, random = solid.step, np.random.default_rng(5)
    solid._locate()
    step.begin(0.02, 0.02, np.zeros((0, 2)))
    shape = len(step.active_cells.node), 2
    u, du = random.uniform(-0.01, 0.01, (2, *shape)) * step.active[:, None]

    def residual(h):
        r = np.empty(shape)
        trials.append(step.equations.residual(u + h * du, r))
        return r.ravel()

    trials = []
    residual(0.0)
    step.newton.make_tangent(trials[0])
    K = step.active_cells.matrix.convert("dense").getDenseArray().copy()
    assert taylor_rate(residual, K @ du.ravel(), h=1e-3) == pytest.approx(2.0, abs=0.05)
    if kind != "soil":
        np.testing.assert_allclose(K, K.T, rtol=0, atol=1e-13 * abs(K).max())
    solid.close()


@pytest.mark.parametrize("motion_", [lambda t: 0.4 * t, lambda t: 0.2 * t * t], ids=["even", "accelerated"])
def test_supports_that_move_take_the_body_along(motion_):
    """At the velocity that the support has at the end of each step."""
    body = Body(Box((0.0, 0.0), (1.0, 1.0)), (3, 3), 2, linear(1e3, 0.3), 10.0,
                velocity=(motion_(1e-6) / 1e-6, 0.0))
    solid = MPM(Grid(Box((-1.0, -1.0), (3.0, 2.0)), (12, 9)), body, inertia="lumped",
                supports=[Support(lambda x: x[:, 0] > -9.0, "xy", lambda t: (motion_(t), 0.0))],
                numerics=Numerics(transfer="tpic"))
    start = solid.points.x.copy()
    for _ in range(10):
        solid.advance(0.1)
    slope = (motion_(1.0) - motion_(1.0 - 1e-6)) / 1e-6
    np.testing.assert_allclose(solid.points.x[:, 0] - start[:, 0], motion_(1.0), rtol=1e-12)
    np.testing.assert_allclose(solid.points.v[:, 0], slope, rtol=1e-5)
    np.testing.assert_allclose(solid.points.C, 0.0, atol=1e-12)
    solid.close()


def test_a_run_goes_on_bit_for_bit():
    solid = spinning(numerics=Numerics(transfer="tpic", losses=True))
    for _ in range(3):
        solid.advance(0.05)
    state, ends = solid.get_state(), []
    for _ in range(2):
        for _ in range(3):
            solid.advance(0.05)
        ends.append({**solid.points.copy(), "losses": solid.get_state()["losses"]})
        solid.set_state(state)
    assert all(np.array_equal(ends[0][name], ends[1][name]) for name in ends[0])
    other = solid.anew()
    other.set_state(state)
    assert other.angular_momentum() == solid.angular_momentum()
    plain = spinning(numerics=Numerics())
    with pytest.raises(ValueError, match="its transfer differ from those here"):
        plain.set_state(state)
    for one in (solid, other, plain):
        one.close()


def test_apic_is_refused_without_a_smooth_basis():
    with pytest.raises(ValueError, match="transfer is 'apic'.*give basis='bspline' or 'gimp', or"):
        Numerics(transfer="apic")
    with pytest.raises(ValueError, match="transfer"):
        Numerics(transfer="flip")
