"""Cycles of conversational programs: pecking (1), dwell time (9), working plane (19); what a call of one does.

Notation of cycle 1: the tool stands the set-up clearance DIST above the surface; DEPTH of the hole and PLNGNG of each
plunge are counted from the surface down; before each plunge it stops ``advanced_stop`` above what is drilled.
"""

from __future__ import annotations

import re

from chipload.errors import InputError
from chipload.program.commands import DWELL, LINE, RAPID
from chipload.program.heidenhain.q_cycles import CYCLES, LEFT_OUT
from chipload.units import mm_s_from_mm_min

#: plunges of one hole
MOST_PLUNGES = 10_000
#: cycles that move nothing and set nothing that concerns the path
SILENT = (32, 247)
_VALUE = re.compile(r"([A-Z ]*?)\s*([-+]?\d*\.?\d+)\s*$")


def advanced_stop(depth: float) -> float:
    """Above what is drilled where a plunge begins [mm]: 0.6 for holes to 30 mm, else a fiftieth, at most 7.

    >>> advanced_stop(20.0), advanced_stop(100.0), advanced_stop(1000.0)
    (0.6, 2.0, 7.0)
    """
    return 0.6 if depth <= 30.0 else min(depth / 50.0, 7.0)


class Cycles:
    """The cycle that a call carries out, and its values as they are read."""

    def __init__(self) -> None:
        self.number: int | None = None
        self.values: dict[int, float] = {}
        self.modal = False

    def define(self, number: int, part: int, body: str, scale: float) -> float | None:
        """Read one block of a definition; returns the seconds that a dwell takes at once."""
        if number == 9:
            return self._value(number, body) if part > 0 else None
        if number == 19:
            if part > 0 and any(float(x) != 0.0 for x in re.findall(r"[ABC]\s*([-+]?\d*\.?\d+)", body)):
                raise InputError("CYCL DEF 19: a tilted working plane is not read: state the program in the work frame")
            return None
        if number == 1:
            if part == 0:
                self.number, self.values, self.modal = 1, {}, False
            else:
                value = self._value(number, body)
                self.values[part] = value if part == 4 else value * scale
            return None
        if number in CYCLES or number in LEFT_OUT:
            self.number, self.values, self.modal = number, {}, False
            return None
        if number not in SILENT:
            raise InputError(f"CYCL DEF {number}: is not read: write its motions")
        return None

    def _value(self, number: int, body: str) -> float:
        found = _VALUE.fullmatch(body)
        if found is None:
            raise InputError(f"CYCL DEF {number}: {body!r}: must be a name and a number")
        value = float(found[2])
        if not abs(value) < 1e6:
            raise InputError(f"CYCL DEF {number}: {body!r}: must be below 1e6")
        return value

    def call(self, z: float) -> list[tuple[int, float, float]]:
        """(motion, z [mm], feed [mm/s] or time [s]) of the hole under ``z``."""
        if self.number is None:
            raise InputError("a cycle is called and none is defined: give CYCL DEF 1")
        missing = [k for k in (1, 2, 3, 5) if k not in self.values]
        if missing:
            raise InputError(f"CYCL DEF 1.{missing[0]}: is missing: define the cycle whole")
        distance, depth, plunge = abs(self.values[1]), abs(self.values[2]), abs(self.values[3])
        dwell, feed = self.values.get(4, 0.0), mm_s_from_mm_min(self.values[5])
        if not (plunge > 0.0 and feed > 0.0):
            raise InputError("CYCL DEF 1: PLNGNG and F must be above 0")
        if depth / plunge > MOST_PLUNGES:
            raise InputError(f"CYCL DEF 1: more than {MOST_PLUNGES} plunges: raise PLNGNG")
        surface = z - distance
        out: list[tuple[int, float, float]] = []
        done = 0.0
        while done < depth:
            if done > 0.0:
                out.append((RAPID, surface - done + advanced_stop(depth), 0.0))
            done = min(done + plunge, depth)
            out.append((LINE, surface - done, feed))
            if done >= depth and dwell > 0.0:
                out.append((DWELL, surface - done, dwell))
            out.append((RAPID, z, 0.0))
        return out
