"""Structures that a scene is given, and their walls. They are matched by their fields, as the class of those
that a solid meets, too, belongs to another package."""
from typing import Any, Tuple

import numpy as np

import mpm_dem_checks as check

from .walls import Wall

FIELDS = "name", "x", "elements", "friction", "motion", "cell", "cells", "closed", "width", "material"


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
