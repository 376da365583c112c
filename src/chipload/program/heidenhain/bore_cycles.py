"""Cycles that mill round a hole: bore milling (208) and thread milling inside (262).

Notation: the tool stands in the middle of the hole; r is the nominal radius Q335 / 2 less that of the tool, P the pitch
Q239, below 0 for a left-hand thread. A step is ``(kind, x, y, z, feed, centre, turns)``, x and y from the middle, z in
the coordinates of the program [mm].

* The tool comes to the wall and leaves it on half circles between the middle and r. In a thread it rises along them by
  a quarter of the pitch, so that the tooth stays on the thread; the manual allows up to half of it.
* 208: from the set-up clearance on a helix of Q334 a turn to the depth, a whole turn there, back to the middle.
* 262: climb milling (Q351 = 1) turns counter-clockwise, so that a right-hand thread is cut upwards. Q355 = 0: one turn
  at the depth; 1: one helix over the whole depth; n > 1: turns that are n pitches apart, each with its way in and out.

Reference: Heidenhain, iTNC 530 User's Manual Cycle Programming, "Bore milling" and "Thread milling".
"""

from __future__ import annotations

import math
from collections.abc import Iterator

from chipload.errors import InputError
from chipload.program.commands import ARC, LINE, RAPID
from chipload.program.heidenhain.q_cycles import MAX, HoleValues, Value

#: cycles that are carried out
CYCLES = (208, 262)
MOST_TURNS = 10_000

Step = tuple[int, float, float, float, float, tuple[float, float], int]


def bore_steps(number: int, q: Value, tool_radius: float, scale: float) -> Iterator[Step]:
    """The steps of a cycle over the middle of a hole.

    Parameters
    ----------
    number : 208 or 262
    q : value of a Q parameter, as in :func:`~chipload.program.heidenhain.q_cycles.q_cycle_steps`
    tool_radius : [mm]
    scale : mm in a unit of the text

    Raises
    ------
    InputError
        A parameter is missing or out of its range, or the tool does not fit into the hole.
    """
    h = HoleValues(number, q, scale)
    r = 0.5 * abs(h.mm(335, None)) - tool_radius
    if r < -1e-6 or (number == 262 and r <= 1e-6):
        raise InputError(
            f"CYCL DEF {number}: Q335 = {q(335, None):g}: the tool of radius {tool_radius:g} mm does not fit"
        )
    sense = 1 if q(351, 1.0) >= 0.0 else -1
    yield RAPID, 0.0, 0.0, h.top, 0.0, (0.0, 0.0), 0
    yield from _bore(h, max(r, 0.0), sense) if number == 208 else _thread(h, r, sense)
    yield RAPID, 0.0, 0.0, h.away, 0.0, (0.0, 0.0), 0


def _turns(sweep: float, sense: int) -> int:
    """Whole turns that an arc of so many turns is counted as."""
    count = max(1, math.ceil(sweep - 1e-9))
    if count > MOST_TURNS:
        raise InputError(f"a cycle of {count} turns: must be at most {MOST_TURNS}")
    return sense * count


def _bore(h: HoleValues, r: float, sense: int) -> Iterator[Step]:
    feed = h.feed(206)
    if r < 1e-6:
        yield LINE, 0.0, 0.0, h.bottom, feed, (0.0, 0.0), 0
        return
    pitch = abs(h.mm(334, None))
    if pitch == 0.0:
        raise InputError("CYCL DEF 208: Q334 = 0: the depth of a turn must not be 0")
    turns = (h.top - h.bottom) / pitch
    angle = math.tau * (turns % 1.0) * sense
    x, y = r * math.cos(angle), r * math.sin(angle)
    yield ARC, r, 0.0, h.top, feed, (0.5 * r, 0.0), sense
    yield ARC, x, y, h.bottom, feed, (0.0, 0.0), _turns(turns, sense)
    yield ARC, x, y, h.bottom, feed, (0.0, 0.0), sense
    yield ARC, 0.0, 0.0, h.bottom, feed, (0.5 * x, 0.5 * y), sense
    yield RAPID, 0.0, 0.0, h.top, 0.0, (0.0, 0.0), 0


def _thread(h: HoleValues, r: float, sense: int) -> Iterator[Step]:
    pitch, apart = h.mm(239, None), h.q(355, 0.0)
    if pitch == 0.0 or apart < 0.0:
        raise InputError("CYCL DEF 262: the pitch Q239 must not be 0, and Q355 must be 0 or more")
    feed, size = h.feed(207), abs(pitch)
    reach = (LINE, h.feed(253)) if h.q(253, None) < MAX else (RAPID, 0.0)
    up = 1.0 if sense * pitch > 0.0 else -1.0
    turns, starts = 1.0, [h.bottom if up > 0.0 else h.bottom + size]
    if apart == 1.0:
        turns = h.depth / size
        starts = [h.bottom if up > 0.0 else h.surface]
    elif apart > 1.0:
        count = math.ceil(h.depth / (apart * size) - 1e-9)
        if count > MOST_TURNS:
            raise InputError(f"CYCL DEF 262: {count} turns: must be at most {MOST_TURNS}")
        deep = [min((k + 1) * apart * size, h.depth) for k in range(count)]
        starts = [h.bottom + k * apart * size if up > 0.0 else h.surface - deep[k] + size for k in range(count)]
    angle = math.tau * (turns % 1.0) * sense
    x, y = r * math.cos(angle), r * math.sin(angle)
    quarter, rise = 0.25 * size * up, turns * size * up
    for z in starts:
        yield reach[0], 0.0, 0.0, z - quarter, reach[1], (0.0, 0.0), 0
        yield ARC, r, 0.0, z, feed, (0.5 * r, 0.0), sense
        yield ARC, x, y, z + rise, feed, (0.0, 0.0), _turns(turns, sense)
        yield ARC, 0.0, 0.0, z + rise + quarter, feed, (0.5 * x, 0.5 * y), sense
    yield RAPID, 0.0, 0.0, h.top, 0.0, (0.0, 0.0), 0
