"""Three plans for one wall: variable depths, a constant depth under the same limit, a constant depth without it.

The constant one is the least depth that the last passes bear, in the fewest equal passes; those need less than it, so
that the wall gives way less than it may. Variable depths are then held to what the constant ones reach, so that both
are compared at one deflection. Without the limit the depth is the greatest that is allowed.

The sides are cut alternately or one after the other, whichever leaves fewer passes; at as many, whichever needs the
least normal force: each choice is planned, and named.

Reference: [Yan2018] for the comparison.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chipload.planning.thinwall.blank import FinishSurface
from chipload.planning.thinwall.force_table import ForceTable
from chipload.planning.thinwall.passes import Order, Plan, ThresholdOf, constant, least_first_depth, variable

Corrections = Sequence[NDArray[np.float64]] | None

NAMES = ("variable", "constant", "unconstrained")


@dataclass(frozen=True, eq=False)
class PlannedVariant:
    """A plan and what it was planned under.

    Attributes
    ----------
    plan : its passes
    deflection : [mm] that its thresholds allow; infinite without the limit
    order : of the sides
    passes_otherwise : passes in the other order; None: it has one side
    """

    plan: Plan
    deflection: float
    order: Order
    passes_otherwise: int | None


def unlimited(surfaces: Sequence[FinishSurface], threshold_of: ThresholdOf, law: ForceTable) -> PlannedVariant:
    """Passes of the greatest depth of the law, whatever the wall bears."""
    deepest = law.limits.greatest
    return _better(
        surfaces, lambda order: constant(surfaces, threshold_of, law, deepest, "unconstrained", order), math.inf
    )


def even(
    surfaces: Sequence[FinishSurface],
    threshold_of: ThresholdOf,
    law: ForceTable,
    deflection: float,
    corrections: Corrections = None,
) -> PlannedVariant:
    """Equal passes of the depth that every place bears in the last ones, at least the smallest of the law.

    Parameters
    ----------
    surfaces : one or two sides
    threshold_of : thresholds that allow ``deflection`` [mm]
    law : of even stock
    corrections : of its forces, side by side
    """
    least = max(least_first_depth(surfaces, threshold_of, law, corrections), law.limits.smallest)
    return _better(
        surfaces,
        lambda order: constant(surfaces, threshold_of, law, least, order=order, corrections=corrections),
        deflection,
    )


def limited_to(
    surfaces: Sequence[FinishSurface],
    threshold_of: ThresholdOf,
    law: ForceTable,
    slope: float,
    deflection: float,
    corrections: Corrections = None,
) -> PlannedVariant:
    """Variable depths under thresholds that allow ``deflection`` [mm]; ``corrections`` of the law's forces."""
    return _better(
        surfaces,
        lambda order: variable(surfaces, threshold_of, law, slope, order=order, corrections=corrections),
        deflection,
    )


def _better(surfaces: Sequence[FinishSurface], made: Callable[[Order], Plan], deflection: float) -> PlannedVariant:
    one = made("alternately")
    if len({s.wall for s in surfaces}) == len(surfaces):
        return PlannedVariant(one, deflection, "alternately", None)
    other = made("one after the other")
    if (len(other.passes), other.force_max) < (len(one.passes), one.force_max) and other.holds >= one.holds:
        return PlannedVariant(other, deflection, "one after the other", len(one.passes))
    return PlannedVariant(one, deflection, "alternately", len(other.passes))
