"""Places of a pattern: PATTERN DEF of conversational programs.

Notation: a place is (x, y, z) in the units of the text; z is added to the surface of the cycle.

| word | places |
|---|---|
| POS1 (X Y Z) | one |
| ROW1 (X Y D NUM ROT Z) | NUM in a row, D apart, in the direction ROT |
| PAT1, FRAME1 (X Y DX DY NUMX NUMY ROT ROTX ROTY Z) | rows and columns, whole, or those of the border alone |
| CIRC1 (X Y D START NUM Z) | NUM on a circle of the diameter D |
| PITCHCIRC1 (X Y D START STEP NUM Z) | NUM on it, STEP apart |

Reference: Heidenhain, TNC 640 User's Manual Cycle Programming, "Pattern definition PATTERN DEF".
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator

from chipload.errors import InputError
from chipload.program.heidenhain import words
from chipload.program.heidenhain.formula import NotKnownError

#: places of one pattern
MOST_PLACES = 10_000
_ONE = re.compile(r"\b(POS|ROW|PAT|FRAME|CIRC|PITCHCIRC)\s*\d+\s*\(([^()]*)\)")
_VALUE = re.compile(rf"\b(NUMX|NUMY|NUM|ROTX|ROTY|ROT|START|STEP|DX|DY|[XYZD])\s*([-+]?)\s*({words.VALUE})")

Place = tuple[float, float, float]


def pattern_places(text: str, value: Callable[[str, str], float]) -> list[Place]:
    """The places of a PATTERN DEF block in the order in which they are worked.

    Parameters
    ----------
    value : of a number or a Q parameter with its sign

    Raises
    ------
    InputError
        It has no place, or a word is missing.

    >>> pattern_places("PATTERN DEF ROW1 (X+10 Y+0 D+5 NUM3 ROT+90 Z+0)", lambda sign, v: float(sign + v))[2]
    (10.0, 10.0, 0.0)
    """
    out: list[Place] = []
    for kind, body in _ONE.findall(text):
        given = {key: value(sign, number) for key, sign, number in _VALUE.findall(body)}
        out += [(round(x, 9), round(y, 9), z) for x, y, z in _places(kind, given)]
    if not out:
        raise NotKnownError(f"{text[:60]}: no pattern that is read")
    if len(out) > MOST_PLACES:
        raise InputError(f"PATTERN DEF: {len(out)} places: must be at most {MOST_PLACES}")
    return out


def _places(kind: str, given: dict[str, float]) -> Iterator[Place]:
    def need(key: str) -> float:
        if key not in given:
            raise InputError(f"PATTERN DEF {kind}: {key} is missing")
        return given[key]

    def count(key: str) -> int:
        number = need(key)
        if not 1 <= number <= MOST_PLACES:
            raise InputError(f"PATTERN DEF {kind}: {key} = {number:g}: must be from 1 to {MOST_PLACES}")
        return round(number)

    x, y, z = need("X"), need("Y"), given.get("Z", 0.0)
    turn = math.radians(given.get("ROT", 0.0))
    if kind == "POS":
        yield x, y, z
    elif kind == "ROW":
        for k in range(count("NUM")):
            yield x + k * need("D") * math.cos(turn), y + k * need("D") * math.sin(turn), z
    elif kind in ("PAT", "FRAME"):
        columns, rows = count("NUMX"), count("NUMY")
        if columns * rows > MOST_PLACES:
            raise InputError(f"PATTERN DEF {kind}: NUMX x NUMY = {columns * rows}: must be at most {MOST_PLACES}")
        along, up = (turn + math.radians(given.get(key, 0.0)) for key in ("ROTX", "ROTY"))
        for j in range(rows):
            for i in range(columns) if j % 2 == 0 else reversed(range(columns)):
                if kind == "FRAME" and 0 < i < columns - 1 and 0 < j < rows - 1:
                    continue
                a, b = i * given.get("DX", 0.0), j * given.get("DY", 0.0)
                yield x + a * math.cos(along) - b * math.sin(up), y + a * math.sin(along) + b * math.cos(up), z
    else:
        holes, radius, start = count("NUM"), 0.5 * need("D"), given.get("START", 0.0)
        step = 360.0 / holes if kind == "CIRC" else need("STEP")
        for k in range(holes):
            at = math.radians(start + k * step)
            yield x + radius * math.cos(at), y + radius * math.sin(at), z
