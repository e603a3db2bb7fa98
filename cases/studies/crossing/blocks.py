"""Granular flow against three blocks: ``granular_blocks.py``, until the soil has reached them."""
from typing import Any

import granular_blocks

from studies.crossing.common import of_case

ONLY_BY_NAME = True  # takes long
SWEEP = [dict(h=0.02)]


def run(basis: str = "linear", h: float = 0.02, **others: Any) -> dict:
    """Cells of ``h`` [m]; others: keys of the case. Returns its errors, and what it costs."""
    return of_case(granular_blocks.main, **{"dt": 5e-4, "t_end": 0.4, **others}, h=h, basis=basis)
