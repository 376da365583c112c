"""Steps whose deflection neither their force nor the compliance of their neighbours explains.

Notation: d_k deflection of the workpiece in step k, F_k its force, c_k its compliance, d_k <= c_k F_k. Along a path the
compliance of a workpiece changes gradually: within a cutter's diameter it does not triple and fall again. A step whose
c_k is more than :data:`JUMP` times that of both neighbours, or less than a :data:`JUMP`-th of both, rests on a contact
or a state of the stock that is not that of the cut. It counts where it decides: where d_k, or what F_k would do with
the compliance of the neighbours, is greater than every other deflection.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chipload.errors import Finding, Severity
from chipload.number_text import number_text

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

#: compliance of a step over that of its neighbours; from step to step of the examples with thin walls it changes by a
#: factor of 2.1 (plate), at the tip of a blade once by 3.0, but then of one neighbour only
JUMP = 3.0


def jumps(place: Floats, force: Floats, deflection: Floats, compliance: Floats, reach: float) -> tuple[Ints, Floats]:
    """Return the steps that decide and that their neighbours do not explain, and their compliance over that of these.

    Parameters
    ----------
    place : (c, 3) float [mm], where each step cuts, in the order of the steps
    force, deflection : (c,) float, F and d, in units whose quotient is that of ``compliance``
    compliance : (c,) float, c
    reach : greatest distance of a neighbour [mm]

    Examples
    --------
    The third step bends the wall eight times as much per newton as those beside it.

    >>> place = np.array([[float(x), 0.0, 0.0] for x in range(5)])
    >>> c = np.array([0.1, 0.1, 0.8, 0.1, 0.1])
    >>> step, ratio = jumps(place, np.full(5, 100.0), 100.0 * c, c, 2.0)
    >>> step.tolist(), ratio.round(3).tolist()
    ([2], [8.0])
    """
    known = np.flatnonzero((force > 0.0) & (compliance > 0.0))
    c, f, d = compliance[known], force[known], deflection[known]
    near = np.linalg.norm(np.diff(place[known], axis=0), axis=1) <= reach
    most, least = np.zeros(len(c)), np.full(len(c), np.inf)
    for own, other in ((slice(1, None), slice(None, -1)), (slice(None, -1), slice(1, None))):
        most[own] = np.where(near, np.maximum(most[own], c[other]), most[own])
        least[own] = np.where(near, np.minimum(least[own], c[other]), least[own])
    above, below = (most > 0.0) & (c > JUMP * most), (most > 0.0) & (JUMP * c < least)
    expected = np.where(below, f * np.where(below, least, 0.0), d)
    worst = float(d[~(above | below)].max(initial=0.0))
    k = np.flatnonzero((above | below) & (expected > worst))
    return known[k], c[k] / np.where(above, most, least)[k]


def jump_findings(
    columns: Mapping[str, NDArray[Any]], step: Ints, place: Floats, compliance: Floats, reach: float, force: str
) -> tuple[Finding, ...]:
    """Return a finding for each step of a history that :func:`jumps` returns.

    Parameters
    ----------
    columns : of the history, one row for each step
    step : (c,) int, rising, rows that cut
    place, compliance : (c, 3) float [mm], (c,) float [um/N]
    reach : [mm]
    force : column of the force that bends the workpiece
    """
    if not len(step):
        return ()
    f, d = np.asarray(columns[force])[step], np.asarray(columns["deflection_workpiece_um"])[step]
    out = []
    for k, ratio in zip(*(x.tolist() for x in jumps(place, f, d, compliance, reach)), strict=True):
        text = (
            f"the workpiece bends by {number_text(d[k])} µm under {number_text(f[k])} N, "
            f"{number_text(ratio, 3)} times as much per "
            "newton as in the "
            "steps next to it: its deflection is not known; state a smaller step_mm"
        )
        row, (x, y, z) = int(step[k]), place[k].tolist()
        line = int(columns["line"][row])
        out.append(Finding("deflection-jump", line, text, Severity.UNPROVEN, (x, y, z), row))
    return tuple(out)
