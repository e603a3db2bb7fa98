"""The bodies of a scene as parts of the partition: each with points, kernels of its law and work arrays of its own."""
import warnings

import numpy as np

import mpm_dem_checks as check

from ..points.points import Points, seed
from ..scene.geostatic import put_stress
from . import newmark
from .fields import Deformation, Elements, Patches, Quadrature
from .kernels import compile_body_kernels


class Part:
    """One body: ``body``, ``points`` (its material points, at first all of them on every rank), and after ``attach``
    the ``basis`` values at the points, shape (n, K).

    first: number of its first point; gravity: [m/s^2], shape (D,); body_force: None, or a function as of ``MPM``.
    """

    def __init__(self, body, first, gravity, body_force=None):
        x, volume = seed(body)
        n, dim, self.body, self._params = len(x), body.dim, body, body.law.params
        self._body_force = body_force
        self.velocity_at = lambda at: (
            check.values("velocity of the body", body.velocity, (at,), at.shape, unit="m/s")
            if callable(body.velocity) else np.array(np.broadcast_to(body.velocity, at.shape), float))
        a = np.tile(gravity, (n, 1))  # an unstressed body starts in free fall
        rest = {}
        if body_force is not None:
            a += check.values("body_force", body_force, (x, 0.0), x.shape, unit="m/s^2")
            rest["rest"] = x.copy()
        self.points = Points(
            gid=first + np.arange(n), cell=np.zeros(n, np.int32), x=x, v=self.velocity_at(x), a=a,
            mass=body.rho * volume, V0=volume,
            F=np.tile(np.eye(dim), (n, 1, 1)), F33=np.ones(n), state=np.zeros(n, body.law.state), **rest)
        if body.stress is not None:
            put_stress(self.points, body.law, check.values("stress of the body", body.stress, (x,), (n, 3), unit="Pa"))

    def compile(self, background, consistent):
        """Kernels of the law on the cells of ``background``, with consistent or lumped inertia."""
        self._kernels = compile_body_kernels(self.body, background, consistent)

    def attach(self, active_cells):
        """Work arrays on the active cells; needed whenever these or the number of points on this rank change."""
        n, K, (patches, M, D) = len(self.points), active_cells.cells.shape[1], active_cells.patch_matrices.shape[:3]
        self._patches = Patches(np.zeros((patches, 2)), np.zeros((patches, M, D)), np.zeros((patches, 2)),
                                *(np.zeros((patches, M, D)) for _ in range(2)))
        self._elements = Elements(active_cells.cells, active_cells.row, active_cells.patch, active_cells.place)
        self.basis, self._G = np.empty((n, K)), np.empty((n, K, D))
        self._new = Deformation(np.empty((n, D, D)), np.empty(n), self.points.state.copy())
        self._inert = self.points.mass  # with consistent inertia

    # ---------------------------------------------------------------- one step, see the kernels' modules

    def shapes(self, step):
        """Basis values and gradients at the points."""
        step.shapes(self.points.cell, self.points.x, self.basis, self._G)

    def to_grid(self, step, nodal):
        """Add the points' share to ``nodal``, see ``transfer.to_grid``."""
        p = self.points
        step.kernels.to_grid(p.cell, step.active_cells.cells, self.basis, p.mass, p.v, p.a, nodal)

    def _quadrature(self):
        p = self.points
        return Quadrature(p.cell, self.basis, self._G, self._inert, p.V0)

    def _deformation(self):
        """At the start of the step."""
        return Deformation(self.points.F, self.points.F33, self.points.state)

    @property
    def thickness(self):
        """Of a plane body [m], 1 in space."""
        return self.body.thickness if self.body.dim == 2 else 1.0

    def hold(self, step, held, nodal):
        """Give points in cells with ``held``, a mask over the grid's cells, consistent inertia and add the mass of the
        others to ``nodal``, shape (nodes, 1)."""
        p, consistent = self.points, held[self.points.cell]
        self._inert = np.where(consistent, p.mass, 0.0)
        if not consistent.all():
            step.kernels.spread_mass(p.cell, step.active_cells.cells, self.basis, (p.mass - self._inert)[:, None], nodal)

    @property
    def pushed(self):
        """Whether there is a body force."""
        return self._body_force is not None

    def push(self, step, time, load):
        """Add the body force at ``time`` [s] to ``load`` [N], shape (nodes, D)."""
        p = self.points
        force = p.mass[:, None] * np.asarray(self._body_force(p.rest, time), float)
        step.kernels.spread(p.cell, step.active_cells.cells, self.basis, force, load)

    def _mean_changes(self, points, old, u):
        """F-bar's means over the patches at the displacement u, see ``f_bar.mean_changes``."""
        for sums in (self._patches.volume, self._patches.gradient, self._patches.bulk):
            sums[:] = 0.0
        self._kernels.mean_changes(points, self._elements, old, u, self._patches)

    def residual(self, step, u, a, R):
        """Add inner and, with consistent inertia, inertia forces to R, see ``weakform.residual``; keeps u and a for the
        tangent."""
        points, old = self._quadrature(), self._deformation()
        self._increment = newmark.Increment(step.dt, newmark.alpha(step.dt), u, a)
        if self.body.f_bar:
            self._mean_changes(points, old, u)
        self._kernels.residual(points, self._elements, old, self._new, self._patches, self._params, self._increment, R)
        if self.body.f_bar:
            self._kernels.add_pressure(step.active_cells.nodes_of_patch, self._patches, R)

    def rest(self, step):
        """Before a tangent at the start of the step, without a residual."""
        nothing = np.zeros_like(step.v)
        self._increment = newmark.Increment(step.dt, newmark.alpha(step.dt), nothing, nothing)
        self._new.F[:], self._new.F33[:] = self.points.F, self.points.F33
        if self.body.f_bar:  # its tangent needs the mean pressure
            self.residual(step, nothing, nothing, np.empty_like(step.v))

    def tangent(self, step):
        """Add to the matrices of the active cells, see ``weakform.tangent`` and ``f_bar.couple``."""
        patches, active_cells = self._patches, step.active_cells
        patches.bulk[:, 1], patches.push[:], patches.pull[:] = 0.0, 0.0, 0.0
        self._kernels.tangent(self._quadrature(), self._elements, self._deformation(), self._new, patches, self._params,
                              self._increment, active_cells.element_matrices)
        if self.body.f_bar:
            self._kernels.couple(patches, active_cells.patch_matrices)

    def finish(self, step, u, a):
        """Move the points; deformation and state of the last residual become theirs."""
        p, increment = self.points, newmark.Increment(step.dt, newmark.alpha(step.dt), u, a)
        step.kernels.to_points(p.cell, step.active_cells.cells, self.basis, increment, p.x, p.v, p.a)
        old = self._deformation()
        p.F, p.F33, p.state = self._new
        self._new = old

    # ---------------------------------------------------------------- what others ask

    def energies(self, gravity, chosen=slice(None)):
        """Kinetic, strain and potential energy of this rank's points [J], or of the ``chosen``, in ``gravity`` [m/s^2],
        shape (D,)."""
        p = self.points
        mass, V0, v, *now = (values[chosen] for values in (p.mass, p.V0, p.v, *self._deformation()))
        return (*self._kernels.energies(mass, V0, v, Deformation(*now), self._params), -mass @ (p.x[chosen] @ gravity))

    def volume(self):
        """Of this rank's points as deformed [m^3], shape (n,)."""
        p, F = self.points, self.points.F
        if self.body.dim == 2:  # an order of magnitude faster than numpy.linalg.det
            return p.V0 * p.F33 * (F[:, 0, 0] * F[:, 1, 1] - F[:, 0, 1] * F[:, 1, 0])
        return p.V0 * np.einsum("pi,pi->p", F[:, 0], np.cross(F[:, 1], F[:, 2]))

    def cauchy_stress(self):
        """Of this rank's points [Pa], shape (n, D, D)."""
        sigma = np.empty_like(self.points.F)
        self._kernels.cauchy(self._deformation(), self._params, sigma)
        return sigma


def make_parts(bodies, grid, gravity, body_force):
    """Parts of the ``bodies``, numbered through; ValueError when they do not fit each other or the grid."""
    if not bodies:
        raise ValueError("there is no body: give at least one")
    for number, body in enumerate(bodies):
        if body.dim != grid.box.dim:
            raise ValueError(f"body {number} has {body.dim} dimensions, the grid {grid.box.dim}: give both the same")
        if body.dim == 2 and body.thickness != bodies[0].thickness:
            raise ValueError(f"body {number} is {body.thickness} m thick, body 0 {bodies[0].thickness} m: bodies in "
                             "one plane grid have the same thickness")
    parts, count = [], 0
    for body in bodies:
        parts.append(Part(body, count, gravity, body_force))
        count += len(parts[-1].points)
    return parts


class Start:
    """Bodies at the start as functions of places x [m], shape (n, D), as of boundary particles: a place belongs to the
    body with the nearest material point. thickness: of a plane scene [m], 1 in space. To be made of parts that still
    have all their points."""

    def __init__(self, parts, gravity, body_force):
        self.parts, self._gravity, self._body_force = parts, gravity, body_force
        self.thickness = parts[0].body.thickness if parts[0].body.dim == 2 else 1.0
        if len(parts) > 1:
            from scipy.spatial import cKDTree  # takes time to import, and few scenes need it

            self._tree = cKDTree(np.concatenate([part.points.x for part in parts]))
            self._owner = np.repeat(np.arange(len(parts)), [len(part.points) for part in parts])

    def body(self, x):
        """Number of the body of each place, shape (n,)."""
        if len(self.parts) == 1 or not len(x):
            return np.zeros(len(x), int)
        return self._owner[self._tree.query(x)[1]]

    def velocity(self, x):
        """[m/s], shape (n, D)."""
        v, body = np.zeros(x.shape), self.body(x)
        for number, part in enumerate(self.parts):
            v[body == number] = part.velocity_at(x[body == number])
        return v

    def acceleration(self, x):
        """Of an unstressed body [m/s^2], shape (n, D)."""
        return self._gravity + (np.zeros(x.shape) if self._body_force is None else self._body_force(x, 0.0))

    def modulus(self, x, of_law):
        """``of_law(law, dim)`` of the law at each place, shape (n,)."""
        values = np.array([of_law(part.body.law, part.body.dim) for part in self.parts])
        return values[self.body(x)]


def warn_if_in_pieces(parts, background):
    """One warning for each body whose points are too far apart for the grid to hold it together. Collective."""
    for n, part in enumerate(parts):
        groups = background.groups(np.unique(part.points.cell))
        if groups > 1:
            warnings.warn(f"the material points of body {n + 1} lie in {groups} groups of cells without common nodes, and "
                          "nothing holds these together: seed more points, or take a coarser grid", stacklevel=3)
