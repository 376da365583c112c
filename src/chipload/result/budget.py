"""Error budget of a load: what its value may be at a confidence, its parts, and the statement that would make it less.

Notation: L nominal value; b bounds of its error, r rise, u standard deviations, all relative to L; z the one-sided
normal quantile of the confidence c. Bounds add linearly, the rise multiplies, independent random parts add as the root
of their squares:

    value at c = L (1 + sum b) (1 + r) exp(z sqrt(sum u^2)),    at c = 0.5: L (1 + sum b)

exp, as coefficients are positive: at 3 % it is 1 + z u. At 0.5 what is not known counts neither way.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from statistics import NormalDist

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipload.number_text import number_text

#: confidence of the value that is shown beside the nominal one where limits are held at the nominal one
SHOWN = 0.95


@dataclass(frozen=True)
class ErrorPart:
    """A part of an error budget, relative to the nominal value.

    Parameters
    ----------
    name : in words
    bound : its greatest size; it adds linearly
    rise : what it adds on average; it multiplies
    deviation : standard deviation
    remedy : what the user can state to make it less; empty: nothing
    grows : whether it grows as chips become thinner, in the ratio in which the value falls

    Raises
    ------
    ValueError
        A number is below 0 or not finite.
    """

    name: str
    bound: float = 0.0
    rise: float = 0.0
    deviation: float = 0.0
    remedy: str = ""
    grows: bool = False

    def __post_init__(self) -> None:
        if not all(math.isfinite(x) and x >= 0.0 for x in (self.bound, self.rise, self.deviation)):
            raise ValueError(f"error part {self.name}: its numbers must be finite and at least 0: {self}")

    def alone(self, confidence: float) -> float:
        """What the part would add if it were the only one, relative.

        >>> round(ErrorPart("coefficients", deviation=0.1).alone(0.95), 3)
        0.179
        """
        return _factor((self,), confidence) - 1.0


@dataclass(frozen=True)
class ErrorBudget:
    """The error of a load by its parts.

    Parameters
    ----------
    confidence : one-sided, at which the limit is held; 0.5: at the nominal value
    parts : of the error; kept are those that add something, the greatest first

    Examples
    --------
    >>> own = ErrorBudget(0.95, (ErrorPart("resolution", bound=0.02), ErrorPart("coefficients", deviation=0.1)))
    >>> round(own.value(150.0), 1), own.parts_text(150.0)
    (180.4, 'coefficients 27, resolution 3')
    """

    confidence: float
    parts: tuple[ErrorPart, ...]

    def __post_init__(self) -> None:
        if not 0.5 <= self.confidence < 1.0:
            raise ValueError(f"confidence = {self.confidence}: must be at least 0.5 and below 1")
        object.__setattr__(self, "parts", tuple(part for part, _ in self.in_order()))

    @property
    def shown_at(self) -> float:
        """The confidence of the value that is shown: that of the limit, or :data:`SHOWN` where it is 0.5."""
        return self.confidence if self.confidence > 0.5 else SHOWN

    def value(self, nominal: float, confidence: float | None = None, *, least: bool = False) -> float:
        """Return what a nominal value may be at a confidence, that of the limit if none is given.

        Parameters
        ----------
        least : whether the limit is the least value that is allowed, so that a smaller value is worse
        """
        factor = _factor(self.parts, self.confidence if confidence is None else confidence)
        return nominal / factor if least else nominal * factor

    def at_feed(self, ratio: float) -> ErrorBudget:
        """Return the budget at another feed, at which the nominal value is ``ratio`` times as great: parts that grow as
        chips become thinner stay as great as they were.
        """
        parts = (
            replace(part, rise=part.rise / ratio, deviation=part.deviation / ratio) if part.grows else part
            for part in self.parts
        )
        return ErrorBudget(self.confidence, tuple(parts))

    def in_order(self, confidence: float | None = None) -> list[tuple[ErrorPart, float]]:
        """Return the parts that add something and what each adds alone, relative, the greatest first."""
        level = self.shown_at if confidence is None else confidence
        own = [(part, part.alone(level)) for part in self.parts]
        return sorted(((part, x) for part, x in own if x > 0.0), key=lambda each: (-each[1], each[0].name))

    def parts_text(self, nominal: float) -> str:
        """Return the parts that make at least a percent of the value, in falling order, in the unit of the value."""
        order = self.in_order()
        least = 0.01 * abs(nominal)
        shown = [(part.name, x * abs(nominal)) for part, x in order if x * abs(nominal) >= least] or [
            (part.name, x * abs(nominal)) for part, x in order[:1]
        ]
        return ", ".join(f"{name} {number_text(x, 2)}" for name, x in shown)

    def remedy(self, nominal: float, limit: float, *, least: bool = False) -> tuple[ErrorPart | None, str]:
        """Return the part that alone takes the value beyond its limit, and the one statement that brings the value
        within it, or does most for it; None: more than one part does, or nothing can be stated for it; empty: no
        statement does.

        >>> fit = ErrorPart("coefficients", deviation=0.1, remedy="fit them")
        >>> own = ErrorBudget(0.95, (fit, ErrorPart("turns", deviation=0.015)))
        >>> part, text = own.remedy(180.0, 190.0)
        >>> part.name, text
        ('coefficients', 'fit them')
        """
        settling = []
        for part in self.parts:
            rest = ErrorBudget(self.confidence, tuple(p for p in self.parts if p is not part))
            value = rest.value(nominal, least=least)
            if value >= limit if least else value <= limit:
                settling.append(part)
        stated = [part for part in settling if part.remedy] or [part for part in self.parts if part.remedy]
        if not stated:
            return None, ""
        text = max(stated, key=lambda part: part.alone(self.confidence)).remedy
        return (settling[0] if len(settling) == 1 and settling[0].remedy else None), text


def _factor(parts: tuple[ErrorPart, ...], confidence: float) -> float:
    bounds = sum(part.bound for part in parts)
    rise = math.prod(1.0 + part.rise for part in parts) - 1.0
    deviation = math.sqrt(sum(part.deviation**2 for part in parts))
    return float(factor_at(confidence, bounds, rise, deviation))


def factor_at(confidence: float, bounds: ArrayLike, rise: ArrayLike, deviation: ArrayLike) -> NDArray[np.float64]:
    """Return what values may be at a confidence over their nominal ones: the formula of this module.

    Parameters
    ----------
    bounds : (n,) or a number, sum of the bounds
    rise, deviation : likewise; the deviation of independent parts is the root of the sum of their squares

    >>> factor_at(0.95, [0.02, 0.02], 0.0, [0.1, 0.0]).round(3).tolist()
    [1.202, 1.02]
    """
    known = 1.0 + np.asarray(bounds, dtype=np.float64)
    if confidence <= 0.5:
        return np.asarray(known + np.zeros(np.broadcast(bounds, rise, deviation).shape))
    quantile = NormalDist().inv_cdf(confidence)
    return np.asarray(known * (1.0 + np.asarray(rise)) * np.exp(quantile * np.asarray(deviation)))


def level_text(confidence: float) -> str:
    """Return a confidence in words.

    >>> level_text(0.95), level_text(0.995)
    ('95 %', '99.5 %')
    """
    return f"{number_text(100.0 * confidence, 6)} %"
