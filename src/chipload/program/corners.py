"""Roundings and chamfers between two elements of a contour in the plane, for all controllers.

Notation: points of the plane are complex numbers [mm]; an element runs from its start to its end, straight or about a
centre, counter-clockwise where ``sense`` is 1. At the corner P the contour turns to the side o, 1 to the left. The
centre of a rounding of radius r lies on both elements shifted by r to that side: a line by r along its normal, an arc
of radius R to the radius R - o sense r. A chamfer of length l begins l before P and ends l after P; one that is
stated by the length s of its own edge has l = s / |a + b|, with a and b the unit vectors of the lines.

Reference: Heidenhain, iTNC 530 User's Manual HEIDENHAIN Conversational, "Inserting a chamfer between two straight
lines", "Corner rounding RND"; Siemens, SINUMERIK 840D sl Fundamentals, "Chamfer, rounding (CHF, CHR, RND, RNDM)";
Haas, Mill Operator's Manual, "Corner rounding and chamfering".
"""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass, replace

from chipload.program.commands import ARC, LINE

#: two points are one within this [mm]
SAME = 1e-9


@dataclass(frozen=True)
class Element:
    """A straight or round piece of a contour; ``sense`` 0: straight."""

    start: complex
    end: complex
    centre: complex = 0j
    sense: int = 0

    @property
    def radius(self) -> float:
        """Radius of an arc."""
        return abs(self.start - self.centre)

    def along(self, point: complex) -> complex:
        """Unit vector of the motion at a point of the element."""
        tangent = self.end - self.start if self.sense == 0 else 1j * self.sense * (point - self.centre)
        return tangent / abs(tangent)

    def share(self, point: complex) -> float:
        """Position of a point along the element, 0 at the start, 1 at the end."""
        if self.sense == 0:
            vector = self.end - self.start
            return ((point - self.start) / vector).real
        whole = self._angle(self.end) or math.tau
        angle = self._angle(point)
        return (angle if angle < 0.5 * (whole + math.tau) else angle - math.tau) / whole

    def _angle(self, point: complex) -> float:
        turned = (point - self.centre) / (self.start - self.centre)
        return (self.sense * cmath.phase(turned)) % math.tau


@dataclass(frozen=True)
class CornerArc:
    """Arc that a rounding inserts between two elements."""

    start: complex
    end: complex
    centre: complex
    sense: int


def rounding_arc(before: Element, after: Element, radius: float) -> CornerArc | None:
    """The arc of a radius that touches both elements; None: no such arc ends on them.

    >>> rounding_arc(Element(0j, 10 + 0j), Element(10 + 0j, 10 + 10j), 2.0)
    CornerArc(start=(8+0j), end=(10+2j), centre=(8+2j), sense=1)
    """
    if min(abs(e.end - e.start) for e in (before, after)) <= SAME and not (before.sense and after.sense):
        return None
    first, second = before.along(before.end), after.along(after.start)
    across = (second / first).imag
    if abs(across) < 1e-9:
        return None
    side = 1 if across > 0.0 else -1
    centres = _intersections(_shift_element(before, side * radius), _shift_element(after, side * radius))
    best: CornerArc | None = None
    for centre in sorted(centres, key=lambda c: abs(c - before.end)):
        a, b = _foot(before, centre), _foot(after, centre)
        inside = 0.0 < before.share(a) <= 1.0 + SAME and -SAME <= after.share(b) < 1.0
        touches = all(abs(abs(p - centre) - radius) < 1e-6 for p in (a, b))
        if inside and touches:
            best = CornerArc(a, b, centre, side)
            break
    return best


def chamfer(before: Element, after: Element, length: float) -> tuple[complex, complex] | None:
    """Start and end of a chamfer between two lines; None: a line is too short, or an element is not straight.

    >>> chamfer(Element(0j, 10 + 0j), Element(10 + 0j, 10 + 10j), 3.0)
    ((7+0j), (10+3j))
    """
    short = min(abs(before.end - before.start), abs(after.end - after.start)) <= length
    if before.sense or after.sense or short:
        return None
    return before.end - length * before.along(before.end), after.start + length * after.along(after.start)


@dataclass(frozen=True)
class Piece:
    """A motion of the contour: positions (9) [mm, rad], centre and turns of an arc, feed [mm/s], what rows carry."""

    motion: int
    start: list[float]
    end: list[float]
    centre: tuple[float, float]
    turns: int
    feed: float
    tail: tuple[object, ...]

    @property
    def element(self) -> Element:
        """The element of the motion in the plane."""
        start, end = complex(*self.start[:2]), complex(*self.end[:2])
        return Element(start, end, complex(*self.centre), self.turns if self.motion == ARC else 0)


@dataclass(frozen=True)
class Corner:
    """A rounding (``round``) or chamfer: radius or length [mm]; its feed [mm/s], None: that of what follows; its text;
    whether the length is that of the edge of the chamfer itself.
    """

    round: bool
    size: float
    feed: float | None
    text: str
    edge: bool = False


def turns(before: Piece, after: Piece) -> bool:
    """Whether the contour has a corner between two pieces: both move in the plane, and they are not tangent."""
    first, second = before.element, after.element
    if any(e.sense == 0 and abs(e.end - e.start) <= SAME for e in (first, second)):
        return False
    turned = second.along(second.start) / first.along(first.end)
    return abs(cmath.phase(turned)) > 1e-6


def join_corner(before: Piece, after: Piece, corner: Corner) -> tuple[Piece, Piece, Piece] | None:
    """Two trimmed pieces with the rounding or chamfer between them; None: it does not fit."""
    level = all(a[2:] == b[2:] for a, b in ((before.start, before.end), (after.start, after.end)))
    flat = any(e.sense == 0 and abs(e.end - e.start) <= SAME for e in (before.element, after.element))
    if not level or flat or max(abs(before.turns), abs(after.turns)) > 1 or after.motion not in (LINE, ARC):
        return None
    feed = after.feed if corner.feed is None else corner.feed
    if corner.round:
        arc = rounding_arc(before.element, after.element, corner.size)
        if arc is None:
            return None
        ends, centre, turns, motion = (arc.start, arc.end), (arc.centre.real, arc.centre.imag), arc.sense, ARC
    else:
        size = corner.size
        if corner.edge:
            total = abs(before.element.along(before.element.end) + after.element.along(after.element.start))
            if total < 1e-9:
                return None
            size /= total
        found = chamfer(before.element, after.element, size)
        if found is None:
            return None
        ends, centre, turns, motion = found, (0.0, 0.0), 0, LINE
    a, b = ([p.real, p.imag, *before.end[2:]] for p in ends)
    middle = Piece(motion, a, b, centre, turns, feed, before.tail)
    return replace(before, end=a), middle, replace(after, start=b)


#: a shifted element: of a line a point and its direction, of an arc its centre and radius
Shifted = tuple[complex, complex | None, float]


def _shift_element(element: Element, by: float) -> Shifted:
    if element.sense == 0:
        tangent = element.along(element.start)
        return element.start + 1j * tangent * by, tangent, 0.0
    return element.centre, None, element.radius - element.sense * by


def _foot(element: Element, centre: complex) -> complex:
    """The point of an element nearest to the centre of a rounding."""
    if element.sense == 0:
        tangent = element.along(element.start)
        return element.start + tangent * ((centre - element.start) / tangent).real
    out = centre - element.centre
    return element.centre + (out / abs(out) * element.radius if abs(out) > SAME else element.start - element.centre)


def _intersections(one: Shifted, two: Shifted) -> list[complex]:
    """Where two shifted elements meet."""
    if one[1] is None and two[1] is not None:
        one, two = two, one
    (p, direction, r0), (q, other, r1) = one, two
    if direction is not None and other is not None:
        return [_line_intersection(p, direction, q, other)]
    if min(r0 if direction is None else 1.0, r1) <= 0.0:
        return []
    if direction is not None:
        at = (q - p) / direction
        under = r1**2 - at.imag**2
        return [] if under < 0.0 else [p + direction * (at.real + s * math.sqrt(under)) for s in (-1.0, 1.0)]
    distance = abs(q - p)
    if distance <= SAME:
        return []
    x = (distance**2 + r0**2 - r1**2) / (2.0 * distance)
    under = r0**2 - x**2
    return [] if under < 0.0 else [p + (q - p) / distance * complex(x, s * math.sqrt(under)) for s in (-1.0, 1.0)]


def _line_intersection(p: complex, direction: complex, q: complex, other: complex) -> complex:
    """Intersection of two lines that are not parallel."""
    return p + direction * ((q - p) / other).imag / (direction / other).imag
