"""Spinning disc or square: a free elastic body turns in its plane, and its points cross cells all the time.

It must keep its angular momentum and its energy, and carry the stress of a disc that spins (Timoshenko &
Goodier, Theory of Elasticity, section 32, in plane strain with nu / (1 - nu) for nu):

    sigma_r = (3 + nu)/8 rho w^2 (R^2 - r^2),   sigma_t = rho w^2 ((3 + nu)/8 R^2 - (1 + 3 nu)/8 r^2).

It starts without stress and breathes about this state, so stresses are means over the last turn.
"""
from typing import Literal

import numpy as np

from coupling.records.report import relative_l2
from mpm_fenicsx import MPM, Body, Cloud, Grid, neo_hooke
from mpm_fenicsx import Box as Room
from studies.crossing.common import gather, march, numerics

R, E, NU, RHO = 0.2, 1000.0, 0.3, 1000.0  # [m], [Pa], [-], [kg/m^3]
SPIN = 0.25  # [1/s]: rho w^2 R^2 / E = 0.0025, small strains
CENTRE = np.array([0.03, 0.01])  # [m], no symmetry of the grid
RINGS = 4  # of equal width, over which the stress is averaged
SWEEP = [dict(h=R / 3), dict(h=R / 4), dict(h=R / 6)]
MEASURE = "stress"


def seeds(shape: str, spacing: float) -> Cloud:
    """Points about ``spacing`` [m] apart: in a square of width 2 R on a lattice, in a disc of radius R on
    circles, as a lattice would give it steps for a rim and 3 % more moment of inertia."""
    n = round(R / spacing)
    if shape == "square":
        line = R * ((np.arange(2 * n) + 0.5) / n - 1.0)
        x = np.stack(np.meshgrid(line, line, indexing="ij"), axis=-1).reshape(-1, 2)
        return Cloud(CENTRE + x, np.full(len(x), (R / n) ** 2))
    return disc(R, n, CENTRE)


def disc(radius: float, rings: int, centre: np.ndarray) -> Cloud:
    """Points on ``rings`` circles about ``centre`` [m], shape (2,), as far apart along them as they are."""
    x, area = [], []
    for ring in range(rings):
        r, count = (ring + 0.5) * radius / rings, round(2.0 * np.pi * (ring + 0.5))
        angle = 2.0 * np.pi * (np.arange(count) + 0.5 * (ring % 2)) / count
        x.append(r * np.column_stack([np.cos(angle), np.sin(angle)]))
        area.append(np.full(count, 2.0 * np.pi * r * radius / rings / count))
    return Cloud(centre + np.concatenate(x), np.concatenate(area))


def closed_form(x: np.ndarray) -> np.ndarray:
    """Radial and tangential stress of the spinning disc at x, from its centre, over rho w^2 R^2; (n, 2)."""
    nu, r2 = NU / (1.0 - NU), (x**2).sum(axis=1) / R**2
    return np.column_stack([(3.0 + nu) * (1.0 - r2), 3.0 + nu - (1.0 + 3.0 * nu) * r2]) / 8.0


def polar(stress: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Radial and tangential stress, (n, 2), of ``stress``, (n, 2, 2), at x, from the centre, (n, 2)."""
    radial = x / np.linalg.norm(x, axis=1)[:, None]
    normal = np.column_stack([-radial[:, 1], radial[:, 0]])
    return np.column_stack([np.einsum("pi,pij,pj->p", n, stress, n) for n in (radial, normal)])


def of_rings(x: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Means of ``values``, (n, 2), over the points x, (n, 2), of each ring around the centre, (RINGS, 2)."""
    ring = np.minimum((RINGS * np.linalg.norm(x, axis=1) / R).astype(int), RINGS - 1)
    return np.array([values[ring == k].mean(axis=0) for k in range(RINGS)])


def run(basis: str = "linear", h: float = 0.05, transfer: str = "newmark", cfl: float = 0.5,
        turns: float = 3.0, shape: Literal["disc", "square"] = "disc", inertia: str = "lumped",
        flight: float = 0.0, points: int = 3, **others: str) -> dict:
    """Cells of ``h`` [m], transfer, time step over h / sqrt(E / rho), full turns, shape, inertia, how far it
    flies meanwhile along x [m], points per cell and direction; others: see ``numerics``. Returns the largest
    relative change of the angular momentum, the change of the energy, of a disc the errors of the stresses
    (relative L2): ``stress`` of the means over rings, ``points`` of all points, and what it costs."""
    dt = cfl * h / np.sqrt(E / RHO)
    steps = int(np.ceil(turns * 2.0 * np.pi / SPIN / dt))
    last = max(0, steps - int(np.ceil(2.0 * np.pi / SPIN / dt)))
    speed = np.array([flight / (steps * dt), 0.0])

    def rigid(x: np.ndarray) -> np.ndarray:
        return speed + SPIN * (x - CENTRE)[:, ::-1] * (-1.0, 1.0)

    def from_middle(now: MPM) -> np.ndarray:
        return gather(now, now.bodies[0].points.x) - CENTRE - now.time * speed

    room, far = h * (np.ceil(1.5 * R / h) + 2), h * np.ceil(flight / h)
    grid = Grid(Room((-room, -room), (room + far, room)), (round((2 * room + far) / h), round(2 * room / h)))
    body = Body(seeds(shape, h / points), None, None, neo_hooke(E, NU), RHO, velocity=rigid)
    solid = MPM(grid, body, inertia=inertia, numerics=numerics(basis, transfer=transfer, **others))
    means, start = np.zeros((solid.count, 2)), from_middle(solid)

    def look(now: MPM) -> tuple:
        if now.steps > last:
            means[:] += polar(gather(now, now.cauchy_stress()), from_middle(now)) / (steps - last)
        return now.angular_momentum(), sum(now.energy().values())

    turned, energy = solid.angular_momentum(), sum(solid.energy().values())
    taken = march(solid, dt, steps, look)
    solid.close()
    found = {"angular_momentum": np.abs(taken.rows[:, 0] / turned - 1.0).max(),
             "energy": taken.rows[-1, 1] / energy - 1.0}
    if shape == "disc":
        stress, exact = means / (RHO * SPIN**2 * R**2), closed_form(start)
        found["stress"] = relative_l2(of_rings(start, stress), of_rings(start, exact))
        found["points"] = relative_l2(stress, exact)
    return {**found, **taken.cost}
