"""How the worst value of a load depends on the feed of its step.

Notation: k new feed over the old one; h thickest chip of a step [mm]; e edge force over the cutting force of a chip of
1 mm; m exponent of the size effect; r part of h that runout makes, which does not depend on the feed [mm]. Edge forces
do not depend on the feed, what a chip adds does:

    V(k) / V(1) = c + (1 - c) k^(1 - m),    c = (e + r') / (e + h'),    h' = h^(1 - m)

Teeth in the cut have chips between MEAN h and h, and directions have their own e: the ratio is between its values at
the ends of these ranges.

Reference: [Altintas2012] ch. 2.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]

#: least mean chip of the teeth in the cut over the thickest one; 0.5 where it rises evenly from 0, 0.64 in a slot
MEAN = 0.5
#: halvings of the range of a feed that is sought
HALVINGS = 40


@dataclass(frozen=True)
class FeedLaw:
    """Range in which the value of a load at another feed lies.

    Parameters
    ----------
    edge_low, edge_high : least and greatest e of the directions that count
    exponent : greatest m of them
    runout_mm : r, at most

    Raises
    ------
    ValueError
        A number is not finite, or the exponent is not from 0 to below 1.
    """

    edge_low: float
    edge_high: float
    exponent: float = 0.0
    runout_mm: float = 0.0

    def __post_init__(self) -> None:
        """Refuse numbers that are not finite."""
        numbers = (self.edge_low, self.edge_high, self.exponent, self.runout_mm)
        if not all(map(math.isfinite, numbers)) or not 0.0 <= self.exponent < 1.0 or self.runout_mm < 0.0:
            raise ValueError(f"feed law: {numbers} must be finite, the exponent from 0 to below 1")

    def ratios(self, factor: float, chip_mm: ArrayLike) -> tuple[Floats, Floats]:
        """Return the least and the greatest value at another feed over the value of each step.

        Parameters
        ----------
        factor : new feed over the old one, above 0 and at most 1
        chip_mm : (n,) thickest chip of each step

        >>> [float(x[0]) for x in FeedLaw(0.0, 0.0).ratios(0.5, [0.1])]
        [0.5, 0.5]
        >>> [round(float(x[0]), 3) for x in FeedLaw(0.025, 0.025).ratios(0.5, [0.1])]
        [0.6, 0.667]
        """
        h = np.asarray(chip_mm, dtype=np.float64)
        power = 1.0 - self.exponent
        thick, mean = h**power, (MEAN * h) ** power
        low = np.clip(self.edge_low / np.maximum(self.edge_low + thick, np.finfo(float).tiny), 0.0, 1.0)
        runout = np.minimum(self.runout_mm, MEAN * h) ** power if self.runout_mm > 0.0 else np.zeros_like(h)
        with np.errstate(divide="ignore", invalid="ignore"):
            high = np.where(h > 0.0, (self.edge_high + runout) / (self.edge_high + mean), 1.0)
        high = np.clip(high, low, 1.0)
        return low + (1.0 - low) * factor, high + (1.0 - high) * factor**power

    def greatest_factor(
        self,
        values: Floats,
        limit: float,
        chip_mm: Floats,
        least: float,
        error: Callable[[float], float],
        sure: bool = True,
    ) -> float | None:
        """Return the greatest feed factor, at most 1, at which no value is above the limit; None: none from ``least``.

        Parameters
        ----------
        values : (n,) nominal
        error : what a value may be at a feed factor over its nominal one
        sure : by the greatest ratio; else by the mean of the least and the greatest

        >>> FeedLaw(0.0, 0.0).greatest_factor(np.array([200.0]), 150.0, np.array([0.1]), 0.2, lambda k: 1.0)
        0.75
        """

        def all_hold(k: float) -> bool:
            low, high = self.ratios(k, chip_mm)
            return bool((values * error(k) * (high if sure else 0.5 * (low + high)) <= limit).all())

        if not all_hold(least):
            return None
        low, high = least, 1.0
        if all_hold(high):
            return high
        for _ in range(HALVINGS):
            k = 0.5 * (low + high)
            low, high = (k, high) if all_hold(k) else (low, k)
        return round(low, 9)
