"""Motion of clusters, rigid bodies of spheres: velocity Verlet with quaternions; all compiled.

The order of operations follows fix_multisphere.cpp of LIGGGHTS 3.8, but for the free rotation in a step,
where both back ends have their own (`rotate`; liggghts/shim/rotation.h): Richardson's extrapolation there
loses energy in every step.
"""
from typing import NamedTuple

import numpy as np

from ..compiled import compiled
from ..scene.tables import ClusterTable


class ClusterState(NamedTuple):
    """All clusters now; SI units."""

    x: np.ndarray  # (n, 3), as all to torque
    v: np.ndarray
    omega: np.ndarray
    spin: np.ndarray  # angular momentum
    force: np.ndarray
    torque: np.ndarray
    q: np.ndarray  # quaternion of the principal axes, (n, 4)
    axes: np.ndarray  # these axes as columns, (n, 3, 3)
    mass: np.ndarray  # (n,)
    inertia: np.ndarray  # principal moments, (n, 3)
    free: np.ndarray  # (n, 6)
    first: np.ndarray  # their first spheres, (n + 1,)
    arm: np.ndarray  # from the centre of mass to each sphere along the principal axes, (spheres, 3)
    extent: np.ndarray  # the longest arm, (n,)


@compiled
def turn_axes(q, axes):
    """Rotation matrix of a quaternion, into axes (3, 3)."""
    w, x, y, z = q[0], q[1], q[2], q[3]
    axes[0, 0] = w * w + x * x - y * y - z * z
    axes[1, 0], axes[2, 0] = 2.0 * (x * y + w * z), 2.0 * (x * z - w * y)
    axes[1, 1] = w * w - x * x + y * y - z * z
    axes[0, 1], axes[2, 1] = 2.0 * (x * y - w * z), 2.0 * (y * z + w * x)
    axes[2, 2] = w * w - x * x - y * y + z * z
    axes[0, 2], axes[1, 2] = 2.0 * (x * z + w * y), 2.0 * (y * z - w * x)


@compiled
def spin_to_omega(spin, axes, inertia, omega):
    """Angular velocity [rad/s] from the angular momentum ``spin`` [kg m^2/s]."""
    omega[:] = 0.0
    for a in range(3):
        about = (spin[0] * axes[0, a] + spin[1] * axes[1, a] + spin[2] * axes[2, a]) / inertia[a]
        for k in range(3):
            omega[k] += about * axes[k, a]


@compiled
def omega_to_spin(omega, axes, inertia, spin):
    """The reverse."""
    spin[:] = 0.0
    for a in range(3):
        about = (omega[0] * axes[0, a] + omega[1] * axes[1, a] + omega[2] * axes[2, a]) * inertia[a]
        for k in range(3):
            spin[k] += about * axes[k, a]


@compiled
def _normalise(q):
    norm = 1.0 / np.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    for k in range(4):
        q[k] *= norm


@compiled
def _middle(inertia):
    """Number of the axis whose moment of inertia lies between the two others."""
    for a in range(2):
        if (inertia[a] - inertia[(a + 1) % 3]) * (inertia[a] - inertia[(a + 2) % 3]) <= 0.0:
            return a
    return 2


@compiled
def _turn_about_spin(q, spin, factor):
    """Turn q by the rotation vector ``factor`` times ``spin`` [rad], in space."""
    size = np.sqrt(spin[0] * spin[0] + spin[1] * spin[1] + spin[2] * spin[2])
    if not size > 0.0:
        return
    half = 0.5 * factor * size
    c, s = np.cos(half), np.sin(half) / size
    b, d, e, w, x, y, z = s * spin[0], s * spin[1], s * spin[2], q[0], q[1], q[2], q[3]
    q[0], q[1] = c * w - b * x - d * y - e * z, c * x + b * w + d * z - e * y
    q[2], q[3] = c * y - b * z + d * w + e * x, c * z + b * y - d * x + e * w


@compiled
def _turn_about_axis(q, own, k, factor):
    """Turn q about the principal axis k by ``factor`` times own[k] [rad]; own, (3,): the angular momentum
    along the principal axes, which turn against it."""
    i, j, half = (k + 1) % 3, (k + 2) % 3, 0.5 * factor * own[k]
    c, s = np.cos(half), np.sin(half)
    w, qi, qj, qk = q[0], q[1 + i], q[1 + j], q[1 + k]
    q[0], q[1 + k], q[1 + i], q[1 + j] = w * c - qk * s, qk * c + w * s, qi * c + qj * s, qj * c - qi * s
    cosine, sine, along = c * c - s * s, 2.0 * c * s, own[i]
    own[i], own[j] = cosine * along + sine * own[j], cosine * own[j] - sine * along


@compiled
def rotate(q, spin, inertia, dt, omega, axes, own):
    """Turn the quaternion q (4,) over the step dt [s] with the constant angular momentum ``spin``; omega
    [rad/s] ends as that of the half step, axes as those of the new q. own: scratch (3,).

    With a, i, j the middle axis and the others, the energy of rotation is L^2 / 2 I_a, which alone turns the
    cluster about L, plus (1/I_i - 1/I_a) L_i^2 / 2 and the same of j, each of which alone turns it about that
    axis. Their exact rotations follow each other, there and back: a symplectic map, symmetric in time, so
    that the energy swings within the second order of the step and does not drift, and the angular momentum
    stays. Splitting of the rigid body: Dullweber, Leimkuhler and McLachlan, J. Chem. Phys. 107 (1997)
    5840-5851; Fasso, J. Comput. Phys. 189 (2003) 527-538.
    """
    for k in range(3):
        own[k] = spin[0] * axes[0, k] + spin[1] * axes[1, k] + spin[2] * axes[2, k]
    a = _middle(inertia)
    i, j, whole = (a + 1) % 3, (a + 2) % 3, 0.5 * dt / inertia[a]
    about_i, about_j = 0.5 * dt / inertia[i] - whole, 0.5 * dt / inertia[j] - whole
    _turn_about_spin(q, spin, whole)
    _turn_about_axis(q, own, j, about_j)
    _turn_about_axis(q, own, i, about_i)
    turn_axes(q, axes)
    spin_to_omega(spin, axes, inertia, omega)
    _turn_about_axis(q, own, i, about_i)
    _turn_about_axis(q, own, j, about_j)
    _turn_about_spin(q, spin, whole)
    _normalise(q)
    turn_axes(q, axes)


@compiled
def drift_clusters(r, dt, own):
    """Half a kick, then positions and orientations over the step dt [s]; velocities end as those of the half
    step."""
    for b in range(len(r.x)):
        for k in range(3):
            if r.free[b, k]:
                r.v[b, k] += 0.5 * dt / r.mass[b] * r.force[b, k]
            r.x[b, k] += dt * r.v[b, k]
            if r.free[b, 3 + k]:
                r.spin[b, k] += 0.5 * dt * r.torque[b, k]
        rotate(r.q[b], r.spin[b], r.inertia[b], dt, r.omega[b], r.axes[b], own)


@compiled
def kick_clusters(r, half):
    """Half a step [s] of velocity and spin."""
    for b in range(len(r.x)):
        for k in range(3):
            if r.free[b, k]:
                r.v[b, k] += half / r.mass[b] * r.force[b, k]
            if r.free[b, 3 + k]:
                r.spin[b, k] += half * r.torque[b, k]
        spin_to_omega(r.spin[b], r.axes[b], r.inertia[b], r.omega[b])


@compiled
def move_spheres(r, x, v, omega, move):
    """Velocities of the spheres from their clusters, and their places when ``move``; all (n, 3)."""
    for b in range(len(r.x)):
        for i in range(r.first[b], r.first[b + 1]):
            arm = r.arm[i]
            dx = r.axes[b, 0, 0] * arm[0] + r.axes[b, 0, 1] * arm[1] + r.axes[b, 0, 2] * arm[2]
            dy = r.axes[b, 1, 0] * arm[0] + r.axes[b, 1, 1] * arm[1] + r.axes[b, 1, 2] * arm[2]
            dz = r.axes[b, 2, 0] * arm[0] + r.axes[b, 2, 1] * arm[1] + r.axes[b, 2, 2] * arm[2]
            v[i, 0] = r.omega[b, 1] * dz - r.omega[b, 2] * dy + r.v[b, 0]
            v[i, 1] = r.omega[b, 2] * dx - r.omega[b, 0] * dz + r.v[b, 1]
            v[i, 2] = r.omega[b, 0] * dy - r.omega[b, 1] * dx + r.v[b, 2]
            for k in range(3):
                omega[i, k] = r.omega[b, k]
            if move:
                x[i, 0], x[i, 1], x[i, 2] = dx + r.x[b, 0], dy + r.x[b, 1], dz + r.x[b, 2]


@compiled
def gather_forces(r, x, force, torque, gravity):
    """Force and torque on the clusters from those on their spheres, (n, 3), and from gravity [m/s^2]."""
    for b in range(len(r.x)):
        for k in range(3):
            r.force[b, k] = r.torque[b, k] = 0.0
        for i in range(r.first[b], r.first[b + 1]):
            dx, dy, dz = x[i, 0] - r.x[b, 0], x[i, 1] - r.x[b, 1], x[i, 2] - r.x[b, 2]
            for k in range(3):
                r.force[b, k] += force[i, k]
            r.torque[b, 0] += dy * force[i, 2] - dz * force[i, 1] + torque[i, 0]
            r.torque[b, 1] += dz * force[i, 0] - dx * force[i, 2] + torque[i, 1]
            r.torque[b, 2] += dx * force[i, 1] - dy * force[i, 0] + torque[i, 2]
        for k in range(3):
            r.force[b, k] += r.mass[b] * gravity[k]


@compiled
def speed_bound(r, b, dt):
    """No sphere of cluster b is faster than this in the coming step [m/s]."""
    v2 = omega2 = kick2 = torque2 = 0.0
    for k in range(3):
        v2 += r.v[b, k] ** 2
        omega2 += r.omega[b, k] ** 2
        if r.free[b, k]:
            kick2 += (0.5 * dt / r.mass[b] * r.force[b, k]) ** 2
        if r.free[b, 3 + k]:
            torque2 += (0.5 * dt * r.torque[b, k]) ** 2
    turning = np.sqrt(omega2) + np.sqrt(torque2) / min(r.inertia[b, 0], r.inertia[b, 1], r.inertia[b, 2])
    return np.sqrt(v2) + np.sqrt(kick2) + turning * r.extent[b]


def cluster_state(table: ClusterTable, arm: np.ndarray) -> ClusterState:
    """The clusters of ``table`` as they start. arm: of all spheres, as in `tables.SphereTable`."""
    n = len(table.mass)
    axes, spin, zeros = np.empty((n, 3, 3)), np.empty((n, 3)), lambda: np.zeros((n, 3))
    for b in range(n):
        turn_axes(table.q[b], axes[b])
        omega_to_spin(table.omega[b], axes[b], table.inertia[b], spin[b])
    extent = np.maximum.reduceat(np.sqrt((arm**2).sum(axis=1)), table.first[:-1])
    return ClusterState(table.x.copy(), table.v.copy(), table.omega.copy(), spin, zeros(), zeros(),
                        table.q.copy(), axes, table.mass, table.inertia, table.free, table.first, arm, extent)
