"""Thread milling: the rise of a helix against the pitch of the thread mill that is stated.

Notation: arcs about one centre that follow one another turn by phi [rad] and rise by h [mm] along their axis; they cut
a thread of the pitch 2 pi |h| / phi [mm]. Less than ``LEAST_TURNS`` is a lead-in or lead-out, whose rise is free.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from chipload.cutter.cutter import Cutter
from chipload.errors import Finding, Severity
from chipload.program.program import ARC_CCW, ARC_CW, Program
from chipload.program.tapping import SAME_PITCH

#: least turns of a helix that cuts a thread
LEAST_TURNS = 0.9
#: centres that differ by less are one [mm]
SAME_CENTRE = 1e-3


def thread_milling_findings(program: Program, cutters: Mapping[int, Cutter]) -> tuple[Finding, ...]:
    """Return ``thread-pitch`` for the first helix of each thread mill whose pitch is another than that of its teeth.

    Parameters
    ----------
    cutters : by tool; a thread mill has a shape and a pitch
    """
    mills = {n: c.thread_pitch for n, c in cutters.items() if c.shape and c.thread_pitch is not None}
    if not mills:
        return ()
    p, out = program, dict[int, Finding]()
    arc = ((p.motion == ARC_CW) | (p.motion == ARC_CCW)) & np.isin(p.tool, list(mills))
    rows = np.flatnonzero(arc)
    rows = rows[rows > 0]
    start, end = p.p_work[rows - 1] - p.centre[rows], p.p_work[rows] - p.centre[rows]
    normal = p.normal[rows]
    rise = ((end - start) * normal).sum(axis=1)
    cross = (np.cross(start, end) * normal).sum(axis=1)
    dot = (start * end).sum(axis=1) - (start * normal).sum(axis=1) * (end * normal).sum(axis=1)
    angle = np.mod(np.where(p.motion[rows] == ARC_CCW, 1.0, -1.0) * np.arctan2(cross, dot), math.tau)
    angle = np.where(angle < 1e-9, math.tau, angle) + math.tau * p.turns[rows]
    centre = p.centre[rows] - (p.centre[rows] * normal).sum(axis=1)[:, None] * normal
    new = np.ones(len(rows), dtype=np.bool_)
    new[1:] = (
        (np.diff(rows) != 1)
        | (p.motion[rows[1:]] != p.motion[rows[:-1]])
        | (np.abs(np.diff(centre, axis=0)).max(axis=1, initial=0.0) > SAME_CENTRE)
    )
    first = np.flatnonzero(new)
    turns = np.add.reduceat(angle, first) / math.tau if len(first) else np.zeros(0)
    height = np.add.reduceat(rise, first) if len(first) else np.zeros(0)
    for k in np.flatnonzero((turns >= LEAST_TURNS) & (np.abs(height) > 1e-6)).tolist():
        row = int(rows[first[k]])
        number, pitch = int(p.tool[row]), abs(float(height[k])) / float(turns[k])
        own = mills[number]
        if number not in out and abs(pitch - own) > SAME_PITCH * own:
            text = (
                f"tool {number} mills a thread with a pitch of {pitch:.5g} mm (rise of its helix for a turn), and "
                f"thread_pitch_mm of its [[cutter]] is {own:.5g} mm: the thread does not fit: let the helix rise by "
                f"{own:.5g} mm for each turn"
            )
            x, y, z = (float(v) for v in p.p_work[row])
            out[number] = Finding("thread-pitch", int(p.line[row]), text, Severity.EXCEEDS, (x, y, z))
    return tuple(out.values())
