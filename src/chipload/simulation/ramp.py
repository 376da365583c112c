"""Angle at which a cutter descends into material that lies under its centre: ramps and plunges.

Notation: d [mm] motion of the tip in a step, A the axis from the tip to the holder. The ramp angle is
atan2(-d.A, |d - (d.A) A|): 90 deg in a plunge, 0 in a level or rising motion. Material lies under the centre where the
tooth engagement begins at the axis, where the profile does; a plunge that the axis follows in air, along a side or into
a hole, has no ramp angle.

Reference: ISO 13399, RMPX (maximum ramping angle).
"""

from __future__ import annotations

import math

import numpy as np

from chipload.cutter.cutter import Cutter
from chipload.simulation.loads import Cuts, Floats

#: a profile is engaged to the axis where its engagement begins within this share of the radius
AT_AXIS = 1e-6


def ramp_angle(cuts: Cuts) -> Floats:
    """Return the column ``ramp_deg`` (c,) [deg]: the ramp angle of each step with material under the centre, else 0.

    A slice of the bottom that is engaged counts as a whole. By layers a step counts as it is in its middle: one that
    meets the material later has no ramp angle.
    """
    engagement, cutter = cuts.plain, cuts.cutter
    axis = engagement.frames[:, 2]
    d = cuts.ends[:, 3:6] - cuts.ends[:, 0:3]
    along = (d * axis).sum(axis=1)
    across = np.linalg.norm(d - along[:, None] * axis, axis=1)
    angle = np.degrees(np.arctan2(np.maximum(-along, 0.0), across))
    # the least s that is engaged; a step without engagement has no row
    least = np.full(len(cuts), math.inf)
    step = np.repeat(np.arange(len(cuts)), np.diff(engagement.start))
    np.minimum.at(least, step, engagement.rows[:, 2])
    return np.where(least <= AT_AXIS * cutter.radius - _bottom(cutter), angle, 0.0)


def _bottom(cutter: Cutter) -> float:
    """Length of the bottom line from the axis to the corner along the profile [mm]."""
    first = cutter.segments[0]
    return first.length if first.straight else 0.0
