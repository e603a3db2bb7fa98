"""What a point sees of the flanks of a wall."""
import numpy as np
import pytest

from mpm_fenicsx.compiled import specialise
from mpm_fenicsx.terms import flanks


@pytest.mark.parametrize("dim", [2, 3])
def test_what_is_left_out_cannot_look_at_the_point(dim):
    """Elements of all shapes and distances: one that is too far by the sphere around it does not look at the
    point from nearer than the bound; and most of those that do not are left out."""
    random, n = np.random.default_rng(3), 4000
    too_far, find_arm = (specialise(kernel, D=dim) for kernel in (flanks.too_far, flanks.find_arm))
    x = random.uniform(-1.0, 1.0, (n, dim))
    weight, arm, work = np.empty(dim), np.empty(dim), np.empty((3, dim))
    looks, left_out = np.empty(n, bool), np.empty(n, bool)
    for p in range(n):
        corners = random.uniform(-1.0, 1.0, dim) + random.uniform(0.01, 0.6) * random.normal(size=(dim, dim))
        edges = corners[1:] - corners[0]
        normal = np.cross(*edges) if dim == 3 else np.array([-edges[0, 1], edges[0, 0]])
        normal /= np.linalg.norm(normal)
        find_arm(p, x, corners, weight, arm, work)
        distance, bound = np.linalg.norm(arm), random.uniform(0.1, 2.0)
        looks[p] = abs(arm @ normal) >= flanks.ALIKE * distance and distance <= bound
        left_out[p] = too_far(p, x, corners, normal, bound**2)
    assert looks.sum() > 100 and not (looks & left_out).any()
    assert left_out.sum() > 0.5 * (~looks).sum()
