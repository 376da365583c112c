"""Cutter radius compensation: the path of the tool centre beside a programmed contour (G41 and G42).

Notation: positions in the plane are complex numbers, first axis + i second axis. ``r`` is the tool's radius, ``s`` the
side (+1 left, -1 right), ``a -> b`` a programmed motion, ``m`` the offset of its start and ``e`` that of its end: r
away, square to the contour, on the tool's side. ``c`` is where the tool's centre stands.

At a corner that turns away from the tool the centre goes round the corner on an arc of radius r; at one that turns
towards it both motions end where their offsets cross. So the end of a motion is known only with the next motion in the
plane: one motion, and what follows it without moving in the plane, is held back.

The rules are those of LinuxCNC ("Tool Compensation" in its manual): the first motion leads to the offset of its own
end, a change of direction below 0.05 rad is no corner, and what the tool does not fit into is refused. As there, a
line that its corners turned back is not noticed where an arc follows it round a corner, or nothing but a smooth one.
With ``square`` the first motion ends square to the start of the contour that follows it, and may be of any length, as
a Heidenhain carries out RL and RR (iTNC 530 User's Manual, "Tool Radius Compensation").
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from typing import NamedTuple

from chipload.errors import InputError
from chipload.program.commands import ARC, DWELL, LINE, PLANE_AXES, RAPID

#: a change of direction below this is no corner [rad]
SMOOTH = 0.05
#: a smaller radius counts as none [mm]
LEAST_RADIUS = 1e-9
#: two arcs have one centre within this [mm]
SAME_CENTRE = 1e-6


class CentreMove(NamedTuple):
    """One motion of the tool's centre.

    ``motion`` RAPID, LINE, ARC or DWELL; ``end`` (9) [mm, rad]; ``centre`` (2) [mm] and ``turns`` of an arc as in
    :class:`~chipload.program.commands.Commands`; ``payload`` of the programmed motion that it belongs to.
    """

    motion: int
    end: tuple[float, ...]
    centre: tuple[float, float]
    turns: int
    payload: object


class ContourFeed(Enum):
    """What the feed of an arc beside a contour is of: the tool's centre, the contour, or that at concave arcs."""

    NONE = "centre"
    ALL = "contour"
    CONCAVE = "concave"


@dataclass(frozen=True)
class ContourArc:
    """A programmed arc whose feed is that along the contour: its centre and radius [mm]."""

    rule: ContourFeed
    centre: tuple[float, float]
    radius: float

    def feed_share(self, move: CentreMove, plane: int) -> float:
        """Feed of the tool's centre as a share of the programmed one, 1 for what is no part of the arc.

        F' = F r_c / r with r_c the radius on which the centre goes and r that of the contour.

        Reference: Siemens, SINUMERIK 808D ADVANCED, Programming and Operating Manual (Milling), 01/2014, p. 79;
        Heidenhain, iTNC 530 User's Manual, "Feed rate for circular arcs: M109/M110/M111".

        >>> arc = ContourArc(ContourFeed.ALL, (0.0, 0.0), 10.0)
        >>> arc.feed_share(CentreMove(2, (0.0, 15.0) + (0.0,) * 7, (0.0, 0.0), 1, None), 0)
        1.5
        """
        if move.motion != ARC or math.dist(move.centre, self.centre) > SAME_CENTRE:
            return 1.0
        first, second, _ = PLANE_AXES[plane]
        share = math.dist((move.end[first], move.end[second]), move.centre) / self.radius
        return min(share, 1.0) if self.rule is ContourFeed.CONCAVE else share


def contour_arc(rule: ContourFeed, end: Sequence[float], centre: tuple[float, float], plane: int) -> ContourArc | None:
    """The programmed arc to ``end``; None: its feed is that of the tool's centre."""
    first, second, _ = PLANE_AXES[plane]
    radius = math.dist((end[first], end[second]), centre)
    return None if rule is ContourFeed.NONE or radius <= LEAST_RADIUS else ContourArc(rule, centre, radius)


class _Offset(NamedTuple):
    """The offset of one motion in the plane: from ``m`` along ``u`` to ``e``; ``turns`` not 0: about ``o``.

    ``entry``: it leads to the contour from anywhere, so that its end may be moved either way.
    """

    motion: int
    m: complex
    u: complex
    e: complex
    o: complex = 0j
    turns: int = 0
    entry: bool = False


class Compensation:
    """The tool's centre beside the contour, from G41 or G42 to G40.

    Parameters
    ----------
    side : +1 tool left of the contour (G41), -1 right (G42)
    radius : of the tool [mm]; a negative one stands on the other side
    plane : XY (G17), ZX (G18) or YZ (G19)
    start : (9,) programmed position where compensation begins [mm, rad]
    shift : (2,) from the tool's centre to the point that is commanded, in the plane's axes [mm]
    slack : by how much an arc may turn more than programmed before it is refused [rad]; LinuxCNC's is 0.0254 in a text
        in mm, 0.001 in one in inches
    square : the first motion ends square to the start of the contour
    sharp : round a corner the offsets go on to where they cross or, where the path turns by more than a right angle, by
        r each; else an arc goes round it

    Raises
    ------
    InputError
        Of its methods: the tool does not fit beside a motion.
    """

    def __init__(
        self,
        side: int,
        radius: float,
        plane: int,
        start: Sequence[float],
        *,
        shift: tuple[float, float] = (0.0, 0.0),
        slack: float = 0.0254,
        square: bool = False,
        sharp: bool = False,
    ) -> None:
        self._side = side if radius >= 0.0 else -side
        # beside a contour of metres a smaller radius is lost in the coordinates
        self._radius = abs(radius) if abs(radius) >= LEAST_RADIUS else 0.0
        self._first, self._second, self._along = PLANE_AXES[plane]
        self._shift = complex(*shift)
        self._slack, self._square, self._sharp, self._anew = slack, square, sharp, False
        self._programmed = self._centre = tuple(start)
        self._held: list[CentreMove] = []
        self._front: _Offset | None = None
        self._from = 0j

    @property
    def position(self) -> tuple[float, ...]:
        """(9,) programmed end of the last motion [mm, rad]."""
        return self._programmed

    @property
    def end(self) -> tuple[float, ...]:
        """(9,) end of the last motion beside the contour, as long as no corner shortens it [mm, rad]."""
        return self._centre if self._front is None else self._with(self._centre, self._flat(self._centre) + self._shift)

    def line(self, motion: int, end: Sequence[float], payload: object) -> list[CentreMove]:
        """Motions that are final once a straight motion, RAPID or LINE, to ``end`` (9) is known."""
        a, b, r = self._flat(self._programmed), self._flat(end), self._radius
        if r == 0.0:
            return self._pass(CentreMove(motion, tuple(end), (0.0, 0.0), 0, payload))
        length, front = abs(b - a), self._front
        if front is None:
            if length == 0.0 and self._square:
                return self._pass(CentreMove(motion, tuple(end), (0.0, 0.0), 0, payload))
            if length <= r and not self._square:
                raise self._short(length)
            u = (b - a) / length
            normal = self._side * 1j * r * u
            return self._append(_Offset(motion, a + normal, u, b + normal, entry=True), end, payload)
        if a == b:
            self._programmed, self._centre = tuple(end), self._with(end, self._flat(self._centre))
            self._held.append(CentreMove(motion, self._centre, (0.0, 0.0), 0, payload))
            return []
        u = (b - a) / length
        normal = self._side * 1j * r * u
        return self._corner(front, _Offset(motion, a + normal, u, b + normal), a, end, payload)

    def arc(self, end: Sequence[float], centre: tuple[float, float], turns: int, payload: object) -> list[CentreMove]:
        """Motions that are final once an arc to ``end`` (9) about ``centre`` (2), in the plane's axes, is known."""
        a, b, o, r = self._flat(self._programmed), self._flat(end), complex(*centre), self._radius
        if r == 0.0:
            return self._pass(CentreMove(ARC, tuple(end), centre, turns, payload))
        inside = self._side * turns > 0
        size = min(abs(a - o), abs(b - o))
        if size <= (r if inside else 0.0):
            raise self._gouge(f"an arc of radius {size:.6g} mm", "use a smaller tool")
        outward = (b - o) / abs(b - o)
        e = b + (-r if inside else r) * outward
        front = self._front
        if front is None:
            if abs(b - a) <= r:
                raise self._short(abs(b - a))
            # its centre is on the normal at its end, as far from the start as from the offset of the end
            chord = a - e
            slope = 2.0 * (chord * outward.conjugate()).real
            if slope == 0.0:
                raise self._gouge("a first arc that starts on the tangent at its end", "start it farther away")
            o = e + outward * abs(chord) ** 2 / slope
            return self._append(_Offset(ARC, a, 0j, e, o, turns, entry=True), end, payload)
        radial = (a - o) / abs(a - o)
        m = a + (-r if inside else r) * radial
        new = _Offset(ARC, m, math.copysign(1.0, turns) * 1j * radial, e, o, turns)
        return self._corner(front, new, a, end, payload)

    def pause(self, payload: object) -> list[CentreMove]:
        """Motions that are final; a pause (DWELL) keeps its place among them."""
        self._held.append(CentreMove(DWELL, self._centre, (0.0, 0.0), 0, payload))
        return self._release() if self._front is None else []

    def again(self, side: int, radius: float) -> list[CentreMove]:
        """Motions that are final where G41 or G42 is repeated: the last one ends square to its own end."""
        self._check()
        done = self._release()
        self._side, self._radius = side if radius >= 0.0 else -side, abs(radius)
        self._anew = self._front is not None
        return done

    def skip(self, end: Sequence[float]) -> list[CentreMove]:
        """Motions that are final where the contour up to ``end`` (9) is left out: the next one is a first one."""
        done = self._release()
        self._front, self._square = None, True
        self._programmed = tuple(end)
        self._centre = self._with(end, self._flat(self._centre))
        return done

    def finish(self) -> list[CentreMove]:
        """The motions that were held back (G40)."""
        self._check()
        return self._release()

    def _release(self) -> list[CentreMove]:
        """What was held back, as commanded."""
        done, self._held = [self._out(move) for move in self._held], []
        return done

    def _corner(
        self, front: _Offset, new: _Offset, corner: complex, end: Sequence[float], payload: object
    ) -> list[CentreMove]:
        """Join ``new`` to the front; what is final."""
        c = self._flat(self._centre)
        if self._anew:
            self._anew = False
            return self._append(new, end, payload)
        if front.entry and self._square:
            self._trim(new.m)
            return self._append(new, end, payload)
        # from the direction to the tool's centre to its direction beside the new motion, > 0 away from the tool
        away = -self._side * cmath.phase((new.m - corner) / (c - corner))
        if away < -0.5 * math.pi:
            away += 2.0 * math.pi
        # an arc with the tool outside curves away, so that a reversal there is a corner towards the tool
        round_ = new if new.turns else front
        limit = math.pi + (-SMOOTH if self._side * round_.turns < 0 else SMOOTH)
        if away < -SMOOTH or away > limit:
            at = self._cross_offsets(front, new, corner)
            self._trim(at)
            return self._append(new, end, payload)
        if away <= SMOOTH:
            return self._append(new, end, payload)
        if not new.turns:
            self._check()
        if self._sharp:
            return self._round_corner(front, new, corner, away, end, payload)
        # the other axes go round the corner with the new motion, the one along the tool waits
        around = self._with(end, new.m, along=self._centre[self._along])
        rapid = new.motion == RAPID
        centre = (0.0, 0.0) if rapid else (corner.real, corner.imag)
        move = CentreMove(RAPID if rapid else ARC, around, centre, 0 if rapid else -self._side, payload)
        done = [*self._release(), self._out(move)]
        self._centre = around
        return [*done, *self._append(new, end, payload)]

    def _round_corner(
        self, front: _Offset, new: _Offset, corner: complex, away: float, end: Sequence[float], payload: object
    ) -> list[CentreMove]:
        """Straight pieces round a corner that turns away from the tool by ``away``.

        Reference: Fanuc B-63944EN-1, "Cutter or Tool Nose Radius Compensation", offset mode.
        """
        c, r = self._flat(self._centre), self._radius
        first, second = (c - corner) / r, (new.m - corner) / r
        if away <= 0.5 * math.pi + 1e-9:
            points = [corner + r * (first + second) / (1.0 + (first * second.conjugate()).real)]
        else:
            along = -self._side * 1j * r
            points = [c + along * first, new.m - along * second]
        if not front.turns:
            at = points.pop(0)
            self._held = [move._replace(end=self._with(move.end, at)) for move in self._held]
            self._centre = self._with(self._centre, at)
        done, motion = self._release(), RAPID if new.motion == RAPID else LINE
        for at in (*points, new.m) if new.turns else points:
            self._centre = self._with(end, at, along=self._centre[self._along])
            done.append(self._out(CentreMove(motion, self._centre, (0.0, 0.0), 0, payload)))
        return [*done, *self._append(new, end, payload)]

    def _cross_offsets(self, front: _Offset, new: _Offset, corner: complex) -> complex:
        """Where two offsets cross beside a corner that turns towards the tool."""
        if not front.turns and not new.turns:
            return new.m + new.u * self._radius * math.tan(0.5 * abs(cmath.phase(new.u / front.u)))
        if front.turns and new.turns:
            return self._circles(front, new)
        round_, straight = (front, new) if front.turns else (new, front)
        size = abs((front.e if front.turns else new.m) - round_.o)
        m = straight.m
        if front.entry and front.turns and corner != front.o:
            # its contour is thought r beside it on the side that its turns tell, even where it enters from the other
            out = (corner - front.o) / abs(corner - front.o)
            m += out * (size + self._side * math.copysign(self._radius, front.turns)) - (corner - front.o)
        foot = m + straight.u * ((round_.o - m) * straight.u.conjugate()).real
        under = size**2 - abs(foot - round_.o) ** 2
        if under < 0.0:
            raise self._gouge("a corner between an arc and a line", "use a smaller tool")
        # an arc with the tool inside is left through its disc, one with the tool outside away from it
        leaving = self._side * round_.turns > 0
        sense = -1.0 if leaving == bool(front.turns) else 1.0
        return foot + straight.u * math.copysign(math.sqrt(under), sense)

    def _circles(self, front: _Offset, new: _Offset) -> complex:
        """Where two offset arcs cross so that the path turns towards the tool."""
        apart = new.o - front.o
        d = abs(apart)
        r0, r1 = abs(front.e - front.o), abs(new.m - new.o)
        if d == 0.0:
            raise self._gouge("a corner between two arcs with one centre", "join them")
        u = apart / d
        x = (d**2 + r0**2 - r1**2) / (2.0 * d)
        under = r0**2 - x**2
        if under < 0.0:
            raise self._gouge("a corner between two arcs", "use a smaller tool")
        sense = math.copysign(1.0, self._side * front.turns * new.turns)
        return front.o + u * complex(x, math.copysign(math.sqrt(under), sense))

    def _trim(self, at: complex) -> None:
        """Let the front and what follows it end ``at``."""
        self._held = [move._replace(end=self._with(move.end, at)) for move in self._held]
        self._centre = self._with(self._centre, at)
        self._check()

    def _check(self) -> None:
        """Refuse a front that its corners turned back."""
        front, at = self._front, self._flat(self._centre)
        if front is None or front.entry:
            return
        if front.turns:
            if _sweep(front, self._from, at) > _sweep(front, front.m, front.e) + self._slack:
                raise self._gouge("an arc between two corners", "use a smaller tool or a longer arc")
        elif ((at - self._from) * front.u.conjugate()).real < 0.0:
            raise self._gouge("a line between two corners", "use a smaller tool or a longer line")

    def _pass(self, move: CentreMove) -> list[CentreMove]:
        """A motion as it is programmed: with a radius of 0, and before the first motion in the plane."""
        self._programmed = self._centre = move.end
        return [self._out(move)]

    def _append(self, new: _Offset, end: Sequence[float], payload: object) -> list[CentreMove]:
        """Hold ``new``; what was held before is final."""
        done = self._release()
        self._front, self._from = new, self._flat(self._centre)
        self._programmed, self._centre = tuple(end), self._with(end, new.e)
        self._held = [CentreMove(new.motion, self._centre, (new.o.real, new.o.imag), new.turns, payload)]
        return done

    def _flat(self, position: Sequence[float]) -> complex:
        return complex(position[self._first], position[self._second])

    def _with(self, position: Sequence[float], at: complex, along: float | None = None) -> tuple[float, ...]:
        out = list(position)
        out[self._first], out[self._second] = at.real, at.imag
        if along is not None:
            out[self._along] = along
        return tuple(out)

    def _out(self, move: CentreMove) -> CentreMove:
        """Shifted from the tool's centre to the point that is commanded."""
        end = self._with(move.end, self._flat(move.end) + self._shift)
        centre = complex(*move.centre) + (self._shift if move.turns else 0j)
        return move._replace(end=end, centre=(centre.real, centre.imag))

    def _short(self, length: float) -> InputError:
        return InputError(
            f"radius compensation: its first motion is {length:.6g} mm long: must be longer than the tool's radius "
            f"{self._radius:.6g} mm: start farther away or use a smaller tool"
        )

    def _gouge(self, what: str, remedy: str) -> InputError:
        return InputError(
            f"radius compensation: {what} would cause gouging with a tool of radius {self._radius:.6g} mm: {remedy}"
        )


def _sweep(arc: _Offset, start: complex, end: complex) -> float:
    """Angle from ``start`` to ``end`` in the direction of an arc, above 0 to a whole turn [rad]."""
    angle = math.copysign(1.0, arc.turns) * (cmath.phase(end - arc.o) - cmath.phase(start - arc.o))
    angle %= 2.0 * math.pi
    return angle if angle > 1e-9 else 2.0 * math.pi
