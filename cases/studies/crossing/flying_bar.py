"""Flying bar: a free elastic bar swings in its first mode while it flies through the grid.

A wave of small amplitude in a straight bar without Poisson's ratio has an exact solution: with X from one
end and omega = pi c / length, the velocity is v0 cos(pi X / length) cos(omega t) beside that of the
flight, the stress - rho c v0 sin(pi X / length) sin(omega t); Newmark's method makes 2 arctan(omega dt /
2) / dt of omega. Strains are so small that points cross cells by the flight alone, 8.5 cells of 1 m in
ten swings. A flight in which they cross twice in a swing, 0.2 m/s with two points in a cell of 1 m, would
pump it.
"""
import numpy as np

from mpm_fenicsx import MPM, Body, Box, Grid, Interface, Support, neo_hooke
from studies.crossing.common import gather, march, numerics

LENGTH, E, RHO = 25.0, 100.0, 1.0  # [m], [Pa], [kg/m^3]
C = np.sqrt(E / RHO)  # [m/s]
SWEEP = [dict(h=1.0), dict(h=0.5), dict(h=0.25)]
MEASURE = "stress"


def run(basis: str = "linear", h: float = 0.5, fly: float = 0.17, speed: float = 1e-3, swings: int = 10,
        dt: float = 0.05, points: int = 2, place: float = 0.3, **others: str) -> dict:
    """Cells of ``h`` [m], velocity of the flight and of the ends in the swing [m/s], swings, time step [s],
    points per cell and direction, place of the bar's end in its cell at the start [-]; others: see
    ``numerics``. Returns errors against the exact solution, root mean square over time and points relative to
    its own: of stress, velocity, and velocity of a boundary particle at the end (over time), the energy of
    the swing left, and what it costs."""
    n, steps = round(LENGTH / h), round(swings * 2 * LENGTH / C / dt)
    x0, room = (2 + place) * h, int(np.ceil(fly * dt * steps / h)) + 6

    def shape(x: np.ndarray) -> np.ndarray:
        return np.cos(np.pi / LENGTH * (x[:, 0] - x0))

    body = Body(Box((x0, 0.0), (x0 + LENGTH, h)), (n, 1), points, neo_hooke(E, 0.0), RHO,
                velocity=lambda x: np.column_stack([fly + speed * shape(x), 0 * x[:, 0]]))
    end = Interface.line((x0, 0.0), (x0, h), 1)
    solid = MPM(Grid(Box((0.0, 0.0), ((n + room) * h, h)), (n + room, 1)), body,
                [Support(lambda x: x[:, 1] > -1.0, "y")], end, numerics=numerics(basis, **others))
    start = gather(solid, solid.bodies[0].points.x)
    flight, swing = 0.5 * RHO * LENGTH * h * fly**2, 0.25 * RHO * LENGTH * h * speed**2

    def look(now: MPM) -> np.ndarray:
        stress, v = now.cauchy_stress()[:, 0, 0], now.bodies[0].points.v[:, 0] - fly
        values = gather(now, np.column_stack([stress / (RHO * C * speed), v / speed]))
        energy = (sum(now.energy().values()) - flight) / swing
        return np.append(values.T.ravel(), [(now.surface()[1][0, 0] - fly) / speed, energy])

    taken = march(solid, dt, steps, look)
    solid.close()
    angle = 2 * np.arctan(0.5 * np.pi / LENGTH * C * dt) * np.arange(1, steps + 1)[:, None]
    along = shape(start)
    exact = np.hstack([-np.sin(angle) * np.sqrt(1 - along**2), np.cos(angle) * along, np.cos(angle)])
    error = (taken.rows[:, :-1] - exact) ** 2
    parts = dict(zip(("stress", "velocity", "end"), np.split(np.arange(exact.shape[1]),
                                                             [len(start), 2 * len(start)])))
    found = {name: np.sqrt(error[:, i].sum() / (exact[:, i] ** 2).sum()) for name, i in parts.items()}
    return {**found, "energy": taken.rows[-1, -1], **taken.cost}
