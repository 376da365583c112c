"""Jobs that hold the torque on a thin tube or cone by a feed override, and compare controllers."""

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
