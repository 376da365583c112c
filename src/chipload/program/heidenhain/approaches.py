"""Approach to a contour and departure from it: APPR and DEP with LT, LN, CT and LCT.

Notation: complex numbers in the plane; ``u`` the direction of the contour at its first point PA or its last point PE,
``n`` = +-i u its normal on the tool's side, r the radius of the tool. PS is where the tool stands, PH the point
between, PN the end of a departure. The arc of CT and LCT touches the contour on the tool's side, is compensated like
the contour and turns to the left where the tool is left of it (RL); with a negative R of CT to the right, on the other
side of the contour.

An approach is carried out with the first motion behind it, which gives u. The tool goes to PH in the plane with the
feed that was before, at rapid if the block before was at FMAX, then to the Z of the block, then to PA.

Reference: Heidenhain, TNC 407 User's Manual, "Contour Approach and Departure"; iTNC 530 User's Manual HEIDENHAIN
Conversational, "Contour Approach and Departure"; TNC7 User's Manual, "Approach function APPR CT", "Departure function
DEP CT" (direction of rotation by compensation and sign of R).
"""

from __future__ import annotations

import cmath
import math
import re
from typing import NamedTuple

from chipload.errors import InputError
from chipload.program.commands import ARC, LINE, RAPID
from chipload.program.corners import Piece
from chipload.program.heidenhain import words
from chipload.program.heidenhain.formula import NotKnownError
from chipload.program.heidenhain.state import ConversationalState

#: a form with its words
FORM = re.compile(r"\s*(P?)(LCT|LT|LN|CT)\b\s*(.*)")
_LENGTH = re.compile(rf"\bLEN\s*\+?\s*({words.VALUE})")
_ANGLE = re.compile(rf"\bCCA\s*\+?\s*({words.VALUE})")
#: a motion in the plane is at least so long [mm]
LEAST_MM = 1e-9


class Form(NamedTuple):
    """Words of an approach or a departure: ``size`` is LEN or R [mm], ``span`` CCA [rad].

    ``turn`` is -1 for a negative R of CT, with which the arc turns the other way and lies on the other side.
    """

    kind: str
    size: float
    span: float
    turn: int = 1


def form_of(s: ConversationalState, kind: str, text: str) -> tuple[Form, str]:
    """The form of a block, and the words that it leaves.

    Raises
    ------
    InputError
        A word that the form needs is missing or not above 0.
    """
    name, pattern = ("LEN", _LENGTH) if kind in ("LT", "LN") else ("R", words.RADIUS)
    found = pattern.search(text)
    if found is None:
        raise InputError(f"{kind}: {name} is missing")
    size = s.amount(found[1]) if name == "LEN" else s.signed(found[1], found[2])
    span = math.pi
    if kind == "CT":
        angle = _ANGLE.search(text)
        if angle is None:
            raise InputError("CT: CCA is missing: the angle of the arc")
        span = math.radians(s.amount(angle[1]))
    turn = -1 if kind == "CT" and size < 0.0 else 1
    size *= turn
    if not (size > 0.0 and 0.0 < span <= math.tau):
        raise InputError(f"{kind}: {name} must be above 0, CCA above 0 and at most 360 deg")
    return Form(kind, size * s.scale * abs(s.size_factor()), span, turn), words.rest_of(text, pattern, _ANGLE)


class Approach:
    """An approach that waits for the first motion of its contour.

    Parameters
    ----------
    form, text : of the block
    end : PA (9) [mm, rad]
    side : of the tool, +1 left, -1 right
    lasting : feed before the block [mm/s]
    fast : whether the motion before it was at rapid
    """

    def __init__(
        self,
        s: ConversationalState,
        form: Form,
        text: str,
        end: list[float],
        side: int,
        lasting: float | None,
        fast: bool,
    ) -> None:
        self.s, self.form, self.text, self.side = s, form, text, side
        self.start, self.end = list(s.at), end
        self.feed, self.lasting, self.fast = s.cutting_feed(), lasting, fast
        self.tail = s.tail()

    def carry_out(self, first: Piece | None) -> None:
        """Carry the approach out before ``first``; None: nothing follows it, and it is straight."""
        s, at = self.s, list(self.s.at)
        s.at, s.side = self.start, 0
        u = None if first is None else _begin(first)
        if u is None:
            s.unproven("heidenhain-approach", f"{self.text[:40]}: no motion follows it: it is taken as a straight line")
            s.select(self.side, {0, 1})
            self._piece(LINE, self.end, self.feed)
        else:
            self._round(u)
        s.at = at

    def _round(self, u: complex) -> None:
        s, form, side = self.s, self.form, self.side
        radius = s.radius() or 0.0
        pa, ps = complex(*self.end[:2]), complex(*self.start[:2])
        n = 1j * side * u
        motion = RAPID if self.fast or self.lasting is None else LINE
        feed = 0.0 if motion == RAPID else self.lasting or 0.0
        if form.kind == "LN":
            self._to(pa + n * (form.size + radius), motion, feed)
            s.select(side, {0, 1})
            self._piece(LINE, self.end, self.feed)
            return
        s.select(side, {0, 1})
        if form.kind == "LT":
            self._to(pa - form.size * u, motion, feed)
            self._piece(LINE, self.end, self.feed)
            return
        sense = side * form.turn
        centre = pa + form.turn * n * form.size
        if form.kind == "CT":
            ph = centre + (pa - centre) * cmath.rect(1.0, -sense * form.span)
        else:
            # the line from PS touches the path of the tool's centre, an arc of the radius R - r
            ph = centre + form.size * touch_direction(ps - centre, form.size - radius, -side)
        self._to(ph, motion, feed)
        at, end = list(s.at), self.end
        s.carry(Piece(ARC, at, end, (centre.real, centre.imag), sense, self.feed, self.tail))
        s.at = end

    def _to(self, ph: complex, motion: int, feed: float) -> None:
        """To PH in the plane, then to the height of the block."""
        self._piece(motion, [ph.real, ph.imag, *self.start[2:]], feed)
        if self.end[2] != self.start[2]:
            self._piece(motion, [ph.real, ph.imag, *self.end[2:]], feed)

    def _piece(self, motion: int, end: list[float], feed: float) -> None:
        self.s.carry(Piece(motion, self.s.at, end, (0.0, 0.0), 0, feed, self.tail))
        self.s.at = end


def touch_direction(out: complex, radius: float, sense: int) -> complex:
    """Unit vector from a circle's centre to where a line from ``out`` (seen from the centre) touches the circle.

    Parameters
    ----------
    sense : -1: the line leads to an arc that turns to the left, or from one to the right; +1: the others

    >>> touch_direction(2.0 + 0.0j, 1.0, -1).real  # cos 60 deg
    0.4999999999999999
    """
    if not 0.0 < radius < abs(out):
        raise NotKnownError(f"LCT: an arc of the radius {radius:.6g} mm cannot be reached from {abs(out):.6g} mm")
    return cmath.rect(1.0, cmath.phase(out) - sense * math.acos(radius / abs(out)))


def _begin(piece: Piece) -> complex | None:
    """Direction of a piece where it begins; None: it does not move in the plane."""
    start, end = complex(*piece.start[:2]), complex(*piece.end[:2])
    along = end - start
    if piece.motion == ARC:
        along = (1j if piece.turns > 0 else -1j) * (start - complex(*piece.centre))
    return along / abs(along) if abs(along) > LEAST_MM else None


def depart(s: ConversationalState, form: Form, end: list[float], named: set[int], fast: bool) -> None:
    """Carry a departure out from where the contour ends."""
    if s.heading is None or not s.side:
        raise NotKnownError("DEP: no compensated contour is before it: write RL or RR, and a motion in the plane")
    u, side, radius = s.heading, s.side, s.radius() or 0.0
    pe, n = complex(*s.at[:2]), 1j * side * u
    motion = RAPID if fast else LINE
    if form.kind == "LT":
        pn = pe + form.size * u
        s.straight(motion, [pn.real, pn.imag, *s.at[2:]])
        s.end_contour()
    elif form.kind == "LN":
        s.end_contour()
        s.lag = [0.0, 0.0]
        pn = pe + n * (form.size + radius)
        s.straight(motion, [pn.real, pn.imag, *s.at[2:]])
    else:
        sense = side * form.turn
        centre = pe + form.turn * n * form.size
        if form.kind == "CT":
            ph = centre + (pe - centre) * cmath.rect(1.0, sense * form.span)
        else:
            pn = complex(*end[:2])
            ph = centre + form.size * touch_direction(pn - centre, form.size - radius, side)
        s.arc([ph.real, ph.imag, *s.at[2:]], (centre.real, centre.imag), sense)
        s.end_contour()
        if form.kind == "LCT":
            s.lag = [0.0, 0.0]
            s.straight(motion, [*end[:2], *s.at[2:]])
    if 2 in named:
        s.unknown.discard(2)
        s.straight(motion, [*s.at[:2], *end[2:]])
