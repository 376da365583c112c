"""Cycles 251, 252 and 253: rectangular pocket, circular pocket and slot.

Notation: Q218 length, Q219 width, Q220 corner radius, Q223 diameter; Q224 the angle of the length; Q367 where the tool
stands: 0 in the middle (others are not read); Q201 depth, Q202 a pass; Q368 and Q369 allowances of wall and floor; Q207
feed along, Q206 down, Q385 in finishing; Q351 1 climb, -1 conventional; Q370 the step in radii of the tool; Q366 1
enters on a helix, 0 straight down, 2 to and fro, which is taken as straight down; Q215 0 roughing and
finishing, 1 roughing, 2 finishing, 3 and 4 finishing of the floor and of the wall alone, which are not read.

Differs from source: a helix has a radius of half of that of the tool and falls by a pass in a turn at most.

Reference: Heidenhain, TNC 640 User's Manual Cycle Programming, "PocketCycle milling/stud milling/slot milling".
"""

from __future__ import annotations

from collections.abc import Iterator

from chipload.errors import InputError
from chipload.program.commands import RAPID
from chipload.program.heidenhain.formula import NotKnownError
from chipload.program.heidenhain.q_cycles import HoleValues, Value
from chipload.program.pocket_cycles import PocketCycle, Step, finish, levels, rough

#: cycles that are carried out
CYCLES = (251, 252, 253)
#: radius of the helix of the entry, in radii of the tool
HELIX_SHARE = 0.5


def pocket_steps(number: int, q: Value, tool_radius: float, scale: float) -> Iterator[Step]:
    """The steps of a cycle over the middle of a pocket, its length along x.

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
    h = HoleValues(number, q, scale)
    kind = round(q(215, 0.0))
    if kind not in (0, 1, 2) or (number != 252 and q(367, 0.0) != 0.0):
        raise NotKnownError(f"CYCL DEF {number}: Q215 above 2 or Q367 other than 0: what it cuts here is left out")
    if number == 252:
        a = b = corner = 0.5 * abs(h.mm(223, None))
    else:
        a, b = 0.5 * abs(h.mm(218, None)), 0.5 * abs(h.mm(219, None))
        corner = min(a, b) if number == 253 else abs(h.mm(220, 0.0))
    most = abs(h.mm(202, None))
    helix = q(366, 1.0) == 1.0
    pocket = PocketCycle(
        a,
        b,
        corner,
        tool_radius,
        q(370, 1.0) * tool_radius,
        1 if q(351, 1.0) >= 0.0 else -1,
        h.feed(207),
        h.feed(206),
        HELIX_SHARE * tool_radius if helix else 0.0,
        most if helix else 0.0,
    )
    side, floor = abs(h.mm(368, 0.0)), abs(h.mm(369, 0.0))
    yield RAPID, 0.0, 0.0, h.top, 0.0, (0.0, 0.0), 0
    if kind != 2:
        if floor >= h.depth:
            raise InputError(f"CYCL DEF {number}: Q369 = {floor:g} mm: must be below the depth {h.depth:g} mm")
        yield from rough(pocket, side, h.top, levels(h.surface, h.bottom + floor, most, even=False))
    if kind == 2 or (kind == 0 and side + floor > 0.0):
        infeed = abs(h.mm(338, 0.0)) or h.depth
        last = PocketCycle(a, b, corner, tool_radius, pocket.step, pocket.sense, h.feed(385), pocket.plunge_feed)
        if floor > 0.0 and kind == 0:
            yield from rough(last, side, h.top, [h.bottom])
        yield from finish(last, h.top, levels(h.surface, h.bottom, infeed, even=False))
    yield RAPID, 0.0, 0.0, h.away, 0.0, (0.0, 0.0), 0
