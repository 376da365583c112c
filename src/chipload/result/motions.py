"""History of a program that is not simulated: a row for each motion of the tip, or for each chord of an arc."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from chipload.program.motions import is_arc, lengths, radii, straighten_arcs
from chipload.program.program import DWELL, Program
from chipload.result.limits import Columns
from chipload.units import mm_min_from_mm_s, rpm_from_rad_s

MOTIONS = ("rapid", "line", "arc clockwise", "arc counter-clockwise", "dwell")
#: chords of arcs in pictures leave them by at most this [mm]
CHORD_MM = 0.01


def chords_of(program: Program) -> Program:
    """Return the program with chords in place of arcs, for pictures."""
    r = radii(program)
    turn = 2.0 * np.arccos(1.0 - np.minimum(CHORD_MM / np.where(r > 0.0, r, np.inf), 1.0))
    return straighten_arcs(program, np.where(is_arc(program) & (r > 0.0), np.maximum(turn, 0.02), np.inf))


def motion_columns(program: Program, seconds: NDArray[np.float64]) -> Columns:
    """Return the columns of a program, with a row for each motion of the tip or each chord of an arc.

    Parameters
    ----------
    seconds : (n,) time of each row of the program [s]
    """
    chords = chords_of(program)
    row = np.asarray(chords_of(replace(program, line=np.arange(len(program)))).line)
    share = 1.0 / np.bincount(row, minlength=len(program))[row]
    names = np.array([label or "program" for label in program.labels], dtype=object)
    duration = np.asarray(seconds)[row] * share
    return {
        "pass": names[chords.label],
        "line": chords.line,
        "motion": np.array(MOTIONS, dtype=object)[program.motion[row]],
        **{f"{x}_mm": chords.p_work[:, k] for k, x in enumerate("xyz")},
        **{f"axis_{x}": chords.axis[:, k] for k, x in enumerate("xyz")},
        "s_mm": np.cumsum(lengths(program)[row] * share),
        "t_s": np.cumsum(duration),
        "duration_s": duration,
        "feed_mm_min": np.where(program.motion == DWELL, 0.0, mm_min_from_mm_s(1.0) * program.feed)[row],
        "spindle_rpm": rpm_from_rad_s(1.0) * chords.spindle,
        "tool": chords.tool,
    }
