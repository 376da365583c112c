"""Three plans for one wall: variable depths, a constant depth under the same limit, a constant depth without it.

All plans with the limit have the same allowed deflection. The constant depth is the least that the last passes allow,
in the fewest equal passes; these are usually less deep than that, so their deflection is below the limit. Variable
depths keep the limit itself at every place, not the deflection of the constant ones. Without the limit the depth is the
greatest of the force law.

The sides are cut alternately or one after the other, whichever gives fewer passes; if both give as many, whichever
needs the lesser normal force. Both orders are planned, and the plan names its order.

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
from chipload.planning.thinwall.passes import (
    Order,
    Plan,
    PlanOf,
    ThresholdOf,
    constant,
    in_operations,
    least_first_depth,
    variable,
)

Corrections = Sequence[NDArray[np.float64]] | None

NAMES = ("variable", "constant", "unconstrained")


@dataclass(frozen=True, eq=False)
class DepthOperation:
    """Depth planning data of an operation: thresholds, force law and limits of its cutter.

    Attributes
    ----------
    threshold_of : thresholds of the places
    law : force of its cutter
    leave : [mm] stock that it leaves on every side
    slope : greatest change of its depth along the surface
    corrections : of the law's forces, side by side
    steps : its passes leave steps, one a row
    level : its passes are level
    """

    threshold_of: ThresholdOf
    law: ForceTable
    leave: float = 0.0
    slope: float = 1.0
    corrections: Corrections = None
    steps: bool = False
    level: bool = False


@dataclass(frozen=True, eq=False)
class PlannedVariant:
    """A plan with its allowed deflection and the order of its sides.

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


def plan_without_limit(surfaces: Sequence[FinishSurface], operations: Sequence[DepthOperation]) -> PlannedVariant:
    """Passes of the greatest depth of each operation's force law, without the limit of the wall."""

    def of_order(order: Order) -> PlanOf:
        def planned(k: int, found: Sequence[FinishSurface], leave: float) -> Plan:
            one = operations[k]
            deepest = one.law.limits.greatest
            return constant(found, one.threshold_of, one.law, deepest, "unconstrained", order, leave=leave)

        return planned

    return _better(surfaces, operations, of_order, math.inf)


def even(surfaces: Sequence[FinishSurface], operations: Sequence[DepthOperation], deflection: float) -> PlannedVariant:
    """Equal passes of the depth that every place allows in the last passes of an operation, at least the smallest of
    its law.

    Parameters
    ----------
    surfaces : one or two sides of each wall
    operations : with thresholds that allow ``deflection`` [mm] and the laws of even stock
    """

    def of_order(order: Order) -> PlanOf:
        def planned(k: int, found: Sequence[FinishSurface], leave: float) -> Plan:
            one = operations[k]
            least = least_first_depth(found, one.threshold_of, one.law, one.corrections, leave)
            depth = max(least, one.law.limits.smallest)
            return constant(
                found, one.threshold_of, one.law, depth, order=order, corrections=one.corrections, leave=leave
            )

        return planned

    return _better(surfaces, operations, of_order, deflection)


def limited_to(
    surfaces: Sequence[FinishSurface], operations: Sequence[DepthOperation], deflection: float
) -> PlannedVariant:
    """Passes of variable depth within thresholds for an allowed ``deflection`` [mm]."""

    def of_order(order: Order) -> PlanOf:
        def planned(k: int, found: Sequence[FinishSurface], leave: float) -> Plan:
            one = operations[k]
            return variable(
                found,
                one.threshold_of,
                one.law,
                one.slope,
                order=order,
                corrections=one.corrections,
                leave=leave,
                steps=one.steps,
                level=one.level,
            )

        return planned

    return _better(surfaces, operations, of_order, deflection)


def _better(
    surfaces: Sequence[FinishSurface],
    operations: Sequence[DepthOperation],
    of_order: Callable[[Order], PlanOf],
    deflection: float,
) -> PlannedVariant:
    leaves = [one.leave for one in operations]
    one = in_operations(surfaces, leaves, of_order("alternately"))
    if len({s.wall for s in surfaces}) == len(surfaces):
        return PlannedVariant(one, deflection, "alternately", None)
    other = in_operations(surfaces, leaves, of_order("one after the other"))
    if (len(other.passes), other.force_max) < (len(one.passes), one.force_max) and other.holds >= one.holds:
        return PlannedVariant(other, deflection, "one after the other", len(one.passes))
    return PlannedVariant(one, deflection, "alternately", len(other.passes))
