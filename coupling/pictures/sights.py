"""What a picture shows besides the points of the solid, of any scene: spheres, rocks, structures, walls."""
from typing import Any, Dict, List, Tuple

import numpy as np

from ..shapes import bare_spheres, fixed_walls, joined, placed, rocks, structures

Sight = Dict[str, Tuple[np.ndarray, np.ndarray]]  # name → places and radii of spheres, or places and elements


def sight(solid: Any, grains: Any, dim: int, time: float) -> Sight:
    """What there is at a ``time`` [s]: "spheres", (centres [m], radii [m]) of the particles that are no part
    of a rock with a surface, and "rocks", "structures" and "walls", (places [m], elements). Collective."""
    found: Sight = {}
    if grains is not None:
        particles = grains.particles()
        seen = particles[bare_spheres(grains) & (particles["radius"] > 0.0)]
        found["spheres"] = seen["x"][:, :dim].copy(), seen["radius"].copy()
        found["rocks"] = rocks(grains)[0][:2] if dim == 3 else _nothing(dim)
    standing = [(placed(one, time), one.elements) for one in structures(solid, grains)]
    found["structures"] = joined(standing, dim)[:2]
    walls = [(wall.nodes, wall.elements) for wall in fixed_walls(solid, grains)]
    found["walls"] = joined(walls, dim)[:2]
    return {name: thing for name, thing in found.items() if len(thing[1])}


def magnified(start: Sight, end: Sight, by: float) -> Sight:
    """``end`` with the displacements since the ``start`` times ``by``, where the same is there."""
    moved = dict(end)
    for name, (x, what) in end.items():
        before = start.get(name)
        if before is not None and before[0].shape == x.shape:
            moved[name] = before[0] + by * (x - before[0]), what
    return moved


def outlines(x: np.ndarray, segments: np.ndarray) -> List[np.ndarray]:
    """The chains that ``segments`` (a, b), shape (m, 2), make: their corners, shape (k, 2) each; of a closed
    one the first is the last, too.

    >>> square = np.array([[0, 0], [1, 0], [1, 1], [0, 1]])
    >>> [len(chain) for chain in outlines(square, np.array([[1, 2], [2, 3], [0, 1]]))]
    [4]
    """
    after = {int(a): int(b) for a, b in segments}
    heads = sorted(set(after) - set(after.values()))
    chains = []
    while after:
        chain = [heads.pop(0) if heads else next(iter(after))]
        while chain[-1] in after:
            chain.append(after.pop(chain[-1]))
        chains.append(x[chain])
    return chains


def _nothing(dim: int) -> Tuple[np.ndarray, np.ndarray]:
    return np.zeros((0, dim)), np.zeros((0, dim), int)
