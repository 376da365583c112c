"""Greatest multipliers of cuts with several delays (uneven pitch, runout) or three directions.

Notation: pitch of tooth j, the angle by which it follows the tooth before it. A tooth cuts the surface that another one
left: the one before it, or with runout the m-th before it for which the chip is least, as in
:mod:`chipload.engagement.tooth_surfaces`. Its delay is the time in which the spindle turns by the pitches between
them. The nominal chip determines which tooth that is. The period is a revolution; that of even teeth without runout in
three directions is a tooth period. A revolution takes several times as long as the periods of even teeth together.

Unevenly spaced teeth have the same engagement; the chip of each is thicker or thinner by its pitch, which matters only
if the coefficients have exponents.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from chipload.cutter.cutter import Cutter
from chipload.engagement.tooth_engagement import ToothEngagement
from chipload.engagement.tooth_surfaces import chips_and_paths, turns_before
from chipload.errors import InputError
from chipload.lazy import LateModule

_several_delays = LateModule("chipload.stability._several_delays")

if TYPE_CHECKING:
    from chipload.stability.cuts import DynamicCuts

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

#: how near to a revolution the pitches must add up [rad]
SUM = 1e-3
#: delays that differ by less are one [rad]
ALIKE = 1e-9


def engagement_of_teeth(engagement: ToothEngagement, cutter: Cutter) -> tuple[ToothEngagement, Floats]:
    """What each tooth cuts with the runout of the cutter, and by which angle the spindle turns between it and the tooth
    whose surface it cuts, (b,) float [rad].

    Parameters
    ----------
    engagement : without runout, of every tooth

    Examples
    --------
    Of two teeth whose radii differ by more than a chip the longer one cuts alone, what it left a revolution ago:

    >>> from chipload.engagement.tooth_engagement import engagement_of_arcs
    >>> mill = Cutter(10.0, 2, 0.0, 20.0, 30.0, 6e5, runout=(0.05, 0.0))
    >>> each, delay = engagement_of_teeth(engagement_of_arcs([0.0], [math.pi], 0.01, mill, 1.0), mill)
    >>> set(each.tooth.tolist()), set((delay / math.tau).tolist())
    ({0}, {1.0})
    """
    each, _, before = chips_and_paths(engagement, cutter)
    tooth = np.array(each.tooth)
    # at a wall the tooth meets what the one before it left
    delay = turns_before(cutter)[tooth, np.maximum(before, 1) - 1] * math.tau / cutter.flutes
    return each, delay


def several_multipliers(
    cuts: DynamicCuts, gain: Floats, per_wave: float, most: int, still: float, shared: Callable[..., None]
) -> Floats:
    """(n, 4) modulus and angle of the greatest multiplier of the map of one period, the dimension of its Krylov
    space, and the mode of greatest share.

    Parameters
    ----------
    cuts : their time between two teeth is that of even pitches
    gain, per_wave, most, still : as of :func:`chipload.stability.margin.largest_multipliers`
    shared : calls a function of first and last on chunks of the cuts

    Raises
    ------
    InputError
        The pitches do not make a revolution of the cutter's teeth, or there is process damping.
    """
    if len(cuts.damped):
        raise InputError(
            "dynamics.process_damping: not known with cutter.pitch_deg, with runout or with motion along the axis: "
            "leave one of them out"
        )
    teeth = round(math.tau / cuts.pitch)
    start, rows, delay, angle = _rows_of_teeth(cuts, teeth)
    delays, which = np.unique(np.round(delay / ALIKE).astype(np.int64), return_inverse=True)
    out, time = np.zeros((len(cuts), 4)), cuts.period * (angle / cuts.pitch)
    angles, number = np.maximum(delays, 1) * ALIKE, np.ascontiguousarray(which.ravel(), dtype=np.int64)
    if not len(angles):
        angles = np.array([cuts.pitch])

    def part(first: int, last: int) -> None:
        _several_delays.multipliers(
            first, last, start, rows, number, angles, cuts.exponents, time, angle, cuts.omega,
            np.array(cuts.damping), cuts.U, gain, per_wave, most, still, out,
        )  # fmt: skip

    shared(part, len(cuts))
    if not (out[:, 0] >= 0.0).all():
        raise InputError("stability: a multiplier was not found: check frequency and damping of the modes")
    return out


def _rows_of_teeth(cuts: DynamicCuts, teeth: int) -> tuple[Ints, Floats, Floats, float]:
    """Start, rows and delays [rad] of the cuts, each row of its own tooth, and the angle of a period."""
    if len(cuts.delay):
        return cuts.start, np.ascontiguousarray(cuts.rows), cuts.delay, math.tau
    if not cuts.pitches:
        return cuts.start, np.ascontiguousarray(cuts.rows), np.full(len(cuts.rows), cuts.pitch), cuts.pitch
    pitch = np.asarray(cuts.pitches, dtype=np.float64)
    if pitch.shape != (teeth,) or not (pitch > 0.0).all() or abs(pitch.sum() - math.tau) > SUM:
        raise InputError(
            f"variable pitch: {np.degrees(pitch).round(6).tolist()} deg: must be {teeth} angles above 0 that add up to "
            "360 deg"
        )
    pitch = pitch * (math.tau / pitch.sum())
    size = np.diff(cuts.start)
    start = teeth * cuts.start
    # the rows of a cut once for each tooth, one tooth behind the other
    own = np.repeat(cuts.start[:-1], teeth * size) + np.concatenate(
        [np.tile(np.arange(n), teeth) for n in size.tolist()] or [np.zeros(0, dtype=np.int64)]
    )
    tooth = np.concatenate([np.repeat(np.arange(teeth), n) for n in size.tolist()] or [np.zeros(0, dtype=np.int64)])
    rows = cuts.rows[own].copy()
    rows[:, 2:4] += (np.cumsum(pitch) - pitch[0])[tooth][:, None]
    rows[:, 8:11] *= (pitch / cuts.pitch)[tooth][:, None]
    return start, np.ascontiguousarray(rows), pitch[tooth], math.tau
