"""How a long plan remembers its finished parts, so that a run that was stopped does not plan them again.

Parts that do not need one another are told ahead: where there are other processes, they are made side by side.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Protocol, TypeVar

from chipload.progress import Progress, silent

T = TypeVar("T")


@dataclass(frozen=True, eq=False)
class PlanTask:
    """A part of a plan that another process can make.

    Parameters
    ----------
    key : as of :class:`Keep`
    make : a function of a module or class; its first argument is what all processes share
    arguments : the others
    """

    key: tuple[object, ...]
    make: Callable[..., Any]
    arguments: tuple[Any, ...]

    def of(self, shared: Any, keep: Keep) -> Any:
        """The part, kept or made with what all processes share."""
        return keep(self.key, lambda: self.make(shared, *self.arguments))


class Keep(Protocol):
    """What gives a part of a plan: the kept one, or the one that ``make`` makes.

    ``key``: numbers, texts, arrays and dataclasses of them that say which part of the run it is and what it depends on.
    """

    def __call__(self, key: tuple[object, ...], make: Callable[[], T]) -> T:
        """The part."""

    def ahead(self, parts: Sequence[PlanTask], progress: Progress = silent) -> None:
        """Parts that are asked for next: made side by side where there are other processes, else when asked for."""


class Anew:
    """Nothing is kept: the default of every ``keep=`` argument.

    >>> anew(("sum",), lambda: 1 + 1)
    2
    """

    def __call__(self, key: tuple[object, ...], make: Callable[[], T]) -> T:
        """What ``make`` makes."""
        return make()

    def ahead(self, parts: Sequence[PlanTask], progress: Progress = silent) -> None:
        """Each is made when it is asked for."""


anew = Anew()
