"""Rows of a program on which the tool's axis turns along a straight line between its directions.

Notation: on a row whose axis turns by the angle w from a0 to a1, the axis at the share u of the row is (1 - u) a0 + u
a1, made a unit vector: it has turned by phi with phi' = sin w / D, phi'' = 2 sin w (1 - cos w) s / D^2, s = 1 - 2 u,
D = A + B s^2, A = cos^2(w / 2), B = sin^2(w / 2); phi'' is greatest at s = sqrt(A / (3 B)), or at the ends. A row is
divided into n parts on which steps turn the axis evenly, which is off by at most max phi'' / (8 n^2) = ``OFF``. Between
the chords of an arc the axis is on the straight line already.
"""

from __future__ import annotations

import math
from dataclasses import fields

import numpy as np
from numpy.typing import NDArray

from chipload.errors import InputError
from chipload.program.motions import is_arc, starts
from chipload.program.program import Program

Floats = NDArray[np.float64]

#: most that the axis is off the straight line [rad]: 0.5 um at 50 mm from the tip
OFF = 1e-5
#: most that it may turn on a row [rad]: the line between opposite directions goes through 0
WIDEST = math.radians(170.0)


def with_linear_axes(program: Program, times: Floats) -> tuple[Program, Floats]:
    """Return a program whose axis turns along straight lines, and the time of each of its rows.

    Parameters
    ----------
    times : (n,) float [s], of the rows of ``program``, which their parts share equally

    Raises
    ------
    InputError
        The axis turns by more than ``WIDEST`` on a row.
    """
    before = program.axis[np.maximum(np.arange(len(program)) - 1, 0)]
    angle = 2.0 * np.arcsin(np.minimum(0.5 * np.linalg.norm(program.axis - before, axis=1), 1.0))
    angle[is_arc(program)] = 0.0
    k = int(np.argmax(angle))
    if angle[k] > WIDEST:
        raise InputError(
            f"line {int(program.line[k])}: the axis turns by {math.degrees(angle[k]):.4g} deg: must be at most "
            f'{math.degrees(WIDEST):g} with interpolation = "lerp"'
        )
    a, b = np.cos(0.5 * angle) ** 2, np.sin(0.5 * angle) ** 2
    s = np.sqrt(np.minimum(a / np.maximum(3.0 * b, a), 1.0))
    curve = 4.0 * np.sin(angle) * b * s / (a + b * s * s) ** 2
    count = np.ceil(np.sqrt(curve / (8.0 * OFF))).astype(np.int64).clip(1)
    if (count == 1).all():
        return program, times
    row = np.repeat(np.arange(len(program)), count)
    u = ((np.arange(len(row)) - np.repeat(np.cumsum(count) - count, count) + 1) / count[row])[:, None]
    columns = {f.name: getattr(program, f.name)[row] for f in fields(program) if f.name != "labels"}
    inner = u < 1.0
    axis = (1.0 - u) * before[row] + u * program.axis[row]
    tips = starts(program)[row]
    columns["axis"] = np.where(inner, axis / np.linalg.norm(axis, axis=1)[:, None], columns["axis"])
    columns["p_work"] = np.where(inner, tips + u * (columns["p_work"] - tips), columns["p_work"])
    return Program(**columns, labels=program.labels), times[row] / count[row]
