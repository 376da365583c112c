"""Factors of a stiffness in an order of nested dissection, by dense supernodes.

Notation: A = L L^T. The unknowns of a piece that is not cut further, or of a plane between two pieces, are one
**supernode**: n own unknowns, eliminated together, and b unknowns of later supernodes beside them, its border. With the
sums of A and of what the supernodes below leave, in blocks A_11 (n, n), A_21 (b, n), A_22 (b, b),

    A_11 = L_11 L_11^T,  L_21 = A_21 L_11^-T,

and A_22 - L_21 L_21^T goes on to the supernode of the border's first unknown.

All work is dense algebra on a few hundred rows at once, and L is kept once: a quarter of the time and less than half of
the memory of SuperLU in the same order (docs/design/workpiece.md). Right-hand sides are solved together; supernodes
without a force are left out, and in the substitution backwards those on which no wanted row depends.

Reference: [Duff1983].
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chipload.errors import InputError
from chipload.lazy import LateModule, scipy
from chipload.structure.cells.grid import Array, Indices

_supernodes = LateModule("chipload.structure.cells._supernodes")


@dataclass(frozen=True, eq=False)
class SupernodeFactors:
    """Factors of a symmetric positive definite matrix.

    Attributes
    ----------
    start : (m + 1,) int, first unknown of each supernode, and the number of unknowns
    parent : (m,) int, supernode to which each goes on; m: none
    own : m lower triangles L_11 (n, n)
    below : m blocks L_21 (b, n)
    border : m (b,) int, unknowns of the borders, rising
    """

    start: Indices
    parent: Indices
    own: tuple[Array, ...]
    below: tuple[Array, ...]
    border: tuple[Indices, ...]

    @property
    def entries(self) -> int:
        """How many numbers are kept."""
        return sum(a.size + b.size for a, b in zip(self.own, self.below, strict=True))

    def solve(self, right: Array, rows: Indices | None = None) -> Array:
        """A^-1 B.

        Parameters
        ----------
        right : (f,) or (f, q) float
        rows : (r,) int, rows of the solution that are wanted; None: all

        Returns
        -------
        (f,), (f, q), (r,) or (r, q) float.
        """
        work = np.array(right, dtype=np.float64, order="C").reshape(len(right), -1)
        trsm, start = scipy.linalg.blas.dtrsm, self.start.tolist()
        for k, L in enumerate(self.own):
            y = work[start[k] : start[k + 1]]
            if not y.any():
                continue
            trsm(1.0, L.T, y.T, side=1, lower=0, overwrite_b=1)
            if len(self.border[k]):
                work[self.border[k]] -= self.below[k] @ y
        for k in self._wanted(rows)[::-1].tolist():
            y = work[start[k] : start[k + 1]]
            if len(self.border[k]):
                y -= self.below[k].T @ work[self.border[k]]
            trsm(1.0, self.own[k].T, y.T, side=1, lower=0, trans_a=1, overwrite_b=1)
        out = work if rows is None else work[rows]
        return np.asarray(out[:, 0] if right.ndim == 1 else out)

    def _wanted(self, rows: Indices | None) -> Indices:
        """Rising supernodes of wanted rows and those above them."""
        m = len(self.own)
        if rows is None:
            return np.arange(m)
        wanted = np.zeros(m + 1, dtype=np.bool_)
        wanted[np.searchsorted(self.start, rows, side="right") - 1] = True
        for k, above in enumerate(self.parent.tolist()):
            if wanted[k]:
                wanted[above] = True
        return np.flatnonzero(wanted[:m])


def factor_supernodes(matrix: scipy.sparse.bsr_array, order: Indices, sizes: Sequence[int]) -> SupernodeFactors:
    """Factors of a symmetric positive definite matrix (f, f), O(f^1.5) for a plate, O(f^2) for a block.

    Parameters
    ----------
    matrix : by rows of blocks (s, s), one for a pair of nodes; both triangles
    order : (f / s,) int, nodes in the order of elimination, which is that of the factors
    sizes : (m,) nodes of each supernode, in that order; a supernode may touch any later one

    Raises
    ------
    InputError
        The matrix is singular: a piece is not held.

    Examples
    --------
    >>> from scipy.sparse import bsr_array
    >>> A = bsr_array([[4.0, 2.0], [2.0, 2.0]], blocksize=(1, 1))
    >>> factor_supernodes(A, np.array([0, 1]), [1, 1]).solve(np.array([2.0, 2.0])).tolist()
    [0.0, 1.0]
    """
    start = np.concatenate([[0], np.cumsum(sizes)]).astype(np.int64)
    u, m, s = int(start[-1]), len(sizes), matrix.blocksize[0]
    indptr, indices, data = matrix.indptr, matrix.indices, matrix.data
    position, place, touched = np.empty_like(order), np.zeros(u, dtype=np.int64), np.zeros(u, dtype=np.bool_)
    position[order] = np.arange(u)
    parent, waiting = np.full(m, m, dtype=np.int64), dict[int, list[tuple[Indices, Array]]]()
    own, below, borders = list[Array](), list[Array](), list[Indices]()
    for k, (first, last) in enumerate(zip(start[:-1].tolist(), start[1:].tolist(), strict=True)):
        n, children = last - first, waiting.pop(k, [])
        _supernodes.mark_rows(indptr, indices, order, position, first, last, touched)
        for nodes, _ in children:
            touched[nodes] = True
        border = last + np.flatnonzero(touched[last:])
        touched[border] = False
        place[first:last] = np.arange(n)
        place[border] = n + np.arange(len(border))
        b = s * len(border)
        L, B, rest = np.zeros((s * n, s * n)), np.zeros((b, s * n)), np.zeros((b, b))
        _supernodes.add_columns(indptr, indices, data, order, position, first, last, place, L, B)
        for nodes, update in children:
            _supernodes.add_update(update, _unknowns(place[nodes], s), L, B, rest)
        _eliminate(L, B, rest)
        if len(border):
            parent[k] = int(np.searchsorted(start, border[0], side="right")) - 1
            waiting.setdefault(int(parent[k]), []).append((border, rest))
        own.append(L)
        below.append(B)
        borders.append(_unknowns(border, s))
    return SupernodeFactors(s * start, parent, tuple(own), tuple(below), tuple(borders))


def _unknowns(nodes: Indices, s: int) -> Indices:
    """Return the unknowns of nodes, ``s`` each."""
    return np.asarray((s * nodes[:, None] + np.arange(s)).ravel())


def _eliminate(own: NDArray[np.float64], border: NDArray[np.float64], rest: NDArray[np.float64]) -> None:
    """Turn A_11, A_21, A_22 into L_11, L_21 and A_22 - L_21 L_21^T, in place.

    LAPACK reads columns first: of the transposed blocks, which are upper triangles.
    """
    if not len(own):
        return
    _, wrong = scipy.linalg.lapack.dpotrf(own.T, lower=0, clean=0, overwrite_a=1)
    if wrong:
        raise InputError("stiffness: not positive definite: a part of the workpiece is not held")
    if len(border):
        scipy.linalg.blas.dtrsm(1.0, own.T, border.T, lower=0, trans_a=1, overwrite_b=1)
        scipy.linalg.blas.dsyrk(-1.0, border.T, beta=1.0, c=rest.T, trans=1, lower=0, overwrite_c=1)
