"""The Sinumerik dialect, where it differs from LinuxCNC's.

Notation: ``X=10``, ``X=IC(5)`` and ``I=AC(3)`` give values; ``CR=`` the radius of an arc, ``TURN=`` its whole turns;
``R1=..`` sets a parameter, stored as #1. TRAORI begins tip control and TRAFOOF ends it. G70 and G700 are inches, G71
and G710 mm.

CYCLE81 to CYCLE89, with MCALL too, are carried out (:mod:`~chipload.program.gcode.sinumerik_cycles`).

TRANS, ATRANS, ROT and AROT about Z are carried out (:mod:`~chipload.program.gcode.frames`), MIRROR and SCALE with their
additive forms (:mod:`~chipload.program.gcode.coordinates`), and CYCLE800
(:mod:`~chipload.program.gcode.sinumerik_swivel`).

Points by a pole or an angle and arcs by three points are in :mod:`~chipload.program.gcode.sinumerik_points`, patterns
of holes in :mod:`~chipload.program.gcode.sinumerik_patterns`, subprograms in
:mod:`~chipload.program.gcode.sinumerik_calls`, jumps and loops in :mod:`~chipload.program.gcode.sinumerik_flow`. Left
out, so that the result is unproven: motions in coordinates that change within mirrored or scaled ones, tool vectors (A3
B3 C3), cycles that are not drilling, splines, values of names that nothing defines. Noted and left out:
what does not concern the path. G331 is read as G33, G332 as G33 with the spindle reversed.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING

from chipload.errors import InputError
from chipload.program.corners import Corner
from chipload.program.gcode.controller import Controller
from chipload.program.gcode.coordinates import factor_axes, words_of_arcs
from chipload.program.gcode.dialect import NOTED, Dialect, NotReadError, go_on, leave_out, lenient
from chipload.program.gcode.expression import integer_of
from chipload.program.gcode.frames import further, remove
from chipload.program.gcode.offsets import choose
from chipload.program.gcode.sinumerik_cycles import CYCLES, NORMAL, hole_blocks
from chipload.program.gcode.sinumerik_flow import flow_step
from chipload.program.gcode.sinumerik_patterns import PATTERNS, hole_positions
from chipload.program.gcode.sinumerik_pockets import POCKETS, mill_pocket
from chipload.program.gcode.sinumerik_points import PLANES, POINT_WORDS, POLES, place_points
from chipload.program.gcode.sinumerik_slots import SLOTS, mill_slots
from chipload.program.gcode.sinumerik_swivel import swivel
from chipload.program.gcode.sinumerik_values import define, element, value_of, without_blanks
from chipload.program.gcode.sinumerik_words import (
    ALONG_TOOL,
    CONTOUR_FEEDS,
    CORNER_FEEDS,
    CORNERS,
    CURVES,
    END_ALONG_TOOL,
    FRAMES,
    IDLE,
    JUMPS,
    PLACED,
    leaves_out,
    unread,
)
from chipload.program.gcode.state import AXES, LINEAR, ZERO, nine
from chipload.program.gcode.words import LONGEST, Block
from chipload.program.setup import FIRST_NAMED

if TYPE_CHECKING:
    from chipload.program.gcode.flow import Flow

#: largest rounding or chamfer [mm]
LARGEST_CORNER = 1e6
_TOKEN = re.compile(
    r"""\s*(?:
      (?P<name>[A-Z_$][A-Z0-9_$]*?)\s*(?:\[(?P<index>[^\]]*)\])?\s*=\s*(?P<value>"[^"]*"|(?:[^\s=()"]|\([^()]*(?:\([^()]*\)[^()]*)*\))+)
     |(?P<call>[A-Z_][A-Z0-9_]+)\s*\((?P<arguments>(?:"[^"]*"|[^()"]|\([^()]*\))*)\)
     |(?P<letter>[A-Z])\s*(?P<number>[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+))(?![A-Z_])
     |(?P<word>[A-Z_][A-Z0-9_]*)(?P<colon>:?)
    )""",
    re.VERBOSE,
)
_DIMENSION = re.compile(r"(AC|IC|DC|ACP|ACN)\((.*)\)\Z", re.DOTALL)
_LABEL = re.compile(r"^(N[0-9]+\s*)?[A-Z_][A-Z0-9_]*\s*:(?!=)\s*")
_CALL = re.compile(r'(?:N[0-9]+\s*)?(?:EXT)?CALL\s*\(?\s*"([^"]+)"\s*\)?\s*\Z')
_CYCLE = re.compile(r"(?:CYCLE|POCKET|SLOT|HOLES)[0-9]|LONGHOLE\Z")
#: reference and fixed points of the machine, and a text that a name stands for
_RETURNS = re.compile(r"(?:N[0-9]+\s*)?G7[45](?![0-9])")
_TEXT = re.compile(r"DEFINE\s+([A-Z_][A-Z0-9_]*)\s+AS\s+(.*)", re.DOTALL)
_DEFINITION = re.compile(r"DEF\s+(?:CHAN\s+|NCK\s+)?(REAL|INT|BOOL|CHAR|STRING|AXIS|FRAME)\b(.*)")
#: codes of G as LinuxCNC has them, in tenths
SAME = {60: 610, 64: 640, 641: 640, 642: 640, 643: 640, 644: 640, 645: 640, 70: 200, 700: 200, 71: 210, 710: 210,
        153: 530, 53: 530, 9: 0}  # fmt: skip
PLAIN = frozenset({0, 1, 2, 3, 4, 17, 18, 19, 40, 41, 42, 54, 55, 56, 57, 90, 91, 93, 94, 95, 96, 97})
NO_MEANING = frozenset({9, 25, 26, 460, 461, 462, 601, 602, 603, 621, 810, 820, 930, 931, 94})
#: shifts by G code
FRAME_CODES = {58: "TRANS", 59: "ATRANS"}
#: G33 and tapping: LinuxCNC's code, and whether the spindle turns against K
SYNCHRONISED = {33: None, 331: False, 332: True}
_WORDS = frozenset("XYZABCUVWIJKFSTDH")


@dataclass(frozen=True)
class Sinumerik(Dialect):
    """The Sinumerik dialect; see the module."""

    def begin(self, c: Controller, text: str) -> None:
        """Nothing: the state at power on is that of LinuxCNC."""

    def jump(self, flow: Flow, raw: str) -> bool:
        """Jumps and loops."""
        return flow_step(flow, raw, value_of)

    def read(self, raw: str, c: Controller) -> Block | None:
        """The block of a line, in LinuxCNC's words."""
        body, _, comment = _without_comment(raw)
        body = body.strip().upper()
        block = Block(comments=[comment] if comment else [])
        if body.startswith(("%", "PROC ", "EXTERN ")) or (body.startswith("$") and "=" not in body):
            return None
        body = _LABEL.sub(r"\1", re.sub(r"^/[0-9]?\s*", "", body))
        definition = _DEFINITION.match(body)
        if definition:
            if definition[1] in ("REAL", "INT", "BOOL"):
                define(definition[2], c)
            return None
        if _RETURNS.match(body):
            c.retracted = c.state.at
            c.note("nc-machine-retraction", f"{body[:24]}: a retraction to a position of the machine is left out")
            return None
        named_text = _TEXT.match(body)
        if named_text:
            c.named_texts[named_text[1]] = named_text[2].strip()
            return None
        for name, meaning in c.named_texts.items():
            body = re.sub(rf"(?<![A-Z0-9_]){name}(?![A-Z0-9_(=])", meaning.replace("\\", r"\\"), body)
        body = without_blanks(body)
        call = _CALL.match(body)
        if call:
            block.program_call = call[1].rsplit("/", 1)[-1].split(".")[0].removesuffix("_SPF"), 1
            return block
        if len(body) > 4 * LONGEST:
            raise InputError(f"{len(body)} characters: a block has at most {4 * LONGEST}")
        at = 0
        values: list[tuple[str, str, float]] = []
        while at < len(body):
            found = _TOKEN.match(body, at)
            if found is None:
                if not body[at:].strip():
                    break
                raise InputError(f"{body[at : at + 16].strip()!r}: does not begin a word")
            at = found.end()
            if found["letter"]:
                _letter(block, c, found["letter"], float(found["number"]), values)
            elif found["name"] in ("SPOS", "SPOSA"):
                _position_spindle(block, c, found["index"])
            elif found["name"]:
                if found["index"] is not None and _is_field(found["name"], c):
                    key = element(found["name"], found["index"], c)
                    block.sets.append((key, value_of(found["value"], c)))
                else:
                    _set_named(block, c, found["name"], found["value"], values)
            elif found["call"]:
                _call_named(block, c, found["call"], found["arguments"])
            elif not found["colon"]:
                _keyword(block, c, found["word"], body)
        if block.frame:
            _frame(block, c)
        place_points(block, c, values)
        if c.scaled is not None and values:
            raise NotReadError("AC and IC in mirrored or scaled coordinates")
        self._resolve(block, c, values)
        if c.scaled is not None:
            words_of_arcs(block, c, c.scaled[0])
        self._holes(block, c)
        return lenient(block, c)

    def _holes(self, block: Block, c: Controller) -> None:
        """A drilling cycle at the position of the tool or, with MCALL, after each block that moves in the plane."""
        moves = {"x", "y", "z"} - {NORMAL.get(c.state.plane, "z")}
        if block.pocket is not None:
            if block.modal or not moves.isdisjoint(block.words) or c.left_out:
                raise NotReadError(f"{block.pocket[0]}: beside MCALL or a motion")
            (mill_slots if block.pocket[0] in SLOTS else mill_pocket)(*block.pocket, c)
        elif block.pattern is not None:
            block.after = _pattern_blocks(*block.pattern, c)
        elif block.modal:
            c.modal_hole, c.modal_program = block.hole, None
            if block.program_call is not None:
                c.modal_program = *block.program_call, block.arguments, c.level
                block.program_call = None
        elif (block.hole or c.modal_hole) and c.scaled is not None and c.scaled[0][2] != 1.0:
            raise NotReadError("a cycle in coordinates that are scaled or mirrored along Z")
        elif block.hole is not None:
            block.after = hole_blocks(*block.hole, c)
        elif c.modal_hole is not None and not moves.isdisjoint(block.words):
            block.after = hole_blocks(*c.modal_hole, c)

    def _resolve(self, block: Block, c: Controller, values: list[tuple[str, str, float]]) -> None:
        """Convert AC and IC values to the mode (absolute or incremental) of the block."""
        state, words = c.state, block.words
        absolute = 910 not in block.g and (state.absolute or 900 in block.g)
        scale = 25.4 if 200 in block.g else 1.0 if 210 in block.g else state.scale
        if 40 in block.g:
            if "f" in words:
                words["p"] = words.pop("f")
            elif "s" in words:
                if state.speed == 0.0:
                    raise InputError("G4 S: a dwell by turns of the spindle: its speed is not known: give S before")
                words["p"] = words.pop("s") * 60.0 / state.speed
        if 330 in block.g and c.reversed is not None:
            clockwise = (words.get("k", 1.0) > 0.0) != c.reversed
            block.m = [m for m in block.m if m not in (3, 4, 5)] + [3 if clockwise else 4]
            c.reversed = None
        if 19 in block.m:
            # SPOS stands beside M3 to M5: the spindle stops at its angle
            block.m = [m for m in block.m if m not in (3, 4, 5, 19)] + [19]
        for letter, mode, value in values:
            k = AXES.find(letter) if letter in AXES else "ijk".find(letter)
            here = state.at[k] / (scale if k in LINEAR else 1.0)
            if letter in "ijk":
                words[letter] = value - here if mode != "IC" else value
            elif mode == "IC":
                words[letter] = here + value if absolute else value
            else:
                if mode != "AC":
                    c.once("nc-ignored", f"{mode}: the direction in which a rotary axis turns is left to the machine")
                words[letter] = value if absolute else value - here
        if 6 in block.m and c.tools is not None and not {430, 490} & set(block.g):
            block.g.append(430)
            words.setdefault("h", 0.0)
        # D is an edge of the tool in the spindle, so that compensation takes that tool's diameter
        for letter in "dh":
            if letter in words and not (letter == "h" and {430, 490} & set(block.g)):
                del words[letter]
                c.once("nc-ignored", f"{letter.upper()}: tool edges (D) and auxiliary functions (H) are ignored")


def _without_comment(raw: str) -> tuple[str, str, str]:
    quoted = False
    for k, character in enumerate(raw):
        if character == '"':
            quoted = not quoted
        elif character == ";" and not quoted:
            return raw[:k], ";", raw[k + 1 :].strip()
    return raw, "", ""


def _is_field(name: str, c: Controller) -> bool:
    """Whether a name with [ ] is R or a field of the program."""
    return name == "R" or any(x.startswith(f"_{name.lower()}[") for x in c.parameters.shared)


def _letter(block: Block, c: Controller, letter: str, value: float, values: list[tuple[str, str, float]]) -> None:
    if letter == "G":
        _code(block, c, integer_of(value, "code G"))
    elif letter == "M":
        m = integer_of(value, "code M")
        if m == 17:
            m = _end_of_program(c, "M17")
        block.m.append(m)
    elif letter == "N":
        block.number = int(min(value, 1e12))
    elif letter == "L":
        block.program_call = f"L{integer_of(value, 'L')}", 1
    elif letter == "P" and block.program_call is not None:
        block.program_call = block.program_call[0], integer_of(value, "P")
    elif letter in _WORDS:
        _put(block, letter.lower(), value)
    else:
        c.note("nc-unknown-word", f"{letter}{value:g}: is not known")


def _put(block: Block, letter: str, value: float) -> None:
    if letter in block.words:
        raise InputError(f"{letter.upper()}: appears twice in one block")
    block.words[letter] = value


def _code(block: Block, c: Controller, code: int) -> None:
    if code in (53, 153):
        c.machine_word = f"G{code}"
    if code in SAME and code != 9:
        block.g.append(SAME[code])
    elif code in PLAIN:
        block.g.append(10 * code)
    elif code == 500 or 505 <= code <= 599:
        choose(c, f"G{code}", 0 if code == 500 else code - 500)
    elif code in (450, 451):
        if c.state.compensation != 400:
            c.leave_out("nc-unknown-word", f"G{code}: within a compensated contour: its corners stay as they were")
        c.crossing_corners = code == 451
    elif code in NO_MEANING:
        c.once("nc-ignored", f"G{code}: does not affect the path")
    elif code in SYNCHRONISED:
        block.g.append(330)
        if SYNCHRONISED[code] is not None:
            c.reversed = SYNCHRONISED[code]
    elif code == 63:
        block.g.append(10)
    elif code == 59 or (code == 58 and c.program_frame is None):
        block.frame = FRAME_CODES[code]
    elif code in POLES:
        block.pole = code
    elif code in (34, 35, 58, 59, 74, 75, *range(140, 149), 247, 248, 347, 348):
        raise NotReadError(f"G{code}: is not read")
    else:
        # the dialect's reader makes a finding of it
        block.g.append(9990 - code % 100 if code > 998 else 10 * code + 9)


def _position_spindle(block: Block, c: Controller, index: str | None) -> None:
    """SPOS: the spindle stops at an angle; that of another number than 1 is not the one that cuts."""
    if index is None or not index.strip() or index.strip() == "1":
        block.m.append(19)
    elif index.strip().isdigit():
        c.once("nc-other-spindle", f"SPOS[{index.strip()}]: positions another spindle: the one that cuts goes on")
    else:
        block.m.append(19)
        c.leave_out(
            "nc-other-spindle", f"SPOS[{index.strip()[:20]}]: which spindle is not known: taken as the one that cuts"
        )


def _end_of_program(c: Controller, word: str) -> int:
    """M function that ends a subprogram, or a text that is one."""
    if c.level > 0:
        return 99
    c.note("nc-ignored", f"{word}: ends a subroutine: the text ends here")
    return 30


def _pattern_blocks(name: str, arguments: list[float | None], c: Controller) -> list[Block]:
    """The drilling cycle of MCALL at each hole of a pattern."""
    if c.modal_hole is None:
        c.leave_out("nc-call", f"{name}: no cycle is active by MCALL: left out")
        return []
    if c.state.plane not in PLANES:
        raise NotReadError(f"{name}: patterns lie in the planes of G17, G18 and G19")
    u, v = PLANES[c.state.plane][:2]
    out: list[Block] = []
    for hole in hole_positions(name, arguments):
        out += [Block(words={u: hole.real, v: hole.imag}, g=[900, 0]), *hole_blocks(*c.modal_hole, c)]
    return out


def _set_named(block: Block, c: Controller, name: str, text: str, values: list[tuple[str, str, float]]) -> None:
    if name in ("A3", "B3", "C3", "A2", "B2", "C2", "A4", "B4", "C4", "A5", "B5", "C5", "LEAD", "TILT"):
        raise NotReadError(
            f"{name}: tool directions as vectors or angles to the surface are not read: output rotary axes"
        )
    if name == "T" and text.startswith('"'):
        number = c.named_tools.setdefault(text, FIRST_NAMED + len(c.named_tools))
        c.once("nc-tool-unknown", f"tool {text}: has no number: it is taken as T{number} with length 0")
        _put(block, "t", float(number))
        return
    if name in POINT_WORDS:
        dimension = _DIMENSION.match(text)
        how = dimension[1] if dimension is not None else "AC"
        block.point[name] = how, value_of(dimension[2] if dimension is not None else text, c)
        return
    if name == "P" and block.program_call is not None:
        block.program_call = block.program_call[0], integer_of(value_of(text, c), "P")
        return
    if name in CURVES:
        _left_out(block, c, name)
        return
    if name in CORNERS:
        _corner(c, name, text)
        return
    if name in CORNER_FEEDS:
        _feed_corner(c, name, value_of(text, c))
        return
    if left_out := unread(name, text):
        c.leave_out("nc-unknown-word", left_out)
        if leaves_out(name) and NOTED not in block.g:
            block.g.append(NOTED)
        return
    if text.startswith('"') or name.startswith("$") or name in IDLE or name in ("OVR", "OVRRAP"):
        c.once("nc-ignored", f"{name}: does not affect the path; it is ignored")
        return
    if re.fullmatch(r"R[0-9]{1,4}", name):
        block.sets.append((int(name[1:]), value_of(text, c)))
        return
    if name == "CR":
        _put(block, "r", value_of(text, c))
    elif name == "TURN":
        _put(block, "p", value_of(text, c) + 1.0)
    elif name in ("G", "M"):
        _letter(block, c, name, value_of(text, c), values)
    elif f"_{name.lower()}" in c.parameters.shared:
        block.sets.append((f"_{name.lower()}", value_of(text, c)))
    elif name == "RPL":
        _put(block, "p", value_of(text, c))
    elif len(name) == 1 and name in _WORDS:
        dimension = _DIMENSION.match(text)
        value = value_of(dimension[2] if dimension is not None else text, c)
        if dimension is not None and name in "XYZABCUVWIJK":
            values.append((name.lower(), dimension[1], value))
        else:
            _put(block, name.lower(), value)
    elif name in ("S1", "M1", "T1"):
        # spindle 1 is the one that cuts
        _letter(block, c, name[0], value_of(text, c), values)
    elif re.fullmatch(r"[SMTH][0-9]", name):
        c.note("nc-unknown-word", f"{name}={text}: further spindles and auxiliary functions are left out")
    else:
        c.note("nc-unknown-word", f"{name}={text[:40]}: is not known")


def _corner(c: Controller, name: str, text: str) -> None:
    """A rounding or chamfer after the motion of the block; RNDM: after every motion until RNDM=0."""
    size, label = value_of(text, c) * c.state.scale, f"{name}={text.strip()[:20]}"
    if not 0.0 <= size <= LARGEST_CORNER:
        raise InputError(f"{label}: must be from 0 to {LARGEST_CORNER:g} mm")
    corner = Corner(name.startswith("RND"), size, None, label, edge=name == "CHF") if size > 0.0 else None
    if name == "RNDM":
        c.round_all(corner)
    elif corner is not None:
        c.round_off(corner)


def _feed_corner(c: Controller, name: str, value: float) -> None:
    """FRC and FRCM: the feed of roundings and chamfers, for each turn in G95; FRCM=0 ends it."""
    if value < 0.0 or (value == 0.0 and name == "FRC"):
        raise InputError(f"{name}={value:g}: must be above 0")
    feed = value * c.state.scale / 60.0 * (abs(c.state.speed) if c.state.feed_mode == 950 else 1.0)
    if name == "FRCM":
        c.corner_feeds = feed if feed > 0.0 else None
    else:
        c.feed_corner(feed)


def _left_out(block: Block, c: Controller, word: str) -> None:
    """A word whose motion is not read: its block does not move."""
    c.leave_out("nc-unknown-word", f"{word}: is not read: the motion of its block is left out")
    if NOTED not in block.g:
        block.g.append(NOTED)


def _call_named(block: Block, c: Controller, name: str, arguments: str) -> None:
    if name == "MSG":
        c.note("nc-message", arguments.strip().strip('"')[:200])
    elif name == "TRAORI":
        _keyword(block, c, name)
    elif name == "CYCLE800":
        swivel(c, [value_of(x, c) if x.strip() else 0.0 for x in re.sub(r'"[^"]*"', "", arguments).split(",")])
    elif name in FRAMES:
        leave_out(c, f"{name}: changed coordinates")
    elif name in CYCLES:
        block.hole = (name, [value_of(x, c) if x.strip() else None for x in arguments.split(",")])
    elif name in POCKETS or name in SLOTS:
        block.pocket = name, [value_of(x, c) if x.strip() else None for x in arguments.split(",")]
    elif name in PATTERNS:
        block.pattern = name, [value_of(x, c) if x.strip() else None for x in arguments.split(",")]
    elif name in JUMPS:
        _keyword(block, c, name)
    elif name in IDLE:
        c.once("nc-ignored", f"{name}: does not affect the path; it is ignored")
    elif _CYCLE.match(name) or '"' in arguments:
        c.leave_out("nc-call", f"{name}({arguments.strip()[:60]}): cycles and calls are not read: left out")
    else:
        block.program_call = name, 1
        block.arguments = [value_of(x, c) if x.strip() else None for x in arguments.split(",")]


def _frame(block: Block, c: Controller) -> None:
    """TRANS, ROT and the like, with their axes; without any axis they end all frames."""
    word, words = block.frame, block.words
    tilted = c.state.datum.tilt is not None
    given = {x: words.pop(x) for x in "xyzabcpijk" if x in words}
    if word in ALONG_TOOL:
        leave_out(c, f"{word}: coordinates along the tool's axis")
        return
    if word == END_ALONG_TOOL:
        if c.left_out.startswith(("TOFRAME", "TOROT")):
            go_on(c)
        return
    if not word.startswith("A"):
        c.scaled = None
    if not word.startswith("A") and not given:
        go_on(c)
        remove(c)
    elif tilted:
        leave_out(c, f"{word}: coordinates that change within a swivelled plane")
    elif word in ("MIRROR", "AMIRROR", "SCALE", "ASCALE") and not given.keys() - set("xyz"):
        if not word.startswith("A"):
            remove(c)
        factor_axes(c, {x: -1.0 if word.endswith("MIRROR") else given[x] for x in given})
    elif word not in PLACED or c.scaled is not None:
        leave_out(c, f"{word}: mirrored, scaled or tilted coordinates")
    elif word.endswith("TRANS"):
        shift = nine([given.get(x, 0.0) * (c.state.scale if x in "xyz" else 1.0) for x in AXES])
        if word == "TRANS":
            remove(c)
        further(c, 0.0, shift)
    elif given.keys() - {"z", "p"} or ("p" in given and c.state.plane != 170):
        leave_out(c, f"{word}: coordinates that are tilted")
    else:
        if word == "ROT":
            remove(c)
        further(c, given.get("z", given.get("p", 0.0)), ZERO)


def _keyword(block: Block, c: Controller, word: str, body: str = "") -> None:
    if word in ("TRAORI", "TRAFOOF"):
        c.state.tcp = word == "TRAORI"
        c.changed()
    elif word == "MCALL":
        block.modal = True
    elif word == "SUPA":
        c.machine_word = word
        block.g.append(530)
    elif word == "RET":
        block.m.append(_end_of_program(c, "RET"))
    elif word == "CIP":
        block.circle = True
    elif word == "CT":
        block.tangent = True
    elif word in FRAMES:
        block.frame = word
    elif word in JUMPS:
        # sinumerik_flow reads the jumps that begin a block
        raise NotReadError(f"{word}: is not read here")
    elif word == "KONT":
        c.leave_out("nc-unknown-word", "KONT: the way round the contour at its start and end is left out")
    elif word in CONTOUR_FEEDS:
        c.contour_feed = CONTOUR_FEEDS[word]
    elif word in CURVES or _CYCLE.match(word):
        _left_out(block, c, word)
    elif word in IDLE:
        c.once("nc-ignored", f"{word}: does not affect the path; it is ignored")
    elif re.fullmatch(rf"(?:N[0-9]+\s*)?{re.escape(word)}\s*(?:P\s*=?\s*[0-9]+\s*)?", body):
        block.program_call = word, 1
    else:
        c.leave_out("nc-unknown-word", f"{word[:40]}: is not known: its effect is left out")
