"""The rows of a Program as CL data is read: the modal state and the motions.

Notation: all in the work frame, mm, s and rad. ``stated`` is the feed as the text gives it, a number and what it
counts: mm in a minute or in a turn of the spindle, or degrees in a minute (DPM) for the tool's axis where the tip
stands.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from chipload.errors import Finding, InputError, Severity
from chipload.geometry.contour import JOIN_MM
from chipload.program.program import ARC_CCW, ARC_CW, ARC_SKEW_MM, DWELL, LINE, RAPID, Program
from chipload.units import mm_s_from_mm_min

Point = tuple[float, float, float]

#: rows of one program
MOST_ROWS = 5_000_000
#: findings that are listed
LISTED = 1000
#: the centre of an arc whose ends are not as far from it is moved by at most this [mm]
MOST_SHIFT_MM = 0.05
MINUTE, TURN, DEGREES = "mm/min", "mm/turn", "deg/min"

_NO_CENTRE: Point = (0.0, 0.0, 0.0)
_UP: Point = (0.0, 0.0, 1.0)


@dataclass
class AptRows:
    """Rows so far and what the next one is made with.

    Parameters
    ----------
    name : of the program
    feed : [mm/s] of a text that states none; None: such a cut is refused
    spindle : [rad/s]; ``tool`` its number; ``label`` what rows belong to
    at, axis : where the tip stands and the tool's axis; ``at`` is None before the first row
    """

    name: str
    feed: float | None = None
    spindle: float = 0.0
    tool: int = 0
    label: str = ""
    at: Point | None = None
    axis: Point = _UP
    stated: tuple[float, str] | None = None
    findings: list[Finding] = field(default_factory=list)
    _rows: list[tuple[int, Point, Point, Point, Point, float, float, int, int, int]] = field(default_factory=list)
    _labels: dict[str, int] = field(default_factory=dict)
    _once: set[str] = field(default_factory=set)
    _left: int = 0
    _left_severity: Severity = Severity.NOTE

    def note(self, code: str, line: int, text: str, severity: Severity = Severity.NOTE) -> None:
        """A finding, unless too many are listed."""
        if len(self.findings) < LISTED:
            self.findings.append(Finding(code, line, text, severity))
        else:
            self._left += 1
            self._left_severity = max(self._left_severity, severity)

    def leave_out(self, code: str, line: int, text: str) -> None:
        """A finding on something that is left out, so that the result is unproven."""
        self.note(code, line, text, Severity.UNPROVEN)

    def note_once(self, code: str, line: int, text: str) -> None:
        """A finding, the first of its code alone."""
        if code not in self._once:
            self._once.add(code)
            self.note(code, line, text)

    def rapid(self, p: Point, axis: Point, line: int) -> None:
        """A rapid."""
        self._add(RAPID, p, axis, _NO_CENTRE, _UP, 0.0, line)

    def straight(self, p: Point, axis: Point, line: int) -> None:
        """A straight cut at the feed in effect; where a program begins, a rapid."""
        if self.at is None:
            self.note_once("apt-start", line, "the program begins here: no motion leads to the first point")
            self.rapid(p, axis, line)
        else:
            self._add(LINE, p, axis, _NO_CENTRE, _UP, self._speed(math.dist(self.at, p) <= JOIN_MM, axis, line), line)

    def arc(self, p: Point, axis: Point, centre: Point, normal: Point, line: int) -> None:
        """A cut counter-clockwise about ``normal`` through ``centre``."""
        if self.at is None:
            raise InputError(f"line {line}: an arc before the first point: a GOTO to its start must come before it")
        middle, r = self._centre_arc(p, centre, normal, line)
        if r <= JOIN_MM:
            self.note("apt-arc", line, "an arc without a radius: a straight line")
            self.straight(p, axis, line)
            return
        flip = max(normal, key=abs) < 0.0
        turned = (-normal[0] + 0.0, -normal[1] + 0.0, -normal[2] + 0.0) if flip else normal
        speed = self._speed(False, axis, line)
        self._add(ARC_CW if flip else ARC_CCW, p, axis, middle, turned, speed, line)

    def dwell(self, seconds: float, line: int) -> None:
        """The tip stands."""
        if self.at is None:
            self.note("apt-unused", line, f"a dwell of {seconds:g} s before the first point is left out")
        elif seconds > 0.0:
            self._add(DWELL, self.at, self.axis, _NO_CENTRE, _UP, seconds, line)

    def _add(self, motion: int, p: Point, axis: Point, centre: Point, normal: Point, feed: float, line: int) -> None:
        if len(self._rows) >= MOST_ROWS:
            raise InputError(f"line {line}: more than {MOST_ROWS} motions: split the program")
        label = self._labels.setdefault(self.label, len(self._labels))
        self._rows.append((motion, p, axis, centre, normal, feed, self.spindle, self.tool, line, label))
        self.at, self.axis = p, axis

    def _speed(self, stands: bool, axis: Point, line: int) -> float:
        """Feed of a cut [mm/s], [rad/s] where the tip ``stands``."""
        if self.stated is None:
            if self.feed is None:
                raise InputError(f"line {line}: a cutting motion without a feed: no FEDRAT before it: give a feed")
            value, counts = self.feed, MINUTE
        else:
            value, counts = self.stated[0], self.stated[1]
            if counts == TURN:
                if self.spindle == 0.0:
                    raise InputError(
                        f"line {line}: a feed per turn with the spindle at rest: SPINDL must come before it"
                    )
                value *= abs(self.spindle) / math.tau
            else:
                value = mm_s_from_mm_min(value)
        if value <= 0.0:
            raise InputError(f"line {line}: a cutting motion at feed {value:g}: FEDRAT must be above 0")
        if counts == DEGREES and not stands:
            raise InputError(
                f"line {line}: a feed in degrees a minute, but the tip moves: give FEDRAT in lengths a minute"
            )
        if stands:
            if counts != DEGREES and axis != self.axis:
                text = "the tool turns about its tip: the feed is taken in degrees a minute"
                self.note_once("apt-turn", line, text)
            return math.radians(value)
        return value

    def _centre_arc(self, p: Point, centre: Point, normal: Point, line: int) -> tuple[Point, float]:
        """The centre as far from both ends, and that distance [mm]."""
        n, c = np.array(normal), np.array(centre)
        v0, v1 = ((w - (w @ n) * n) for w in (np.array(self.at) - c, np.array(p) - c))
        r0, r1 = float(np.linalg.norm(v0)), float(np.linalg.norm(v1))
        if abs(r1 - r0) <= 0.5 * ARC_SKEW_MM:
            return centre, r1
        chord = v1 - v0
        length = float(np.linalg.norm(chord))
        along = chord / length
        shift = float(0.5 * (v0 + v1) @ along)
        if abs(shift) > MOST_SHIFT_MM:
            raise InputError(
                f"line {line}: an arc starts {r0:.6g} mm from its centre and ends {r1:.6g} mm from it: must agree: "
                "correct the CIRCLE before it"
            )
        self.note(
            "apt-arc", line, f"the arc's ends differ by {abs(r1 - r0):.3g} mm: its centre is moved {shift:.3g} mm"
        )
        moved = c + shift * along
        return (float(moved[0]), float(moved[1]), float(moved[2])), float(np.linalg.norm(v1 - shift * along))

    def program(self) -> tuple[Program, tuple[Finding, ...]]:
        """All rows, and the findings."""
        if not self._rows:
            raise InputError(f"{self.name}: no point: CL data must have at least one GOTO")
        if self._left:
            self.findings.append(
                Finding("apt-more-findings", 0, f"{self._left} more findings are not listed", self._left_severity)
            )
        motion, p, axis, centre, normal, feed, spindle, tool, line, label = zip(*self._rows, strict=True)
        whole = Program(
            motion=np.array(motion),
            p_work=np.array(p),
            axis=np.array(axis),
            centre=np.array(centre),
            normal=np.array(normal),
            turns=np.zeros(len(motion), dtype=np.int64),
            feed=np.array(feed),
            spindle=np.array(spindle),
            tool=np.array(tool),
            line=np.array(line),
            label=np.array(label),
            labels=tuple(self._labels),
        )
        return whole, tuple(self.findings)
