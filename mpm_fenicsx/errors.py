"""Errors of the MPM. Each carries one sentence that says what to do."""


class MPMError(RuntimeError):
    """The MPM cannot go on: the message names the point or step and the remedy.

    >>> raise MPMError("material point 7 left the grid at x = [1.2, 0.1] m: enlarge the grid")
    Traceback (most recent call last):
    mpm_fenicsx.errors.MPMError: material point 7 left the grid at x = [1.2, 0.1] m: enlarge the grid
    """


class MPMDivergedError(MPMError, ArithmeticError):
    """Newton's method did not converge in a step. An ArithmeticError, as all that a shorter step may cure.
    ``what`` happened, and ``advice``: what to try.

    >>> MPMDivergedError("Newton's method diverged in step 3", "try a smaller dt").advice
    'try a smaller dt'
    """

    def __init__(self, what: str, advice: str):
        super().__init__(f"{what}: {advice}")
        self.what, self.advice = what, advice
