"""Sizes of the material points and of their motion, from which contacts and windows are chosen."""
from itertools import product
from typing import NamedTuple

import numpy as np
from mpi4py import MPI

from .resolution import wave_speed


class Scales(NamedTuple):
    """See ``contact_scales``; the fields of `dem_liggghts.contact.rule.Scales`."""

    spacing: float  # of the points [m]
    mass: float  # of one of them [kg]
    area: float  # that a point has on a surface [m^2]
    rho: float  # density of the soil [kg/m^3]
    wave: float  # speed of its compression waves [m/s], 0 when not known
    height: float  # of the soil along gravity [m]
    speed: float  # largest that is expected [m/s]


def contact_scales(mpm):
    """``Scales`` of an MPM: of the body with the lightest points; height: of all of them; speed: of a body
    that falls from its highest place to the lowest one of the grid, with its speed at the start. Volumes are
    means of those at rest. Collective."""
    found = []
    for term in mpm._bodies:
        body, p = term.body, term.points
        count, volume = mpm.comm.allreduce(len(p)), mpm.comm.allreduce(float(p.V0.sum()))
        thickness = term.thickness if mpm.dim == 2 else 1.0
        volume /= max(count, 1)
        spacing = (volume / thickness) ** (1.0 / mpm.dim)
        found.append(Scales(spacing, body.rho * volume, volume / spacing, body.rho, wave_speed(body) or 0.0,
                            0.0, 0.0))
    return min(found, key=lambda scales: scales.mass)._replace(height=_height(mpm), speed=_expected(mpm))


def fastest(mpm):
    """Largest speed of a material point now [m/s]. Collective."""
    own = max((float(np.einsum("ni,ni->n", b.points.v, b.points.v).max(initial=0.0)) for b in mpm._bodies),
              default=0.0)
    return float(np.sqrt(mpm.comm.allreduce(own, MPI.MAX)))


def _levels(box, g):
    """Potential [m^2/s^2] of the lowest and the highest corner of a box, with ``g`` [m/s^2], shape (D,)."""
    levels = [-float(np.dot(g, corner)) for corner in product(*zip(box.lower, box.upper))]
    return min(levels), max(levels)


def _height(mpm):
    g = np.linalg.norm(mpm.gravity)
    levels = np.array([_levels(body.box, mpm.gravity) for body in mpm.scene.bodies])
    return float((levels[:, 1].max() - levels[:, 0].min()) / g) if g > 0 else 0.0


def _expected(mpm):
    top = max(_levels(body.box, mpm.gravity)[1] for body in mpm.scene.bodies)
    return float(np.sqrt(fastest(mpm) ** 2 + 2.0 * (top - _levels(mpm.scene.grid.box, mpm.gravity)[0])))
