"""Splines by knots, G6.2: each block states a control point, its weight R and a knot K, the last ones a knot alone.

Notation: P is the order, 4 where it is not stated. n + 1 control points have n + 1 + P knots; with the last of them the
curve is complete and becomes straight feeds on it. The first control point is where the tool stands. Q, how a control
chooses points on the curve, does not change it.

Reference: Fanuc Series 16i/18i/21i, B-63534EN, "NURBS interpolation (G06.2)"; LinuxCNC 2.10, "G6.2 NURBS".
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from chipload.errors import InputError
from chipload.program.commands import LINE
from chipload.program.gcode import nurbs
from chipload.program.gcode.controller import Controller
from chipload.program.gcode.expression import integer_of
from chipload.program.gcode.state import put
from chipload.program.gcode.targets import axes, end, rate
from chipload.program.gcode.words import Block

#: code of the motion, in tenths
SPLINE = 62
#: order of a spline that states none
USUAL_ORDER = 4
#: the first control point may lie this far from where the tool stands [mm]
NEAR_MM = 0.01


@dataclass
class _Curve:
    """A spline that is being stated."""

    order: int
    rate: float | None
    points: list[tuple[float, float, float]] = field(default_factory=list)
    weights: list[float] = field(default_factory=list)
    knots: list[float] = field(default_factory=list)


class KnottedSplines:
    """The splines by knots of one controller."""

    def __init__(self, controller: Controller):
        self.c = controller
        self._curve: _Curve | None = None

    @property
    def is_open(self) -> bool:
        """Whether control points or knots are still to come."""
        return self._curve is not None

    def move(self, block: Block) -> None:
        """Carry out one block.

        Raises
        ------
        InputError
            A word is out of its range, or the knots and control points make no curve.
        """
        c, words = self.c, block.words
        if c.strict:
            raise InputError("G6.2: is not a code of LinuxCNC 2.9")
        c.not_compensated("G6.2")
        given = any(axis in words for axis in "xyz")
        curve = self._curve
        if any(axis in words for axis in "abcuvw"):
            raise InputError("G6.2: a spline moves X, Y and Z only")
        if curve is None:
            if not given:
                raise InputError("G6.2: a curve begins with a control point")
            order = integer_of(words.get("p", float(USUAL_ORDER)), "G6.2: P")
            if not 2 <= order <= nurbs.HIGHEST_ORDER:
                raise InputError(f"G6.2: P{order}: the order must be from 2 to {nurbs.HIGHEST_ORDER}")
            curve = self._curve = _Curve(order, rate(c, block, "G6.2"))
        weight = words.get("r", 1.0)
        if "k" not in words or not 0.0 < weight <= 1e9:
            self._curve = None
            raise InputError("G6.2: each control point has a knot K, and its weight R is above 0")
        if len(curve.knots) >= nurbs.MOST_CONTROL_POINTS:
            self._curve = None
            raise InputError(f"G6.2: more than {nurbs.MOST_CONTROL_POINTS} control points: split the spline")
        curve.knots.append(words["k"])
        if given:
            curve.points.append(self._point(block, curve))
            curve.weights.append(weight)
        elif len(curve.knots) == len(curve.points) + curve.order:
            self._curve = None
            self._run(curve)

    def end(self) -> None:
        """Another motion begins: a curve whose knots are missing is left out."""
        if self._curve is not None:
            self._curve = None
            self.c.leave_out("nc-left-out", "G6.2: its last knots are missing: the curve is left out")

    def _point(self, block: Block, curve: _Curve) -> tuple[float, float, float]:
        at = self.c.state.at
        last = curve.points[-1] if curve.points else (at[0], at[1], at[2])
        if self.c.state.absolute:
            to, words = end(self.c, block), block.words
            return (
                to[0] if "x" in words else last[0],
                to[1] if "y" in words else last[1],
                to[2] if "z" in words else last[2],
            )
        step = axes(self.c, block)
        return last[0] + step.get(0, 0.0), last[1] + step.get(1, 0.0), last[2] + step.get(2, 0.0)

    def _run(self, curve: _Curve) -> None:
        c, points = self.c, np.array(curve.points)
        at = np.array(c.state.at[:3])
        if np.linalg.norm(points[0] - at) > NEAR_MM:
            raise InputError("G6.2: the first control point is not where the tool stands: the curve is left out")
        for x, y, z in curve.points:
            c.check(put(c.state.at, {0: x, 1: y, 2: z}))
        chords = nurbs.spline_points(points, np.array(curve.weights), curve.order, knots=np.array(curve.knots))
        spans = np.linalg.norm(np.diff(np.vstack([at[None], chords]), axis=0), axis=1)
        total = float(spans.sum())
        for (x, y, z), span in zip(chords.tolist(), spans.tolist(), strict=True):
            # by inverse time the whole curve takes 1 / F: each chord its share
            own = None if curve.rate is None else curve.rate * total / span if span else curve.rate
            c.straight(LINE, put(c.state.at, {0: x, 1: y, 2: z}), own)
