"""From the workpiece to the axes of a machine: Program to Commands.

Notation: L [mm] tool length, in a frame what it adds to the axes. A machine without rotary axes is told the tip. One
with them is told its axes, or, with tool centre point control (tcp), the tip and the angles.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import fields, replace

import numpy as np
from numpy.typing import NDArray

from chipload.errors import Finding, InputError
from chipload.machine.follow import follow
from chipload.machine.kinematics import forward, with_tip
from chipload.machine.limits import limit_findings
from chipload.machine.linearise import linearise
from chipload.machine.machine import Machine
from chipload.program.commands import ARC, DWELL, LINE, PLANE_AXES, RAPID, XY, YZ, ZX, Commands, Frame, extents
from chipload.program.motions import is_arc, radii, spans, straighten_arcs, sweeps
from chipload.program.program import ARC_CCW, Program
from chipload.program.program import RAPID as WORK_RAPID
from chipload.program.to_work import TOLERANCE_MM, home

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

#: how far the tool's axis may leave its great circle where a row is cut into pieces [rad]
ANGLE_TOLERANCE = math.radians(0.05)
#: arcs of a smaller radius [mm] are written as chords: controllers refuse them
LEAST_RADIUS = 0.0013
#: an index table that moves less [rad] stands
INDEX_STANDS = 1e-6
#: codes of findings about the position of the axes
LIMITS = ("machine-limit", "machine-index", "machine-offset")
#: pieces that the rows of one tool may be cut into
MOST_PIECES = 1_000_000
_ROTARY = slice(3, 6)


def to_axes(
    program: Program,
    machine: Machine,
    *,
    tool_lengths: Mapping[int, float] | None = None,
    tcp: bool = False,
    start: Floats | None = None,
    tolerance: float = TOLERANCE_MM,
) -> tuple[Commands, tuple[Finding, ...]]:
    """Motions of the machine's axes for a program; O(n) and the search of :func:`~chipload.machine.follow.follow`.

    Parameters
    ----------
    tool_lengths : L [mm] of each tool; one that is not named has 0: positions are of the spindle's nose
    tcp : whether the controller is told the tip and keeps it there while rotary axes move
    start : (9,) float, where the axes stand before row 0
    tolerance : greatest distance of the tip from its line [mm] where a rotary axis moves

    Raises
    ------
    InputError
        The axis is tilted and the machine has no rotary axis, or its rotary axes do not reach it; an index table would
        move in a cut.
    """
    small = (radii(program) < LEAST_RADIUS) & is_arc(program)
    program = straighten_arcs(program, np.where(small, 0.25 * math.pi, math.inf))
    program = _single_turns(program)
    if not machine.chain.rotary:
        tilted = np.flatnonzero((np.abs(program.axis[:, :2]).max(axis=1) > 1e-9) | (program.axis[:, 2] < 0.0))
        if len(tilted):
            raise InputError(f"program row {tilted[0]}: the axis is tilted: {machine.name} is written with three axes")
        program = _plane_arcs(program, program.normal, tolerance)
        position, frame = np.pad(program.p_work, ((0, 0), (0, 6))), np.zeros(len(program), dtype=np.int64)
        return _commands(program, position, program.centre, program.normal, (Frame(),), frame), ()
    return _rotary_commands(program, machine, tool_lengths or {}, tcp, start, tolerance)


def _single_turns(program: Program) -> Program:
    """Arcs of more than a turn as several rows of at most one turn each."""
    if not program.turns.any():
        return program
    sweep = np.abs(sweeps(program))
    count = np.where(program.turns > 0, np.ceil(sweep / math.tau - 1e-9), 1.0).clip(1.0).astype(np.int64)
    chords = straighten_arcs(program, np.where(program.turns > 0, sweep / count, math.inf))
    row = np.repeat(np.arange(len(program)), count)
    back = {name: getattr(program, name)[row] for name in ("motion", "centre", "normal")}
    return replace(chords, **back, turns=np.zeros(len(row), dtype=np.int64))


def _plane_arcs(program: Program, normal: Floats, tolerance: float) -> Program:
    """Arcs about no axis of coordinates (``normal`` (n, 3), as the controller sees it) as chords."""
    odd = is_arc(program) & (np.abs(normal).max(axis=1) < 1.0 - 1e-9)
    r = radii(program)
    turn = 2.0 * np.arccos(1.0 - np.minimum(tolerance / np.where(r > 0.0, r, math.inf), 1.0))
    return straighten_arcs(program, np.where(odd, turn, math.inf))


def _commands(
    program: Program, position: Floats, centre: Floats, normal: Floats, frames: tuple[Frame, ...], frame: Ints
) -> Commands:
    """Commands of rows at ``position`` (n, 9), arcs of at most a turn about ``normal`` through ``centre``."""
    along = np.argmax(np.abs(normal), axis=1)
    plane = np.array([YZ, ZX, XY])[along]
    arc = is_arc(program)
    pair = np.array(PLANE_AXES)[plane][:, :2]
    sense = np.where(program.motion == ARC_CCW, 1, -1) * np.sign(normal[np.arange(len(along)), along])
    return Commands(
        motion=np.array([RAPID, LINE, ARC, ARC, DWELL])[program.motion],
        position=position,
        plane=np.where(arc, plane, XY),
        centre=np.where(arc[:, None], np.take_along_axis(centre, pair, axis=1), 0.0),
        turns=np.where(arc, sense, 0),
        feed=program.feed,
        spindle=program.spindle,
        tool=program.tool,
        tcp=np.zeros(len(program), dtype=bool),
        frame=frame,
        line=program.line,
        label=program.label,
        frames=frames,
        labels=program.labels,
        path_mode=program.path_mode,
    )


def _rotary_commands(
    program: Program,
    machine: Machine,
    tool_lengths: Mapping[int, float],
    tcp: bool,
    start: Floats | None,
    tolerance: float,
) -> tuple[Commands, tuple[Finding, ...]]:
    """Commands of a machine with rotary axes, tool after tool: each has its own length."""
    free = "".join(axis.letter for axis in machine.chain.rotary)
    origin = home(machine, 0.0)
    tools = list(dict.fromkeys(program.tool.tolist()))
    frames = tuple(Frame(offset=origin, tool=home(machine, tool_lengths.get(t, 0.0)) - origin) for t in tools)
    findings: list[Finding] = []
    parts: list[Program] = []
    axes: list[Floats] = []
    stands = start
    ends = np.flatnonzero(np.append(np.diff(program.tool) != 0, True)) + 1
    for begin, end in zip([0, *ends[:-1]], ends, strict=True):
        length = tool_lengths.get(int(program.tool[begin]), 0.0)
        piece, q, found = _piece(
            _rows_of(program, np.arange(begin, end)), machine, length, free, tcp, stands, tolerance
        )
        parts.append(piece)
        axes.append(q)
        prefix = f"tool {program.tool[begin]}: " if len(tools) > 1 else ""
        findings += [replace(f, text=f"{prefix}{f.text}") for f in found if f.code not in LIMITS]
        stands = q[-1]
    whole, q = Program.join(parts), np.vstack(axes)
    findings += limit_findings(machine, q, whole.line, placed=False)
    _index_stands(whole, machine, q)
    frame = np.array([tools.index(t) for t in whole.tool.tolist()])
    if tcp:
        position = np.array(q)
        position[:, :3] = whole.p_work
        centre, normal = whole.centre, whole.normal
        frames = tuple(replace(f, offset=np.zeros(9), tool=np.zeros(9)) for f in frames)
    else:
        position = np.zeros((len(q), 9))
        for k, one in enumerate(frames):
            position[frame == k] = one.from_machine(q[frame == k])
        centre, normal = _arcs_in_machine(whole, machine, q, frames, frame, tool_lengths, tools)
    out = replace(_commands(whole, position, centre, normal, frames, frame), tcp=np.full(len(whole), tcp))
    if not tcp:
        out = _with_tip_time(out, whole)
    return out, tuple(findings)


def _rows_of(program: Program, rows: NDArray[np.int64]) -> Program:
    columns = {f.name: getattr(program, f.name)[rows] for f in fields(Program) if f.name != "labels"}
    return Program(**columns, labels=program.labels)


def _piece(
    program: Program, machine: Machine, length: float, free: str, tcp: bool, start: Floats | None, tolerance: float
) -> tuple[Program, Floats, tuple[Finding, ...]]:
    """Rows of one tool and their axes: arcs that the machine sees askew as chords, turning rows in pieces."""
    q, findings = _follow_axes(program, machine, start, length, free)
    missed = next((f for f in findings if f.code == "machine-reach"), None)
    if missed is not None:
        raise InputError(f"program {missed.text}: choose a machine that reaches it")
    turns = np.abs(np.diff(q[:, _ROTARY], axis=0, prepend=q[:1, _ROTARY])).max(axis=1) > 1e-9
    normal = program.normal if tcp else _in_machine(machine, q, program.normal)
    odd = np.where((turns & is_arc(program))[:, None], math.sqrt(1.0 / 3.0), normal)
    program = _plane_arcs(program, odd, tolerance)
    indexed = any(axis.indexed for axis in machine.chain.rotary)
    if tcp or indexed:
        q, findings = _follow_axes(program, machine, start, length, free)
        return (program, q, findings) if tcp else (*_linearise_rows(program, machine, q, length, tolerance), findings)
    pieces, findings = linearise(
        machine, program.p_work, program.axis, tolerance, ANGLE_TOLERANCE, start, length, None, free
    )
    out = _rows_of(program, pieces.row)
    inner = (pieces.part < 1.0)[:, None]
    out = replace(out, p_work=np.where(inner, pieces.tip, out.p_work), axis=np.where(inner, pieces.axis, out.axis))
    return out, pieces.axes, findings


def _follow_axes(
    program: Program, machine: Machine, start: Floats | None, length: float, free: str
) -> tuple[Floats, tuple[Finding, ...]]:
    """Axes of the rows; index tables stand but in rapids, wherever another solution would take them."""
    stand = program.motion != WORK_RAPID
    return follow(
        machine, program.p_work, program.axis, start, length, None, free, line=program.line, stand=stand
    )  # fmt: skip


def _linearise_rows(
    program: Program, machine: Machine, q: Floats, length: float, tolerance: float
) -> tuple[Program, Floats]:
    """Rows in pieces: rotary axes in straight proportion, the tip on its line within the tolerance.

    The tool's axis goes the way that the rotary axes take it, which need not be a great circle: that of a pallet is a
    cone. The error of n pieces falls as 1 / n^2. A row that sets an index table stays one.
    """
    count = np.ones(len(q), dtype=np.int64)
    tables = [axis.column for axis in machine.chain.rotary if axis.indexed]
    sets = np.abs(np.diff(q[:, tables], axis=0, prepend=q[:1, tables])).max(axis=1) > INDEX_STANDS
    while True:
        row = np.repeat(np.arange(len(q)), count)
        part = (np.arange(len(row)) - np.repeat(np.cumsum(count) - count, count) + 1) / count[row]
        before = np.maximum(row - 1, 0)
        axes = q[before] + part[:, None] * (q[row] - q[before])
        tip = program.p_work[before] + part[:, None] * (program.p_work[row] - program.p_work[before])
        cut = (count > 1)[row] & (part < 1.0)
        axes[cut] = with_tip(machine, axes[cut], tip[cut], length)
        axes[~cut] = q[row[~cut]]
        back = np.vstack([axes[:1], axes[:-1]])
        away = np.zeros(len(row))
        tips, _ = forward(machine, axes, length)
        for share in (0.25, 0.5, 0.75):
            at, _ = forward(machine, back + share * (axes - back), length)
            chord = np.vstack([tips[:1], tips[:-1]]) * (1.0 - share) + tips * share
            away = np.maximum(away, np.linalg.norm(at - chord, axis=1))
        worst = np.zeros(len(q))
        np.maximum.at(worst, row, np.where(is_arc(program)[row], 0.0, away))
        worst[0] = 0.0
        worst[sets] = 0.0
        if (worst <= tolerance).all():
            break
        more = np.ceil(count * np.sqrt(np.maximum(worst / tolerance, 1.0)) * 1.1).astype(np.int64)
        count = np.where(worst > tolerance, more, count)
        if count.sum() > MOST_PIECES:
            raise InputError(
                f"program: more than {MOST_PIECES} pieces are needed: raise the tolerance = {tolerance:g} mm"
            )
    out = _rows_of(program, row)
    _, direction = forward(machine, axes, length)
    inner = (part < 1.0)[:, None]
    direction /= np.linalg.norm(direction, axis=1)[:, None]
    return replace(out, p_work=np.where(inner, tip, out.p_work), axis=np.where(inner, direction, out.axis)), axes


def _in_machine(machine: Machine, q: Floats, vector: Floats) -> Floats:
    """(n, 3) work directions as X Y Z of the machine see them, its rotary axes where they are."""
    still = np.zeros((len(q), 3))
    a, b = (with_tip(machine, q, p)[:, :3] for p in (still, vector))
    d = b - a
    return np.asarray(d / np.linalg.norm(d, axis=1)[:, None])


def _arcs_in_machine(
    program: Program,
    machine: Machine,
    q: Floats,
    frames: tuple[Frame, ...],
    frame: NDArray[np.int64],
    tool_lengths: Mapping[int, float],
    tools: list[int],
) -> tuple[Floats, Floats]:
    """Centres and normals of the arcs in the coordinates of X Y Z."""
    arc = is_arc(program)
    centre, normal = np.array(program.centre), np.array(program.normal)
    for k, tool in enumerate(tools):
        rows = arc & (frame == k)
        at = with_tip(machine, q[rows], program.centre[rows], tool_lengths.get(tool, 0.0))
        centre[rows] = frames[k].from_machine(at)[:, :3]
        n = _in_machine(machine, q[rows], program.normal[rows])
        normal[rows] = np.where(np.abs(n) > 0.5, np.sign(n), 0.0)
    return centre, normal


def _index_stands(program: Program, machine: Machine, q: Floats) -> None:
    """An index table is set between cuts only."""
    for axis in machine.chain.rotary:
        if axis.indexed:
            moved = np.abs(np.diff(q[:, axis.column], prepend=q[:1, axis.column])) > INDEX_STANDS
            bad = np.flatnonzero(moved & (program.motion != WORK_RAPID))
            if len(bad):
                raise InputError(
                    f"program row {bad[0]}: {axis.letter} of machine {machine.name} would move in a cut: an index "
                    "table is set between cuts: keep the axis of the tool there"
                )


def _with_tip_time(commands: Commands, program: Program) -> Commands:
    """Feeds along the commanded coordinates that give each row the time that the tip needs at its own."""
    cuts = np.isin(commands.motion, (LINE, ARC))
    length, own = spans(program), extents(commands)
    ratio = own / np.where(length > 0.0, length, 1.0)
    return replace(commands, feed=np.where(cuts & (ratio > 0.0), commands.feed * ratio, commands.feed))
