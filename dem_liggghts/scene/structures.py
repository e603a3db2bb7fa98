"""Structures that a scene is given, and their walls. They are matched by their fields, as the class of those
that a solid meets, too, belongs to another package."""
from dataclasses import dataclass
from typing import Any, Callable, Dict, Optional, Tuple

import numpy as np

import mpm_dem_checks as check

from .walls import Wall

FIELDS = "name", "x", "elements", "friction", "motion", "cell", "cells", "closed", "width", "material"


@dataclass(frozen=True)
class Region:
    """One force cell of a structure whose friction differs from place to place: a structure of its own, with
    the mean of the friction there."""

    name: str
    x: np.ndarray
    elements: np.ndarray
    friction: float
    motion: Optional[Callable]
    cell: np.ndarray
    cells: Tuple[str, ...]
    material: str
    closed: bool = False
    width: float = 0.0


def by_region(structures: Tuple[Any, ...]) -> Tuple[Any, ...]:
    """The structures, those whose friction is that of each element cut into their regions. Where their sides
    meet a particle has one contact, as inside one wall."""
    return tuple(part for one in structures for part in (_regions(one) if np.ndim(one.friction) else (one,)))


def _regions(one: Any) -> Tuple[Region, ...]:
    x, elements, cell = np.asarray(one.x, float), np.asarray(one.elements), np.asarray(one.cell)
    corners = x[elements]
    size = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, -1] - corners[:, 0]), axis=1) \
        if x.shape[1] == 3 else np.linalg.norm(corners[:, 1] - corners[:, 0], axis=1)
    parts = []
    for number, name in enumerate(one.cells):
        own = cell == number
        used, local = np.unique(elements[own], return_inverse=True)
        mean = float(np.average(np.asarray(one.friction, float)[own], weights=size[own]))
        parts.append(Region(name, x[used], local.reshape(-1, x.shape[1]), mean, _part_of(one.motion, used),
                            np.zeros(int(own.sum()), np.int64), (name,), one.material or name))
    return tuple(parts)


def _part_of(motion: Optional[Callable], used: np.ndarray) -> Optional[Callable]:
    """The motion of the vertices ``used`` alone."""
    if motion is None:
        return None
    whole = motion

    def part(time: float) -> np.ndarray:
        w: np.ndarray = np.asarray(whole(time), float)
        return w if w.ndim == 1 else w[used]

    return part


def for_regions(interactions: Dict[Any, Any], structures: Tuple[Any, ...]) -> Dict[Any, Any]:
    """``interactions`` that hold for a structure as a whole, for each of its regions that is not named."""
    whole = {one.name: one.cells for one in structures if np.ndim(one.friction) and one.material is None}
    told = dict(interactions)
    for pair, interaction in interactions.items():
        for name in set(pair) & set(whole) if isinstance(pair, tuple) and len(pair) == 2 else ():
            other = pair[1 - pair.index(name)]
            told.pop(pair)
            for region in whole[name]:
                if not {(other, region), (region, other)} & set(interactions):
                    told[other, region] = interaction
    return told


def check_structures(given: Any) -> Tuple[Any, ...]:
    """As a tuple; ValueError for one that lacks a field, and for two of one name."""
    try:
        structures = tuple(given)
    except TypeError:
        check.refuse("structures", given, "give a list of structures")
    for one in structures:
        lacking = [name for name in FIELDS if not hasattr(one, name)]
        if lacking:
            check.refuse("one of the structures", one, f"it has no {lacking[0]}, give an "
                         "mpm_fenicsx.Structure or what has its fields")
    names = [name for one in structures for name in {one.name, *one.cells}]
    for name in names:
        if names.count(name) > 1:
            raise ValueError(f"{name!r} is the name of two structures: give each its own, as forces are told "
                             "by name")
    return structures


def wall_of(one: Any) -> Wall:
    """The wall of a structure: one with an inside pushes outwards, from half its width on; with several force
    cells each element has nodes of its own, whose forces are then those of one cell."""
    x, elements = np.asarray(one.x, float), np.asarray(one.elements)
    if len(one.cells) > 1:
        x, elements = x[elements].reshape(elements.size, -1), np.arange(elements.size).reshape(elements.shape)
    return Wall(x, elements, 0.5 * one.width if one.closed else None, one.material or one.name)
