"""Check of the chip space: the loose volume of the chips of a tooth compared with its gullet.

Notation: a tooth cuts V, its part of N sum over the engagement ranges of the front of rho (b - a) integral of h dphi, N
teeth, in a revolution: the part that its chips have of the same integrals of all teeth. Its loose
chips fill q V (``chip_ratio``); between two teeth there is an area A across the axis (``gullet``), over the height H of
the edge that cuts. The share that is filled is q V / (A H).

A cut of a flat bottom alone has no height; its share is 0, because the chip flow of a plunge is not calculated.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from chipload.engagement.tooth_engagement import ToothEngagement
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
    step = np.repeat(np.arange(len(cuts)), np.diff(engagement.start))
    # engagement ranges of all teeth alike are those of tooth 0; with runout each tooth has its own
    own = step * cutter.flutes + np.maximum(engagement.tooth, 0)
    chips = np.bincount(own, _swept(engagement), len(cuts) * cutter.flutes).reshape(len(cuts), -1)
    front = np.bincount(np.repeat(np.arange(len(cuts)), np.diff(cuts.plain.start)), _swept(cuts.plain), len(cuts))
    every = chips.sum(axis=1) / (1.0 if cutter.teeth_alike else cutter.flutes)
    volume = (chips * np.divide(front, every, out=np.zeros(len(cuts)), where=every > 0.0)[:, None]).ravel()
    _, _, a, b = engagement.rows[:, :4].T
    sine = engagement.slices[engagement.slice, 3]
    height = _height(own, engagement.slice, a, b, sine, len(cuts) * cutter.flutes)
    share = np.divide(cutter.chip_ratio * volume, cutter.gullet * height, out=np.zeros(len(height)), where=height > 0.0)
    return np.asarray(share.reshape(len(cuts), cutter.flutes).max(axis=1))


def _swept(engagement: ToothEngagement) -> Floats:
    """Return rho (b - a) times the integral of h over the immersion (b,) [mm^3] of each engagement range."""
    p, q, a, b, along, offset, across = engagement.rows.T
    chip = along * (np.cos(p) - np.cos(q)) + across * (np.sin(q) - np.sin(p)) + offset * (q - p)
    return np.asarray(engagement.slices[engagement.slice, 1] * (b - a) * chip)


def _height(own: NDArray[np.int64], piece: NDArray[np.int64], a: Floats, b: Floats, sine: Floats, n: int) -> Floats:
    """Return the height (n,) of the edge that cuts: by slices, from the lowest engagement range to the highest."""
    key, back = np.unique(np.column_stack([own, piece]), axis=0, return_inverse=True)
    low, high = np.full(len(key), np.inf), np.full(len(key), -np.inf)
    np.minimum.at(low, back.ravel(), a)
    np.maximum.at(high, back.ravel(), b)
    slope = np.zeros(len(key))
    slope[back.ravel()] = sine
    return np.asarray(np.bincount(key[:, 0], (high - low) * slope, n), dtype=np.float64)
