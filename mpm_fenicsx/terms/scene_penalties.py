"""The ``Penalty`` and ``GridWall`` records of a scene, made ready for this rank."""
import numpy as np

import mpm_dem_checks as check

from .. import laws
from ..points.surface import areas
from ..scene.conditions import GridWall
from ..scene.refine import as_fine_as_the_grid
from .penalty import Penalties, has_kinks

# Stiffness of the springs over that of one cell of the body. Those of a support give by 1 % of a cell's
# strain. A wall with friction or separation gives as much as one more cell would: with 100, neighbours in one
# cell fight each other, friction without separation is too large by 10 to 80 % and Newton's method fails
# (measured on a sliding block).
SUPPORT_FACTOR, WALL_FACTOR = 100.0, 1.0


def modulus(law, dim):
    """Stiffness [Pa] of the law at rest against stretch in one direction with the others fixed."""
    P, A = np.zeros(dim * dim + 1), np.zeros((dim * dim + 1, dim * dim + 1))
    old, new = np.zeros(2, law.state)
    laws.kernels(law, dim)[1](law.params, np.eye(dim), 1.0, 0.0, old, new, P, A)
    return A[0, 0]


def make_penalties(scene, background, start):
    """``Penalties`` of a scene, those in space and those that follow the body apart, as a tuple of none to
    two.

    scene: ``Penalty`` and ``GridWall`` records; start: the bodies, see ``bodies.Start``. Raises ValueError
    for a surface of another dimension, and a motion that does not fit it.
    """
    D, groups, h = background.dim, {False: [], True: []}, background.h.min()
    for condition in scene:
        if isinstance(condition, GridWall):
            condition = condition.penalty(background.whole[0])
        if np.shape(condition.surface.x)[1] != D:
            raise ValueError(f"the surface of {condition.name} has {np.shape(condition.surface.x)[1]} "
                             f"dimensions, the scene {D}: give both the same")
        _check_motion(condition)
        if not condition.follows:
            condition = as_fine_as_the_grid(condition, background)
        area = areas(np.asarray(condition.surface.x, float), np.asarray(condition.surface.elements))
        area[area == 0.0] = h ** (D - 1)  # a particle without elements stands for a node
        groups[condition.follows].append((condition, area * start.thickness * _stiffness(condition, h,
                                                                                         start)))
    return tuple(Penalties(*zip(*group), start, background) for group in groups.values() if group)


def _check_motion(penalty):
    if penalty.motion is None:
        return
    shape = np.shape(penalty.surface.x)
    start = check.values(f"the motion of {penalty.name} at t = 0 s", penalty.motion, (0.0,), shape[1:], shape,
                         unit="m")
    if start.any():
        raise ValueError(f"the motion of {penalty.name} at t = 0 is {check.shown(start.tolist())} m: it must "
                         "start from zero")


def reaction(penalties, name):
    """Force of the penalties of that name on the body, this rank's share [N]; raises ValueError for an
    unknown name."""
    names = sorted({str(other) for penalty in penalties for other in penalty.names})
    if name not in names:
        raise ValueError(f"there is no penalty {name!r}: choose one of {', '.join(names) or 'none'}")
    return sum(p.points.force[p.names[p.points.gid] == name].sum(axis=0) for p in penalties)


def _stiffness(penalty, h, start):
    """Of the springs per area [Pa/m], shape (n,); by default that of the nearest body."""
    x = np.asarray(penalty.surface.x, float)
    if penalty.stiffness is not None:
        return np.full(len(x), penalty.stiffness)
    factor = WALL_FACTOR if has_kinks(penalty) else SUPPORT_FACTOR
    return factor * start.modulus(x, modulus) / h
