"""The law by which the loads of a check change with the feed, from the coefficients and the runout of its cutter."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from chipload.checking.load_budget import WITH_FORCE
from chipload.cutter.cutter import Cutter
from chipload.cutting.drilling import is_pointed
from chipload.cutting.load_parts import CHIP
from chipload.cutting.material import Material
from chipload.result.feed_law import FeedLaw
from chipload.result.limits import Columns, LimitCheck

#: loads of the tangential force alone
TANGENTIAL = ("torque_nm", "torque_mean_nm", "power_w")


def feed_law_of(
    check: LimitCheck, cutters: Mapping[int, Cutter], material: Material, columns: Columns
) -> FeedLaw | None:
    """Return how the load of a check depends on the feed; None: it is no load of teeth, or its cutter is not known.

    Parameters
    ----------
    cutters : by tool number
    columns : of the track, one row for each step
    """
    name = check.column.name
    if name not in (*WITH_FORCE, *TANGENTIAL, CHIP) or check.row is None or "tool" not in columns:
        return None
    cutter = cutters.get(int(np.asarray(columns["tool"])[check.row]))
    if cutter is None or is_pointed(cutter):
        return None
    runout = 2.0 * max(cutter.runout[0], 0.0)
    if name == CHIP:
        return FeedLaw(0.0, 0.0, 0.0, runout)
    tangential = material.Kte / material.Ktc
    if name not in WITH_FORCE or material.tangential:
        return FeedLaw(tangential, tangential, material.exponents[0], runout)
    # the resultant of a tooth's force in the plane; the radial part alone is small beside it
    plane = math.hypot(material.Kte, material.Kre) / math.hypot(material.Ktc, material.Krc)
    radial = material.Kre / material.Krc if material.Krc > 0.0 else tangential
    least = max(min(tangential, radial), 0.0)
    return FeedLaw(min(least, plane), max(least, plane), max(material.exponents[:2]), runout)
