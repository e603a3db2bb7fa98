"""Contact of walls with the surface of a body: of its material points, not of the nodes that they share.

A wall that holds nodes stops a body as soon as it shares one with it, up to a cell away, over all the width
of the cells. Here each material point is as thick as its share of the body: half-widths l along the axes, by
which the outermost ones are from its surface, make an ellipsoid (in a square or cube a ball, so that it does
not matter how the body turns). Toward a wall with normal n it reaches by

    r = |(l_i n_i)|,        gap g_n = n . (x - x_wall) - r,

to its foot x - r n. A spring between foot and wall, as in ``springs``, pushes where g_n < 0 and rubs. The
nodes of the point's own stencil take part in it with the basis at the foot,

    N_foot = N - r n . grad N,

which moves the foot exactly with every linear field. So forces go to the nodes with their momentum and, about
any axis, their moment as at the foot; they need no cell, no node and no rank besides those of the point. They
do the work that the gaps tell, as r deforms while the point is pressed, see ``feet.deform``. (If r stayed as
it is, N would tell the gap across the wall. Part of the normal force would go past the lowest cell, 25 % of
it at two points per direction, and soil there shear at that much less friction than it has; measured. Bird
et al. 2024, arXiv 2412.01565, measure the gap at the boundary of the points' domains, too. Domains that
follow all of F are of no use in soil: there F is mostly flow, and points that it stretches were thrown from
the floor.) A wall with xi resists slip by rho g v^2 / xi per area besides mu N (Voellmy 1955; S of Christen,
Kowalski & Bartelt 2010, doi 10.1016/j.coldregions.2010.04.005).
"""
import numpy as np

from mpm_dem_direct import direct

from ..compiled import specialise
from ..points.points import surface_distances, surface_shares
from .creases import Creases
from .feet import Feet, FootBasis, ThickPoints, deform, finder, follow, foot_basis, spread, tangent
from .flanks import Slots
from .foot_memory import FootMemory
from .penalty import STICKS
from .springs import AHEAD, CLOSED, LEAD, STICK, Answer, Springs, respond, spend, spring_matrix
from .wall_surfaces import WallSurfaces, places

NEAR = 1.0  # cells between a wall and the points that a step looks at


class SurfaceContact:
    """Contact of one body with the ``surfaces`` of walls, see ``wall_surfaces.Surface``, as a term of a step
    (see ``grid_state``). Each material point keeps, per wall, its side, and per slot for a foot there, of
    which walls with creases have several (see ``flanks``), force [N], gap along the wall and change of its
    reach [m], status in the tangent in use, and element (-1: none); ``half``, ``sunk``: ``feet.ThickPoints``.

    body: its term; stiffness: of each wall per area [Pa/m], shape (walls,); gravity [m/s^2]."""

    follows, points, kinks = False, None, True
    _sticks = False  # friction in the step to come holds whatever comes

    def __init__(self, body, surfaces, stiffness, background, gravity=0.0):
        self.penalties = [surface.record for surface in surfaces]
        self.names, self._body, self._dim = [s.name for s in surfaces], body, background.dim
        self._h = background.h.max()
        self._walls = [WallSurfaces([surface], self._h, 2.0 * NEAR * self._h, background.grid.box,
                                    [body.points.x]) for surface in surfaces]
        self.moves = any(wall.moves for wall in self._walls)
        self._creases = [Creases(wall) for wall in self._walls]
        most = [creases.most for creases in self._creases]
        self._slots = np.concatenate([[0], np.cumsum(most)])  # the first of each wall
        wall = np.repeat(np.arange(len(surfaces)), most)  # of each slot
        p, n, W, M, D = body.points, len(body.points), len(surfaces), len(wall), self._dim
        self._memory = memory = FootMemory(p, surfaces, wall)
        self.cell_names, self.stored = memory.cell_names, memory.stored
        self.held, self.reaction = memory.held, memory.reaction
        area, self._stiffness = surface_shares(p.V0, body.thickness, D), stiffness
        p.add(half=surface_distances(body.body, p.V0, background.basis.smooth, body.part), sunk=np.zeros(n),
              wall_stiffness=area[:, None] * stiffness,
              wall_side=np.zeros((n, W), np.int8), wall_status=np.zeros((n, M), np.int8),
              wall_force=np.zeros((n, M, D)), wall_gap=np.zeros((n, M, D)), wall_deformed=np.zeros((n, M)),
              wall_foot=np.zeros((n, M, D)), wall_element=np.full((n, M), -1, np.int32))
        self._friction, self._xi = zip(*((surface.friction, surface.xi) for surface in surfaces))
        self._gravity, self._drags = gravity, any(np.isfinite(xi).any() for xi in self._xi)
        self._compile(background)
        found, _ = self._find_feet()
        np.maximum.at(p.sunk, found.point, -found.gap)

    def enter(self, body, chosen, gravity):
        """The points ``chosen`` of a ``body`` are new: they get springs like the others."""
        if body is self._body:
            area = surface_shares(body.points.V0[chosen], body.thickness, self._dim)
            body.points.wall_stiffness[chosen] = area[:, None] * self._stiffness

    def _compile(self, background):
        smooth, D = background.basis.smooth, self._dim
        size = dict(D=D, K=background.basis.nodes(D, background.cells.shape[1]))
        self._find = [direct(finder(D, creases.most)) for creases in self._creases]
        self._foot_basis, self._follow, self._spread = (
            direct(specialise(kernel, **size)) for kernel in (foot_basis, follow, spread))
        self._tangent = direct(specialise(tangent, **size, SMOOTH=smooth,
                                          spring_matrix=specialise(spring_matrix, D=D)))
        self._respond = direct(specialise(respond, D=D, K=1))

    def _find_feet(self):
        """``Feet`` of all walls, and the wall of each."""
        p, parts = self._body.points, []
        points = ThickPoints(p.x, p.half, p.sunk)
        for w, (wall, creases, first) in enumerate(zip(self._walls, self._creases, self._slots)):
            if wall.follow([p.x]):
                creases.place()
            kept = slice(first, first + (creases.most if creases.most > 1 else 0))
            slots = Slots(wall.among(p.wall_element[:, kept]), creases.turns)
            feet, side = Feet.room(len(p) * creases.most, self._dim), p.wall_side[:, w].copy()
            reach = wall.far, NEAR * self._h
            count = self._find[w](points, wall.tree, wall.walls, reach, side, slots, feet)
            p.wall_side[:, w] = side
            feet.slot[:count] += first
            feet.element[:count] = wall.number[feet.element[:count]]
            parts.append(Feet(*(values[:count] for values in feet)))
        number = np.repeat(np.arange(len(parts)), [len(part.point) for part in parts])
        return Feet(*(np.concatenate(values) for values in zip(*parts))), number

    # ---------------------------------------------------------------- one step, see ``grid_state``

    def locate(self, grid):
        """Nothing: the points are in their elements. Returns -1, as no point can lose its body."""
        return -1

    def expect(self, growth):
        """See ``penalty.Penalties.expect``."""
        self._sticks = growth is None
        self._body.points.wall_force *= growth or 0.0

    def begin(self, grid, load):
        """Gaps and velocities of the feet at the start of the step, and what the walls will do in it. There
        is no load."""
        body, p = self._body, self._body.points
        if self.moves:
            for wall, creases in zip(self._walls, self._creases):
                if wall.place(grid.time):
                    creases.place()
        feet, number = self._find_feet()
        self._index, normal = (feet.point, feet.slot), feet.normal
        at = [feet.element[number == w] for w in range(len(self._walls))]
        self._arm = -feet.reach[:, None] * normal
        self._element = feet.element
        element, nodes = np.ascontiguousarray(body._element[feet.point]), body._elements.nodes
        shape = len(element), nodes.shape[1]
        self._basis = FootBasis(element, nodes, np.empty(shape), np.empty(shape), normal)
        self._some_left = self._memory.keep(*self._index)
        rub, force = p.wall_gap[self._index], p.wall_force[self._index]
        pressed = np.sum(force * normal, axis=1)
        self._deformed, deforming = deform(feet, p.wall_deformed[self._index], pressed > 0.0)
        self._foot_basis(feet, deforming, body._N, body._G, self._basis.across, self._basis.along)
        self._slip = rub - np.sum(rub * normal, axis=1)[:, None] * normal
        base = feet.gap[:, None] * normal + self._slip
        self._follow(self._basis, -AHEAD * grid.dt, grid.v, base)
        self._wall_moved = 0.0
        if self.moves:
            before, half, now = (
                places(self._walls, feet, number, grid.time + k * grid.dt) for k in (0.0, 0.5, 1.0))
            self._wall_moved = now - before
            self._slip -= self._wall_moved
            base -= now - before + AHEAD * (before - 4.0 * half + 3.0 * now)  # dt times its last velocity
        stiffness = p.wall_stiffness[feet.point, number]
        pressed, self._sticks = (np.full_like(pressed, STICKS) if self._sticks else pressed), False
        rough = np.concatenate([friction[e] for friction, e in zip(self._friction, at)])
        limit, self._smooth = np.where(pressed > 0.0, rough, 0.0), rough == 0.0
        rubs = np.isfinite(limit)
        limit[rubs] *= pressed[rubs] / stiffness[rubs]
        if self._drags:
            drag = self._drag(grid, feet, np.concatenate([xi[e] for xi, e in zip(self._xi, at)]))
            limit, self._smooth = limit + (pressed > 0.0) * drag / stiffness, self._smooth & (drag == 0.0)
        self._springs = Springs(base, normal, stiffness, limit, np.ones(len(limit), bool),
                                LEAD if grid.dt > 0.0 else 1.0)
        self._answer = Answer(np.empty_like(base), np.zeros_like(base), np.empty(len(limit), np.int8))

    def _drag(self, grid, feet, xi):
        """rho g v^2 / xi on each point's share of area [N], by its velocity along the wall at the start."""
        v = np.zeros((len(xi), self._dim))
        self._follow(self._basis, 1.0, grid.v, v)
        v -= self._wall_moved / grid.dt if self.moves and grid.dt > 0.0 else 0.0
        square = np.maximum(np.sum(v**2, axis=1) - np.sum(v * feet.normal, axis=1) ** 2, 0.0)
        area = surface_shares(self._body.points.V0[feet.point], self._body.thickness, self._dim)
        return self._body.body.rho * self._gravity * area * square / xi

    def first_trial(self, grid, increment):
        """Gap, force and status of the springs at the increment, an ``Answer``."""
        springs, n = self._springs, len(self._springs.base)
        ahead = springs.base.copy()
        self._follow(self._basis, springs.lead, increment.u, ahead)
        still = np.zeros((n, 1)), np.zeros((1, self._dim))  # all motion is in the gaps already
        self._respond(np.zeros(n, np.int32), np.zeros((1, 1), np.int32), *still,
                      springs._replace(base=ahead), self._answer)
        return self._answer

    def residual(self, grid, increment, R):
        """Subtract the forces [N] from R, shape (nodes, D). Returns the ``Answer`` of the springs."""
        answer = self.first_trial(grid, increment)
        self.spread(grid, answer, R)
        return answer

    def spread(self, grid, answer, R):
        """Subtract the forces of the ``answer`` [N] from R, shape (nodes, D)."""
        self._spread(self._basis, answer.force, R)

    def switched(self, answer):
        """Whether a point of this rank sticks, slides or has separated otherwise than in the tangent."""
        kept = self._body.points.wall_status[self._index]
        return self._some_left or not np.array_equal(answer.status, kept)

    def tangent(self, grid, answer):
        """Add the springs to the matrix."""
        self._body.points.wall_status[self._index], self._some_left = answer.status, False
        grid.active_cells.add_for_points(self._basis.element, lambda row, matrices: self._tangent(
            self._basis, row, self._springs, answer, matrices))

    def finish(self, grid, answer, increment):
        """Keep the forces, and the gaps along the walls; the others follow from where the points are."""
        p, (_, force, status), springs = self._body.points, answer, self._springs
        moved = np.zeros_like(force)
        self._follow(self._basis, 1.0, increment.u, moved)
        of_point = self._body.interpolate(self._index[0], increment.u)[0]
        p.wall_deformed[self._index] = self._deformed + np.sum((of_point - moved) * springs.normal, axis=1)
        wall = self._wall_moved
        self.spent = spend(springs, p.wall_force[self._index], force, moved - wall, wall, self._smooth)
        moved += self._slip
        gap = np.where(status[:, None] % CLOSED == STICK, moved, -force / springs.stiffness[:, None])
        p.wall_gap[self._index] = gap - np.sum(gap * springs.normal, axis=1)[:, None] * springs.normal
        p.wall_force[self._index] = force
        p.wall_foot[self._index], p.wall_element[self._index] = self._arm, self._element

    def move(self, time):
        """Nothing: the walls are placed at the start of a step."""
