"""Heidenhain conversational programs to Commands: the part of the language that CAM systems and shop programs use.

Notation: a block is a line; X Y Z [mm], A B C [rad].

| subject | blocks |
|---|---|
| motions (:mod:`~chipload.program.heidenhain.motions`) | L, LN, LP, CC, C, CR, CT, CP, RND, CHF, RL, RR |
| approach (:mod:`~chipload.program.heidenhain.approaches`) | APPR and DEP with LT, LN, CT, LCT |
| planes (:mod:`~chipload.program.heidenhain.tilted_plane`) | PLANE SPATIAL, EULER, VECTOR, RELATIV, RESET; cycle 19 |
| cycles (:mod:`~chipload.program.heidenhain.cycles`) | 1, 7, 9, 200 to 209, 220, 221, 240, 262; PATTERN DEF |
| switches (:mod:`~chipload.program.heidenhain.switches`) | TOOL DEF, TOOL CALL, M functions, FUNCTION TCPM |
| order (:mod:`~chipload.program.heidenhain.flow`) | labels, REP, FN, Q parameters, CALL PGM of a file beside it |

Programs in DIN/ISO are taken as conversational ones (:mod:`~chipload.program.heidenhain.din_iso`).

Everything else in a block is left out, with a finding on its line that leaves the program unproven. A block whose words
are wrong is refused.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from chipload.errors import Finding, InputError
from chipload.files import decode_text, read_regular
from chipload.program.commands import Commands, commands_from_rows
from chipload.program.heidenhain import motions, switches, words
from chipload.program.heidenhain.cycles import Cycles, call_positions
from chipload.program.heidenhain.din_iso import AND, conversational
from chipload.program.heidenhain.flow import HeidenhainFlow, Text, sections_behind, text_of
from chipload.program.heidenhain.formula import NotKnownError, q_number
from chipload.program.heidenhain.q_cycles import MAX
from chipload.program.heidenhain.state import KEPT, ConversationalState
from chipload.program.path_mode import PathControl
from chipload.program.reconcile import StatedDiameter, unit_mm
from chipload.program.swivel import Swivel

__all__ = ["KEPT", "read_heidenhain", "read_heidenhain_file", "tool_definitions"]

#: largest text [characters], blocks that may be carried out
LONGEST_TEXT, MOST_BLOCKS = 100_000_000, 2_000_000
#: blocks, comments alone, that may stand between a motion and what rounds its end
AHEAD = 20
_MOTIONS = {
    "L": motions.line,
    "LN": motions.line_with_normal,
    "LP": motions.polar_line,
    "C": motions.arc,
    "CR": motions.arc_of_radius,
    "CT": motions.tangent_arc,
    "CP": motions.helix,
    "CC": motions.pole,
    "APPR": motions.approach,
}
#: blocks that move nothing
_UNUSED = ("BLK FORM", "TOOL TAB", "SECTION", "SEL ", "VC TABLE")
_DEFINED = re.compile(r"^\d*\s*TOOL DEF\s*(\d{1,9})\b[^;]*?\bR\s*\+?(\d+\.?\d*|\.\d+)")


def read_heidenhain(
    text: str,
    *,
    name: str = "program",
    folder: Path | None = None,
    parameters: Mapping[int, float] | None = None,
    radii: Mapping[int, float] | None = None,
    feed: float | None = None,
    swivel: Swivel | None = None,
    lenient: bool = False,
) -> tuple[Commands, tuple[Finding, ...]]:
    r"""The motions of a conversational program, and the findings.

    Parameters
    ----------
    text : of the program
    name : for messages
    folder : the one folder in which called programs are sought; None: no files
    parameters : Q parameters by number that are known before: what SYSREAD would read too
    radii : [mm] of the tools, where TOOL DEF states none
    feed : [mm/s] of cuts before the program states one; None: such a cut is refused
    swivel : the machine, for tilted working planes; None: they are not read
    lenient : a block that cannot be read is a finding; else it refuses the text

    Raises
    ------
    InputError
        A block cannot be read; the message gives the line.

    >>> commands, _ = read_heidenhain("BEGIN PGM A MM\nL X+1 Y+2 Z+3 FMAX\nL IX+4 F60\nEND PGM A MM")
    >>> commands.position[:, :3].tolist(), float(commands.feed[-1])
    ([[1.0, 2.0, 3.0], [5.0, 2.0, 3.0]], 1.0)
    """
    if len(text) > LONGEST_TEXT:
        raise InputError(f"{name}: {len(text)} characters: must be at most {LONGEST_TEXT}")
    state = ConversationalState(name, parameters or {}, radii or {}, feed, swivel)
    run = _Blocks(state, HeidenhainFlow(state, text_of(text), folder), lenient)
    try:
        run.go()
        state.end_contour()
    except InputError as err:
        raise InputError(f"{name}: line {state.line}: {err}") from None
    commands = commands_from_rows(state.rows, state.frames, state.labels)
    if state.unplaced:
        mode = np.array(commands.path_mode)
        mode[state.unplaced, 0] = PathControl.UNPLACED
        commands = replace(commands, path_mode=mode)
    return commands, tuple(state.findings)


def read_heidenhain_file(path: str | Path, **options: object) -> tuple[Commands, tuple[Finding, ...]]:
    """As :func:`read_heidenhain`, of a file; the programs that it calls lie beside it."""
    path = Path(path)
    given = {"name": path.name, "folder": path.parent, **options}
    return read_heidenhain(heidenhain_text(path), **given)  # type: ignore[arg-type]


def heidenhain_text(path: Path) -> str:
    """The text of a program's file."""
    return decode_text(read_regular(path, path.name, LONGEST_TEXT))


def tool_definitions(text: str) -> dict[int, StatedDiameter]:
    r"""What TOOL DEF states about the diameter of each tool; a radius of 0 states none.

    >>> tool_definitions("BEGIN PGM A MM\nTOOL DEF 5 L+30 R+2")[5].diameter
    4.0
    """
    mm = unit_mm(text)
    out: dict[int, StatedDiameter] = {}
    for line, raw in enumerate(conversational(text).splitlines(), start=1):
        found = _DEFINED.match(raw.upper())
        if found is not None and float(found[2]) > 0.0:
            diameter = 2.0 * float(found[2]) * mm
            out.setdefault(int(found[1]), StatedDiameter(diameter, "TOOL DEF", line))
    return out


class _Blocks:
    """Carries blocks out, one after another."""

    def __init__(self, state: ConversationalState, flow: HeidenhainFlow, lenient: bool) -> None:
        self.lenient = lenient
        self.s, self.flow = state, flow
        self.cycles, self.tools = Cycles(state), switches.Tools()

    def go(self) -> None:
        """Carry out blocks until the program ends."""
        at, main = 0, self.flow.text
        reached = bytearray(len(main.blocks))
        for _ in range(MOST_BLOCKS):
            blocks = self.flow.text.blocks
            if at >= len(blocks):
                self.s.unproven("heidenhain-no-end", "the text does not end with END PGM: it may be truncated")
                back = self.flow.end()
                if back is None:
                    return
                at = back
                continue
            if not self.flow.calls or self.flow.calls[0][0] is self.flow.text:
                self.s.line = at + 1
            if self.flow.text is main:
                reached[at] = 1
            last, at = at, self._next(blocks[at], at)
            if self.s.ended:
                if self.flow.text is main:
                    self._note_behind(main, reached, last)
                return
        raise InputError(f"more than {MOST_BLOCKS} blocks are carried out: the program does not seem to end")

    def _note_behind(self, main: Text, reached: bytearray, end: int) -> None:
        """Report motions behind the end that nothing carries out."""
        for first, last, called in sections_behind(main, reached, end):
            self.s.line = first
            place = f"lines {first} to {last}" if last > first else f"line {first}"
            if called:
                self.s.note("nc-not-called", f"{place}: a subprogram that nothing calls: it is not carried out")
            else:
                self.s.unproven(
                    "nc-behind-end",
                    f"{place}: what stands behind the end of the program is not carried out: give another program a "
                    "file of its own",
                )

    def _next(self, block: str, at: int) -> int:
        """Carry out a block; returns the next one's index."""
        blocks = self.flow.text.blocks
        following = next((b for b in blocks[at + 1 : at + 1 + AHEAD] if b), "")
        self.s.before_corner = following.startswith(("RND", "CHF"))
        if not block:
            return at + 1
        for word, step in (
            ("LBL", self.flow.label), ("CALL LBL", self.flow.call), ("CALL PGM", self.flow.call_program),
        ):  # fmt: skip
            if block.startswith(word):
                return self._step(step, block, at)
        if re.match(r"FN\s*\d+", block):
            try:
                return self.flow.function(block, at)
            except InputError as err:
                if not (self.lenient or isinstance(err, NotKnownError)):
                    raise
                jump = "jump not taken" if "GOTO" in block else "left out"
                self.s.unproven("heidenhain-jump", f"{err} [{jump}: {block[:60]}]")
                return at + 1
        if re.match(r"END PGM\b|END\b", block):
            back = self.flow.end()
            self.s.ended = back is None
            return at if back is None else back
        try:
            for part in block.split(AND):
                self._carry_out(part)
        except InputError as err:
            if not (self.lenient or isinstance(err, NotKnownError)):
                raise
            self.s.unproven("heidenhain-left-out", f"{err} [left out: {block[:60]}]")
            self.s.unknown |= {"XYZ".index(letter) for letter in re.findall(r"[XYZ]", block)}
        return at + 1

    def _step(self, step: Callable[[str, int], int], block: str, at: int) -> int:
        """Index of the block that follows a label or a call; one that cannot be read is left out where ``lenient``."""
        try:
            return step(block, at)
        except InputError as err:
            if not self.lenient:
                raise
            self.s.unproven("heidenhain-left-out", f"{err} [left out: {block[:60]}]")
            return at + 1

    def _carry_out(self, block: str) -> None:
        s, word = self.s, block.split(maxsplit=1)[0]
        assigned = re.match(r"(Q[LR]?)\s*(\d+)\s*=\s*(.*)", block)
        if assigned:
            self._assign(q_number(assigned[1], assigned[2]), assigned[3].strip())
        elif word == "BEGIN":
            switches.program_word(s, block)
        elif block.startswith(("TOOL DEF", "TOOL CALL")):
            self.tools.read(s, block)
        elif re.match(r"CYCLE? DEF\b", block):
            self.cycles.define(block)
        elif block.startswith("TRANS DATUM"):
            self.cycles.shift_datum(block)
        elif block.startswith("PATTERN DEF"):
            self.cycles.define_pattern(block)
        elif block.startswith("CYCL CALL"):
            self._call_cycle(block[9:].strip())
        elif word in _MOTIONS:
            text = block[len(word) :]
            _MOTIONS[word](s, text)
            self._cycle_here(text, word)
        elif word == "STOP":
            s.note("nc-stop", "M0: the program stops until it is started again")
            switches.functions(s, block)
        elif re.match(r"M\s*\d", block):
            text = block
            (motions.line if words.RETRACT.search(block) else switches.functions)(s, text)
            self._cycle_here(text, word)
        elif word.startswith("PLANE"):
            switches.plane(s, block)
        elif word in ("RND", "CHF"):
            motions.corner(s, block)
        elif word == "DEP":
            motions.departure(s, block)
        elif block.startswith(_UNUSED) or (word == "FUNCTION" and switches.function_word(s, block)):
            s.note("heidenhain-unused", block[:100])
        elif word == "*":
            self._label(block)
        else:
            s.unproven("heidenhain-unread", f"{block[:60]!r}: is not read: left out")

    def _label(self, block: str) -> None:
        """A structure block labels the motions that follow."""
        plain = block.lstrip("* -").strip()[:100]
        if plain and plain != self.s.labels[-1]:
            self.s.labels.append(plain)

    def _assign(self, key: int, formula: str) -> None:
        if formula in ("MAX", "FMAX"):
            self.s.q.set(key, MAX)
        else:
            self.s.q.assign(key, formula)

    def _cycle_here(self, text: str, word: str) -> None:
        """M99 calls the cycle once, M89 behind each motion until M99."""
        codes = switches.m_codes(text)
        if 89 in codes:
            self.cycles.modal = True
        moved = word in ("L", "LN", "LP", "C", "CR", "CT", "CP") and words.AXIS.search(text) is not None
        if 99 in codes or (self.cycles.modal and moved):
            self.cycles.call()
        if 99 in codes:
            self.cycles.modal = False

    def _call_cycle(self, text: str) -> None:
        s = self.s
        if text.startswith("PAT"):
            self.cycles.call_pattern(text[3:])
            return
        if text.startswith("POS"):
            s.feed_of(text)
            end, _ = s.ends(text[3:])
            if not s.left_out:
                call_positions(s, end)
            self.cycles.call()
            return
        switches.act_before(s, switches.m_codes(text))
        s.feed_of(text)
        self.cycles.call()
        switches.act_after(s, switches.m_codes(text))
