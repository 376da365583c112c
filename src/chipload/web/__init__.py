"""The page in the browser: results and jobs of one folder, on this computer only."""

from __future__ import annotations

from typing import TYPE_CHECKING

from chipload.lazy import attach

if TYPE_CHECKING:
    from chipload.web.result import open_result

__all__ = ["open_result"]

__getattr__, __dir__ = attach(
    __name__,
    {
        "result": "open_result",
    },
)
