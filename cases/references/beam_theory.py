"""A sphere strikes a simply supported beam, at midspan or elsewhere: modal beam, Hertz contact, no gravity.

The beam is a sum of its eigenmodes, the sphere one more "mode" without stiffness, and the contact force
couples them:

    z_j'' + omega_j^2 z_j = -F / m_j,     m u_s'' = F,     F = 4/3 E* sqrt(R) d^1.5,     d = sum_j z_j - u_s,

with 1/E* = (1 - nu^2)/E + (1 - nu_s^2)/E_s (Johnson, Contact Mechanics, 1985, eq. 4.22-4.24). It is
Timoshenko's problem of 1913, free of any mesh: the reference for the coupled runs. Displacements, velocities
and the force on the sphere are positive upward; the sphere touches the beam at time 0.
"""

from dataclasses import dataclass, fields, replace
from math import ceil, pi, sqrt
from typing import Any, Dict, List, NamedTuple, Optional, Tuple, Union

import numpy as np
from numba import njit

import mpm_dem_checks as check

THEORIES = ("timoshenko", "euler_bernoulli")
# of the default step, in the contact time with a rigid plane: force exact to about 1e-6
STEPS_PER_CONTACT = 2000
MIN_STEPS_PER_CONTACT = 20


class Contact(NamedTuple):
    """One contact: its start and end [s], the largest force [N] and its time [s]."""

    start: float
    end: float
    peak: float
    peak_time: float


@dataclass(frozen=True)
class ImpactHistory:
    """What `impact` returns: arrays of shape (n,) over time, and two constants of the contact.

    time [s]; force on the sphere [N]; u_beam: deflection at the place struck [m]; u_sphere [m]; v_sphere
    [m/s]; beam_energy: kinetic and strain energy of all modes [J]; sphere_mass [kg]; stiffness: 4/3 E*
    sqrt(R) [N/m^1.5].
    """

    time: np.ndarray
    force: np.ndarray
    u_beam: np.ndarray
    u_sphere: np.ndarray
    v_sphere: np.ndarray
    beam_energy: np.ndarray
    sphere_mass: float
    stiffness: float

    def at(self, time: np.ndarray) -> "ImpactHistory":
        """The history at other times [s], linear between the (fine) steps. ValueError outside the run."""
        time = np.asarray(time, dtype=float)
        if time.size and not (time.min() >= 0 and time.max() <= self.time[-1] * (1 + 1e-12)):
            raise ValueError(f"times {time.min():g} to {time.max():g} s leave the reference, which covers 0 "
                             f"to {self.time[-1]:g} s; call impact with a longer t_end.")
        arrays = [field.name for field in fields(self) if field.type is np.ndarray]
        at_time: Dict[str, Any] = {name: np.interp(time, self.time, getattr(self, name)) for name in arrays}
        return replace(self, **at_time)

    def energy(self) -> np.ndarray:
        """Total energy [J], shape (n,): of the sphere, of the beam, and 2/5 K d^2.5 of the contact."""
        contact = 0.4 * self.force ** (5 / 3) / self.stiffness ** (2 / 3)
        return 0.5 * self.sphere_mass * self.v_sphere**2 + contact + self.beam_energy

    def contacts(self) -> List[Contact]:
        """All contacts in order, a list of `Contact`; one that lasts to the end of the run ends there."""
        indentation = self.u_beam - self.u_sphere
        touching = np.concatenate(([False], self.force > 0, [False]))
        first, free = np.flatnonzero(touching[1:] & ~touching[:-1]), np.flatnonzero(touching[:-1]
                                                                                    & ~touching[1:])

        def crossing(i: int) -> float:  # between rows i - 1 and i, where the indentation changes sign
            if i == len(self.time):
                return float(self.time[-1])
            before, after = indentation[i - 1], indentation[i]
            return float(self.time[i - 1] + (self.time[i] - self.time[i - 1]) * before / (before - after))

        peaks = [a + int(np.argmax(self.force[a:b])) for a, b in zip(first, free)]
        return [Contact(crossing(a), crossing(b), float(self.force[p]), float(self.time[p]))
                for a, b, p in zip(first, free, peaks)]


def contacts(time: np.ndarray, force: np.ndarray) -> List[Contact]:
    """Contacts in a history of coupling windows, a list of `Contact`: time [s] at the windows' ends and mean
    force [N] over each, shape (n,)."""
    dt, touching = time[1] - time[0], np.concatenate(([False], force > 0, [False]))
    found = []
    for a, b in zip(np.flatnonzero(touching[1:] & ~touching[:-1]),
                    np.flatnonzero(touching[:-1] & ~touching[1:])):
        peak = a + int(np.argmax(force[a:b]))
        found.append(Contact(float(time[a] - dt), float(time[b - 1]), float(force[peak]),
                             float(time[peak] - dt / 2)))
    return found


def beam_modes(length: float, height: float, width: float, E: float, nu: float, rho: float,
               theory: str = "timoshenko", modes: int = 50, shear: float = 5 / 6,
               at: float = 0.0) -> Tuple[np.ndarray, np.ndarray]:
    """Modes of a simply supported beam that move its place ``at`` [m] from midspan: omega [rad/s] and modal
    mass [kg], shape (n,) each.

    A modal mass belongs to unit deflection at that place, where n half-waves have the share sin(kappa (L/2 +
    at)). Odd half-waves n = 1, 3, … are taken, `modes` of them, and those in between, but none with its node
    there. Euler-Bernoulli: omega = kappa^2 sqrt(EI/(rho A)), kappa = n pi/L, mass rho A L/2 over the share
    squared. Timoshenko, for w = W sin(kappa x), theta = Theta cos(kappa x) in rho A w'' = k G A (w_xx -
    theta_x) and rho I theta'' = E I theta_xx + k G A (w_x - theta): per half-wave one frequency of bending
    and one of shear, from a symmetric 2 x 2 problem; all bending modes come first, then all shear modes. k =
    `shear` is 5/6; with Cowper's 10(1 + nu)/(12 + 11 nu) (J. Appl. Mech. 33, 1966) the peak forces of steel
    beams differ by less than 0.1 %.
    """
    _check_beam(length, height, width, E, nu, rho, theory, modes)
    _check_positive(shear=shear)
    check.between("at", at, -length / 2, length / 2, "m", "it must lie between the supports", "()")
    area, inertia = width * height, width * height**3 / 12
    kappa = pi / length * np.arange(1, 2 * modes)
    there = np.round(np.sin(kappa * (0.5 * length + at)) ** 2, 12)  # a node, and the top of a wave, are exact
    kappa, there = kappa[there > 0], there[there > 0]
    half_mass = 0.5 * rho * area * length / there
    if theory == "euler_bernoulli":
        return kappa**2 * sqrt(E * inertia / (rho * area)), half_mass
    c2 = shear * E / (2 * (1 + nu)) / rho  # shear wave speed squared
    deflection, rotation = c2 * kappa**2, E / rho * kappa**2 + c2 * area / inertia
    mixed2 = c2**2 * kappa**2 * area / inertia
    high = 0.5 * (deflection + rotation) + np.sqrt(0.25 * (deflection - rotation) ** 2 + mixed2)
    # determinant / high: the difference of two large numbers would lose digits
    low = c2 * E / rho * kappa**4 / high
    share = mixed2 / (rotation - low) / (high - low)  # of the shear mode in a force on the deflection
    return np.sqrt(np.concatenate((low, high))), np.concatenate((half_mass / (1 - share), half_mass / share))


def impact(length: float, height: float, width: float, radius: float, v0: float, E: float, nu: float,
           rho: float, t_end: float, *, theory: str = "timoshenko",
           modes: Union[int, Tuple[np.ndarray, np.ndarray]] = 50, dt: Optional[float] = None,
           shear: float = 5 / 6, sphere: Optional[Tuple[float, float, float]] = None,
           at: float = 0.0) -> ImpactHistory:
    """History of a sphere of `radius` [m] falling down at `v0` [m/s] on the beam, `at` [m] from midspan.

    length, height, width of the beam [m]; E [Pa], nu [-], rho [kg/m^3] of the beam, and of the sphere too
    unless sphere=(E, nu, rho); t_end [s]; theory, modes, shear: see `beam_modes`, or modes=(omega, modal
    mass) of any body that is struck, shape (n,) each; dt: longest step [s]. Each step assumes a force linear
    in time, moves all modes exactly, and solves the contact law at its end: second order in dt, whatever the
    modes' frequencies. Returns an `ImpactHistory`. ValueError for input without meaning.
    """
    E_s, nu_s, rho_s = (E, nu, rho) if sphere is None else sphere
    _check_positive(radius=radius, v0=v0, t_end=t_end)
    _check_material(E, nu, rho)
    _check_material(E_s, nu_s, rho_s, "sphere's ")
    mass = rho_s * 4 / 3 * pi * radius**3
    stiffness = 4 / 3 * sqrt(radius) / ((1 - nu**2) / E + (1 - nu_s**2) / E_s)
    dt = _step(dt, mass, stiffness, v0)
    n = t_end / dt
    what = f"{n:.3g} steps of the reference solution (t_end={t_end:g} s, dt={dt:.3g} s)"
    check.check_memory(what, 100 * n, "take a smaller t_end")
    check.check_work(what, 100 * n * (len(modes[0]) if isinstance(modes, tuple) else 2 * modes),
                     "take a smaller t_end")
    steps = ceil(n * (1 - 1e-12))
    omega, modal_mass = (modes if isinstance(modes, tuple) else
                         beam_modes(length, height, width, E, nu, rho, theory, modes, shear, at))
    omega, modal_mass = np.concatenate(([0.0], omega)), np.concatenate(([mass], modal_mass))
    rows = np.zeros((steps + 1, 5))
    _march(_propagator(omega, modal_mass, t_end / steps), omega, modal_mass, stiffness, v0, rows)
    force, u_beam, u_sphere, v_sphere, energy = rows.T.copy()
    time = np.linspace(0, t_end, steps + 1)
    return ImpactHistory(time, force, u_beam, u_sphere, v_sphere, energy, mass, stiffness)


def _propagator(omega: np.ndarray, mass: np.ndarray, dt: float) -> np.ndarray:
    """Exact step of z'' + omega^2 z = f/mass, f linear: (z, z') at the end from (z, z', f0, f1), shape (n, 2,
    4)."""
    angle = omega * dt
    sinc, cosc = np.sinc(angle / pi), 0.5 * np.sinc(angle / (2 * pi)) ** 2  # sin(a)/a, (1 - cos(a))/a^2
    small = angle < 0.1
    a = np.where(small, 1.0, angle)
    tail = np.where(small, (1 - angle**2 / 20 * (1 - angle**2 / 42)) / 6, (a - np.sin(a)) / a**3)
    move = (np.cos(angle), dt * sinc, dt**2 / mass * (cosc - tail), dt**2 / mass * tail)
    speed = (-omega * np.sin(angle), np.cos(angle), dt / mass * (sinc - cosc), dt / mass * cosc)
    return np.ascontiguousarray(np.moveaxis(np.array((move, speed)), 2, 0))


@njit(cache=True)
def _march(propagator: np.ndarray, omega: np.ndarray, mass: np.ndarray, stiffness: float, v0: float,
           rows: np.ndarray) -> None:
    """Fill rows (force, u_beam, u_sphere, v_sphere, beam energy) over all steps; mode 0 is the sphere."""
    n = len(omega)
    z, velocity = np.zeros(n), np.zeros(n)
    velocity[0] = -v0
    rows[0, 3] = -v0
    force = 0.0
    # what the unknown force at the end of the step takes off the indentation
    compliance = propagator[:, 0, 3].sum()
    for i in range(1, len(rows)):
        beam = 0.0
        for j in range(n):
            p, f = propagator[j], force if j == 0 else -force
            z[j], velocity[j] = (p[0, 0] * z[j] + p[0, 1] * velocity[j] + p[0, 2] * f,
                                 p[1, 0] * z[j] + p[1, 1] * velocity[j] + p[1, 2] * f)
            beam += z[j] if j else 0.0
        force = _contact_force(beam - z[0], compliance, stiffness)
        beam, energy = 0.0, 0.0
        for j in range(n):
            f = force if j == 0 else -force
            z[j] += propagator[j, 0, 3] * f
            velocity[j] += propagator[j, 1, 3] * f
            if j:
                beam += z[j]
                energy += 0.5 * mass[j] * (velocity[j] ** 2 + (omega[j] * z[j]) ** 2)
        rows[i] = (force, beam, z[0], velocity[0], energy)


@njit(cache=True)
def _contact_force(free: float, compliance: float, stiffness: float) -> float:
    """Force F = K d^1.5 with d + compliance F = free, the indentation without it; Newton from the convex
    side."""
    if free <= 0:
        return 0.0
    d, change = free, free
    while change > 1e-15 * free:
        change = ((d + compliance * stiffness * d**1.5 - free)
                  / (1 + 1.5 * compliance * stiffness * sqrt(d)))
        d -= change
    return stiffness * d**1.5


def _step(dt: Optional[float], mass: float, stiffness: float, v0: float) -> float:
    """The step [s] asked for, or a fraction of the Hertz contact time 2.943 d/v with a rigid plane."""
    contact_time = 2.943 * (1.25 * mass * v0**2 / stiffness) ** 0.4 / v0
    if dt is None:
        return contact_time / STEPS_PER_CONTACT
    _check_positive(dt=dt)
    if dt > contact_time / MIN_STEPS_PER_CONTACT:
        raise ValueError(f"dt = {dt:g} s is too long for a contact of about {contact_time:.3g} s; "
                         f"take at most {contact_time / MIN_STEPS_PER_CONTACT:.2g} s.")
    return dt


def _check_beam(length: float, height: float, width: float, E: float, nu: float, rho: float, theory: str,
                modes: int) -> None:
    """ValueError unless the beam makes sense."""
    _check_positive(length=length, height=height, width=width)
    _check_material(E, nu, rho)
    check.choice("theory", theory, THEORIES)
    check.count("modes", modes, rule="give a whole number of at least 1; 50 is a good choice")


def _check_material(E: float, nu: float, rho: float, whose: str = "") -> None:
    """ValueError unless E [Pa], nu [-], rho [kg/m^3] belong to an elastic solid."""
    _check_positive(**{whose + "E": E, whose + "rho": rho})
    check.between(f"{whose}nu", nu, -1, 0.5, rule="give a number between -1 and 0.5, both excluded; steel "
                  "has 0.29", ends="()")


def _check_positive(**values: float) -> None:
    """ValueError naming the first value that is not a positive finite number."""
    for name, value in values.items():
        check.positive(name, value, rule="it must be a positive number in SI units")
