"""Sphere on a beam: one impact at midspan, ``beam_impact.py``, with points that fit the cells."""
from typing import Any

import beam_impact

from studies.crossing.common import of_case

ONLY_BY_NAME = True  # no point crosses a cell: for the choice of a default
SWEEP = [dict(h=5e-3), dict(h=2.5e-3), dict(h=2e-3), dict(h=1e-3)]
MEASURE = "force"


def run(basis: str = "linear", h: float = 2e-3, points: int = 2, **others: Any) -> dict:
    """Cells of ``h`` [m], points per cell and direction; others: keys of the case. Returns its errors
    against Timoshenko's beam, and what it costs."""
    body = round(0.1535 / h), round(0.01 / h)
    return of_case(beam_impact.main, h=h, body=body, points=points, basis=basis, **others)
