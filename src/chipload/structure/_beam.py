"""Compiled deflection of the cutter as a stepped beam. Oracle: the NumPy version in :mod:`chipload.structure.beam`."""

from __future__ import annotations

from numba import njit


@njit(cache=True, nogil=True)
def beam_deflection(za, zb, length, fluted, flex_fluted, flex_shank):
    """Deflection [mm/N] at height zb under a unit force at za; see :func:`chipload.structure.beam.compliance`."""
    top = max(za, zb)
    d = top - min(za, zb)
    t1 = length - top
    if t1 <= 0.0:
        return 0.0
    tf = max(fluted - top, 0.0)
    pf = tf * tf * (tf / 3.0 + 0.5 * d)
    return flex_fluted * pf + flex_shank * (t1 * t1 * (t1 / 3.0 + 0.5 * d) - pf)
