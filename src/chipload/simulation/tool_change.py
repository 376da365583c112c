"""Tool changes with the tool in the stock.

Notation: p [mm] the tip where a tool is taken out, a the tool's axis, R the cutter's radius. The tool is in the box of
the stock where a point p + t a, 0 < t below the overhang, is in the box widened by R sqrt(1 - a_i^2) along each
coordinate i: by as much as a disc of radius R across the axis reaches. Where the box ends along the axis, t is the
distance that the tool must be retracted.

What a machine does at a change is up to its builder: some retract along Z first, some stop where they are.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping

import numpy as np
from numpy.typing import NDArray

from chipload.cutter.cutter import Cutter
from chipload.errors import Finding, Severity
from chipload.program.program import Program

Floats = NDArray[np.float64]

#: a tool that is deeper in the box by less [mm] stands on its face
TOUCHES = 1e-6


def retract_needed(tip: Floats, axis: Floats, radius: float, overhang: float, low: Floats, high: Floats) -> float:
    """Return the distance along its axis [mm] by which a tool must go back to leave the box of the stock; 0: it is out.

    Parameters
    ----------
    tip : (3,) float [mm]
    axis : (3,) float, unit vector from the tip to the spindle
    radius, overhang : of the tool [mm]
    low, high : (3,) float [mm], corners of the box

    Examples
    --------
    >>> up = np.array([0.0, 0.0, 1.0])
    >>> box = np.array([0.0, 0.0, -10.0]), np.array([40.0, 30.0, 0.0])
    >>> [retract_needed(np.array(p), up, 3.0, 25.0, *box) for p in ([20.0, 15.0, -2.0], [-4.0, 15.0, -2.0])]
    [2.0, 0.0]
    """
    reach = radius * np.sqrt(np.maximum(1.0 - axis**2, 0.0))
    near, far = low - reach - tip, high + reach - tip
    begin, end = 0.0, math.inf
    for d, n, f in zip(axis.tolist(), near.tolist(), far.tolist(), strict=True):
        if abs(d) < 1e-12:
            # it only touches a face that it stands beside
            if not n + TOUCHES < 0.0 < f - TOUCHES:
                return 0.0
            continue
        enters, leaves = sorted((n / d, f / d))
        begin, end = max(begin, enters), min(end, leaves)
    return float(end) if min(end, overhang) - begin > TOUCHES else 0.0


def changes_in_stock(
    program: Program, cutters: Mapping[int, Cutter], low: Floats, high: Floats, retractions: Iterable[int] = ()
) -> tuple[Finding, ...]:
    """Return a finding for each change of a tool that stands in the box of the stock; O(n).

    Parameters
    ----------
    cutters : by tool number; a tool without one is not judged
    low, high : (3,) float [mm], corners of the box of the stock before the program
    retractions : lines that retract to a position of the machine which is not known, and so have no row
    """
    rows = np.flatnonzero(np.diff(program.tool)) + 1
    away = np.unique(np.fromiter(retractions, dtype=np.int64))
    out = []
    for k in rows.tolist():
        old, new = int(program.tool[k - 1]), int(program.tool[k])
        if old not in cutters or _any_between(away, int(program.line[k - 1]), int(program.line[k])):
            continue
        tip, axis = np.asarray(program.p_work[k - 1]), np.asarray(program.axis[k - 1])
        by = retract_needed(tip, axis, cutters[old].radius, cutters[old].overhang, low, high)
        if by > 0.0:
            x, y, z = (float(v) for v in tip)
            text = (
                f"before this line tool {old} is changed for tool {new} at X{x:.6g} Y{y:.6g} Z{z:.6g}, {by:.4g} mm "
                "inside the stock along its axis: what the machine does there is not known: before the change, retract "
                f"it by more than {by:.4g} mm, or by G53 or G28"
            )
            out.append(Finding("tool-change-in-stock", int(program.line[k]), text, Severity.UNPROVEN, (x, y, z)))
    return tuple(out)


def _any_between(lines: NDArray[np.int64], first: int, last: int) -> bool:
    """Whether one of the lines is carried out from ``first`` on and before ``last``, which stands above it after a
    subroutine at the end of the text.
    """
    after, before = lines >= first, lines <= last
    return bool((after & before if first <= last else after | before).any())
