"""The outline of a plane body that flows: it gets boundary particles where it stretches and loses some where
it folds.

Everything here is a pure function of arrays.
"""
from typing import NamedTuple

import numpy as np

from ..scene.interface import SIDES
from .chains import NONE, Floor, drop_loops, end_of, foremost, in_order, links, remove, thin_out, untie


class OutlineChange(NamedTuple):
    """From an outline of m particles to one of n: places x [m], shape (n, 2), and elements, shape (k, 2).

    A new particle moves as (1 - weight) times the first plus weight times the second of its ``parents``,
    shape (n, 2); what loads an old particle goes on to its ``successor``, shape (m,).
    """

    x: np.ndarray
    elements: np.ndarray
    parents: np.ndarray
    weight: np.ndarray
    successor: np.ndarray

    @property
    def keeps_numbers(self):
        """Whether every particle is the one that it was."""
        return np.array_equal(self.successor, np.arange(len(self.x)))

    def interpolate(self, values):
        """Values at the new particles, shape (n, …), of what is given at the old ones, shape (m, …)."""
        w = self.weight.reshape(-1, *[1] * (values.ndim - 1))
        return (1.0 - w) * values[self.parents[:, 0]] + w * values[self.parents[:, 1]]

    def redistribute(self, load):
        """Loads on the new particles, shape (n, …), of those on the old ones, (m, …): the sum stays."""
        out = np.zeros((len(self.x), *load.shape[1:]))
        np.add.at(out, self.successor, load)
        return out


def find_change(x, elements, rule, loaded, has_mass, changed=False):
    """The ``OutlineChange`` that ``rule`` (``Resampling``) asks for, or None.

    x: places [m], shape (n, 2); loaded: mask of the particles that carry a load, shape (n,); has_mass(x):
    mask of the places from which a particle reaches a grid node with mass; changed: the places have been
    changed already. In this order: particles that reach no mass or sank below a floor go, as do those in
    folds and between short segments; the feet are laid anew; loops are cut off; long segments are divided.
    """
    x, parent = np.array(x, float), np.arange(len(x))
    following, before = links(elements, len(x))
    near = has_mass(x)
    stays = near.copy()
    for side, level in filter(None, rule.feet):
        axis, inward = SIDES[side]
        stays &= inward * (x[:, axis] - level) > 0.0
    changed |= thin_out(x, following, before, stays, rule.shortest * rule.spacing)
    for foot, last in zip(rule.feet, (False, True)):
        end = end_of(following, before, last)
        if foot is not None and end != NONE:
            (axis, inward), level = SIDES[foot[0]], foot[1]
            floor = Floor(axis, float(level), inward, rule.reach * rule.spacing)
            place, nose = find_foot(x, before if last else following, end, floor, last, loaded)
            if nose != end and has_mass(place[None])[0]:
                lay_foot((following, before), last, end, nose)
                x[end], parent[end] = place, nose
                changed = near[end] = True
        while end != NONE and not near[end]:
            remove(end, following, before)
            changed, end = True, end_of(following, before, last)
    touched = np.zeros(len(x), np.bool_)
    if untie(x, following, before, touched):
        drop_loops(x, following, before, touched, (2.0 * rule.spacing) ** 2)
        changed = True
    order, after = in_order(following, before)
    if not len(order):  # nothing is left
        none = np.empty((0, 2), int)
        return OutlineChange(x[:0], none, none, np.empty(0), np.full(len(x), NONE))
    return _divided(x, order, after, parent, rule.longest * rule.spacing, has_mass, changed)


def find_foot(x, step, end, floor, last, loaded):
    """Place [m], shape (2,), for the ``end`` of an open chain, its ``last`` or first, on the floor beneath
    the foremost particle near it, and the number of that particle.

    Grid nodes on a floor that sticks do not move, so an end there stays behind and the flow overruns it;
    contact with the lower side of the overrun part would be contact with the floor. What lies within the
    reach of the floor, up to the first particle that carries a load, is therefore cut off as far as the
    foremost particle, and the end goes on as that one does. step: (n,) the way into the chain.
    """
    out = floor.inward if last == (floor.axis == 1) else -floor.inward  # left of the way to or from the floor
    nose = foremost(x, step, end, floor, out, loaded)
    place = x[nose].copy()
    place[floor.axis] = floor.level
    return place, nose


def lay_foot(links, last, end, nose):
    """Cut off what lies between the ``end`` of a chain, its ``last`` or first, and its particle ``nose``.
    links: the arrays ``following`` and ``before``."""
    following, before = links
    step = before if last else following
    while step[end] != nose:
        remove(step[end], following, before)


def _divided(x, order, after, parent, longest, has_mass, changed):
    """The ``OutlineChange`` to the particles in this ``order``, with others between them where segments are
    longer than ``longest`` [m] and there is mass; None unless that, or something before, has ``changed`` the
    outline."""
    a, b = order, order[np.where(after == NONE, np.arange(len(order)), after)]
    length = np.hypot(*(x[b] - x[a]).T)
    pieces = np.where(length > longest, np.ceil(length / longest), 1).astype(int)
    owner = np.repeat(np.arange(len(order)), pieces)
    t = (np.arange(len(owner)) - (np.cumsum(pieces) - pieces)[owner]) / pieces[owner]
    places = (1.0 - t[:, None]) * x[a[owner]] + t[:, None] * x[b[owner]]
    keep = t == 0.0
    if not keep.all():
        keep[~keep] = has_mass(places[~keep])
    owner, t, places = owner[keep], t[keep], places[keep]
    if not changed and len(owner) == len(order):
        return None
    first = np.flatnonzero(t == 0.0)
    target = np.arange(1, len(owner) + 1)
    target[np.append(first[1:], len(owner)) - 1] = np.where(after == NONE, NONE, first[after])
    elements = np.column_stack([np.arange(len(owner)), target])[target != NONE]
    successor = np.full(len(x), NONE)
    successor[order] = first
    gone = np.flatnonzero(successor == NONE)
    successor[gone] = np.argmin(((x[gone, None] - places) ** 2).sum(axis=2), axis=1)
    return OutlineChange(places, elements, parent[np.column_stack([a[owner], b[owner]])], t, successor)
