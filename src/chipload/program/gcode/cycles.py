"""Canned cycles G73, G74, G81 to G89: the motions over one hole.

Notation: (a, b) the hole in the plane [mm], c along its normal [units of the text]; R where feeding begins, ``bottom``
where it ends, ``clear`` where the cycle leaves the hole (R with G99, with G98 the higher of R and the level at which
the series began); Q depth of a peck, P time at the bottom. A step is ``(kind, a, b, c, value)``: RAPID, LINE or DWELL
(value: time [s]), or SPIN (value: sense of the spindle, 0 stopped) or STOP (the program waits for its operator).

Reference: LinuxCNC 2.9, "Canned Cycles Motion".
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import NamedTuple

from chipload.errors import InputError
from chipload.program.commands import DWELL, LINE, RAPID

SPIN, STOP = -1, -2
#: G codes in tenths
CYCLES = frozenset({730, 740, 810, 820, 830, 840, 850, 860, 870, 871, 880, 890})
#: back boring as a Fanuc does it, under a number of its own
FANUC_BACK_BORING = 871
#: tapping, right- and left-hand
TAPPING = frozenset({840, 740})
#: cycles that need a P word, a Q word
NEED_P = frozenset({820, 860, 880, 890})
NEED_Q = frozenset({730, 830})
#: a peck goes back by this, or comes back to this above the bottom so far [mm]
RETURN = 0.254
#: pecks of one hole
MOST_PECKS = 100_000

Step = tuple[int, float, float, float, float]


class PeckRule(NamedTuple):
    """How the pecks of a hole change [units of the text].

    ``shorter``: each peck is by that shorter than the one before it, and at least ``least`` where it is.
    ``lift``: after that depth G73 goes to R; 0: it does not. ``heights``: where the pecks end, the bottom last, instead
    of equal ones; ``back``: by how much such a peck goes or comes back, at its feed where chips are broken.
    ``pause``: time [s] at R, where a drill waits before it goes in again; ``dwell``: time [s] at the bottom, and of
    each peck where heights are stated.
    """

    shorter: float = 0.0
    least: float = 0.0
    lift: float = 0.0
    heights: tuple[float, ...] = ()
    back: float = RETURN
    pause: float = 0.0
    dwell: float = 0.0


@dataclass(frozen=True)
class Hole:
    """Numbers of one hole [units of the text, s]; ``sense`` of the spindle: 1, -1 or 0.

    ``out``: height up to which G74, G84 and G89 go at their feed, then at rapid to ``clear``; None: at feed to there.
    ``shift`` [mm] and ``middle`` of G87; ``back`` is RETURN in units of the text.
    """

    r: float
    bottom: float
    clear: float
    peck: float = 0.0
    dwell: float | None = None
    sense: int = 0
    shift: tuple[float, float] = (0.0, 0.0)
    middle: float = 0.0
    back: float = RETURN
    pecks: PeckRule = field(default_factory=PeckRule)
    out: float | None = None


def cycle_steps(code: int, a: float, b: float, hole: Hole) -> Iterator[Step]:
    """The steps from above R, over (a, b), to ``clear``."""
    r, bottom, clear = hole.r, hole.bottom, hole.clear
    out = clear if hole.out is None else hole.out
    if code in (870, FANUC_BACK_BORING):
        yield from _back_bore(a, b, hole) if code == 870 else _fanuc_back_bore(a, b, hole)
        return
    if hole.pecks.heights:
        yield from _stated_pecks(code, a, b, hole)
    elif code in NEED_Q:
        yield from _pecks(code, a, b, hole)
    else:
        if code in (740, 840):
            _require_spindle_sense(code, hole.sense)
            yield from _tap_pecks(a, b, hole)
        elif code in (860, 880) and hole.sense == 0:
            raise InputError(f"G{code // 10}: the spindle does not turn: start it by M3 or M4")
        yield LINE, a, b, bottom, 0.0
    if code in (740, 840):
        yield SPIN, a, b, bottom, -hole.sense
        yield DWELL, a, b, bottom, hole.dwell or 0.0
        yield LINE, a, b, out, 0.0
        yield SPIN, a, b, out, hole.sense
        if out != clear:
            yield RAPID, a, b, clear, 0.0
        return
    if code in NEED_P:
        yield DWELL, a, b, bottom, hole.dwell or 0.0
    if code == 890:
        yield LINE, a, b, out, 0.0
        if out != clear:
            yield RAPID, a, b, clear, 0.0
        return
    if code == 850:
        yield LINE, a, b, r, 0.0
    elif code in (860, 880):
        yield SPIN, a, b, bottom, 0
        if code == 880:
            yield STOP, a, b, bottom, 0.0
    yield RAPID, a, b, clear, 0.0
    if code in (860, 880):
        yield SPIN, a, b, clear, hole.sense


def _tap_pecks(a: float, b: float, hole: Hole) -> Iterator[Step]:
    """Pecks of a tap before the last one: in, back a little, in again."""
    if hole.peck <= 0.0:
        return
    if (hole.r - hole.bottom) / hole.peck > MOST_PECKS:
        raise InputError(f"Q{hole.peck:g}: makes more than {MOST_PECKS} pecks: raise it")
    depth = hole.r - hole.peck
    while depth > hole.bottom + 1e-9:
        yield LINE, a, b, depth, 0.0
        yield SPIN, a, b, depth, -hole.sense
        yield LINE, a, b, depth + hole.back, 0.0
        yield SPIN, a, b, depth, hole.sense
        depth -= hole.peck


def _require_spindle_sense(code: int, sense: int) -> None:
    right = 1 if code == 840 else -1
    if sense != right:
        state = {0: "does not turn", 1: "turns clockwise", -1: "turns counter-clockwise"}[sense]
        raise InputError(f"G{code // 10}: the spindle {state}: start it by M{3 if right > 0 else 4}")


def _pecks(code: int, a: float, b: float, hole: Hole) -> Iterator[Step]:
    if hole.peck <= 0.0:
        raise InputError(f"Q{hole.peck:g}: the depth of a peck must be above 0")
    if (hole.r - hole.bottom) / hole.peck > MOST_PECKS:
        raise InputError(f"Q{hole.peck:g}: makes more than {MOST_PECKS} pecks: raise it")
    shorter, least, lift = hole.pecks.shorter, hole.pecks.least, hole.pecks.lift
    if shorter < 0.0 or (shorter > 0.0 and not 0.0 < least <= hole.peck):
        raise InputError(
            f"I{hole.peck:g} J{shorter:g} K{least:g}: pecks become shorter by J, 0 or more, down to K, which must be "
            "above 0 and at most I"
        )
    if shorter > 0.0 and (hole.r - hole.bottom) / least > MOST_PECKS:
        raise InputError(f"K{least:g}: makes more than {MOST_PECKS} pecks: raise it")
    peck, lift_level = hole.peck, hole.r
    depth = hole.r - peck
    while depth > hole.bottom:
        yield LINE, a, b, depth, 0.0
        if code == 830 or 0.0 < lift <= lift_level - depth + 1e-9:
            lift_level = depth
            yield RAPID, a, b, hole.r, 0.0
        yield RAPID, a, b, depth + hole.back, 0.0
        peck = max(peck - shorter, least) if shorter > 0.0 else peck
        depth -= peck
    yield LINE, a, b, hole.bottom, 0.0
    if hole.pecks.dwell > 0.0:
        yield DWELL, a, b, hole.bottom, hole.pecks.dwell


def _stated_pecks(code: int, a: float, b: float, hole: Hole) -> Iterator[Step]:
    """Pecks that end at stated heights, each with the time at its bottom."""
    *heights, bottom = hole.pecks.heights
    dwell, pause = hole.pecks.dwell, hole.pecks.pause
    for height in heights:
        yield LINE, a, b, height, 0.0
        if dwell > 0.0:
            yield DWELL, a, b, height, dwell
        if code == 830:
            yield RAPID, a, b, hole.r, 0.0
            if pause > 0.0:
                yield DWELL, a, b, hole.r, pause
        yield RAPID if code == 830 else LINE, a, b, height + hole.pecks.back, 0.0
    yield LINE, a, b, bottom, 0.0
    if dwell > 0.0:
        yield DWELL, a, b, bottom, dwell


def _back_bore(a: float, b: float, hole: Hole) -> Iterator[Step]:
    if hole.sense == 0:
        raise InputError("G87: the spindle does not turn: start it by M3 or M4")
    shifted_a, shifted_b = a + hole.shift[0], b + hole.shift[1]
    yield RAPID, shifted_a, shifted_b, hole.r, 0.0
    yield SPIN, shifted_a, shifted_b, hole.r, 0
    yield RAPID, shifted_a, shifted_b, hole.bottom, 0.0
    yield RAPID, a, b, hole.bottom, 0.0
    yield SPIN, a, b, hole.bottom, hole.sense
    yield LINE, a, b, hole.middle, 0.0
    yield LINE, a, b, hole.bottom, 0.0
    yield SPIN, a, b, hole.bottom, 0
    yield RAPID, shifted_a, shifted_b, hole.bottom, 0.0
    yield RAPID, shifted_a, shifted_b, hole.clear, 0.0
    yield RAPID, a, b, hole.clear, 0.0
    yield SPIN, a, b, hole.clear, hole.sense


def _fanuc_back_bore(a: float, b: float, hole: Hole) -> Iterator[Step]:
    """R is below: from there the tool bores up to Z, stops, goes aside and out."""
    shifted_a, shifted_b = a + hole.shift[0], b + hole.shift[1]
    yield SPIN, a, b, hole.clear, 0
    yield RAPID, shifted_a, shifted_b, hole.clear, 0.0
    yield RAPID, shifted_a, shifted_b, hole.r, 0.0
    yield RAPID, a, b, hole.r, 0.0
    yield SPIN, a, b, hole.r, 1
    yield LINE, a, b, hole.bottom, 0.0
    yield DWELL, a, b, hole.bottom, hole.dwell or 0.0
    yield SPIN, a, b, hole.bottom, 0
    yield RAPID, shifted_a, shifted_b, hole.bottom, 0.0
    yield RAPID, shifted_a, shifted_b, hole.clear, 0.0
    yield RAPID, a, b, hole.clear, 0.0
    yield SPIN, a, b, hole.clear, 1
