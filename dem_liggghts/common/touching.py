"""What touches what: geometry that both back ends share, with the springs that each keeps in its own way."""
from typing import Any, Tuple

import numpy as np

from ..compiled import compiled
from ..scene.contacts import Contacts, ContactTable, contact_table
from ..search.elements import COLUMNS, NEAREST, PAIR, MovingWall
from ..search.neighbours import NeighbourList, Query, near_elements, near_spheres, no_neighbours
from ..search.wall_contacts import find_contacts
from .energy import Shapes

Springs = Tuple[int, ...]  # how many each contact has: of spheres with each other, of spheres with walls


def neighbours_of(table: ContactTable, spheres: int, springs: int) -> NeighbourList:
    """A list of the contacts in ``table`` for so many ``spheres``, with so many ``springs`` of each."""
    first, partner = table.partners.T
    order = np.lexsort((partner, first))
    start = np.concatenate([[0], np.cumsum(np.bincount(first, minlength=spheres))])
    kept = order if springs else order[:0]
    return NeighbourList(start, partner[order], np.ones(len(kept), np.bool_),
                         np.ascontiguousarray(table.springs[kept, :3 * max(springs, 1)]))


def lists_of(contacts: Any, spheres: int, springs: Springs) -> Tuple[NeighbourList, NeighbourList]:
    """The lists of both kinds of ``contacts``, empty for None."""
    if contacts is None:
        return no_neighbours(spheres), no_neighbours(spheres)
    return (neighbours_of(contacts.spheres, spheres, springs[0]),
            neighbours_of(contacts.walls, spheres, springs[1]))


def touching(spheres: Shapes, wall: MovingWall, old: Tuple[NeighbourList, NeighbourList],
             springs: Springs) -> Contacts:
    """All contacts of the ``spheres`` with each other and the ``wall``, whose springs are those of ``old``
    lists."""
    x, radius = spheres.x, spheres.radius
    near = near_spheres(x, radius, spheres.cluster, 0.0, old[0], springs[0])
    first, second = np.repeat(np.arange(len(x)), np.diff(near.start)), near.partner
    overlap = radius[first] + radius[second] - np.sqrt(((x[first] - x[second])**2).sum(axis=1))
    between = contact_table(np.column_stack([first, second]), overlap, near.shear)
    near = near_elements(x, radius, 0.0, wall, 0.0, old[1], springs[1])
    found = _at_walls(x, radius, near, wall)
    rows = found[:, 1].astype(np.int64)
    return Contacts(between, contact_table(
        np.column_stack([found[:, 0].astype(np.int64), near.partner[rows]]), found[:, 2],
        near.shear[rows] if springs[1] else near.shear))


@compiled
def _at_walls(x: np.ndarray, radius: np.ndarray, near: NeighbourList, wall: MovingWall) -> np.ndarray:
    """Sphere, row in the list and overlap [m] of each contact with walls, (n, 3)."""
    query = Query(near, wall, 0.0, np.empty((len(near.partner) + 1, COLUMNS)), np.empty((3, 3)))
    out, count, found = np.empty((len(near.partner), 3)), 0, query.found
    for i in range(len(radius)):
        for c in range(find_contacts(query, i, x[i], radius[i])):
            out[count, 0], out[count, 1], out[count, 2] = i, found[c, PAIR], radius[i] - found[c, NEAREST]
            count += 1
    return out[:count]
