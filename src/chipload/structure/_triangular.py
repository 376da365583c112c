"""Compiled triangular solves of a sparse factorisation. Oracle: the solution of SuperLU."""

from __future__ import annotations

from numba import njit


@njit(cache=True, nogil=True)
def mark_ancestors(indptr, indices, wanted):
    """Mark in ``wanted`` (n,) every row on which a marked row depends in the backward substitution.

    ``indptr``, ``indices`` the columns of L (compressed sparse columns).
    """
    for j in range(len(wanted)):
        if wanted[j]:
            for p in range(indptr[j], indptr[j + 1]):
                wanted[indices[p]] = True


@njit(cache=True, nogil=True)
def solve_triangular(indptr, indices, data, inverse, wanted, out):
    """Solve L D L^T x = b in place for the right-hand sides ``out`` (n, q); see :mod:`chipload.structure.factors`.

    L in compressed sparse columns, ``inverse`` (n,) of the diagonal of D, ``wanted`` (n,) rows of the solution that are
    computed.
    """
    n, q = out.shape
    for j in range(n):
        y = out[j]
        zero = True
        for c in range(q):
            if y[c] != 0.0:
                zero = False
                break
        if zero:
            continue
        for p in range(indptr[j], indptr[j + 1]):
            i = indices[p]
            if i != j:
                v = data[p]
                z = out[i]
                for c in range(q):
                    z[c] -= v * y[c]
    for j in range(n - 1, -1, -1):
        if not wanted[j]:
            continue
        y = out[j]
        for c in range(q):
            y[c] *= inverse[j]
        for p in range(indptr[j], indptr[j + 1]):
            i = indices[p]
            if i != j:
                v = data[p]
                z = out[i]
                for c in range(q):
                    y[c] -= v * z[c]
