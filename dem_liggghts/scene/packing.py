"""Places in a box, drawn from a seed, where spheres and clusters do not overlap."""
from typing import Any, List, NamedTuple, Tuple, Union

import numpy as np

import mpm_dem_checks as check

from ..compiled import compiled
from .arrays import in_space
from .sizes import check_size

TRIES = 100000  # places drawn for one body before it is given up
LOT = 4096  # tries whose numbers are drawn together
TURNING = {2: 1, 3: 3}  # random numbers for an orientation
JAMMED = {2: 0.547, 3: 0.384}  # part of a large box that equal discs or spheres fill when no more fit (RSA)

ArrayList = Union[np.ndarray, List[np.ndarray]]


class Bodies(NamedTuple):
    """Rigid bodies of spheres, in the order in which they are placed."""

    first: np.ndarray  # number of the first sphere of each, and the end, (n + 1,)
    arms: np.ndarray  # from the body's point of reference to its spheres [m], (m, 3)
    radius: np.ndarray  # of the spheres [m], (m,)
    turned: bool  # whether orientations are drawn


class Room(NamedTuple):
    """The box, in cells that name the spheres in them: a grid of its own for each level of radii, halved from
    one to the next, so that neither few large spheres nor many small ones make long lists."""

    lower: np.ndarray  # corners [m], (3,); third coordinate zero in a plane
    upper: np.ndarray
    dim: int
    gap: float  # least distance between surfaces of bodies [m]
    level: np.ndarray  # of each sphere, (m,)
    radius: np.ndarray  # largest of each level [m], (l,)
    shape: np.ndarray  # number of cells along each axis, (l, 3)
    width: np.ndarray  # of the cells [m], (l, 3)
    first: np.ndarray  # number of the first cell of each level, (l,)
    head: np.ndarray  # number of the last sphere in each cell, or -1
    following: np.ndarray  # number of the one before it in its cell, or -1, (m,)


class Places(NamedTuple):
    """What is placed so far."""

    x: np.ndarray  # points of reference [m], (n, 3)
    q: np.ndarray  # orientations, (n, 4)
    spheres: np.ndarray  # centres of the spheres [m], (m, 3)


def pack(arms: ArrayList, radii: ArrayList, inside: Any, seed: int, gap: float,
         turned: bool = True) -> Tuple[np.ndarray, np.ndarray]:
    """Points of reference [m], shape (n, 3), and quaternions, shape (n, 4), of n bodies inside the box
    without overlap: random sequential addition. arms, (k, dim), and radii, (k,), of each: where its
    spheres are [m].

    Large bodies come first. Each gets an orientation (as in Shoemake, Graphics Gems III (1992) 124-132), if
    ``turned``, and a place, both uniform among those in the box, until it overlaps none before it. Only seed
    and bodies decide: every rank gets the same. Raises ValueError when one finds no place in ``TRIES`` tries.
    """
    lower, upper = read_box(inside)
    dims = sorted({a.shape[1] for a in arms})
    if set(dims) - {len(lower)}:
        raise ValueError(f"the box inside has {len(lower)} dimensions and the clusters have {dims}: use one "
                         "dimension, 2 or 3, for all")
    gap = check.not_negative("gap", gap, "m")
    random = np.random.default_rng(check.count("seed", seed, 0))
    counts = np.array([len(r) for r in radii], np.int64)
    check_size(float(counts.sum()), f"{len(counts)} bodies to pack")
    if not len(counts):
        return np.zeros((0, 3)), np.zeros((0, 4))
    reach = np.array([(np.linalg.norm(a, axis=1) + r).max() for a, r in zip(arms, radii)])
    order = np.argsort(-reach, kind="stable")
    bodies = Bodies(np.concatenate([[0], np.cumsum(counts[order])]),
                    in_space(np.concatenate([arms[k] for k in order])),
                    np.concatenate([radii[k] for k in order]).astype(float), turned)
    places = Places(np.zeros((len(counts), 3)), np.tile([1.0, 0.0, 0.0, 0.0], (len(counts), 1)),
                    np.zeros((len(bodies.arms), 3)))
    _place_all(bodies, _room(lower, upper, gap, bodies.radius), places, random)
    back = np.argsort(order)
    return places.x[back], places.q[back]


def read_box(inside: Any) -> Tuple[np.ndarray, np.ndarray]:
    """Corners [m], (2,) or (3,), of anything with ``lower`` and ``upper``."""
    if not hasattr(inside, "lower") or not hasattr(inside, "upper"):
        check.refuse("inside", inside, "give a box, something with lower and upper, its corners [m]")
    lower = check.array("lower corner of inside", inside.lower, (2,), (3,), unit="m")
    upper = check.array("upper corner of inside", inside.upper, lower.shape, unit="m")
    if not (lower < upper).all():
        raise ValueError(f"inside goes from {lower} to {upper} m: every upper coordinate must exceed the "
                         "lower one")
    return lower, upper


def _room(lower: np.ndarray, upper: np.ndarray, gap: float, radius: np.ndarray) -> Room:
    dim, none = len(lower), np.zeros(3 - len(lower))
    octave, level, times = np.unique(np.floor(np.log2(radius.max() / radius)), return_inverse=True,
                                     return_counts=True)
    largest = radius.max() / 2.0**octave
    # at least as wide as two spheres that touch; more cells than spheres are of no use
    shape = np.ones((len(largest), 3), np.int64)
    shape[:, :dim] = np.clip((upper - lower) / (2.0 * largest + gap)[:, None], 1,
                             np.ceil((4.0 * times)**(1.0 / dim))[:, None])
    lower, upper = np.concatenate([lower, none]), np.concatenate([upper, none])
    cells = np.concatenate([[0], np.cumsum(shape.prod(axis=1))])
    return Room(lower, upper, dim, gap, level.ravel(), largest, shape, (upper - lower) / shape, cells[:-1],
                np.full(cells[-1], -1), np.full(len(radius), -1))


def _place_all(bodies: Bodies, room: Room, places: Places, random: np.random.Generator) -> None:
    count = len(bodies.first) - 1
    space = float(np.prod((room.upper - room.lower)[:room.dim]))
    ball = np.pi if room.dim == 2 else 4.0 / 3.0 * np.pi
    filled = np.concatenate([[0.0], np.cumsum(ball * bodies.radius**room.dim)])[bodies.first] / space
    numbers = room.dim + bodies.turned * TURNING[room.dim]
    remedy = "give fewer or smaller ones, a smaller gap or a larger box"
    one = np.diff(bodies.first) == 1
    if filled[-1] > 1.0 and one.all():
        raise ValueError(f"{count} spheres would fill {filled[-1]:.3g} times the box: {remedy}")
    done, tries = 0, 0
    while done < count:
        done, tries = _place(random.random((LOT, numbers)), done, tries, bodies, room, places)
        if tries >= TRIES:
            what = "spheres" if one.all() else "clusters, whose spheres"
            raise ValueError(f"{done} of {count} {what} fill {filled[done]:.3g} of the box, and the next one "
                             f"finds no place in {TRIES} tries (equal spheres placed at random end near "
                             f"{JAMMED[room.dim]}): {remedy}")


@compiled
def _place(numbers: np.ndarray, done: int, tries: int, bodies: Bodies, room: Room,
           places: Places) -> Tuple[int, int]:
    """Go on with random ``numbers``, a row for each try; how many bodies are placed, and the tries that the
    next one has had."""
    for row in numbers:
        if done == len(bodies.first) - 1 or tries == TRIES:
            break
        start, end = bodies.first[done], bodies.first[done + 1]
        if bodies.turned:
            _draw_turn(row[room.dim:], room.dim, places.q[done])
        spheres = places.spheres[start:end]
        _turn(places.q[done], bodies.arms[start:end], spheres)
        fits = True
        for k in range(room.dim):
            low = (spheres[:, k] - bodies.radius[start:end]).min()
            high = (spheres[:, k] + bodies.radius[start:end]).max()
            space = (room.upper[k] - high) - (room.lower[k] - low)
            fits = fits and space >= 0.0
            places.x[done, k] = room.lower[k] - low + row[k] * space
            spheres[:, k] += places.x[done, k]
        n = start
        while fits and n < end:
            fits = _is_free(places.spheres[n], bodies.radius[n], places.spheres, bodies.radius, room)
            n += 1
        if not fits:
            tries += 1
            continue
        for n in range(start, end):
            level, x = room.level[n], places.spheres[n]
            cell = _cell(_row(x[0], 0, level, room), _row(x[1], 1, level, room), _row(x[2], 2, level, room),
                         level, room)
            room.following[n] = room.head[cell]
            room.head[cell] = n
        done, tries = done + 1, 0
    return done, tries


@compiled
def _draw_turn(row: np.ndarray, dim: int, q: np.ndarray) -> None:
    """A uniform rotation from 1 or 3 numbers in [0, 1), about the third axis in a plane."""
    if dim == 2:
        q[0], q[1], q[2], q[3] = np.cos(np.pi * row[0]), 0.0, 0.0, np.sin(np.pi * row[0])
        return
    a, b, s, t = np.sqrt(1.0 - row[0]), np.sqrt(row[0]), 2.0 * np.pi * row[1], 2.0 * np.pi * row[2]
    q[0], q[1], q[2], q[3] = b * np.cos(t), a * np.sin(s), a * np.cos(s), b * np.sin(t)


@compiled
def _turn(q: np.ndarray, arms: np.ndarray, out: np.ndarray) -> None:
    """The ``arms``, (n, 3), turned by q."""
    w, x, y, z = q
    for n in range(len(arms)):
        a, b, c = arms[n]
        u, v, t = 2 * (y * c - z * b), 2 * (z * a - x * c), 2 * (x * b - y * a)
        out[n, 0] = a + w * u + y * t - z * v
        out[n, 1] = b + w * v + z * u - x * t
        out[n, 2] = c + w * t + x * v - y * u


@compiled
def _row(x: float, axis: int, level: int, room: Room) -> int:
    """In which row of cells a coordinate lies, the nearest one outside the box."""
    width, most = room.width[level, axis], room.shape[level, axis] - 1
    return min(most, max(0, int((x - room.lower[axis]) / width))) if most else 0


@compiled
def _cell(i: int, j: int, k: int, level: int, room: Room) -> int:
    return room.first[level] + (i * room.shape[level, 1] + j) * room.shape[level, 2] + k


@compiled
def _is_free(x: np.ndarray, radius: float, spheres: np.ndarray, radii: np.ndarray, room: Room) -> bool:
    """Whether a sphere overlaps none of those that are placed."""
    for level in range(len(room.radius)):
        reach = radius + room.radius[level] + room.gap
        low_k, high_k = _row(x[2] - reach, 2, level, room), _row(x[2] + reach, 2, level, room)
        low_j, high_j = _row(x[1] - reach, 1, level, room), _row(x[1] + reach, 1, level, room)
        for i in range(_row(x[0] - reach, 0, level, room), _row(x[0] + reach, 0, level, room) + 1):
            for j in range(low_j, high_j + 1):
                for k in range(low_k, high_k + 1):
                    other = room.head[_cell(i, j, k, level, room)]
                    while other >= 0:
                        apart = radius + radii[other] + room.gap
                        away = 0.0
                        for axis in range(3):
                            away += (x[axis] - spheres[other, axis])**2
                        if away < apart * apart:
                            return False
                        other = room.following[other]
    return True
