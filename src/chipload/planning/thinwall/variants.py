"""Three plans for one wall: variable depths, a constant depth under the same limit, a constant depth without it.

The constant one is the least depth that the last passes bear, in the fewest equal passes; those need less than it, so
that the wall gives way less than it may. Variable depths are then held to what the constant ones reach, so that both
are compared at one deflection; they may be held to less, where a simulation finds that the constant ones reach less.
Without the limit the depth is the greatest that is allowed.

The sides are cut alternately or one after the other, whichever leaves fewer passes; at as many, whichever needs the
least normal force: each choice is planned, and named.

Reference: [Yan2018] for the comparison.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from chipload.planning.thinwall.law import Law
from chipload.planning.thinwall.passes import Bears, Order, Plan, constant, least_first_depth, variable
from chipload.planning.thinwall.wall import Surface
from chipload.progress import Progress, silent

NAMES = ("variable", "constant", "unconstrained")


@dataclass(frozen=True, eq=False)
class Variant:
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


def variants(
    surfaces: Sequence[Surface],
    bears_at: Callable[[float], Bears],
    law: Law,
    even_law: Law,
    slope: float,
    deflection: float,
    factor: float = 1.0,
    progress: Progress = silent,
) -> Mapping[str, Variant]:
    """The three plans by name.

    Parameters
    ----------
    surfaces : one or two sides
    bears_at : deflection [mm] -> thresholds of a side in a state, ``factor`` in them
    law, even_law : of stock with the slope, and of even stock
    slope : L of the variable depths
    deflection : [mm] that is allowed
    factor : share of the thresholds that is used

    Raises
    ------
    InputError
        A place bears not even the smallest depth by constant passes, or the passes do not end.
    """
    allowed = bears_at(deflection)
    least = max(least_first_depth(surfaces, allowed, even_law), law.limits.smallest)
    even = _better(surfaces, lambda order: constant(surfaces, allowed, even_law, least, order=order), deflection)
    progress(0.3, "constant depth")
    reached = even.plan.deflection_max
    held = deflection if reached is None or not even.plan.holds else min(reached / factor, deflection)
    uneven = held_to(surfaces, bears_at, law, slope, held)
    progress(0.9, "variable depth")
    deepest = law.limits.greatest
    free = _better(
        surfaces, lambda order: constant(surfaces, allowed, even_law, deepest, "unconstrained", order), float("inf")
    )
    return {"variable": uneven, "constant": even, "unconstrained": free}


def held_to(
    surfaces: Sequence[Surface], bears_at: Callable[[float], Bears], law: Law, slope: float, deflection: float
) -> Variant:
    """Variable depths under thresholds that allow ``deflection`` [mm]."""
    bears = bears_at(deflection)
    return _better(surfaces, lambda order: variable(surfaces, bears, law, slope, order=order), deflection)


def _better(surfaces: Sequence[Surface], made: Callable[[Order], Plan], deflection: float) -> Variant:
    one = made("alternately")
    if len(surfaces) == 1:
        return Variant(one, deflection, "alternately", None)
    other = made("one after the other")
    if (len(other.passes), other.force_max) < (len(one.passes), one.force_max) and other.holds >= one.holds:
        return Variant(other, deflection, "one after the other", len(one.passes))
    return Variant(one, deflection, "alternately", len(other.passes))
