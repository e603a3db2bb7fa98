"""Forces spread over a radius: what a map keeps of them, and the dent that is taken out of the wall's
motion."""
import numpy as np
import pytest

from coupling import Scheme, couple, linear, nearest, spread
from coupling.ledger.exchange import Ledger
from coupling.maps.spread import compliance_in_plane, compliance_in_space
from tests.coupling.toys import INNER, Ball, Oscillator


def wall(dim, cells=12):
    """Uneven places on a plane or in one, and segments or triangles."""
    x = np.linspace(-1, 1, cells + 1) + 0.05 * np.sin(7 * np.arange(cells + 1))
    if dim == 2:
        return np.column_stack([x, 0.0 * x]), np.column_stack([np.arange(cells), np.arange(1, cells + 1)])
    X, Z = (a.ravel() for a in np.meshgrid(x, np.linspace(-1, 1, 7), indexing="ij"))
    first = (np.arange(cells)[:, None] * 7 + np.arange(6)).ravel()
    return np.column_stack([X, 0 * X, Z]), np.concatenate([np.column_stack([first, first + 1, first + 8]),
                                                           np.column_stack([first, first + 8, first + 7])])


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("radius", [1e-3, 0.5, 0.9])
def test_sum_moment_and_work_stay(dim, radius):
    """Also at the rim, on uneven places, and from nodes of the wall that are not those of the interface."""
    x, elements = wall(dim)
    nodes = x if radius == 0.5 else 0.9 * wall(dim, 7)[0]
    follow = spread(linear(x, elements, nodes), radius)
    rng = np.random.default_rng(1)
    f, v = rng.normal(size=nodes.shape), rng.normal(size=x.shape)
    force, (moved, wall_v) = follow.force(f), follow.motion(x, v)
    size = np.abs(f).sum()
    assert np.abs(force.sum(axis=0) - f.sum(axis=0)).max() < 1e-12 * size
    assert np.abs(np.einsum("ni,nj->ij", x, force) - np.einsum("ni,nj->ij", nodes, f)).max() < 1e-12 * size
    assert np.vdot(force, v) == pytest.approx(np.vdot(f, wall_v), rel=1e-11)
    assert moved == pytest.approx(nodes)
    turned = follow.motion(x, x @ np.arange(dim**2).reshape(dim, dim))[1]
    # linear fields stay
    assert turned == pytest.approx(nodes @ np.arange(dim**2).reshape(dim, dim), abs=1e-12)


def test_spreads_as_far_as_the_radius_and_not_at_all_below_the_spacing():
    x = np.column_stack([np.linspace(0, 1, 21), np.zeros(21)])
    one = np.zeros((21, 2))
    one[10, 1] = -1.0
    copy = nearest(x, x)
    assert spread(copy, 0.0) is copy and np.array_equal(spread(copy, 0.04).force(one), one)
    assert spread(copy, 0.151).force(one)[:, 1] == pytest.approx(
        [0] * 8 + [-1 / 9, -2 / 9, -3 / 9, -2 / 9, -1 / 9] + [0] * 8, abs=5e-3)
    for radius, compliance, text in ((-1.0, 0.0, "spread is -1.0 m: give the radius"),
                                     (1.0, np.nan, "compliance is nan m/N: give the one to subtract")):
        with pytest.raises(ValueError, match=text):
            spread(copy, radius, compliance)


def test_dents_of_a_cone_of_pressure():
    """Mean displacement of a half space under a unit force, both with weights that fall linearly from the
    middle: 1 / (pi E' r) of Boussinesq, averaged over both."""
    rng = np.random.default_rng(2)
    r = np.sqrt(rng.uniform(size=(2, 400_000)))
    keep = rng.uniform(size=r.shape) < 1.0 - r
    angle = rng.uniform(0, 2 * np.pi, r.shape)
    places = r * np.exp(1j * angle)
    n = keep.sum(axis=1).min()
    a, b = (row[mask][:n] for row, mask in zip(places, keep))
    mean = np.mean(1.0 / np.abs(a - b)) / np.pi
    assert compliance_in_space(1.0, 1.0, 0.0) == pytest.approx(mean, rel=0.02)
    assert compliance_in_space(0.02, 1e6, 0.3) == pytest.approx(compliance_in_space(1.0, 1.0, 0.3) / 0.02e6)
    assert compliance_in_plane(2.63, 1.0, 1.0) == pytest.approx(0.0, abs=1e-12) == compliance_in_plane(9.0,
                                                                                                       1.0,
                                                                                                       1.0)
    assert compliance_in_plane(0.01, 1e6, 0.01) - compliance_in_plane(0.02, 1e6,
                                                                      0.01) == pytest.approx(np.log(4)
                                                                                             / (np.pi * 1e4))
    assert compliance_in_plane(0.0, 1e6, 0.01) == compliance_in_space(0.0, 1e6, 0.3) == 0.0


class Ground(Oscillator):
    """A light mass on a spring, Newmark's method; stiffness in N/m."""

    def __init__(self, stiffness):
        super().__init__(mass=0.02)
        self.stiffness = stiffness

    def advance(self, dt, force):
        f, u, v, m, k = force[0, 1], self.u, self.v, self.mass, self.stiffness
        self.u = u + (dt * v + 0.5 * dt**2 * (f - k * u) / m) / (1.0 + 0.25 * dt**2 * k / m)
        self.v = 2.0 * (self.u - u) / dt - v
        self.applied, self.time = force[0].copy(), self.time + dt
        return self.surface()

    def energy(self):
        return {"kinetic": 0.5 * self.mass * self.v**2, "strain": 0.5 * self.stiffness * self.u**2}


@pytest.mark.parametrize("iterate", [0, 20])
def test_a_spring_in_series_is_taken_out(iterate):
    """A ball falls on a Hertz spring over one that gives way by a quarter of the overlap: with that
    compliance taken out it moves as on rigid ground, and the energy that both sides hold of the dent is
    counted once."""
    paths, errors, at_rest = {}, {}, np.zeros((1, 2))
    for name, stiffness, taken in (("rigid", 1e9, 0.0), ("soft", 300.0, 0.0),
                                   ("taken out", 300.0, 1 / 300.0)):
        ground, grains = Ground(stiffness), Ball(gravity=-2.0)
        grains.v, rows = 0.0, []
        ledger = Ledger(ground, grains, -2.0)

        def observe(window, grains=grains, ledger=ledger, rows=rows):
            rows.append((grains.y, ledger(window)["energy_error"]))

        scheme = Scheme(10 * INNER, 400 * 10 * INNER, substeps=10, iterate=iterate, tol=1e-6)
        couple(ground, grains, spread(nearest(at_rest, at_rest), 1.0, taken), scheme, on_window=[observe])
        paths[name], errors[name] = np.array(rows).T
    depth = -paths["rigid"].min()
    assert -paths["soft"].min() > 1.2 * depth
    assert np.abs(paths["taken out"] - paths["rigid"]).max() < 0.01 * depth
    # of more than nothing
    assert np.abs(errors["taken out"][50:]).max() < 0.02, np.abs(errors["taken out"][50:]).max()


def test_goes_on_bit_for_bit_with_a_dent():
    at_rest = np.zeros((1, 2))
    for iterate in (0, 20):
        ends = []
        for stops in ((8,), (4, 8)):
            ground, grains, last = Ground(300.0), Ball(gravity=-2.0), []
            for stop in stops:
                follow = spread(nearest(at_rest, at_rest), 1.0, 1 / 300.0)
                scheme = Scheme(80 * INNER, stop * 80 * INNER, substeps=80, iterate=iterate)
                couple(ground, grains, follow, scheme, last=last[-1] if last else None,
                       on_window=[last.append])
            ends.append((grains.y, grains.v, ground.u))
        assert ends[0] == ends[1] and ends[0][0] < 0.0
