"""Cycles of conversational programs: what CYCL DEF sets, and what a call carries out where the tool stands.

Notation of cycle 1 (pecking): the tool stands the set-up clearance DIST above the surface; DEPTH of the hole and PLNGNG
of each plunge are counted from the surface down; before each plunge it stops ``advanced_stop`` above what is drilled.

Cycles 7 (datum shift), 8 (mirrored), 9 (dwell), 10 (turned coordinates), 11 and 26 (scaled), 19 (working plane, by
spatial angles) and 220, 221 (patterns) act where they are defined. Coordinates are mirrored and scaled about the datum,
by cycle 26 about its own point; which of shift, turn and mirror comes first is a matter of the control where both are
there, which leaves the program unproven. In a tilted plane they are not read: motions are left out until they end. A
cycle that is not read is left out where it is called.

Reference: Heidenhain, iTNC 530 User's Manual, "Cycles: Coordinate Transformations".
"""

from __future__ import annotations

import cmath
import math
import re
from collections.abc import Iterator

from chipload.errors import InputError
from chipload.program.commands import DWELL, LINE, RAPID
from chipload.program.heidenhain import bore_cycles, patterns, pocket_steps, q_cycles, surface_steps, words
from chipload.program.heidenhain.formula import NotKnownError, q_number
from chipload.program.heidenhain.state import ConversationalState
from chipload.program.heidenhain.switches import datum_shift, leave_out
from chipload.program.heidenhain.tilted_plane import enter, put
from chipload.program.tilt import spatial
from chipload.units import mm_s_from_mm_min

#: plunges of one hole, holes of one pattern
MOST_PLUNGES, MOST_HOLES = 10_000, 10_000
#: cycles that move nothing and set nothing that concerns the path
SILENT = (13, 14, 20, 32)
#: by what the coordinates are changed
CHANGES = {8: "mirrored", 10: "turned", 11: "scaled", 26: "scaled"}
MIRROR, SCALING = 8, 11
#: factors of scaling
LEAST_FACTOR, MOST_FACTOR = 1e-6, 100.0
#: cycles that mill within a hole or a pocket, a slot, a stud or a face
MILLING = (*bore_cycles.CYCLES, *pocket_steps.CYCLES, *surface_steps.CYCLES)
PRESET, PATTERNS, WORKING_PLANE, ROTATION = 247, (220, 221), 19, 10
_VALUE = re.compile(r"([A-Z. ]*?)\s*([-+]?\d*\.?\d+)\s*$")
_SPATIAL = re.compile(rf"\b([ABC])\s*([-+]?)\s*({words.VALUE})")
_FACTOR = re.compile(rf"(?<![A-Z])([XYZ])\s*\+?\s*({words.VALUE})")
_FIXED = re.compile(rf"\bCC([XYZ])\s*([-+]?)\s*({words.VALUE})")
_CHANGED = re.compile(rf"(?:\b|(?<=\s))[A-Z]*\s*([-+]?)\s*({words.VALUE})")


def advanced_stop(depth: float) -> float:
    """Above what is drilled where a plunge begins [mm]: 0.6 for holes to 30 mm, else a fiftieth, at most 7.

    >>> advanced_stop(20.0), advanced_stop(100.0), advanced_stop(1000.0)
    (0.6, 2.0, 7.0)
    """
    return 0.6 if depth <= 30.0 else min(depth / 50.0, 7.0)


class Cycles:
    """The cycle that a call carries out, and its values as they are read."""

    def __init__(self, state: ConversationalState) -> None:
        self.s = state
        self.number: int | None = None
        self.values: dict[int, float] = {}
        self.modal = False
        self.places: list[patterns.Place] = []
        self.preset: float | None = None
        #: turn of the coordinates about Z [deg]
        self.turned = 0.0
        #: mirrored axes, the factor of cycle 11, and factors and fixed point of cycle 26
        self.mirrored, self.scaled = set[int](), 1.0
        self.axis_scaled: tuple[list[float], list[float]] = ([1.0] * 3, [0.0] * 3)

    def define(self, text: str) -> None:
        """Carry out one block of a definition."""
        found = re.match(r"CYCLE? DEF\s*(\d{1,6})\s*(?:\.\s*(\d{1,3}))?\s*(.*)", text)
        if found is None:
            raise InputError(f"{text!r}: CYCL DEF must have a number")
        s, number, part, body = self.s, int(found[1]), int(found[2] or 0), found[3]
        if number == 7:
            if part > 0:
                datum_shift(s, text, body)
                self._report_mixed(text)
            return
        for letters, digits, value in words.Q_VALUE.findall(body):
            s.q.set(q_number(letters, digits), self._q_value(value))
        if number == 9:
            if part > 0:
                s.dwell(self._value(number, body))
        elif number == 1:
            if part == 0:
                self.number, self.values = 1, {}
            else:
                value = self._value(number, body)
                unit = words.feed_unit(s.scale) if part == 5 else s.scale
                self.values[part] = value if part == 4 else value * unit
        elif number == WORKING_PLANE:
            if part > 0:
                self._tilt(text, body)
        elif number in CHANGES:
            self._change(text, number, part, body)
        elif number == PRESET:
            self._choose_preset(text)
        elif number in PATTERNS:
            self._pattern(number)
        elif number in q_cycles.LEFT_OUT:
            self.number, self.values = number, {}
        elif number not in SILENT:
            s.unproven("heidenhain-cycle", f"CYCL DEF {number}: is not read: left out")

    def shift_datum(self, text: str) -> None:
        """TRANS DATUM AXIS X+10 Y+5, and its RESET: cycle 7 by another name, all axes of which it states."""
        body = text.removeprefix("TRANS DATUM").strip()
        if body == "RESET":
            parts = [f"{axis}+0" for k, axis in enumerate("XYZABC") if self.s.shift[k] != 0.0]
        elif body.startswith("AXIS"):
            parts = body.removeprefix("AXIS").split()
        else:
            self.s.unproven("heidenhain-datum", f"{text[:40]}: the datum table is not known: its shift is left out")
            return
        for part in parts:
            datum_shift(self.s, text, part)
        self._report_mixed(f"CYCL DEF 7: {text}")

    def _q_value(self, text: str) -> float:
        if text.endswith("MAX"):
            return q_cycles.MAX
        if text.endswith("AUTO"):
            # the feed that lasts, in units of the text
            return self.s.cutting_feed() * 60.0 / words.feed_unit(self.s.scale)
        return self.s.q.formula(text)

    def _value(self, number: int, body: str) -> float:
        found = _VALUE.fullmatch(body)
        if found is None:
            raise InputError(f"CYCL DEF {number}: {body!r}: must be a name and a number")
        value = float(found[2])
        if not abs(value) < 1e6:
            raise InputError(f"CYCL DEF {number}: {body!r}: must be below 1e6")
        return value

    def _change(self, text: str, number: int, part: int, body: str) -> None:
        """Mirrored, turned and scaled coordinates, or the end of them."""
        how, s = CHANGES[number], self.s
        if part == 0:
            return
        values = [s.signed(sign, value) for sign, value in _CHANGED.findall(body)]
        if number == ROTATION:
            if values and (s.tilt is None or s.tilt.upright):
                self.turned = values[0] + (self.turned if re.search(r"\bIROT", body) else 0.0)
                enter(s, spatial(0.0, 0.0, self.turned))
                self._report_mixed(text)
            elif any(values):
                leave_out(s, f"{text[:60]}: {how} coordinates are not read: motions are left out until they end")
            return
        if number == MIRROR:
            self.mirrored = {"XYZ".index(letter) for letter in re.findall(r"[XYZ]", body)}
        elif number == SCALING:
            self.scaled = self._factor(text, values[0] if values else 1.0)
        else:
            factors, fixed = [1.0] * 3, [0.0] * 3
            for letter, value in _FACTOR.findall(_FIXED.sub(" ", body)):
                factors["XYZ".index(letter)] = self._factor(text, s.amount(value))
            for letter, sign, value in _FIXED.findall(body):
                fixed["XYZ".index(letter)] = s.signed(sign, value) * s.scale
            self.axis_scaled = (factors, fixed)
        self._take_factors(text, how)

    def _factor(self, text: str, value: float) -> float:
        if not LEAST_FACTOR <= value <= MOST_FACTOR:
            raise InputError(f"{text[:60]}: the factor must be from {LEAST_FACTOR:g} to {MOST_FACTOR:g}")
        return value

    def _take_factors(self, text: str, how: str) -> None:
        """Let the coordinates be mirrored and scaled from here on."""
        s, (factors, fixed) = self.s, self.axis_scaled
        if s.tilt is not None and not s.tilt.upright:
            leave_out(s, f"{text[:60]}: {how} coordinates in a tilted plane are not read: motions are left out")
            return
        if how in s.left_out:
            s.left_out = ""
        s.end_contour()
        signed = [(-self.scaled if k in self.mirrored else self.scaled) for k in range(3)]
        s.factor = [a * f for a, f in zip(signed, factors, strict=True)]
        s.origin = [a * (1.0 - f) * c for a, f, c in zip(signed, factors, fixed, strict=True)]
        self._report_mixed(text)

    def _report_mixed(self, text: str) -> None:
        """Report a turn or a shift of mirrored coordinates, whose order depends on the control."""
        changed = self.s.factor != [1.0] * 3 or self.s.origin != [0.0] * 3
        if changed and (self.turned != 0.0 or text.startswith(("CYCL DEF 7", "CYCLE DEF 7"))):
            self.s.unproven(
                "heidenhain-plane",
                f"{text[:60]}: a turn or shift of mirrored or scaled coordinates: taken as the outer one",
            )

    def _tilt(self, text: str, body: str) -> None:
        """Cycle 19: the working plane; the rotary axes stay until a motion names them."""
        given = {letter: self.s.signed(sign, value) for letter, sign, value in _SPATIAL.findall(body)}
        why = put(self.s, spatial(*(given.get(x, 0.0) for x in "ABC")), "STAY")
        if why:
            leave_out(self.s, f"{text[:60]}: {why}: motions are left out until it ends")
        elif "tilted" in self.s.left_out:
            self.s.left_out = ""

    def _choose_preset(self, text: str) -> None:
        chosen = self.s.q.values.get(339)
        if self.preset is not None and chosen != self.preset:
            self.s.unproven("heidenhain-datum", f"{text[:40]}: this preset is not known here: the first one is kept")
        elif self.preset is None:
            self.preset = chosen

    # -- calls ------------------------------------------------------------------------------------------------
    def call(self) -> None:
        """Carry out the cycle where the tool stands."""
        s, number = self.s, self.number
        if s.left_out:
            return
        if s.unknown:
            raise NotKnownError("a cycle is called at a position that is not known: move there first")
        s.end_contour()
        if number is None:
            raise InputError("a cycle is called and none is defined: give CYCL DEF 1")
        if s.factor[2] != 1.0 or (number in MILLING and (s.factor[0] != 1.0 or s.factor[1] != 1.0)):
            raise NotKnownError("a cycle is called in mirrored or scaled coordinates: what it cuts here is left out")
        if number == 1:
            for motion, z, value in self._pecks(s.at[2]):
                s.plunge(motion, z, value)
        elif number in MILLING:
            self._bore(number)
        elif number in q_cycles.CYCLES:
            self._drill(number)
        else:
            s.unproven("heidenhain-cycle", f"CYCL DEF {number}: is not read: what it cuts here is left out")

    def _q(self, key: int, default: float | None) -> float:
        return default if default is not None and key not in self.s.q.values else self.s.q.read(key)

    def _pecks(self, z: float) -> Iterator[tuple[int, float, float]]:
        """(motion, z [mm], feed [mm/s] or time [s]) of a hole of cycle 1 under ``z``."""
        missing = [k for k in (1, 2, 3, 5) if k not in self.values]
        if missing:
            raise InputError(f"CYCL DEF 1.{missing[0]}: is missing: define the cycle whole")
        distance, depth, plunge = abs(self.values[1]), abs(self.values[2]), abs(self.values[3])
        dwell, feed = self.values.get(4, 0.0), mm_s_from_mm_min(self.values[5])
        if not (plunge > 0.0 and feed > 0.0):
            raise InputError("CYCL DEF 1: PLNGNG and F must be above 0")
        if depth / plunge > MOST_PLUNGES:
            raise InputError(f"CYCL DEF 1: more than {MOST_PLUNGES} plunges: raise PLNGNG")
        surface = z - distance
        done = 0.0
        while done < depth:
            if done > 0.0:
                yield RAPID, surface - done + advanced_stop(depth), 0.0
            done = min(done + plunge, depth)
            yield LINE, surface - done, feed
            if done >= depth and dwell > 0.0:
                yield DWELL, surface - done, dwell
            yield RAPID, z, 0.0

    def _drill(self, number: int) -> None:
        s = self.s
        if number == 202:
            s.note("nc-fine-boring", "CYCL DEF 202: the shift away from the wall is left out")
        # tapping starts the spindle itself
        before, sense = s.sense, (s.sense or 1.0) if number in (206, 207, 209) else s.sense
        s.sense = sense
        for kind, z, value in q_cycles.q_cycle_steps(number, self._q, s.speed / math.tau, s.scale):
            if kind == q_cycles.SPIN:
                s.sense = value * sense
            else:
                s.plunge(kind, z, value)
        s.sense = before

    def _bore(self, number: int) -> None:
        s, radius = self.s, self.s.radius()
        if radius is None:
            raise NotKnownError(
                f"CYCL DEF {number}: no radius of tool {s.tool} is known: what it cuts here is left out: state R in "
                f"TOOL DEF, D in a tool table, or a [[cutter]] with number = {s.tool}"
            )
        middle, turn = complex(*s.at[:2]), complex(1.0, 0.0)
        if number in pocket_steps.CYCLES:
            steps = pocket_steps.pocket_steps(number, self._q, radius, s.scale)
            turn = cmath.rect(1.0, math.radians(self._q(374 if number == 253 else 224, 0.0) if number != 252 else 0.0))
            s.unproven(
                "nc-pocket-path",
                f"CYCL DEF {number}: the way within the pocket is the control's own: rings from its middle are taken; "
                "its wall, floor and passes are those of the cycle",
            )
        elif number in surface_steps.CYCLES:
            steps = surface_steps.surface_steps(number, self._q, radius, s.scale)
            turn = cmath.rect(1.0, math.radians(surface_steps.angle_of(number, self._q)))
            if number in surface_steps.PLACED_BY:
                keys = surface_steps.PLACED_BY[number]
                x, y = (
                    f * s.scale * self._q(key, None) + o for f, key, o in zip(s.factor, keys, s.origin, strict=False)
                )
                middle = complex(x, y)
            s.unproven(
                "nc-pocket-path",
                f"CYCL DEF {number}: the way of the tool is the control's own: rings or passes of its step are taken; "
                "its wall, floor and levels are those of the cycle",
            )
        else:
            steps = bore_cycles.bore_steps(number, self._q, radius, s.scale)
        for kind, x, y, z, feed, centre, turns in steps:
            at, about = middle + turn * complex(x, y), middle + turn * complex(*centre)
            s.at = [at.real, at.imag, z, *s.at[3:]]
            s.row(kind, s.at, feed, (about.real, about.imag) if turns else (0.0, 0.0), turns)

    # -- patterns ---------------------------------------------------------------------------------------------
    def _pattern(self, number: int) -> None:
        """220 (holes on a circle) and 221 (rows): the cycle defined last, at each hole."""
        s = self.s
        if s.factor[2] != 1.0:
            raise NotKnownError("a pattern is called in scaled coordinates: what it cuts here is left out")
        surface = s.scale * self._q(203, None)
        away = surface + s.scale * max(abs(self._q(200, None)), self._q(204, 0.0))
        between = surface + s.scale * abs(self._q(200, None)) if self._q(301, 1.0) == 0.0 else away
        holes = self._circle() if number == 220 else self._rows()
        level = away
        for x, y in holes:
            self._at_hole(x, y, level, RAPID)
            level = between
        s.plunge(RAPID, away, 0.0)

    def _at_hole(self, x: float, y: float, level: float, motion: int) -> None:
        """The cycle at a place [mm], over which the tool goes at a height or above it."""
        s = self.s
        if 2 in s.unknown or s.at[2] < level:
            s.plunge(RAPID, level, 0.0)
        s.unknown.clear()
        x, y = s.factor[0] * x + s.origin[0], s.factor[1] * y + s.origin[1]
        s.straight(motion, [x, y, *s.at[2:]])
        self.call()

    def define_pattern(self, text: str) -> None:
        """PATTERN DEF: the places at which CYCL CALL PAT calls a cycle."""
        self.places = []
        self.places = patterns.pattern_places(text, self.s.signed)

    def call_pattern(self, text: str) -> None:
        """CYCL CALL PAT: the cycle at each place; between them the tool stays at the height of the call or above."""
        s = self.s
        if not self.places:
            raise NotKnownError("CYCL CALL PAT: no pattern is defined that is read: what it cuts here is left out")
        if self.number is None or self.number not in q_cycles.CYCLES:
            self.call()
            return
        if s.factor[2] != 1.0:
            raise NotKnownError("a pattern is called in scaled coordinates: what it cuts here is left out")
        s.feed_of(text)
        motion = RAPID if "MAX" in text or s.feed is None else LINE
        surface = self._q(203, None)
        lowest = -math.inf if 2 in s.unknown else s.at[2]
        try:
            for x, y, z in self.places:
                s.q.set(203, surface + z)
                away = s.scale * (surface + z + max(abs(self._q(200, None)), self._q(204, 0.0)))
                self._at_hole(s.scale * x, s.scale * y, max(away, lowest), motion)
        finally:
            s.q.set(203, surface)
        s.plunge(RAPID, max(away, lowest), 0.0)

    def _count(self, key: int) -> int:
        value = self._q(key, None)
        if not 1 <= value <= MOST_HOLES:
            raise InputError(f"Q{key} = {value:g}: must be from 1 to {MOST_HOLES}")
        return round(value)

    def _circle(self) -> list[tuple[float, float]]:
        q, scale = self._q, self.s.scale
        x, y, r = scale * q(216, None), scale * q(217, None), 0.5 * scale * q(244, None)
        count, start, step = self._count(241), q(245, 0.0), q(247, 0.0)
        if step == 0.0:
            span = q(246, 360.0) - start
            step = span / (count if abs(abs(span) - 360.0) < 1e-9 else max(1, count - 1))
        angles = [math.radians(start + k * step) for k in range(count)]
        return [(x + r * math.cos(a), y + r * math.sin(a)) for a in angles]

    def _rows(self) -> list[tuple[float, float]]:
        """Row by row, there and back; the first hole is about which the rows are turned (Q224)."""
        q, scale = self._q, self.s.scale
        x, y = scale * q(225, None), scale * q(226, None)
        columns, rows = self._count(242), self._count(243)
        if columns * rows > MOST_HOLES:
            raise InputError(f"Q242 x Q243 = {columns * rows}: must be at most {MOST_HOLES}")
        apart = scale * q(237, 0.0), scale * q(238, 0.0)
        turn = math.radians(q(224, 0.0))
        out = []
        for j in range(rows):
            for i in range(columns) if j % 2 == 0 else reversed(range(columns)):
                a, b = i * apart[0], j * apart[1]
                out.append((x + a * math.cos(turn) - b * math.sin(turn), y + a * math.sin(turn) + b * math.cos(turn)))
        return out


def call_positions(s: ConversationalState, end: list[float]) -> None:
    """CYCL CALL POS: at rapid to a place, above first."""
    if 2 in s.unknown or end[2] >= s.at[2]:
        s.plunge(RAPID, end[2], 0.0)
        s.straight(RAPID, end)
    else:
        s.straight(RAPID, [*end[:2], *s.at[2:]])
        s.plunge(RAPID, end[2], 0.0)
    s.unknown.clear()
