"""Finished parts of a long plan, stored so that a resumed run does not plan them again.

Parts that do not depend on one another are announced in advance. Where there are other processes, they are planned in
parallel.
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
    key : as for :class:`Keep`
    make : a function of a module or class; its first argument is the data that all processes share
    arguments : its other arguments
    """

    key: tuple[object, ...]
    make: Callable[..., Any]
    arguments: tuple[Any, ...]

    def of(self, shared: Any, keep: Keep) -> Any:
        """The part, stored or planned with the data that all processes share."""
        return keep(self.key, lambda: self.make(shared, *self.arguments))


class Keep(Protocol):
    """Source of the parts of a plan: a stored part, or the one that ``make`` plans.

    ``key``: numbers, texts, arrays and dataclasses of them that identify the part of the run and its inputs.
    """

    def __call__(self, key: tuple[object, ...], make: Callable[[], T]) -> T:
        """The part."""

    def ahead(self, parts: Sequence[PlanTask], progress: Progress = silent) -> None:
        """Announce the parts that are needed next: planned in parallel where there are other processes, else on
        request.
        """


class Anew:
    """A :class:`Keep` that stores nothing: the default of every ``keep=`` argument.

    >>> anew(("sum",), lambda: 1 + 1)
    2
    """

    def __call__(self, key: tuple[object, ...], make: Callable[[], T]) -> T:
        """The part that ``make`` plans."""
        return make()

    def ahead(self, parts: Sequence[PlanTask], progress: Progress = silent) -> None:
        """Nothing: each part is planned on request."""


anew = Anew()
