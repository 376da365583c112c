"""What the rows of a program are in space: sweep, length, ends' directions, bounds.

Notation: row k goes from the end of row k - 1 to its own end; row 0 has no length. An arc turns about the axis through
its ``centre`` along its unit ``normal`` n; e1, e2 span its plane, e1 x e2 = n. ``sweep`` [rad] is the angle that it
turns through, positive counter-clockwise about n, 0 for all else; ends over one another are a full turn.
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
    return np.asarray((program.motion == ARC_CW) | (program.motion == ARC_CCW))


def starts(program: Program) -> Floats:
    """(n, 3) where each row starts [mm]; row 0 starts at its own end."""
    return np.vstack([program.p_work[:1], program.p_work[:-1]])


def bases(normal: Floats) -> tuple[Floats, Floats]:
    """(n, 3), (n, 3) unit vectors e1, e2 with e1 x e2 = ``normal`` (n, 3).

    X, Y for +Z; Z, X for +Y; Y, Z for +X: the order in which controllers name the coordinates of G17, G18 and G19.
    """
    along = np.argmax(np.abs(normal), axis=1)
    e1 = np.eye(3)[(along + 1) % 3]
    e1 = e1 - (e1 * normal).sum(axis=1)[:, None] * normal
    e1 /= np.linalg.norm(e1, axis=1)[:, None]
    return e1, np.cross(normal, e1) + 0.0


def arms(program: Program) -> tuple[Floats, Floats]:
    """(n, 2), (n, 2) start and end of each arc from its axis, along e1 and e2 [mm]; 0 for all else."""
    first, last = np.zeros((len(program), 2)), np.zeros((len(program), 2))
    arc = np.flatnonzero(is_arc(program))
    if len(arc):
        e1, e2 = bases(program.normal[arc])
        for out, p in ((first, starts(program)[arc]), (last, program.p_work[arc])):
            v = p - program.centre[arc]
            out[arc, 0], out[arc, 1] = (v * e1).sum(axis=1), (v * e2).sum(axis=1)
    return first, last


def rises(program: Program) -> Floats:
    """(n,) how far each arc moves along its normal [mm], 0 for all else."""
    out, arc = np.zeros(len(program)), is_arc(program)
    if arc.any():
        d = program.p_work[arc] - starts(program)[arc]
        out[arc] = (d * program.normal[arc]).sum(axis=1)
    return out


def sweeps(program: Program) -> Floats:
    """(n,) signed sweep [rad]; an arc whose ends lie over one another within ``JOIN_MM`` turns fully.

    >>> from chipload.program.build import plunge, rapid, rows
    >>> half = rows([3], [[-1.0, 0.0, 0.0]], (0.0, 0.0), 5.0, 0.0, 1, "cut")
    >>> float(sweeps(Program.join([rapid([1.0, 0.0, 0.0], 0.0, 1, "link"), half]))[1]) / math.pi
    1.0
    """
    if not is_arc(program).any():
        return np.zeros(len(program))
    v0, v1 = arms(program)
    turn = np.arctan2(v0[:, 0] * v1[:, 1] - v0[:, 1] * v1[:, 0], (v0 * v1).sum(axis=1))
    sense = np.where(program.motion == ARC_CCW, 1.0, -1.0)
    sweep = (sense * turn) % math.tau
    sweep = np.where(np.hypot(*(v1 - v0).T) <= JOIN_MM, math.tau, sweep) + math.tau * program.turns
    sweep = np.where(is_arc(program), sense * sweep, 0.0)
    sweep[:1] = 0.0
    return sweep


def radii(program: Program) -> Floats:
    """(n,) radius of each arc at its end [mm], 0 for all else."""
    v = arms(program)[1]
    return np.hypot(v[:, 0], v[:, 1])


def lengths(program: Program) -> Floats:
    """(n,) length of each row [mm]: chord, arc, or helix sqrt((r sweep)^2 + rise^2)."""
    chord = np.linalg.norm(program.p_work - starts(program), axis=1)
    arc = is_arc(program)
    if arc.any():
        chord = np.where(arc, np.hypot(radii(program) * sweeps(program), rises(program)), chord)
    return np.where(program.motion == DWELL, 0.0, chord)


def spans(program: Program) -> Floats:
    """(n,) what a feed is counted along: length [mm] or, where the tip stands, how far the tool's axis turns [rad]."""
    length = lengths(program)
    before = np.vstack([program.axis[:1], program.axis[:-1]])
    turn = 2.0 * np.arcsin(np.minimum(0.5 * np.linalg.norm(program.axis - before, axis=1), 1.0))
    return np.where((length <= JOIN_MM) & (program.motion != DWELL), turn, length)


def directions(program: Program) -> tuple[Floats, Floats]:
    """(n, 3), (n, 3) unit directions of travel at the start and the end of each row; 0 where it has no length."""
    d = program.p_work - starts(program)
    first, last = d.copy(), d.copy()
    arc = np.flatnonzero(is_arc(program))
    e1, e2 = bases(program.normal[arc])
    along, sweep = rises(program)[arc, None] * program.normal[arc], sweeps(program)[arc, None]
    for out, v in zip((first, last), arms(program), strict=True):
        out[arc] = sweep * (v[arc, :1] * e2 - v[arc, 1:] * e1) + along
        size = np.linalg.norm(out, axis=1)
        out /= np.where(size > 0.0, size, 1.0)[:, None]
    still = lengths(program) == 0.0
    first[still] = last[still] = 0.0
    return first, last


def bounds(program: Program) -> tuple[Floats, Floats]:
    """(n, 3), (n, 3) least and greatest coordinates [mm] that each row reaches, the bulge of arcs included.

    Exact but for helical arcs whose normal is no axis of coordinates: those may be given too much, never too little.
    """
    p0, p1 = starts(program), program.p_work
    low, high = np.minimum(p0, p1), np.maximum(p0, p1)
    sweep, r, rise = sweeps(program), radii(program), rises(program)
    turning = sweep != 0.0
    if not turning.any():
        return low, high
    e1, e2 = bases(program.normal)
    v0 = arms(program)[0]
    a0 = np.arctan2(v0[:, 1], v0[:, 0])
    foot = p0 - v0[:, :1] * e1 - v0[:, 1:] * e2
    for i in range(3):
        reach = r * np.hypot(e1[:, i], e2[:, i])
        top = np.arctan2(e2[:, i], e1[:, i])
        climb = rise * program.normal[:, i]
        for sign, turn in ((1.0, 0.0), (-1.0, math.pi)):
            along = (np.sign(sweep) * (top + turn - a0)) % math.tau
            hit = turning & ((along <= np.abs(sweep)) | (np.abs(climb) > 1e-9)) & (reach > 1e-12)
            value = foot[:, i] + sign * (reach + np.maximum(0.0, sign * climb))
            if sign > 0.0:
                high[:, i] = np.where(hit, np.maximum(high[:, i], value), high[:, i])
            else:
                low[:, i] = np.where(hit, np.minimum(low[:, i], value), low[:, i])
    return low, high


def straighten_arcs(program: Program, turn: Floats) -> Program:
    """The program with some arcs as chords between points on them.

    Parameters
    ----------
    turn : (n,) float [rad]
        Greatest angle of a chord of each row; inf where the row stays as it is. A chord leaves its arc by at most
        r (1 - cos(turn / 2)). An axis that turns on an arc turns evenly along its chord.
    """
    sweep = sweeps(program)
    chosen = is_arc(program) & np.isfinite(turn) & (sweep != 0.0)
    if not chosen.any():
        return program
    count = np.ones(len(program), dtype=np.int64)
    count[chosen] = np.ceil(np.abs(sweep[chosen]) / turn[chosen] - 1e-9).astype(np.int64).clip(1)
    row = np.repeat(np.arange(len(program)), count)
    u = ((np.arange(len(row)) - np.repeat(np.cumsum(count) - count, count) + 1) / count[row])[:, None]
    p0, v = starts(program)[row], arms(program)[0][row]
    e1, e2 = (e[row] for e in bases(program.normal))
    angle = (sweep[row] * u[:, 0])[:, None]
    c, s = np.cos(angle), np.sin(angle)
    foot = p0 - v[:, :1] * e1 - v[:, 1:] * e2 + (rises(program)[row] * u[:, 0])[:, None] * program.normal[row]
    around = foot + (c * v[:, :1] - s * v[:, 1:]) * e1 + (s * v[:, :1] + c * v[:, 1:]) * e2
    inner = (chosen[row] & (u[:, 0] < 1.0))[:, None]
    points = np.where(inner, around, program.p_work[row])
    columns = {f.name: getattr(program, f.name)[row] for f in fields(Program) if f.name != "labels"}
    turned = program.axis[np.maximum(row - 1, 0)] * (1.0 - u) + program.axis[row] * u
    columns["axis"] = np.where(inner, turned / np.linalg.norm(turned, axis=1)[:, None], columns["axis"])
    columns["motion"] = np.where(chosen[row], LINE, program.motion[row])
    columns["centre"] = np.where(chosen[row][:, None], 0.0, program.centre[row])
    columns["normal"] = np.where(chosen[row][:, None], (0.0, 0.0, 1.0), program.normal[row])
    columns["turns"] = np.where(chosen[row], 0, program.turns[row])
    return Program(**{**columns, "p_work": points}, labels=program.labels)
