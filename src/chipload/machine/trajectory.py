"""Settings of LinuxCNC's trajectory planner, as stated in a configuration."""

from __future__ import annotations

import math
from dataclasses import dataclass

from chipload.errors import InputError


@dataclass(frozen=True)
class TrajectoryPlanner:
    """Settings of LinuxCNC's trajectory planner.

    Parameters
    ----------
    cycle : period of the servo thread [s], > 0 (`[EMCMOT] SERVO_PERIOD`)
    blend_arcs : whether corners have blend arcs (`[TRAJ] ARC_BLEND_ENABLE`); else they have parabolic blends
    lookahead : number of segments of look-ahead, >= 2 (`ARC_BLEND_OPTIMIZATION_DEPTH`)
    gap_cycles : cycles; the rest of a line that takes less time becomes part of the blend (`ARC_BLEND_GAP_CYCLES`)
    ramp_frequency : a segment shorter than one period of it has a linear speed ramp [1/s], > 0 (`ARC_BLEND_RAMP_FREQ`)
    kink_ratio : greatest share of the acceleration at a kink that counts as smooth (`ARC_BLEND_KINK_RATIO`)
    override : greatest feed override for which the planner plans, >= 1 (`[DISPLAY] MAX_FEED_OVERRIDE`)

    Raises
    ------
    InputError
        A number is out of range.
    """

    cycle: float = 1e-3
    blend_arcs: bool = True
    lookahead: int = 50
    gap_cycles: float = 4.0
    ramp_frequency: float = 100.0
    kink_ratio: float = 0.1
    override: float = 1.0

    def __post_init__(self) -> None:
        ranges = {
            "cycle": (1e-6, 1.0),
            "lookahead": (2, 100_000),
            "gap_cycles": (0.0, 1e6),
            "ramp_frequency": (1e-6, 1e9),
            "kink_ratio": (1e-3, 0.7071),
            "override": (1.0, 1000.0),
        }
        for key, (low, high) in ranges.items():
            value = getattr(self, key)
            if not (math.isfinite(value) and low <= value <= high):
                raise InputError(f"trajectory planner: {key} = {value:g}: must be from {low:g} to {high:g}")
