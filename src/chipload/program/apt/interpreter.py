"""Execution of the records of CL data, one after the other.

Notation: ``mm`` in one unit of the text; p, a a point and the tool's axis as the text gives them, w, b the same in the
work frame. Between records stand the units, the coordinates, a pending RAPID or CIRCLE, and the cycle that cuts holes.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from chipload.errors import Finding, Severity
from chipload.program.apt.arcs import SWEEP, Circle, read_circle, read_tlon, sweep_of
from chipload.program.apt.cutters import Shape, length_unit, nx_shape, shape, tool_number
from chipload.program.apt.cycles import FEEDS, Cycle, read_cycle
from chipload.program.apt.frames import Coordinates, unit
from chipload.program.apt.records import NOTE, AptRecord
from chipload.program.apt.track import DEGREES, MINUTE, AptRows, Point
from chipload.program.program import DWELL, LINE, RAPID, Program
from chipload.units import MM_PER, rad_s_from_rpm

Floats = NDArray[np.float64]

#: how far the length of a tool's axis may be from 1 without a finding
UNIT_AXIS = 1e-3
#: how far the radius that a CIRCLE gives may be from its arc [mm] without a finding
RADIUS_MM = 1e-2

#: records that change the coordinates or the order of the records in a way that is not read
REFUSED = re.compile("TRACUT|COPY|INDEX|TRANS|CALL|MACRO|TERMAC|LOOPST|LOOPND|JUMPTO|IF|MIRROR|TMARK")
#: records that move the tool in a way that is not read: they are left out, and the program is unproven
LEFT_OUT = re.compile(
    "ARC|GOHOME|RETRCT|THREAD|POCKET|INDIRP|TLLFT|TLRGT|TLON|GOLFT|GORGT|GOFWD|GOBACK|GOUP|GODOWN|GO|PSIS|PROBE|"
    "ROTATE|ROTHED|PATTERN|CALSUB|NURBS|SPLINE"
)
#: records that a Program does not hold
UNUSED = re.compile(
    "COOLNT|STOP|OPSTOP|SELECT|SELCTL|OPSKIP|SEQNO|MACHIN|CUTCOM|INTOL|OUTTOL|TOLER|PREFUN|AUXFUN|CLAMP|MODE|DISPLY|"
    "TPRINT|REMARK|LETTER|OPFEATEND|REWIND|CLEARP|AUTOPS|TOOLPATH|PAINT|MSYS"
)
#: ends an operation of NX, whose texts have no FINI
END_OF_PATH = "END-OF-PATH"
_SILENT = frozenset({"PARTNO"})


class AptInterpreter:
    """Modal state between records; ``ended`` is the record that ends the text, once it is read."""

    def __init__(self, track: AptRows, mm: float, coordinates: Coordinates, units_stated: bool) -> None:
        self.track, self.mm, self.ended = track, mm, ""
        self._units_stated, self._path_ended = units_stated, False
        self._msys: tuple[str, ...] | None = None  # of NX: each of its operations states it
        self._in = coordinates
        self._resolved: tuple[Floats, Floats, Floats] | None = None
        self._axis: Point | None = None  # of the text, None: that of the coordinates
        self._programmed: Point | None = None  # the last point of the text, in the work frame
        self._rapid = False
        self._circle: Circle | None = None
        self._direction: Point | None = None  # of INDIRV
        self._cycle: Cycle | None = None
        self._unread: AptRecord | None = None  # the CYCLE that is not read
        self._drilling = False
        self._shape: Shape | None = None  # of the last CUTTER
        self._changed: AptRecord | None = None  # the CUTTER that changed it since the last point
        self._loaded = False  # whether a tool was loaded after it
        self._sense = -1.0 if track.spindle < 0.0 else 1.0
        self._speed = abs(track.spindle)
        self._counts: tuple[str, float | None] = (MINUTE, None)
        self._do: dict[str, Callable[[AptRecord], None]] = {
            "GOTO": self._goto,
            "FROM": self._from,
            "GODLTA": self._godlta,
            "CIRCLE": self._circle_record,
            "MOVARC": self._circle_record,
            "INDIRV": self._indirv,
            "ORIGIN": self._origin,
            "TLON,GOFWD": self._tlon,
            "RAPID": self._rapid_record,
            "CYCLE": self._cycle_record,
            "DELAY": self._delay,
            "DWELL": self._delay,
            "FEDRAT": self._fedrat,
            "SPINDL": self._spindl,
            "UNITS": self._units,
            "UNIT": self._units,
            "LOAD": self._load,
            "LOADTL": self._load,
            "TOOLNO": self._load,
            "TURRET": self._load,
            "MULTAX": self._multax,
            "CSYS": self._coordinates,
            "TRNTYP": self._coordinates,
            "ROTABL": self._coordinates,
            "TLAXIS": self._coordinates,
            "CUTTER": self._cutter,
            "TLDATA": self._cutter,
            "PPRINT": self._label,
            "INSERT": self._label,
            "OPFEATSTART": self._label,
        }

    def read(self, record: AptRecord) -> None:
        """One record."""
        word, track = record.word, self.track
        self._path_ended = word == END_OF_PATH or (self._path_ended and word == NOTE)
        if word in self._do:
            self._do[word](record)
        elif word in ("FINI", "END"):
            self.ended = word
        elif REFUSED.fullmatch(word) or (word == "MSYS" and track.at is not None and record.args != self._msys):
            raise record.error(
                "changes the coordinates or the order of the records and is not read: write plain GOTO instead"
            )
        elif LEFT_OUT.fullmatch(word.partition(",")[0]):
            track.leave_out("apt-left-out", record.line, f"{record}: moves the tool and is not read: left out")
        elif word == "CUTCOM" and record.args != ("OFF",):
            track.note_once("apt-cutcom", record.line, f"{record}: points are taken as positions of the tool tip")
        elif word == "MODE" and "INCR" in record.args:
            track.leave_out("apt-left-out", record.line, f"{record}: points are taken as positions, not as steps")
        elif UNUSED.fullmatch(word):
            self._msys = record.args if word == "MSYS" else self._msys
            track.note("apt-unused", record.line, str(record))
        elif word not in (*_SILENT, END_OF_PATH):
            track.note("apt-comment" if word == NOTE else "apt-unknown", record.line, str(record))

    def done(self) -> tuple[Program, tuple[Finding, ...]]:
        """The program."""
        if self._circle is not None:
            self.track.note("apt-circle", self._circle.record.line, "CIRCLE without a GOTO after it is left out")
        if not self.ended and not self._path_ended:
            self.track.leave_out("apt-end", 0, "the text does not end with FINI: it may be truncated")
        return self.track.program()

    # ------------------------------------------------------------------------------------------------ motions

    def _goto(self, record: AptRecord) -> None:
        p, b = self._point(record)
        if self._unread is not None:
            self.track.leave_out(
                "apt-cycle", record.line, f"{self._unread} is not read: its hole at {record} is left out"
            )
        elif self._drilling and self._cycle is not None:
            self._hole(self._cycle, p, b, record)
        elif self._circle is not None:
            self._arc(self._circle, p, b, record)
        elif self._rapid:
            self.track.rapid(p, b, record.line)
        else:
            self.track.straight(p, b, record.line)
        self._rapid, self._programmed = False, p

    def _from(self, record: AptRecord) -> None:
        p, b = self._point(record)
        if self.track.at is not None and (self.track.at, self.track.axis) != (p, b):
            self.track.note("apt-from", record.line, f"{record}: the tool moves there in a rapid")
        self.track.rapid(p, b, record.line)
        self._programmed = p

    def _godlta(self, record: AptRecord) -> None:
        d = record.numbers(1, 3)
        if self._programmed is None or self._drilling or self._circle is not None:
            raise record.error("must come after a point, and not in a cycle or after CIRCLE")
        R, _, _ = self._frame()
        b = self.track.axis
        step = np.multiply(d[0], b) if len(d) == 1 else R @ d
        p = _tuple(self._programmed + step * self.mm)
        (self.track.rapid if self._rapid else self.track.straight)(p, b, record.line)
        self._rapid, self._programmed = False, p

    def _point(self, record: AptRecord) -> tuple[Point, Point]:
        """The point and the axis of a GOTO in the work frame."""
        v = record.numbers(3, 6)
        if self._changed is not None and not self._loaded and self.track.at is not None:
            text = f"{self._changed}: no LOADTL follows the new cutter: tool {self.track.tool} stays loaded"
            self.track.note("apt-cutter", self._changed.line, text)
        self._changed, self._loaded = None, False
        if not self._units_stated:
            text = "no UNITS before it: lengths are read as mm: state UNITS, or program.unit of the job"
            self.track.note("apt-units", record.line, text, Severity.UNPROVEN)
            self._units_stated = True
        R, t, natural = self._frame()
        if self._in.note:
            self.track.note_once("apt-coordinates", record.line, self._in.note)
        if len(v) == 6:
            a, length = unit(record, v[3:])
            if abs(length - 1.0) > UNIT_AXIS:
                self.track.note(
                    "apt-axis", record.line, f"the axis has the length {length:.6g}: must be 1; it is scaled"
                )
            self._axis = a
        if self._axis is not None and self._in.in_work:
            return (v[0] * self.mm, v[1] * self.mm, v[2] * self.mm), self._axis
        b = natural if self._axis is None else R @ self._axis
        return _tuple(R @ (np.multiply(v[:3], self.mm) - t)), _tuple(b / np.linalg.norm(b))

    def _frame(self) -> tuple[Floats, Floats, Floats]:
        if self._resolved is None:
            self._resolved = self._in.resolved()
        return self._resolved

    def _rapid_record(self, record: AptRecord) -> None:
        self._rapid = True

    def _circle_record(self, record: AptRecord) -> None:
        if self._circle is not None:
            self.track.note("apt-circle", self._circle.record.line, "CIRCLE without a GOTO after it is left out")
        circle = read_circle(record)
        if isinstance(circle, str):
            self.track.leave_out(
                "apt-circle", record.line, f"{record}: {circle}: the tool moves to the next point in a straight line"
            )
            self._circle = None
            return
        if circle.unread:
            self.track.note_once("apt-circle", record.line, f"{record}: {circle.unread} is not read")
        self._circle = circle

    def _indirv(self, record: AptRecord) -> None:
        self._direction = unit(record, record.numbers(3))[0]

    def _tlon(self, record: AptRecord) -> None:
        """An arc from where the tool stands, in the direction of INDIRV."""
        at, direction, b = self._programmed, self._direction, self.track.axis
        self._direction = None
        if at is None or direction is None or self._drilling or self._circle is not None:
            self.track.leave_out("apt-left-out", record.line, f"{record}: needs a point and INDIRV before it: left out")
            return
        R, t, _ = self._frame()
        start = _tuple((R.T @ at + t) / self.mm)
        found = read_tlon(record, start, direction)
        if isinstance(found, str):
            self.track.leave_out("apt-left-out", record.line, f"{record}: {found}: left out")
            return
        circle, end = found
        p = _tuple(R @ (np.multiply(end, self.mm) - t))
        self._arc(circle, p, b, record)
        self._rapid, self._programmed = False, p

    def _origin(self, record: AptRecord) -> None:
        if any(record.numbers()[:3]):
            text = f"{record}: is not read: points are taken unchanged"
            self.track.leave_out("apt-origin", record.line, text)
        else:
            self.track.note("apt-unused", record.line, str(record))

    def _arc(self, circle: Circle, p: Point, b: Point, record: AptRecord) -> None:
        self._circle = None
        if self._rapid:
            self.track.note("apt-arc", record.line, "RAPID before an arc: it is cut at the feed in effect")
        R, t, _ = self._frame()
        centre, normal = _tuple(R @ (np.multiply(circle.centre, self.mm) - t)), _tuple(R @ circle.normal)
        start = self.track.at
        self.track.arc(p, b, centre, normal, record.line)
        off = np.subtract(p, centre)
        own = float(np.linalg.norm(off - (off @ normal) * np.array(normal)))
        if circle.radius is not None and abs(own - circle.radius * self.mm) > RADIUS_MM:
            text = f"{circle.record}: its radius to the GOTO after it is {own:.6g} mm"
            self.track.note("apt-arc", circle.record.line, text)
        if circle.sweep is not None and start is not None:
            sweep = sweep_of(start, p, centre, normal)
            if abs(sweep - circle.sweep) > SWEEP:
                text = (
                    f"{circle.record}: the GOTO after it gives a sweep of {math.degrees(sweep):.4g} deg, which is cut"
                )
                self.track.leave_out("apt-arc", circle.record.line, text)

    # ------------------------------------------------------------------------------------------------ holes

    def _cycle_record(self, record: AptRecord) -> None:
        word = record.args[0] if record.args else ""
        if word not in ("ON", "INIT", "CLEAR"):
            self._unread = None
        if word in ("OFF", "NOMORE"):
            self._drilling = False
        elif word == "ON":
            self._drilling = self._cycle is not None
        elif word not in ("INIT", "CLEAR"):
            found = read_cycle(record, self.mm)
            if found is None:
                self._cycle, self._drilling, self._unread = None, False, record
                return
            self._cycle, self._drilling = found[0], True
            if found[1]:
                self.track.leave_out(
                    "apt-cycle", record.line, f"{record}: {', '.join(found[1])} is not read in a cycle"
                )

    def _hole(self, cycle: Cycle, p: Point, b: Point, record: AptRecord) -> None:
        """A hole at p against the axis b."""
        track, line = self.track, record.line
        if self._circle is not None:
            raise record.error("CIRCLE before a hole: must not be")
        at, up = np.array(p), np.array(b)
        stated, turning = track.stated, track.spindle
        if cycle.kind == "TAP" and turning == 0.0:
            raise record.error("a tap with the spindle at rest: SPINDL must come before it")
        if track.at is not None:
            height = float(np.subtract(track.at, at) @ up)
            if height < cycle.rtrcto - 1e-9 and track.axis == b:
                track.rapid(_tuple(track.at + (cycle.rtrcto - height) * up), b, line)
            height = max(height, cycle.rtrcto)
        else:
            height = cycle.rtrcto
        track.rapid(_tuple(at + height * up), b, line)
        if cycle.feed is not None:
            track.stated = cycle.feed
        for kind, h, value in cycle.steps():
            w = _tuple(at + h * up)
            if kind == DWELL:
                track.dwell(value, line)
            elif kind == LINE:
                track.straight(w, b, line)
            elif kind == RAPID and w != track.at:
                track.rapid(w, b, line)
            elif kind != RAPID:
                track.spindle = value * turning
        track.stated = stated

    def _delay(self, record: AptRecord) -> None:
        turns = record.args[1:] == ("REV",)
        value = record.number(0)
        if value < 0.0 or (len(record.args) > 1 and not turns):
            raise record.error("must be a time in s, at least 0, or a number of turns and REV")
        if turns and self.track.spindle == 0.0:
            raise record.error("turns of the spindle, which is at rest: SPINDL must come before it")
        self.track.dwell(value * math.tau / abs(self.track.spindle) if turns else value, record.line)

    # --------------------------------------------------------------------------------------------- modal words

    def _fedrat(self, record: AptRecord) -> None:
        values = [k for k, word in enumerate(record.args) if word not in FEEDS and word != "DPM"]
        words = [word for word in record.args if word in FEEDS or word == "DPM"]
        if len(values) != 1 or len(words) > 1:
            raise record.error(f"must have one number and at most one of {', '.join((*FEEDS, 'DPM'))}")
        if words:
            self._counts = (DEGREES, 1.0) if words == ["DPM"] else FEEDS[words[0]]
        counts, scale = self._counts
        self.track.stated = (record.number(values[0]) * (self.mm if scale is None else scale), counts)

    def _spindl(self, record: AptRecord) -> None:
        words = [word for word in record.args if word in ("RPM", "CLW", "CCLW", "ON", "OFF")]
        values = [k for k, word in enumerate(record.args) if word not in words]
        if len(values) > 1 or not record.args:
            raise record.error("must have one number and RPM, CLW or CCLW, or be ON or OFF")
        if "CLW" in words or "CCLW" in words:
            self._sense = -1.0 if "CCLW" in words else 1.0
        if values:
            self._speed = rad_s_from_rpm(record.number(values[0]))
            if self._speed < 0.0:
                raise record.error("must be at least 0: CCLW turns it the other way")
        self.track.spindle = 0.0 if "OFF" in words else self._sense * self._speed + 0.0

    def _units(self, record: AptRecord) -> None:
        self.mm, self._units_stated = MM_PER[length_unit(record)], True

    def _load(self, record: AptRecord) -> None:
        self.track.tool, self._loaded = tool_number(record), True

    def _multax(self, record: AptRecord) -> None:
        if record.args not in ((), ("ON",), ("OFF",)):
            raise record.error("must be ON or OFF")
        self._axis = None if record.args == ("OFF",) else self._axis

    def _coordinates(self, record: AptRecord) -> None:
        self._resolved = self._axis = None
        if record.word == "CSYS":
            self._in = self._in.csys(record, self.mm)
        elif record.word == "TRNTYP":
            self._in = self._in.trntyp(record)
        elif record.word == "ROTABL":
            self._in = self._in.rotabl(record)
        else:
            self._in = self._in.tool_axis(record)

    def _cutter(self, record: AptRecord) -> None:
        numbers = nx_shape(record, self.mm) if record.word == "TLDATA" else shape(record, self.mm)
        if numbers is None:
            self.track.note("apt-unused", record.line, str(record))
        elif numbers != self._shape:
            self._shape, self._changed = numbers, record

    def _label(self, record: AptRecord) -> None:
        text = record.args[0]
        if record.word == "INSERT":
            self.track.note("apt-unused", record.line, str(record))
            if text.startswith(("STOP", "Stock Size")):
                return
        self.track.label = text


def _tuple(v: Floats) -> Point:
    return (float(v[0]), float(v[1]), float(v[2]))
