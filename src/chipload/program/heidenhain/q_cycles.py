"""Drilling cycles of conversational programs that take Q parameters: 200, 201, 206 and 207.

Notation: the surface of the work is at Q203, the set-up clearance Q200 and the second one Q204 are above it, the depth
Q201 below it (its sign does not count). A step is ``(kind, z, value)``: RAPID, LINE with its feed, DWELL with its time,
SPIN to the sense of the spindle, 1 as it was or -1 reversed.

* 200 drilling: Q202 plunge, Q206 feed, Q210 dwell at the top, Q211 at the bottom. Between plunges the tool goes out to
  the clearance and back to the clearance above what is drilled.
* 201 reaming: feed Q206 in, Q208 out (0: Q206), dwell Q211.
* 206 tapping with a floating chuck: feed Q206 in and out; 207 rigid tapping: the pitch Q239 times the spindle speed.

Reference: Heidenhain, iTNC 530 User's Manual Cycle Programming, "Drilling, tapping and thread-milling".
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

from chipload.errors import InputError
from chipload.program.commands import DWELL, LINE, RAPID
from chipload.units import mm_s_from_mm_min

SPIN = -1
#: cycles that are carried out
CYCLES = (200, 201, 206, 207)
#: cycles that cut where they are called and are not read: the call is left out, and the program is unproven
LEFT_OUT = frozenset({2, 3, 4, 5, 6, 15, 16, 17, 18, *range(21, 26), *range(200, 300)} - {*CYCLES, 220, 221, 247})
#: plunges of one hole
MOST_PLUNGES = 10_000

Step = tuple[int, float, float]


def q_cycle_steps(number: int, q: Callable[[int, float | None], float], turns_s: float, scale: float) -> Iterator[Step]:
    """The steps of a cycle where the tool stands.

    Parameters
    ----------
    number : of the cycle, one of :data:`CYCLES`
    q : value of a Q parameter by its number, with what counts where it was never set; None: it must be set
    turns_s : turns of the spindle in a second
    scale : mm in a unit of the text

    Raises
    ------
    InputError
        A parameter is missing or out of its range.
    """
    surface, clearance, depth = scale * q(203, None), abs(scale * q(200, None)), abs(scale * q(201, None))
    top, bottom = surface + clearance, surface - depth
    away = surface + max(clearance, scale * q(204, 0.0))
    dwell = q(211, 0.0)
    if depth == 0.0:
        raise InputError(f"CYCL DEF {number}: Q201 = 0: the depth must not be 0")
    yield RAPID, top, 0.0
    if number == 200:
        yield from _plunges(
            surface, clearance, depth, abs(scale * q(202, None)), _feed(number, 206, q, scale), q(210, 0.0)
        )
    else:
        yield LINE, bottom, _tapping(q, turns_s, scale) if number == 207 else _feed(number, 206, q, scale)
    if number in (206, 207):
        yield SPIN, bottom, -1.0
    if dwell > 0.0 and number != 207:
        yield DWELL, bottom, dwell
    if number == 201:
        yield LINE, top, _feed(number, 208 if q(208, 0.0) > 0.0 else 206, q, scale)
    elif number == 206:
        yield LINE, top, _feed(number, 206, q, scale)
    elif number == 207:
        yield LINE, top, _tapping(q, turns_s, scale)
    if number in (206, 207):
        yield SPIN, top, 1.0
    yield RAPID, away, 0.0


def _plunges(
    surface: float, clearance: float, depth: float, plunge: float, feed: float, dwell: float
) -> Iterator[Step]:
    if plunge == 0.0 or depth / plunge > MOST_PLUNGES:
        raise InputError(f"CYCL DEF 200: Q202: makes more than {MOST_PLUNGES} plunges: raise it")
    done = 0.0
    while done < depth:
        if done > 0.0:
            yield RAPID, surface + clearance, 0.0
            if dwell > 0.0:
                yield DWELL, surface + clearance, dwell
            yield RAPID, surface - done + clearance, 0.0
        done = min(done + plunge, depth)
        yield LINE, surface - done, feed


def _feed(number: int, key: int, q: Callable[[int, float | None], float], scale: float) -> float:
    value = scale * q(key, None)
    if not value > 0.0:
        raise InputError(f"CYCL DEF {number}: Q{key} = {value:g}: a feed must be above 0")
    return mm_s_from_mm_min(value)


def _tapping(q: Callable[[int, float | None], float], turns_s: float, scale: float) -> float:
    pitch = abs(scale * q(239, None))
    if pitch == 0.0 or turns_s == 0.0:
        raise InputError("CYCL DEF 207: the pitch Q239 and the spindle speed S must not be 0")
    return pitch * turns_s
