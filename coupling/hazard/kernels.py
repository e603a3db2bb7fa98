"""Sums over points and cells of a map, compiled. This module is loaded only by runs that make maps.

The points of one body: places x [m] and velocities v [m/s], shape (n, D); mass [kg]; volume now, that of a
plane body per metre of its thickness [m^D]; rest: material volume [m^3]; shape (n,) each. A point stands for
a square or a cube of its volume, with sides along the axes, seen from above, and is spread over one
``spread`` times as wide, whose edges are blurred over the width of the first: points that have moved apart or
together by a part of that still add up to an even depth.
"""
import math

import numpy as np
from numba import njit

Array = np.ndarray
compiled = njit(cache=True, error_model="numpy")


@njit(forceinline=True, error_model="numpy")
def overlap(middle: float, half: float, low: float, high: float) -> float:
    """Part of the interval of half width ``half`` around ``middle`` that lies between ``low`` and
    ``high``."""
    return max(min(middle + half, high) - max(middle - half, low), 0.0) / (2.0 * half)


@njit(forceinline=True, error_model="numpy")
def below(t: float, wide: float, narrow: float) -> float:
    """Part below ``t`` of an interval of width ``wide`` around zero, blurred over the width ``narrow``."""
    t = min(max(t, -0.5 * (wide + narrow)), 0.5 * (wide + narrow))
    outer, inner = 0.5 * (wide + narrow), 0.5 * (wide - narrow)
    return ((t + outer) ** 2 - max(t + inner, 0.0) ** 2 - max(t - inner, 0.0) ** 2) / (2.0 * wide * narrow)


@njit(forceinline=True, error_model="numpy")
def blurred(middle: float, width: float, spread: float, low: float, high: float) -> float:
    """Part between ``low`` and ``high`` of what is spread around ``middle`` over ``spread`` times ``width``,
    with edges blurred over ``width``."""
    wide, narrow = max(spread, 1.0) * width, min(spread, 1.0) * width
    return below(high - middle, wide, narrow) - below(low - middle, wide, narrow)


@compiled
def to_raster(x: Array, v: Array, mass: Array, volume: Array, rest: Array, spread: float, cells: tuple,
              sums: Array) -> float:
    """Add volume, mass and momentum of the points to the ``cells`` that they cover, lower corner and width
    [m], in ``sums``, shape (rows, columns, 2 + D); returns the material volume that is inside [m^3]."""
    lower, cell = cells
    rows, columns, D = sums.shape[0], sums.shape[1], x.shape[1]
    inside = 0.0
    for p in range(len(x)):
        width = volume[p] ** (1.0 / D) / cell
        half, at_x = 0.5 * (spread + 1.0) * width, (x[p, 0] - lower[0]) / cell
        first, last = max(math.floor(at_x - half), 0), min(math.floor(at_x + half), columns - 1)
        at_y, bottom, top = 0.5, 0, 0  # in the plane one row, which is covered
        if D == 3:
            at_y = (x[p, 1] - lower[1]) / cell
            bottom, top = max(math.floor(at_y - half), 0), min(math.floor(at_y + half), rows - 1)
        for row in range(bottom, top + 1):
            of_row = blurred(at_y, width, spread, row, row + 1.0) if D == 3 else 1.0
            for column in range(first, last + 1):
                share = of_row * blurred(at_x, width, spread, column, column + 1.0)
                found = sums[row, column]
                found[0] += share * volume[p]
                found[1] += share * mass[p]
                for i in range(D):
                    found[2 + i] += share * mass[p] * v[p, i]
                inside += share * rest[p]
    return inside


@compiled
def to_gauges(x: Array, v: Array, mass: Array, volume: Array, spread: float, places: Array,
              half_widths: Array, sums: Array) -> None:
    """The same of squares of ``half_widths`` [m], (m,), around ``places`` [m], (m, D - 1): to ``sums``, (m, 2
    + D)."""
    D = x.shape[1]
    for p in range(len(x)):
        width = volume[p] ** (1.0 / D)
        for g in range(len(places)):
            share = 1.0
            for i in range(D - 1):
                at = places[g, i]
                share *= blurred(x[p, i], width, spread, at - half_widths[g], at + half_widths[g])
            if share > 0.0:
                sums[g, 0] += share * volume[p]
                sums[g, 1] += share * mass[p]
                for i in range(D):
                    sums[g, 2 + i] += share * mass[p] * v[p, i]


@compiled
def through_lines(x: Array, v: Array, volume: Array, rest: Array, lines: tuple, discharge: Array) -> None:
    """Add the material volume per time [m^3/s] that flows through vertical planes over ``lines`` to
    ``discharge``, (m,). lines: start and normal, (m, 2) each, length and width of the band, (m,), over which
    it is averaged [m]; in the plane the second components are zero."""
    start, normal, length, width = lines
    D = x.shape[1]
    for p in range(len(x)):
        half = 0.5 * volume[p] ** (1.0 / D)
        for g in range(len(start)):
            n_x, n_y, a, b = normal[g, 0], normal[g, 1], x[p, 0] - start[g, 0], 0.0
            speed = v[p, 0] * n_x
            if D == 3:
                b = x[p, 1] - start[g, 1]
                speed += v[p, 1] * n_y
            share = overlap(n_x * a + n_y * b, half, -0.5 * width[g], 0.5 * width[g])
            if D == 3:
                share *= overlap(n_x * b - n_y * a, half, 0.0, length[g])
            discharge[g] += rest[p] * speed * share / width[g]


@compiled
def keep_largest(sums: Array, area: float, dry: float, time: float, depth: Array, speed: Array,
                 pressure: Array, arrival: Array) -> None:
    """Update the largest ``depth`` [m], ``speed`` [m/s] and ``pressure`` [Pa] of each cell, and its time of
    ``arrival`` [s], NaN before, shape (rows, columns) each, by ``sums`` over its ``area`` [m^(D-1)]; a cell
    that is ``dry``, with less depth [m], has no speed and is not reached."""
    for row in range(sums.shape[0]):
        for column in range(sums.shape[1]):
            found = sums[row, column]
            now = found[0] / area
            depth[row, column] = max(depth[row, column], now)
            if now <= dry:
                continue
            square = 0.0
            for i in range(2, len(found)):
                square += (found[i] / found[1]) ** 2
            speed[row, column] = max(speed[row, column], math.sqrt(square))
            pressure[row, column] = max(pressure[row, column], found[1] / found[0] * square)
            if math.isnan(arrival[row, column]):
                arrival[row, column] = time


@compiled
def mark_discs(x: Array, radius: Array, value: Array, lower: Array, cell: float, largest: Array) -> None:
    """Update the ``largest`` value of the cells that spheres at x [m], (n, D), cover, seen from above."""
    rows, columns, D = largest.shape[0], largest.shape[1], x.shape[1]
    for p in range(len(x)):
        at_x, at_y, size = (x[p, 0] - lower[0]) / cell, 0.5, radius[p] / cell
        if D == 3:
            at_y = (x[p, 1] - lower[1]) / cell
        bottom, top = max(math.floor(at_y - size), 0), min(math.floor(at_y + size), rows - 1)
        first, last = max(math.floor(at_x - size), 0), min(math.floor(at_x + size), columns - 1)
        for row in range(bottom, top + 1):
            away_y = max(row - at_y, at_y - row - 1.0, 0.0)
            for column in range(first, last + 1):
                away_x = max(column - at_x, at_x - column - 1.0, 0.0)
                if away_x**2 + away_y**2 <= size**2:
                    largest[row, column] = max(largest[row, column], value[p])
