"""How a long plan remembers its finished parts, so that a run that was stopped does not plan them again."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol, TypeVar

T = TypeVar("T")


class Keep(Protocol):
    """What gives a part of a plan: the kept one, or the one that ``make`` makes.

    ``key``: numbers, texts, arrays and dataclasses of them that say which part of the run it is and what it depends on.
    """

    def __call__(self, key: tuple[object, ...], make: Callable[[], T]) -> T:
        """The part."""


def anew(key: tuple[object, ...], make: Callable[[], T]) -> T:
    """Nothing is kept: the default of every ``keep=`` argument.

    >>> anew(("sum",), lambda: 1 + 1)
    2
    """
    return make()
