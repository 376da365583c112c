"""Dense supernodes against dense algebra, and an order of nested dissection that separates what it says."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse import bsr_array, csc_array, random_array

from chipload.errors import InputError
from chipload.structure.cells.supernodes import factor_supernodes
from chipload.structure.cells.workpiece import dissect_modes

SIZES = {"one": [150], "each": [1] * 150, "mixed": [7, 40, 1, 60, 30, 12]}


def matrix(n: int, seed: int) -> csc_array:
    a = random_array((n, n), density=2.5 / n, rng=np.random.default_rng(seed))
    return (a @ a.T + 0.1 * csc_array(np.eye(n))).tocsc()


@pytest.mark.parametrize("sizes", SIZES.values(), ids=SIZES)
@pytest.mark.parametrize("columns", [1, 5])
def test_against_dense(sizes, columns):
    A = matrix(150, columns)
    right = np.random.default_rng(1).standard_normal((150, columns))
    right[:, 0] = 0.0
    right[100, 0] = 1.0
    expected = np.linalg.solve(A.toarray(), right)
    order = np.random.default_rng(2).permutation(150)
    factors = factor_supernodes(bsr_array(A, blocksize=(1, 1)), order, sizes)
    rows = np.array([140, 3, 77])
    right, expected = right[order], expected[order]
    before = right.copy()
    np.testing.assert_allclose(factors.solve(right), expected, atol=1e-11)
    np.testing.assert_allclose(factors.solve(right, rows), expected[rows], atol=1e-11)
    np.testing.assert_allclose(factors.solve(right[:, 0]), expected[:, 0], atol=1e-11)
    np.testing.assert_array_equal(right, before)


def test_blocks_of_three():
    A = matrix(150, 3)
    order = np.random.default_rng(2).permutation(50)
    factors = factor_supernodes(bsr_array(A, blocksize=(3, 3)), order, [4, 20, 1, 25])
    right = np.random.default_rng(1).standard_normal((150, 4))
    at = (3 * order[:, None] + np.arange(3)).ravel()
    np.testing.assert_allclose(factors.solve(right[at]), np.linalg.solve(A.toarray(), right)[at], atol=1e-11)


def test_supernodes_that_touch_nothing_later():
    A = bsr_array(np.diag([2.0, 4.0, 8.0]), blocksize=(1, 1))
    assert factor_supernodes(A, np.arange(3), [1, 1, 1]).solve(np.ones(3)).tolist() == pytest.approx([0.5, 0.25, 0.125])


def test_what_is_not_held_is_refused():
    with pytest.raises(InputError, match="stiffness: not positive definite: a part of the workpiece is not held"):
        factor_supernodes(bsr_array([[1.0, 1.0], [1.0, 0.5]], blocksize=(1, 1)), np.arange(2), [1, 1])


def test_a_plane_separates_two_pieces():
    lattice = np.argwhere(np.ones((13, 5, 3), dtype=np.bool_))
    pieces = dissect_modes(lattice, 2)
    assert sorted(np.concatenate(pieces).tolist()) == list(range(len(lattice)))
    x = lattice[:, 0]
    plane = pieces[-1]
    assert len(np.unique(x[plane])) == 1
    sides = {np.sign(x[piece] - x[plane][0]).min() * np.sign(x[piece] - x[plane][0]).max() for piece in pieces[:-1]}
    assert sides == {1}
