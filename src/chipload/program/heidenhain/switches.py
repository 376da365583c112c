"""Modal functions of conversational blocks: M functions, tools, working plane, tool centre point control, datum.

Turned, mirrored and scaled coordinates are not read: motions are left out until they end.
"""

from __future__ import annotations

import math
import re

from chipload.errors import InputError
from chipload.program.compensation import ContourFeed
from chipload.program.heidenhain import tilted_plane, words
from chipload.program.heidenhain.state import AXES, RADIUS_Q, ConversationalState
from chipload.program.setup import FIRST_NAMED
from chipload.program.tilt import Tilt, tilt_of
from chipload.units import MM_PER, rad_s_from_rpm

TOOL_DIGITS = 9
#: M functions that are carried out, or that do not concern the path
KNOWN = (0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 13, 14, 19, 30, 89, 91, 92, 99, 103, 109, 110, 111, 128, 129, 136,
         137, 140)  # fmt: skip
#: rotary axes by the shortest way, look-ahead, filters, handwheels, limits of axes
SILENT = (90, 94, 101, 102, 107, 108, 116, 117, 118, 120, 124, 126, 127, 134, 135, 138, 141,
          142, 143, 148, 149, 150, 200, 201, 202, 203, 204)  # fmt: skip
#: what the feed of a compensated arc is of
CONTOUR_FEEDS = {109: ContourFeed.ALL, 110: ContourFeed.CONCAVE, 111: ContourFeed.NONE}
_SHIFT = re.compile(r"^(I?)([XYZABC])\s*(.+)$")
_CHANGE = re.compile(rf"\b(D[LR])\s*([-+]?)\s*({words.VALUE})")


def m_codes(text: str) -> list[int]:
    """Numbers of the M functions of a block, those of coolant and spindle too."""
    return [int(m[:6]) for m in words.M_CODE.findall(words.rest_of(text, words.SETTINGS))]


def functions(s: ConversationalState, text: str) -> None:
    """A block of M functions alone."""
    s.rules_of_feed(text)
    codes = m_codes(text)
    act_before(s, codes)
    act_after(s, codes)


def act_before(s: ConversationalState, codes: list[int]) -> None:
    """M functions that act at the beginning of their block."""
    for m in codes:
        if m in (3, 13):
            s.sense = 1.0
        elif m in (4, 14):
            s.sense = -1.0
        elif m in (128, 129):
            tip(s, m == 128, f"M{m}")
        elif m in CONTOUR_FEEDS:
            s.contour_feed = CONTOUR_FEEDS[m]
        if m in (7, 8, 9, 13, 14):
            word = 9 if m == 9 else 8
            s.note("nc-coolant", f"M{word}: coolant does not affect the path; it is ignored")


def act_after(s: ConversationalState, codes: list[int]) -> None:
    """M functions that act at the end of their block."""
    for m in codes:
        if m in (5, 19):
            s.sense = 0.0
        elif m in (0, 1, 6):
            s.note("nc-stop", f"M{m}: the program stops until it is started again")
        elif m in (2, 30):
            s.ended = True
        elif m in (97, 98):
            s.unproven("heidenhain-corner", f"M{m}: is ignored at a corner of a compensated contour")
        elif m == 114:
            s.unproven("heidenhain-m114", "M114: what the control adds to the path of a turning axis is left out")
        elif m == 130:
            s.unproven("heidenhain-m130", "M130: untilted coordinates are read as the current ones")
        elif m not in KNOWN and m not in SILENT:
            s.note("heidenhain-unknown", f"M{m}: its effect is not known here")


def tip(s: ConversationalState, on: bool, name: str) -> None:
    """Tool centre point control."""
    s.end_contour()
    s.tcp = on
    s.note("nc-tip", f"{name}: tool centre point control {'on' if on else 'off'}")


def function_word(s: ConversationalState, text: str) -> bool:
    """FUNCTION TCPM and the like; whether it is read."""
    if "TCPM" in text:
        tip(s, "RESET" not in text, "FUNCTION RESET TCPM" if "RESET" in text else "FUNCTION TCPM")
        return True
    if re.match(r"FUNCTION (?:MODE MILL|PROG PATH|FEED|RESET|S-PULSE)", text):
        s.note("heidenhain-unused", text[:60])
        return True
    return False


def plane(s: ConversationalState, text: str) -> None:
    """PLANE: the working plane."""
    why = tilted_plane.plane(s, text)
    if why:
        leave_out(s, f"{text[:60]}: {why}: motions are left out until PLANE RESET")
    else:
        s.left_out = ""


def leave_out(s: ConversationalState, reason: str) -> None:
    """Leave motions out from here on."""
    s.end_contour()
    s.left_out = reason
    s.unproven("heidenhain-plane", reason)


def program_word(s: ConversationalState, text: str) -> None:
    """BEGIN PGM: the unit."""
    found = re.match(r"BEGIN PGM\s+(.*?)\s*\b(MM|INCH)\s*$", text)
    if found is None:
        raise InputError(f"{text!r}: must be BEGIN PGM name MM or INCH: lengths are not guessed")
    s.scale = MM_PER["mm" if found[2] == "MM" else "inch"]


class Tools:
    """TOOL DEF and TOOL CALL; tools by name get numbers of their own."""

    def __init__(self) -> None:
        self.named: dict[str, int] = {}

    def read(self, s: ConversationalState, text: str) -> None:
        """Carry out a block."""
        found = re.match(r'TOOL (DEF|CALL)\s*(?:(\d+)(?:\.\d+)?|("[^"]*")|(Q[LR]?\d+))?', text)
        if found is None:
            raise InputError(f"{text[:60]}: must be TOOL DEF or TOOL CALL")
        rest = text[found.end() :]
        number = self._number(s, found)
        if found[1] == "DEF":
            self._define(s, number, rest)
            return
        spindle = re.search(rf"\bS\s*({words.VALUE})", rest)
        if spindle:
            s.speed = rad_s_from_rpm(s.amount(spindle[1]))
        s.feed_of(rest)
        if words.FEED.search(rest) is not None or number is not None:
            s.called_feed = s.feed if words.FEED.search(rest) is not None else None
        if number is None:
            return
        if re.search(r"\b[XY]\b", rest):
            raise InputError(f"{text!r}: the spindle along X or Y is not read: must be along Z")
        s.end_contour()
        s.tool, s.sense = number, 0.0
        more = {name: s.signed(sign, value) * s.scale for name, sign, value in _CHANGE.findall(rest)}
        s.extra_radius = more.get("DR", 0.0)
        if s.tool not in s.lengths:
            s.note("heidenhain-tool-unknown", f"tool {s.tool} has no TOOL DEF: its length is taken as 0")
        radius = s.radius()
        if radius is not None:
            s.q.set(RADIUS_Q, radius / s.scale)
        s.frame(more.get("DL", 0.0))

    def _number(self, s: ConversationalState, found: re.Match[str]) -> int | None:
        if found[2]:
            if len(found[2]) > TOOL_DIGITS:
                raise InputError(f"TOOL CALL {found[2][:20]}...: must be at most {'9' * TOOL_DIGITS}")
            return int(found[2])
        if found[3]:
            number = self.named.setdefault(found[3], FIRST_NAMED + len(self.named))
            s.note("nc-tool-unknown", f"tool {found[3][:40]}: has no number: it is taken as tool {number}")
            return number
        if found[4]:
            value = s.amount(found[4])
            if value != int(value) or not 0 <= value < 10**TOOL_DIGITS:
                raise InputError(f"TOOL CALL {found[4]} = {value:g}: must be the number of a tool")
            return int(value)
        return None

    def _define(self, s: ConversationalState, number: int | None, rest: str) -> None:
        length = re.search(r"\bL\s*([-+]?[\d.]+)", rest)
        radius = re.search(r"\bR\s*([-+]?[\d.]+)", rest)
        if number is not None and length:
            s.lengths[number] = words.number(length[1]) * s.scale
        if number is not None and radius and words.number(radius[1]) != 0.0:
            s.stated_radii[number] = words.number(radius[1]) * s.scale


def datum_shift(s: ConversationalState, text: str, body: str) -> None:
    """CYCL DEF 7.k: the shift of one axis."""
    if body.startswith("#"):
        s.unproven("heidenhain-datum", f"{text[:40]}: the datum table is not known here: its shift is taken as 0")
        return
    hit = _SHIFT.match(body)
    if hit is None:
        raise InputError(f"{text!r}: must be an axis and its shift")
    k = AXES.index(hit[2])
    value = s.q.formula(hit[3]) * (s.scale if k < 3 else math.pi / 180.0)
    if s.tilt is not None and k < 3:
        _shift_tilted(s, s.tilt, text, k, value, bool(hit[1]))
        return
    value = value + s.shift[k] if hit[1] else value
    s.end_contour()
    s.at[k] += s.shift[k] - value
    s.shift[k] = value
    s.frame()


def _shift_tilted(s: ConversationalState, tilt: Tilt, text: str, k: int, value: float, further: bool) -> None:
    """A shift of the datum along an axis of the tilted plane."""
    if any(s.shift[:3]) and not further:
        s.unproven("heidenhain-datum", f"{text[:40]}: is added to the shift from before the plane was tilted")
    s.end_contour()
    local = (tilt.matrix.T @ tilt.origin).tolist()
    new = local[k] + value if further else value
    s.at[k] += local[k] - new
    local[k] = new
    s.tilt = tilt_of(tilt.matrix, tuple(tilt.matrix @ local))
    s.frame()
