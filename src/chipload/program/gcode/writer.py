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

from collections.abc import Sequence
from dataclasses import dataclass

from chipload.errors import InputError
from chipload.machine.machine import Machine
from chipload.program.commands import Commands
from chipload.program.control import control_named
from chipload.program.gcode.blocks import Blocks, comment, decimal
from chipload.program.program import Program
from chipload.program.release import Release
from chipload.program.to_axes import to_axes


@dataclass(frozen=True)
class Repeat:
    """A program that is carried out ``count`` times, the k-th time with a rotary axis offset by k turn / count.

    Parameters
    ----------
    letter : of the axis
    count : at least 1
    turn_deg : the whole turn with its sign, as 360 or -360
    """

    letter: str
    count: int
    turn_deg: float


def write_gcode(
    program: Program,
    machine: Machine,
    *,
    title: str,
    release: Release,
    comments: Sequence[str] = (),
    number: int = 1,
    line_step: int = 0,
    repeat: Repeat | None = None,
) -> str:
    """The text of a program for a machine: :func:`~chipload.program.to_axes.to_axes`, then :func:`write_commands`.

    Raises
    ------
    InputError
        As both.
    """
    commands, _ = to_axes(program, machine)
    return write_commands(
        commands, machine, title=title, release=release, comments=comments, number=number, line_step=line_step,
        repeat=repeat,
    )  # fmt: skip


def write_commands(
    commands: Commands,
    machine: Machine,
    *,
    title: str,
    release: Release,
    comments: Sequence[str] = (),
    number: int = 1,
    line_step: int = 0,
    words: Sequence[tuple[int, str]] = (),
    repeat: Repeat | None = None,
) -> str:
    """The text of commands for the controller of ``machine``.

    Parameters
    ----------
    commands : they and every tool begin with a rapid; arcs of at most one turn
    title : what the program is, in a comment
    release : whether an independent simulation has verified the program; stated in the first block
    comments : lines for the reader at the machine
    number : O number of a Fanuc-like program, 1 to 9999
    line_step : step of N words; 0 writes none
    words : (line, block) in rising lines: blocks that stand before the first motion of that line of the source, or
        of a later one; those that are no comment are written as they are
    repeat : the program at other positions of a rotary axis as well, in a loop; None: once

    Raises
    ------
    InputError
        A tool does not begin with a rapid, a feed rounds to 0, the number is out of range, the controller has no word
        for tool centre point control; a program of several tools is to be repeated.
    """
    fanuc = control_named(machine.dialect).text.program_number
    if not 1 <= number <= 9999:
        raise InputError(f"program number = {number}: must be from 1 to 9999")
    status = f"chipload: {release.text}" if release.verified else release.text
    head = [f"O{number:04d} {comment(status, fanuc)}" if fanuc else comment(status, fanuc)]
    head += [comment(text, fanuc) for text in (title, *comments)]
    blocks = [*_modes(machine), *Blocks(commands, machine, words).text()]
    if repeat is not None:
        blocks = _repeat_blocks(blocks, repeat, fanuc)
    blocks += ["M5", "M30" if fanuc else "M2"]
    if line_step > 0:
        blocks = [x if x.startswith("(") else f"N{line_step * (k + 1)} {x}" for k, x in enumerate(blocks)]
    lines = ["%", *head, *blocks, "%"] if fanuc else [*head, *blocks]
    return "\n".join(lines) + "\n"


def _repeat_blocks(blocks: list[str], repeat: Repeat, fanuc: bool) -> list[str]:
    """The blocks from the first rapid on in a loop, each time with another work offset of the rotary axis."""
    changes = sum(" M6" in block for block in blocks)
    if changes > 1:
        raise InputError(f"repeat: the program changes tools {changes} times: must be of one tool")
    first = next(k for k, block in enumerate(blocks) if block.startswith("G0 "))
    turn, count = decimal(repeat.turn_deg, 9, fanuc), repeat.count
    axis = repeat.letter
    if fanuc:
        head = ["#100=0", f"WHILE [#100 LT {count}] DO1", f"G52 {axis}[#100*{turn}/{count}]"]
        tail = ["#100=#100+1", "END1", f"G52 {axis}0."]
    else:
        head = ["#<turn> = 0", f"o100 repeat [{count}]", f"G52 {axis}[#<turn> * {turn} / {count}]"]
        tail = ["#<turn> = [#<turn> + 1]", "o100 endrepeat", f"G52 {axis}0"]
    return [*blocks[:first], *head, *blocks[first:], *tail]


def _modes(machine: Machine) -> list[str]:
    """Every mode that the motions rely on, set and not assumed."""
    path = "G61" if machine.corner_tolerance == 0.0 else "G64"
    if control_named(machine.dialect).text.program_number:
        return ["G21", "G17 G90 G94 G40 G49 G80", f"G54 {path}"]
    if path == "G64":
        path += f" P{decimal(machine.corner_tolerance, 6)}"
    return ["G17 G21 G90 G91.1 G94 G97 G40 G49 G80 G54", path]
