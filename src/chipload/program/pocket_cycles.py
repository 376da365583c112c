"""Cycles that mill a pocket, rectangular or circular, from its middle to its wall, or a stud, from its blank inwards.

Notation: x and y from the middle of the pocket, along its length and its width; z in the coordinates of the program
[mm]. A wall is a rectangle of half sizes a and b whose corners have the radius c; a circle is one of a = b = c. The
centre of the tool stays ``inset`` within the wall: its radius and the allowance. Steps are those of bore milling:
``(kind, x, y, z, feed, centre, turns)``.

Each pass enters in the middle, straight down or on a helix, and goes round on rings from the inside out, a step apart.
The wall, the floor and the levels are those that the cycle states; the way from ring to ring is the control's own, so
that what it takes from the wall is exact and what the tool bears on its way is not: a reader says so. A stud is gone
round from outside; the tool goes down 2 mm beside the blank.

References: Siemens, SINUMERIK 840D sl Programming Manual Cycles, "Milling cycles"; Heidenhain, TNC 640 Cycle
Programming, "Rectangular pocket", "Circular pocket", "Rectangular stud", "Circular stud".
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

from chipload.errors import InputError
from chipload.program.commands import ARC, LINE, RAPID

Step = tuple[int, float, float, float, float, tuple[float, float], int]

#: rings of a pass, passes of a pocket, turns of a helix
MOST_RINGS, MOST_PASSES, MOST_TURNS = 10_000, 10_000, 10_000
#: rings with corners leave no ridge between them up to this step, in radii of the tool; below the square root of 2
WIDEST_STEP = 1.4
#: a motion that is shorter is left out [mm]
SAME_MM = 1e-9
#: the tool goes down so far beside the blank of a stud [mm]
BESIDE_BLANK = 2.0


@dataclass(frozen=True)
class PocketCycle:
    """A pocket and how it is cut [mm, mm/s].

    Parameters
    ----------
    a, b, corner : half length, half width, radius of the corners of the wall
    tool_radius : of the cutter
    step : from ring to ring
    sense : 1 counter-clockwise, which is climb milling, -1 clockwise
    feed, plunge_feed : along the rings, and down
    helix_radius, helix_pitch : of the way down; 0: straight down
    """

    a: float
    b: float
    corner: float
    tool_radius: float
    step: float
    sense: int
    feed: float
    plunge_feed: float
    helix_radius: float = 0.0
    helix_pitch: float = 0.0


def levels(top: float, bottom: float, most: float, even: bool) -> list[float]:
    """Heights of the passes from the surface down; ``even``: all as deep as one another, else the last is the rest.

    >>> levels(0.0, -5.0, 2.0, False), levels(0.0, -5.0, 2.5, True)
    ([-2.0, -4.0, -5.0], [-2.5, -5.0])
    """
    if not most > 0.0:
        raise InputError(f"depth of a pass {most:g}: must be above 0")
    depth = top - bottom
    count = math.ceil(depth / most - 1e-9)
    if not 1 <= count <= MOST_PASSES:
        raise InputError(f"{count} passes of a pocket: must be from 1 to {MOST_PASSES}")
    step = depth / count if even else most
    return [*(top - (k + 1) * step for k in range(count - 1)), bottom]


def count_rings(room: float, step: float, tool_radius: float) -> int:
    """Return the number of rings over ``room`` [mm] that are at most ``step`` apart and leave no ridge between them.

    Raises
    ------
    InputError
        There are too many.
    """
    width = min(step, WIDEST_STEP * tool_radius)
    count = math.ceil(room / width - 1e-9) if width > 0.0 else MOST_RINGS + 1
    if count > MOST_RINGS:
        raise InputError(f"a cycle with a step of {step:g} mm: must need at most {MOST_RINGS} rings")
    return count


def rough(pocket: PocketCycle, allowance: float, clear: float, passes: list[float]) -> Iterator[Step]:
    """Clear a pocket up to an allowance, pass by pass, from ``clear`` above the surface, and back there.

    Raises
    ------
    InputError
        The tool does not fit, or there are too many rings.
    """
    inset = pocket.tool_radius + allowance
    inner = min(pocket.a, pocket.b) - inset
    if inner < -1e-6:
        raise InputError(
            f"a pocket {2 * pocket.a:g} x {2 * pocket.b:g} mm: a tool of radius {pocket.tool_radius:g} mm with an "
            f"allowance of {allowance:g} mm does not fit"
        )
    count = count_rings(max(inner, 0.0), pocket.step, pocket.tool_radius)
    start_z = clear
    for z in passes:
        yield from _enter(pocket, max(inner, 0.0), start_z, z)
        reach = abs(pocket.a - pocket.b)
        if reach > SAME_MM:
            along = pocket.a > pocket.b
            for end in (reach, -reach, 0.0):
                yield _line(end if along else 0.0, 0.0 if along else end, z, pocket.feed)
        for k in range(1, count + 1):
            yield from _ring(pocket, inset + max(inner, 0.0) * (1.0 - k / count), z, k == 1)
        if count:
            yield _line(0.0, 0.0, z, pocket.feed)
        start_z = z
    yield RAPID, 0.0, 0.0, clear, 0.0, (0.0, 0.0), 0


def finish(pocket: PocketCycle, clear: float, passes: list[float]) -> Iterator[Step]:
    """Go round along the wall itself, pass by pass, and back to ``clear``."""
    if min(pocket.a, pocket.b) - pocket.tool_radius < 1e-6:
        raise InputError(f"a tool of radius {pocket.tool_radius:g} mm does not fit along the wall of the pocket")
    for z in passes:
        yield _line(0.0, 0.0, z, pocket.plunge_feed)
        yield from _ring(pocket, pocket.tool_radius, z, True)
        yield _line(0.0, 0.0, z, pocket.feed)
    yield RAPID, 0.0, 0.0, clear, 0.0, (0.0, 0.0), 0


def stud(
    pocket: PocketCycle, blank: tuple[float, float, float], allowance: float, clear: float, passes: list[float]
) -> Iterator[Step]:
    """Go round a stud from its blank inwards, pass by pass, from ``clear`` above the surface, and back there.

    The rings keep their distance from the wall, so that the outer ones also take the corners of the blank.

    Parameters
    ----------
    pocket : its wall as that of a stud; ``sense`` -1 is climb milling here
    blank : half length, half width and corner radius of what stands before

    Raises
    ------
    InputError
        The blank is smaller than the stud, or there are too many rings.
    """
    a, b, corner = blank
    if a < pocket.a - SAME_MM or b < pocket.b - SAME_MM:
        raise InputError(
            f"a blank of {2 * a:g} x {2 * b:g} mm: must be at least the stud of {2 * pocket.a:g} x {2 * pocket.b:g} mm"
        )
    reach = _farthest(pocket, (a, b, min(corner, a, b))) - allowance
    count = max(1, count_rings(reach, pocket.step, pocket.tool_radius))
    start = a + BESIDE_BLANK + pocket.tool_radius
    yield RAPID, start, 0.0, clear, 0.0, (0.0, 0.0), 0
    for z in passes:
        yield _line(start, 0.0, z, pocket.plunge_feed)
        for k in range(1, count + 1):
            yield from _ring(pocket, -(pocket.tool_radius + allowance + max(reach, 0.0) * (1.0 - k / count)), z, k == 1)
        yield _line(start, 0.0, z, pocket.feed)
    yield RAPID, start, 0.0, clear, 0.0, (0.0, 0.0), 0


def _farthest(pocket: PocketCycle, blank: tuple[float, float, float]) -> float:
    """Greatest distance of the border of a blank from the wall of its stud."""
    a, b, corner = blank
    c = min(pocket.corner, pocket.a, pocket.b)
    # a corner of the blank is round about its own centre: the farthest point lies on the line of both centres
    x, y = (a - corner) - (pocket.a - c), (b - corner) - (pocket.b - c)
    return max(a - pocket.a, b - pocket.b, math.hypot(max(x, 0.0), max(y, 0.0)) + corner - c)


def _line(x: float, y: float, z: float, feed: float) -> Step:
    return LINE, x, y, z, feed, (0.0, 0.0), 0


def _enter(pocket: PocketCycle, room: float, start_z: float, z: float) -> Iterator[Step]:
    """Down in the middle, on a helix as wide as there is room for."""
    r = min(pocket.helix_radius, room)
    if r < 1e-6 or pocket.helix_pitch <= 0.0:
        yield _line(0.0, 0.0, z, pocket.plunge_feed)
        return
    turns = math.ceil((start_z - z) / pocket.helix_pitch - 1e-9)
    if turns > MOST_TURNS:
        raise InputError(f"a helix of {turns} turns: must be at most {MOST_TURNS}")
    yield _line(r, 0.0, start_z, pocket.plunge_feed)
    yield ARC, r, 0.0, z, pocket.plunge_feed, (0.0, 0.0), pocket.sense * max(turns, 1)
    yield ARC, r, 0.0, z, pocket.plunge_feed, (0.0, 0.0), pocket.sense
    yield _line(0.0, 0.0, z, pocket.plunge_feed)


def _ring(pocket: PocketCycle, inset: float, z: float, from_middle: bool) -> Iterator[Step]:
    """Once round at a distance from the wall, from the middle of a side along the length."""
    a, b, s, feed = pocket.a - inset, pocket.b - inset, pocket.sense, pocket.feed
    c = min(max(pocket.corner - inset, 0.0), a, b)
    if from_middle or a > SAME_MM:
        yield _line(a, 0.0, z, feed)
    if c > SAME_MM and max(a, b) - c < SAME_MM:
        yield ARC, a, 0.0, z, feed, (0.0, 0.0), s
        return
    # corners in the order of a turn to the left; sense -1 mirrors y
    at = (a, 0.0)
    for mx, my, first in ((1, 1, False), (-1, 1, True), (-1, -1, False), (1, -1, True)):
        begin = (mx * (a - c), my * b) if first else (mx * a, my * (b - c))
        end = (mx * a, my * (b - c)) if first else (mx * (a - c), my * b)
        if math.dist(at, begin) > SAME_MM:
            yield _line(begin[0], s * begin[1], z, feed)
        if c > SAME_MM:
            yield ARC, end[0], s * end[1], z, feed, (mx * (a - c), s * my * (b - c)), s
        at = end
    if math.dist(at, (a, 0.0)) > SAME_MM:
        yield _line(a, 0.0, z, feed)
