"""A flume of 80 m with a cube at its end: its bed, what is read off the flow, and the figure."""
from pathlib import Path
from typing import Any, Dict, Tuple

import numpy as np

from coupling import History
from coupling.pictures import figure
from dem_liggghts import Cluster

GRAVITY = 4.90332, 0.0, -8.49281  # along and across a bed that falls by 30 degrees [m/s^2]
WIDTH, SIDES, END = 2.0, 82.5, 100.0  # between the side walls, their end, end of the bed [m]
BED = np.array([(-1.0, 0.0), (80.0, 0.0), (81.0, 0.176), (82.0, 0.54), (END, 10.926)])  # x, z [m]
FRONT, ACROSS, HIGH = 80.0, (0.5, 1.5), 1.0  # of the cube: face up the flume, sides, height [m]
BLOCKS = [(4.25 + 0.7 * i, 0.55 + 0.3 * j) for j in range(4) for i in range(2)]  # x, y of their middles [m]
SIZE = 0.5, 0.1, 0.05  # of a block [m]
GAUGES = 20.0, 40.0, 60.0, 79.95  # [m]
BEFORE = 75.0  # of the flow that comes to the cube, where what dams up there is late [m]
THIN = 0.02  # depth at which the flow has arrived [m]
MEAN = 0.05  # of a force, in which the flow goes on by the length of the cube [s]
# Of hdro-0008, read off its figures: arrivals at the gauges [s], depths at the last three [m], largest force
# on the lower and the upper half of the cube [N] and its time [s].
ARRIVALS, PEAK, PEAK_TIME = (2.05, 3.9, 5.05, 5.95), 240e3, 6.05


def bed(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Height of the bed [m]."""
    return np.interp(x, *BED.T)


def block(place: Tuple[float, float], rho: float, h: float) -> Cluster:
    """One layer of 10 x 2 spheres that touch, with mass and inertia of the solid of density ``rho``
    [kg/m^3], just above the sand on cells of size ``h`` [m], whose points are balls."""
    size, radius = np.array(SIZE), 0.5 * SIZE[2]
    x, y = np.meshgrid(*(radius - 0.5 * length + 2.0 * radius * np.arange(round(0.5 * length / radius))
                         for length in SIZE[:2]))
    mass = rho * size.prod()
    return Cluster(np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)]), radius,
                   (*place, 2.03 + 0.05 * h), mass, mass / 12.0 * ((size**2).sum() - size**2))


def gauges(solid: Any, h: float) -> Dict[str, tuple]:
    """Columns: depth [m] and mean speed along the bed [m/s] within ``h`` [m] of each gauge, of the last one
    what lies before the cube; and the thrust of what comes, see ``jet``."""
    places = *GAUGES, BEFORE
    found: Dict[float, np.ndarray] = {}

    def look(window: Any) -> None:
        p, rows = solid.bodies[0].points, np.zeros((len(places), 4))
        for row, at in zip(rows, places):
            near = np.abs(p.x[:, 0] - at + (h if at == GAUGES[-1] else 0.0)) < h
            mass, v = p.mass[near], p.v[near, 0]
            row[:] = (p.V0[near] @ np.linalg.det(p.F[near]), mass.sum(), mass @ v,
                      (mass * v**2)[p.x[near, 2] < HIGH].sum())
        found.update(zip(places, solid.comm.allreduce(rows)))

    def depth(window: Any, at: float) -> float:
        if at == places[0]:
            look(window)
        return found[at][0] / (2.0 * h * WIDTH)

    def speed(window: Any, at: float) -> float:
        return found[at][2] / found[at][1] if found[at][1] else 0.0

    columns: Dict[str, tuple] = {}
    for at in places:
        columns[f"depth_{at:g}"] = "m", f"of the flow at x = {at} m", lambda w, at=at: depth(w, at)
        columns[f"speed_{at:g}"] = "m/s", f"mean of the flow at x = {at} m", lambda w, at=at: speed(w, at)
    share = (ACROSS[1] - ACROSS[0]) / WIDTH
    columns[f"thrust_{BEFORE:g}"] = ("N", f"momentum per time through the height and width of the cube at x "
                                     f"= {BEFORE} m", lambda w: share * found[BEFORE][3] / (2.0 * h))
    return columns


def arrivals(history: History) -> np.ndarray:
    """Times at which the flow is as deep as ``THIN`` at the gauges [s], nan where it never is."""
    deep = [history[f"depth_{at:g}"] > THIN for at in GAUGES]
    return np.array([history["time"][np.argmax(one)] if one.any() else np.nan for one in deep])


def slide(first: float, v: float, at: np.ndarray, friction: float = 0.0) -> np.ndarray:
    """Times [s] at which what passes the first gauge at ``first`` [s] with the speed ``v`` [m/s] is ``at``
    places [m], with ``friction`` at the bed and none at the sides."""
    g = GRAVITY[0] + friction * GRAVITY[2]
    return first + (np.sqrt(v**2 + 2.0 * g * (at - GAUGES[0])) - v) / g


def front_speed(history: History) -> float:
    """Of the front at the first gauge [m/s]: of what arrives there."""
    arrived = np.flatnonzero(history[f"depth_{GAUGES[0]:g}"] > THIN)
    return float(history[f"speed_{GAUGES[0]:g}"][arrived[0]]) if len(arrived) else np.nan


def force(history: History) -> np.ndarray:
    """On the cube along the bed [N]: soil and blocks, on the lower and the upper half, shape (2, windows)."""
    names = [[f"force_{matter}_cube_{half}_x" for matter in ("soil", "rock")] for half in (1, 2)]
    return np.array([sum(history[name] for name in both if name in history.columns) for both in names])


def smooth(history: History, values: np.ndarray) -> np.ndarray:
    """Means over ``MEAN`` of what is given by window."""
    return figure.mean_over(history["time"], history["window"], values, MEAN, centred=True)


def jet(history: History) -> np.ndarray:
    """Force [N] of what comes to the cube on its face if that takes all its momentum, rho v^2 h w: measured
    upstream of the cube, at most as deep as it is high, and brought there as it slides without friction."""
    v, length = history[f"speed_{BEFORE:g}"], FRONT - BEFORE
    there = v > 0.0
    if not there.any():
        return np.zeros_like(v)
    v, g = v[there], GRAVITY[0]
    faster = np.sqrt(v**2 + 2.0 * g * length)
    arrival = history["time"][there] + (faster - v) / g
    return np.interp(history["time"], arrival, history[f"thrust_{BEFORE:g}"][there] * (faster / v) ** 2, 0.0,
                     0.0)


def compare(histories: Dict[str, History], friction: float = 0.0) -> Dict[str, float]:
    """Arrivals against those of sliding from the first gauge on and against hdro-0008's, relative; peak of
    the force, mean over ``MEAN``, against that of ``jet`` and hdro-0008's, and its impulse against the
    jet's; error of the balance of energy."""
    numbers = {}
    for name, history in histories.items():
        times, at = arrivals(history), np.array(GAUGES)
        theory = slide(times[0], front_speed(history), at, friction)
        for place, time, slid, read in zip(GAUGES, times, theory, ARRIVALS):
            if place != GAUGES[0]:
                numbers[f"{name}_arrival_{place:g}_sliding"] = float(time / slid - 1.0)
            numbers[f"{name}_arrival_{place:g}_hdro"] = float(time / read - 1.0)
        whole, coming = smooth(history, force(history).sum(axis=0)), smooth(history, jet(history))
        numbers[f"{name}_peak_hdro"] = float(whole.max() / PEAK - 1.0)
        if coming.max() > 0.0:
            numbers[f"{name}_peak_jet"] = float(whole.max() / coming.max() - 1.0)
            numbers[f"{name}_impulse_jet"] = float((whole @ history["window"]) / (coming @ history["window"]))
        if "balance_error" in history.columns:
            numbers[f"{name}_balance"] = float(history["balance_error"][-1])
    return {name: value for name, value in numbers.items() if np.isfinite(value)}


def draw(path: Path, histories: Dict[str, History]) -> None:
    """Depth and speed at the gauges, and the force on both halves of the cube beside that of a jet."""
    depths: list = []
    speeds: list = []
    forces: list = []
    for name, history in histories.items():
        t, told = history["time"], f" ({name})" if len(histories) > 1 else ""
        for at in GAUGES:
            depths.append((t, history[f"depth_{at:g}"], f"x = {at} m{told}", "run"))
            speeds.append((t, history[f"speed_{at:g}"], f"x = {at} m{told}", "run"))
        lower, upper = (smooth(history, half) for half in force(history))
        forces += [(t, lower, f"lower half{told}", "run"), (t, upper, f"upper half{told}", "run"),
                   (t, lower + upper, f"both{told}", "run"),
                   (t, jet(history), f"ρ v² h w{told}", "reference")]
        first = arrivals(history)[0]
        if np.isfinite(first):
            x = np.linspace(GAUGES[0], GAUGES[-1], 50)
            v = front_speed(history)
            speeds.append((slide(first, v, x), np.sqrt(v**2 + 2 * GRAVITY[0] * (x - GAUGES[0])),
                           f"slides without friction{told}", "reference"))
    figure.draw(path, "time [s]", {"depth [m]": depths, "speed [m/s]": speeds,
                                   "force on the cube [N]": forces})
