"""Progress callback of a long call, which reports how far it is and can stop it."""

from __future__ import annotations

from collections.abc import Callable

#: ``progress(done, what)`` with ``done`` in 0..1. It may raise :class:`chipload.errors.Cancelled` (or let
#: ``KeyboardInterrupt`` pass) to stop the call; the caller keeps the finished parts.
Progress = Callable[[float, str], None]


def silent(done: float, what: str) -> None:
    """Report nothing: the default of every ``progress=`` argument."""


def part_of(progress: Progress, begin: float, end: float) -> Progress:
    """The progress of a part of a call that runs from ``begin`` to ``end`` of the whole.

    >>> part_of(lambda done, what: print(f"{done:g} {what}"), 0.5, 0.75)(0.5, "chips")
    0.625 chips
    """
    return lambda done, what: progress(begin + (end - begin) * done, what)
