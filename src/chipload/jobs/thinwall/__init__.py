"""Thin-wall jobs: they plan the depths of cut of a thin wall, and simulate and compare the variants."""

from __future__ import annotations

from typing import TYPE_CHECKING

from chipload.lazy import attach

if TYPE_CHECKING:
    from chipload.jobs.thinwall.job import ThinWallJob
    from chipload.jobs.thinwall.outcome import ThinWallResult, Variant
    from chipload.jobs.thinwall.run import propose

__all__ = ["ThinWallJob", "ThinWallResult", "Variant", "propose"]

__getattr__, __dir__ = attach(
    __name__,
    {
        "job": "ThinWallJob",
        "outcome": "ThinWallResult Variant",
        "run": "propose",
    },
)
