"""The blocks of commands, modal words left out where nothing changes.

Notation: a row of Commands gives none, one or several blocks: a change of tool, the spindle, a work offset, the motion.
Numbers are compared as they are written, so that what rounds to nothing is not there.
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
from chipload.program.commands import starts as starts_of
from chipload.program.control import control_named
from chipload.program.gcode.controller import LEAST_INVERSE
from chipload.units import mm_min_from_mm_s, rpm_from_rad_s

Floats = NDArray[np.float64]

#: comments that LinuxCNC would act upon
_ACTIVE = re.compile(r"^\s*(abort|axis|debug|log|logappend|logclose|logopen|msg|print|probeclose|probeopen|py)\b", re.I)
_LONGEST_COMMENT = 120
#: way of linear axes beside a turn that is left out where it would spoil the time of the turn [mm]
HELD_MM = 1e-3


def comment(text: str, fanuc: bool) -> str:
    """A comment that no controller acts upon, of printable ASCII."""
    plain = text.encode("ascii", "replace").decode("ascii")
    plain = re.sub(r"\s+", " ", plain).strip()
    plain = plain.translate(str.maketrans("()%;", "[]#,"))
    plain = "".join(c for c in plain if c.isprintable())[:_LONGEST_COMMENT]
    if _ACTIVE.match(plain):
        plain = f"- {plain}"
    return f"({plain.upper() if fanuc else plain})"


def decimal(value: float, decimals: int, point: bool = False) -> str:
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


def _write_blocks(commands: Commands, decimals: int) -> _Written:
    if any(f.tilt is not None for f in commands.frames):
        raise InputError("commands: rows in a tilted plane are not written: convert the program to rows of the axes")
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


class Blocks:
    """What the text has said so far, and the blocks that each row adds.

    Parameters
    ----------
    kept : (line, block) in rising lines, that stand before the first motion of that line or of a later one
    """

    def __init__(self, commands: Commands, machine: Machine, kept: Sequence[tuple[int, str]]) -> None:
        self.commands, self.machine = commands, machine
        self.fanuc, d = control_named(machine.dialect).text.program_number, machine.decimals
        self.columns = [LETTERS.index(x) for x in LETTERS if x in machine.chain.letters]
        done = _write_blocks(commands, d)
        self.arc = done.arc
        self.ends = [[decimal(x, d, self.fanuc) for x in row] for row in done.q.tolist()]
        self.centres = [[decimal(x, d, self.fanuc) for x in row] for row in done.ij.tolist()]
        self.feeds, self.minutes = _feeds(commands)
        self.waiting = list(reversed(kept))
        self.at = [""] * 9
        self.mode, self.feed, self.label, self.plane, self.inverse = "", "", -1, XY, False
        self.tool: int | None = None
        self.number, self.spindle, self.tcp = 1, 0.0, False

    def text(self) -> Iterator[str]:
        """All blocks."""
        for k in range(len(self.commands)):
            yield from self.row(k)
        for _, block in reversed(self.waiting):
            yield self._keep_block(block)
        if self.inverse:
            yield "G94"
        if self.tcp:
            yield self._tcp(False, len(self.commands))

    def row(self, k: int) -> Iterator[str]:
        """The blocks of row k."""
        c = self.commands
        fresh = int(c.tool[k]) != self.tool
        if c.label[k] != self.label:
            self.label = int(c.label[k])
            yield comment(c.labels[self.label], self.fanuc)
        if fresh:
            yield from self._change(k)
        yield from self._settings(k)
        while self.waiting and c.line[k] and self.waiting[-1][0] <= c.line[k]:
            yield self._keep_block(self.waiting.pop()[1])
        if c.motion[k] == DWELL:
            seconds = float(c.feed[k])
            yield f"G4 P{max(1, round(1000.0 * seconds))}" if self.fanuc else f"G4 P{decimal(seconds, 6)}"
        elif fresh:
            yield from self._approach(k)
        else:
            words = self._motion(k)
            if words:
                yield " ".join(words)

    def _change(self, k: int) -> Iterator[str]:
        """Another tool: spindle and tip control off, then the change; where the axes stand is not known after it."""
        tool = int(self.commands.tool[k])
        if self.commands.motion[k] != RAPID:
            raise InputError(f"program row {k}: tool {tool} begins with a cutting motion: begin with a rapid")
        if self.spindle != 0.0:
            yield "M5"
            self.spindle = 0.0
        if self.tcp:
            yield self._tcp(False, k)
        self.tool = tool
        if tool > 0:
            yield f"T{tool} M6"
        if tool > 0 and not self.fanuc:
            yield f"G43 H{tool}"
        self.at = [""] * 9

    def _settings(self, k: int) -> Iterator[str]:
        """Work offset, spindle, tip control."""
        c = self.commands
        number = c.frames[c.frame[k]].number
        if number != self.number:
            self.number = number
            yield _offset_word(number, k)
            self.at = [""] * 9
        if float(c.spindle[k]) != self.spindle:
            self.spindle = float(c.spindle[k])
            rpm = decimal(abs(rpm_from_rad_s(self.spindle)), 0 if self.fanuc else 3)
            yield "M5" if self.spindle == 0.0 else f"S{rpm} M{3 if self.spindle > 0.0 else 4}"
        if bool(c.tcp[k]) != self.tcp:
            yield self._tcp(not self.tcp, k)
            self.at = [""] * 9

    def _approach(self, k: int) -> Iterator[str]:
        """The first rapid of a tool: over the start first, then down."""
        to = self.ends[k]
        self.mode, self.at = "G0", to
        yield " ".join(["G0", *(f"{LETTERS[c]}{to[c]}" for c in self.columns if c != 2)])
        length = self.fanuc and self.commands.tool[k] > 0 and not self.tcp
        yield f"G43 H{self.tool} Z{to[2]}" if length else f"Z{to[2]}"

    def _motion(self, k: int) -> list[str]:
        """The words of a motion; none where it rounds to nothing."""
        c, to = self.commands, self.ends[k]
        if self.arc[k]:
            turn = "G3" if c.turns[k] > 0 else "G2"
            words = self._arc(k)
        else:
            turn = "G0" if c.motion[k] == RAPID else "G1"
            to = self._turn_end(k, to)
            words = [f"{LETTERS[x]}{to[x]}" for x in self.columns if to[x] != self.at[x]]
            if not words:
                return []
        self.at = to
        if turn != "G0" and (self.minutes[k] > 0.0) != self.inverse:
            self.inverse = not self.inverse
            words.insert(0, "G93" if self.inverse else "G94")
            self.feed = ""
        if turn != self.mode:
            words.insert(0, turn)
            self.mode = turn
        if turn != "G0":
            feed = self._feed_text(1.0 / self.minutes[k] if self.inverse else self.feeds[k], k)
            if feed != self.feed or self.inverse:
                words.append(f"F{feed}")
                self.feed = feed
        return words

    def _turn_end(self, k: int, to: list[str]) -> list[str]:
        """Return the end of a motion by inverse time, with linear axes that hardly move where they are.

        LinuxCNC counts the time along the linear axes and takes a feed of at least LEAST_INVERSE: a turn beside a way
        of nearly 0 would be far too fast. Where only the rotary axes move the time is theirs.
        """
        if self.minutes[k] <= 0.0 or self.commands.motion[k] == RAPID or not all(self.at[x] for x in self.columns):
            return to
        linear = [x for x in self.columns if LETTERS[x] not in "ABC"]
        way = math.hypot(*(float(to[x]) - float(self.at[x]) for x in linear))
        turns = any(to[x] != self.at[x] for x in self.columns if x not in linear)
        if not turns or not 0.0 < way <= HELD_MM or way > LEAST_INVERSE * self.minutes[k]:
            return to
        return [self.at[x] if x in linear else text for x, text in enumerate(to)]

    def _arc(self, k: int) -> list[str]:
        """End and centre of an arc, and its plane where that is another."""
        to, plane = self.ends[k], int(self.commands.plane[k])
        pair = PLANE_AXES[plane][:2]
        words = [f"{LETTERS[c]}{to[c]}" for c in self.columns if to[c] != self.at[c] or c in pair]
        offsets = dict(zip(pair, self.centres[k], strict=True))
        words += [f"{'IJK'[c]}{offsets[c]}" for c in sorted(pair)]
        if plane != self.plane:
            self.plane = plane
            words.insert(0, ("G17", "G18", "G19")[plane])
        return words

    def _keep_block(self, block: str) -> str:
        return comment(block[1:-1], self.fanuc) if block.startswith("(") else block

    def _tcp(self, on: bool, k: int) -> str:
        """The words that begin or end tool centre point control."""
        words, self.tcp = self.machine.tcp_words, on
        if words is None:
            name = self.machine.name
            raise InputError(f"program row {k}: machine {name} has no tool centre point control: give its axes")
        return words[0].replace("{tool}", str(self.tool)) if on else words[1]

    def _feed_text(self, per_min: float, k: int) -> str:
        text = decimal(per_min, 3 if per_min >= 1.0 else 6, self.fanuc)
        if float(text) == 0.0:
            raise InputError(f"program row {k}: feed {per_min:g} mm/min rounds to 0: raise it")
        return text


def _feeds(commands: Commands) -> tuple[list[float], list[float]]:
    """Feed of each row [mm/min], or [deg/min] where only rotary axes move; minutes of the rows that are written with
    their time, which are cuts on which a rotary axis moves under no tool centre point control, 0 for all others.
    """
    moved = np.abs(commands.position - starts_of(commands)) > 0.0
    rotary = moved[:, 3:6].any(axis=1)
    only = rotary & ~moved[:, :3].any(axis=1) & ~moved[:, 6:].any(axis=1)
    feeds = np.where(only, np.degrees(60.0 * commands.feed), mm_min_from_mm_s(1.0) * commands.feed)
    rows = rotary & np.isin(commands.motion, (LINE, ARC)) & ~commands.tcp & (commands.feed > 0.0)
    time = extents(commands) / np.where(rows, commands.feed, 1.0)
    return feeds.tolist(), np.where(rows, time / 60.0, 0.0).tolist()


def _offset_word(number: int, row: int) -> str:
    if number < 1:
        raise InputError(f"program row {row}: is in the machine's own coordinates: write it in those of a work offset")
    return f"G{53 + number}" if number <= 6 else f"G59.{number - 6}"
