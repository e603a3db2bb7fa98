"""Free rotation of clusters (both back ends): energy, angular momentum, flips of the middle axis."""
import numpy as np
import pytest
from scipy.special import ellipk, ellipkinc

from dem_liggghts import Cluster, Material, Scene, quaternion

INERTIA, NONE = np.array([0.01, 0.02, 0.03]), np.zeros((0, 3))


pytestmark = pytest.mark.filterwarnings("ignore:DEM time step")  # the Hertz limit, without contacts


def spinning(dem, omega, steps, inertia=INERTIA):
    """A body that turns with ``omega`` [rad/s] in ``steps`` per turn."""
    body = Cluster([[0, 0, 0], [0.1, 0, 0]], 0.1, (0, 0, 0), 1.0, inertia, (0.05, 0, 0), omega=omega)
    scene = Scene(clusters=[body], materials={"spheres": Material(100.0, 0.3)})
    return dem(scene, 2 * np.pi / np.linalg.norm(omega) / steps)


def own_omega(dem):
    """Angular velocity along the principal axes [rad/s], and these axes as columns."""
    body = dem.bodies()[0]
    axes = quaternion.matrix(body["quaternion"])
    return axes.T @ body["omega"], axes


def exact_flips(omega, time):
    """Times that the middle component of ``omega`` changes its sign (Landau and Lifshitz, Mechanics, section
    37)."""
    (a, b, c), w = INERTIA, np.array(omega)
    E, L = INERTIA @ w**2, np.linalg.norm(INERTIA * w)  # twice the energy
    if E * b > L**2:
        a, c = c, a
    rate = np.sqrt((c - b) * (L**2 - E * a) / (a * b * c))
    m = (b - a) * (E * c - L**2) / ((c - b) * (L**2 - E * a))
    phase = ellipkinc(np.arcsin(min(1.0, w[1] / np.sqrt((E * c - L**2) / (b * (c - b))))), m)
    return int((phase + rate * time) // (2 * ellipk(m)))


@pytest.mark.parametrize("steps, turns", [(100, 100), (400, 50)])
def test_flips_of_the_middle_axis(dem, steps, turns):
    """After Dzhanibekov: turns about the middle axis, all flips, without loss of energy and angular
    momentum."""
    omega = (0.01, 10.0, 0.01)
    free = spinning(dem, omega, steps)
    energy, flips, sign = [free.energy()["kinetic"]], 0, 1.0
    for _ in range(4 * turns):
        free.advance(steps // 4, NONE, NONE)
        w, axes = own_omega(free)
        energy.append(free.energy()["kinetic"])
        if w[1] * sign < -5.0:
            flips, sign = flips + 1, -sign
    assert flips == exact_flips(omega, free.time) > 10
    error = np.array(energy) / energy[0] - 1
    assert np.abs(error).max() < 5e-5 * (100 / steps) ** 2
    assert abs(error[-len(error) // 2:].mean() - error[:len(error) // 2].mean()) < 0.1 * np.abs(error).max()
    spin = axes @ (INERTIA * w)
    assert np.abs(spin - INERTIA * omega).max() < 1e-12 * np.linalg.norm(INERTIA * omega)


def test_symmetric_top_precesses_exactly(dem):
    """With two equal moments, at seven steps per turn: about the angular momentum and about its own axis."""
    inertia, omega = np.array([0.02, 0.03, 0.02]), np.array([0.5, 6.0, 0.3])
    free, spin = spinning(dem, omega, 7, inertia), inertia * omega
    free.advance(1000, NONE, NONE)
    t, own = free.time, np.array([0.0, spin[1] * (1 / 0.03 - 1 / 0.02), 0.0])
    exact = quaternion.product(turned(spin / 0.02 * t), turned(own * t))
    q = free.bodies()["quaternion"][0]
    assert q * np.sign(q @ exact) == pytest.approx(exact, abs=1e-10)


def turned(angle):
    """The rotation about a vector by its length [rad]."""
    size = np.linalg.norm(angle)
    return np.array([np.cos(size / 2), *(np.sin(size / 2) / size * angle)])
