"""What one block of RS-274 does, in LinuxCNC's order of execution.

Notation: codes of G are in tenths; F per minute, S in rpm.

The order: comments; G96, G97; G93 to G95; F; S; T; outputs; M6, M61; M3 to M5, M19; M70 to M73; coolant; overrides; G4;
plane; units; compensation; tool length; work offset; path; distance; retract; the codes that act once; the motion;
stops.

Reference: LinuxCNC 2.9, "Order of Execution".
"""

from __future__ import annotations

import re
from dataclasses import replace

from chipload.errors import InputError
from chipload.program.gcode import offsets, targets
from chipload.program.gcode.controller import Controller
from chipload.program.gcode.cycles import TAPPING
from chipload.program.gcode.expression import integer_of
from chipload.program.gcode.knotted_splines import SPLINE
from chipload.program.gcode.mirror import mirror
from chipload.program.gcode.modal import USER_M, check_codes, code_text, motion_of, motion_of_group_one, unused_letters
from chipload.program.gcode.motion import ControllerMotion
from chipload.program.gcode.state import NO_MOTION, State
from chipload.program.gcode.words import Block
from chipload.program.path_mode import PathControl, PathMode

_MESSAGE = re.compile(r"\s*(msg|debug|print)\s*,(.*)", re.IGNORECASE | re.DOTALL)
_OTHER = re.compile(
    r"\s*(log|logopen|logappend|logclose|probeopen|probeclose|py|abort)\b(.*)", re.IGNORECASE | re.DOTALL
)
_READ = re.compile(r"#(?:([0-9]{1,6})|<([^<>]*)>)")
_FORMAT = re.compile(r"%(?:d|f|\.[0-9]f)")
#: words that change a cut on some controllers: roundings, spirals, whole turns
CONTOUR = "ijklpqr"
#: characters of a comment that are kept
LONGEST = 1000
#: states saved by M70 and M73
MOST_SAVED = 100
#: words of a tool number
LARGEST_TOOL = 99_999_999

_COOLANT = {7: ("mist", True), 8: ("flood", True)}
_IGNORED = {
    **dict.fromkeys((7, 8, 9), ("nc-coolant", "coolant")),
    **dict.fromkeys((48, 49, 50, 51, 52, 53), ("nc-override", "permission to override")),
    **dict.fromkeys((62, 63, 64, 65, 67, 68), ("nc-output", "an output")),
}
_SAVED = (
    "scale", "plane", "feed_mode", "path", "path_mode", "absolute", "absolute_centre", "old_level", "diameter", "feed",
    "feed_turning", "speed", "sense", "surface", "flood", "mist",
)  # fmt: skip


def path_mode(code: int, words: dict[str, float], scale: float) -> PathMode:
    """What G61, G61.1 or G64 asks for at joints; without Q the naive tolerance is P.

    >>> path_mode(640, {"p": 0.01}, 1.0), path_mode(611, {}, 1.0)
    ((3.0, 0.01, 0.01), (1.0, 0.0, 0.0))
    """
    if code != 640:
        return float(PathControl.EXACT_STOP if code == 611 else PathControl.EXACT_PATH), 0.0, 0.0
    tolerance = max(words.get("p", 0.0), 0.0) * scale
    naive = max(words["q"], 0.0) * scale if "q" in words else tolerance
    return float(PathControl.CONTINUOUS), tolerance, naive


class BlockInterpreter:
    """Carries out blocks on a controller."""

    def __init__(self, controller: Controller):
        self.c = controller
        mirror(controller)
        self.motion = ControllerMotion(controller)
        #: state saved by M70 or M73, one for each level of call; True: M73
        self.saved: dict[int, tuple[bool, State]] = {}

    def execute(self, block: Block) -> bool:
        """Carry out one block; whether the program ends."""
        c, state = self.c, self.c.state
        rules = c.control.modal
        codes = check_codes(block, rules)
        lasting = 52 if self.motion.splines.spline is not None else state.motion
        if rules.cycle_group:
            motion = motion_of_group_one(block, codes, state)
            if codes.get("cycle") == NO_MOTION:
                self.motion.drilling.end()
        else:
            motion = motion_of(block, codes, lasting)
        if motion < 0 and lasting == 52 and "p" in block.words and "motion" not in codes:
            motion = 52
        if motion < 0 and self.motion.knotted.is_open and "k" in block.words and "motion" not in codes:
            motion = SPLINE
        for letter in unused_letters(block, motion):
            message = f"{letter.upper()}{block.words[letter]:g}: no code of the block uses it"
            if c.strict:
                raise InputError(f"{message}: remove it")
            if motion in (10, 20, 30) and letter in CONTOUR:
                c.leave_out("nc-unused-word", f"{message}, and it may change the motion")
            else:
                c.refused("nc-unused-word", message)
            del block.words[letter]
        if codes.get("once") == 40 and motion in (20, 30) and "p" in block.words:
            raise InputError(f"G4 with {code_text(motion)}: both use P: write two blocks")
        for text in block.comments:
            self.comment(text)
        self._speeds(block, codes)
        self._tool(block)
        self._machine(block)
        self._modes(block, codes)
        axes = targets.axes(c, block)
        once = codes.get("once", -1)
        self._once(block, once, axes)
        if motion >= 0:
            c.place(axes, motion)
            self.motion.move(block, motion, once == 530)
        return self._stop(block)

    # -- comments --------------------------------------------------------------------------------------------------

    def comment(self, text: str) -> None:
        """A message is a finding; any other comment labels the motions that follow."""
        c = self.c
        message = _MESSAGE.match(text)
        if message is not None:
            text_out = message[2] if message[1].lower() == "msg" else self._fill_message(message[2])
            code = "nc-print" if message[1].lower() == "print" else "nc-message"
            c.note(code, text_out.strip()[:LONGEST])
            return
        other = _OTHER.match(text)
        if other is not None:
            c.note("nc-comment-ignored", f"({text.strip()[:LONGEST]}): is ignored, no log is written")
            return
        plain = "".join(x for x in " ".join(text.split()) if x.isprintable())[:LONGEST]
        if plain:
            label = c.track.label(plain)
            if label != c.label:
                c.label = label
                c.changed()

    def _fill_message(self, text: str) -> str:
        """A message with the values of its parameters."""
        parameters = self.c.parameters
        form = "%f"

        def value(found: re.Match[str]) -> str:
            nonlocal form
            if found[0].startswith("%"):
                form = found[0]
                return ""
            name = "".join((found[2] or "").lower().split())
            key: int | str = int(found[1]) if found[1] else name
            try:
                number = parameters.read(key)
            except InputError:
                return "######"
            digits = 0 if form == "%d" else int(form[2]) if form != "%f" else 6
            # no -0
            return f"{round(number, digits) + 0.0:.{digits}f}"

        return re.sub(f"{_READ.pattern}|{_FORMAT.pattern}", value, text[: 4 * LONGEST])

    # -- speeds and tools ------------------------------------------------------------------------------------------

    def _speeds(self, block: Block, codes: dict[str, int]) -> None:
        c, state, words = self.c, self.c.state, block.words
        if "$" in words and integer_of(words["$"], "$") != 0:
            raise InputError(f"${words['$']:g}: there is one spindle, 0")
        spindle = codes.get("spindle")
        if spindle is not None:
            state.surface = spindle == 960
            c.changed()
            if state.surface:
                c.note("nc-surface-speed", "G96: S is a surface speed: the spindle speed is not known here")
        feed = codes.get("feed")
        if feed is not None:
            state.feed_mode = feed
            if feed != 930:
                state.feed = state.feed_turning = 0.0
            c.changed()
        if "f" in words:
            if not TAPPING.intersection(block.g):
                c.feed_of_cuts = None
            if words["f"] < 0.0:
                raise InputError(f"F{words['f']:g}: a feed must be 0 or more")
            if state.feed_mode != 930:
                state.feed, state.feed_turning = words["f"] * state.scale, words["f"]
                c.changed()
                units = codes.get("units")
                if units is not None and (units == 200) != (state.scale != 1.0):
                    c.note(
                        "nc-feed-before-units",
                        f"F{words['f']:g}: is read in the units before the {code_text(units)} of this block",
                    )
        if "s" in words:
            if words["s"] < 0.0:
                raise InputError(f"S{words['s']:g}: a spindle speed must be 0 or more")
            state.speed = words["s"]
            c.changed()

    def _tool(self, block: Block) -> None:
        c, state, words = self.c, self.c.state, block.words
        if "t" in words:
            number = integer_of(words["t"], "T")
            if not 0 <= number <= LARGEST_TOOL:
                raise InputError(f"T{number}: must be from 0 to {LARGEST_TOOL}")
            c.find_tool(number, "T")
            state.selected = number
        for m in block.m:
            if 62 <= m <= 68:
                self._output(block, m)
        if 6 in block.m:
            c.not_compensated("M6")
            state.tool, state.sense = state.selected, 0
            c.changed()
        elif 61 in block.m:
            number = integer_of(words.get("q", -1.0), "Q")
            if number < 0:
                raise InputError("M61: Q is missing: the number of the tool, 0 or more")
            c.find_tool(number, "Q")
            state.tool = number
            c.changed()

    def _output(self, block: Block, m: int) -> None:
        words = block.words
        if m <= 65 and words.get("p", -1.0) < 0.0:
            raise InputError(f"M{m}: P is missing: the number of the output, 0 or more")
        if m in (67, 68) and words.get("e", -1.0) < 0.0:
            raise InputError(f"M{m}: E is missing: the number of the output, 0 or more")
        if m == 66:
            if "p" in words and "e" in words:
                raise InputError("M66: P and E: one input at a time")
            if "e" in words and words.get("l", 0.0) != 0.0:
                raise InputError("M66: an analogue input is read at once: L must be 0")
            self.c.leave_out("nc-input", "M66: an input of the machine is not known here: #5399 is taken as 0")
            self.c.parameters.numbered[5399] = 0.0

    def _machine(self, block: Block) -> None:
        """Spindle, saved states, coolant, overrides and the builder's own codes."""
        c, state = self.c, self.c.state
        for m in block.m:
            if m == 19 and not 0.0 <= block.words.get("r", 0.0) <= 360.0:
                raise InputError(f"M19: R{block.words['r']:g}: must be from 0 to 360")
            if m in (3, 4, 5, 19):
                # an oriented spindle stands still
                state.sense = {3: 1, 4: -1}.get(m, 0)
                self.motion.drilling.started = False
                c.changed()
            elif m in (70, 71, 72, 73):
                self._save(m)
            elif m in _IGNORED:
                if m in (7, 8):
                    setattr(state, *_COOLANT[m])
                elif m == 9:
                    state.flood = state.mist = False
                code, what = _IGNORED[m]
                c.once(code, f"M{m}: {what} does not affect the path; it is ignored")
            elif m in USER_M:
                c.once("nc-user-code", f"M{m}: is a code of the machine builder: its effect is not known here")
            elif m in (428, 429, 430):
                state.tcp, state.tcp_by_length = m == 428, False
                c.changed()
                c.once("nc-tip", f"M{m}: taken as LinuxCNC's {'tip control on' if state.tcp else 'tip control off'}")

    def _save(self, m: int) -> None:
        c, level = self.c, self.c.level
        if m in (70, 73):
            self.saved[level] = (m == 73, replace(c.state))
        elif m == 71:
            self.saved.pop(level, None)
        elif level not in self.saved:
            raise InputError("M72: nothing is saved: write M70 or M73 first")
        else:
            self.restore(self.saved[level][1])

    def restore(self, saved: State) -> None:
        """The modes that were saved."""
        c = self.c
        for name in _SAVED:
            setattr(c.state, name, getattr(saved, name))
        if c.state.datum.number != saved.datum.number:
            number = saved.datum.number
            offsets.select(c, 530 + 10 * number if number < 7 else 584 + number)
        if c.state.compensation != saved.compensation and saved.compensation == 400:
            c.compensate(400)
        c.changed()

    def left(self, level: int) -> None:
        """A call of this level ends: M73 restores."""
        kept = self.saved.pop(level, None)
        if kept is not None and kept[0]:
            self.restore(kept[1])

    # -- modes -----------------------------------------------------------------------------------------------------

    def _modes(self, block: Block, codes: dict[str, int]) -> None:
        c, state, words = self.c, self.c.state, block.words
        if codes.get("once") == 40:
            if words.get("p", -1.0) < 0.0:
                raise InputError("G4: P is missing: the time [s], 0 or more")
            c.dwell(words["p"])
        plane = codes.get("plane")
        if plane is not None:
            if plane != state.plane:
                c.not_compensated(code_text(plane))
            state.plane = plane
            c.changed()
        if "units" in codes:
            state.scale = 25.4 if codes["units"] == 200 else 1.0
        if "lathe" in codes:
            state.diameter = codes["lathe"] == 70
        if "compensation" in codes:
            c.compensate(codes["compensation"], words.get("d"), words.get("l"))
        if "length" in codes:
            offsets.length_offset(c, block, codes["length"], targets.axes(c, block))
        if "offset" in codes:
            offsets.select(c, codes["offset"])
        if "path" in codes:
            c.not_compensated("a change of path control")
            state.path = codes["path"]
            state.path_mode = path_mode(state.path, words, state.scale)
            c.changed()
            tolerances = "".join(f" {x.upper()}{words[x]:g}" for x in "pqr" if x in words and state.path == 640)
            c.note("nc-path-mode", f"{code_text(state.path)}{tolerances}")
        if "distance" in codes:
            state.absolute = codes["distance"] == 900
        if "centre" in codes:
            state.absolute_centre = codes["centre"] == 901
        if "retract" in codes:
            state.old_level = codes["retract"] == 980

    def _once(self, block: Block, once: int, axes: dict[int, float]) -> None:
        c = self.c
        if once == 100:
            offsets.set_data(c, block, axes)
        elif once in (280, 300):
            offsets.go_home(c, once, axes, targets.end(c, block))
        elif once in (281, 301):
            offsets.keep_point(c, once)
        elif once in (520, 920, 921, 922, 923):
            offsets.shift(c, once, axes)

    def _stop(self, block: Block) -> bool:
        ends = False
        for m in block.m:
            if m in (0, 1, 60):
                self.c.note("nc-stop", f"M{m}: the program stops until it is started again")
            elif m in (2, 30):
                self.finish()
                ends = True
        return ends

    def finish(self) -> None:
        """The program ends: what waits is carried out."""
        if self.motion.splines.spline is not None:
            raise InputError("the program ends and G5.2 is open: close it by G5.3")
        self.c.compensate(400)
