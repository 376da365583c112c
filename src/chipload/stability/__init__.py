"""Stability of cuts: chatter margin, quiet spindle speeds, surface location error."""

from __future__ import annotations

from typing import TYPE_CHECKING

from chipload.lazy import attach

if TYPE_CHECKING:
    from chipload.stability.chart import StabilityChart, critical_depth, stability_chart
    from chipload.stability.cuts import DynamicCuts, dynamic_cuts
    from chipload.stability.grouping import CutGroups, group_steps
    from chipload.stability.margin import StabilityMargins, largest_multipliers, stability_margins
    from chipload.stability.modes import Modes
    from chipload.stability.probability import ModeSpread, stable_probability, variance_shares
    from chipload.stability.process_damping import ProcessDamping
    from chipload.stability.speeds import QuietSpeeds, SpeedWindow, quiet_speeds
    from chipload.stability.surface_error import location_error
    from chipload.stability.zones import SpeedZone, speed_zones

__all__ = [
    "CutGroups",
    "DynamicCuts",
    "ModeSpread",
    "Modes",
    "ProcessDamping",
    "QuietSpeeds",
    "SpeedWindow",
    "SpeedZone",
    "StabilityChart",
    "StabilityMargins",
    "critical_depth",
    "dynamic_cuts",
    "group_steps",
    "largest_multipliers",
    "location_error",
    "quiet_speeds",
    "speed_zones",
    "stability_chart",
    "stability_margins",
    "stable_probability",
    "variance_shares",
]

__getattr__, __dir__ = attach(
    __name__,
    {
        "chart": "StabilityChart critical_depth stability_chart",
        "cuts": "DynamicCuts dynamic_cuts",
        "grouping": "CutGroups group_steps",
        "surface_error": "location_error",
        "margin": "StabilityMargins largest_multipliers stability_margins",
        "modes": "Modes",
        "probability": "ModeSpread stable_probability variance_shares",
        "process_damping": "ProcessDamping",
        "speeds": "QuietSpeeds SpeedWindow quiet_speeds",
        "zones": "SpeedZone speed_zones",
    },
)
