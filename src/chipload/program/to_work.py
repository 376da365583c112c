"""From the axes of a machine to the workpiece: Commands to Program.

Notation: a **known** work offset is one that the text or its parameters set; where it is all zero the work's zero is
where the machine's file puts it. L [mm] tool length, kept in a frame as what it adds to the axes. Rows on which no
rotary axis moves are mapped rigidly: arcs stay arcs. Where one moves, the tip of a machine without tool centre point
control leaves the straight line: the row is cut into pieces. So is an arc whose radii at its ends differ.
"""

from __future__ import annotations

import math
from dataclasses import fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chipload.errors import Finding, InputError, Severity
from chipload.machine.kinematics import forward, with_tip
from chipload.machine.linearise import trace_path
from chipload.machine.machine import Machine
from chipload.program.commands import (
    ARC,
    DWELL,
    LETTERS,
    LINE,
    PLANE_AXES,
    PROBE,
    Commands,
    Frame,
    chord_arcs,
    extents,
    spirals,
)
from chipload.program.motions import spans
from chipload.program.program import ARC_CCW, ARC_CW, ARC_SKEW_MM, Program
from chipload.program.program import DWELL as WORK_DWELL
from chipload.program.program import LINE as WORK_LINE
from chipload.program.program import RAPID as WORK_RAPID

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

#: how far the tip may leave its path where a row is cut into pieces [mm]
TOLERANCE_MM = 1e-3
#: rows that are taken to the workpiece at once
ROWS = 1 << 15
#: the tool stands along the normal of a tilted plane [rad]
ALONG = 1e-4
_ROTARY = slice(3, 6)
_STILL = 1e-12  # [rad] a rotary axis that moves less stands


def work_frame(commands: Commands, number: int | None = None) -> Frame:
    """The work offset whose coordinates are those of the workpiece.

    Parameters
    ----------
    number : of the work offset; None: the first of the motions that is not the machine's own

    Raises
    ------
    InputError
        No motion is in the work offset of that number.
    """
    used: list[Frame] = [commands.frames[k] for k in dict.fromkeys(commands.frame.tolist())]
    if number is None:
        return replace(next((f for f in used if f.number > 0), Frame()), tilt=None)
    found = next((f for f in used if f.number == number), None)
    if found is None:
        known = ", ".join(dict.fromkeys(_offset_name(f.number) for f in used if f.number > 0)) or "none"
        raise InputError(f"program.placed_in: no motion is in {_offset_name(number)}: must be one of {known}")
    return replace(found, tilt=None)


def _offset_name(number: int) -> str:
    return f"G{53 + number}" if number < 7 else f"G59.{number - 6}" if number < 10 else f"work offset {number}"


def axes_of(commands: Commands, machine: Machine, placed: int | None = None) -> Floats:
    """(n, 9) where the machine's own axes stand at the end of each row [mm, rad]; O(n).

    Where the work offset is not known, the work's zero is where the machine's file puts it. ``placed`` as in
    :func:`to_work`.
    """
    base = work_frame(commands, placed)
    zero, shift = work_zero(machine, base, bool(base.offset.any()))
    axes = commands.machine() + shift
    if not (machine.chain.rotary and commands.tcp.any()):
        return axes
    tool = np.array([tool_length(machine, f) for f in commands.frames])[commands.frame]
    rows = commands.tcp
    axes[rows] = with_tip(machine, axes[rows], _flat(commands, base)[rows], tool[rows], zero)
    return axes


def to_work(
    commands: Commands, machine: Machine, *, tolerance: float = TOLERANCE_MM, placed: int | None = None
) -> tuple[Program, tuple[Finding, ...]]:
    """What the commands do to the workpiece: tip and tool's axis in the work frame; O(n).

    Parameters
    ----------
    commands : motions of the machine's axes, or of the tip where ``tcp``
    machine : whose chain leads from the axes to the tip
    tolerance : greatest distance [mm] of the tip's path from the pieces of a row on which a rotary axis moves
    placed : number of the work offset whose coordinates are those of the workpiece; None: the first that is used

    Raises
    ------
    InputError
        An axis moves that the machine does not have; the work offset is turned and the machine has rotary axes.
    """
    findings = _require_axes(commands, machine)
    base = work_frame(commands, placed)
    known = bool(base.offset.any())
    zero, shift = work_zero(machine, base, known)
    commands = chord_arcs(commands, _turning_rows(commands) | spirals(commands, 0.999 * ARC_SKEW_MM), tolerance)
    turning = _turning_rows(commands)
    # only rows that turn and arcs of a machine with rotary axes are traced by the axes
    axes = commands.machine() + shift if machine.chain.rotary or turning.any() else np.empty((0, 9))
    tool = np.array([tool_length(machine, f) for f in commands.frames])[commands.frame]
    if not machine.chain.rotary:
        tip = _flat(commands, base)
        axis = np.broadcast_to([0.0, 0.0, 1.0], (len(tip), 3))
    else:
        if any(f.rotation for f in commands.frames):
            raise InputError(
                "commands: the work offset is turned (G10 L2 R): must not be on a machine with rotary axes"
            )
        tip, direction = forward(machine, axes, tool, zero)
        tip = np.where(commands.tcp[:, None], _flat(commands, base), tip)
        axis = direction / np.linalg.norm(direction, axis=1)[:, None]
    columns: dict[str, Any] = {
        "motion": np.array([WORK_RAPID, WORK_LINE, ARC_CW, WORK_DWELL, WORK_LINE])[commands.motion],
        "p_work": tip,
        "axis": axis,
        "spindle": commands.spindle,
        "tool": commands.tool,
        "line": commands.line,
        "label": commands.label,
        "path_mode": commands.path_mode,
        **_arcs_to_work(commands, machine, axes, tool, zero, base),
    }
    arcs = np.where(commands.turns > 0, ARC_CCW, ARC_CW)
    columns["motion"] = np.where(commands.motion == ARC, arcs, columns["motion"])
    program = Program(**columns, feed=commands.feed, labels=commands.labels)
    cut = turning & ~commands.tcp & (commands.motion != DWELL)
    findings += _off_normal(commands, axis)
    time = turning_times(commands, cut)
    program = _with_controller_time(program, time)
    if cut.any():
        program = _linearise_rows(program, machine, axes, tool, zero, cut, time, tolerance)
    return program, findings


def _require_axes(commands: Commands, machine: Machine) -> tuple[Finding, ...]:
    """Refuse axes that move but that the machine does not have; report probing moves."""
    letters = machine.chain.letters
    for k, letter in enumerate(LETTERS):
        if letter not in letters and len(commands) and np.ptp(commands.position[:, k]) > 0.0:
            row = int(np.flatnonzero(np.diff(commands.position[:, k]))[0]) + 1
            raise InputError(
                f"line {commands.line[row]}: {letter} moves: machine {machine.name} has the axes {letters}"
            )
    probes = np.flatnonzero(commands.motion == PROBE)
    text = "{} probing moves are taken to their ends"
    return (Finding("program-probe", int(commands.line[probes[0]]), text.format(len(probes))),) if len(probes) else ()


def _off_normal(commands: Commands, axis: Floats) -> tuple[Finding, ...]:
    """Cuts in a tilted plane with the tool not along its normal: one finding, with first line and worst angle."""
    off = np.zeros(len(commands))
    for k, frame in enumerate(commands.frames):
        if frame.tilt is not None:
            rows = (commands.frame == k) & np.isin(commands.motion, (LINE, ARC))
            across = np.linalg.norm(np.cross(axis[rows], frame.tilt.direction), axis=1)
            off[rows] = np.arctan2(across, axis[rows] @ frame.tilt.direction)
    askew = np.flatnonzero(off > ALONG)
    if not len(askew):
        return ()
    text = (
        f"{len(askew)} cuts in a tilted plane with the tool up to {math.degrees(off.max()):.3g} deg off its normal: "
        "turn the rotary axes there before (G53.1, PLANE ... TURN, DIR of CYCLE800)"
    )
    return (Finding("program-tilted-plane", int(commands.line[askew[0]]), text, Severity.UNPROVEN),)


def _turning_rows(commands: Commands) -> NDArray[np.bool_]:
    """(n,) whether a rotary axis moves on each row."""
    rotary = np.empty((len(commands), 3))
    for k, frame in enumerate(commands.frames):
        rows = commands.frame == k if len(commands.frames) > 1 else slice(None)
        # as Frame.to_machine, which turns the linear axes alone
        own = commands.position[rows, _ROTARY] + frame.shift[_ROTARY]
        rotary[rows] = own + frame.offset[_ROTARY] + frame.tool[_ROTARY]
    out = np.abs(np.diff(rotary, axis=0, prepend=rotary[:1])).max(axis=1) > _STILL
    return np.asarray(out)


def home(machine: Machine, length: float) -> Floats:
    """(9,) the axes that bring the tip of a tool to the work's zero, rotary axes at zero."""
    out: Floats = with_tip(machine, np.zeros((1, 9)), np.zeros((1, 3)), length)[0]
    return out


def tool_length(machine: Machine, frame: Frame) -> float:
    """L [mm] of a frame whose tool adds to the axes what a tool of that length does."""
    unit = home(machine, 1.0)[:3] - home(machine, 0.0)[:3]
    return float(frame.tool[:3] @ unit / (unit @ unit))


def work_zero(machine: Machine, base: Frame, known: bool) -> tuple[Floats, Floats]:
    """(3,) the work's zero in the machine's frame [mm]; (9,) what to add to the axes where the offset is not known."""
    if known:
        zero = np.array(base.offset)
        tip, _ = forward(machine, zero[None, :] * _linear(), 0.0, np.zeros(3))
        return tip[0] @ machine.chain.R_machine_work.T, np.zeros(9)
    return np.array(machine.chain.work_zero), home(machine, 0.0)


def _linear() -> Floats:
    mask = np.ones(9)
    mask[_ROTARY] = 0.0
    return mask


def _flat(commands: Commands, base: Frame) -> Floats:
    """(n, 3) X Y Z in the work frame, as if no rotary axis were turned."""
    own = replace(base, shift=np.zeros(9), tool=np.zeros(9))
    out = np.zeros((len(commands), 3))
    for k, frame in enumerate(commands.frames):
        bare = replace(frame, tool=np.zeros(9))
        for at in range(0, len(out), ROWS):
            rows = at + np.flatnonzero(commands.frame[at : at + ROWS] == k)
            if len(rows):
                out[rows] = own.from_machine(bare.to_machine(commands.position[rows]))[:, :3]
    return out


def _arcs_to_work(
    commands: Commands, machine: Machine, axes: Floats, tool: Floats, zero: Floats, base: Frame
) -> dict[str, Floats | Ints]:
    """Centre, normal and whole turns of the arcs."""
    n = len(commands)
    arcs = np.flatnonzero(commands.motion == ARC)
    centre, normal = np.broadcast_to(0.0, (n, 3)), np.broadcast_to([0.0, 0.0, 1.0], (n, 3))
    if len(arcs):
        centre, normal = centre.copy(), normal.copy()
        first = np.array(PLANE_AXES)[commands.plane[arcs]]
        at = np.array(commands.position[arcs])
        at[np.arange(len(arcs)), first[:, 0]] = commands.centre[arcs, 0]
        at[np.arange(len(arcs)), first[:, 1]] = commands.centre[arcs, 1]
        up = np.array(at)
        up[np.arange(len(arcs)), first[:, 2]] += 1.0
        ends = []
        for points in (at, up):
            moved = _at_rows(commands, arcs, points)
            flat = _flat(moved, base)
            if machine.chain.rotary:
                whole = moved.machine() + (axes[arcs] - commands.machine()[arcs])
                tip, _ = forward(machine, whole, tool[arcs], zero)
                flat = np.where(moved.tcp[:, None], flat, tip)
            ends.append(flat)
        centre[arcs] = ends[0]
        n1 = ends[1] - ends[0]
        normal[arcs] = n1 / np.linalg.norm(n1, axis=1)[:, None]
    turns = np.where(commands.motion == ARC, np.abs(commands.turns) - 1, 0)
    return {"centre": centre, "normal": normal, "turns": turns}


def _at_rows(commands: Commands, rows: Ints, position: Floats) -> Commands:
    """Some rows of the commands at other positions."""
    columns = {f.name: getattr(commands, f.name)[rows] for f in fields(Commands) if f.name not in ("frames", "labels")}
    return Commands(**{**columns, "position": position}, frames=commands.frames, labels=commands.labels)


def turning_times(commands: Commands, turning: NDArray[np.bool_] | None = None) -> Floats:
    """(n,) time [s] that the controller gives to each cut on which a rotary axis moves the tip; 0 for other rows.

    Parameters
    ----------
    turning : (n,) such rows; None: those that move a rotary axis without tip control
    """
    rows = _turning_rows(commands) & ~commands.tcp if turning is None else turning
    cuts = rows & np.isin(commands.motion, (LINE, PROBE, ARC)) & (commands.feed > 0.0)
    return np.where(cuts, extents(commands) / np.where(cuts, commands.feed, 1.0), 0.0)


def _with_controller_time(program: Program, time: Floats) -> Program:
    """The feed of the tip: rows that turn a rotary axis take the (n,) time that the controller gives them."""
    if not time.any():
        return program
    own = spans(program) / np.where(time > 0.0, time, 1.0)
    return replace(program, feed=np.where((time > 0.0) & (own > 0.0), own, program.feed))


def _linearise_rows(
    program: Program,
    machine: Machine,
    axes: Floats,
    tool: Floats,
    zero: Floats,
    cut: NDArray[np.bool_],
    time: Floats,
    tolerance: float,
) -> Program:
    """The program with its turning rows in pieces along which the tip goes straight within the tolerance.

    A row that begins with another tool length comes from nowhere that is known: it stays one.
    """
    parts: list[dict[str, NDArray[np.generic]]] = []
    names = [f.name for f in fields(Program) if f.name != "labels"]
    begin = 0
    for count in _runs(tool):
        stop = begin + count
        pieces = trace_path(machine, axes[begin:stop], tolerance, float(tool[begin]), zero)
        row = pieces.row + begin
        keep = cut[row] | (pieces.part == 1.0)
        row, part = row[keep], pieces.part[keep]
        columns = {name: np.array(getattr(program, name)[row]) for name in names}
        inner = part < 1.0
        columns["p_work"][inner] = pieces.tip[keep][inner]
        columns["axis"][inner] = pieces.axis[keep][inner]
        total = np.zeros(stop)
        before = np.vstack([columns["p_work"][:1], columns["p_work"][:-1]])
        np.add.at(total, row, np.linalg.norm(columns["p_work"] - before, axis=1))
        # a full turn ends where it began: what counts is the way along the pieces, or the turn of the axis at the tip
        turned = np.zeros(stop)
        old = np.vstack([columns["axis"][:1], columns["axis"][:-1]])
        np.add.at(turned, row, 2.0 * np.arcsin(np.minimum(0.5 * np.linalg.norm(columns["axis"] - old, axis=1), 1.0)))
        way = np.where(total > 1e-9, total, turned)[row]
        timed = (columns["motion"] == WORK_LINE) & (time[row] > 0.0) & (way > 1e-12)
        columns["feed"][timed] = way[timed] / time[row][timed]
        parts.append(columns)
        begin = stop
    joined = {name: np.concatenate([p[name] for p in parts]) for name in names}
    return Program(**joined, labels=program.labels)


def _runs(values: Floats) -> list[int]:
    """Lengths of the runs of equal values."""
    ends = np.flatnonzero(np.append(np.diff(values) != 0.0, True)) + 1
    return [int(x) for x in np.diff(ends, prepend=0)]
