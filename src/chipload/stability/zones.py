"""Zones: the fewest spindle speeds for the passes of a tool with which each pass has its required margin.

Notation: margin (p, s) of p passes in their order at s speeds, the least over the cuts of a pass. Between two passes
the cutter is out of the material, so that its speed can change there. The required margin of a pass is its greatest
over the speeds, but at most the greater of the required margin and the greatest margin of the worst pass. A zone is the
longest run of passes for which one speed gives the required margin. Taken from the first pass on, this gives the fewest
zones.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipload.errors import InputError
from chipload.stability.speeds import ALIKE, QuietSpeeds

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class SpeedZone:
    """Passes ``first`` to ``last``, both among them, at ``speed`` [rad/s]; ``margin`` is their least."""

    first: int
    last: int
    speed: float
    margin: float


def speed_zones(speed: ArrayLike, margin: ArrayLike, wanted: float, present: ArrayLike) -> tuple[SpeedZone, ...]:
    """Return the fewest zones, in the order of the passes.

    Parameters
    ----------
    speed : (s,) float [rad/s], rising
    margin : (p, s) float
    wanted : required margin
    present : (p,) float [rad/s], the speed of each pass now: of speeds that are as good the nearest is taken

    Raises
    ------
    InputError
        Shapes do not agree, or there is no pass.

    Examples
    --------
    Two passes that are quiet at different speeds, and a third that is quiet at both:

    >>> speed_zones([1.0, 2.0, 3.0], [[2.0, 0.5, 0.5], [2.0, 0.5, 2.0], [0.5, 0.5, 2.0]], 1.0, [2.0, 2.0, 2.0])
    (SpeedZone(first=0, last=1, speed=1.0, margin=2.0), SpeedZone(first=2, last=2, speed=3.0, margin=2.0))
    """
    speeds, margins, now = (np.asarray(x, dtype=np.float64) for x in (speed, margin, present))
    if margins.ndim != 2 or margins.shape != (len(now), len(speeds)) or not margins.size:
        raise InputError(
            f"speed zones: margins of shape {margins.shape} for {len(now)} passes and {len(speeds)} speeds: need one "
            "for each pass at each speed"
        )
    greatest = margins.max(axis=1)
    least_margin = np.minimum(greatest, max(float(greatest.min()), wanted)) * (1.0 - ALIKE)
    good = margins >= least_margin[:, None]
    out, first = [], 0
    while first < len(margins):
        common, last = good[first].copy(), first
        while last + 1 < len(margins) and (common & good[last + 1]).any():
            last += 1
            common &= good[last]
        least = margins[first : last + 1].min(axis=0)
        quiet = QuietSpeeds(speeds, np.where(common, least, 0.0), wanted)
        best, found = quiet.advised(float(np.median(now[first : last + 1])))
        out.append(SpeedZone(first, last, best, found))
        first = last + 1
    return tuple(out)
