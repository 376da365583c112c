"""Jobs that fit force coefficients to measured forces."""

from __future__ import annotations

from typing import TYPE_CHECKING

from chipload.lazy import attach

if TYPE_CHECKING:
    from chipload.jobs.fit.job import FitJob
    from chipload.jobs.fit.outcome import Comparison, FitResult, MeasuredForces

__all__ = ["Comparison", "FitJob", "FitResult", "MeasuredForces"]

__getattr__, __dir__ = attach(
    __name__,
    {
        "job": "FitJob",
        "outcome": "Comparison FitResult MeasuredForces",
    },
)
