"""Canned cycles block by block: what lasts in a series of holes, and the way from hole to hole.

Notation: a series begins with the first cycle after another motion; ``level`` is where it began along the normal of the
plane. Heights are in units of the text: pecks add up as they do there.

Reference: LinuxCNC 2.9, "Canned Cycles"; the way between holes is that which its interpreter was observed to take.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from chipload.errors import InputError, Severity
from chipload.program.commands import DWELL, LINE, PLANE_AXES, RAPID
from chipload.program.gcode import cycles
from chipload.program.gcode.controller import PLANES, Controller
from chipload.program.gcode.expression import integer_of
from chipload.program.gcode.modal import code_text
from chipload.program.gcode.state import put
from chipload.program.gcode.targets import axes, polar, rate
from chipload.program.gcode.words import Block
from chipload.program.path_mode import PathControl, PathMode

#: heights that differ by less are one [units of the text]
SAME = 1e-9
MOST_REPEATS = 100_000
#: a cycle positions exactly, whatever the program asks for at joints
EXACT: PathMode = (float(PathControl.EXACT_PATH), 0.0, 0.0)


@dataclass(frozen=True)
class Series:
    """What a canned cycle keeps from block to block [units of the text]; ``level`` where the series began."""

    code: int
    level: float
    r: float
    bottom: float
    peck: float | None = None
    dwell: float | None = None
    i: float | None = None
    j: float | None = None
    k: float | None = None


class Drilling:
    """The canned cycles of one controller."""

    def __init__(self, controller: Controller):
        self.c = controller
        self.series: Series | None = None
        #: a tapping cycle has started the spindle, and stops it when it ends
        self.started = False

    def end(self) -> None:
        """The series of holes ends (G80); a spindle that its cycle has started stops, its own feed ends."""
        self.series = None
        if self.started:
            self.started = False
            self.c.state.sense = 0
            self.c.changed()
        if self.c.feed_of_cuts is not None:
            self.c.state.feed, self.c.state.feed_turning = self.c.feed_of_cuts
            self.c.feed_of_cuts = None
            self.c.changed()

    def _start(self, code: int) -> None:
        """Start a spindle at rest where the cycle of this control does."""
        state, which = self.c.state, self.c.control.cycles.starts_spindle
        tapping = code in cycles.TAPPING
        # a Haas, and the cycles of a Brother that state the pitch, turn the spindle themselves
        own = which == "all" or self.c.feed_of_cuts is not None
        if state.sense == 0 and state.speed > 0.0 and (which == "all" or (which == "tapping" and tapping)):
            state.sense = -1 if code == 740 else 1
            self.started = tapping
            self.c.once("nc-cycle-spindle", f"{code_text(code)}: the spindle is at rest: the cycle starts it")
            self.c.changed()
        elif tapping and own and state.speed > 0.0 and state.sense != (-1 if code == 740 else 1):
            # a tap turns as its cycle asks for, whatever the spindle did before
            state.sense, self.started = -1 if code == 740 else 1, True
            self.c.once("nc-cycle-spindle", f"{code_text(code)}: the cycle turns the spindle the other way")
            self.c.changed()

    def move(self, block: Block, code: int) -> None:
        """Carry out the cycle ``code`` over the holes of a block."""
        c, state, words = self.c, self.c.state, block.words
        c.not_compensated(code_text(code))
        for axis in "abcuvw":
            if axis in words:
                raise InputError(f"{axis.upper()}: is not allowed in a canned cycle")
        if state.plane % 10:
            raise InputError(f"{code_text(code)}: cycles lie in the planes of G17, G18 and G19")
        if state.feed_mode == 930:
            raise InputError(f"{code_text(code)}: a cycle has no inverse time: write G94 and F")
        if state.feed_mode == 950 and state.speed == 0.0 and state.feed != 0.0:
            message = f"{code_text(code)}: feed per revolution (G95) and no spindle speed"
            c.once("nc-feed-unknown", message, Severity.UNPROVEN)
        else:
            rate(self.c, block, code_text(code))
        first, second, along = PLANE_AXES[PLANES[state.plane]]
        scale, old = state.scale, self.series
        self._start(code)
        series = self._sticky(block, code, old, "xyz"[along], state.at[along] / scale)
        repeats = integer_of(words.get("l", 1.0), "L")
        # L0 or K0 of a Fanuc states a cycle and drills no hole
        least = 0 if c.control.cycles.zero_repeats else 1
        if not least <= repeats <= MOST_REPEATS:
            raise InputError(f"L{repeats}: repeats of a cycle must be from {least} to {MOST_REPEATS}")
        if repeats == 0:
            self.series = series
            return
        r, bottom, level = series.r, series.bottom, series.level
        if not state.absolute and not c.control.cycles.keeps_places:
            r += level
            bottom += r
        back = code == cycles.FANUC_BACK_BORING
        if r < bottom and not back:
            raise InputError(f"R{r:g}: lies below the bottom of the hole, {bottom:g}: raise R")
        if self.c.returns_to_level and self.c.return_level is not None:
            clear = max(self.c.return_level, r)
        else:
            clear = max(level, r) if state.old_level or back else r
        hole = self._hole(series, code, along, first, second, r, bottom, clear)
        self.series = series
        given = axes(self.c, block)

        def go(motion: int, a: float, b: float, height: float) -> None:
            c.straight(motion, put(state.at, {first: a, second: b, along: height * scale}))

        height = state.at[along] / scale
        if level < r:
            go(RAPID, state.at[first], state.at[second], r)
            height = r
        asked, state.path_mode = state.path_mode, EXACT
        c.changed()
        try:
            self._drill(block, code, hole, given, max(height, clear), repeats, go)
        finally:
            state.path_mode = asked
            c.changed()

    def _drill(
        self, block: Block, code: int, hole: cycles.Hole, given: dict[int, float], height: float, repeats: int,
        go: Callable[[int, float, float, float], None],
    ) -> None:  # fmt: skip
        """Drill the holes of a block from ``height``; ``go``: a motion to a place and a height [units of the text]."""
        c, state, words = self.c, self.c.state, block.words
        first, second, _ = PLANE_AXES[PLANES[state.plane]]
        back = code == cycles.FANUC_BACK_BORING
        a, b = state.at[first], state.at[second]
        pole = "@" in words or "^" in words
        for count in range(repeats):
            if count and c.polar is not None and not state.absolute:
                # each hole turns on about the pole
                c.polar_words = None
                given = axes(c, block)
            if pole:
                to = put(state.at, polar(self.c, block, given))
                a, b = to[first], to[second]
            elif state.absolute:
                a, b = given.get(first, a), given.get(second, b)
            else:
                a, b = a + given.get(first, 0.0), b + given.get(second, 0.0)
            go(RAPID, a, b, height)
            if abs(height - hole.r) > SAME and not back:
                go(RAPID, a, b, hole.r)
            for kind, p, q, h, value in cycles.cycle_steps(code, a, b, hole):
                if kind in (RAPID, LINE):
                    go(kind, p, q, h)
                elif kind == DWELL:
                    c.dwell(value)
                elif kind == cycles.SPIN:
                    state.sense = int(value)
                    c.changed()
                else:
                    c.note("nc-stop", f"{code_text(code)}: the program waits for its operator, who retracts by hand")
            height = hole.clear
            c.track.spill()

    def _sticky(self, block: Block, code: int, old: Series | None, normal: str, here: float) -> Series:
        words = block.words
        if self.c.state.diameter and normal == "x":
            raise InputError(f"{code_text(code)}: no cycle along X with diameters (G7)")
        shares_data = self.c.control.cycles.keeps_data and old is not None
        shares_data = shares_data and cycles.FANUC_BACK_BORING not in (code, old.code if old is not None else code)
        if old is not None and shares_data and old.code != code:
            # Q and the letters of another cycle may mean something else there
            peck = old.peck if code in cycles.NEED_Q and old.code in cycles.NEED_Q else None
            old = replace(old, code=code, peck=peck, i=None, j=None, k=None)
        if old is None or old.code != code:
            if "r" not in words:
                raise InputError(f"{code_text(code)}: R is missing: where feeding begins")
            if normal not in words:
                raise InputError(f"{code_text(code)}: {normal.upper()} is missing: the bottom of the hole")
            new = Series(code, here if old is None else old.level, words["r"], words[normal])
        else:
            new = replace(old, r=words.get("r", old.r), bottom=words.get(normal, old.bottom))
        if self.c.control.cycles.keeps_places and not self.c.state.absolute:
            r = new.level + words["r"] if "r" in words else new.r
            new = replace(new, r=r, bottom=r + words[normal] if normal in words else new.bottom)
        new = replace(
            new,
            peck=words.get("q", new.peck),
            dwell=words.get("p", new.dwell),
            i=words.get("i", new.i),
            j=words.get("j", new.j),
            k=words.get("k", new.k),
        )
        if code in cycles.NEED_P and new.dwell is None and not self.c.control.cycles.dwell_optional:
            raise InputError(f"{code_text(code)}: P is missing: the time at the bottom")
        if code in cycles.NEED_Q and new.peck is None:
            raise InputError(f"{code_text(code)}: Q is missing: the depth of a peck")
        return new

    def _hole(
        self, series: Series, code: int, along: int, first: int, second: int, r: float, bottom: float, clear: float
    ) -> cycles.Hole:
        scale = self.c.state.scale
        shift, middle = (0.0, 0.0), 0.0
        if code == 870:
            offsets = (series.i, series.j, series.k)
            for letter, value in zip("IJK", offsets, strict=True):
                if value is None:
                    raise InputError(f"G87: {letter} is missing")
            i, j, k = (value or 0.0 for value in offsets)
            shift = (scale * (i, j, k)[first], scale * (i, j, k)[second])
            middle = (i, j, k)[along] + (0.0 if self.c.state.absolute else bottom)
        elif code == cycles.FANUC_BACK_BORING:
            shift = (scale * (series.i or 0.0), scale * (series.j or 0.0))
        dwell = series.dwell
        if dwell is not None and dwell < 0.0:
            raise InputError(f"P{dwell:g}: the time at the bottom must be 0 or more")
        return cycles.Hole(
            r,
            bottom,
            clear,
            self.c.tap_peck if code in cycles.TAPPING else series.peck or 0.0,
            dwell,
            self.c.state.sense,
            shift,
            middle,
            cycles.RETURN / scale,
            self.c.pecks if code in cycles.NEED_Q else cycles.PeckRule(),
            out=r if self.c.control.cycles.feeds_to_r else None,
        )
