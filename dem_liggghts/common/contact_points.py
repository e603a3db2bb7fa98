"""Where particles touch each other and walls, for pictures: the same for both back ends."""
from typing import Any

import numpy as np

from ..compiled import compiled
from ..contact.law import Laws, area_at_wall, area_of_spheres, pair_law, radius_at_wall
from ..scene.tables import GROUP, MATERIAL, RADIUS
from ..search.elements import COLUMNS, DISTANCE, NEAREST, PAIR, POINT, SHARE, MovingWall
from ..search.neighbours import Query, near_elements, near_spheres, no_neighbours
from ..search.wall_contacts import find_contacts
from .energy import Shapes

# One contact: place [m], force on the first sphere [N], ids of this and of the other one, or 0, number of the
# wall in the order of the scene, the moving one last, or -1, overlap [m]
CONTACT_POINT = np.dtype([("x", float, 3), ("force", float, 3), ("particle", int), ("other", int),
                          ("wall", int), ("overlap", float)])


@compiled
def _pairs(spheres, near, between, rows):
    """Contacts of spheres as rows: place, force, both numbers, -1, overlap. Returns how many there are."""
    count, x = 0, spheres.x
    for i in range(len(x)):
        for q in range(near.start[i], near.start[i + 1]):
            j = near.partner[q]
            a, b, r = spheres.radius[i], spheres.radius[j], np.sqrt(np.sum((x[i] - x[j]) ** 2))
            if r >= a + b:
                continue
            law, d = pair_law(between, spheres.material[i], spheres.material[j]), a + b - r
            force = 4.0 / 3.0 * law.E * np.sqrt(a * b / (a + b)) * d**1.5
            force -= law.adhesion * area_of_spheres(r, a, b)
            for k in range(3):
                n = (x[i, k] - x[j, k]) / r
                rows[count, k] = x[i, k] - (a - 0.5 * d) * n
                rows[count, 3 + k] = force * n
            rows[count, 6], rows[count, 7], rows[count, 8], rows[count, 9] = i, j, -1, d
            count += 1
    return count


@compiled
def _at_walls(spheres, near, wall, at_wall, rows):
    """The same with walls, whose number takes the place of the -1."""
    query = Query(near, wall, 0.0, np.empty((len(near.partner) + 1, COLUMNS)), np.empty((3, 3)))
    count, found, radius = 0, query.found, spheres.radius
    for i in range(len(radius)):
        for c in range(find_contacts(query, i, spheres.x[i], radius[i])):
            traits = wall.traits[near.partner[int(found[c, PAIR])]]
            law = pair_law(at_wall, spheres.material[i], int(traits[MATERIAL]))
            d, reduced = radius[i] - found[c, NEAREST], radius_at_wall(radius[i], traits[RADIUS])
            force = 4.0 / 3.0 * law.E * np.sqrt(reduced) * d**1.5
            force -= law.adhesion * area_at_wall(reduced - d, reduced)
            for k in range(3):
                rows[count, k] = spheres.x[i, k] + found[c, POINT + k]
                rows[count, 3 + k] = -found[c, SHARE] * force * found[c, POINT + k] / found[c, DISTANCE]
            rows[count, 6], rows[count, 7], rows[count, 8], rows[count, 9] = i, -1, traits[GROUP], d
            count += 1
    return count


def contact_points(spheres: Shapes, ids: np.ndarray, wall: MovingWall, laws: Laws) -> np.ndarray:
    """All contacts of the spheres with these ``ids``, (n,), with each other and the walls, dtype
    ``CONTACT_POINT``. The force is the normal one of springs and adhesion, without dampers and friction."""
    none, springs = no_neighbours(len(spheres.x)), 0
    pairs = near_spheres(spheres.x, spheres.radius, spheres.cluster, 0.0, none, springs)
    near = near_elements(spheres.x, spheres.radius, 0.0, wall, 0.0, none, springs)
    rows = np.empty((2, max(len(pairs.partner), len(near.partner)), 10))
    counts = (_pairs(spheres, pairs, laws.between, rows[0]),
              _at_walls(spheres, near, wall, laws.at_wall, rows[1]))
    table: Any = np.concatenate([part[:count] for part, count in zip(rows, counts)])
    out = np.empty(len(table), CONTACT_POINT)
    out["x"], out["force"], out["overlap"] = table[:, :3], table[:, 3:6], table[:, 9]
    numbers = table[:, 6:9].astype(int)
    out["particle"], out["wall"] = ids[numbers[:, 0]], numbers[:, 2]
    out["other"] = np.where(numbers[:, 1] < 0, 0, ids[numbers[:, 1]])
    return out
