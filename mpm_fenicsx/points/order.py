"""Points in another order than that in which they are kept."""
import numpy as np

from ..compiled import compiled


@compiled
def put_in_order(element, count, order):
    """Fill ``order`` (n,) with the numbers of the points, element by element, in each by their number.
    element: (n,) of the points, below ``count``."""
    place = np.zeros(count + 1, np.int64)
    for q in range(len(element)):
        place[element[q] + 1] += 1
    for c in range(count):
        place[c + 1] += place[c]
    for q in range(len(element)):
        order[place[element[q]]] = q
        place[element[q]] += 1
