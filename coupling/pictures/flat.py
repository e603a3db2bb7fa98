"""Spheres, structures and walls in pictures of plane scenes."""
from typing import Any

import numpy as np

from .sights import Sight, outlines

STRUCTURE = dict(facecolor="#9ea8bd", edgecolor="0.3", linewidth=0.8)


def draw_things(axes: Any, things: Sight, scale: float) -> list:
    """Add spheres as discs, structures as polygons, open ones and walls as lines; ``scale``: units of the
    axes per metre. Returns what has been added, which ``remove()`` takes away."""
    from matplotlib.collections import EllipseCollection, LineCollection, PolyCollection

    added: list = []
    if "structures" in things:
        chains = [scale * chain for chain in outlines(*things["structures"])]
        closed = [np.array_equal(chain[0], chain[-1]) for chain in chains]
        added += [PolyCollection([c for c, whole in zip(chains, closed) if whole], **STRUCTURE),
                  LineCollection([c for c, whole in zip(chains, closed) if not whole], color="0.3")]
    if "walls" in things:
        x, elements = things["walls"]
        added.append(LineCollection(scale * x[elements], color="0.5", linewidth=1))
    if "shapes" in things:
        added.append(PolyCollection(scale * things["shapes"][0], facecolor="burlywood",
                                    edgecolor="saddlebrown"))
    if "spheres" in things:
        x, width = scale * things["spheres"][0], 2 * scale * things["spheres"][1]
        added.append(EllipseCollection(width, width, np.zeros_like(width), units="xy", offsets=x,
                                       offset_transform=axes.transData, facecolor="burlywood",
                                       edgecolor="saddlebrown"))
    for one in added:
        axes.add_collection(one, autolim=False)
    return added
