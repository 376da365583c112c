"""Tables of the largest cutter of single contact points at single table angles: diameter, corner radius, pallet angles.

They have the form of tables 1 to 3 of [Wu2019], which list contact points at 35, 45 and 55 deg. The diameter is the
largest of the catalogue at that table angle that has a valid pallet angle at the check points; between them nothing is
checked.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from chipload.jobs.impeller.outcome import Searched
from chipload.planning.impeller.pallet_ranges import valid_ranges

#: table angles of the source [deg]
ANGLES = (35.0, 45.0, 55.0)
#: contact points of a surface that are listed at most
_MOST = 12


def contact_table(op: Searched) -> tuple[list[str], list[list[str]]]:
    """Head and rows: u and v of contact points on the middle line, then D, r [mm] and B [deg] at each table angle.

    The table angles are those of the machine nearest to :data:`ANGLES`; each once.
    """
    a, b = op.surface.shape
    angles = np.degrees(op.table.angle)
    tables = list(dict.fromkeys(int(np.abs(angles - x).argmin()) for x in ANGLES))
    some = np.unique(np.linspace(0, a - 1, min(a, _MOST)).round().astype(int))
    points = some * b + b // 2
    columns = [_column(op, points, t) for t in tables]
    head = ["u", "v", *(f"{angles[t]:.6g} deg: D, r [mm]; B [deg]" for t in tables)]
    u, v = op.surface.u[some], op.surface.v[b // 2]
    rows = [[f"{x:.2f}", f"{v:.2f}", *cells] for x, cells in zip(u.tolist(), zip(*columns, strict=True), strict=True)]
    return head, rows


def _column(op: Searched, points: NDArray[np.int64], table: int) -> list[str]:
    """Of each contact point its largest cutter at a table angle and that one's widest range, in words."""
    catalogue = op.answer.catalogue
    order = sorted(catalogue.cutters, key=lambda c: (-c.diameter, c.corner_radius))
    out = ["not reached"] * len(points)
    left = np.arange(len(points))
    for cutter in order:
        found = valid_ranges(
            op.surface.scene, cutter, float(op.table.angle[table]), op.clearance, op.table.spans, points[left]
        ).ranges
        for k, rows in zip(left.tolist(), found, strict=True):
            if len(rows):
                low, high = np.degrees(rows[(rows[:, 1] - rows[:, 0]).argmax()])
                out[k] = f"{cutter.diameter:g}, {cutter.corner_radius:g}; {low:.1f} to {high:.1f}"
        left = left[[not len(rows) for rows in found]]
        if not len(left):
            break
    return out
