"""Disc rolling down a slope: an elastic disc, nearly rigid, starts from rest on a wall that it rubs on.

With tan(theta) <= 3 mu it rolls, a = 2/3 g sin(theta) and alpha = a / R; on a steeper slope it slides too,
a = g (sin(theta) - mu cos(theta)) and alpha = 2 mu g cos(theta) / R. The slope lies along the grid; the
weight across it is put on slowly first, as a disc that falls into its contact bounces for long.
"""
from typing import Callable, Literal, Optional, Union

import numpy as np

from mpm_fenicsx import MPM, Body, Box, Grid, GridWall, Interface, Penalty, linear
from studies.crossing import spinning
from studies.crossing.common import gather, march, numerics

R, E, NU, RHO, G = 0.5, 2e7, 0.3, 1000.0, 9.81  # [m], [Pa], [-], [kg/m^3], [m/s^2]
LOADING, TIME = 0.3, 0.75  # of the weight across the slope, and of rolling [s]
START, ROOM = 1.0, 2.2  # place of the disc at the start, and room for it [m]
CUT = 0.37  # cells below the disc: where a plane that is not of nodes cuts the grid
SWEEP = [dict(h=0.2, dt=4e-3), dict(h=0.1, dt=2e-3)]
MEASURE = "acceleration"
Kind = Literal["nodes", "surface", "plane", "rim"]


def closed_form(angle: float, mu: float) -> np.ndarray:
    """Acceleration [m/s^2] and R times the angular one [m/s^2] on a slope of ``angle`` [degrees]."""
    t = np.radians(angle)
    if np.tan(t) <= 3.0 * mu:
        return np.full(2, 2.0 / 3.0 * G * np.sin(t))
    return G * np.array([np.sin(t) - mu * np.cos(t), 2.0 * mu * np.cos(t)])


def make_wall(kind: Kind, length: float, y: float, mu: float, h: float) -> Union[GridWall, Penalty]:
    """The slope at height y [m]: the ``nodes`` of the grid; the same as a ``surface``; a ``plane`` in space;
    or particles on the ``rim`` of the disc, four to a cell, that know where the plane is."""
    if kind in ("nodes", "surface"):
        return GridWall(lambda x: np.abs(x[:, 1] - y) < 1e-9, "+y", mu, separates=True, contact=kind,
                        name="slope")
    if kind == "plane":
        line = Interface.line((0.0, y), (length, y), 4)
        return Penalty(line, (0, 1), mu, separates=True, contact="surface", name="slope")
    n = round(8.0 * np.pi * R / h)
    angle = 2.0 * np.pi * np.arange(n) / n
    rim = (START, y + R) + R * np.column_stack([np.cos(angle), np.sin(angle)])
    return Penalty(Interface(rim, np.column_stack([np.arange(n), (np.arange(n) + 1) % n])), (0, 1), mu,
                   separates=True, follows=True, at=(0.0, y), name="slope")


def weight(angle: float) -> Callable:
    """Body force [m/s^2]: first the part across the slope, smoothly, then that along it."""
    t = np.radians(angle)

    def force(x: np.ndarray, time: float) -> np.ndarray:
        part = min(time / LOADING, 1.0)
        across = part * part * (3.0 - 2.0 * part)
        return np.tile(G * np.array([np.sin(t) * (time > LOADING - 1e-9), -np.cos(t) * across]), (len(x), 1))

    return force


def run(basis: str = "linear", h: float = 0.1, wall: Kind = "surface", angle: float = 20.0, mu: float = 0.3,
        dt: float = 1e-3, points: int = 4, time: float = TIME, transfer: Optional[str] = None,
        **others: str) -> dict:
    """Cells of ``h`` [m], kind of wall, slope [degrees], coefficient of friction, time step [s], points per
    cell and direction, time of rolling [s], transfer (None: tpic); others: see ``numerics``. Returns the
    relative errors of mean ``acceleration`` and angular one, ``spin``, the slip at the end over the final
    speed, and what it costs."""
    exact = closed_form(angle, mu)
    y = CUT * h if wall == "plane" else h if wall == "rim" else 0.0
    counts = Grid.counts((ROOM + 0.55 * exact[0] * time**2, 2.4 * R), h)
    length, height = h * np.asarray(counts)
    disc = spinning.disc(R, round(points * R / h), np.array([START, y + R]))
    solid = MPM(Grid(Box((0.0, 0.0), (length, height)), counts), Body(disc, None, None, linear(E, NU), RHO),
                penalties=[make_wall(wall, length, y, mu, h)], body_force=weight(angle),
                numerics=numerics(basis, transfer=transfer or "tpic", **others))
    march(solid, dt, round(LOADING / dt), lambda s: 0.0)
    rolling = march(solid, dt, round(time / dt), lambda s: 0.0)
    mass, x, v = (gather(solid, getattr(solid.points, name)) for name in ("mass", "x", "v"))
    solid.close()
    speed, r = mass @ v / mass.sum(), x - mass @ x / mass.sum()
    turning = mass @ (r[:, 0] * v[:, 1] - r[:, 1] * v[:, 0]) / (mass @ (r**2).sum(axis=1))
    found = np.array([speed[0], -R * turning])
    return {**dict(zip(("acceleration", "spin"), found / (time * exact) - 1.0)),
            "slip": 1.0 - found[1] / found[0], **rolling.cost}
