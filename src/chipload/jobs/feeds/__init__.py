"""Jobs that give a program new feeds: new F words, simulated again."""

from __future__ import annotations

from typing import TYPE_CHECKING

from chipload.lazy import attach

if TYPE_CHECKING:
    from chipload.jobs.feeds.job import FeedsJob
    from chipload.jobs.feeds.outcome import FeedResult, FeedsProgram

__all__ = ["FeedResult", "FeedsJob", "FeedsProgram"]

__getattr__, __dir__ = attach(
    __name__,
    {
        "job": "FeedsJob",
        "outcome": "FeedResult FeedsProgram",
    },
)
