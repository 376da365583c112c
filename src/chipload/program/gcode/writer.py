"""A program as RS-274 text, for LinuxCNC and for controllers that read like a Fanuc.

Notation: q [mm] the position as written, rounded to the machine's decimals; one unit is the last of them. An arc is
written by its end q and by I, J (K) from its rounded start to its centre; of the nine pairs about the true one that is
taken whose two radii agree best, so that a controller that compares them (LinuxCNC: 0.0127 mm and 0.1 %) accepts the
arc. A motion that rounds to nothing is left out. An arc that rounds to a chord within half a unit of it is a line: it
cannot become a full turn. LinuxCNC refuses arcs with a radius below 0.00127 mm: ``to_axes`` makes them chords. Cutting
rows on which a rotary axis moves are written with their time (G93), those under tool centre point control with F.

First comes whether the program was verified. The same program gives the same bytes.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chipload.errors import InputError
from chipload.machine.machine import Machine
from chipload.program.commands import ARC, DWELL, LETTERS, LINE, PLANE_AXES, RAPID, XY, Commands, arc_sweeps, extents
from chipload.program.program import Program
from chipload.program.to_axes import to_axes
from chipload.units import mm_min_from_mm_s, rpm_from_rad_s

Floats = NDArray[np.float64]

VERIFIED = "chipload: verified by independent simulation"
NOT_VERIFIED = "NOT VERIFIED: no simulation has checked this program"
#: comments that LinuxCNC would act upon
_ACTIVE = re.compile(r"^\s*(abort|axis|debug|log|logappend|logclose|logopen|msg|print|probeclose|probeopen|py)\b", re.I)
_LONGEST_COMMENT = 120


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
    """The text of a program for a machine: :func:`~chipload.program.to_axes.to_axes`, then :func:`write_commands`.

    Raises
    ------
    InputError
        As both.
    """
    commands, _ = to_axes(program, machine)
    return write_commands(
        commands, machine, title=title, verified=verified, comments=comments, number=number, line_step=line_step
    )


def write_commands(
    commands: Commands,
    machine: Machine,
    *,
    title: str,
    verified: bool,
    comments: Sequence[str] = (),
    number: int = 1,
    line_step: int = 0,
    words: Sequence[tuple[int, str]] = (),
) -> str:
    """The text of commands for the controller of ``machine``.

    Parameters
    ----------
    commands : they and every tool begin with a rapid; arcs of at most one turn
    title : what the program is, in a comment
    verified : whether an independent simulation has found the program good; said in the first block
    comments : lines for the reader at the machine
    number : O number of a Fanuc-like program, 1 to 9999
    line_step : step of N words; 0 writes none
    words : (line, block) in rising lines: blocks that stand before the first motion of that line of the source, or
        of a later one; those that are no comment are written as they are

    Raises
    ------
    InputError
        A tool does not begin with a rapid, a feed rounds to 0, the number is out of range, the controller has no word
        for tool centre point control.
    """
    fanuc = machine.dialect == "fanuc"
    if not 1 <= number <= 9999:
        raise InputError(f"program number = {number}: must be from 1 to 9999")
    said = VERIFIED if verified else NOT_VERIFIED
    head = [f"O{number:04d} {_comment(said, fanuc)}" if fanuc else _comment(said, fanuc)]
    head += [_comment(text, fanuc) for text in (title, *comments)]
    blocks = [*_modes(machine), *_blocks(commands, machine, words)]
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


@dataclass(frozen=True, eq=False)
class _Written:
    """Numbers as they are written: positions (n, 9) [mm, deg], whether rows stay arcs, the two centre words [mm]."""

    q: Floats
    arc: NDArray[np.bool_]
    ij: Floats


def _written(commands: Commands, decimals: int) -> _Written:
    unit = 10.0**-decimals
    shift = np.array([f.shift for f in commands.frames]).reshape(-1, 9)[commands.frame]
    exact = commands.position + shift
    exact[:, 3:6] = np.degrees(exact[:, 3:6])
    q = np.round(exact, decimals) + 0.0
    pair = np.array(PLANE_AXES)[commands.plane][:, :2]
    centre = commands.centre + np.take_along_axis(shift, pair, axis=1)
    sweep = arc_sweeps(commands)
    arc = (commands.motion == ARC) & (sweep != 0.0)
    # all but a full turn, its ends rounded together: a full turn
    for k in np.flatnonzero(arc & (np.abs(sweep) > math.pi)):
        if np.hypot(*(q[k] - q[k - 1])[pair[k]]) < 2.0 * unit:
            q[k, pair[k]] = q[k - 1, pair[k]]
    q0 = np.take_along_axis(np.vstack([q[:1], q[:-1]]), pair, axis=1)
    chord = np.take_along_axis(q, pair, axis=1) - q0
    from_start = centre - q0
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
    return _Written(q, arc & ~flat & (r > 0.0), ij)


def _blocks(commands: Commands, machine: Machine, kept: Sequence[tuple[int, str]]) -> Iterator[str]:
    """The blocks of the motions, modal words left out where nothing changes."""
    fanuc = machine.dialect == "fanuc"
    d = machine.decimals
    written = _written(commands, d)
    columns = [LETTERS.index(x) for x in LETTERS if x in machine.chain.letters]
    linear = [c for c in columns if c < 2] + [c for c in columns if c >= 3]
    ends = [[_decimal(x, d, fanuc) for x in row] for row in written.q.tolist()]
    centres = [[_decimal(x, d, fanuc) for x in row] for row in written.ij.tolist()]
    minutes = _inverse_minutes(commands)
    motion, feeds, planes = commands.motion.tolist(), commands.feed.tolist(), commands.plane.tolist()
    tools, spindles, labels = commands.tool.tolist(), commands.spindle.tolist(), commands.label.tolist()
    numbers = [f.number for f in commands.frames]
    at: list[str] = [""] * 9
    mode, feed, label, plane, inverse = "", "", -1, XY, False
    tool: int | None = None
    number, spindle, tcp = 1, 0.0, False
    lines = commands.line.tolist()
    waiting = list(reversed(kept))
    for k in range(len(motion)):
        fresh = tools[k] != tool
        if labels[k] != label:
            label = labels[k]
            yield _comment(commands.labels[label], fanuc)
        if fresh:
            if motion[k] != RAPID:
                raise InputError(f"program row {k}: tool {tools[k]} begins with a cutting motion: begin with a rapid")
            if spindle != 0.0:
                yield "M5"
                spindle = 0.0
            if tcp:
                yield _tcp(machine, False, 0, k)
                tcp = False
            tool = tools[k]
            if tools[k] > 0:
                yield f"T{tool} M6"
            if tools[k] > 0 and not fanuc:
                yield f"G43 H{tool}"
            at = [""] * 9
        if numbers[commands.frame[k]] != number:
            number = numbers[commands.frame[k]]
            yield _offset_word(number, k)
            at = [""] * 9
        if spindles[k] != spindle:
            spindle = spindles[k]
            rpm = _decimal(abs(rpm_from_rad_s(spindle)), 0 if fanuc else 3)
            yield "M5" if spindle == 0.0 else f"S{rpm} M{3 if spindle > 0.0 else 4}"
        if bool(commands.tcp[k]) != tcp:
            tcp = not tcp
            yield _tcp(machine, tcp, tools[k], k)
            at = [""] * 9
        while waiting and lines[k] and waiting[-1][0] <= lines[k]:
            yield _kept(waiting.pop()[1], fanuc)
        if motion[k] == DWELL:
            yield f"G4 P{max(1, round(1000.0 * feeds[k]))}" if fanuc else f"G4 P{_decimal(feeds[k], 6)}"
            continue
        to = ends[k]
        words = [f"{LETTERS[c]}{to[c]}" for c in columns if to[c] != at[c]]
        if fresh:
            # where the machine stands is not known: over the start first, then down
            mode = "G0"
            yield " ".join([mode, *(f"{LETTERS[c]}{to[c]}" for c in linear)])
            yield f"G43 H{tool} Z{to[2]}" if fanuc and tools[k] > 0 and not tcp else f"Z{to[2]}"
            at = to
            continue
        if written.arc[k]:
            turn = "G3" if commands.turns[k] > 0 else "G2"
            first, second, _ = PLANE_AXES[planes[k]]
            pair = sorted((first, second))
            words = [f"{LETTERS[c]}{to[c]}" for c in columns if to[c] != at[c] or c in pair]
            offsets = dict(zip((first, second), centres[k], strict=True))
            words += [f"{'IJK'[c]}{offsets[c]}" for c in pair]
            if planes[k] != plane:
                plane = planes[k]
                words.insert(0, ("G17", "G18", "G19")[plane])
        elif not words:
            continue
        else:
            turn = "G0" if motion[k] == RAPID else "G1"
        at = to
        if turn != "G0" and (minutes[k] > 0.0) != inverse:
            inverse = not inverse
            words.insert(0, "G93" if inverse else "G94")
            feed = ""
        if turn != mode:
            words.insert(0, turn)
            mode = turn
        if turn != "G0":
            text = _rounded(1.0 / minutes[k], k, fanuc) if inverse else _feed(feeds[k], k, fanuc)
            if text != feed or inverse:
                words.append(f"F{text}")
                feed = text
        yield " ".join(words)
    for _, text in reversed(waiting):
        yield _kept(text, fanuc)
    if inverse:
        yield "G94"
    if tcp:
        yield _tcp(machine, False, 0, len(motion))


def _kept(text: str, fanuc: bool) -> str:
    return _comment(text[1:-1], fanuc) if text.startswith("(") else text


def _inverse_minutes(commands: Commands) -> list[float]:
    """Minutes of each cutting row on which a rotary axis moves under no tool centre point control, 0 for all else."""
    rotary = commands.position[:, 3:6]
    moved = np.abs(np.diff(rotary, axis=0, prepend=rotary[:1])).max(axis=1, initial=0.0) > 0.0
    rows = moved & np.isin(commands.motion, (LINE, ARC)) & ~commands.tcp & (commands.feed > 0.0)
    time = extents(commands) / np.where(rows, commands.feed, 1.0)
    return [float(x) for x in np.where(rows, time / 60.0, 0.0)]


def _offset_word(number: int, row: int) -> str:
    if number < 1:
        raise InputError(f"program row {row}: is in the machine's own coordinates: write it in those of a work offset")
    return f"G{53 + number}" if number <= 6 else f"G59.{number - 6}"


def _tcp(machine: Machine, on: bool, tool: int, row: int) -> str:
    """The words that begin and end tool centre point control."""
    words = machine.tcp_words
    if words is None:
        raise InputError(f"program row {row}: machine {machine.name} has no tool centre point control: give its axes")
    return words[0].replace("{tool}", str(tool)) if on else words[1]


def _feed(feed: float, row: int, fanuc: bool) -> str:
    """Feed word in mm/min."""
    return _rounded(mm_min_from_mm_s(feed), row, fanuc)


def _rounded(per_min: float, row: int, fanuc: bool) -> str:
    text = _decimal(per_min, 3 if per_min >= 1.0 else 6, fanuc)
    if float(text) == 0.0:
        raise InputError(f"program row {row}: feed {per_min:g} mm/min rounds to 0: raise it")
    return text
