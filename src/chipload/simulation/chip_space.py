"""Check of the chip space: the loose volume of the chips of a tooth compared with its gullet.

Notation: a tooth cuts V = sum over its engagement ranges of rho (b - a) integral of h dphi in a revolution; its loose
chips fill q V (``chip_ratio``); between two teeth there is an area A across the axis (``gullet``), over the height H of
the edge that cuts. The share that is filled is q V / (A H).

A cut of a flat bottom alone has no height; its share is 0, because the chip flow of a plunge is not calculated.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from chipload.errors import InputError
from chipload.simulation.loads import Cuts

Floats = NDArray[np.float64]


def flute_fill(cuts: Cuts) -> Floats:
    """Return the share of the gullet (c,) that the chips of one revolution fill, for the fullest tooth of each step.

    Parameters
    ----------
    cuts : of a cutter whose ``gullet`` and ``chip_ratio`` are stated

    Raises
    ------
    InputError
        They are not stated.
    """
    cutter, engagement = cuts.cutter, cuts.engagement
    if cutter.gullet is None or cutter.chip_ratio is None:
        raise InputError(f"flute_fill: gullet_mm2 and chip_ratio of cutter {cuts.tool}: missing: state both")
    p, q, a, b, along, offset, across = engagement.rows.T
    rho, sine = engagement.slices[engagement.slice, 1], engagement.slices[engagement.slice, 3]
    chip = along * (np.cos(p) - np.cos(q)) + across * (np.sin(q) - np.sin(p)) + offset * (q - p)
    step = np.repeat(np.arange(len(cuts)), np.diff(engagement.start))
    # engagement ranges of all teeth alike are those of tooth 0; with runout each tooth has its own
    own = step * cutter.flutes + np.maximum(engagement.tooth, 0)
    volume = np.bincount(own, rho * (b - a) * chip, len(cuts) * cutter.flutes)
    height = _height(own, engagement.slice, a, b, sine, len(cuts) * cutter.flutes)
    share = np.divide(cutter.chip_ratio * volume, cutter.gullet * height, out=np.zeros(len(height)), where=height > 0.0)
    return np.asarray(share.reshape(len(cuts), cutter.flutes).max(axis=1))


def _height(own: NDArray[np.int64], piece: NDArray[np.int64], a: Floats, b: Floats, sine: Floats, n: int) -> Floats:
    """Return the height (n,) of the edge that cuts: by slices, from the lowest engagement range to the highest."""
    key, back = np.unique(np.column_stack([own, piece]), axis=0, return_inverse=True)
    low, high = np.full(len(key), np.inf), np.full(len(key), -np.inf)
    np.minimum.at(low, back.ravel(), a)
    np.maximum.at(high, back.ravel(), b)
    slope = np.zeros(len(key))
    slope[back.ravel()] = sine
    return np.asarray(np.bincount(key[:, 0], (high - low) * slope, n), dtype=np.float64)
