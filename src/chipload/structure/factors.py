"""Factors of a symmetric positive definite matrix, and solutions for many right-hand sides at once.

Notation: A (f, f) = P^T L D L^T P with P a permutation (minimum degree on A + A^T), L unit lower triangular, D
diagonal; B right-hand sides (f, q).

SuperLU factors without pivots. Its own solution processes the columns one after the other through 100 MB of factors.
:func:`chipload.structure._triangular.solve_triangular` processes 64 together, skips rows that are still zero in forward
substitution and rows that are not needed in back substitution: ten times as many in the same time
(benchmarks/structure.py).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from chipload.errors import InputError
from chipload.lazy import LateModule, scipy

_triangular = LateModule("chipload.structure._triangular")

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

#: number of right-hand sides that are solved together
ABREAST = 64


@dataclass(frozen=True, eq=False)
class Factors:
    """Factors of a matrix.

    Attributes
    ----------
    lu : as SuperLU holds them
    """

    lu: scipy.sparse.linalg.SuperLU

    @cached_property
    def _lower(self) -> tuple[Indices, Indices, Array, Array]:
        """L by columns, and 1 / D."""
        L = self.lu.L
        return L.indptr, L.indices, L.data, 1.0 / self.lu.U.diagonal()

    @cached_property
    def _symmetric(self) -> bool:
        return bool((self.lu.perm_r == self.lu.perm_c).all())

    def solve(self, right: Array, rows: Indices | None = None) -> Array:
        """A^-1 B.

        Parameters
        ----------
        right : (f,) or (f, q) float
        rows : (r,) int, rows of the solution that are wanted; None: all

        Returns
        -------
        (f,), (f, q) or (r, q) float.
        """
        if right.ndim == 1 or right.shape[1] < 4 or not self._symmetric:
            out = np.asarray(self.lu.solve(np.ascontiguousarray(right)))
            return out if rows is None else out[rows]
        indptr, indices, data, inverse = self._lower
        order = self.lu.perm_r
        wanted = np.ones(len(order), dtype=np.bool_) if rows is None else np.zeros(len(order), dtype=np.bool_)
        if rows is not None:
            wanted[order[rows]] = True
            _triangular.mark_ancestors(indptr, indices, wanted)
        out = np.empty((len(order) if rows is None else len(rows), right.shape[1]))
        for at in range(0, right.shape[1], ABREAST):
            part = slice(at, at + ABREAST)
            work = np.empty((len(order), right[:, part].shape[1]))
            work[order] = right[:, part]
            _triangular.solve_triangular(indptr, indices, data, inverse, wanted, work)
            out[:, part] = work[order if rows is None else order[rows]]
        return out


#: smallest pivot over the diagonal that does not count as zero; thin plates of 1:1000 reach 1e-10, hinges 1e-12
SMALLEST_PIVOT = 1e-11


def factor(matrix: scipy.sparse.csc_array, smallest: float = SMALLEST_PIVOT) -> Factors:
    """Factors of a symmetric positive definite matrix, O(f^1.5) for a plate, O(f^2) for a block.

    ``smallest`` is the pivot, over the diagonal entry that it came from, below which the matrix counts as singular.

    Raises
    ------
    InputError
        The matrix is singular: a piece is loose, or only a line of nodes connects it, like a hinge.

    Examples
    --------
    >>> from scipy.sparse import csc_array
    >>> factor(csc_array([[4.0, 2.0], [2.0, 2.0]])).solve(np.array([2.0, 2.0])).tolist()
    [0.0, 1.0]
    """
    options = {"SymmetricMode": True}
    try:
        lu = scipy.sparse.linalg.splu(matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=options)
    except RuntimeError as error:
        raise InputError(f"stiffness: {error}: a part of the workpiece is not held") from None
    came_from = np.empty(matrix.shape[0])
    came_from[lu.perm_r] = matrix.diagonal()
    ratio = float((lu.U.diagonal() / came_from).min())
    if not ratio > smallest:
        raise InputError(
            f"stiffness: smallest pivot {ratio:.1e} of its diagonal, must be above {smallest:.1e}: a piece of the "
            "workpiece hangs on a hinge of nodes or hardly at all"
        )
    return Factors(lu)
