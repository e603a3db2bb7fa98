"""Why an attempt at a step has failed, in words, and what to try."""
from petsc4py import PETSc

from ..errors import MPMDivergedError

ZERO_PIVOT = 81  # PETSc's error of a factorisation that fails
FACTOR_FAILED = -11  # KSP_DIVERGED_PC_FAILED: one that fails without an error
REASONS = {value: name for name, value in vars(PETSc.SNES.ConvergedReason).items() if isinstance(value, int)}
SINGULAR = -ZERO_PIVOT  # beside PETSc's reasons, of one attempt
NOT_POSITIVE = SINGULAR, PETSc.SNES.ConvergedReason.DIVERGED_LINEAR_SOLVE  # perhaps, of the tangent
ANY_SIGN = "a solver that bears tangents of any sign"
FACTOR = "a factorisation in the place of an iterative solver"
ADVICE = {
    "DIVERGED_FNORM_NAN": "the residual is not a number, take a smaller dt or a law that bears the "
                          "deformation",
    "DIVERGED_LINEAR_SOLVE": "the linear solver failed, try solver=lu (-mpm_pc_type lu)",
    "DIVERGED_LINE_SEARCH": "the line search found no descent, try a smaller dt or "
                            "-mpm_snes_linesearch_type basic",
    "DIVERGED_MAX_IT": "too many iterations, try a smaller dt, -mpm_snes_linesearch_type basic, or "
                       "-mpm_snes_max_it 100",
}


def first_line(error):
    """What PETSc says itself, without the places in its source."""
    lines = [line.split("] ", 1)[-1].strip() for line in str(error).splitlines()]
    return next((line for line in reversed(lines) if line and "()" not in line), lines[0])


def diverged(reason, when, iterations, tried, residual, lost=None):
    """The error for PETSc's ``reason``, or SINGULAR, in the step ``when``, with all that was ``tried`` in
    ``iterations`` down to a ``residual`` [N]; lost: None, or the ``NoStress`` of a point on the way."""
    in_vain = f"; {', '.join(tried)} did not help" + (f"; {lost.text}" if lost else "")
    if reason == SINGULAR:
        return MPMDivergedError(f"the tangent of {when} cannot be factorised (nearly empty cells, stiff "
                                f"bodies beside soft ones){in_vain}", "take more material points, a "
                                "smaller dt or -mpm_pc_type lu")
    name = REASONS.get(reason, str(reason))
    return MPMDivergedError(f"Newton's method diverged in {when} after {iterations} iterations with "
                            f"residual {residual:.3g} N ({name}){in_vain}",
                            ADVICE.get(name, "try a smaller dt"))
