"""Geometry of surfaces of segments or triangles, each with its outside, see ``Interface``."""
import numpy as np

from ..scene.facets import normal_areas


def to_particles(values, elements, count):
    """Elements' ``values``, shape (m, …), shared equally among their particles, shape (count, …)."""
    shared = np.zeros((count, *values.shape[1:]))
    for column in elements.T:
        np.add.at(shared, column, values / elements.shape[1])
    return shared


def areas(x, elements):
    """Area of each particle [m^2; m in the plane], shape (n,)."""
    return to_particles(np.linalg.norm(normal_areas(x, elements), axis=1), elements, len(x))


def everywhere(comm, gid, values, count):
    """Values, shape (count, …), in the order of ``gid`` on every rank, from those of each rank. Collective
    when there is more than one rank."""
    if comm.size == 1:
        return values.copy()
    whole = np.empty((count, *values.shape[1:]))
    for numbers, part in comm.allgather((gid, values)):
        whole[numbers] = part
    return whole
