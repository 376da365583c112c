"""State of a conversational program while it is executed, and the rows that it produces.

Notation: ``at`` (9) is the programmed position [mm, rad]; beside a contour (RL, RR) the tool's centre stands elsewhere,
and ``lag`` (2) [mm] is by how much it still does after R0, until X or Y is given. Axes in ``unknown`` stand where the
program does not say.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Protocol, cast

from chipload.errors import Finding, InputError, Severity
from chipload.program.commands import ARC, DWELL, LINE, PLANE_AXES, RAPID, XY, YZ, Frame, Row
from chipload.program.compensation import CentreMove, Compensation, ContourArc, ContourFeed, contour_arc
from chipload.program.corners import Corner, Piece, join_corner
from chipload.program.heidenhain.formula import NotKnownError, QParameters, q_number
from chipload.program.heidenhain.words import (
    AXIS,
    FEED,
    FEED_UNIT,
    PLUNGING,
    RETRACT,
    SETTINGS,
    TURN_FEED,
    feed_unit,
    number,
    rest_of,
)
from chipload.program.swivel import Swivel
from chipload.program.tilt import Tilt
from chipload.units import mm_s_from_mm_min

#: findings that are kept
KEPT = 2000
#: largest coordinate [mm or deg]
FARTHEST = 1e6
AXES = "XYZABC"
#: the parameter that holds the radius of the tool
RADIUS_Q = 108


class Pending(Protocol):
    """What the first motion of a contour completes: ``side`` of the tool beside that contour."""

    side: int

    def carry_out(self, first: Piece | None) -> None:
        """Carry it out before a motion, or alone."""


class ConversationalState:
    """State and output of one reading.

    Parameters
    ----------
    name : of the program
    parameters : Q parameters by number that are known before
    radii : [mm] of the tools by number, where the program states none
    feed : [mm/s] of cuts before the program states one; None: such a cut is refused
    swivel : the machine, for tilted working planes; None: they are not read
    """

    def __init__(
        self,
        name: str,
        parameters: Mapping[int, float],
        radii: Mapping[int, float],
        feed: float | None,
        swivel: Swivel | None = None,
    ) -> None:
        self.line = 0
        self.q = QParameters(parameters)
        self.rows: list[Row] = []
        self.findings: list[Finding] = []
        self.labels: list[str] = [name]
        self.frames: list[Frame] = [Frame()]
        self.at = [0.0] * 9
        self.unknown = set(range(3))
        #: rows of rapids that send an axis for the first time, from nobody knows where
        self.unplaced: list[int] = []
        #: in the plane that the axes of CC name
        self.pole: list[float | None] = [None, None]
        self.pole_plane = XY
        self.heading: complex | None = None
        self.shift = [0.0] * 9
        self.scale = 1.0
        #: programmed X Y Z become factor * value + origin: mirrored and scaled coordinates
        self.factor, self.origin = [1.0] * 3, [0.0] * 3
        self.feed = feed
        #: feed of the last TOOL CALL, which F AUTO takes [mm/s]; None: it states none
        self.called_feed: float | None = None
        self.feed_of_turn = False
        #: arcs beside a contour whose feed is that of the contour
        self.contour_feed = ContourFeed.NONE
        #: largest feed down the tool's axis as a share of F (M103); None: none
        self.plunging_share: float | None = None
        self.speed, self.sense = 0.0, 0.0
        self.tool, self.lengths = 0, dict[int, float]()
        self.radii, self.stated_radii, self.extra_radius = dict(radii), dict[int, float](), 0.0
        self.tcp = False
        self.swivel = swivel
        #: the tilted working plane in the datum's coordinates; None: none
        self.tilt: Tilt | None = None
        self.ended = False
        #: why motions are left out until further notice; empty: they are not
        self.left_out = ""
        self.side = 0
        self.lag = [0.0, 0.0]
        self._beside: Compensation | None = None
        #: whether the next block rounds or chamfers the end of this one
        self.before_corner = False
        self._waiting: Piece | None = None
        self._corner: Corner | None = None
        #: an approach that the next motion completes
        self.approaching: Pending | None = None

    # -- findings ---------------------------------------------------------------------------------------------
    def note(self, code: str, text: str, severity: Severity = Severity.NOTE) -> None:
        """Keep a finding; one that was there is not repeated."""
        if len(self.findings) < KEPT or severity > Severity.NOTE:
            found = Finding(code, self.line, text, severity)
            if found not in self.findings[-50:]:
                self.findings.append(found)

    def unproven(self, code: str, text: str) -> None:
        """Keep a finding on something that is left out, so that the program is unproven."""
        self.note(code, text, Severity.UNPROVEN)

    # -- words ------------------------------------------------------------------------------------------------
    def amount(self, text: str) -> float:
        """The value of a number or of a parameter."""
        plain = text.replace(" ", "").lstrip("+")
        if not plain.startswith("Q"):
            return number(plain)
        letters = plain.rstrip("0123456789")
        return self.q.read(q_number(letters, plain[len(letters) :]))

    def signed(self, sign: str, text: str) -> float:
        """The value with its sign."""
        return self.amount(text) * (-1.0 if sign == "-" else 1.0)

    def ends(self, text: str) -> tuple[list[float], set[int]]:
        """The end of a motion and which axes it names."""
        end, named = list(self.at), set[int]()
        for step, letter, sign, value in AXIS.findall(rest_of(text, RETRACT, SETTINGS)):
            k = AXES.index(letter)
            amount = self.signed(sign, value) * (self.scale if k < 3 else math.pi / 180.0)
            if not abs(amount) <= FARTHEST:
                raise InputError(f"{letter} = {amount:g}: must be at most {FARTHEST:g}")
            if step and k in self.unknown:
                raise NotKnownError(f"I{letter}: the position of the axis is not known: give {letter} first")
            if k < 3:
                amount = self.factor[k] * amount + (0.0 if step else self.origin[k])
            end[k] = end[k] + amount if step else amount
            named.add(k)
        return end, named

    def size_factor(self, plane: int = XY) -> float:
        """By what mirrored and scaled coordinates multiply a length in a plane; below 0 they turn the other way.

        Raises
        ------
        InputError
            The two axes have different factors.
        """
        a, b = (self.factor[k] for k in PLANE_AXES[plane][:2])
        if abs(abs(a) - abs(b)) > 1e-12:
            raise InputError(
                f"arcs, lengths and roundings in a plane with factors {abs(a):g} and {abs(b):g}: must have one factor"
            )
        return math.copysign(abs(a), a * b)

    def feed_of(self, text: str) -> bool:
        """Take the feed of a block; whether it goes at rapid."""
        text = self.rules_of_feed(text)
        turned = TURN_FEED.search(text)
        if turned is not None:
            self._take(self.amount(turned[1]), True)
        found = FEED.search(text)
        if found is not None and found[1] == "AUTO" and self.called_feed is not None:
            self.feed = self.called_feed
        elif found is not None and found[1] == "AUTO":
            if self.feed is None:
                raise InputError("F AUTO: the feed of a tool table is not known: give a number")
            self.unproven(
                "heidenhain-feed-auto", "F AUTO: the feed of a tool table is not known: the last one is taken"
            )
        elif found is not None and found[1] != "MAX":
            self._take(self.amount(found[1]), False)
        return found is not None and found[1] == "MAX"

    def rules_of_feed(self, text: str) -> str:
        """Take M136 and M137, the unit of F, and M103 F, the share of it that plunges have; the rest of the text."""
        for found in FEED_UNIT.finditer(text):
            self.feed_of_turn, self.feed = found[1] == "136", None
        for found in PLUNGING.finditer(text):
            percent = None if found[1] is None else self.amount(found[1])
            if percent is not None and not 0.0 < percent <= 100.0:
                raise InputError(f"M103 F{percent:g}: must be above 0 and at most 100 percent")
            self.plunging_share = None if percent is None else 0.01 * percent
        return PLUNGING.sub("", text)

    def _take(self, value: float, of_turn: bool) -> None:
        value *= self.scale if of_turn or self.feed_of_turn else feed_unit(self.scale)
        if not 0.0 < value < FARTHEST:
            raise InputError(f"F{value:g}: must be above 0 and below {FARTHEST:g}")
        of_turn = of_turn or self.feed_of_turn
        if of_turn and self.speed == 0.0:
            raise InputError(f"F{value:g} for each turn: the spindle speed is not known: give S")
        self.feed = value * self.speed / math.tau if of_turn else mm_s_from_mm_min(value)

    def cutting_feed(self) -> float:
        """The feed of a cut [mm/s]."""
        if self.feed is None:
            raise InputError("a cut has no feed: give F")
        return self.feed

    # -- tools and frames -------------------------------------------------------------------------------------
    def radius(self) -> float | None:
        """Radius of the tool [mm] with what TOOL CALL adds; None: nothing states it."""
        stated = self.stated_radii.get(self.tool, self.radii.get(self.tool))
        return None if stated is None else stated + self.extra_radius

    def frame(self, extra_length: float = 0.0) -> None:
        """The coordinates from here on: the datum shift and the length of the tool."""
        self.end_contour()
        tool, shift = [0.0] * 9, list(self.shift)
        tool[2] = self.lengths.get(self.tool, 0.0) + extra_length
        self.frames.append(Frame(shift=shift, tool=tool, tilt=self.tilt))  # type: ignore[arg-type]

    # -- rows -------------------------------------------------------------------------------------------------
    def select(self, side: int, moves: set[int]) -> None:
        """Radius compensation of a block: side +1 left, -1 right, 0 none; ``moves`` the axes that it names."""
        if self.approaching is not None and side == self.approaching.side:
            return
        if side != self.side or (side and self._beside is None):
            self.end_contour()
            self.side = side
            if side:
                radius = self.radius()
                if radius is None:
                    self.unproven(
                        "nc-diameter-unknown",
                        f"R{'L' if side > 0 else 'R'}: no radius of tool {self.tool} is known, the path is compensated "
                        f"by 0: state R in TOOL DEF, D in a tool table, or a [[cutter]] with number = {self.tool}",
                    )
                start = [x + d for x, d in zip(self.at[:2], self.lag, strict=True)]
                self._beside = Compensation(side, radius or 0.0, XY, [*start, *self.at[2:]], square=True)
                self.lag = [0.0, 0.0]
        if not side and {0, 1} & moves and self.lag != [0.0, 0.0]:
            self._flush()
            self.lag = [0.0, 0.0]

    def end_contour(self) -> None:
        """Carry out what compensation holds back, and leave the tool where it stands."""
        self._flush()
        if self._beside is not None:
            self._emit(self._beside.finish())
            if self.rows:
                standing = self.rows[-1][1]
                self.lag = [standing[0] - self.at[0], standing[1] - self.at[1]]
            self._beside = None
        self.side = 0

    def _emit(self, moves: list[CentreMove]) -> None:
        for m in moves:
            head, tail, contour = cast("tuple[float, tuple[object, ...], ContourArc | None]", m.payload)
            if contour is not None:
                head *= contour.feed_share(m, XY)
            self.rows.append((m.motion, tuple(m.end), XY, m.centre, m.turns, head, *tail))

    def straight(self, motion: int, end: list[float]) -> None:
        """RAPID or LINE to the programmed ``end``."""
        feed = 0.0 if motion == RAPID else self.cutting_feed()
        if feed > 0.0 and end[:3] == self.at[:3] and end[3:] != self.at[3:]:
            # rotary axes alone turn at F degrees a minute, in inches too
            feed /= feed_unit(self.scale)
        if feed > 0.0 and self.plunging_share is not None and end[2] < self.at[2]:
            # F down the tool's axis is at most its share
            feed = min(feed, self.plunging_share * feed * math.dist(end[:3], self.at[:3]) / (self.at[2] - end[2]))
        self._turn_to(complex(end[0] - self.at[0], end[1] - self.at[1]))
        self._piece(Piece(motion, self.at, end, (0.0, 0.0), 0, feed, self.tail()))
        self.at = end

    def arc(self, end: list[float], centre: tuple[float, float], turns: int) -> None:
        """ARC to the programmed ``end``."""
        feed = self.cutting_feed()
        out = complex(end[0] - centre[0], end[1] - centre[1]) * (1j if turns > 0 else -1j)
        self._turn_to(out)
        self._piece(Piece(ARC, self.at, end, centre, turns, feed, self.tail()))
        self.at = end

    def upright_arc(self, end: list[float], centre: tuple[float, float], turns: int, plane: int) -> None:
        """ARC to ``end`` in the plane YZ or ZX, about ``centre`` in its coordinates."""
        if self.side:
            raise InputError("an arc in a plane along the tool's axis: must be without RL and RR: write R0 before it")
        self._flush()
        x, y = self.lag
        at = (centre[0] + y, centre[1]) if plane == YZ else (centre[0], centre[1] + x)
        self._row(ARC, end, self.cutting_feed(), at, turns, self.tail(), plane)
        self.heading = None
        self.at = end

    def last_motion(self) -> int | None:
        """The motion that was programmed last; None: none."""
        if self._waiting is not None:
            return self._waiting.motion
        return self.rows[-1][0] if self.rows else None

    def corner(self, corner: Corner) -> bool:
        """Round or chamfer the corner between the piece before and the next one; whether there is one before."""
        self._corner = corner
        return self._waiting is not None

    def _piece(self, piece: Piece) -> None:
        """A piece of the contour; it waits where its end is to be rounded."""
        self._approach(piece)
        before, corner = self._waiting, self._corner
        self._waiting = self._corner = None
        if before is not None:
            made = None if corner is None else join_corner(before, piece, corner)
            if corner is not None and made is None:
                self.sharp(corner.text)
            for some in (before,) if made is None else made[:-1]:
                self.carry(some)
            piece = piece if made is None else made[-1]
        if self.before_corner and piece.motion != RAPID:
            self._waiting = piece
        else:
            self.carry(piece)

    def sharp(self, text: str) -> None:
        """Report that a corner stays sharp; ``text`` is the block that requests another."""
        self.unproven("heidenhain-corner", f"{text[:40]}: the corner stays sharp: its rounding or chamfer is left out")

    def _approach(self, first: Piece | None) -> None:
        """Carry out the approach that waits for a motion."""
        waiting, self.approaching = self.approaching, None
        if waiting is not None:
            waiting.carry_out(first)

    def _flush(self) -> None:
        """Execute the motion that waits for a corner block."""
        self._approach(None)
        waiting, corner = self._waiting, self._corner
        self._waiting = self._corner = None
        if waiting is not None:
            if corner is not None:
                self.sharp(corner.text)
            self.carry(waiting)

    def carry(self, piece: Piece) -> None:
        """Execute a piece of the contour, beside it or on it."""
        if self._beside is None:
            self._row(piece.motion, piece.end, piece.feed, piece.centre, piece.turns, piece.tail)
        elif piece.motion == ARC:
            payload = piece.feed, piece.tail, contour_arc(self.contour_feed, piece.end, piece.centre, XY)
            self._emit(self._beside.arc(piece.end, piece.centre, piece.turns, payload))
        else:
            self._emit(self._beside.line(piece.motion, piece.end, (piece.feed, piece.tail, None)))

    def _turn_to(self, along: complex) -> None:
        if abs(along) > 1e-9:
            self.heading = along / abs(along)

    def dwell(self, seconds: float) -> None:
        """DWELL where the tool stands."""
        self._flush()
        if self._beside is not None:
            self._emit(self._beside.pause((seconds, self.tail(), None)))
        else:
            self._row(DWELL, self.at, seconds, (0.0, 0.0), 0, self.tail())

    def row(
        self,
        motion: int,
        end: list[float],
        feed: float = 0.0,
        centre: tuple[float, float] = (0.0, 0.0),
        turns: int = 0,
    ) -> None:
        """A motion of the tool's own centre."""
        self._flush()
        self._row(motion, end, feed, centre, turns, self.tail())

    def _row(
        self,
        motion: int,
        end: list[float],
        feed: float,
        centre: tuple[float, float],
        turns: int,
        tail: tuple[object, ...],
        plane: int = XY,
    ) -> None:
        x, y = end[0] + self.lag[0], end[1] + self.lag[1]
        self.rows.append((motion, (x, y, *end[2:]), plane, centre, turns, feed, *tail))

    def tail(self) -> tuple[object, ...]:
        """What a row has behind its motion."""
        spindle = self.speed * self.sense
        tip = self.tcp or (self.tilt is not None and self.swivel is not None and self.swivel.turns)
        return (spindle, self.tool, tip, len(self.frames) - 1, self.line, len(self.labels) - 1)

    def plunge(self, motion: int, z: float, value: float) -> None:
        """RAPID or LINE along Z, or DWELL: ``value`` the feed [mm/s] or the time [s]."""
        if motion != DWELL:
            self.at = [*self.at[:2], z, *self.at[3:]]
        self.row(motion, self.at, value if motion in (LINE, DWELL) else 0.0)
