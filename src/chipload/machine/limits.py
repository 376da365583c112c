"""Checks of axis positions against the limits and index steps of a machine.

Notation: q axis positions, columns X Y Z A B C U V W [mm, rad].
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipload.errors import Finding
from chipload.machine.axis import Axis
from chipload.machine.machine import Machine

Floats = NDArray[np.float64]

#: distance beyond a limit that still counts as within it [mm or rad]
SLACK = 1e-9


def distance_beyond(axis: Axis, q: Floats) -> Floats:
    """Distance [mm or rad] of positions of an axis outside its limits; 0 inside.

    >>> distance_beyond(Axis("X", True, (1.0, 0.0, 0.0), low=-1.0, high=1.0), np.array([0.5, 3.0])).tolist()
    [0.0, 2.0]
    """
    return np.asarray(np.maximum(np.maximum(axis.low - q, q - axis.high), 0.0))


def text_of_rows(rows: NDArray[np.int64], worst: int, text: str, line: NDArray[np.int64]) -> str:
    """Return the text of a finding on the worst of some rows; rows are named only where their source has no lines.

    Parameters
    ----------
    rows : rising
    line : of the source (n,), of each row; 0: none

    >>> text_of_rows(np.array([1, 4]), 4, "X = 450 mm", np.array([3, 5, 6, 7, 9]))
    'X = 450 mm (2 motions, the first in line 5)'
    >>> text_of_rows(np.array([1, 4]), 4, "X = 450 mm", np.zeros(5, dtype=np.int64))
    'row 4: X = 450 mm (2 rows, the first is 1)'
    """
    if line[worst] == 0:
        return f"row {worst}: {text}{f' ({len(rows)} rows, the first is {rows[0]})' if len(rows) > 1 else ''}"
    return f"{text}{f' ({len(rows)} motions, the first in line {line[rows[0]]})' if len(rows) > 1 else ''}"


def position_text(axis: Axis, q: float) -> str:
    """A position of an axis as text, in mm or deg.

    >>> position_text(Axis("C", False, (0.0, 0.0, 1.0)), math.pi)
    '180 deg'
    """
    return f"{math.degrees(q) + 0.0:g} deg" if axis.rotary else f"{q + 0.0:g} mm"


def limit_findings(
    machine: Machine, axes: ArrayLike, line: ArrayLike | None = None, placed: bool = True
) -> tuple[Finding, ...]:
    """Findings on axis limits and index steps, one for each axis and code, with the worst and the first row; O(n m).

    Codes: ``machine-limit``; ``machine-index``, an indexed axis that is not at a multiple of its step;
    ``machine-offset``, a linear axis that is beyond a limit but fits within its travel with another work offset.

    Parameters
    ----------
    axes : (n, 9) float [mm, rad]
    line : (n,) int, line of each row in its source; None: 0
    placed : whether the work offset is known

    Examples
    --------
    >>> from chipload.machine.machine import machine_named
    >>> axes = np.zeros((2, 9))
    >>> axes[1, 3] = np.radians(60.0)
    >>> limit_findings(machine_named("xyzac-trunnion"), axes)[0].text
    'row 1: A = 60 deg: machine xyzac-trunnion travels from -100 deg to 50 deg'
    """
    q = np.asarray(axes, dtype=np.float64)
    lines = np.zeros(len(q), dtype=np.int64) if line is None else np.asarray(line)
    found = []
    for axis in machine.chain.axes:
        values = q[:, axis.column]
        fits = not placed and not axis.rotary and np.ptp(values) <= axis.high - axis.low
        checks = [
            (
                "machine-offset" if fits else "machine-limit",
                distance_beyond(axis, values),
                f"travels from {position_text(axis, axis.low)} to {position_text(axis, axis.high)}",
            )
        ]
        if axis.step is not None:
            off = np.abs(values - axis.step * np.round(values / axis.step))
            checks.append(("machine-index", off, f"stands at multiples of {position_text(axis, axis.step)}"))
        for code, excess, text in checks:
            rows = np.flatnonzero(excess > SLACK)
            if len(rows):
                worst = int(rows[np.argmax(excess[rows])])
                what = f"{axis.letter} = {position_text(axis, float(values[worst]))}: machine {machine.name} {text}"
                found.append(Finding(code, int(lines[worst]), text_of_rows(rows, worst, what, lines)))
    return tuple(found)
