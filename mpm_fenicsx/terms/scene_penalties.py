"""The ``Penalty`` and ``GridWall`` records of a scene, made ready for this rank."""
import numpy as np

import mpm_dem_checks as check

from .. import laws
from ..points.surface import areas
from ..scene.conditions import GridWall
from ..scene.refine import as_fine_as_the_grid
from .penalty import Penalties, has_kinks
from .surface_contact import SurfaceContact
from .wall_surfaces import find_surfaces

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


def softest(bodies):
    """The least modulus of the ``bodies``, terms, times its thickness [Pa m^(3-D)]."""
    return min(modulus(body.body.law, body.body.dim) * body.thickness for body in bodies)


def make_penalties(scene, background, start):
    """``Penalties`` of a scene, those in space and those that follow the body apart, as a tuple of none to
    two, those in space once for each field of the grid.

    scene: ``Penalty`` and ``GridWall`` records; start: the bodies, see ``bodies.Start``. Raises ValueError
    for a surface of another dimension, and a motion that does not fit it.
    """
    parts = start.by_field()
    if len(parts) == 1:
        return _of_bodies(scene, background, start)
    follows = lambda condition: getattr(condition, "follows", False)  # noqa: E731
    in_space = [condition for condition in scene if not follows(condition)]
    return sum((_of_bodies(in_space, background, part) for part in parts),
               _of_bodies([condition for condition in scene if follows(condition)], background, start))


def _of_bodies(scene, background, start):
    """The same for the bodies of ``start`` alone."""
    D, groups, h = background.dim, {False: [], True: []}, background.h.min()
    for condition in scene:
        if condition.contact == "surface":
            continue  # on material points, see ``surface_contact``
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
        stiffness = stiffness_at(condition, np.asarray(condition.surface.x, float), h, start)
        groups[condition.follows].append((condition, area * start.thickness * stiffness))
    return tuple(Penalties(*zip(*group), start, background) for group in groups.values() if group)


def make_contacts(scene, background, start, bodies):
    """``SurfaceContact`` of each of the ``bodies``, terms of a step, with the walls of the scene that meet
    the surface: none, or as many as there are bodies. Other arguments and errors: see ``make_penalties``."""
    scene = [condition for condition in scene if condition.contact == "surface"]
    surfaces, h = find_surfaces(scene, background), background.h.min()
    without = {condition.name for condition in scene} - {surface.name for surface in surfaces}
    if without:
        raise ValueError(f'{min(without)} has contact="surface" but no side that bodies can meet: give a '
                         "normal, and to a GridWall all nodes of the sides of cells")
    for surface in surfaces:
        if surface.motion:
            _check_motion(surface.record)
    here = np.zeros((1, background.dim))  # anywhere in a body
    return tuple(SurfaceContact(body, surfaces, np.concatenate(
        [stiffness_at(surface.record, here, h, start.of(body)) for surface in surfaces]), background,
        start.pull) for body in bodies if surfaces)


def _check_motion(penalty):
    if penalty.motion is None:
        return
    shape = np.shape(penalty.surface.x)
    start = check.values(f"the motion of {penalty.name} at t = 0 s", penalty.motion, (0.0,), shape[1:], shape,
                         unit="m")
    if start.any():
        raise ValueError(f"the motion of {penalty.name} at t = 0 is {check.shown(start.tolist())} m: it must "
                         "start from zero")


def names_of(terms):
    """Names under which penalties and contacts tell their forces, sorted."""
    return sorted({str(name) for term in terms for name in (*term.names, *term.cell_names)})


def reaction(penalties, contacts, name):
    """Force of the penalties and ``contacts`` of that name on the body, this rank's share [N]; raises
    ValueError for an unknown name."""
    names = names_of((*penalties, *contacts))
    if name not in names:
        raise ValueError(f"there is no penalty {name!r}: choose one of {', '.join(names) or 'none'}")
    held = [p.points.force[p.names[p.points.gid] == name].sum(axis=0) for p in penalties]
    return sum([*held, *(contact.reaction(name) for contact in contacts)])


def stiffness_at(penalty, x, h, start):
    """Of the springs per area at places x [m], shape (n, D) [Pa/m], shape (n,); by default that of the
    nearest body. h: size of a cell [m]; start: the bodies, see ``bodies.Start``."""
    if penalty.stiffness is not None:
        return np.full(len(x), penalty.stiffness)
    factor = WALL_FACTOR if has_kinks(penalty) else SUPPORT_FACTOR
    return factor * start.modulus(x, modulus) / h
