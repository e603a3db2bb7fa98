"""Rigid bodies of spheres: velocity Verlet with quaternions in the scheme of LIGGGHTS' fix multisphere; all compiled.

The order of operations follows fix_multisphere.cpp and math_extra.cpp of LIGGGHTS 3.8 (richardson: the quaternion over
a full step from two half steps and one whole, Miller et al., J. Chem. Phys. 116 (2002) 8649, give the background).
"""
from collections import namedtuple

import numpy as np

from .compiled import compiled

# x, v, omega, spin (angular momentum), force, torque (n, 3); q: quaternion of the principal axes (n, 4); axes: these
# axes as columns (n, 3, 3); mass (n,), inertia: principal moments (n, 3); free (n, 6); first: their first spheres (n
# + 1,); arm: from the centre of mass to each sphere along the principal axes, (spheres, 3); extent: the longest arm
# (n,): SI units
Bodies = namedtuple("Bodies", "x v omega spin force torque q axes mass inertia free first arm extent")


@compiled
def turn_axes(q, axes):
    """Rotation matrix of a quaternion, into axes (3, 3)."""
    w, x, y, z = q[0], q[1], q[2], q[3]
    axes[0, 0], axes[1, 0], axes[2, 0] = w * w + x * x - y * y - z * z, 2.0 * (x * y + w * z), 2.0 * (x * z - w * y)
    axes[0, 1], axes[1, 1], axes[2, 1] = 2.0 * (x * y - w * z), w * w - x * x + y * y - z * z, 2.0 * (y * z + w * x)
    axes[0, 2], axes[1, 2], axes[2, 2] = 2.0 * (x * z + w * y), 2.0 * (y * z - w * x), w * w - x * x - y * y + z * z


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
def _turned(q, omega, rate_of, dt, out):
    """q + dt/2 omega rate_of, of norm one, into out; all quaternions (4,)."""
    w, x, y, z = rate_of[0], rate_of[1], rate_of[2], rate_of[3]
    a = -omega[0] * x - omega[1] * y - omega[2] * z
    b = w * omega[0] + omega[1] * z - omega[2] * y
    c = w * omega[1] + omega[2] * x - omega[0] * z
    d = w * omega[2] + omega[0] * y - omega[1] * x
    out[0], out[1], out[2], out[3] = q[0] + 0.5 * dt * a, q[1] + 0.5 * dt * b, q[2] + 0.5 * dt * c, q[3] + 0.5 * dt * d
    _normalise(out)


@compiled
def _normalise(q):
    norm = 1.0 / np.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    for k in range(4):
        q[k] *= norm


@compiled
def rotate(q, spin, inertia, dt, omega, axes, full, half):
    """Turn the quaternion q (4,) over the step dt [s] with the constant angular momentum ``spin``; omega [rad/s] ends
    as that of the half step, axes as those of the new q. full, half: scratch (4,)."""
    _turned(q, omega, q, dt, full)
    _turned(q, omega, q, 0.5 * dt, half)
    turn_axes(half, axes)
    spin_to_omega(spin, axes, inertia, omega)
    _turned(half, omega, half, 0.5 * dt, half)
    for k in range(4):
        q[k] = 2.0 * half[k] - full[k]
    _normalise(q)
    turn_axes(q, axes)


@compiled
def drift_bodies(r, dt, full, half):
    """Half a kick, then positions and orientations over the step dt [s]; velocities end as those of the half step."""
    for b in range(len(r.x)):
        for k in range(3):
            if r.free[b, k]:
                r.v[b, k] += 0.5 * dt / r.mass[b] * r.force[b, k]
            r.x[b, k] += dt * r.v[b, k]
            if r.free[b, 3 + k]:
                r.spin[b, k] += 0.5 * dt * r.torque[b, k]
        spin_to_omega(r.spin[b], r.axes[b], r.inertia[b], r.omega[b])
        rotate(r.q[b], r.spin[b], r.inertia[b], dt, r.omega[b], r.axes[b], full, half)


@compiled
def kick_bodies(r, half):
    """Half a step [s] of velocity and spin."""
    for b in range(len(r.x)):
        for k in range(3):
            if r.free[b, k]:
                r.v[b, k] += half / r.mass[b] * r.force[b, k]
            if r.free[b, 3 + k]:
                r.spin[b, k] += half * r.torque[b, k]
        spin_to_omega(r.spin[b], r.axes[b], r.inertia[b], r.omega[b])


@compiled
def carry_spheres(r, x, v, omega, move):
    """Velocities of the spheres from their bodies, and their places when ``move``; all (n, 3)."""
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
    """Force and torque on the bodies from those on their spheres, (n, 3), and from gravity [m/s^2]."""
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
    """No sphere of body b is faster than this in the coming step [m/s]."""
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
