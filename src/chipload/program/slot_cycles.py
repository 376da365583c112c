"""Cycles that mill a slot along an arc, from its middle line to its wall, pass below pass.

Notation: x and y from the centre of the arc, z in the coordinates of the program [mm]. The middle line has the radius
R from the angle ``first`` over ``sweep`` [rad]; the slot is ``width`` wide and ends in half circles about the ends of
that line. Steps are those of a pocket (:mod:`chipload.program.pocket_cycles`).

Each pass enters at the beginning of the middle line, goes along it and back on loops about it, a step apart. The wall,
the floor and the levels are those that the cycle states; the way between them is the control's own.

References: Heidenhain, TNC 640 Cycle Programming, "Circular slot"; Siemens, SINUMERIK 840D sl Programming Manual
Cycles, "Circumferential slot SLOT2".
"""

from __future__ import annotations

import cmath
from collections.abc import Iterator
from dataclasses import dataclass

from chipload.errors import InputError
from chipload.program.commands import ARC, LINE, RAPID
from chipload.program.pocket_cycles import Step, count_rings

#: a slot as wide as the tool is cut along its middle line alone [mm]
SAME_MM = 1e-6


@dataclass(frozen=True)
class ArcSlot:
    """A slot and how it is cut [mm, rad, and a feed that the reader takes as it is].

    Parameters
    ----------
    radius, first, sweep : of the middle line
    width : of the slot
    tool_radius : of the cutter
    step : from loop to loop
    sense : 1 counter-clockwise along the wall, which is climb milling, -1 clockwise
    feed, plunge_feed : along the slot, and down
    """

    radius: float
    first: float
    sweep: float
    width: float
    tool_radius: float
    step: float
    sense: int
    feed: float
    plunge_feed: float


def arc_slot_steps(
    slot: ArcSlot, allowance: float, clear: float, passes: list[float], wall_only: bool = False
) -> Iterator[Step]:
    """Cut a slot up to an allowance of its wall, from ``clear`` above the surface, and back there.

    Raises
    ------
    InputError
        The tool does not fit, the wall crosses the centre, or there are too many loops.
    """
    room = 0.5 * slot.width - slot.tool_radius - allowance
    if room < -SAME_MM or slot.radius - max(room, 0.0) <= 0.0:
        raise InputError(
            f"a slot {slot.width:g} mm wide on a radius of {slot.radius:g} mm: a tool of radius "
            f"{slot.tool_radius:g} mm with an allowance of {allowance:g} mm does not fit"
        )
    count = count_rings(max(room, 0.0), slot.step, slot.tool_radius)
    begin, end = (cmath.rect(slot.radius, slot.first + a) for a in (0.0, slot.sweep))
    along, turns = slot.sweep >= 0.0, 1 if slot.sweep >= 0.0 else -1
    yield RAPID, begin.real, begin.imag, clear, 0.0, (0.0, 0.0), 0
    for z in passes:
        yield LINE, begin.real, begin.imag, z, slot.plunge_feed, (0.0, 0.0), 0
        if not wall_only or not count:
            yield ARC, end.real, end.imag, z, slot.feed, (0.0, 0.0), turns
            yield ARC, begin.real, begin.imag, z, slot.feed, (0.0, 0.0), -turns
        for k in [count] if wall_only and count else range(1, count + 1):
            yield from _loop(slot, begin, end, room * k / count, z, along)
        if count:
            yield LINE, begin.real, begin.imag, z, slot.feed, (0.0, 0.0), 0
    yield RAPID, begin.real, begin.imag, clear, 0.0, (0.0, 0.0), 0


def _loop(slot: ArcSlot, begin: complex, end: complex, out: float, z: float, along: bool) -> Iterator[Step]:
    """Once round the middle line at a distance, from beside its beginning."""
    u, v = begin / slot.radius, end / slot.radius
    # counter-clockwise: outside along the slot, round its end, inside back, round its beginning
    outer = [(v * (slot.radius + out), 0j, 1), (v * (slot.radius - out), end, 1)]
    inner = [(u * (slot.radius - out), 0j, -1), (u * (slot.radius + out), begin, 1)]
    corners = [*outer, *inner]
    if not along:
        # the slot runs clockwise: the loop that is counter-clockwise begins round its beginning
        corners = [
            (u * (slot.radius - out), begin, 1),
            (v * (slot.radius - out), 0j, -1),
            (v * (slot.radius + out), end, 1),
            (u * (slot.radius + out), 0j, 1),
        ]
    if slot.sense < 0:
        starts = [u * (slot.radius + out), *(p for p, _, _ in corners[:-1])]
        corners = [(p, centre, -turn) for p, (_, centre, turn) in zip(starts[::-1], corners[::-1], strict=True)]
    start = u * (slot.radius + out)
    yield LINE, start.real, start.imag, z, slot.feed, (0.0, 0.0), 0
    for at, centre, turn in corners:
        yield ARC, at.real, at.imag, z, slot.feed, (centre.real, centre.imag), turn
