"""The transfers between points and grid: which rule of time, term of a body and way back to the points each
has; and the terms of all bodies of a scene."""
from functools import partial
from types import ModuleType
from typing import Callable, NamedTuple

from ..collective import Part, together
from ..points import transfer
from . import midpoint, newmark
from .affine_bodies import AffineBody
from .bodies import BodyTerm


class Transfer(NamedTuple):
    """``rule`` of time, see ``GridState``; ``body``: class of the terms of bodies; ``to_points``: template of
    phase III."""

    rule: ModuleType
    body: Callable
    to_points: Callable


TRANSFERS = {
    "newmark": Transfer(newmark, BodyTerm, transfer.to_points),
    "apic": Transfer(midpoint, partial(AffineBody, apic=True), transfer.to_points_midpoint),
    "tpic": Transfer(midpoint, partial(AffineBody, apic=False), transfer.to_points_midpoint)}


def make_bodies(scene, gravity, basis, make, comm):
    """Terms of the bodies of a ``SolidScene``, numbered through, by ``make``, with arguments as of
    ``BodyTerm``, each rank with its part of their points; ValueError when they do not fit each other or the
    grid. Collective."""
    return together(comm, lambda: _make(scene, gravity, basis, make, Part(comm.rank, comm.size)))


def _make(scene, gravity, basis, make, part):
    bodies, body_force, grid = scene.bodies, scene.body_force, scene.grid
    if not bodies:
        raise ValueError("there is no body: give at least one")
    for number, body in enumerate(bodies):
        if body.dim != grid.box.dim:
            raise ValueError(f"body {number} has {body.dim} dimensions, the grid {grid.box.dim}: give both "
                             "the same")
        if body.dim == 2 and body.thickness != bodies[0].thickness:
            raise ValueError(f"body {number} is {body.thickness} m thick, body 0 {bodies[0].thickness} m: "
                             "bodies in one plane grid have the same thickness")
    terms, count, h = [], 0, grid.cell_size if basis.smooth else None
    for body, field in zip(bodies, scene.fields):
        terms.append(make(body, count, gravity, body_force, basis, h, part=part))
        terms[-1].points.field = field
        count += terms[-1].total
    return terms
