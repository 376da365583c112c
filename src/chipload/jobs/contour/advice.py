"""Greatest engagement within all limits of a job (`engagement_deg = "limit"`).

It is the greatest engagement at which every stated limit and every default check holds at the feed, the speed and the
depth of the operation, wherever on the front half of the rim the stock lies: at the wall, in the middle, at the other
side. So a path that keeps the engagement keeps the limits.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chipload.checking.default_checks import DefaultChecks, default_limits, stated_limits
from chipload.cutter.cutter import Cutter
from chipload.cutting.material import Material
from chipload.engagement.contact import PIECES, Engagement
from chipload.errors import InputError
from chipload.jobs.contour.outcome import PLANNED_ERRORS
from chipload.jobs.contour.tables import OperationTable
from chipload.machine.machine import Machine
from chipload.number_text import number_text
from chipload.planning.cost import CutConditions, cost
from chipload.result import LimitCheck, Verdict
from chipload.units import mm_s_from_mm_min, rad_s_from_rpm

Floats = NDArray[np.float64]

#: range of the engagements [deg]: those that the planner takes
LEAST_DEG, GREATEST_DEG = 2.0, 150.0
#: places of the stock on the front half of the rim, from one wall to the other
PLACES = 25
#: spacing of the tested engagements [deg], and the accuracy of the answer
APART_DEG, CLOSE_DEG = 2.0, 1e-3


@dataclass(frozen=True)
class EngagementAdvice:
    """The greatest engagement [rad] within all limits, and the limit that the next greater one exceeds."""

    engagement: float
    text: str


def greatest_engagement(
    op: OperationTable,
    cutter: Cutter,
    material: Material,
    machine: Machine,
    limits: Mapping[str, float],
    checks: DefaultChecks,
    rigid: tuple[float, float],
) -> EngagementAdvice:
    """Greatest engagement at which every limit holds.

    Raises
    ------
    InputError
        Not even the least engagement that the planner takes holds.
    """
    depth = op.axial_depth_mm
    if op.depth_mm is not None and op.levels_mm is None:
        depth = op.depth_mm / math.ceil(op.depth_mm / op.axial_depth_mm - 1e-9)
    cut = CutConditions(cutter, material, depth, rad_s_from_rpm(op.speed_rpm), op.milling, *rigid)
    feed = mm_s_from_mm_min(op.feed_mm_min)

    def limit_exceeded_at(degrees: float) -> LimitCheck | None:
        return _exceeded_limit(cut, feed, math.radians(degrees), limits, checks, machine)

    most = min(GREATEST_DEG, limits.get("engagement_deg", GREATEST_DEG))
    # the rigid model needs a radial depth that is not too small: what holds need not hold below it
    candidates = [most, *np.arange(math.ceil(most / APART_DEG) - 1, 0, -1) * APART_DEG]
    by, high = None, most
    for low in (float(x) for x in candidates if x >= LEAST_DEG):
        found = limit_exceeded_at(low)
        if found is None:
            break
        by, high = found, low
    else:
        why = "" if by is None else f": {_limit_text(by)}"
        raise InputError(
            f"operation.engagement_deg = 'limit': no engagement from {LEAST_DEG:g} deg keeps the limits{why}: lower "
            "feed_mm_min or axial_depth_mm"
        )
    if by is None:
        what = (
            "limits.engagement_deg" if most < GREATEST_DEG else "no limit below the greatest engagement that is planned"
        )
        return EngagementAdvice(math.radians(most), f"engagement {most:.4g} deg, by {what}")
    while high - low > CLOSE_DEG:
        middle = 0.5 * (low + high)
        found = limit_exceeded_at(middle)
        if found is None:
            low = middle
        else:
            high, by = middle, found
    return EngagementAdvice(math.radians(low), f"engagement {low:.4g} deg, by {_limit_text(by)}")


def _limit_text(check: LimitCheck) -> str:
    """A limit that does not hold, with its value."""
    value = "" if check.worst is None else f" {check.worst_text} of {number_text(check.limit, 6)}"
    return f"{check.name}{value}{f', {check.reason}' if check.reason else ''}"


def _exceeded_limit(
    cut: CutConditions,
    feed: float,
    angle: float,
    limits: Mapping[str, float],
    checks: DefaultChecks,
    machine: Machine,
) -> LimitCheck | None:
    """The first limit that does not hold at an engagement; None: all hold."""
    begin = np.linspace(0.0, math.pi - angle, PLACES)
    phi = np.zeros((PLACES, PIECES, 2))
    phi[:, 0, 0], phi[:, 0, 1] = begin, begin + angle
    engagement = Engagement(np.full(PLACES, angle), np.ones(PLACES, dtype=np.int64), phi)
    zero, ahead = np.zeros(PLACES), np.tile([1.0, 0.0], (PLACES, 1))
    wall = np.arange(PLACES) == (PLACES - 1 if cut.milling == "down" else 0)
    zone = np.full(PLACES, "pocket", dtype=object)
    columns = dict(
        cost(cut, zone, zero, zero, np.zeros((PLACES, 2)), ahead, 0.0, engagement, np.full(PLACES, feed), wall)
    )
    columns["tool"] = np.full(PLACES, cut.cutter.number)
    own = {name: limit for name, limit in limits.items() if name != "engagement_deg"}
    found = stated_limits(checks, own, columns, "", PLANNED_ERRORS)
    found += default_limits(checks, machine, columns, "", PLANNED_ERRORS)
    return next((c for c in found if c.state is not Verdict.HOLDS), None)
