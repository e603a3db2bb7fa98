"""Granular column: ``column_collapse.py`` on its way to 30 cm, where the paper's flow is after 0.25 s."""
from typing import Any

import column_collapse

from studies.crossing.common import of_case

ONLY_BY_NAME = True  # takes long
SWEEP = [dict(h=0.02), dict(h=0.01)]
MEASURE = "arrival"


def run(basis: str = "linear", h: float = 0.02, points: int = 2, **others: Any) -> dict:
    """Cells of ``h`` [m], points per body cell and direction, of which there are two in a cell; others: keys
    of the case. Returns its errors, and what it costs."""
    keys = {"dt": 1e-3, "t_end": 0.3, **others}
    return of_case(column_collapse.main, h=h, body_cell="quadrilateral", points=points, basis=basis, **keys)
