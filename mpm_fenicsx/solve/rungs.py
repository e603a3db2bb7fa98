"""The attempts at one step inside Newton's method, see docs/tangents.md."""
from typing import NamedTuple


class Rung(NamedTuple):
    """One attempt at a step: with ``new_tangents`` in every iteration, ``from_rest`` instead of from the
    predicted displacement, with ``full_steps`` instead of a line search; ``news``: what the attempt before
    did not have."""

    news: str
    new_tangents: bool
    from_rest: bool
    full_steps: bool


# One after the other until one succeeds. Left out is what the user's options decide, and new tangents after
# an attempt that had one in every iteration: it would be the same one again.
RUNGS = (
    Rung("", False, False, False),
    Rung("new tangents", True, False, False),  # a body that turns leaves the kept one behind
    Rung("a start from rest", True, True, False),
    # a nearly empty cell lets the line search stall on a residual that no point feels
    Rung("full Newton steps", True, True, True))
