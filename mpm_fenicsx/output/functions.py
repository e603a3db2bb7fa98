"""Nodal fields of the last step, for ParaView and as functions of FEniCSx."""
import numpy as np

import mpm_dem_checks as check

from ..errors import MPMError

FIELDS = {  # name → values of shape (active nodes, D) from the state before the step and the increment
    "velocity": lambda grid, increment: grid.v,
    "displacement": lambda grid, increment: increment.u,
    "acceleration": lambda grid, increment: increment.a}
SUMS = "mass", "density", "momentum"


def by_vertex(background, active_cells, mass, values):
    """Mass [kg], shape (n,), and means of the ``values`` by mass, (n, D), at the vertices of the whole grid,
    over all its fields; zero where this rank has no active cell. mass, values: of the active nodes."""
    vertices = background.whole[0]
    total, mean = np.zeros(len(vertices)), np.zeros(vertices.shape)
    vertex = background.vertex_of[active_cells.node] % len(vertices)
    if background.fields == 1:
        total[vertex], mean[vertex] = mass, values
        return total, mean
    np.add.at(total, vertex, mass)
    np.add.at(mean, vertex, mass[:, None] * values)
    return total, mean / np.where(total > 0.0, total, 1.0)[:, None]


def function(mpm, name):
    """See ``MPM.function``."""
    check.choice("name of the field", name, (*SUMS, *FIELDS))
    step, domain = mpm.step, mpm.background.domain
    if step.finished is None:
        raise MPMError(f"no step has left a {name} on the grid: call advance first")
    grid, increment = step.finished
    values = FIELDS.get(name, FIELDS["velocity"])(grid, increment)
    mass, mean = by_vertex(mpm.background, step.active_cells, grid.mass, values)
    density = mass / domain.volume
    sums = {"mass": mass, "density": density, "momentum": density[:, None] * mean}
    return domain.function(name, sums.get(name, mean))
