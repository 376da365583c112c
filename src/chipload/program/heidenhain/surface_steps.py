"""Cycles 232 and 233 (faces), 254 (circular slot), 256 and 257 (studs).

Notation: as in :mod:`~chipload.program.heidenhain.pocket_steps`, and

* 232: a face from the corner Q225, Q226 over Q218 and Q219 (their signs count), from the height Q227 down to Q386 in
  levels of Q202 at most; Q389 0 goes from pass to pass beside the face, 1 over its border, 2 at the clearance, one way;
  Q357 beside the face, Q253 between the passes and down, the last level at Q385 with the allowance Q369 before it.
* 233: as 232 about where the tool stands: Q367 1 to 4 it stands on a corner, 0 in the middle; Q350 2: passes along y.
  Borders Q347 to Q349 and the strategies Q389 above 2 are not read.
* 254: a slot Q219 wide on the circle Q375 about Q216, Q217, from Q376 over Q248 [deg]; Q377 slots Q378 apart. Q367
  other than 0, another middle of the circle, is not read.
* 256: a stud of Q218 x Q219 with corners Q220 out of a blank of Q424 x Q425; 257: Q223 out of Q222.

Differs from source: the tool goes down at the beginning of the middle line of a slot, straight.

Reference: Heidenhain, TNC 640 User's Manual Cycle Programming, "Face milling", "Circular slot", "Rectangular stud",
"Circular stud". The parameters of 232, 233 and 254 are from memory.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Iterator
from dataclasses import replace

from chipload.errors import InputError
from chipload.program.commands import RAPID
from chipload.program.face_cycles import FaceCycle, face_steps
from chipload.program.heidenhain.formula import NotKnownError
from chipload.program.heidenhain.q_cycles import HoleValues, Value
from chipload.program.pocket_cycles import PocketCycle, Step, levels, stud
from chipload.program.slot_cycles import ArcSlot, arc_slot_steps

FACES, SLOT, STUDS = (232, 233), 254, (256, 257)
#: cycles that are carried out
CYCLES = (*FACES, SLOT, *STUDS)
#: those whose place is stated by coordinates, not by where the tool stands: the parameters of their x and y
PLACED_BY = {232: (225, 226), 254: (216, 217)}
#: most slots of one cycle
MOST_SLOTS = 1000


def surface_steps(number: int, q: Value, tool_radius: float, scale: float) -> Iterator[Step]:
    """The steps of a cycle about its place.

    Parameters
    ----------
    number : one of :data:`CYCLES`
    q : value of a Q parameter, as in :func:`~chipload.program.heidenhain.q_cycles.q_cycle_steps`
    tool_radius : [mm]
    scale : mm in a unit of the text

    Raises
    ------
    InputError
        A parameter is missing or out of its range, or the tool does not fit.
    NotKnownError
        The cycle is called in a way that is not read.
    """
    if number in FACES:
        yield from _face(number, q, tool_radius, scale)
    elif number == SLOT:
        yield from _slots(q, tool_radius, scale)
    else:
        yield from _stud(number, q, tool_radius, scale)


def angle_of(number: int, q: Value) -> float:
    """Angle [deg] by which a cycle is turned about its place."""
    return q(224, 0.0) if number == 256 else 0.0


def _face(number: int, q: Value, tool_radius: float, scale: float) -> Iterator[Step]:
    # Q201 and Q203 are those of holes: a face states its heights
    heights = {201: q(386, None) - q(227, None), 203: q(227, None)}
    h = HoleValues(number, lambda key, default: heights[key] if key in heights else q(key, default), scale)
    if h.bottom != scale * q(386, None):
        raise InputError(f"CYCL DEF {number}: Q386 = {q(386, None):g}: must be below Q227 = {q(227, None):g}")
    kind, strategy = round(q(215, 0.0)), round(q(389, 0.0))
    bordered = number == 233 and any(q(key, 0.0) != 0.0 for key in (347, 348, 349))
    place = round(q(367, 1.0 if number == 232 else 0.0))
    if strategy not in (0, 1, 2) or bordered or kind not in (0, 1, 2) or place not in (-1, 0, 1, 2, 3, 4):
        raise NotKnownError(
            f"CYCL DEF {number}: Q389 above 2, Q347 to Q349 or Q215 above 2: what it cuts here is left out"
        )
    length, width = h.mm(218, None), h.mm(219, None)
    turned = number == 233 and round(q(350, 1.0)) == 2
    face = FaceCycle(
        width if turned else length,
        length if turned else width,
        tool_radius,
        q(370, 1.0) * tool_radius,
        abs(h.mm(357, 2.0)),
        strategy == 2,
        strategy == 1,
        h.feed(207),
        h.feed(253),
    )
    last = replace(face, feed=h.feed(385)) if q(385, 0.0) > 0.0 else face
    floor, most = abs(h.mm(369, 0.0)), abs(h.mm(202, None))
    rough = levels(h.surface, h.bottom + floor, most, even=False) if kind != 2 and floor < h.depth else []
    steps: list[Step] = []
    if rough:
        steps += face_steps(face, h.top, rough)
    if kind == 2 or (kind == 0 and floor > 0.0):
        steps += face_steps(last, h.top, [h.bottom])
    corner = {0: (0.5, 0.5), 1: (0.0, 0.0), 2: (1.0, 0.0), 3: (1.0, 1.0), 4: (0.0, 1.0), -1: (0.0, 0.0)}[place]
    for motion, x, y, z, feed, centre, turns in steps:
        x, y = (y, x) if turned else (x, y)
        yield motion, x - corner[0] * length, y - corner[1] * width, z, feed, centre, turns
    yield RAPID, *_end(steps, turned, corner, length, width), h.away, 0.0, (0.0, 0.0), 0


def _end(
    steps: list[Step], turned: bool, corner: tuple[float, float], length: float, width: float
) -> tuple[float, float]:
    """X and y where the last step of a face ends; its corner without one."""
    if not steps:
        return -corner[0] * length, -corner[1] * width
    x, y = steps[-1][1:3]
    x, y = (y, x) if turned else (x, y)
    return x - corner[0] * length, y - corner[1] * width


def _slots(q: Value, tool_radius: float, scale: float) -> Iterator[Step]:
    h = HoleValues(SLOT, q, scale)
    kind, count = round(q(215, 0.0)), round(q(377, 1.0))
    if kind not in (0, 1, 2) or q(367, 0.0) != 0.0:
        raise NotKnownError(f"CYCL DEF {SLOT}: Q215 above 2 or Q367 other than 0: what it cuts here is left out")
    if not 1 <= count <= MOST_SLOTS:
        raise InputError(f"CYCL DEF {SLOT}: Q377 = {count}: must be from 1 to {MOST_SLOTS}")
    side, floor, most = abs(h.mm(368, 0.0)), abs(h.mm(369, 0.0)), abs(h.mm(202, None))
    for k in range(count):
        slot = ArcSlot(
            0.5 * abs(h.mm(375, None)),
            math.radians(q(376, None) + k * q(378, 0.0)),
            math.radians(q(248, None)),
            abs(h.mm(219, None)),
            tool_radius,
            tool_radius,
            1 if q(351, 1.0) >= 0.0 else -1,
            h.feed(207),
            h.feed(206),
        )
        start = cmath.rect(slot.radius, slot.first)
        yield RAPID, start.real, start.imag, h.away, 0.0, (0.0, 0.0), 0
        if kind != 2:
            yield from arc_slot_steps(slot, side, h.top, levels(h.surface, h.bottom + floor, most, even=False))
        if kind == 2 or (kind == 0 and side + floor > 0.0):
            infeed = abs(h.mm(338, 0.0)) or h.depth
            last = replace(slot, feed=h.feed(385))
            if floor > 0.0 and kind == 0:
                yield from arc_slot_steps(last, side, h.top, [h.bottom])
            passes = levels(h.surface, h.bottom, infeed, even=False)
            yield from arc_slot_steps(last, 0.0, h.top, passes, wall_only=True)
        yield RAPID, start.real, start.imag, h.away, 0.0, (0.0, 0.0), 0


def _stud(number: int, q: Value, tool_radius: float, scale: float) -> Iterator[Step]:
    h = HoleValues(number, q, scale)
    if round(q(215, 0.0)) not in (0, 1) or q(367, 0.0) != 0.0:
        raise NotKnownError(f"CYCL DEF {number}: Q215 above 1 or Q367 other than 0: what it cuts here is left out")
    if number == 257:
        a = b = corner = 0.5 * abs(h.mm(223, None))
        blank = (0.5 * abs(h.mm(222, None)),) * 3
    else:
        a, b, corner = 0.5 * abs(h.mm(218, None)), 0.5 * abs(h.mm(219, None)), abs(h.mm(220, 0.0))
        blank = (0.5 * abs(h.mm(424, None)), 0.5 * abs(h.mm(425, None)), 0.0)
    climb = q(351, 1.0) >= 0.0
    wall = PocketCycle(
        a, b, corner, tool_radius, q(370, 1.0) * tool_radius, -1 if climb else 1, h.feed(207), h.feed(206)
    )
    side, floor, most = abs(h.mm(368, 0.0)), abs(h.mm(369, 0.0)), abs(h.mm(202, None))
    passes = levels(h.surface, h.bottom + floor, most, even=False)
    steps = list(stud(wall, blank, side, h.top, passes))
    if round(q(215, 0.0)) == 0 and q(385, 0.0) > 0.0 and side + floor > 0.0:
        fine = replace(wall, feed=h.feed(385))
        steps += stud(fine, (a + side, b + side, corner + side), 0.0, h.top, [h.bottom])
    yield from steps
    yield RAPID, steps[-1][1], steps[-1][2], h.away, 0.0, (0.0, 0.0), 0
