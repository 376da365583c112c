"""Drilling and tapping cycles that take Q parameters: 200 to 203, 205 to 207, 209 and 240.

Notation: the surface of the work is at Q203, the set-up clearance Q200 and the second one Q204 are above it, the depth
Q201 below it (its sign does not count). A step is ``(kind, z, value)``: RAPID, LINE with its feed, DWELL with its time,
SPIN to the sense of the spindle, 1 as it was or -1 reversed. A feed of MAX is rapid.

* 200 drilling: Q202 plunge, Q206 feed, Q210 dwell at the top, Q211 at the bottom. Between plunges the tool goes out to
  the clearance and back to the clearance above what is drilled.
* 201 reaming, 202 boring: feed Q206 in, Q208 out (0: Q206), dwell Q211. Boring is carried out without its shift away
  from the wall before it goes out.
* 203 universal drilling: as 200; each plunge is shorter by Q212, not below Q205. Q213 times the tool only goes back by
  Q256 to break the chip, at Q208, before it goes out to the clearance.
* 205 universal pecking: as 203 without Q213. Within a plunge the chip is broken every Q257 by a rapid way back of
  Q256. After going out at rapid the tool stops Q258 above the first plunge, Q259 above the last one, evenly between.
  Q379: the hole begins so deep, entered at the feed Q253. Out at Q208, at rapid where it is not given.
* 206 tapping with a floating chuck: feed Q206 in and out; 207 rigid tapping: the pitch Q239 times the spindle speed;
  209 the same, broken every Q257: back by Q256 pitches, 0: out of the hole.
* 241 deep drilling with one lip: from the clearance above the start Q379 at the feed Q253, then at Q206 in plunges of
  Q202 that become shorter, without a way out between them; out at Q208. Its speeds Q426 and Q427 are left out.
* 240 centring to the depth Q201; by the diameter (Q343 = 1) it needs the tool's point angle, which is not known here.

Reference: Heidenhain, iTNC 530 User's Manual Cycle Programming, "Drilling, tapping and thread-milling".
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

from chipload.errors import InputError
from chipload.program.commands import DWELL, LINE, RAPID
from chipload.program.heidenhain.formula import NotKnownError
from chipload.program.heidenhain.words import feed_unit
from chipload.units import mm_s_from_mm_min

SPIN = -1
#: cycles that are carried out
CYCLES = (200, 201, 202, 203, 205, 206, 207, 209, 240, 241)
#: cycles that cut where they are called and are not read: the call is left out, and the program is unproven
LEFT_OUT = frozenset({2, 3, 4, 5, 6, 12, 15, 16, 17, 18, *range(21, 26), 27, 28, 29, 39, *range(200, 300)})
#: plunges of one hole
MOST_PLUNGES = 10_000
#: a feed from which on it is rapid
MAX = 99_999.0

Step = tuple[int, float, float]
Value = Callable[[int, float | None], float]


def q_cycle_steps(number: int, q: Value, turns_s: float, scale: float) -> Iterator[Step]:
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
    hole = HoleValues(number, q, scale)
    if number == 240 and q(343, 0.0) != 0.0:
        raise NotKnownError(
            "CYCL DEF 240: Q343 = 1: centring by a diameter needs the tool's point angle: give Q343 = 0"
        )
    yield RAPID, hole.top, 0.0
    if number in (207, 209):
        yield from _rigid_tapping(hole, turns_s)
    else:
        if number == 200:
            yield from _drilling_steps(hole, (RAPID, 0.0), steady=True)
        elif number == 203:
            yield from _drilling_steps(hole, hole.retraction(206), steady=False)
        elif number == 205:
            yield from _pecking_steps(hole)
        elif number == 241:
            yield from _single_lip_steps(hole)
        else:
            yield LINE, hole.bottom, hole.feed(206)
        if number == 206:
            yield SPIN, hole.bottom, -1.0
        if q(211, 0.0) > 0.0:
            yield DWELL, hole.bottom, q(211, 0.0)
        if number in (201, 202, 203, 205, 241):
            kind, feed = hole.retraction(None if number == 205 else 206)
            yield kind, hole.top, feed
        elif number == 206:
            yield LINE, hole.top, hole.feed(206)
            yield SPIN, hole.top, 1.0
    yield RAPID, hole.away, 0.0


class HoleValues:
    """Heights [mm] and feeds [mm/s] of a hole from the Q parameters of its cycle."""

    def __init__(self, number: int, q: Value, scale: float) -> None:
        self.number, self.q, self.scale = number, q, scale
        self.surface, self.clearance, self.depth = self.mm(203, None), abs(self.mm(200, None)), abs(self.mm(201, None))
        self.top, self.bottom = self.surface + self.clearance, self.surface - self.depth
        self.away = self.surface + max(self.clearance, self.mm(204, 0.0))
        if self.depth == 0.0:
            raise InputError(f"CYCL DEF {number}: Q201 = 0: the depth must not be 0")

    def mm(self, key: int, default: float | None) -> float:
        """A length [mm]."""
        return self.scale * self.q(key, default)

    def feed(self, key: int) -> float:
        """A feed that must be above 0."""
        value = feed_unit(self.scale) * self.q(key, None)
        if not value > 0.0:
            raise InputError(f"CYCL DEF {self.number}: Q{key} = {value:g}: a feed must be above 0")
        return mm_s_from_mm_min(value)

    def retraction(self, otherwise: int | None) -> tuple[int, float]:
        """Motion and feed by Q208; where that is 0 by another parameter, or at rapid."""
        value = self.q(208, 0.0)
        if value >= MAX or (value <= 0.0 and otherwise is None):
            return RAPID, 0.0
        return LINE, self.feed(208 if value > 0.0 else otherwise or 206)

    def plunges(self, start: float, steady: bool) -> list[float]:
        """Depths below the surface at which the plunges end."""
        step, less, least = abs(self.mm(202, None)), 0.0, 0.0
        if not steady:
            less, least = abs(self.mm(212, 0.0)), abs(self.mm(205, 0.0))
        out: list[float] = []
        done = start
        while done < self.depth:
            if step <= 0.0 or len(out) >= MOST_PLUNGES:
                raise InputError(
                    f"CYCL DEF {self.number}: Q202: makes more than {MOST_PLUNGES} plunges: raise it"
                    f"{'' if steady else ', or Q205'}"
                )
            done = min(done + step, self.depth)
            out.append(done)
            step = max(step - less, least) if less > 0.0 else step
        return out


def _drilling_steps(h: HoleValues, out: tuple[int, float], steady: bool) -> Iterator[Step]:
    """Plunges of 200 and 203; ``out`` the motion and feed between them."""
    feed, dwell = h.feed(206), h.q(210, 0.0)
    breaks, back = (0.0, 0.0) if steady else (h.q(213, 0.0), abs(h.mm(256, 0.2)))
    chip_breaks, done = 0, 0.0
    for depth in h.plunges(0.0, steady):
        if done > 0.0 and chip_breaks < breaks:
            chip_breaks += 1
            yield out[0], h.surface - done + back, out[1]
        elif done > 0.0:
            chip_breaks = 0
            yield out[0], h.top, out[1]
            if dwell > 0.0:
                yield DWELL, h.top, dwell
            yield RAPID, h.surface - done + h.clearance, 0.0
        yield LINE, h.surface - depth, feed
        done = depth


def _pecking_steps(h: HoleValues) -> Iterator[Step]:
    """Plunges of 205."""
    feed, start = h.feed(206), abs(h.mm(379, 0.0))
    every, back = abs(h.mm(257, 0.0)), abs(h.mm(256, 0.2))
    first, last = abs(h.mm(258, 0.2)), abs(h.mm(259, 0.2))
    plunges = h.plunges(start, False)
    if every > 0.0 and h.depth / every > MOST_PLUNGES:
        raise InputError(f"CYCL DEF 205: Q257: breaks the chip more than {MOST_PLUNGES} times: raise it")
    if start > 0.0:
        yield LINE, h.surface - start + h.clearance, h.feed(253)
    done = start
    for k, depth in enumerate(plunges):
        if k > 0:
            share = (k - 1) / max(1, len(plunges) - 2)
            yield RAPID, h.top, 0.0
            yield RAPID, h.surface - done + first + share * (last - first), 0.0
        while every > 0.0 and depth - done > every * (1.0 + 1e-9):
            done += every
            yield LINE, h.surface - done, feed
            yield RAPID, h.surface - done + back, 0.0
        yield LINE, h.surface - depth, feed
        done = depth


def _single_lip_steps(h: HoleValues) -> Iterator[Step]:
    """Plunges of 241, which follow one another."""
    start = abs(h.mm(379, 0.0))
    if start > 0.0:
        yield LINE, h.surface - start + h.clearance, h.feed(253)
    plunges = h.plunges(start, False) if h.q(202, MAX) < h.depth else [h.depth]
    for depth in plunges:
        yield LINE, h.surface - depth, h.feed(206)


def _rigid_tapping(h: HoleValues, turns_s: float) -> Iterator[Step]:
    """207 and 209."""
    pitch = abs(h.mm(239, None))
    if pitch == 0.0 or turns_s == 0.0:
        raise InputError(f"CYCL DEF {h.number}: the pitch Q239 and the spindle speed S must not be 0")
    feed, done = pitch * turns_s, 0.0
    every = abs(h.mm(257, 0.0)) if h.number == 209 else 0.0
    if every > 0.0 and h.depth / every > MOST_PLUNGES:
        raise InputError(f"CYCL DEF 209: Q257: breaks the chip more than {MOST_PLUNGES} times: raise it")
    while every > 0.0 and h.depth - done > every * (1.0 + 1e-9):
        done += every
        back = abs(h.q(256, 0.0)) * pitch
        yield LINE, h.surface - done, feed
        yield SPIN, h.surface - done, -1.0
        yield LINE, h.surface - done + back if back > 0.0 else h.top, feed
        yield SPIN, h.surface - done, 1.0
    yield LINE, h.bottom, feed
    yield SPIN, h.bottom, -1.0
    yield LINE, h.top, feed
    yield SPIN, h.top, 1.0
