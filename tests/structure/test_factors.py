"""Many right-hand sides against dense algebra."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse import csc_array, random_array

from chipload.errors import InputError
from chipload.structure.factors import factor


def matrix(n, seed):
    a = random_array((n, n), density=2.5 / n, rng=np.random.default_rng(seed))
    return (a @ a.T + 0.1 * csc_array(np.eye(n))).tocsc()


@pytest.mark.parametrize("columns", [1, 3, 4, 64, 130])
def test_against_dense(columns):
    A = matrix(150, columns)
    right = np.random.default_rng(1).standard_normal((150, columns))
    right[:, 0] = 0.0
    right[100, 0] = 1.0
    expected = np.linalg.solve(A.toarray(), right)
    factors = factor(A)
    np.testing.assert_allclose(factors.solve(right), expected, atol=1e-11)
    rows = np.array([140, 3, 77])
    np.testing.assert_allclose(factors.solve(right, rows), expected[rows], atol=1e-11)
    np.testing.assert_allclose(factors.solve(right[:, 0]), expected[:, 0], atol=1e-11)


def test_singular_is_refused():
    with pytest.raises(InputError, match="stiffness: Factor is exactly singular: a part of the workpiece is not held"):
        factor(csc_array(np.diag([1.0, 0.0, 2.0])))
    with pytest.raises(InputError, match=r"stiffness: smallest pivot 4.4e-16 of its diagonal, must be above 1.0e-11"):
        factor(csc_array(np.array([[1.0, 1.0], [1.0, 1.0 + 2.0**-51]])))
