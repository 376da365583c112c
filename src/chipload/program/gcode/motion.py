"""What the codes of motion do: straight lines, arcs, splines, probing and canned cycles.

Notation: a word is in units of the text; ``scale`` mm in one of them. Codes of G are in tenths.

Reference: LinuxCNC 2.9, "G-Codes".
"""

from __future__ import annotations

import math

from chipload.errors import InputError
from chipload.program.commands import LINE, PLANE_AXES, PROBE, RAPID
from chipload.program.gcode import arcs
from chipload.program.gcode.controller import PLANES, Controller
from chipload.program.gcode.cycles import CYCLES
from chipload.program.gcode.drilling import Drilling
from chipload.program.gcode.expression import integer_of
from chipload.program.gcode.knotted_splines import SPLINE, KnottedSplines
from chipload.program.gcode.modal import GROUP_ONE, code_text
from chipload.program.gcode.offsets import in_machine_unknown, note_machine_coordinates, probe_motion
from chipload.program.gcode.splines import Splines
from chipload.program.gcode.state import LINEAR, NO_MOTION, Nine, put
from chipload.program.gcode.synchronised import run_synchronised
from chipload.program.gcode.targets import axes, end, rate
from chipload.program.gcode.tilted_plane import turn
from chipload.program.gcode.words import Block

#: a touch is sought over at least this [mm]
LEAST_PROBE = 0.254
MOST_TURNS = 100_000
#: a rapid to a lower height of the machine [mm], counted from the top of its travel, is no retraction
RETRACTED_MM = -100.0


class ControllerMotion:
    """The motions of one controller, with what lasts between their blocks."""

    def __init__(self, controller: Controller):
        self.c = controller
        self.drilling = Drilling(controller)
        self.splines = Splines(controller)
        self.knotted = KnottedSplines(controller)

    def move(self, block: Block, code: int, machine: bool) -> None:
        """Carry out the motion ``code`` of a block; ``machine``: G53 stands in it."""
        state = self.c.state
        if self.splines.spline is not None and code not in (52, 53):
            raise InputError(f"{code_text(code)}: G5.2 is open: close it by G5.3")
        if code != SPLINE:
            self.knotted.end()
        if code != 50:
            self.splines.tangent = (0.0, 0.0)
        if code not in CYCLES:
            self.drilling.end()
        if code in (0, 10):
            self._straight(block, code, machine)
        elif machine:
            raise InputError(f"{self.c.machine_word} with {code_text(code)}: goes with G0 and G1 only")
        elif code in (20, 30):
            self._arc(block, code)
        elif code == SPLINE:
            self.knotted.move(block)
        elif code in (50, 51, 52, 53):
            self.splines.move(block, code)
            if code in (50, 51):
                # they last for their own block
                return
            code = 52 if self.splines.spline is not None else NO_MOTION
        elif code in CYCLES:
            self.drilling.move(block, code)
        elif 382 <= code <= 385:
            self._probe(block, code)
        elif code in (330, 331):
            run_synchronised(self.c, block, code)
        elif code != NO_MOTION:
            raise InputError(f"{code_text(code)}: threading cycles of a lathe are not read: write the moves out")
        state.motion = code
        if code in GROUP_ONE:
            state.group_one = code

    # -- lines and arcs --------------------------------------------------------------------------------------------

    def _straight(self, block: Block, code: int, machine: bool) -> None:
        c, state = self.c, self.c.state
        pace = rate(self.c, block, "G1") if code == 10 else None
        if machine:
            if not state.absolute and 900 not in block.g:
                raise InputError(f"{c.machine_word}: goes with G90 only")
            c.not_compensated(c.machine_word)
            target = axes(self.c, block)
            lower = code == 10 or target.get(2, 0.0) < RETRACTED_MM
            if in_machine_unknown(c, c.machine_word, target, lower):
                return
            note_machine_coordinates(c, c.machine_word)
            to = c.position(put(c.machine_position(), target))
        else:
            goal = end(self.c, block)
            to = self._turned_end(goal)
            if to != goal and to == state.at:
                return
        c.straight(LINE if code == 10 else RAPID, to, pace)

    def _turned_end(self, to: Nine) -> Nine:
        """An end in a tilted plane once the rotary axes that it moves have turned: what it gives of X Y Z, the rest
        where that has brought the tip.
        """
        c, at = self.c, self.c.state.at
        if c.state.datum.tilt is None or to[3:6] == at[3:6]:
            return to
        turn(c, c.state.datum.to_machine((*at[:3], *to[3:])))
        return put(c.state.at, {k: to[k] for k in (*range(3), *range(6, 9)) if to[k] != at[k]})

    def _arc(self, block: Block, code: int) -> None:
        c, state, words = self.c, self.c.state, block.words
        if state.plane % 10:
            raise InputError(f"{code_text(code)}: arcs lie in the planes of G17, G18 and G19")
        pace = rate(self.c, block, code_text(code))
        turns = 1
        if "p" in words:
            turns = integer_of(words["p"], "P")
            if not 1 <= turns <= MOST_TURNS:
                raise InputError(f"P{turns}: whole turns of an arc must be from 1 to {MOST_TURNS}")
        to, at, inch = end(self.c, block), state.at, state.scale != 1.0
        first, second, along = PLANE_AXES[PLANES[state.plane]]
        left = code == 30
        if "r" in words:
            if words.keys() & {"i", "j", "k"}:
                raise InputError("R with I, J or K: an arc has a radius or a centre, not both")
            r = words["r"] * state.scale
            centre = arcs.centre_from_radius(at[first], at[second], to[first], to[second], r, left, inch)
        else:
            letters = "ijk"
            if not words.keys() & set(letters):
                raise InputError(f"{code_text(code)}: neither R nor I, J, K: an arc needs its radius or its centre")
            if letters[along] in words:
                raise InputError(f"{letters[along].upper()}: is not a coordinate of the arc's plane")
            if state.absolute_centre:
                for k in (first, second):
                    if letters[k] not in words:
                        raise InputError(f"{letters[k].upper()}: is missing: a centre by G90.1 needs both")
                centre = words[letters[first]] * state.scale, words[letters[second]] * state.scale
            else:
                centre = (
                    at[first] + words.get(letters[first], 0.0) * state.scale,
                    at[second] + words.get(letters[second], 0.0) * state.scale,
                )
            arcs.check_centre(at[first], at[second], to[first], to[second], *centre, inch)
        c.arc(to, centre, turns if left else -turns, pace)

    def _probe(self, block: Block, code: int) -> None:
        c, state = self.c, self.c.state
        c.not_compensated(code_text(code))
        if state.feed_mode != 940 or state.feed == 0.0:
            raise InputError(f"{code_text(code)}: needs a feed per minute (G94, F)")
        to = end(self.c, block)
        if math.dist(state.at, to) < LEAST_PROBE:
            raise InputError(f"{code_text(code)}: ends less than {LEAST_PROBE:g} mm from where it starts: go farther")
        probe_motion(c, "nc-probe", code_text(code), "the probe touches")
        c.straight(PROBE, to)
        for k, axis in enumerate(to):
            c.parameters.numbered[5061 + k] = axis / (c.machine_scale if k in LINEAR else 1.0)
        c.parameters.numbered[5070] = 0.0
