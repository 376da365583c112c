"""Fanuc's language, and that of the controls that read like one, where it differs from LinuxCNC's in what matters.

Notation: codes of G are in tenths. What differs from control to control (units of a dwell, repeats, starts of the
spindle, macro arguments, numbers without a point) is in their profiles (:mod:`~chipload.program.control`). M98 P51234
calls O1234 five times. Fine boring (G76) is carried out without its shift in the bottom of the hole; back boring (G87)
shifts by Q against X, which leaves it unproven, as the machine's own setting says where to and the cutter is round. G33
has its lead in F. Macro statements and calls (G65, G66) are those of :mod:`~chipload.program.gcode.macros`; polar,
scaled and mirrored coordinates (G16, G51, G51.1) of :mod:`~chipload.program.gcode.coordinates`; G12, G13 and G70 to G72
of a Haas of :mod:`~chipload.program.gcode.haas_cycles`. G68 turns about Z. A tilted plane (G68.2, Haas
G268) is stated by angles, points or vectors (:mod:`~chipload.program.gcode.plane_words`); G53.1 (G253) turns the tool
along its normal (:mod:`~chipload.program.gcode.tilted_plane`).

Polar and cylindrical interpolation (G12.1, G7.1) are those of :mod:`~chipload.program.gcode.interpolation_codes`.

Left out, so that the result is unproven: motions in planes that are tilted otherwise (G68.2 P4, G68.3, G68 about
another axis than Z) until they end, tool vectors (G43.5), involutes and splines. Noted and left out: smoothing and
look-ahead (G5.1, G8), retractions to where only the machine knows.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING

from chipload.errors import InputError
from chipload.program.corners import Corner
from chipload.program.gcode.bare_chamfers import with_commas
from chipload.program.gcode.controller import Controller
from chipload.program.gcode.coordinates import change_coordinates
from chipload.program.gcode.cycles import CYCLES, FANUC_BACK_BORING, NEED_Q, PeckRule
from chipload.program.gcode.dialect import UNREAD, Dialect, NotReadError, go_on, leave_out, lenient
from chipload.program.gcode.expression import integer_of, read_value
from chipload.program.gcode.frames import remove, turn_about
from chipload.program.gcode.haas_cycles import circular_pocket, hole_pattern
from chipload.program.gcode.interpolation_codes import change_plane, refuse_within
from chipload.program.gcode.macros import (
    ALARM,
    OUTPUTS,
    clear_variable,
    macro_step,
    read_macro_call,
    system_variables,
    with_brackets,
)
from chipload.program.gcode.modal import GROUP_OF, code_text
from chipload.program.gcode.numbers import count_increments, decide_increments, seconds_of
from chipload.program.gcode.offsets import choose, probe_motion
from chipload.program.gcode.other_codes import replace_codes, without_next_tool
from chipload.program.gcode.plane_words import stated_plane
from chipload.program.gcode.state import LINEAR, ZERO
from chipload.program.gcode.tilted_plane import align, at_angles, level, tilt_coordinates
from chipload.program.gcode.words import Block, bare, read_block
from chipload.program.tilt import tilt_of

if TYPE_CHECKING:
    from chipload.program.gcode.flow import Flow

#: name of a program instead of its number, and a comment that holds another (
_NAME = re.compile(r"^[ \t]*<([A-Za-z0-9_+.-]{1,32})>(?=[ \t]*(?:\(|$))", re.MULTILINE)
_NESTED = re.compile(r"\([^()\n]*\([^)\n]*\)")
_COLON = re.compile(r"^([ \t]*):(?=[0-9]+[ \t]*(?:\(|$))", re.MULTILINE)
#: a block number that marks a place to begin from, as of NX
_PLACE = re.compile(r"^([ \t]*):(?=[0-9])", re.MULTILINE)
_FILE = re.compile(r"^\$[^\n%]*%[ \t]*$", re.MULTILINE)
_SKIP = re.compile(r"^/[1-9]")
#: how the words of a block begin; a block of words with numbers, one of them a code or an axis
_BEGINS = re.compile(r"\s*[/:]?\s*(?:[A-Za-z]\s*[-+]?[0-9.#\[]|#|IF|WHILE|GOTO)")
_COMMENT = re.compile(r"\([^()\n]*\)")
_WORD = r"[A-Za-z][-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+|#[0-9]+|\[[^\[\]]*(?:\[[^\[\]]*\][^\[\]]*)*\])"
_BLOCK = re.compile(rf"(?=.*[GMXYZgmxyz])/?(?:{_WORD})+")
_TAP = re.compile(r"g(?:84|74)(?![0-9.])")
#: rounding or chamfer of the corner behind a motion, and an angle or what else stands behind a comma
_CORNER = re.compile(r",([rc])([-+]?[0-9.]+|#[0-9]+|\[[^\]]*\])")

#: coordinates in which motions are left out until a code ends them
CHANGED = {
    683: "a tilted plane",
    684: "a tilted plane",
}
#: and those codes
ENDS = {150: (160,), 690: (682, 683, 684), 131: (121,), 1130: (1120,), 71: (71,), 1070: (1070,)}
#: blocks that are left out
NOT_READ = {
    401: "normal direction control",
    411: "normal direction control",
    421: "normal direction control",
    661: "a modal macro that is called in every block",
    435: "tip control by vectors",
    440: "a negative tool length",
}
#: tilted planes and the code that turns the tool along their normal, of a Fanuc and of a Haas
TILTED, ALIGN = (682, 2680), (531, 2530)
#: G254 and G255 of a Haas: the origin follows the turned table, X, Y and Z stay those of the machine
DYNAMIC, STATIC = 2540, 2550
#: what a Haas calls G69
HAAS_UNTILTED = 2690
#: G53.1 P: the angle of the last rotary axis from the workpiece is positive, or negative
SIGNS = {0.0: 0, 1.0: 1, 2.0: -1}
TURNED, UNTURNED, SKIP = 680, 690, 310
#: blocks that are left out if they have such words: what they do with them
NOT_READ_WITH = {
    270: ("xyzabc", "a motion to a position of the machine"),
    600: ("xyzabc", "positioning from one direction"),
    70: ("xyzabc", "a hypothetical axis"),
}
#: codes whose axes are no positions: the area of a stored limit, axes that are smoothed
NO_POSITIONS = {220: "xyzijk", 51: "xyzabc"}
#: motions that are left out: splines through points
LEFT_OUT = frozenset({61})
#: rigid tapping: LinuxCNC's code
TAPPING = {842: 840, 843: 740}
#: tapping itself, and pecks that break the chip: K of a Haas and J of an Okuma lift the drill out after a depth
TAPS, PECKS_WITHOUT_LIFT = (840, 740), 730
FINE_BORING, BORING = 760, 860
#: end of what is not on, or what does not affect the path
IDLE = frozenset(
    {50, 51, 80, 81, 90, 110, 130, 131, 150, 220, 230, 250, 260, 270, 491, 495, 500, 501, 600, 620, 630, 641, 670}
    | {531, 690, 691, 692, 693, 1030, 1130, 1870}
)
EXTENDED = 541
#: kind of tool offset by L of G10
TOOL_OFFSETS = {10.0: "length", 11.0: "length wear", 12.0: "radius", 13.0: "radius wear"}
#: largest rounding or chamfer [mm]
LARGEST_CORNER = 1e6
#: G154 P and G234 of a Haas: more work offsets, tip control
HAAS_EXTENDED, HAAS_TIP = 1540, 2340


@dataclass(frozen=True)
class Fanuc(Dialect):
    """See above."""

    def prepare(self, text: str, c: Controller) -> str:
        """A program number may begin with : instead of O; with words behind it, that is a block number. The first line
        may hold the name of a file ($A.MIN%), that of the program in <>. A comment ends at its first ), whatever it
        holds. A chamfer may stand without a comma.
        """
        text = _NAME.sub(r"(\1)", _FILE.sub("%", _PLACE.sub(r"\1N", _COLON.sub(r"\1O", text))))
        text = _NESTED.sub(lambda found: f"({found[0][1:].replace('(', '[')}", text)
        return with_commas(text, c)

    def begin(self, c: Controller, text: str) -> None:
        """System variables, and numbers without a decimal point."""
        c.parameters.live.update(system_variables(c))
        decide_increments(c, text)

    def begins_at(self, lines: list[str]) -> int:
        """Index of the first % behind a text without words: what stands before it is a label that is not read."""
        first = next((k for k, line in enumerate(lines) if line.strip() == "%"), 0)
        follows = any(line.strip() for line in lines[first + 1 :])
        return first if follows and not any(_BEGINS.match(line) for line in lines[:first]) else 0

    def blocks_of(self, raw: str, c: Controller) -> list[str]:
        """The blocks of a line: ; is how manuals and screens write the end of a block."""
        if ";" not in raw:
            return [raw]
        parts = _COMMENT.sub(lambda found: found[0].replace(";", ","), raw).split(";")
        behind = [part for part in parts[1:] if _BLOCK.fullmatch("".join(_COMMENT.sub("", part).split()))]
        if not behind:
            return [raw]
        c.leave_out(
            "nc-end-of-block",
            f"{behind[0].strip()[:60]!r}: stands behind ; and is carried out as a block: put a comment in ( )",
        )
        return [parts[0], *behind]

    def read(self, raw: str, c: Controller) -> Block | None:
        """The block of a line, in LinuxCNC's words."""
        text, comments = bare(raw)
        text = _SKIP.sub("/", text).replace("(", "")
        if OUTPUTS.match(text):
            c.once("nc-output", f"{text[:20].upper()}: its output is not written")
            return None
        call = read_macro_call(text, comments, c)
        if call is not None:
            return lenient(call, c, UNREAD | LEFT_OUT)
        if clear_variable(text, c):
            return None
        text = without_next_tool(text, c)
        block = read_block(with_brackets(_corners(text, c)), comments, c.parameters)
        rules = c.control.text
        replace_codes(block, rules.codes, c)
        if 670 in block.g:
            c.modal_macro = None
        count_increments(block, c)
        hole_pattern(block, c)
        if circular_pocket(block, c):
            return None
        for code in block.g:
            unread = rules.unread.get(code) or NOT_READ.get(code)
            if unread is not None:
                raise NotReadError(f"{code_text(code)}: {unread}")
            letters, what = NOT_READ_WITH.get(code, ("", ""))
            if not block.words.keys().isdisjoint(letters):
                raise NotReadError(f"{code_text(code)}: {what}")
        if any(key == ALARM for key, _ in block.sets):
            c.leave_out("nc-alarm", f"#{ALARM}: an alarm ends the program here")
            block.sets, block.m = [], [30]
        refuse_within(block, c)
        self._coordinates(block, c)
        change_plane(block, c)
        change_coordinates(block, c)
        if 99 in block.m and "p" in block.words:
            block.returns_to = integer_of(block.words.pop("p"), "M99 P")
        if 198 in block.m:
            raise NotReadError("M198: calls a program of another device")
        if 97 in block.m:
            block.m.remove(97)
            block.block_call = {"p": -1.0, **{x: block.words.pop(x) for x in "pl" if x in block.words}}
        if 98 in block.m and "h" in block.words:
            # a Mitsubishi calls the block N of its own text
            if "p" in block.words:
                raise NotReadError("M98: P with H: a subprogram from a block of it on")
            block.m.remove(98)
            block.block_call = {"p": block.words.pop("h"), **{x: block.words.pop(x) for x in "l" if x in block.words}}
        self._adapt(block, c)
        return lenient(block, c, UNREAD | LEFT_OUT)

    def jump(self, flow: Flow, raw: str) -> bool:
        """Macro statements."""
        return macro_step(flow, raw)

    def _coordinates(self, block: Block, c: Controller) -> None:
        """G68 and G69; coordinates that are not read."""
        words, g = block.words, block.g
        if HAAS_UNTILTED in g:
            g[g.index(HAAS_UNTILTED)] = UNTURNED
        for code in g:
            if c.left_out and code in ENDS and c.left_out.split(":")[0] in map(code_text, ENDS[code]):
                go_on(c)
        for code in [code for code in g if code in CHANGED]:
            leave_out(c, f"{code_text(code)}: {CHANGED[code]}")
            g.remove(code)
            words.clear()
        self._tilt_plane(block, c)
        if DYNAMIC in g:
            g.remove(DYNAMIC)
            remove(c)
            if not tilt_coordinates(c, tilt_of(at_angles(c, {})[1], (0.0, 0.0, 0.0))):
                leave_out(c, "G254: the origin follows the table, and no machine with rotary axes")
        elif STATIC in g:
            g.remove(STATIC)
            level(c)
        g = block.g
        if TURNED in g:
            g.remove(TURNED)
            if c.state.plane != 170 or "z" in words or words.keys() & {"i", "j", "k"}:
                leave_out(c, "G68.2: a tilted plane")
                words.clear()
                return
            remove(c)
            x, y = (words.pop(axis, c.state.at[k] / c.state.scale) for k, axis in enumerate("xy"))
            turn_about(c, x * c.state.scale, y * c.state.scale, words.pop("r", 0.0))
        elif UNTURNED in g:
            remove(c)
            level(c)

    def _tilt_plane(self, block: Block, c: Controller) -> None:
        """Tilted planes, and the tool along their normal."""
        words, g = block.words, block.g
        if c.plane_blocks.is_open and (g or words) and not set(TILTED) & set(g):
            c.plane_blocks.words = {}
            remove(c)
            level(c)
            leave_out(c, "G68.2: a tilted plane of which a block is missing")
        for code in [code for code in g if code in TILTED]:
            name = code_text(code)
            given = dict(words)
            g.remove(code)
            words.clear()
            plane = stated_plane(given, c.state.scale, c.plane_blocks)
            if c.plane_blocks.is_open:
                continue
            remove(c)
            if plane is None:
                level(c)
                leave_out(c, f"G68.2: {name}: a tilted plane that is stated by other words than those that are read")
            elif not tilt_coordinates(c, plane):
                leave_out(c, f"G68.2: {name}: a tilted plane, and no machine with rotary axes")
        for code in [code for code in g if code in ALIGN]:
            if c.state.datum.tilt is None:
                continue
            g.remove(code)
            p = words.pop("p", 0.0)
            if p not in SIGNS:
                raise InputError(f"{code_text(code)}: P{p:g}: must be 0, 1 or 2")
            align(c, SIGNS[p])
        changing = [code for code in g if self._offsets(code, c)] if c.state.datum.tilt is not None else []
        if changing:
            leave_out(c, f"G68.2: {code_text(changing[0])} within a tilted plane")
            block.g = [code for code in g if code not in changing]
            words.clear()

    @staticmethod
    def _offsets(code: int, c: Controller) -> bool:
        """Whether a code changes what a tilted plane lies in."""
        if code in (100, 520, 920, TURNED, EXTENDED, HAAS_EXTENDED):
            return True
        return 540 <= code <= 593 and code % 10 in range(4) and 530 + 10 * c.state.datum.number != code

    def _adapt(self, block: Block, c: Controller) -> None:
        words, g = block.words, block.g
        self._holes(block, c)
        idle = [code for code in g if code in IDLE]
        if 50 in idle and not (words.get("p", 0.0) >= 1000.0 or "x" not in words):
            raise NotReadError("G5: splines")
        for code in idle:
            for letter in NO_POSITIONS.get(code, ""):
                words.pop(letter, None)
            if code in (51, 50, 80, 81):
                c.once("nc-ignored", f"{code_text(code)}: look-ahead and smoothing do not change the path")
            g.remove(code)
        if idle:
            for letter in "pqr" if not any(x in CYCLES or x in (20, 30) for x in g) else "":
                words.pop(letter, None)
        if 40 in g:
            time_word = next((x for x in "xufp" if x in words and x in c.control.dwell), None)
            seconds = None if time_word is None else seconds_of(block, c, time_word)
            for x in "xuf":
                words.pop(x, None)
            if seconds is not None:
                words["p"] = seconds
        if HAAS_EXTENDED in g:
            g[g.index(HAAS_EXTENDED)] = EXTENDED
        if HAAS_TIP in g:
            g[g.index(HAAS_TIP)] = 434
        if EXTENDED in g or (540 in g and "p" in words and 40 not in g):
            self._extended_offset(block, c)
        if 100 in g:
            self._add_to_origin(words, c, c.state.absolute and 910 not in g)
        if 100 in g and words.get("l") != 2.0:
            if words.get("l") == 20.0:
                words.pop("l")
                number = words.pop("p", 0.0)
                if not 1 <= number <= 300 or number != int(number):
                    raise InputError(f"G10 L20 P{number:g}: P must be from 1 to 300")
                c.set_origin(9 + int(number), {k: words.pop(x) for k, x in enumerate("xyzabc") if x in words})
                g.remove(100)
                return
            self._tool_offset(words, c)
            g.remove(100)
            for letter in "lprqxyz":
                words.pop(letter, None)
        if 330 in g and "f" in words:
            words["k"] = words.pop("f")
        if SKIP in g:
            g[g.index(SKIP)] = 10
            probe_motion(c, "nc-skip", code_text(SKIP), "its signal comes")
        motion = next((x for x in g if x in CYCLES), c.state.motion)
        if motion in CYCLES:
            self._shorter_pecks(words, g, motion, c)
            self._pecks_of_taps(words, g, motion, c)
            repeat = c.control.cycles.repeat_letter
            if repeat == "q" and motion in NEED_Q:
                # an Okuma repeats by Q, but for the pecks of G83 and G73, whose depth may also be I
                if "i" in words and "q" not in words:
                    words["q"] = words.pop("i")
                    c.pecks = PeckRule(lift=words.pop("j", 0.0) if motion == PECKS_WITHOUT_LIFT else 0.0)
            elif repeat in words and repeat != "l":
                words["l"] = words.pop(repeat)
            if "p" in words and 40 not in g and 98 not in block.m:
                seconds = seconds_of(block, c, "p")
                words["p"] = 0.0 if seconds is None else seconds
                if motion in NEED_Q:
                    c.pecks = c.pecks._replace(dwell=max(words.pop("p"), 0.0))

    @staticmethod
    def _shorter_pecks(words: dict[str, float], g: list[int], motion: int, c: Controller) -> None:
        """G83 and G73 of a Haas with I: the first peck; each that follows is shorter by J, and at least K.

        Reference: Haas, Mill Operator's Manual, "G83 Normal Peck Drilling Canned Cycle".
        """
        if motion in NEED_Q and "i" in words and c.control.cycles.peck_letters:
            if "q" in words:
                raise NotReadError(f"{code_text(motion)}: I with Q: pecks that retract after a depth Q")
            words["q"] = words.pop("i")
            c.pecks = PeckRule(words.pop("j", 0.0), words.pop("k", 0.0))
        elif any(code in CYCLES for code in g) or "q" in words:
            has_lift = c.control.cycles.repeat_letter == "l" and motion == PECKS_WITHOUT_LIFT
            c.pecks = PeckRule(lift=words.pop("k", 0.0) if has_lift else 0.0)

    @staticmethod
    def _pecks_of_taps(words: dict[str, float], g: list[int], motion: int, c: Controller) -> None:
        """Q of G84 and G74: tapping in pecks; J of a Haas: how much faster the tap comes out, which is left out."""
        if motion not in TAPS:
            return
        if "q" in words and c.control.cycles.repeat_letter != "q":
            c.tap_peck = words.pop("q")
            c.once("nc-tap-pecks", "G84 Q: between its pecks the tap goes back by a setting: 0.254 mm are taken")
        elif any(code in TAPS for code in g):
            c.tap_peck = 0.0
        if "j" in words:
            del words["j"]
            c.once("nc-tap-retraction", "G84 J: the tap is taken to come out as fast as it goes in")

    @staticmethod
    def _add_to_origin(words: dict[str, float], c: Controller, absolute: bool) -> None:
        """G10 L2 and L20 in G91 move an origin by their words."""
        base = {2.0: 0, 20.0: 9}.get(words.get("l", 0.0))
        number = int(words.get("p", 0.0))
        if absolute or base is None or number < 1 or (base == 0 and number > 9):
            return
        at = c.work_offset(base + number)[0] if base == 0 or base + number in c.origins else ZERO
        for k, axis in enumerate("xyzabc"):
            if axis in words:
                words[axis] += at[k] / (c.state.scale if k in LINEAR else 1.0)

    @staticmethod
    def _tool_offset(words: dict[str, float], c: Controller) -> None:
        """G10 L10 to L13: length and radius of an offset and their wear; the diameter on a Haas."""
        kind = TOOL_OFFSETS.get(words.get("l", 0.0))
        if kind is None or "p" not in words or "r" not in words:
            name = f"G10 L{words['l']:g}" if "l" in words else "G10"
            c.leave_out("nc-offset-left-out", f"{name}: data of the controller are left out")
            return
        if kind.startswith("radius") and "diameter" in c.control.macros.tool_variables.values():
            kind = kind.replace("radius", "diameter")
        number, value = integer_of(words["p"], "P"), words["r"] * c.state.scale
        old = 0.0 if c.state.absolute else c.tool_rows.value(kind, number) or 0.0
        c.tool_rows.set(kind, number, old + value)

    def _holes(self, block: Block, c: Controller) -> None:
        """Tapping, fine and back boring in LinuxCNC's words."""
        words, g = block.words, block.g
        if 870 in g:
            g[g.index(870)] = FANUC_BACK_BORING
            words["i"], words["j"] = -abs(words.pop("q", 0.0)), 0.0
            c.leave_out(
                "nc-back-boring",
                "G87: the shift by Q is taken along -X (a setting of the machine), and the cutter as round",
            )
        if 29 in block.m:
            # rigid tapping: its cycle starts the spindle
            block.m.remove(29)
        for code in [code for code in g if code in TAPPING]:
            g[g.index(code)] = TAPPING[code]
        if FINE_BORING in g or (c.fine and c.state.motion == BORING and not self._moves(g)):
            c.fine = True
            if FINE_BORING in g:
                g[g.index(FINE_BORING)] = BORING
                words.setdefault("p", 0.0)
                c.once("nc-fine-boring", "G76: the shift in the bottom of the hole is left out")
            for letter in "qij":
                words.pop(letter, None)
        elif self._moves(g):
            c.fine = False

    @staticmethod
    def _moves(g: list[int]) -> bool:
        """Whether a code of motion or G80 stands among the codes."""
        return any(GROUP_OF.get(code) in ("motion", "none") for code in g)

    def _extended_offset(self, block: Block, c: Controller) -> None:
        """G54.1 P: a work offset whose origin is not known here."""
        number = block.words.pop("p", 0.0)
        if number != int(number) or not 1 <= number <= 300:
            raise InputError(f"G54.1 P{number:g}: P must be from 1 to 300")
        block.g = [code for code in block.g if code not in (EXTENDED, 540)]
        choose(c, f"G54.1 P{number:g}", 9 + int(number))

    def call(self, words: dict[str, float], c: Controller) -> tuple[str, int]:
        """M98 P1234 L5 or M98 P51234."""
        p = words.get("p", 0.0)
        if c.control.macros.packed_calls and "l" not in words and p > 9999.0 and p == int(p):
            times, p = divmod(int(p), 10_000)
            words = {"p": float(p), "l": float(times)}
        return super().call(words, c)


def _corners(text: str, c: Controller) -> str:
    """A block without the rounding or chamfer (,R or ,C) behind it, which the controller makes.

    Raises
    ------
    NotReadError
        Something else stands behind a comma, as the angle of a line (,A).
    """
    if "," not in text or OUTPUTS.match(text):
        return text
    if any(code_text(code).lower() in text for code in c.control.text.no_corners) or _TAP.search(text):
        # ,R1 of a tap asks for a spindle in step with the feed
        return _CORNER.sub("", text)
    for found in _CORNER.finditer(text):
        size = read_value(found[2], 0, c.parameters)[0] * c.state.scale
        said = found[0].upper()
        if not 0.0 <= size <= LARGEST_CORNER:
            raise InputError(f"{said}: a corner must be from 0 to {LARGEST_CORNER:g} mm")
        if size > 0.0:
            c.round_off(Corner(found[1] == "r", size, None, said))
    left = _CORNER.sub("", text)
    if "," in left:
        raise NotReadError(f"{left[left.index(',') :][:12].upper()!r}: what stands behind a comma is not read")
    return left
