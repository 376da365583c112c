"""How a long call tells where it is, and how it is stopped."""

from __future__ import annotations

from collections.abc import Callable

#: ``progress(done, what)`` with ``done`` in 0..1. It may raise :class:`chipload.errors.Cancelled` (or let
#: ``KeyboardInterrupt`` pass) to stop the call; what was finished is kept by the caller.
Progress = Callable[[float, str], None]


def silent(done: float, what: str) -> None:
    """Report nothing: the default of every ``progress=`` argument."""
