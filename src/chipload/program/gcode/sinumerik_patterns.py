"""Patterns of holes of a Sinumerik, behind MCALL: HOLES1, HOLES2, CYCLE801.

Notation: HOLES1(SPCA, SPCO, STA1, FDIS, DBH, NUM), a row from the point SPCA, SPCO in the direction STA1 [deg]: the
first of NUM holes after FDIS, DBH between them. HOLES2(CPA, CPO, RAD, STA1, INDA, NUM), a circle of the radius RAD
about CPA, CPO: the first of NUM holes at STA1, INDA [deg] between them, 0: evenly all round. CYCLE801(SPCA, SPCO, STA,
DIS1, DIS2, NUM1, NUM2), a grid in the direction STA with DIS1 between NUM1 columns and DIS2 between NUM2 rows.

Reference: Siemens, Sinumerik 840D sl Programming Manual Cycles, "Drilling pattern cycles".
"""

from __future__ import annotations

import cmath
import math

from chipload.errors import InputError

PATTERNS = {"HOLES1": 6, "HOLES2": 6, "CYCLE801": 7}
#: greatest number of holes of one pattern
MOST_HOLES = 10_000


def hole_positions(name: str, arguments: list[float | None]) -> list[complex]:
    """Positions of the holes in the plane [units of the text].

    >>> [(round(p.real, 6), round(p.imag, 6)) for p in hole_positions("HOLES2", [1.0, 2.0, 5.0, 90.0, 0.0, 2.0])]
    [(1.0, 7.0), (1.0, -3.0)]

    Raises
    ------
    InputError
        An argument is missing, or a number of holes is none.
    """
    count = PATTERNS[name]
    values = [x for x in arguments[:count] if x is not None]
    if len(values) < count:
        raise InputError(f"{name}: its {count} arguments must be given")
    start = complex(values[0], values[1])
    numbers = values[5:]
    if any(n != int(n) or n < 1.0 for n in numbers) or math.prod(numbers) > MOST_HOLES:
        raise InputError(f"{name}: numbers of holes {numbers}: must be whole and from 1 to {MOST_HOLES} in all")
    if name == "HOLES2":
        radius, first, step, number = values[2], values[3], values[4], int(values[5])
        step = step or 360.0 / number
        return [start + cmath.rect(radius, math.radians(first + k * step)) for k in range(number)]
    direction = cmath.rect(1.0, math.radians(values[2]))
    if name == "HOLES1":
        return [start + direction * (values[3] + k * values[4]) for k in range(int(values[5]))]
    columns, rows = int(values[5]), int(values[6])
    # row by row, each in the direction against that of the row before
    return [
        start + direction * complex(values[3] * (i if j % 2 == 0 else columns - 1 - i), values[4] * j)
        for j in range(rows)
        for i in range(columns)
    ]
