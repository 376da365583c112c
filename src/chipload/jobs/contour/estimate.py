"""Estimate of the time and memory to plan pockets.

A step of a pass along a straight front clears the radial depth times the step; levels share one path. The processor
time of a run without its start, for each such step, is 0.12 to 0.71 ms on the example `pocket` and on eight drawings of
others (gear, octagon, square2, taper, text, thrash, triceratops, wrench). It grows with the corners and narrow places
of a pocket, where passes overlap. The estimate states this range with a factor of 2 on both sides;
`benchmarks/pocket_estimate.py FILE ...` measures it.
"""

from __future__ import annotations

from collections.abc import Iterable

from chipload.planning.pocket.clearing import STEP
from chipload.planning.pocket.request import Clearing
from chipload.simulation.estimate import estimate

#: processor time of a step [s], least and greatest: half and twice what was measured
QUICK, SLOW = 0.05e-3, 1.5e-3


def clearing_estimate(cleared: Iterable[tuple[float, Clearing, float]]) -> list[str]:
    """Steps, memory and processor time, as a line; none where nothing is cleared.

    Parameters
    ----------
    cleared : area [mm^2], the request, and radius of the cutter [mm] of each pocket
    """
    steps = sum(
        len(request.strategies) * area / (request.radial_depth * min(request.step, STEP * radius))
        for area, request, radius in cleared
    )
    return [estimate(round(steps), 0, QUICK, SLOW, coarse=False)] if steps else []
