"""Three impacts: a sphere strikes a long beam three times, ``multiple_impact.py``, points fit the cells."""
from typing import Any

import multiple_impact

from studies.crossing.common import of_case

ONLY_BY_NAME = True  # no point crosses a cell: for the choice of a default
SWEEP = [dict(h=3.34e-3), dict(h=2e-3)]
MEASURE = "force"


def run(basis: str = "linear", h: float = 2e-3, points: int = 2, **others: Any) -> dict:
    """Cells of ``h`` [m], points per cell and direction; others: keys of the case. Returns its errors
    against Timoshenko's beam, and what it costs."""
    body = round(0.307 / h), round(0.01 / h)
    return of_case(multiple_impact.main, **{"dt": 4e-6, "substeps": 40, **others}, h=h, body=body,
                   points=points, basis=basis)
