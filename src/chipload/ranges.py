"""Fields of settings with a range: checked when a value is made, and shared with the tables of the job file.

A settings dataclass states default and range of a field once. Its ``__post_init__`` calls :func:`require_ranges`; the
table of the job file takes both by :func:`bounds_of`.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Iterator
from dataclasses import MISSING, Field, dataclass, field, fields
from numbers import Integral, Real
from typing import Any

from chipload.errors import InputError, InputErrors


@dataclass(frozen=True)
class Range:
    """Range of a number: limits that are excluded (``above``, ``below``) or included (``least``, ``most``).

    Parameters
    ----------
    above, least, below, most : limits; None: there is none
    whole : the number is an integer
    infinite : inf is allowed
    """

    above: float | None = None
    least: float | None = None
    below: float | None = None
    most: float | None = None
    whole: bool = False
    infinite: bool = False

    def error_of(self, value: Any) -> str:
        """Return what is wrong with a value; empty: it is within the range.

        >>> Range(above=0.0).error_of(-1.0), Range(most=3).error_of(3)
        ('must be above 0', '')
        """
        if isinstance(value, bool) or not isinstance(value, Integral if self.whole else Real):
            return f"must be a {'whole ' if self.whole else ''}number"
        if math.isnan(value) or (math.isinf(value) and not self.infinite):
            return "must be a finite number"
        limits = (
            (self.above, "above", operator.gt),
            (self.least, "at least", operator.ge),
            (self.below, "below", operator.lt),
            (self.most, "at most", operator.le),
        )
        wrong = [f"must be {word} {x:g}" for x, word, keeps in limits if x is not None and not keeps(value, x)]
        return wrong[0] if wrong else ""


def number_field(default: Any = MISSING, *, text: str = "", **limits: Any) -> Any:
    """Return a field that holds a number within a :class:`Range`, or None where that is its default.

    Parameters
    ----------
    text : what it is, for a key of the job file that is made of the field
    limits : parameters of the range
    """
    return field(default=default, metadata={"range": Range(**limits), "text": text})


def choice_field(default: Any, *choices: str) -> Any:
    """Return a field that holds one of some texts; None where its default is."""
    return field(default=default, metadata={"choices": choices})


def require_ranges(value: Any, prefix: str = "") -> None:
    """Refuse a dataclass one of whose numbers is outside its range, or whose choice is unknown.

    Parameters
    ----------
    prefix : before the names of the fields, as ``"stiffness."``

    Raises
    ------
    InputError
        A line for each field, with its value and the limit.

    Examples
    --------
    >>> @dataclass(frozen=True)
    ... class Setting:
    ...     step_mm: float = number_field(1.0, above=0.0, most=100.0)
    >>> require_ranges(Setting())
    >>> require_ranges(Setting(step_mm=200.0))
    Traceback (most recent call last):
        ...
    chipload.errors.InputError: step_mm = 200: must be at most 100
    """
    texts = [f"{prefix}{text}" for text in _errors(value)]
    if texts:
        raise InputErrors(*texts) if len(texts) > 1 else InputError(texts[0])


def _errors(value: Any) -> Iterator[str]:
    for f in fields(value):
        own = getattr(value, f.name)
        if own is None and f.default is None:
            continue
        if "range" in f.metadata and (wrong := f.metadata["range"].error_of(own)):
            yield f"{f.name} = {own:g}: {wrong}" if isinstance(own, float) else f"{f.name} = {own!r}: {wrong}"
        if "choices" in f.metadata and own not in f.metadata["choices"]:
            yield f"{f.name} = {own!r}: must be one of {', '.join(f.metadata['choices'])}"


def bounds_of(kind: type, name: str) -> dict[str, Any]:
    """Return default and range of a field of a settings dataclass, by the names that pydantic has for them.

    >>> @dataclass(frozen=True)
    ... class Setting:
    ...     step_mm: float = number_field(1.0, above=0.0, most=100.0)
    >>> bounds_of(Setting, "step_mm")
    {'default': 1.0, 'gt': 0.0, 'le': 100.0}
    """
    own: Field[Any] = next(f for f in fields(kind) if f.name == name)
    out = {} if own.default is MISSING else {"default": own.default}
    limits: Range | None = own.metadata.get("range")
    if limits is not None:
        stated = {"gt": limits.above, "ge": limits.least, "lt": limits.below, "le": limits.most}
        out |= {key: limit for key, limit in stated.items() if limit is not None}
    return out
