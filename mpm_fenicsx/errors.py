"""Errors of the MPM partition. Each carries one sentence that says what to do."""


class MPMError(RuntimeError):
    """The MPM cannot go on: the message names the point or step and the remedy."""


class MPMDiverged(MPMError, ArithmeticError):
    """Newton's method did not converge in a step. An ArithmeticError, as all that a shorter step may cure. ``what``
    happened, and ``advice``: what to try."""

    def __init__(self, what, advice):
        super().__init__(f"{what}: {advice}")
        self.what, self.advice = what, advice
