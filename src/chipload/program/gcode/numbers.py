"""Numbers without a decimal point: least increments of coordinates and feeds, units of a dwell.

Notation: ``X1000`` is 1 mm where the least increment of 0.001 mm counts, and 1000 mm where whole units count. Counts
(N, O, G, M, T, H, D, S, L, repeats) are whole numbers everywhere. What a control does is in its profile
(:mod:`~chipload.program.control`); where a setting decides and the job does not state it, a text that writes points
(``X10.``) is read in least increments, one that never does in whole units, and the result is unproven.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from chipload.errors import Severity
from chipload.program.gcode.cycles import CYCLES, NEED_Q, TAPPING

if TYPE_CHECKING:
    from chipload.program.gcode.controller import Controller
    from chipload.program.gcode.words import Block

#: a coordinate with a trailing point, as ``X10.``
_POINT = re.compile(r"[XYZABCIJKQR][ \t]*[-+]?[0-9]+\.(?![0-9])", re.IGNORECASE)
#: a whole number that is not 0, with which the point makes a difference
_COORDINATE = r"[XYZABCIJKUVW][ \t]*[-+]?0*[1-9][0-9]*(?![0-9.])"
_NO_POINT = re.compile(_COORDINATE, re.IGNORECASE)
_NO_POINT_FEED = re.compile(rf"{_COORDINATE}|F[ \t]*0*[1-9][0-9]*(?![0-9.])", re.IGNORECASE)
_COMMENT = re.compile(r"\([^()\n]*\)")
#: codes whose words are no coordinates: dwells, look-ahead, data of the controller
_NO_COORDINATES = frozenset({40, 50, 51, 80, 81, 1030, 1870, 2540})
#: angles: turned coordinates and tilted planes
_ANGLES = frozenset({680, 682, 2680, 160})


def decide_increments(c: Controller, text: str) -> None:
    """Decide what a number without a point counts in; a finding where nothing states it."""
    numbers, stated = c.control.numbers, c.control.settings.point is not None
    if not numbers.increment_letters:
        return
    plain = _COMMENT.sub(lambda found: " " * len(found[0]), text)
    if not stated and c.increments and _POINT.search(plain) is None:
        c.increments = False
        found = _NO_POINT.search(plain)
        if found is not None:
            message = (
                f"{found[0]!r} has no decimal point, nor has any number that is whole: taken as a whole unit, not as "
                "the least increment: state program.settings.point"
            )
            c.findings.add("nc-no-point", 1 + plain.count("\n", 0, found.start()), message, Severity.UNPROVEN)
    if c.increments or numbers.feed_increment:
        pattern = _NO_POINT_FEED if numbers.feed_increment else _NO_POINT
        c.pointless = pattern if pattern.search(plain) is not None else None


def count_increments(block: Block, c: Controller) -> None:
    """Numbers without a point in units of the text."""
    words, numbers = block.words, c.control.numbers
    if not _NO_COORDINATES.isdisjoint(block.g):
        return
    cycle = any(code in CYCLES for code in block.g) or c.state.motion in CYCLES
    changed = []
    for letter in sorted(block.pointless & words.keys()):
        if words[letter] == 0.0 or _counts(letter, block, c, cycle):
            continue
        factor = c.increment(letter)
        if letter == "r" and 680 in block.g:
            factor = numbers.increment_deg if c.increments else 1.0
        if letter == "f" and numbers.feed_increment and c.state.feed_mode == 940:
            factor = numbers.increment_inch if c.state.scale != 1.0 else numbers.increment_mm
        if factor != 1.0:
            changed.append(letter)
            words[letter] *= factor
    settings = c.control.settings
    if changed and (settings.feed_point if changed == ["f"] else settings.point) is None:
        c.leave_out(
            "nc-no-point",
            f"{', '.join(changed).upper()} without a decimal point: counts in least increments, 1000 as "
            f"{1000.0 * numbers.increment_mm:g} mm or {1000.0 * numbers.increment_inch:g} in: "
            "state program.settings.point",
        )


def _counts(letter: str, block: Block, c: Controller, cycle: bool) -> bool:
    """Whether a word of the block is a count, or an angle in whole degrees."""
    if letter == "q":
        return not (cycle and not NEED_Q.isdisjoint({c.state.motion, *block.g, 760, 870}))
    if letter == "j" and not TAPPING.isdisjoint({c.state.motion, *block.g}):
        return True
    if letter == "k" and cycle:
        return c.control.cycles.repeat_letter == "k"
    if letter in "ijk" and not _ANGLES.isdisjoint(block.g):
        return True
    return letter == "y" and c.polar is not None


def seconds_of(block: Block, c: Controller, letter: str) -> float | None:
    """Seconds of a dwell; None where the control has no such word of a dwell."""
    unit = c.control.dwell.get(letter)
    if unit is None:
        return None
    value = block.words[letter]
    if letter not in block.pointless:
        if value != int(value) and unit.point_s < 1.0 and letter == "p" and c.control.settings.dwell_s is None:
            c.leave_out(
                "nc-dwell-point",
                f"P{value:g}: a dwell in milliseconds has no decimal point; taken as {value * unit.point_s:g} s: state "
                "program.control or program.settings.dwell_s",
            )
        return value * unit.point_s
    return value * unit.whole_s
