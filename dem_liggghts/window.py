"""How long a coupling window may be for the contact of the particles with the moving wall."""
import numpy as np

import mpm_dem_checks as check

from . import parts
from .contact import field, laws


def contact_at_wall(scene, force):
    """Tangent stiffness [N/m], damping [kg/s] and mass [kg] in the contact of each sphere of ``scene`` with the moving
    wall under ``force`` [N]; shape (n,) each.

    Hertz: S = (6 E*^2 R force)^(1/3) = 2 E* sqrt(R d) at the overlap d, which is at most the radius, when the centre is
    on the surface: there the stiffness under an infinite force ends. Damping 2 sqrt(5/6) |beta| sqrt(S m), see
    ``contact.normal_force``.
    """
    balls, number = parts.grains(scene), {name: k for k, name in enumerate(scene.names)}
    if not len(balls.x) or not len(scene.wall.elements):
        return np.zeros((3, 0))
    E, beta = (field(laws(scene, scene.wall_pairs()), name)[balls.kind, number[scene.wall.material]]
               for name in ("E", "beta"))
    disc = scene.wall.radius
    R = balls.radius if disc is None else balls.radius * disc / (balls.radius + disc)
    overlap = np.minimum((0.75 * force / (E * np.sqrt(R))) ** (2.0 / 3.0), R)
    stiffness = 2.0 * E * np.sqrt(R * overlap)
    damping = 2.0 * np.sqrt(5.0 / 6.0) * abs(beta) * np.sqrt(stiffness * balls.partner)
    return np.array([stiffness, damping, balls.partner])


def longest_window(scene, mass, force=np.inf):
    """Longest sensible coupling window of ``scene`` [s] when the moving wall is carried by grid nodes of ``mass`` [kg],
    weakly coupled.

    For each sphere the root of 3/4 S dt^2/m + sqrt(3)/2 gamma dt/m = 1, with the stiffness S and the damping gamma of
    its contact under ``force`` [N], by default as deep as its radius: the stability limit of a mass on a spring and a
    damper that follows with the motion extrapolated from the windows before. 1.15 sqrt(m/S) without damping, 1.15
    m/gamma where it rules. Infinite when nothing can meet the wall. Several spheres at one node, and nodes that carry
    less mass, shorten it; the stiffness of the grid, which this leaves out, lengthens it.
    """
    check.positive("mass", mass, "kg")
    force = np.inf if force is None or force == np.inf else check.positive("force", force, "N")
    stiffness, damping, _ = contact_at_wall(scene, force)
    k, c = 0.75 * stiffness, 0.5 * np.sqrt(3.0) * damping
    return float((2.0 * mass / (c + np.sqrt(c**2 + 4.0 * k * mass))).min(initial=np.inf))


class AtWall:
    """What a back end with a ``scene`` tells of the contact with its moving wall."""

    def contact_at_wall(self, force):
        """See `protocol.DEM.contact_at_wall`."""
        return contact_at_wall(self.scene, force)
