"""Passes over a thin wall: variable depths within the allowable force, from the finish surface outwards; constant
depths.

Notation: D_k [mm] stock that is left on a side before its pass k, D_0 = 0 the finish surface; d [mm] greatest depth of
a place within its threshold; d~ its lower Lipschitz envelope of slope L; a allowance. Passes are numbered from the
finish outwards, the order of planning. They are cut in the opposite order, the sides of a wall alternately: ... A_2 B_2
A_1 B_1. Of several walls the first one is cut first, whole.

    D_k = min(D_(k-1) + d~_k, a)      until D_k = a everywhere,

but at most a - d_min where a is not reached, so that the pass before has more than a film to cut.

The depth of pass k is the allowable one with D_(k-1) left on its side everywhere, as if the whole pass were already
cut: the most compliant state in which the pass is cut. The other side still has the stock of its own later passes.

Constant depths: the least d of the last passes, in the fewest equal passes. Unconstrained: the greatest depth of the
cutter.

Operations with cutters of their own follow one another. Each but the last leaves even stock on every side, which the
next one removes. Each is planned with its own force law, from the stock that it leaves to the stock that it finds. One
operation cuts all walls before the next one begins.

The planned force at a place is c F_n(d). The correction c of a side is the force that a simulation of an earlier plan
found there over the force of the law at the same depth; it is 1 where nothing is known.

Reference: [Yan2018]. Differs from source: thresholds of each pass by the stiffness in its own state.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from chipload.errors import InputError
from chipload.planning.thinwall.blank import FinishSurface
from chipload.planning.thinwall.envelope import lower_envelope
from chipload.planning.thinwall.force_table import ForceTable
from chipload.planning.thinwall.threshold import Threshold
from chipload.progress import Progress, silent

Floats = NDArray[np.float64]
#: threshold of the places of a side, ``(left on each side, side) -> threshold``
ThresholdOf = Callable[[Sequence[Floats], int], Threshold]

#: plan of an operation, ``(number, surfaces with the stock that it finds, stock that it leaves) -> plan``
PlanOf = Callable[[int, Sequence[FinishSurface], float], "Plan"]

#: in which order the sides are cut
Order = Literal["alternately", "one after the other"]

#: depths below this are no cut [mm]
NOTHING = 1e-9


@dataclass(frozen=True, eq=False)
class WallPass:
    """One pass over one side: stock before and after it, its force and its threshold.

    Attributes
    ----------
    side : number of the side
    low, high : (n, m) float [mm], stock after and before it
    threshold : of the places in the state after it
    force : (n, m) float [N], c F_n of its depth; 0 where nothing is cut
    exceeds : (n, m) bool, where the force is above the threshold, or the pass is deeper than the stable depth
    correction : (n, m) float, c that it was planned with
    operation : number of the operation that cuts it
    """

    side: int
    low: Floats
    high: Floats
    threshold: Threshold
    force: Floats
    exceeds: NDArray[np.bool_]
    correction: Floats
    operation: int = 0

    @property
    def depth(self) -> Floats:
        """Depth of cut, (n, m) float [mm]."""
        return np.asarray(self.high - self.low)

    @property
    def deflection(self) -> Floats | None:
        """Deflection F_n C_nn, (n, m) float [mm]; None where the compliance is not known."""
        C = self.threshold.compliance
        return None if C is None else self.force * C.reshape(self.force.shape)


@dataclass(frozen=True, eq=False)
class Plan:
    """Passes in the order in which they are cut.

    Attributes
    ----------
    name : ``variable``, ``constant`` or ``unconstrained``
    passes : in order
    infeasible : (side, i, j) of places where even the smallest depth is too great in some pass
    """

    name: str
    passes: tuple[WallPass, ...]
    infeasible: tuple[tuple[int, int, int], ...] = ()

    @property
    def holds(self) -> bool:
        """Whether no place exceeds its threshold."""
        return not any(p.exceeds.any() for p in self.passes)

    @property
    def force_max(self) -> float:
        """Greatest F_n [N]."""
        return max(float(p.force.max()) for p in self.passes)

    @property
    def deflection_max(self) -> float | None:
        """Greatest predicted deflection [mm]; None where the compliance is not known."""
        known = [p.deflection for p in self.passes]
        return max((float(x.max()) for x in known if x is not None), default=None)


def _ones(surfaces: Sequence[FinishSurface], corrections: Sequence[Floats] | None) -> tuple[Floats, ...]:
    """Corrections of each side; 1 where none are given."""
    shapes = [s.points.shape[:2] for s in surfaces]
    if corrections is None:
        return tuple(np.ones(shape) for shape in shapes)
    for c, shape in zip(corrections, shapes, strict=True):
        if c.shape != shape or not ((c > 0.0) & np.isfinite(c)).all():
            raise InputError(f"passes: a correction {c.shape}: must be above 0 at all places {shape}")
    return tuple(corrections)


def planned_pass(side: int, low: Floats, high: Floats, threshold: Threshold, law: ForceTable, c: Floats) -> WallPass:
    """A pass from the stock before it to the stock after it, with its planned force."""
    depth = high - low
    force = np.where(depth > NOTHING, c * law.force(np.maximum(depth, NOTHING)), 0.0)
    exceeds = force > threshold.force.reshape(low.shape) * (1.0 + 1e-9)
    return WallPass(side, low, high, threshold, force, exceeds | (depth > threshold.within(depth) + NOTHING), c)


def in_operations(surfaces: Sequence[FinishSurface], leaves: Sequence[float], planned: PlanOf) -> Plan:
    """Passes of all operations, one operation after another.

    Parameters
    ----------
    leaves : [mm] stock that each operation leaves on every side, in the order of cutting, falling to 0
    planned : plan of an operation by its number, of surfaces whose allowance is the stock that it finds, down to the
        stock that it leaves

    Raises
    ------
    InputError
        An operation leaves no less than it finds.
    """
    out: list[Plan] = []
    for k, low in enumerate(leaves):
        found = [s.allowance if k == 0 else leaves[k - 1] for s in surfaces]
        if not low < min(found):
            raise InputError(
                f"operation.{k}: leaves {low:g} mm of stock, finds {min(found):g} mm: must leave less than it finds"
            )
        plan = planned(k, [replace(s, allowance=a) for s, a in zip(surfaces, found, strict=True)], low)
        out.append(replace(plan, passes=tuple(replace(p, operation=k) for p in plan.passes)))
    weak = sorted({place for plan in out for place in plan.infeasible})
    return Plan(out[0].name, tuple(p for plan in out for p in plan.passes), tuple(weak))


def in_steps(values: Floats) -> Floats:
    """Stock (n, m), lowered so that it is constant along each row and does not grow up the wall. The free edge takes
    the stock of the row that reaches it.

    >>> in_steps(np.array([[0.3, 0.2, 0.25, 0.1], [0.4, 0.3, 0.3, 0.2]])).tolist()
    [[0.3, 0.2, 0.2, 0.2], [0.3, 0.2, 0.2, 0.2]]
    """
    lowered = np.minimum.accumulate(values.min(axis=0))
    lowered[-1] = lowered[-2]
    return np.tile(lowered, (len(values), 1))


def at_one_level(low: Floats, high: Floats, allowance: float, smallest: float) -> Floats:
    """Stock (n, m) before a level pass over a floor, lowered so that each row is left whole or cut by earlier passes
    down to one level: the least of the rows that need them.

    An end mill that goes down along a row presses with its bottom, so a pass is level. ``low`` is the stock after it.

    >>> none = np.zeros((2, 3))
    >>> at_one_level(none, np.array([[0.9, 0.3, 0.9], [0.9, 0.4, 0.5]]), 0.8, 0.1).tolist()
    [[0.8, 0.3, 0.3], [0.8, 0.3, 0.3]]
    """
    row = high.min(axis=0)
    whole = row >= allowance - NOTHING
    if whole.all():
        return np.full_like(high, allowance)
    level = min(float(row[~whole].min()), allowance - smallest)
    return np.asarray(np.maximum(np.tile(np.where(whole, allowance, level), (len(high), 1)), low))


def _no_sliver(low: Floats, high: Floats, allowance: float, smallest: float) -> Floats:
    """Stock before a pass: the allowance where it is reached, else at least the smallest depth below it."""
    rest = np.maximum(np.minimum(high, allowance - smallest), low)
    return np.where(high >= allowance - NOTHING, allowance, rest)


def variable(
    surfaces: Sequence[FinishSurface],
    threshold_of: ThresholdOf,
    law: ForceTable,
    slope: float,
    *,
    order: Order = "alternately",
    corrections: Sequence[Floats] | None = None,
    leave: float = 0.0,
    steps: bool = False,
    level: bool = False,
    most: int = 200,
    progress: Progress = silent,
) -> Plan:
    """Passes of variable depth within the thresholds.

    Parameters
    ----------
    surfaces : one or two sides of each wall, A first, wall by wall
    threshold_of : threshold of a side in a state; the stock left is that of all sides, in their order
    law : depth of a threshold
    slope : L > 0 of the offset function
    order : of the sides; one after the other: the first one whole while the second has all of its stock
    corrections : c of each side, (n, m) float above 0; None: 1
    leave : [mm] stock that stays on every side
    steps : a pass leaves the same stock along each row, and no more of it up the wall: a flank reaches over the rows
        before
    level : each pass is level, over the rows that need it; ``slope`` has no meaning
    most : passes on a side before it is given up

    Raises
    ------
    InputError
        The allowance is not covered in ``most`` passes.
    """
    count, c = len(surfaces), _ones(surfaces, corrections)
    D = [np.full(s.points.shape[:2], leave) for s in surfaces]
    done: list[WallPass] = []
    infeasible: set[tuple[int, int, int]] = set()
    for _ in range(most * len({s.wall for s in surfaces})):
        open_sides = [s for s in reversed(range(count)) if (D[s] < surfaces[s].allowance - NOTHING).any()]
        if not open_sides:
            return Plan("variable", tuple(reversed(done)), tuple(sorted(infeasible)))
        last = max(surfaces[s].wall for s in open_sides)
        open_sides = [s for s in open_sides if surfaces[s].wall == last]
        for side in open_sides if order == "alternately" else open_sides[:1]:
            a = surfaces[side].allowance
            threshold = threshold_of(D, side)
            F = threshold.force.reshape(D[side].shape)
            open_ = D[side] < a - NOTHING
            depth = threshold.within(law.depth(F / c[side]))
            weak = (depth == 0.0) & open_
            infeasible |= {(side, int(i), int(j)) for i, j in np.argwhere(weak)}
            depth = np.maximum(depth, law.limits.smallest)
            if level:
                high = at_one_level(D[side], np.minimum(D[side] + depth, a), a, law.limits.smallest)
            else:
                depth = lower_envelope(surfaces[side].points, depth, slope)
                high = _no_sliver(D[side], D[side] + depth, a, law.limits.smallest)
                high = in_steps(high) if steps else high
            done.append(planned_pass(side, D[side], high, threshold, law, c[side]))
            D[side] = high
            progress(
                min(float(np.mean([(d / s.allowance).mean() for d, s in zip(D, surfaces, strict=True)])), 1.0), "passes"
            )
    worst = min(float(d.min()) for d in D)
    raise InputError(
        f"passes: {most} on each side remove only {worst:.3g} mm: allow more deflection, less feed or a smaller "
        "step-over"
    )


def least_first_depth(
    surfaces: Sequence[FinishSurface],
    threshold_of: ThresholdOf,
    law: ForceTable,
    corrections: Sequence[Floats] | None = None,
    leave: float = 0.0,
) -> float:
    """Least over all places and sides of the greatest allowable depth [mm] in the last passes, which ``leave`` stock
    [mm]; 0 where a place allows none.
    """
    D = [np.full(s.points.shape[:2], leave) for s in surfaces]
    c = _ones(surfaces, corrections)
    found = [threshold_of(D, side) for side in range(len(surfaces))]
    return min(float(t.within(law.depth(t.force / c[k].ravel())).min()) for k, t in enumerate(found))


def constant(
    surfaces: Sequence[FinishSurface],
    threshold_of: ThresholdOf,
    law: ForceTable,
    depth: float,
    name: str = "constant",
    order: Order = "alternately",
    corrections: Sequence[Floats] | None = None,
    leave: float = 0.0,
) -> Plan:
    """The fewest equal passes of at most ``depth``; ``corrections`` and ``leave`` as of :func:`variable`.

    Raises
    ------
    InputError
        The depth is not above 0.
    """
    if not depth > 0.0:
        raise InputError(
            f"passes: constant depth_mm = {depth:g}: must be above 0; a place of the wall allows no cut at all: allow "
            "more deflection, less feed or a smaller step-over"
        )
    number = [math.ceil((s.allowance - leave) / depth - 1e-9) for s in surfaces]
    turns = [(k, side) for side in reversed(range(len(surfaces))) for k in range(number[side])]
    if order == "alternately":
        turns.sort(key=lambda turn: (-surfaces[turn[1]].wall, turn[0]))
    D, c = [np.full(s.points.shape[:2], leave) for s in surfaces], _ones(surfaces, corrections)
    done = []
    for k, side in turns:
        high = np.full_like(D[side], leave + (surfaces[side].allowance - leave) * (k + 1) / number[side])
        done.append(planned_pass(side, D[side], high, threshold_of(D, side), law, c[side]))
        D[side] = high
    return Plan(name, tuple(reversed(done)))
