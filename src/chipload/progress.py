"""How a long call tells where it is, and how it is stopped."""

from __future__ import annotations

from collections.abc import Callable

#: ``progress(done, what)`` with ``done`` in 0..1. It may raise :class:`chipload.errors.Cancelled` (or let
#: ``KeyboardInterrupt`` pass) to stop the call; what was finished is kept by the caller.
Progress = Callable[[float, str], None]


def silent(done: float, what: str) -> None:
    """Report nothing: the default of every ``progress=`` argument."""


def part_of(progress: Progress, begin: float, end: float) -> Progress:
    """The progress of a part of a call, which goes on from ``begin`` to ``end`` of the whole.

    >>> part_of(lambda done, what: print(f"{done:g} {what}"), 0.5, 0.75)(0.5, "chips")
    0.625 chips
    """
    return lambda done, what: progress(begin + (end - begin) * done, what)
