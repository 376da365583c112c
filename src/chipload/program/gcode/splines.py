"""Splines: G5, G5.1, and G5.2 to G5.3.

Notation: a spline lies in X and Y; it becomes straight feeds on its curve. ``tangent`` is P, Q of the G5 before, which
the next G5 goes on along where it gives no I and J.

Reference: LinuxCNC 2.9, "G5 Cubic Spline", "G5.1 Quadratic Spline", "G5.2 G5.3 NURBS Block".
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from chipload.errors import InputError
from chipload.program.commands import LINE, Floats
from chipload.program.gcode import nurbs
from chipload.program.gcode.controller import Controller
from chipload.program.gcode.expression import integer_of
from chipload.program.gcode.modal import code_text
from chipload.program.gcode.state import put
from chipload.program.gcode.targets import axes, end, rate
from chipload.program.gcode.words import Block


@dataclass(frozen=True)
class Spline:
    """Control points of a G5.2 that is open, as (x, y, weight) [mm]."""

    points: tuple[tuple[float, float, float], ...]
    order: int
    rate: float | None


class Splines:
    """The splines of one controller."""

    def __init__(self, controller: Controller):
        self.c = controller
        self.spline: Spline | None = None
        self.tangent = (0.0, 0.0)

    def move(self, block: Block, code: int) -> None:
        """Carry out G5, G5.1, or one block of G5.2, or G5.3."""
        c, state, words = self.c, self.c.state, block.words
        c.not_compensated(code_text(code))
        if state.plane != 170 and code in (50, 51):
            raise InputError(f"{code_text(code)}: splines lie in the XY plane (G17)")
        if code == 53:
            self._close()
            return
        pace = rate(self.c, block, code_text(code))
        if any(axis in words for axis in "zabcuvw"):
            raise InputError(f"{code_text(code)}: a spline moves X and Y only")
        scale = state.scale
        if code == 52:
            self._point(block, pace)
            return
        to = end(self.c, block)
        start, stop = (state.at[0], state.at[1]), (to[0], to[1])
        if code == 50:
            if ("i" in words) != ("j" in words):
                raise InputError("G5: give both I and J, or neither")
            if "p" not in words or "q" not in words:
                raise InputError("G5: P and Q are missing: the second control point from the end")
            i, j = words.get("i", -self.tangent[0]), words.get("j", -self.tangent[1])
            points = nurbs.cubic(start, i * scale, j * scale, words["p"] * scale, words["q"] * scale, stop)
            self.tangent = words["p"], words["q"]
        else:
            if "i" not in words or "j" not in words:
                raise InputError("G5.1: I and J are missing: the control point from the start")
            points = nurbs.quadratic(start, words["i"] * scale, words["j"] * scale, stop)
        self._run(points, np.ones(len(points)), len(points), pace)

    def _point(self, block: Block, rate: float | None) -> None:
        state, words = self.c.state, block.words
        given = "x" in words or "y" in words
        if given and not ("x" in words and "y" in words):
            raise InputError("G5.2: a control point needs both X and Y")
        weight = words.get("p")
        if weight is not None and not 0.0 < weight <= 1e9:
            raise InputError(f"P{weight:g}: the weight of a control point must be above 0")
        spline = self.spline
        if spline is None:
            order = integer_of(words.get("l", 3.0), "L")
            if not 2 <= order <= nurbs.HIGHEST_ORDER:
                raise InputError(f"L{order}: the order of a spline must be from 2 to {nurbs.HIGHEST_ORDER}")
            first = 1.0 if given or weight is None else weight
            spline = Spline(((state.at[0], state.at[1], first),), order, rate)
            weight = 1.0 if weight is None else weight
        elif weight is None:
            raise InputError("G5.2: P is missing: each control point has its weight")
        elif not given:
            raise InputError("G5.2: a control point needs both X and Y")
        if given:
            points = spline.points
            x, y = end(self.c, block)[:2] if state.absolute else self._end_after(block, points[-1])
            if len(points) >= nurbs.MOST_CONTROL_POINTS:
                raise InputError(f"G5.2: more than {nurbs.MOST_CONTROL_POINTS} control points: split the spline")
            spline = replace(spline, points=(*points, (x, y, weight)))
        self.spline = spline

    def _end_after(self, block: Block, last: tuple[float, float, float]) -> tuple[float, float]:
        stated = axes(self.c, block)
        return last[0] + stated[0], last[1] + stated[1]

    def _close(self) -> None:
        spline = self.spline
        if spline is None:
            raise InputError("G5.3: no spline is open: begin it by G5.2")
        if len(spline.points) < spline.order:
            raise InputError(
                f"G5.3: {len(spline.points)} control points: must be at least the order L = {spline.order}"
            )
        table = np.array(spline.points)
        self.spline = None
        self._run(table[:, :2], table[:, 2], spline.order, spline.rate)

    def _run(self, points: Floats, weights: Floats, order: int, rate: float | None) -> None:
        c = self.c
        for x, y in points:
            c.check(put(c.state.at, {0: float(x), 1: float(y)}))
        chords = nurbs.spline_points(points, weights, order)
        spans = np.linalg.norm(np.diff(np.vstack([points[:1], chords]), axis=0), axis=1)
        total = float(spans.sum())
        for (x, y), span in zip(chords.tolist(), spans.tolist(), strict=True):
            # by inverse time the whole curve takes 1 / F: each chord its share
            own = None if rate is None else rate * total / span if span else rate
            c.straight(LINE, put(c.state.at, {0: x, 1: y}), own)
