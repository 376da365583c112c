"""Impeller jobs: they find the largest cutters of an impeller, plan its programs and check them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from chipload.lazy import attach

if TYPE_CHECKING:
    from chipload.jobs.impeller.job import ImpellerJob
    from chipload.jobs.impeller.outcome import ImpellerResult

__all__ = ["ImpellerJob", "ImpellerResult"]

__getattr__, __dir__ = attach(
    __name__,
    {
        "job": "ImpellerJob",
        "outcome": "ImpellerResult",
    },
)
