"""Products of small matrices with packed arithmetic, as kernels use them: parts of larger arrays."""
import numpy as np
import pytest

from mpm_fenicsx.compiled import multiply, specialise

ROWS, TERMS, COLUMNS = 2, 2, 2  # fixed by specialise


def product(out, left, right):
    multiply((ROWS, TERMS, COLUMNS), False, (out[0], 1, COLUMNS + 1), (left, 2, 1, ROWS + 2),
             (right[1], 0, COLUMNS))
    multiply((ROWS, TERMS, COLUMNS), True, (out[1], 1, COLUMNS + 1), (left, 2, 1, ROWS + 2),
             (right[1], 0, COLUMNS))


@pytest.mark.parametrize("rows, terms, columns", [(4, 2, 4), (8, 3, 8), (9, 3, 3), (3, 3, 9), (1, 4, 3)])
def test_product_of_parts_of_arrays(rows, terms, columns):
    random = np.random.default_rng(0)
    out, left, right = random.random((2, rows, columns + 1)), random.random((terms, rows + 2)), random.random(
        (2, terms, columns))
    expected = out.copy()
    expected[0, :, 1:] = left[:, 2:].T @ right[1]
    expected[1, :, 1:] += left[:, 2:].T @ right[1]
    specialise(product, ROWS=rows, TERMS=terms, COLUMNS=columns)(out, left, right)
    np.testing.assert_allclose(out, expected, rtol=1e-14)
