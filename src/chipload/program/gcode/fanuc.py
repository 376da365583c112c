"""Fanuc's dialect where it differs from LinuxCNC's in what matters.

Notation: codes of G are in tenths. P of a dwell is in ms, X and U of G4 in s; K of a cycle repeats it; a series of
cycles returns to the level where it began (G98) until told otherwise; M98 P51234 calls O1234 five times. After M29,
and in G84.2 and G84.3, tapping starts the spindle itself. Fine boring (G76) is carried out without its shift in the
bottom of the hole.

Refused: macros (G65, G66, IF, WHILE, GOTO), turned and scaled coordinates (G16, G51, G68), tilted planes (G68.2), tool
vectors (G43.5), G10 L20. Noted and left out: smoothing and look-ahead (G5.1, G8), tool offsets by G10 L10 to L13.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

from chipload.errors import InputError, Severity
from chipload.program.gcode.controller import Controller
from chipload.program.gcode.cycles import CYCLES
from chipload.program.gcode.dialect import UNREAD, Dialect, lenient
from chipload.program.gcode.modal import GROUP_OF, shown
from chipload.program.gcode.offsets import choose
from chipload.program.gcode.words import Block, bare, read_block

_MACRO = re.compile(r"(?:/[1-9]?)?(?:n[0-9]+)?(if\[|while\[|goto|end[1-9]|do[1-9]|popen|pclos|dprnt|bprnt|setvn)")
_SKIP = re.compile(r"^/[1-9]")
#: a whole number that is not 0: with 0 the point makes no difference
_NO_POINT = re.compile(r"[XYZIJKR][ \t]*[-+]?0*[1-9][0-9]*(?![0-9.])(?=[^\n(]*)", re.IGNORECASE)
_COMMENT = re.compile(r"\([^()\n]*\)")

REFUSED = {
    160: "polar coordinates",
    510: "scaling",
    511: "mirrored coordinates",
    650: "a macro",
    660: "a macro",
    661: "a macro",
    680: "turned coordinates",
    682: "a tilted plane",
    683: "a tilted plane",
    684: "a tilted plane",
    435: "tip control by vectors",
    440: "a negative tool length",
    71: "cylindrical interpolation",
    121: "polar interpolation",
    1120: "polar interpolation",
    310: "a skip by a signal",
}
#: motions that are left out: back boring, threading, involutes, splines
LEFT_OUT = frozenset({870, 330, 61, 62})
#: tapping: LinuxCNC's code and the M code that starts its spindle
TAPPING = {840: (840, 3), 740: (740, 4), 842: (840, 3), 843: (740, 4)}
FINE_BORING, BORING = 760, 860
#: end of what is not on, or what does not concern the path
IDLE = frozenset(
    {50, 51, 80, 81, 90, 110, 130, 131, 150, 220, 230, 250, 260, 270, 491, 495, 500, 501, 600, 620, 630, 641, 670}
    | {690, 691, 692, 693, 1130}
)
EXTENDED = 541


@dataclass(frozen=True)
class Fanuc(Dialect):
    """See above."""

    def begin(self, c: Controller, text: str) -> None:
        """State at power on, and numbers without a decimal point."""
        c.state.old_level = True
        plain = _COMMENT.sub(lambda found: " " * len(found[0]), text)
        found = _NO_POINT.search(plain)
        if found is not None:
            said = f"{found[0]!r} has no decimal point: taken as a whole unit, not as the least increment"
            c.findings.add("nc-no-point", 1 + plain.count("\n", 0, found.start()), said, Severity.UNPROVEN)

    def read(self, raw: str, c: Controller) -> Block | None:
        """The block of a line, in LinuxCNC's words."""
        text, comments = bare(raw)
        text = _SKIP.sub("/", text)
        macro = _MACRO.match(text)
        if macro is not None:
            raise InputError(f"{macro[1].upper()}: macro statements are not read: write out what they do")
        block = read_block(text, comments, c.parameters)
        for code in block.g:
            if code in REFUSED:
                raise InputError(f"{shown(code)}: {REFUSED[code]}: not read; write the moves out")
        self._adapt(block, c)
        return lenient(block, c, UNREAD | LEFT_OUT)

    def _adapt(self, block: Block, c: Controller) -> None:
        words, g = block.words, block.g
        self._holes(block, c)
        idle = [code for code in g if code in IDLE]
        if 50 in idle and not (words.get("p", 0.0) >= 1000.0 or "x" not in words):
            raise InputError("G5: splines are not read: write the moves out")
        for code in idle:
            if code in (51, 50, 80, 81):
                c.once("nc-ignored", f"{shown(code)}: look-ahead and smoothing do not concern the path")
            g.remove(code)
        if idle:
            for letter in "pqr" if not any(x in CYCLES or x in (20, 30) for x in g) else "":
                words.pop(letter, None)
        if 40 in g:
            seconds = words.pop("x", words.pop("u", None))
            if seconds is None and "p" in words:
                seconds = words["p"] / 1000.0
            if seconds is not None:
                words["p"] = seconds
        if EXTENDED in g or (540 in g and "p" in words and 40 not in g):
            self._extended(block, c)
        if 100 in g and words.get("l") != 2.0:
            if words.get("l") == 20.0:
                raise InputError("G10 L20: more work offsets: not read; give them as G54 to G59")
            c.note("nc-ignored", "G10: offsets of tools that the program sets are left out")
            g.remove(100)
            for letter in "lprqxyz":
                words.pop(letter, None)
        motion = next((x for x in g if x in CYCLES), c.state.motion)
        if motion in CYCLES:
            if "k" in words:
                words["l"] = words.pop("k")
            if "p" in words and 40 not in g and 98 not in block.m:
                words["p"] /= 1000.0

    def _holes(self, block: Block, c: Controller) -> None:
        """Tapping and fine boring in LinuxCNC's words."""
        words, g = block.words, block.g
        if 29 in block.m:
            block.m.remove(29)
            c.rigid = True
        for code in [code for code in g if code in TAPPING]:
            own, starts = TAPPING[code]
            g[g.index(code)] = own
            if c.state.sense == 0 and (c.rigid or code != own) and not {3, 4} & set(block.m):
                block.m.append(starts)
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
            c.rigid = c.rigid and 800 not in g

    @staticmethod
    def _moves(g: list[int]) -> bool:
        """Whether a code of motion or G80 stands among the codes."""
        return any(GROUP_OF.get(code) in ("motion", "none") for code in g)

    def _extended(self, block: Block, c: Controller) -> None:
        """G54.1 P: a work offset whose origin is not known here."""
        number = block.words.pop("p", 0.0)
        if number != int(number) or not 1 <= number <= 300:
            raise InputError(f"G54.1 P{number:g}: P must be from 1 to 300")
        block.g = [code for code in block.g if code not in (EXTENDED, 540)]
        choose(c, f"G54.1 P{number:g}", 9 + int(number))

    def call(self, words: dict[str, float]) -> tuple[str, int]:
        """M98 P1234 L5 or M98 P51234."""
        p = words.get("p", 0.0)
        if "l" not in words and p > 9999.0 and p == int(p):
            times, p = divmod(int(p), 10_000)
            words = {"p": float(p), "l": float(times)}
        return super().call(words)
