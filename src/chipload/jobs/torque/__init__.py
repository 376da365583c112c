"""Jobs that limit the torque on a thin tube, a cone or a workpiece, and compare controllers."""

from __future__ import annotations

from typing import TYPE_CHECKING

from chipload.lazy import attach

if TYPE_CHECKING:
    from chipload.jobs.torque.job import TorqueJob
    from chipload.jobs.torque.outcome import ControlComparison, ControllerRun, TorqueResult

__all__ = ["ControlComparison", "ControllerRun", "TorqueJob", "TorqueResult"]

__getattr__, __dir__ = attach(
    __name__,
    {
        "job": "TorqueJob",
        "outcome": "ControlComparison ControllerRun TorqueResult",
    },
)
