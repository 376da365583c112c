"""Simulation and verification of a Program, independent of the planner."""

from __future__ import annotations

from typing import TYPE_CHECKING

from chipload.lazy import attach

if TYPE_CHECKING:
    from chipload.simulation.centre_path import CentrePath
    from chipload.simulation.checkpoint import Checkpoint
    from chipload.simulation.chip_space import flute_fill
    from chipload.simulation.chips import remove
    from chipload.simulation.removal import Removal, Resolution
    from chipload.simulation.steps import Steps, steps_of
    from chipload.simulation.surface import Collision, Difference
    from chipload.simulation.verify import verify_contour

__all__ = [
    "CentrePath",
    "Checkpoint",
    "Collision",
    "Difference",
    "Removal",
    "Resolution",
    "Steps",
    "flute_fill",
    "remove",
    "steps_of",
    "verify_contour",
]

__getattr__, __dir__ = attach(
    __name__,
    {
        "chips": "remove",
        "removal": "Removal Resolution",
        "steps": "Steps steps_of",
        "surface": "Collision Difference",
        "verify": "verify_contour",
        "checkpoint": "Checkpoint",
        "centre_path": "CentrePath",
        "chip_space": "flute_fill",
    },
)
