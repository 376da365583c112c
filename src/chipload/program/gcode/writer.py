"""A program as RS-274 text, for LinuxCNC and for controllers that read like a Fanuc.

Notation: q [mm] the position as written, rounded to the machine's decimals; one unit is the last of them. An arc is
written by its end q and by I, J from its rounded start to its centre; of the nine (I, J) about the true one that is
taken whose two radii agree best, so that a controller that compares them (LinuxCNC: 0.0127 mm and 0.1 %) accepts the
arc. A motion that rounds to nothing is left out. An arc that rounds to a chord within half a unit of it is a line: it
cannot become a full turn. LinuxCNC refuses arcs with a radius below 0.00127 mm: they are written as chords of 45 deg,
which leave them by at most 0.0001 mm.

First comes whether the program was verified. The same program gives the same bytes.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from chipload.errors import InputError
from chipload.machine.machine import Machine
from chipload.program.motions import is_arc, radii, straightened, sweeps
from chipload.program.program import ARC_CCW, DWELL, RAPID, Program
from chipload.units import mm_min_from_mm_s, rpm_from_rad_s

Floats = NDArray[np.float64]

VERIFIED = "chipload: verified by independent simulation"
NOT_VERIFIED = "NOT VERIFIED: no simulation has checked this program"
#: comments that LinuxCNC would act upon
_ACTIVE = re.compile(r"^\s*(abort|axis|debug|log|logappend|logclose|logopen|msg|print|probeclose|probeopen|py)\b", re.I)
_LONGEST_COMMENT = 120
#: arcs of a smaller radius [mm] are written as chords
LEAST_RADIUS = 0.0013


def write_gcode(
    program: Program,
    machine: Machine,
    *,
    title: str,
    verified: bool,
    comments: Sequence[str] = (),
    number: int = 1,
    line_step: int = 0,
) -> str:
    """The text of a program for the controller of ``machine``.

    Parameters
    ----------
    program : axis along +Z throughout; it and every tool begin with a rapid
    title : what the program is, in a comment
    verified : whether an independent simulation has found the program good; said in the first block
    comments : lines for the reader at the machine
    number : O number of a Fanuc-like program, 1 to 9999
    line_step : step of N words; 0 writes none

    Raises
    ------
    InputError
        The axis is tilted, a tool does not begin with a rapid, a feed rounds to 0, the number is out of range.
    """
    fanuc = machine.dialect == "fanuc"
    if not 1 <= number <= 9999:
        raise InputError(f"program number = {number}: must be from 1 to 9999")
    said = VERIFIED if verified else NOT_VERIFIED
    head = [f"O{number:04d} {_comment(said, fanuc)}" if fanuc else _comment(said, fanuc)]
    head += [_comment(text, fanuc) for text in (title, *comments)]
    small = radii(program) < LEAST_RADIUS
    program = straightened(program, np.where(small, 0.25 * math.pi, math.inf))
    blocks = [*_modes(machine), *_blocks(program, machine)]
    blocks += ["M5", "M30" if fanuc else "M2"]
    if line_step > 0:
        blocks = [x if x.startswith("(") else f"N{line_step * (k + 1)} {x}" for k, x in enumerate(blocks)]
    lines = ["%", *head, *blocks, "%"] if fanuc else [*head, *blocks]
    return "\n".join(lines) + "\n"


def _modes(machine: Machine) -> list[str]:
    """Every mode that the motions rely on, set and not assumed."""
    path = "G61" if machine.corner_tolerance == 0.0 else "G64"
    if machine.dialect == "fanuc":
        return ["G21", "G17 G90 G94 G40 G49 G80", f"G54 {path}"]
    if path == "G64":
        path += f" P{_decimal(machine.corner_tolerance, 6)}"
    return ["G17 G21 G90 G91.1 G94 G97 G40 G49 G80 G54", path]


def _comment(text: str, fanuc: bool) -> str:
    """A comment that no controller acts upon, of printable ASCII."""
    plain = text.encode("ascii", "replace").decode("ascii")
    plain = re.sub(r"\s+", " ", plain).strip()
    plain = plain.translate(str.maketrans("()%;", "[]#,"))
    plain = "".join(c for c in plain if c.isprintable())[:_LONGEST_COMMENT]
    if _ACTIVE.match(plain):
        plain = f"- {plain}"
    return f"({plain.upper() if fanuc else plain})"


def _decimal(value: float, decimals: int, point: bool = False) -> str:
    """Shortest decimal of ``value`` rounded; never -0; with ``point`` there is always one."""
    whole, _, rest = f"{value:.{decimals}f}".partition(".")
    rest = rest.rstrip("0")
    if whole == "-0" and not rest:
        whole = "0"
    return f"{whole}.{rest}" if rest or point else whole


def _written(program: Program, decimals: int) -> tuple[Floats, NDArray[np.bool_], Floats]:
    """(n, 3) positions as written [mm], (n,) which rows stay arcs, (n, 2) their I and J [mm]."""
    unit = 10.0**-decimals
    q = np.round(program.p_work, decimals) + 0.0
    sweep = sweeps(program)
    arc = is_arc(program) & (sweep != 0.0)
    # all but a full turn, its ends rounded together: a full turn
    long = np.flatnonzero(arc & (np.abs(sweep) > math.pi))
    for k in long[np.hypot(*(q[long] - q[long - 1])[:, 0:2].T) < 2.0 * unit]:
        q[k, 0:2] = q[k - 1, 0:2]
    q0 = np.vstack([q[:1], q[:-1]])
    chord = q[:, 0:2] - q0[:, 0:2]
    from_start = program.centre[:, 0:2] - q0[:, 0:2]
    base = np.round(from_start / unit)
    near = np.array([[i, j] for i in (-1, 0, 1) for j in (-1, 0, 1)], dtype=np.float64)
    ij = (base[:, None, :] + near) * unit
    away = np.hypot(ij[..., 0] - chord[:, None, 0], ij[..., 1] - chord[:, None, 1])
    skew = np.abs(np.hypot(ij[..., 0], ij[..., 1]) - away)
    moved = np.linalg.norm(ij - from_start[:, None, :], axis=2)
    best = np.argmin(skew + 0.1 * moved, axis=1)
    ij = np.round(ij[np.arange(len(q)), best], decimals) + 0.0
    r = np.hypot(ij[:, 0], ij[:, 1])
    length = np.hypot(chord[:, 0], chord[:, 1])
    short = np.abs(sweep) < 0.5 * math.pi
    sagitta = length**2 / np.where(r > 0.0, 8.0 * r, 1.0)
    flat = short & ((sagitta < 0.5 * unit) | (length < 2.0 * unit))
    return q, arc & ~flat & (r > 0.0), ij


def _blocks(program: Program, machine: Machine) -> Iterator[str]:
    """The blocks of the motions, modal words left out where nothing changes."""
    fanuc = machine.dialect == "fanuc"
    d = machine.decimals
    q, arcs, ij = _written(program, d)
    tilted = np.flatnonzero((np.abs(program.axis[:, :2]).max(axis=1) > 1e-9) | (program.axis[:, 2] < 0.0))
    if len(tilted):
        raise InputError(f"program row {tilted[0]}: the axis is tilted: {machine.name} is written with three axes")
    ends = [[_decimal(x, d, fanuc) for x in row] for row in q.tolist()]
    centres = [[_decimal(x, d, fanuc) for x in row] for row in ij.tolist()]
    motion, feeds = program.motion.tolist(), program.feed.tolist()
    tools, spindles, labels = program.tool.tolist(), program.spindle.tolist(), program.label.tolist()
    at: list[str] = ["", "", ""]
    mode, feed, label = "", "", -1
    tool: int | None = None
    spindle = 0.0
    for k in range(len(motion)):
        fresh = tools[k] != tool
        if labels[k] != label:
            label = labels[k]
            yield _comment(program.labels[label], fanuc)
        if fresh:
            if motion[k] != RAPID:
                raise InputError(f"program row {k}: tool {tools[k]} begins with a cutting motion: begin with a rapid")
            if spindle != 0.0:
                yield "M5"
                spindle = 0.0
            tool = tools[k]
            yield f"T{tool} M6"
            if not fanuc:
                yield f"G43 H{tool}"
            at = ["", "", ""]
        if spindles[k] != spindle:
            spindle = spindles[k]
            rpm = _decimal(abs(rpm_from_rad_s(spindle)), 0 if fanuc else 3)
            yield "M5" if spindle == 0.0 else f"S{rpm} M{3 if spindle > 0.0 else 4}"
        if motion[k] == DWELL:
            yield f"G4 P{max(1, round(1000.0 * feeds[k]))}" if fanuc else f"G4 P{_decimal(feeds[k], 6)}"
            continue
        to = ends[k]
        words = [f"{a}{x}" for a, x, old in zip("XYZ", to, at, strict=True) if x != old]
        if fresh:
            # where the machine stands is not known: over the start first, then down
            mode = "G0"
            yield " ".join([mode, f"X{to[0]}", f"Y{to[1]}"])
            yield f"G43 H{tool} Z{to[2]}" if fanuc else f"Z{to[2]}"
            at = to
            continue
        if arcs[k]:
            turn = "G3" if motion[k] == ARC_CCW else "G2"
            words = [f"X{to[0]}", f"Y{to[1]}", *(w for w in words if w[0] == "Z")]
            words += [f"I{centres[k][0]}", f"J{centres[k][1]}"]
        elif not words:
            continue
        else:
            turn = "G0" if motion[k] == RAPID else "G1"
        at = to
        if turn != mode:
            words.insert(0, turn)
            mode = turn
        if turn != "G0":
            text = _feed(feeds[k], k, fanuc)
            if text != feed:
                words.append(f"F{text}")
                feed = text
        yield " ".join(words)


def _feed(feed: float, row: int, fanuc: bool) -> str:
    """Feed word in mm/min."""
    per_min = mm_min_from_mm_s(feed)
    text = _decimal(per_min, 3 if per_min >= 1.0 else 6, fanuc)
    if float(text) == 0.0:
        raise InputError(f"program row {row}: feed {per_min:g} mm/min rounds to 0: raise it")
    return text
