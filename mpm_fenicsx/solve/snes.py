"""Newton–Raphson by PETSc SNES, options prefix ``mpm_``.

Defaults are set on the objects before ``setFromOptions``, so the command line always wins:
-mpm_snes_rtol 1e-6, -mpm_snes_stol 0, -mpm_snes_max_it 25, line search bt, and a linear solver of ``solvers``.

The tangent is kept until the caller has a reason for a new one (``-mpm_snes_lag_jacobian 1`` makes it anew in every
Newton iteration, 2 in every second one, …). A step that fails with the kept tangent is tried again with new ones.
"""
import numpy as np
from petsc4py import PETSc

from ..errors import MPMDiverged, MPMError
from ..grid import compat
from . import options, solvers
from .options import PREFIX
from .options import unused as unused_options  # noqa: F401 - known by this name

KEEP = -1  # never made anew by the SNES itself
ZERO_PIVOT = 81  # PETSc's error of a factorisation that fails
REASONS = {value: name for name, value in vars(PETSc.SNES.ConvergedReason).items() if isinstance(value, int)}
SINGULAR = -ZERO_PIVOT  # beside PETSc's reasons, of one attempt
RUNGS = [], ["new tangents"], ["a start from rest"], ["full Newton steps"]  # what each attempt is for
ADVICE = {
    "DIVERGED_FNORM_NAN": "the residual is not a number, take a smaller dt or a law that bears the deformation",
    "DIVERGED_LINEAR_SOLVE": "the linear solver failed, try solver=lu (-mpm_pc_type lu)",
    "DIVERGED_LINE_SEARCH": "the line search found no descent, try a smaller dt or -mpm_snes_linesearch_type basic",
    "DIVERGED_MAX_IT": "too many iterations, try a smaller dt, -mpm_snes_linesearch_type basic, or -mpm_snes_max_it 100",
}


def _first_line(error):
    """What PETSc says itself, without the places in its source."""
    lines = [line.split("] ", 1)[-1].strip() for line in str(error).splitlines()]
    return next((line for line in reversed(lines) if line and "()" not in line), lines[0])


class Newton:
    """One SNES over the active cells. residual(u, r): fills r from u, both (owned, D); tangent(): fills the matrix at the
    deformation of the last residual. Collective.

    tangent is called with whether it was asked for, and whether always or once in a step will do where inertia
    dominates. watched: it is called in every iteration and may find that the kept
    one still holds. kinks: the residual is piecewise linear, as of springs that open, stick and slide. They have a
    potential: line search cp finds its minimum along a line, where bt gets stuck on the residual's norm. symmetric: so
    is the tangent. plastic: it changes with the load, so every iteration gets a new one. solver: one of
    ``solvers.SOLVERS``; ValueError when it does not exist or does not suit the tangent.
    """

    def __init__(self, active_cells, residual, tangent, watched=False, kinks=False, symmetric=True, plastic=False,
                 solver="auto"):
        solvers.check(solver, symmetric)
        options.check()
        self._doubt = options.Doubt()
        self._residual, self._tangent = residual, tangent
        self._failure, self.otherwise = None, ""  # otherwise: a remedy that only the scene knows
        self._shape = (active_cells.owned, active_cells.dim)
        self.u, r = active_cells.vector(active_cells.dim), active_cells.vector(active_cells.dim)
        self.snes = snes = PETSc.SNES().create(active_cells.comm)
        snes.setOptionsPrefix(PREFIX)
        snes.setFunction(self._function, r)
        snes.setJacobian(self._jacobian, active_cells.matrix)
        snes.setTolerances(rtol=1e-6, atol=0.0, stol=0.0, max_it=25)
        self._lag, self._search = 1 if watched or plastic else KEEP, ("cp", 5) if kinks else ("bt",)
        self._symmetric, self._plastic, self._asked, self._again = symmetric, plastic, plastic, False
        compat.set_lag_jacobian(snes, self._lag)
        compat.set_line_search(snes, *self._search)
        snes.getKSP().setOperators(active_cells.matrix)
        self._user_atol, self._user_lag, self._user_search = map(PETSc.Options(PREFIX).hasName, (
            "snes_atol", "snes_lag_jacobian", "snes_linesearch_type"))
        self._active_cells, self._solver, self._chosen = active_cells, solver, False
        r.destroy()  # the SNES holds its own reference

    @property
    def renews(self):
        """Whether the first iteration of the next solve makes a tangent, so that nobody has to make one before."""
        return self._chosen and self._plastic and not self._user_lag

    def choose_solver(self, stiffness, coordinates):
        """Defaults for a tangent with ``stiffness`` times as much stiffness as inertia, then the user's options.

        coordinates: of the owned nodes [m], shape (owned, D). Does nothing when called again.
        """
        if self._chosen:
            return
        name, fresh = self._solver, self._user_lag or self._plastic
        if name == "auto":
            name = solvers.automatic(self.u.getSize(), self._active_cells.dim, self._symmetric, fresh, stiffness)
        try:
            solvers.configure(self.snes.getKSP(), PREFIX, name, coordinates, self._symmetric)
            self.snes.setFromOptions()
        except PETSc.Error as error:
            raise MPMError(f"PETSc cannot take the options -{PREFIX}… ({_first_line(error)}): correct them") from None
        self._chosen = True

    def describe(self):
        """The solver in use, for the report."""
        return f"{self.snes.getType()}, {solvers.describe(self.snes.getKSP())}, {self.u.getSize()} unknowns"

    def _function(self, snes, u, r):
        out = r.array_w.reshape(self._shape)
        try:
            # A copy: numba compiles every kernel anew for an array that is read-only, as a locked vector's is.
            self._residual(np.array(u.array_r).reshape(self._shape), out)
        except Exception as error:
            self._fail(error)
            out[:] = np.nan

    def _jacobian(self, snes, u, A, B):
        try:
            self._tangent(self._asked or self._user_lag, self._user_lag or self._again)
        except Exception as error:
            self._fail(error)

    def _fail(self, error):
        """Keep an error until after the solve, where PETSc's vectors are unlocked. On several ranks leave the solve at
        once: those without the error wait for this one in the middle of their residual, and no solve comes to its
        end."""
        self._failure = error
        if self._active_cells.comm.size > 1:
            raise error

    def solve(self, guess, rest, atol, when):
        """Solve from ``guess``, shape (owned, D); returns the solution and the number of iterations.

        rest: the displacement that only moves what is held, to start from when the guess leads nowhere; atol: residual
        norm to stop at [N]; when: a text for the message, such as "step 3, t = 1e-6 s". Raises MPMDiverged with PETSc's
        reason in words and the option to try.
        """
        if not self._user_atol:
            self.snes.setTolerances(atol=atol)
        iterations, tried = 0, []
        try:
            for attempt, start in enumerate((guess, guess, rest, rest)):
                if attempt and not self._set_back(attempt):
                    continue
                tried += RUNGS[attempt]
                reason, more = self._run(start, when)
                iterations += more
                if reason >= 0:
                    break
        finally:
            if attempt:
                self._set_back(0)
        in_vain = f"; {', '.join(tried)} did not help"
        if reason == SINGULAR:
            raise MPMDiverged(f"the tangent of {when} cannot be factorised (nearly empty cells, stiff bodies beside "
                              f"soft ones){in_vain}", f"take more material points, a smaller dt or -mpm_pc_type lu{self.otherwise}")
        if reason < 0:
            name = REASONS.get(reason, str(reason))
            raise MPMDiverged(f"Newton's method diverged in {when} after {iterations} iterations with residual "
                              f"{self.snes.getFunctionNorm():.3g} N ({name}){in_vain}",
                              ADVICE.get(name, "try a smaller dt") + self.otherwise)
        self._doubt(self.snes.getFunctionNorm(), atol, when)
        return self.u.array_r.reshape(self._shape).copy(), iterations

    def _set_back(self, attempt):
        """What changes from attempt to attempt, where the user has not chosen; False when that would change nothing.

        1: new tangents, because a body that turns leaves the kept one behind; 2: from ``rest``; 3: full Newton steps,
        because a nearly empty cell lets the line search stall on a residual that no point feels.
        """
        if not self._user_lag:
            compat.set_lag_jacobian(self.snes, 1 if attempt else self._lag)
            self._asked, self._again = attempt > 0 or self._plastic, attempt > 0
        if not self._user_search:
            compat.set_line_search(self.snes, *(("basic",) if attempt == 3 else self._search))
        return attempt == 2 or not (self._user_lag if attempt == 1 else self._user_search)

    def _run(self, guess, when):
        """Reason and number of iterations of one attempt."""
        self.u.array_w[:] = guess.ravel()
        try:
            self.snes.solve(None, self.u)
        except PETSc.Error as error:
            if self._failure is None and error.ierr == ZERO_PIVOT:
                self.snes.getKSP().getPC().reset()  # CHOLMOD cannot go on from a factor that failed
                return SINGULAR, self.snes.getIterationNumber()
            if self._failure is None:
                raise MPMError(f"PETSc stopped in the solver {self.describe()} ({_first_line(error)}): try -mpm_pc_type lu "
                               "or other options") from None
        except Exception:
            if self._failure is None:
                raise
        failure, self._failure = self._failure, None
        if failure is not None:
            raise failure
        return self.snes.getConvergedReason(), self.snes.getIterationNumber()

    def destroy(self):
        """Free the SNES: petsc4py does not break the cycle through the callbacks by itself."""
        self.snes.destroy()
        self.u.destroy()
