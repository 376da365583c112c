"""Teeth that are not evenly spaced: one delay a tooth, the map of a revolution.

Notation: pitch of tooth j, the angle by which it follows the tooth before it; its delay is pitch / Omega. The state is
(r, h r') at the nodes of the longest delay, then q, q'; where a delayed time lies between nodes, r is the cubic Hermite
there. A revolution costs some times what the periods of even teeth cost together.

Each tooth cuts the same engagement; what it cuts is thicker or thinner by its pitch, which counts only where the
coefficients have exponents.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from chipload.errors import InputError
from chipload.stability.cuts import DynamicCuts
from chipload.stability.pitches import _kernels

Floats = NDArray[np.float64]

#: how near to a revolution the pitches must add up [rad]
SUM = 1e-3


def revolution_multipliers(
    cuts: DynamicCuts, gain: Floats, per_wave: float, most: int, still: float, shared: Callable[..., None]
) -> Floats:
    """(n, 4) modulus and angle of the greatest multiplier of the map of one revolution, the dimension of its Krylov
    space, and the mode of greatest share.

    Parameters
    ----------
    cuts : with ``pitches``; their time between two teeth is that of even pitches
    gain, per_wave, most, still : as of :func:`chipload.stability.margin.largest_multipliers`
    shared : calls a function of first and last on chunks of the cuts

    Raises
    ------
    InputError
        The pitches do not make a revolution of the cutter's teeth, or there is process damping.
    """
    pitch = np.asarray(cuts.pitches, dtype=np.float64)
    teeth = round(math.tau / cuts.pitch)
    if pitch.shape != (teeth,) or not (pitch > 0.0).all() or abs(pitch.sum() - math.tau) > SUM:
        raise InputError(
            f"variable pitch: {np.degrees(pitch).round(6).tolist()} deg: must be {teeth} angles above 0 that add up to "
            "360 deg"
        )
    if len(cuts.damped):
        raise InputError("dynamics.process_damping: not known with cutter.pitch_deg: leave one of them out")
    pitch = pitch * (math.tau / pitch.sum())
    out = np.zeros((len(cuts), 4))

    def part(first: int, last: int) -> None:
        _kernels.multipliers(
            first, last, cuts.start, cuts.rows, cuts.exponents, teeth * cuts.period, pitch, cuts.omega,
            np.array(cuts.damping), cuts.U, gain, per_wave, most, still, out,
        )  # fmt: skip

    shared(part, len(cuts))
    return out
