"""Distortion jobs: how a part springs when it is released, by the residual stress of its plate."""

from __future__ import annotations

from typing import TYPE_CHECKING

from chipload.lazy import attach

if TYPE_CHECKING:
    from chipload.jobs.distortion.job import DistortionJob
    from chipload.jobs.distortion.outcome import DistortionResult

__all__ = ["DistortionJob", "DistortionResult"]

__getattr__, __dir__ = attach(__name__, {"job": "DistortionJob", "outcome": "DistortionResult"})
