"""What the codes of motion do: straight lines, arcs, splines, probing and canned cycles.

Notation: a word is in units of the text; ``scale`` mm in one of them. Codes of G are in tenths.

Reference: LinuxCNC 2.9, "G-Codes".
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from chipload.errors import InputError
from chipload.program.commands import DWELL, LINE, PLANE_AXES, PROBE, RAPID
from chipload.program.gcode import arcs, cycles, nurbs
from chipload.program.gcode.controller import PLANES, Controller
from chipload.program.gcode.expression import integer_of
from chipload.program.gcode.modal import shown
from chipload.program.gcode.state import AXES, LINEAR, NO_MOTION, Nine, put
from chipload.program.gcode.words import Block

#: a touch is sought over at least this [mm]
LEAST_PROBE = 0.254
MOST_REPEATS = 100_000
MOST_TURNS = 100_000


@dataclass(frozen=True)
class Series:
    """What a canned cycle keeps from block to block [units of the text]; ``level`` where the series began."""

    code: int
    level: float
    r: float
    bottom: float
    peck: float | None = None
    dwell: float | None = None
    i: float | None = None
    j: float | None = None
    k: float | None = None


@dataclass(frozen=True)
class Spline:
    """Control points of a G5.2 that is open, as (x, y, weight) [mm]."""

    points: tuple[tuple[float, float, float], ...]
    order: int
    rate: float | None


class Motion:
    """The motions of one controller, with what lasts between their blocks."""

    def __init__(self, controller: Controller):
        self.c = controller
        self.series: Series | None = None
        self.spline: Spline | None = None
        self.tangent = (0.0, 0.0)

    def move(self, block: Block, code: int, machine: bool) -> None:
        """Carry out the motion ``code`` of a block; ``machine``: G53 stands in it."""
        state = self.c.state
        if self.spline is not None and code not in (52, 53):
            raise InputError(f"{shown(code)}: G5.2 is open: close it by G5.3")
        if code != 50:
            self.tangent = (0.0, 0.0)
        if code not in cycles.CYCLES:
            self.series = None
        if code in (0, 10):
            self._straight(block, code, machine)
        elif machine:
            raise InputError(f"G53 with {shown(code)}: goes with G0 and G1 only")
        elif code in (20, 30):
            self._arc(block, code)
        elif code in (50, 51, 52, 53):
            self._spline(block, code)
            code = 52 if self.spline is not None else NO_MOTION
        elif code in cycles.CYCLES:
            self._cycle(block, code)
        elif 382 <= code <= 385:
            self._probe(block, code)
        elif code != NO_MOTION:
            said = "turns the spindle and the axes together: this reader does not take it; write its moves out"
            raise InputError(f"{shown(code)}: {said}")
        state.motion = code

    # -- words -----------------------------------------------------------------------------------------------------

    def axes(self, block: Block) -> dict[int, float]:
        """Axes that the block gives, by index [mm, deg]."""
        words, state = block.words, self.c.state
        out = {}
        for k, axis in enumerate(AXES):
            if axis in words:
                out[k] = words[axis] * (state.scale if k in LINEAR else 1.0)
        if state.diameter and 0 in out:
            out[0] *= 0.5
        return out

    def end(self, block: Block) -> Nine:
        """Where the words of the block lead."""
        state = self.c.state
        given, at = self.axes(block), state.at
        if "@" in block.words or "^" in block.words:
            given |= self._polar(block, given)
        elif not state.absolute:
            given = {k: at[k] + value for k, value in given.items()}
        return put(at, given)

    def _polar(self, block: Block, given: dict[int, float]) -> dict[int, float]:
        if 0 in given or 1 in given:
            raise InputError("@ and ^: stand for X and Y and go with neither")
        state, words = self.c.state, block.words
        x, y = state.at[0], state.at[1]
        r, angle = math.hypot(x, y), math.degrees(math.atan2(y, x))
        if "^" not in words and r == 0.0:
            raise InputError("@ without ^ from the origin: give the angle")
        if state.absolute:
            r, angle = words.get("@", r / state.scale) * state.scale, words.get("^", angle)
        else:
            r, angle = r + words.get("@", 0.0) * state.scale, angle + words.get("^", 0.0)
        out = {0: r * math.cos(math.radians(angle)), 1: r * math.sin(math.radians(angle))}
        if not state.absolute:
            out |= {k: state.at[k] + value for k, value in given.items()}
        return out

    def rate(self, block: Block, what: str) -> float | None:
        """Of G93 [1/min]; None in other modes, where a feed has to be set."""
        state = self.c.state
        if state.feed_mode == 930:
            if "f" not in block.words:
                raise InputError(f"{what}: each feed by inverse time (G93) needs its own F")
            return block.words["f"]
        if state.feed == 0.0:
            raise InputError(f"{what}: the feed is 0 or was never set: give F")
        if state.feed_mode == 950:
            if state.surface:
                self.c.once("nc-feed-unknown", "feed per revolution (G95) with G96: the spindle speed is not known here")
            elif state.speed == 0.0:
                raise InputError(f"{what}: feed per revolution (G95) and no spindle speed: give S")
        return None

    # -- lines and arcs --------------------------------------------------------------------------------------------

    def _straight(self, block: Block, code: int, machine: bool) -> None:
        c, state = self.c, self.c.state
        rate = self.rate(block, "G1") if code == 10 else None
        if machine:
            if not state.absolute:
                raise InputError("G53: goes with G90 only")
            c.not_compensated("G53")
            target = put(state.datum.to_machine(state.at), self.axes(block))
            end = state.datum.from_machine(target)
        else:
            end = self.end(block)
        c.straight(LINE if code == 10 else RAPID, end, rate)

    def _arc(self, block: Block, code: int) -> None:
        c, state, words = self.c, self.c.state, block.words
        if state.plane % 10:
            raise InputError(f"{shown(code)}: arcs lie in the planes of G17, G18 and G19")
        rate = self.rate(block, shown(code))
        turns = 1
        if "p" in words:
            turns = integer_of(words["p"], "P")
            if not 1 <= turns <= MOST_TURNS:
                raise InputError(f"P{turns}: whole turns of an arc must be from 1 to {MOST_TURNS}")
        end, at, inch = self.end(block), state.at, state.scale != 1.0
        first, second, along = PLANE_AXES[PLANES[state.plane]]
        left = code == 30
        if "r" in words:
            if words.keys() & {"i", "j", "k"}:
                raise InputError("R with I, J or K: an arc has a radius or a centre, not both")
            r = words["r"] * state.scale
            centre = arcs.centre_from_radius(at[first], at[second], end[first], end[second], r, left, inch)
        else:
            letters = "ijk"
            if not words.keys() & set(letters):
                raise InputError(f"{shown(code)}: neither R nor I, J, K: an arc needs its radius or its centre")
            if letters[along] in words:
                raise InputError(f"{letters[along].upper()}: is no coordinate of the plane of the arc")
            if state.absolute_centre:
                for k in (first, second):
                    if letters[k] not in words:
                        raise InputError(f"{letters[k].upper()}: is missing: a centre by G90.1 needs both")
                centre = words[letters[first]] * state.scale, words[letters[second]] * state.scale
            else:
                centre = (
                    at[first] + words.get(letters[first], 0.0) * state.scale,
                    at[second] + words.get(letters[second], 0.0) * state.scale,
                )
            arcs.check_centre(at[first], at[second], end[first], end[second], *centre, inch)
        c.arc(end, centre, turns if left else -turns, rate)

    def _probe(self, block: Block, code: int) -> None:
        c, state = self.c, self.c.state
        c.not_compensated(shown(code))
        if state.feed_mode != 940 or state.feed == 0.0:
            raise InputError(f"{shown(code)}: needs a feed per minute (G94, F)")
        end = self.end(block)
        if math.dist(state.at, end) < LEAST_PROBE:
            raise InputError(f"{shown(code)}: ends less than {LEAST_PROBE:g} mm from where it starts: go farther")
        c.note("nc-probe", f"{shown(code)}: a touch may end it earlier; the program goes on from its end")
        c.straight(PROBE, end)
        for k, axis in enumerate(end):
            c.parameters.numbered[5061 + k] = axis / (c.machine_scale if k in LINEAR else 1.0)
        c.parameters.numbered[5070] = 0.0

    # -- splines ---------------------------------------------------------------------------------------------------

    def _spline(self, block: Block, code: int) -> None:
        c, state, words = self.c, self.c.state, block.words
        c.not_compensated(shown(code))
        if state.plane != 170 and code in (50, 51):
            raise InputError(f"{shown(code)}: splines lie in the XY plane (G17)")
        if code == 53:
            self._close()
            return
        rate = self.rate(block, shown(code))
        if any(axis in words for axis in "zabcuvw"):
            raise InputError(f"{shown(code)}: a spline moves X and Y only")
        scale = state.scale
        if code == 52:
            self._point(block, rate)
            return
        end = self.end(block)
        start, stop = (state.at[0], state.at[1]), (end[0], end[1])
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
        self._run(points, np.ones(len(points)), len(points), rate)

    def _point(self, block: Block, rate: float | None) -> None:
        state, words = self.c.state, block.words
        given = "x" in words or "y" in words
        if given and not ("x" in words and "y" in words):
            raise InputError("G5.2: a control point needs both X and Y")
        weight = words.get("p")
        if weight is not None and not 0.0 < weight <= 1e9:
            raise InputError(f"P{weight:g}: the weight of a control point must be above 0")
        if self.spline is None:
            order = integer_of(words.get("l", 3.0), "L")
            if not 2 <= order <= nurbs.HIGHEST_ORDER:
                raise InputError(f"L{order}: the order of a spline must be from 2 to {nurbs.HIGHEST_ORDER}")
            first = 1.0 if given or weight is None else weight
            self.spline = Spline(((state.at[0], state.at[1], first),), order, rate)
            weight = 1.0 if weight is None else weight
        elif weight is None:
            raise InputError("G5.2: P is missing: each control point has its weight")
        elif not given:
            raise InputError("G5.2: a control point needs both X and Y")
        if given:
            x, y = self.end(block)[:2] if state.absolute else self._after(block)
            points = self.spline.points
            if len(points) >= nurbs.MOST_CONTROL_POINTS:
                raise InputError(f"G5.2: more than {nurbs.MOST_CONTROL_POINTS} control points: split the spline")
            self.spline = replace(self.spline, points=(*points, (x, y, weight)))

    def _after(self, block: Block) -> tuple[float, float]:
        assert self.spline is not None
        x, y, _ = self.spline.points[-1]
        given = self.axes(block)
        return x + given[0], y + given[1]

    def _close(self) -> None:
        spline = self.spline
        if spline is None:
            raise InputError("G5.3: no spline is open: begin it by G5.2")
        if len(spline.points) < spline.order:
            raise InputError(f"G5.3: {len(spline.points)} control points: must be at least the order L = {spline.order}")
        table = np.array(spline.points)
        self.spline = None
        self._run(table[:, :2], table[:, 2], spline.order, spline.rate)

    def _run(self, points: np.ndarray, weights: np.ndarray, order: int, rate: float | None) -> None:  # type: ignore[type-arg]
        c = self.c
        for x, y in points:
            c.check(put(c.state.at, {0: float(x), 1: float(y)}))
        way = nurbs.spline_points(points, weights, order)
        spans = np.linalg.norm(np.diff(np.vstack([points[:1], way]), axis=0), axis=1)
        total = float(spans.sum())
        for (x, y), span in zip(way.tolist(), spans.tolist(), strict=True):
            # by inverse time the whole curve takes 1 / F: each chord its share
            own = None if rate is None else rate * total / span if span else rate
            c.straight(LINE, put(c.state.at, {0: x, 1: y}), own)

    # -- cycles ----------------------------------------------------------------------------------------------------

    def _cycle(self, block: Block, code: int) -> None:
        c, state, words = self.c, self.c.state, block.words
        c.not_compensated(shown(code))
        for axis in "abcuvw":
            if axis in words:
                raise InputError(f"{axis.upper()}: stands in no canned cycle")
        if state.plane % 10:
            raise InputError(f"{shown(code)}: cycles lie in the planes of G17, G18 and G19")
        if state.feed_mode == 930:
            raise InputError(f"{shown(code)}: a cycle has no inverse time: write G94 and F")
        self.rate(block, shown(code))
        first, second, along = PLANE_AXES[PLANES[state.plane]]
        scale, old = state.scale, self.series
        series = self._sticky(block, code, old, "xyz"[along], state.at[along] / scale)
        repeats = integer_of(words.get("l", 1.0), "L")
        if not 1 <= repeats <= MOST_REPEATS:
            raise InputError(f"L{repeats}: repeats of a cycle must be from 1 to {MOST_REPEATS}")
        r, bottom, level = series.r * scale, series.bottom * scale, series.level * scale
        if not state.absolute:
            r += level
            bottom += r
        if r < bottom:
            raise InputError(f"R {r:g} mm: lies below the bottom {bottom:g} mm: raise R")
        clear = max(level, r) if state.old_level else r
        hole = self._hole(series, code, along, first, second, r, bottom, clear)
        self.series = series
        given = self.axes(block)

        def go(motion: int, a: float, b: float, height: float) -> None:
            c.straight(motion, put(state.at, {first: a, second: b, along: height}))

        if level < r:
            go(RAPID, state.at[first], state.at[second], r)
        height = max(state.at[along], clear)
        a, b = state.at[first], state.at[second]
        for _ in range(repeats):
            if state.absolute:
                a, b = given.get(first, a), given.get(second, b)
            else:
                a, b = a + given.get(first, 0.0), b + given.get(second, 0.0)
            go(RAPID, a, b, height)
            if height != r:
                go(RAPID, a, b, r)
            for kind, p, q, h, value in cycles.cycle_steps(code, a, b, hole):
                if kind in (RAPID, LINE):
                    go(kind, p, q, h)
                elif kind == DWELL:
                    c.dwell(value)
                elif kind == cycles.SPIN:
                    state.sense = int(value)
                    c.changed()
                else:
                    c.note("nc-stop", f"{shown(code)}: the program waits for its operator, who retracts by hand")
            height = clear
            c.track.spill()

    def _sticky(self, block: Block, code: int, old: Series | None, normal: str, here: float) -> Series:
        words = block.words
        if self.c.state.diameter and normal == "x":
            raise InputError(f"{shown(code)}: no cycle along X with diameters (G7)")
        if old is None or old.code != code:
            if "r" not in words:
                raise InputError(f"{shown(code)}: R is missing: where feeding begins")
            if normal not in words:
                raise InputError(f"{shown(code)}: {normal.upper()} is missing: the bottom of the hole")
            new = Series(code, here if old is None else old.level, words["r"], words[normal])
        else:
            new = replace(old, r=words.get("r", old.r), bottom=words.get(normal, old.bottom))
        new = replace(
            new,
            peck=words.get("q", new.peck),
            dwell=words.get("p", new.dwell),
            i=words.get("i", new.i),
            j=words.get("j", new.j),
            k=words.get("k", new.k),
        )
        if code in cycles.NEED_P and new.dwell is None:
            raise InputError(f"{shown(code)}: P is missing: the time at the bottom")
        if code in cycles.NEED_Q and new.peck is None:
            raise InputError(f"{shown(code)}: Q is missing: the depth of a peck")
        return new

    def _hole(
        self, series: Series, code: int, along: int, first: int, second: int, r: float, bottom: float, clear: float
    ) -> cycles.Hole:
        scale = self.c.state.scale
        shift, middle = (0.0, 0.0), 0.0
        if code == 870:
            offsets = (series.i, series.j, series.k)
            for letter, value in zip("IJK", offsets, strict=True):
                if value is None:
                    raise InputError(f"G87: {letter} is missing")
            i, j, k = (scale * (value or 0.0) for value in offsets)
            shift = ((i, j, k)[first], (i, j, k)[second])
            middle = (i, j, k)[along] + (0.0 if self.c.state.absolute else bottom)
        dwell = series.dwell
        if dwell is not None and dwell < 0.0:
            raise InputError(f"P{dwell:g}: the time at the bottom must be 0 or more")
        return cycles.Hole(r, bottom, clear, scale * (series.peck or 0.0), dwell, self.c.state.sense, shift, middle)

