"""Force cells of a named body: parts whose forces are told by name, as those of a structure are."""
from typing import Any, Optional, Tuple

import numpy as np

import mpm_dem_checks as check

MOST = 1000  # of a body: each has columns in the history


def check_force_cells(name: Optional[str], cells: Any, dim: int) -> Any:
    """The ``force_cells`` of a body with this ``name``, checked: None, a function, or counts along the
    axes."""
    if name is None:
        if cells is not None:
            raise ValueError("the body has force cells and no name: give it one (name=), by which forces are "
                             "told")
        return None
    if not isinstance(name, str) or not name.replace("_", "a").replace("-", "a").isalnum():
        check.refuse("the name of a body", name, "give letters, digits, _ and -, as it names columns of the "
                     "history")
    if cells is None or callable(cells):
        return cells
    counts = check.counts(f"force cells of {name}", cells, dim)
    if np.prod(counts, dtype=float) > MOST:
        check.refuse(f"force cells of {name}", cells, f"give at most {MOST} in all")
    return counts


def numbers(body: Any, x: np.ndarray) -> np.ndarray:
    """Number of the force cell of each place x [m], shape (n, dim), at the start, shape (n,); outside the box
    around the body that of the nearest place in it. ValueError for a function that gives no such numbers."""
    cells = body.force_cells
    if cells is None or not len(x):
        return np.zeros(len(x), np.int64)
    if callable(cells):
        found = check.values(f"force cells of {body.name}", cells, (x,), (len(x),))
        if (found != np.rint(found)).any() or found.min() < 0 or found.max() >= MOST:
            raise ValueError(f"force cells of {body.name} have numbers from {found.min():g} to "
                             f"{found.max():g}: give whole ones from 0 to {MOST - 1}")
        return found.astype(np.int64)
    at = np.floor((x - body.box.lower) / body.box.size * cells).astype(int)
    at = np.clip(at, 0, np.array(cells) - 1)
    return (at @ np.cumprod([1, *cells[:-1]])).astype(np.int64)


def names_of(body: Any, found: np.ndarray) -> Tuple[str, ...]:
    """Names of the force cells of a named body, by their numbers, of which ``found`` are those of its
    material points: its own, or that with 1, 2, … ValueError where a number is left out."""
    count = int(found.max(initial=0)) + 1
    if len(np.unique(found)) < count:
        raise ValueError(f"force cells of {body.name} with material points are {np.unique(found).tolist()}: "
                         "number them from 0 on, and leave none out")
    return (body.name,) if count == 1 else tuple(f"{body.name}_{k + 1}" for k in range(count))
