"""Bodies whose velocity varies around their points (APIC, TPIC), moved by the midpoint rule."""
import numpy as np

from ..compiled import specialise
from ..laws import ELASTIC_STATE
from ..points import affine, transfer
from ..points.moments import skew
from . import midpoint
from .bodies import BodyTerm, BodyTrial

APART = 0.25  # of a point's size: how far to both sides of it the initial velocity is looked at


class AffineBody(BodyTerm):
    """A ``BodyTerm`` whose points have a velocity gradient ``C`` [1/s] and an affine moment ``B`` [m^2/s],
    shape (n, D, D), see ``affine``, with the residual of the middle of a step, see ``midpoint``.

    apic: transfers by B, else (TPIC) by C.
    """

    def __init__(self, *arguments, apic, **part):
        super().__init__(*arguments, **part)
        self._apic, self._begun = apic, False
        self.points.add(C=self._gradient(), B=np.zeros_like(self.points.F))

    def _gradient(self):
        """Of the initial velocity over the size of each point [1/s], shape (n, D, D)."""
        p, dim = self.points, self.body.dim
        C = np.zeros(p.F.shape)
        if callable(self.body.velocity) and len(p):
            size = APART * (p.V0 / self.thickness) ** (1.0 / dim)
            for j, axis in enumerate(np.eye(dim)):
                aside = size[:, None] * axis
                ahead, behind = self.velocity_at(p.x + aside), self.velocity_at(p.x - aside)
                C[:, :, j] = (ahead - behind) / (2.0 * size[:, None])
        return C

    def compile(self, background, consistent):
        """Kernels as of every body; the way back to the points is another."""
        super().compile(background, consistent)
        size = dict(D=background.dim, K=background.basis.nodes(background.dim, background.cells.shape[1]))
        self._on_points = self._on_points._replace(
            to_points=specialise(transfer.to_points_midpoint, **size))
        self._start, self._deform = (specialise(kernel, **size) for kernel in (affine.start, affine.deform))
        self._add, self._take = (specialise(kernel, **size, APIC=self._apic)
                                 for kernel in (affine.to_grid, affine.to_points))

    def attach(self, active_cells):
        """Work arrays as of every body, and those for the end of a step."""
        super().attach(active_cells)
        self._places, self._half_volume = active_cells.places, 0.5 * self.points.V0
        self._end = np.zeros_like(self._places)

    def _basis(self):
        """Stencils and basis values of the points: the first arguments of the kernels of ``affine``."""
        return self._element, self._elements.nodes, self._N

    def begin_motion(self, active_cells, background):
        """Affine moments of the initial velocity, once the points are in their cells."""
        p = self.points
        if not self._begun:
            self.locate(active_cells, background)
            self._start(*self._basis(), self._places, p.x, p.C, p.B)
        self._begun = True

    # ---------------------------------------------------------------- one step, see ``grid_state``

    def to_grid(self, nodal):
        """Add the points' share to ``nodal``, see ``transfer.to_grid`` and ``affine.to_grid``."""
        super().to_grid(nodal)
        p = self.points
        self._add(*self._basis(), self._places, p.x, p.mass, p.B if self._apic else p.C, nodal)

    def begin(self, grid, load):
        """Add the body force of the middle of the step, see ``BodyTerm.begin``."""
        super().begin(grid._replace(dt=0.5 * grid.dt), load)

    def residual(self, grid, increment, R):
        """Add the forces of the middle of the step, see ``BodyTerm.residual``."""
        return super().residual(grid, midpoint.half(increment), R)

    def first_trial(self, grid, increment):
        """As of every body; its step is that to the middle."""
        trial = super().first_trial(grid, increment)
        return trial if self.body.f_bar else trial._replace(increment=midpoint.half(trial.increment))

    def _stiffness_points(self, increment):
        """Points as quadrature of the tangent: u / 2 is what deforms them, but in load steps."""
        points = self._quadrature()
        return points if increment.dt == 0.0 else points._replace(V0=self._half_volume)

    def finish(self, grid, trial, increment):
        """Deformation and state of the end of the step, which the ``trial`` of its middle does not have; the
        points move and take the nodes' velocity with its gradient, none after a load step."""
        p = self.points
        if increment.dt == 0.0:
            p.C[:], p.B[:] = 0.0, 0.0
            super().finish(grid, trial, increment)
            return
        middle = 2.0 * self.stress_work(grid, trial)[1] if self.booked else 0.0
        end = self._at_end(grid, increment)
        self._take(*self._basis(), self._G, self._places, increment, p.C, p.B)
        super().finish(grid, end, increment)
        self.worked = *self.worked[:2], middle

    def _at_end(self, grid, increment):
        """The trial of the end of the step. Of a law that remembers nothing only F is needed, but in plane
        stress the stretch across the plane, and with F-bar its means, too."""
        body, p, new = self.body, self.points, self._new
        if body.law.state != ELASTIC_STATE or body.f_bar or body.stress_state == "plane_stress":
            return super().residual(grid, increment, self._end)
        self._deform(self._element, self._elements.nodes, self._G, increment.u, p.F, new.F)
        new.F33[:] = p.F33
        return BodyTrial(increment, new, self._patches)

    # ---------------------------------------------------------------- what others ask

    def momentum(self, chosen=slice(None)):
        """As of every body, with the angular momentum of the velocity around the points."""
        p, found = self.points, super().momentum(chosen)
        found[self.body.dim:] += skew(np.tensordot(p.mass[chosen], p.B[chosen], 1))
        return found

    def energies(self, gravity, chosen=slice(None)):
        """As of every body; the kinetic energy has that of the velocity around the points, 1/2 m tr(C D_p
        C^T) = 1/2 m C : B."""
        p = self.points
        kinetic, strain, potential = super().energies(gravity, chosen)
        around = np.einsum("pij,pij->p", p.C[chosen], p.B[chosen])
        return kinetic + 0.5 * p.mass[chosen] @ around, strain, potential
