"""Estimate of the time and memory to plan pockets.

A step of a pass along a straight front clears the radial depth times the step; levels share one path. Measured on
drawings and models of others (docs/real_programs.md), in processor time without the start: 0.2 to 5.5 ms for each such
step, the more the more corners and narrow places a pocket has, whose passes overlap.
"""

from __future__ import annotations

from collections.abc import Iterable

from chipload.planning.pocket.clearing import STEP
from chipload.planning.pocket.request import Clearing
from chipload.simulation.estimate import estimate

#: processor time of a step [s], least and greatest
QUICK, SLOW = 0.15e-3, 8e-3


def clearing_estimate(cleared: Iterable[tuple[float, Clearing, float]]) -> list[str]:
    """Steps, memory and processor time, as a line; none where nothing is cleared.

    Parameters
    ----------
    cleared : area [mm^2], what is asked, and radius of the cutter [mm] of each pocket
    """
    steps = sum(
        len(asked.strategies) * area / (asked.radial_depth * min(asked.step, STEP * radius))
        for area, asked, radius in cleared
    )
    return [estimate(round(steps), 0, QUICK, SLOW, coarse=False)] if steps else []
