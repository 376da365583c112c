"""Drafts of jobs: what a file states, written as a job whose guesses the user confirms."""

from __future__ import annotations

from typing import TYPE_CHECKING

from chipload.lazy import attach

if TYPE_CHECKING:
    from chipload.jobs.drafts.draft import write_draft
    from chipload.jobs.drafts.make import draft_of
    from chipload.jobs.drafts.templates import write_template

__all__ = ["draft_of", "write_draft", "write_template"]

__getattr__, __dir__ = attach(
    __name__,
    {
        "draft": "write_draft",
        "make": "draft_of",
        "templates": "write_template",
    },
)
