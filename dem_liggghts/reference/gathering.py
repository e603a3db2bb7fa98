"""Rows of numbers of all ranks, on every rank."""
from typing import Any, Optional

import numpy as np


def rows_of_all(block: np.ndarray, comm: Any, counts: Optional[np.ndarray] = None) -> np.ndarray:
    """The rows of each rank's ``block``, (n, k) floats, one rank after the other. counts: how many each of
    them has, where that is known. Collective."""
    counts = np.array(comm.allgather(len(block))) if counts is None else counts
    rows = np.empty((counts.sum(), block.shape[1]))
    comm.Allgatherv(block, [rows, counts * block.shape[1]])
    return rows
