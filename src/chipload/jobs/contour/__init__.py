"""Contour jobs: they plan contours and pockets in the plane, write the programs and check them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from chipload.lazy import attach

if TYPE_CHECKING:
    from chipload.jobs.contour.job import ContourJob
    from chipload.jobs.contour.outcome import ContourResult

__all__ = ["ContourJob", "ContourResult"]

__getattr__, __dir__ = attach(
    __name__,
    {
        "job": "ContourJob",
        "outcome": "ContourResult",
    },
)
