"""The cutter's beam and the triangular solutions, compiled.

The oracle of the first is the NumPy version in :mod:`chipload.structure.beam`, that of the others the
solution of SuperLU itself.
"""

from __future__ import annotations

from numba import njit


@njit(cache=True, nogil=True)
def stepped(za, zb, length, fluted, flex_fluted, flex_shank):
    """Deflection at height zb under a unit force at za; see :func:`chipload.structure.beam.compliance`."""
    top = max(za, zb)
    d = top - min(za, zb)
    t1 = length - top
    if t1 <= 0.0:
        return 0.0
    tf = max(fluted - top, 0.0)
    pf = tf * tf * (tf / 3.0 + 0.5 * d)
    return flex_fluted * pf + flex_shank * (t1 * t1 * (t1 / 3.0 + 0.5 * d) - pf)


@njit(cache=True, nogil=True)
def ancestors(indptr, indices, wanted):
    """Mark every row of the solution that a marked row needs on the way up."""
    for j in range(len(wanted)):
        if wanted[j]:
            for p in range(indptr[j], indptr[j + 1]):
                wanted[indices[p]] = True


@njit(cache=True, nogil=True)
def triangular(indptr, indices, data, inverse, wanted, out):
    """Turn right-hand sides into solutions of L D L^T, in place; see :mod:`chipload.structure.factors`."""
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
