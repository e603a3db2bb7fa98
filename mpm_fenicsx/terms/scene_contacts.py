"""Which bodies of a scene meet which others: those in different fields of the grid. Which structures the grid
is too coarse for."""
import warnings
from itertools import combinations

from ..points.points import surface_distances
from .body_contact import BodyContact, Other
from .scene_penalties import WALL_FACTOR, modulus


def make_meetings(bodies, background):
    """``BodyContact`` of each of the ``bodies``, terms of a step, that are softer than another one, as a
    tuple."""
    if background.fields == 1:
        return ()
    stiffness = [modulus(body.body.law, body.body.dim) for body in bodies]
    others = [{} for _ in bodies]
    for a, b in combinations(range(len(bodies)), 2):
        one, other = (a, b) if stiffness[a] <= stiffness[b] else (b, a)
        if bodies[a].field != bodies[b].field:
            friction = max(bodies[a].body.friction, bodies[b].body.friction)
            spring = WALL_FACTOR * stiffness[one] / background.h.min()
            meets = others[one].setdefault(bodies[other].field, [0.0, spring, []])
            meets[0] = max(meets[0], friction)
            meets[2].append(other)
    for body in bodies:
        if "half" not in body.points.names:
            half = surface_distances(body.body, body.points.V0, background.basis.smooth, body.part)
            body.points.add(half=half)
    return tuple(BodyContact(body, [Other(field, friction, spring, *_name(n, numbers)) for
                                    field, (friction, spring, numbers) in of_body.items()], background)
                 for n, (body, of_body) in enumerate(zip(bodies, others)) if of_body)


def _name(one, others):
    """Of the contact of body ``one`` with ``others``, and 1 or, where it is the second one named, -1."""
    if len(others) > 1 or one < others[0]:
        return f"bodies {one} and {', '.join(map(str, others))}", 1.0
    return f"bodies {others[0]} and {one}", -1.0


def warn_if_thin(structures, background):
    """One warning on the first rank for each closed one of the ``structures`` that is thinner than a cell."""
    h = background.h.max()
    for one in structures:
        if one.closed and one.width < (1.0 - 1e-9) * h and background.comm.rank == 0:
            warnings.warn(f"{one.name} is {one.width:.3g} m thick, the cells of the grid {h:.3g} m: soil on "
                          "both sides of it shares grid nodes, so that what is on one side drags along what "
                          f"is on the other; take cells of at most {0.5 * one.width:.3g} m, a thicker "
                          "structure, or keep soil on one side", stacklevel=2)
