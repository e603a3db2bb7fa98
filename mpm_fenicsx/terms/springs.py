"""Springs between the body and boundary particles: walls anywhere in the grid, with friction, and hinges of
the body.

A particle of area A holds what lies at its place by the force (Chandra et al. 2021, doi
10.1007/s11440-020-01123-3)

    f = -k A (g_n n + g_t),   k A |g_t| <= mu N  by radial return (Coulomb),   g_n := 0 when it separates and
                              g_n > 0,

k: stiffness per area [Pa/m]; g: gap [m], the body's motion since contact began less the wall's; n: into the
body. The gap is a state of the particle, so that a load at rest sinks in once, by pressure / k, and does not
creep. A particle in space forgets its gap when the nodes with mass carry less than half of its basis: the
body has left. N [N] is the normal force of the last step. With that of the same step the tangent would not be
symmetric and f would have no potential: Newton's method then cycles between sticking and sliding (measured on
blocks on a slope). With the lag of one step, also when the body separates, the impulse of friction is still
mu times that of the normal force.

In time, f at the end of the step follows from the gap half a step ahead, g + v dt / 2. Without that lead
Newmark's average acceleration turns a stiff spring into v_new = -v, for ever; with it, the normal force of a
sliding block scatters a third as much (measured), and a hit loses the energy of the nodes that touch, as at
held grid nodes. What rests or slides does no work on the lead. A load step without inertia takes no time: its
force follows from the gap at its end.
"""
from typing import NamedTuple

import numpy as np

AHEAD = 0.5  # steps
LEAD = 1.0 + 2.0 * AHEAD  # change of the gap ahead per displacement over the step; without inertia it is 1
# along the wall, SLIDE plus 0 to 5 for its direction; CLOSED is added
FREE, STICK, SLIDE, CLOSED = 0, 1, 2, 8
D, K = 2, 4  # fixed by specialise


class Springs(NamedTuple):
    """What n particles have of their springs over one step: ``base`` (n, D), the gap ahead without motion
    over the step [m]; ``normal`` (n, D), into the body; ``stiffness`` (n,), k A [N/m]; ``limit`` (n,), mu N /
    (k A) [m]; ``separates`` (n,); ``lead``, change of the gap ahead per displacement over the step. Without a
    normal (zero) and limit all motion is held."""

    base: np.ndarray
    normal: np.ndarray
    stiffness: np.ndarray
    limit: np.ndarray
    separates: np.ndarray
    lead: float = LEAD


class Answer(NamedTuple):
    """What n springs do at a displacement: ``gap`` ahead (n, D) [m], ``force`` (n, D) on the body [N],
    ``status`` (n,)."""

    gap: np.ndarray
    force: np.ndarray
    status: np.ndarray


def weigh(cell, cells, heavy, N, share):
    """Share of the basis values N, shape (n, K), on ``heavy`` nodes, into share (n,); scales N to them (as
    eq. 14)."""
    for p in range(len(cell)):
        share[p] = 0.0
        for q in range(K):
            if not heavy[cells[cell[p], q]]:
                N[p, q] = 0.0
            share[p] += N[p, q]
        if share[p] > 0.0:
            for q in range(K):
                N[p, q] /= share[p]


def respond(cell, cells, N, u, springs: Springs, answer: Answer):
    """Fill ``answer``: gap ahead = base + lead u, force and status of each particle.

    cell (n,) of the particles; cells (m, K) nodes; N (n, K) basis values; u (nodes, D) displacement over the
    step [m].
    """
    base, normal, stiffness, limit, separates, lead = springs
    gap, force, status = answer
    for p in range(len(cell)):
        along = 0.0
        for i in range(D):
            g = base[p, i]
            for q in range(K):
                g += lead * N[p, q] * u[cells[cell[p], q], i]
            gap[p, i] = g
            along += g * normal[p, i]
        slip = 0.0
        axis = 0
        largest = 0.0
        for i in range(D):
            t = gap[p, i] - along * normal[p, i]
            slip += t * t
            if abs(t) > abs(largest):
                axis, largest = i, t
        slip = np.sqrt(slip)
        kept = limit[p] / slip if slip > 0.0 else 0.0
        if slip < limit[p]:
            status[p], kept = STICK, 1.0
        elif limit[p] > 0.0:
            status[p] = SLIDE + 2 * axis + (1 if largest > 0.0 else 0)
        else:
            status[p] = FREE
        pushed = 0.0
        if along < 0.0 or not separates[p]:
            status[p] += CLOSED
            pushed = along
        for i in range(D):
            force[p, i] = -stiffness[p] * (pushed * normal[p, i] + kept * (gap[p, i] - along * normal[p, i]))


def spring_matrix(gap, normal, limit, status, C):
    """C = -(df/dg) / (k A), shape (D, D), of one particle."""
    along = 0.0
    for i in range(D):
        along += gap[i] * normal[i]
    slip = 0.0
    for i in range(D):
        t = gap[i] - along * normal[i]
        slip += t * t
    slip = np.sqrt(slip)
    kind = status % CLOSED
    for i in range(D):
        for j in range(D):
            nn = normal[i] * normal[j]
            one = 1.0 if i == j else 0.0
            C[i, j] = nn if status >= CLOSED else 0.0
            if kind == STICK:
                C[i, j] += one - nn
            elif kind >= SLIDE:
                s = (gap[i] - along * normal[i]) / slip
                r = (gap[j] - along * normal[j]) / slip
                C[i, j] += limit / slip * (one - nn - s * r)


def tangent(cell, row, N, springs: Springs, answer: Answer, Ke):
    """Add -df/du to the element matrices Ke [N/m], see ``weakform.tangent``, at the ``answer`` of
    ``respond``."""
    normal, stiffness, limit, lead = springs.normal, springs.stiffness, springs.limit, springs.lead
    gap, status = answer.gap, answer.status
    C = np.empty((D, D))
    for p in range(len(cell)):
        c = row[cell[p]]
        spring_matrix(gap[p], normal[p], limit[p], status[p], C)
        for b in range(K):
            w = lead * stiffness[p] * N[p, b]
            for j in range(D):
                for i in range(D):
                    s = w * C[i, j]
                    for a in range(K):
                        Ke[c, b, j, i, a] += N[p, a] * s


class Spent(NamedTuple):
    """What springs have done in a step [J]: work of the ``walls`` on the body, what ``friction`` and ``hits``
    have taken, what is ``stored`` more than before; and by how much the work of the forces at the end of the
    step is more than that of their mean, ``uneven``."""

    walls: float
    friction: float
    hits: float
    stored: float
    uneven: float


NOTHING_SPENT = Spent(0.0, 0.0, 0.0, 0.0, 0.0)


def spend(springs: Springs, before, after, moved, wall=0.0, smooth=False):
    """What is ``Spent`` in a step by forces from ``before`` to ``after`` [N] while the body has moved by
    ``moved`` against the wall, and that by ``wall`` [m], all (n, D); smooth: springs without friction, (n,).
    Of what is done on the springs and not stored friction takes what is done along the wall, hits the rest:
    by the lead of the force, and where a body goes round an edge, as what has pushed on one face then is
    along another."""
    mean, stiffness = 0.5 * (before + after), springs.stiffness
    rubs = springs.normal.any(axis=1) & ~np.broadcast_to(smooth, len(mean))
    kept = np.sum(after**2 - before**2, axis=1) / (2.0 * stiffness)
    lost = -np.sum(mean * moved, axis=1) - kept
    along = [f - np.sum(f * springs.normal, axis=1)[:, None] * springs.normal for f in (before, after, mean)]
    stored = np.sum(along[1] ** 2 - along[0] ** 2, axis=1) / (2.0 * stiffness)
    rubbed = np.sum((-np.sum(along[2] * moved, axis=1) - stored)[rubs])
    uneven = 0.5 * np.sum((after - before) * (moved + wall))
    return Spent(np.sum(mean * wall), rubbed, np.sum(lost) - rubbed, np.sum(kept), uneven)
