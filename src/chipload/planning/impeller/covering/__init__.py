"""Certification of a range of a cutter between the check points."""

from __future__ import annotations

from typing import TYPE_CHECKING

from chipload.lazy import attach

if TYPE_CHECKING:
    from chipload.planning.impeller.covering.covering import Covering, covering_of, first_edge

__all__ = ["Covering", "covering_of", "first_edge"]

__getattr__, __dir__ = attach(
    __name__,
    {
        "covering": "Covering covering_of first_edge",
    },
)
