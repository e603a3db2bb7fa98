"""The bodies of a scene as terms of the equations: each with points, kernels of its law and work arrays of
its own."""
from typing import NamedTuple

import numpy as np

import mpm_dem_checks as check

from ..basis.smooth import LINEAR
from ..collective import WHOLE
from ..laws.reference import renewal
from ..points.order import put_in_order
from ..points.points import Points, half_widths, numbers, seed
from ..scene.geostatic import put_stress
from .body_readings import BodyReadings
from .fields import Deformation, Patches, Quadrature
from .kernels import compile_body_kernels, compile_point_kernels
from .newmark import Increment
from .stress_work import Stresses, make_stress_work


class BodyTrial(NamedTuple):
    """What the residual of a body has computed at an ``increment``: the ``new`` deformation and state of its
    points, and the sums over F-bar's ``patches``."""

    increment: Increment
    new: Deformation
    patches: Patches


class BodyTerm(BodyReadings):
    """One body as a term of a step, see ``grid_state``: its ``body`` record and ``points``, the material
    points on this rank, whose deformation is the state of the term. At first they are its ``part`` of all, in
    the order of their numbers, of which the body has ``total``, from ``first`` on.

    gravity: [m/s^2], shape (D,); body_force: None, or a function as of
    ``MPM``; basis: a ``smooth.Basis`` on cells of size h [m], shape (D,). ``booked``: each step leaves its
    ``stress_work`` in ``worked``."""

    booked, worked = False, (0.0, 0.0)

    def __init__(self, body, first, gravity, body_force=None, basis=LINEAR, h=None, *, part=WHOLE):
        x, volume = seed(body, basis.smooth, part)
        n, dim, self.body, self._params = len(x), body.dim, body, body.law.params
        self._body_force, self.first, self.part = body_force, first, part
        self.total, own = numbers(body, part)
        a = np.tile(gravity, (n, 1))  # an unstressed body starts in free fall
        start = {}
        if body_force is not None:
            if n:
                a += check.values("body_force", body_force, (x, 0.0), x.shape, unit="m/s^2")
            start["x0"] = x.copy()
        if basis.smooth:
            start["domain"] = basis.domain(half_widths(body, volume, part), h)
        self.points = Points(
            gid=first + np.arange(own.start, own.stop), cell=np.zeros(n, np.int32), x=x,
            v=self.velocity_at(x), a=a, mass=body.rho * volume, V0=volume,
            F=np.tile(np.eye(dim), (n, 1, 1)), F33=np.ones(n), state=np.zeros(n, body.law.state), **start)
        if body.stress is not None and n:
            put_stress(self.points, body.law, body.stress)

    def velocity_at(self, at):
        """Velocity at the start at places [m/s], shape (n, D) both."""
        velocity = self.body.velocity
        if callable(velocity) and len(at):
            return check.values("velocity of the body", velocity, (at,), at.shape, unit="m/s")
        return np.array(np.broadcast_to(0.0 if callable(velocity) else velocity, at.shape), float)

    def compile(self, background, consistent):
        """Kernels of the law on the elements of ``background``, with consistent or lumped inertia."""
        self._kernels = compile_body_kernels(self.body, background, consistent)
        self._on_points, self._stress_work = compile_point_kernels(background), make_stress_work(
            self.body, background)
        follows = background.basis.follows  # domains stretch with F
        self._renew = None if follows else renewal(self.body.law, self.body.dim)

    def attach(self, active_cells):
        """Work arrays on the active cells; needed whenever these or the number of points on this rank
        change."""
        self._elements = active_cells.elements
        n, (patches, M), D = len(self.points), active_cells.nodes_of_patch.shape, active_cells.dim
        K = self._elements.nodes.shape[1]
        self._cells_are_patches = active_cells.patch_matrices is None and active_cells.node_rows is None
        of_nodes = 1 if self._cells_are_patches else patches, D, M
        self._patches = Patches(np.zeros((patches, 2)), np.zeros(of_nodes), np.zeros((patches, 2)),
                                np.zeros(of_nodes), np.zeros(of_nodes))
        own = slice(active_cells.own_patches)
        self._own_patches = active_cells.nodes_of_patch[own], Patches(*(sums[own] for sums in self._patches))
        self._N, self._G = np.empty((n, K)), np.empty((n, D, K))
        self._element, self._order = np.empty(n, np.int32), np.empty(n, np.int32)
        self._new = Deformation(np.empty((n, D, D)), np.empty(n), self.points.state.copy())
        self._consistent_mass = self.points.mass  # that of the points with consistent inertia

    def begin_motion(self, active_cells, background):
        """The points are in their cells, perhaps for the first time."""

    # ---------------------------------------------------------------- one step, see ``grid_state``

    @property
    def field(self):
        """Number of the field of the grid in which it moves."""
        return self.points.field

    @property
    def thickness(self):
        """Of a plane body [m], 1 in space."""
        return self.body.thickness if self.body.dim == 2 else 1.0

    @property
    def has_body_force(self):
        """Whether there is one."""
        return self._body_force is not None

    def locate(self, active_cells, background):
        """Elements of the points in ``active_cells``, basis values and gradients there. What has flowed far
        gets a new reference, see ``laws.reference``."""
        p, shapes = self.points, self._on_points.shapes
        if self._renew is not None:
            self._renew(p.F, p.state)
        if background.basis.smooth:
            grid = background.stencil_grid(active_cells.cells)
            shapes(p.cell, p.x, p.domain, p.F, grid, self._element, self._N, self._G)
        else:
            self._element = p.cell
            shapes(p.cell, p.x, background.maps, self._N, self._G)
        put_in_order(self._element, len(self._elements.nodes), self._order)

    def to_grid(self, nodal):
        """Add the points' share to ``nodal``, see ``transfer.to_grid``."""
        p = self.points
        self._on_points.to_grid(self._element, self._elements.nodes, self._N, p.mass, p.v, p.a, nodal)

    def lump(self, grid, cells, nodes, nodal):
        """Points in ``cells``, a mask over the grid's cells, and those that reach ``nodes``, a mask (nodes,),
        have no consistent inertia in this step: their mass [kg] is added to ``nodal``, shape (nodes, 1).
        Either may be None."""
        p, element, stencil = self.points, self._element, self._elements.nodes
        here = np.zeros(len(p), bool) if cells is None else cells[p.cell]
        if nodes is not None:
            self._on_points.reaches(element, stencil, self._N, nodes, here)
        self._consistent_mass = np.where(here, 0.0, p.mass)
        if here.any():
            lumped = (p.mass - self._consistent_mass)[:, None]
            self._on_points.spread_mass(element, stencil, self._N, lumped, nodal)

    def begin(self, grid, load):
        """Add the body force at the end of the step to ``load`` [N], shape (nodes, D)."""
        p = self.points
        force = p.mass[:, None] * np.asarray(self._body_force(p.x0, grid.time + grid.dt), float)
        self._on_points.spread(self._element, self._elements.nodes, self._N, force, load)

    def spread(self, at, force, nodal):
        """Add forces on the points ``at``, numbers, [N], shape (n, D), to ``nodal``, shape (nodes, D)."""
        self._on_points.spread(self._element[at], self._elements.nodes, self._N[at], force, nodal)

    def add_mass_by(self, column, nodal):
        """Add the mass of the points [kg] to the nodes, of each in its ``column``, shape (n,), of ``nodal``,
        (nodes, columns)."""
        at = self._elements.nodes[self._element] * nodal.shape[1] + column[:, None]
        mass = self._N * self.points.mass[:, None]
        nodal += np.bincount(at.ravel(), mass.ravel(), nodal.size).reshape(nodal.shape)

    def interpolate(self, at, nodal):
        """Of a field with ``nodal`` values, shape (nodes, D), what it is at the points ``at``, numbers, (n,
        D), and the sum of their basis, (n,)."""
        values, N = np.zeros((len(at), nodal.shape[1])), self._N[at]
        self._on_points.interpolate(self._element[at], self._elements.nodes, N, nodal, values)
        return values, N.sum(axis=1)

    def accelerate(self, grid, jump):
        """The points' share in a ``jump`` of the nodes' acceleration [m/s^2], shape (nodes, D)."""
        self._on_points.interpolate(self._element, self._elements.nodes, self._N, jump, self.points.a)

    def _quadrature(self):
        p = self.points
        return Quadrature(self._element, self._N, self._G, self._consistent_mass, p.V0, self._order)

    def _stiffness_points(self, increment):
        """Points as quadrature of the tangent in a step."""
        return self._quadrature()

    def _deformation(self):
        """At the start of the step."""
        return Deformation(self.points.F, self.points.F33, self.points.state)

    def residual(self, grid, increment, R):
        """Add inner and, with consistent inertia, inertia forces to R, see ``weakform.residual``."""
        points, old, patches = self._quadrature(), self._deformation(), self._patches
        if self.body.f_bar:
            patches.volume[:], patches.gradient[:], patches.bulk[:] = 0.0, 0.0, 0.0
            if not self._cells_are_patches:
                self._kernels.mean_changes(points, self._elements, old, increment.u, patches)
                grid.active_cells.share(patches.volume, patches.gradient)
        self._kernels.residual(points, self._elements, old, self._new, patches, self._params, increment, R)
        if self.body.f_bar and not self._cells_are_patches:
            grid.active_cells.share(patches.bulk[:, :1])
            self._kernels.add_pressure(*self._own_patches, R)
        return BodyTrial(increment, self._new, patches)

    def first_trial(self, grid, increment):
        """For a tangent before the first residual: deformed as at the start of the step."""
        nothing = np.zeros_like(grid.v)
        still = increment._replace(u=nothing, a=nothing)
        if self.body.f_bar:  # its tangent needs the mean pressure
            return self.residual(grid, still, np.empty_like(grid.v))
        self._new.F[:], self._new.F33[:] = self.points.F, self.points.F33
        return BodyTrial(still, self._new, self._patches)

    def tangent(self, grid, trial):
        """Add to the matrix of the active cells, see ``weakform.tangent`` and ``f_bar.couple``."""
        increment, new, patches = trial
        patches.bulk[:, 1], patches.push[:], patches.pull[:] = 0.0, 0.0, 0.0
        points, cells = self._stiffness_points(increment), grid.active_cells
        self._kernels.tangent(points, self._elements, self._deformation(), new, patches, self._params,
                              increment, cells.node_rows if grid.smooth else cells.rows)
        matrices = cells.node_rows if grid.smooth else cells.patch_matrices
        if self.body.f_bar and matrices is not None:
            cells.share(patches.bulk[:, 1:], patches.push, patches.pull)
            self._kernels.couple(*self._own_patches, matrices)

    def stress_work(self, grid, trial):
        """Work of the stresses before and after the step of a ``trial``, see ``stress_work``: this rank's
        share. Collective."""
        old = self._deformation()
        return self._stress_work(grid.active_cells, self._quadrature(), self._elements, old,
                                 Stresses(self._kirchhoff(old), self._kirchhoff(trial.new)), trial)

    def finish(self, grid, trial, increment):
        """Move the points; deformation and state of the ``trial`` become theirs."""
        p, old = self.points, self._deformation()
        if self.booked:
            self.worked = self.stress_work(grid, trial)
        self._on_points.to_points(self._element, self._elements.nodes, self._N, increment, p.x, p.v, p.a)
        p.F, p.F33, p.state = trial.new
        self._new = old  # arrays for the next trial
