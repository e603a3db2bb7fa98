"""A mountain valley with a bend, made up: its raster in coordinates of a map, and what lies in it."""
from typing import Tuple

import numpy as np

from dem_liggghts import Spheres
from mpm_fenicsx import Box, Terrain

LOWER = 452_000.0, 5_214_000.0  # corner of the raster on the map, east and north [m]
LENGTH, WIDTH = 160.0, 80.0  # of the raster to the east and to the north [m]
BEND, TURN = 80.0, 12.0  # the valley turns aside around that x [m], by that much to either side [m]
FOOT, STEEP, FLAT = 1200.0, 0.6, 0.08  # height of its end [m], slope of its floor at both ends [-]
FLANK = 0.02  # height of the flanks over the squared distance from the axis [1/m]
DAM = 125.0  # where the dam crosses it [m]


def axis(x: np.ndarray) -> np.ndarray:
    """y of the deepest line of the valley at x, both from the corner of the raster [m]."""
    return 0.5 * WIDTH + TURN * np.tanh((x - BEND) / 20.0)


def height(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Of the ground [m]: its floor levels out as an exponential does, the flanks are parabolas."""
    fade = np.exp(-x / 40.0) - np.exp(-LENGTH / 40.0)
    floor = FLAT * (LENGTH - x) + (STEEP - FLAT) * 40.0 * fade
    return np.asarray(FOOT + floor + FLANK * (y - axis(x)) ** 2)


def ground(cell: float) -> Terrain:
    """The raster with heights every ``cell`` [m]."""
    x, y = (cell * np.arange(round(length / cell) + 1) for length in (LENGTH, WIDTH))
    return Terrain.raster(height(*np.meshgrid(x, y, indexing="ij")), cell, LOWER)


def along(start: float, end: float, right: float, left: float) -> np.ndarray:
    """Polygon, shape (n, 2), on the map [m] of what lies from ``right`` to ``left`` [m] of the axis, between
    two x [m]."""
    x = np.linspace(start, end, 25)
    sides = [np.column_stack([x, axis(x) + left]), np.column_stack([x, axis(x) + right])[::-1]]
    return np.concatenate(sides) + np.array(LOWER)


def release() -> np.ndarray:
    """Polygon of the soil that is released."""
    return along(14.0, 38.0, -8.0, 8.0)


def forest() -> np.ndarray:
    """Polygon of the forest on the outer side of the bend."""
    return along(60.0, 100.0, -25.0, -6.0)


def corridor() -> np.ndarray:
    """Polygon of where soil can come."""
    return along(4.0, 156.0, -20.0, 20.0)


def rocks(ground: Terrain, count: int, radius: float, seed: int) -> Spheres:
    """Spheres of ``radius`` [m] that lie on the ground before the soil, each in a place of its own."""
    rng = np.random.default_rng(seed)
    n = -(-count // 3)
    x = np.repeat(43.0 + 3.0 * radius * np.arange(n), 3)[:count]
    aside = np.tile([-3.0, 0.0, 3.0], n)[:count] * radius + rng.uniform(-0.4, 0.4, count) * radius
    plan = np.column_stack([x, axis(x) + aside]) + np.array(LOWER)
    on_ground = np.column_stack([plan, ground.height(plan)]) + 1.02 * radius * ground.normal(plan)
    return Spheres(on_ground, np.zeros_like(on_ground), radius, 2600.0)


def dam(ground: Terrain, over: float, thickness: float) -> Box:
    """A box across the valley, ``over`` [m] higher than the ground on its axis, that ends in the flanks."""
    middle = np.array([DAM, float(axis(np.array(DAM)))]) + np.array(LOWER)
    top = float(ground.height(middle)) + over
    half = np.sqrt(over / FLANK) + 3.0
    lower: Tuple[float, ...] = (middle[0], middle[1] - half, top - over - 3.0)
    return Box(lower, (middle[0] + thickness, middle[1] + half, top))
