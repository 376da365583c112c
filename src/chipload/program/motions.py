"""What the rows of a program are in space: sweep, length, ends' directions, bounds.

Notation: row k goes from the end of row k - 1 to its own end; row 0 has no length. ``sweep`` [rad] is the angle that an
arc turns through in the XY plane, positive counter-clockwise, 0 for all else; equal ends are a full turn.
"""

from __future__ import annotations

import math
from dataclasses import fields

import numpy as np
from numpy.typing import NDArray

from chipload.geometry.contour import JOIN_MM
from chipload.program.program import ARC_CCW, ARC_CW, DWELL, LINE, Program

Floats = NDArray[np.float64]


def is_arc(program: Program) -> NDArray[np.bool_]:
    """(n,) whether each row is an arc."""
    return np.isin(program.motion, (ARC_CW, ARC_CCW))


def starts(program: Program) -> Floats:
    """(n, 3) where each row starts [mm]; row 0 starts at its own end."""
    return np.vstack([program.p_work[:1], program.p_work[:-1]])


def sweeps(program: Program) -> Floats:
    """(n,) signed sweep [rad]; an arc whose ends are one point within ``JOIN_MM`` turns fully.

    >>> from chipload.program.build import plunge, rapid, rows
    >>> half = rows([3], [[-1.0, 0.0, 0.0]], (0.0, 0.0), 5.0, 0.0, 1, "cut")
    >>> float(sweeps(Program.join([rapid([1.0, 0.0, 0.0], 0.0, 1, "link"), half]))[1]) / math.pi
    1.0
    """
    p0, p1 = starts(program)[:, 0:2], program.p_work[:, 0:2]
    v0, v1 = p0 - program.centre, p1 - program.centre
    turn = np.arctan2(v0[:, 0] * v1[:, 1] - v0[:, 1] * v1[:, 0], (v0 * v1).sum(axis=1))
    sense = np.where(program.motion == ARC_CCW, 1.0, -1.0)
    sweep = (sense * turn) % math.tau
    sweep = np.where(np.hypot(*(p1 - p0).T) <= JOIN_MM, math.tau, sweep)
    sweep = np.where(is_arc(program), sense * sweep, 0.0)
    sweep[:1] = 0.0
    return sweep


def radii(program: Program) -> Floats:
    """(n,) radius of each arc at its end [mm], 0 for all else."""
    v = program.p_work[:, 0:2] - program.centre
    return np.where(is_arc(program), np.hypot(v[:, 0], v[:, 1]), 0.0)


def lengths(program: Program) -> Floats:
    """(n,) length of each row [mm]: chord, arc, or helix sqrt((r sweep)^2 + dz^2)."""
    d = program.p_work - starts(program)
    around = np.where(is_arc(program), radii(program) * np.abs(sweeps(program)), np.hypot(d[:, 0], d[:, 1]))
    return np.where(program.motion == DWELL, 0.0, np.hypot(around, d[:, 2]))


def directions(program: Program) -> tuple[Floats, Floats]:
    """(n, 3), (n, 3) unit directions of travel at the start and the end of each row; 0 where it has no length."""
    p0, p1 = starts(program), program.p_work
    d = p1 - p0
    first, last = d.copy(), d.copy()
    arc = is_arc(program)
    sense = np.where(program.motion == ARC_CCW, 1.0, -1.0)
    turn = np.abs(sweeps(program))
    for out, p in ((first, p0), (last, p1)):
        v = p[:, 0:2] - program.centre
        out[arc, 0] = (-sense * turn * v[:, 1])[arc]
        out[arc, 1] = (sense * turn * v[:, 0])[arc]
        size = np.linalg.norm(out, axis=1)
        out /= np.where(size > 0.0, size, 1.0)[:, None]
    still = lengths(program) == 0.0
    first[still] = last[still] = 0.0
    return first, last


def bounds(program: Program) -> tuple[Floats, Floats]:
    """(n, 3), (n, 3) least and greatest coordinates [mm] that each row reaches, the bulge of arcs included."""
    p0, p1 = starts(program), program.p_work
    low, high = np.minimum(p0, p1), np.maximum(p0, p1)
    sweep, r = sweeps(program), radii(program)
    v0 = p0[:, 0:2] - program.centre
    a0 = np.arctan2(v0[:, 1], v0[:, 0])
    sense = np.sign(sweep)
    for quarter in range(4):
        along = (sense * (quarter * 0.5 * math.pi - a0)) % math.tau
        hit = (sweep != 0.0) & (along <= np.abs(sweep))
        x = program.centre[:, 0] + r * round(math.cos(quarter * 0.5 * math.pi))
        y = program.centre[:, 1] + r * round(math.sin(quarter * 0.5 * math.pi))
        low[:, 0] = np.where(hit, np.minimum(low[:, 0], x), low[:, 0])
        low[:, 1] = np.where(hit, np.minimum(low[:, 1], y), low[:, 1])
        high[:, 0] = np.where(hit, np.maximum(high[:, 0], x), high[:, 0])
        high[:, 1] = np.where(hit, np.maximum(high[:, 1], y), high[:, 1])
    return low, high


def straightened(program: Program, turn: Floats) -> Program:
    """The program with some arcs as chords between points on them.

    Parameters
    ----------
    turn : (n,) float [rad]
        Greatest angle of a chord of each row; inf where the row stays as it is. A chord leaves its arc by at most
        r (1 - cos(turn / 2)).
    """
    sweep = sweeps(program)
    chosen = is_arc(program) & np.isfinite(turn) & (sweep != 0.0)
    if not chosen.any():
        return program
    count = np.ones(len(program), dtype=np.int64)
    count[chosen] = np.ceil(np.abs(sweep[chosen]) / turn[chosen] - 1e-9).astype(np.int64).clip(1)
    row = np.repeat(np.arange(len(program)), count)
    u = ((np.arange(len(row)) - np.repeat(np.cumsum(count) - count, count) + 1) / count[row])[:, None]
    p0, p1 = starts(program)[row], program.p_work[row]
    v = p0[:, 0:2] - program.centre[row]
    angle = (sweep[row] * u[:, 0])[:, None]
    around = program.centre[row] + np.cos(angle) * v + np.sin(angle) * np.column_stack([-v[:, 1], v[:, 0]])
    inner = (chosen[row] & (u[:, 0] < 1.0))[:, None]
    points = np.where(inner, np.column_stack([around, (p0 + (p1 - p0) * u)[:, 2]]), p1)
    columns = {f.name: getattr(program, f.name)[row] for f in fields(Program) if f.name != "labels"}
    columns["motion"] = np.where(chosen[row], LINE, program.motion[row])
    columns["centre"] = np.where(chosen[row][:, None], 0.0, program.centre[row])
    return Program(**{**columns, "p_work": points}, labels=program.labels)
