"""Newton–Raphson by PETSc SNES, options prefix ``mpm_``.

Defaults are set on the objects before ``setFromOptions``, so the command line always wins: -mpm_snes_rtol
1e-6, -mpm_snes_stol 0, -mpm_snes_max_it 25, line search bt, and a linear solver of ``solvers``.

``tangents`` decides in which iterations there is a new tangent. A step that fails is tried again, see
``rungs``."""
import numpy as np
from petsc4py import PETSc

from ..collective import somewhere
from ..errors import MPMError
from ..grid import compat
from . import divergence, options, solvers
from .linear import LinearSolver
from .options import PREFIX
from .options import unused as unused_options  # noqa: F401 - known by this name
from .rungs import RUNGS
from .searches import Searches
from .secants import Secants
from .tolerance import Tolerance
from .translations import Translations


class Newton:
    """One SNES over the active cells, for ``equations``, with tangents as the policy ``tangents`` has it.

    ``linear``: its ``LinearSolver``. It keeps the trial of the last residual with the displacement that it
    belongs to. A tangent is made of the trial at the iterate, and a solve ends with the trial at the
    solution: where the SNES has evaluated the residual elsewhere since (some line searches, trust regions,
    quasi-Newton and accelerated methods do), it is evaluated once more. Collective."""

    def __init__(self, active_cells, equations, tangents, nodes, doubt, kind, symmetric=True,
                 solver="auto"):
        """nodes: ``coarse_grids.Nodes``; doubt: ``options.Doubt``; kind: ``tolerance.Kind`` of the residual;
        symmetric: so is the tangent; solver: one of ``solvers.SOLVERS``. ValueError when that does not exist
        or does not suit the tangent."""
        solvers.check(solver, symmetric, nodes.regular)  # before there is an SNES, which would stay
        options.check()
        self._equations, self._tangents, self._doubt = equations, tangents, doubt
        self._comm, self._shape = active_cells.comm, (active_cells.owned, active_cells.dim)
        self._failure = self._trial = self._residual = self._lost = None
        self.u, r = active_cells.vector(active_cells.dim), active_cells.vector(active_cells.dim)
        self.snes = snes = PETSc.SNES().create(active_cells.comm)
        snes.setOptionsPrefix(PREFIX)
        snes.setFunction(self._function, r)
        snes.setJacobian(self.tangent_wanted, active_cells.matrix)
        snes.setTolerances(rtol=1e-6, atol=0.0, stol=0.0, max_it=25)
        compat.set_lag_jacobian(snes, tangents.lag)
        self._searches, self._tolerance = Searches(snes, bool(kind.late), kind.flows), Tolerance(kind)
        if self._searches.follows:
            snes.setUpdate(self._iterate)
        snes.getKSP().setOperators(active_cells.matrix)
        self.linear = LinearSolver(snes, equations, tangents, nodes, symmetric, solver)
        self.helped = []
        self._secants = Secants(active_cells.comm)
        self._translations = translations = Translations(active_cells.matrix, equations, kind.flows)
        secants = self._secants
        snes.setLineSearchPreCheck(lambda x, y: translations.correct(snes, y) | secants.correct(x, y))
        r.destroy()  # the SNES holds its own reference

    def full_steps_first(self):
        """Full Newton steps from the first attempt on, and a line search in that which would have them."""
        self._searches.exchange()

    def describe(self):
        """The solver in use, for the report."""
        return f"{self.snes.getType()}, {self.linear.describe()}"

    # ---------------------------------------------------------------- what the SNES asks

    def _iterate(self, snes, iteration):
        """PETSc's callback at the start of an iteration."""
        self._tolerance.loosen(snes, iteration)
        self._searches.follow(iteration)

    def _function(self, snes, u, r):
        u, out = self._read(u), r.array_w.reshape(self._shape)
        try:
            if self._is_trial(u):  # line search cp ends with one more residual where it has stopped
                out[:] = self._residual
            else:
                self._trial = self._equations.residual(u, out)
                self._residual = out.copy()
                if self._lost is None and not np.isfinite(out.sum()):
                    self._lost = self._equations.failing(self._trial)
        except Exception as error:
            self._fail(error)
            out[:] = np.nan

    def tangent_wanted(self, snes, u, A, B):
        """PETSc's callback before an iteration at u, whose matrix is B."""
        try:
            trial = self._trial_at(u)
            if self._tangents.wanted(self._equations.switched(trial), snes):
                self.make_tangent(trial)
            self._tolerance.aim(snes)
        except Exception as error:
            self._fail(error)

    def _read(self, u):
        """A copy: numba compiles every kernel anew for an array that is read-only, as a locked vector's
        is."""
        return np.array(u.array_r).reshape(self._shape)

    def _trial_at(self, u):
        """The last trial if it is that of the vector u, else a new one there."""
        u = self._read(u)
        if not self._is_trial(u):
            self._residual = np.empty(self._shape)
            self._trial = self._equations.residual(u, self._residual)
        return self._trial

    def _is_trial(self, u):
        """Whether the last trial is that of the displacement u, shape (owned, D). Collective."""
        return not somewhere(self._comm, self._trial is None or not np.array_equal(u, self._trial.u))[0]

    def make_tangent(self, trial):
        """The tangent of ``trial`` into the matrix."""
        self._tangents.made(self._equations.tangent(trial))
        self._secants.forget()
        self.linear.choose()

    def _fail(self, error):
        """Keep an error until after the solve, where PETSc's vectors are unlocked. On several ranks leave the
        solve at once: those without the error wait for this one in the middle of their residual, and no solve
        comes to its end."""
        self._failure = error
        if self._comm.size > 1:
            raise error

    # ---------------------------------------------------------------- one solve

    def solve(self, guess, rest, norms, when):
        """Solve from ``guess``, shape (owned, D); returns the trial at the solution and the number of
        iterations.

        rest: the displacement that only moves supported nodes; norms: ``tolerance.Norms``; when: a text for
        the message, such as "step 3, t = 1e-6 s". Raises MPMDivergedError with PETSc's reason in words and
        the option to try."""
        self._trial, self._lost, iterations, tried, self.helped = None, None, 0, [], []
        try:
            for rung in RUNGS:
                if rung is not RUNGS[0]:
                    if not self._go_to(rung):
                        continue
                    searches = rung.full_steps and self._searches.full_steps_first
                    tried.append("a line search" if searches else rung.news)
                start = rest if rung.from_rest else guess
                reason, more = self._run(start, norms, when)
                iterations += more
                other = self.linear.bear_any_sign() if reason in divergence.NOT_POSITIVE else ""
                if other:
                    tried.append(other)
                    self.helped = [other]
                    reason, more = self._run(start, norms, when)
                    iterations += more
                if reason >= 0:
                    break
        finally:
            self.linear.as_chosen()
            if rung is not RUNGS[0]:
                self._go_to(RUNGS[0])
        if reason < 0:
            lost = min((lost for lost in self._comm.allgather(self._lost) if lost), default=None)
            raise divergence.diverged(reason, when, iterations, tried, self.snes.getFunctionNorm(), lost)
        self._doubt(self.snes.getFunctionNorm(), norms.forces, when)
        return self._trial_at(self.u), iterations

    def _go_to(self, rung):
        """Set what the user's options have not decided; returns whether the attempt differs from the one
        before: the rung's news are not among these, nor had every iteration a new tangent anyhow."""
        self._tangents.in_every_iteration(rung.new_tangents)
        if not self._tangents.by_user:
            compat.set_lag_jacobian(self.snes, self._tangents.lag)
        self._searches.want(rung.full_steps)
        anew = self._tangents.kept_one and not self._tangents.by_user
        return {1: anew, 3: not self._searches.by_user}.get(RUNGS.index(rung), True)

    def _run(self, guess, norms, when):
        """Reason and number of iterations of one attempt."""
        self.u.array_w[:] = guess.ravel()
        self._secants.forget()
        self._translations.begin()
        self._tolerance.begin(self.snes, norms)
        self._searches.begin(self._tangents.now.stiffness_over_inertia)
        try:
            self.snes.solve(None, self.u)
        except PETSc.Error as error:
            if self._failure is None and error.ierr == divergence.ZERO_PIVOT:
                solvers.forget_failed_factor(self.snes.getKSP())
                return divergence.SINGULAR, self.snes.getIterationNumber()
            if self._failure is None:
                said = divergence.first_line(error)
                raise MPMError(f"PETSc stopped in the solver {self.describe()} ({said}): "
                               "try -mpm_pc_type lu or other options") from None
        except Exception:
            if self._failure is None:
                raise
        failure, self._failure = self._failure, None
        if failure is not None:
            raise failure
        if self.snes.getKSP().getConvergedReason() == divergence.FACTOR_FAILED:
            solvers.forget_failed_factor(self.snes.getKSP())
        return self.snes.getConvergedReason(), self.snes.getIterationNumber()

    def destroy(self):
        """Free the SNES: petsc4py does not break the cycle through the callbacks by itself."""
        self.snes.destroy()
        self.u.destroy()
