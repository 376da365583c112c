"""Where a blend arc of LinuxCNC's trajectory planner lies between a line and an arc or between two arcs.

Notation: the plane of the corner as complex numbers [mm]: the corner is 0, the path arrives along 1, turns to the left
and leaves along t2. c centre of an arc of radius r, R radius of the blend arc, z its centre. An arc bends inwards where
its centre lies on the side of the other segment.

The planner fixes R by straight lines; the arc with that radius then touches the true segments: z lies at the distance R
from a line and at r + R from the centre of an arc, r - R where it bends inwards. The blend arc is refused where there
is no such z, where it leaves the corner by more than the tolerance, takes more of an arc than allowed, all of a line,
or is not tangent to what remains of an arc.

Reference: LinuxCNC 2.9, `blendmath.c`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]
Bools = NDArray[np.bool_]


class CornerSide(NamedTuple):
    """One side of corners: whether it is an arc and bends inwards, its centre and radius, the greatest angle [rad] that
    may be taken of it, and its length [mm].
    """

    arc: Bools
    inner: Bools
    centre: Complexes
    radius: Floats
    most: Floats
    length: Floats


class CornerArcs(NamedTuple):
    """Blend arcs: whether they are possible, what they take of both sides [mm], their lengths [mm]."""

    possible: Bools
    trim1: Floats
    trim2: Floats
    length: Floats


def corner_arcs(
    before: CornerSide, after: CornerSide, leaving: Complexes, radius: Floats, tolerance: Floats, kink: Floats
) -> CornerArcs:
    """Blend arcs of given radii.

    Parameters
    ----------
    leaving : (k,) complex, t2
    radius, tolerance : (k,) float [mm], R and how far the arc may leave the corner
    kink : (k,) float [rad], greatest angle between the blend arc and what remains of an arc

    Examples
    --------
    R = 2 mm at a square corner of two lines takes 2 mm of each. Where the second side is an arc of 2 mm that bends
    outwards, z = -d + 2i with |z - 2| = 4, so d = sqrt(12) - 2, and the arc goes on for half of a right angle less 15
    degrees.

    >>> line = CornerSide(*(np.array([v]) for v in (False, False, 0j, np.inf, 0.0, 9.0)))
    >>> arc = CornerSide(*(np.array([v]) for v in (True, False, 2.0 + 0j, 2.0, 1.5, 6.0)))
    >>> up, two = np.array([1j]), np.array([2.0])
    >>> corner_arcs(line, line, up, two, two, two).trim1.round(6).tolist()
    [2.0]
    >>> found = corner_arcs(line, arc, up, two, two, two)
    >>> found.trim1.round(6).tolist(), found.trim2.round(6).tolist(), found.length.round(6).tolist()
    ([1.464102], [1.047198], [2.094395])
    """
    one = np.ones_like(leaving)
    with np.errstate(divide="ignore", invalid="ignore"):
        z = np.where(
            before.arc & after.arc,
            _of_arcs(before, after, radius),
            np.where(
                before.arc,
                _of_arc_and_line(before, leaving, radius, 1.0),
                np.where(after.arc, _of_arc_and_line(after, one, radius, -1.0), _of_lines(leaving, radius)),
            ),
        )
        start, arriving, trim1, ok1 = _end(before, one, z, -1.0)
        end, going, trim2, ok2 = _end(after, leaving, z, 1.0)
        possible = np.isfinite(z) & ok1 & ok2 & ((np.abs(z) - radius <= tolerance) | ~(before.arc | after.arc))
        for arc, point, tangent in ((before.arc, start, arriving), (after.arc, end, going)):
            possible &= ~arc | (np.abs(np.angle(1j * (point - z) / tangent)) <= kink)
        length = np.abs(start - z) * np.abs(np.angle((end - z) / (start - z)))
    return CornerArcs(possible, *(np.where(possible, column, 0.0) for column in (trim1, trim2, length)))


def _distance(side: CornerSide, radius: Floats) -> Floats:
    """(k,) distance of the blend arc's centre from that of an arc."""
    return np.asarray(side.radius + np.where(side.inner, -radius, radius))


def _of_lines(leaving: Complexes, radius: Floats) -> Complexes:
    """(k,) centres between two lines."""
    return np.asarray(radius * (1j - np.tan(0.5 * np.angle(leaving))))


def _of_arc_and_line(side: CornerSide, along: Complexes, radius: Floats, sign: float) -> Complexes:
    """(k,) centres between an arc and a line along ``along``, after (sign 1) or before (-1) the corner."""
    c = side.centre / along
    square = _distance(side, radius) ** 2 - (radius - c.imag) ** 2
    root = np.sqrt(np.where(square >= 0.0, square, np.nan))
    d = np.minimum(np.abs(-c.real + root), np.abs(-c.real - root))
    return np.asarray(along * (sign * d + 1j * radius))


def _of_arcs(before: CornerSide, after: CornerSide, radius: Floats) -> Complexes:
    """(k,) centres between two arcs: of two places the one nearer to the corner."""
    c = after.centre - before.centre
    apart = np.abs(c)
    d1, d2 = _distance(before, radius), _distance(after, radius)
    x = (d1**2 - d2**2 + apart**2) / (2.0 * apart)
    square = d1**2 - x**2
    y = np.sqrt(np.where(square >= 0.0, square, np.nan))
    left, right = (before.centre + c / apart * (x + sign * 1j * y) for sign in (1.0, -1.0))
    return np.asarray(np.where(np.abs(left) < np.abs(right), left, right))


def _end(side: CornerSide, tangent: Complexes, z: Complexes, sign: float) -> tuple[Complexes, Complexes, Floats, Bools]:
    """Where the blend arc meets a side, the side's tangent there, what it takes of it [mm], whether it may."""
    d = sign * (z / tangent).real
    c = side.centre
    angle = np.abs(np.angle((z - c) / np.where(c == 0.0, 1.0, -c)))
    bend = np.where((c / tangent).imag > 0.0, 1.0, -1.0)
    turn = np.exp(1j * sign * bend * angle)
    point = np.where(side.arc, c - c * turn, sign * d * tangent)
    trim = np.where(side.arc, side.radius * angle, d)
    allowed = np.where(side.arc, angle <= side.most, d < side.length)
    return point, np.where(side.arc, tangent * turn, tangent), trim, allowed
