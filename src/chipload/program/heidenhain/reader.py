"""Heidenhain conversational programs to Commands: the part of the language that CAM systems and shop programs use.

Notation: a block is a line; X Y Z [mm], A B C [rad]. L lines, CC and C arcs about a pole, CP helices, CYCL DEF 1
(pecking), 7 (datum shift), 9 (dwell), 19 (working plane, untilted only), 200 (drilling), 201 (reaming), 206 and 207
(tapping), TOOL DEF and TOOL CALL, labels, Q parameters
and jumps. What else a block says is a finding where it does not move anything, else it is refused with its line.

A motion in the machine's own coordinates (M91) is left out and said: where they lie in the work is not known.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from pathlib import Path

from chipload.errors import Finding, InputError, Severity
from chipload.files import read_regular
from chipload.program.commands import ARC, DWELL, LINE, RAPID, XY, Commands, Frame, Row, commands_from_rows
from chipload.program.heidenhain.cycles import Cycles
from chipload.program.heidenhain.formula import QParameters
from chipload.program.heidenhain.q_cycles import CYCLES, LEFT_OUT, SPIN, q_cycle_steps
from chipload.units import MM_PER, mm_s_from_mm_min, rad_s_from_rpm

#: largest text [characters], blocks that may be carried out, calls inside one another, findings that are kept
TOOL_DIGITS = 9
LONGEST_TEXT, MOST_BLOCKS, NESTED, KEPT = 100_000_000, 2_000_000, 20, 2000
#: largest coordinate [mm or deg]
FARTHEST = 1e6
AXES = "XYZABC"
_WORD = re.compile(r"(I?)([XYZABC])\s*([-+]?)\s*(Q\d+|\d+\.?\d*|\.\d+)")
_FEED = re.compile(r"\bF\s*(MAX|AUTO|Q\d+|\d+\.?\d*|\.\d+)")
_M = re.compile(r"\bM\s*(\d+)\b")
_SIDE = re.compile(r"\bR([LR0])\b")
_TURN = re.compile(r"\bDR([-+])")
_LABEL = re.compile(r"^LBL\s*(\d+)$")
_Q_VALUE = re.compile(r"Q\s*(\d+)\s*=\s*([-+]?\s*(?:Q\s*\d+|\d+\.?\d*|\.\d+))")
_SHIFT = re.compile(r"^(I?)([XYZABC])\s*(.+)$")


def read_heidenhain(
    text: str, *, name: str = "program", parameters: Mapping[int, float] | None = None
) -> tuple[Commands, tuple[Finding, ...]]:
    r"""The motions that a conversational program asks for, and what was noticed.

    Parameters
    ----------
    text : of the program
    name : for messages
    parameters : Q parameters by number that are known before: what SYSREAD would read too

    Raises
    ------
    InputError
        A block cannot be read, or asks for what is not known; the message gives the line.

    >>> commands, _ = read_heidenhain("BEGIN PGM A MM\nL X+1 Y+2 Z+3 FMAX\nL IX+4 F60\nEND PGM A MM")
    >>> commands.position[:, :3].tolist(), float(commands.feed[-1])
    ([[1.0, 2.0, 3.0], [5.0, 2.0, 3.0]], 1.0)
    """
    if len(text) > LONGEST_TEXT:
        raise InputError(f"{name}: {len(text)} characters: must be at most {LONGEST_TEXT}")
    run = _Run(text, name, parameters or {})
    try:
        run.go()
    except InputError as err:
        raise InputError(f"{name}: line {run.line}: {err}") from None
    return commands_from_rows(run.rows, run.frames, run.labels), tuple(run.findings)


def read_heidenhain_file(
    path: str | Path, parameters: Mapping[int, float] | None = None
) -> tuple[Commands, tuple[Finding, ...]]:
    """As :func:`read_heidenhain`, of a file."""
    path = Path(path)
    text = read_regular(path, path.name, LONGEST_TEXT).decode("utf-8", "replace")
    return read_heidenhain(text, name=path.name, parameters=parameters)


class _Run:
    """What holds while a program is carried out."""

    def __init__(self, text: str, name: str, parameters: Mapping[int, float]) -> None:
        self.blocks = [_bare(raw) for raw in text.splitlines()]
        self.name, self.line = name, 0
        self.q = QParameters(parameters)
        self.cycles = Cycles()
        self.rows: list[Row] = []
        self.findings: list[Finding] = []
        self.labels: list[str] = [name]
        self.frames: list[Frame] = [Frame()]
        self.at = [0.0] * 9
        self.unknown = set(range(3))
        self.pole: list[float | None] = [None, None]
        self.shift = [0.0] * 9
        self.scale = 1.0
        self.feed: float | None = None
        self.speed, self.sense = 0.0, 0.0
        self.tool, self.lengths = 0, dict[int, float]()
        self.tcp = False
        self.calls: list[int] = []
        self.repeats: dict[int, int] = {}
        self.places: dict[int, int] = {}
        for k, block in enumerate(self.blocks):
            found = _LABEL.match(block)
            if found and found[1] != "0":
                self.places.setdefault(int(found[1]), k)
        self.ended = False

    # -- the way through the blocks ---------------------------------------------------------------------------
    def go(self) -> None:
        at = 0
        for _ in range(MOST_BLOCKS):
            if at >= len(self.blocks):
                self.gap("heidenhain-no-end", "the text does not end with END PGM: it may have been cut off")
                return
            self.line = at + 1
            at = self.block(self.blocks[at], at)
            if self.ended:
                return
        raise InputError(f"more than {MOST_BLOCKS} blocks are carried out: the program does not seem to end")

    def block(self, text: str, at: int) -> int:
        """Carry out a block; returns the next one's index."""
        word = text.split(maxsplit=1)[0] if text else ""
        if not text:
            return at + 1
        if text.startswith("LBL"):
            return self._label(text, at)
        if text.startswith("CALL LBL"):
            return self._call(text, at)
        if re.match(r"FN\s*\d+", text):
            return self._function(text, at)
        if re.match(r"Q\s*\d+\s*=", text):
            number, formula = text[1:].split("=", 1)
            self.q.set(int(number), self.q.formula(formula))
        elif word in ("BEGIN", "END"):
            self._program(text, word)
        elif text.startswith(("TOOL DEF", "TOOL CALL")):
            self._tool(text)
        elif re.match(r"CYCLE? DEF\b", text):
            self._cycle(text)
        elif text.startswith("CYCL CALL"):
            self._motion(text[9:])
            self._drill()
        elif word in ("L", "C", "CC", "CP"):
            {"L": self._motion, "C": self._arc, "CC": self._pole, "CP": self._helix}[word](text[len(word) :])
        elif word == "STOP":
            self.note("nc-stop", "M0: the program stops until it is started again")
            self._functions(text)
        elif re.match(r"M\s*\d", text):
            self._functions(text)
        elif text.startswith("BLK FORM"):
            self.note("heidenhain-unused", text)
        else:
            raise InputError(f"{text[:60]!r}: is not read: take it out or write it as L and C blocks")
        return at + 1

    def _label(self, text: str, at: int) -> int:
        if not _LABEL.match(text):
            raise InputError(f"{text!r}: LBL must have a number")
        back = bool(re.match(r"^LBL\s*0$", text)) and len(self.calls) > 0
        return self.calls.pop() + 1 if back else at + 1

    def _place(self, number: str) -> int:
        if int(number) not in self.places:
            raise InputError(f"LBL {number} is not there")
        return self.places[int(number)]

    def _call(self, text: str, at: int) -> int:
        found = re.fullmatch(r"CALL LBL\s*(\d+)(?:\s+REP\s*(\d+)(?:\s*/\s*\d+)?)?", text)
        if found is None:
            raise InputError(f"{text!r}: CALL LBL must have a number, and REP how many times")
        place = self._place(found[1])
        if found[2] is None:
            if len(self.calls) >= NESTED:
                raise InputError(f"more than {NESTED} calls inside one another")
            self.calls.append(at)
            return place + 1
        left = self.repeats.get(at, int(found[2]))
        self.repeats[at] = left - 1
        if left > 0:
            return place + 1
        del self.repeats[at]
        return at + 1

    def _function(self, text: str, at: int) -> int:
        found = re.fullmatch(r"FN\s*(\d+)\s*:\s*(.*)", text)
        if found is None:
            raise InputError(f"{text!r}: FN must be written FN number: ...")
        number, body = int(found[1]), found[2]
        if number <= 5:
            hit = re.fullmatch(r"Q\s*(\d+)\s*=\s*(.+)", body)
            if hit is None:
                raise InputError(f"{text!r}: must be Q = ...")
            signs = {"DIV": "/", "SQRT": "SQRT"}
            formula = " ".join(signs.get(w, w) for w in hit[2].split())
            self.q.set(int(hit[1]), self.q.formula(formula))
        elif 9 <= number <= 12:
            hit = re.fullmatch(r"IF\s*(.+?)\s+(EQU|NE|GT|LT)\s*(.+?)\s+GOTO LBL\s*(\d+)", body)
            if hit is None or hit[2] != ("EQU", "NE", "GT", "LT")[number - 9]:
                raise InputError(
                    f"{text!r}: must be IF value {('EQU', 'NE', 'GT', 'LT')[number - 9]} value GOTO LBL number"
                )
            a, b = self.q.formula(hit[1]), self.q.formula(hit[3])
            if {"EQU": a == b, "NE": a != b, "GT": a > b, "LT": a < b}[hit[2]]:
                return self._place(hit[4]) + 1
        elif number == 18:
            hit = re.fullmatch(r"SYSREAD\s*Q\s*(\d+)\s*=.*", body)
            if hit is None:
                raise InputError(f"{text!r}: must be SYSREAD Q = ...")
            self.q.set(int(hit[1]), None)
            if self.q.values[int(hit[1])] is None:
                self.note("heidenhain-sysread", f"Q{hit[1]} comes from the controller and is not known here")
        elif number in (14, 15, 16, 20):
            self.note("heidenhain-unused", text)
        else:
            raise InputError(f"FN {number}: is not read: take it out")
        return at + 1

    # -- what is set ------------------------------------------------------------------------------------------
    def _program(self, text: str, word: str) -> None:
        if word == "END":
            self.ended = True
            return
        found = re.match(r"BEGIN PGM\s+(.*?)\s*\b(MM|INCH)\s*$", text)
        if found is None:
            raise InputError(f"{text!r}: must be BEGIN PGM name MM or INCH: lengths are not guessed")
        self.scale = MM_PER["mm" if found[2] == "MM" else "inch"]

    def _tool(self, text: str) -> None:
        found = re.match(r"TOOL (DEF|CALL)\s*(\d*)", text)
        assert found is not None
        if found[1] == "DEF":
            length = re.search(r"\bL\s*([-+]?[\d.]+)", text)
            if found[2] and length:
                self.lengths[int(found[2])] = _number(length[1]) * self.scale
            return
        spindle = re.search(r"\bS\s*(Q\d+|[\d.]+)", text)
        if spindle:
            self.speed = rad_s_from_rpm(self._amount(spindle[1]))
        if not found[2]:
            return
        if re.search(r"\b[XY]\b", text[found.end() :]):
            raise InputError(f"{text!r}: the spindle along X or Y is not read: must be along Z")
        if len(found[2]) > TOOL_DIGITS:
            raise InputError(f"TOOL CALL {found[2][:20]}...: must be at most {'9' * TOOL_DIGITS}")
        self.tool, self.sense = int(found[2]), 0.0
        if self.tool not in self.lengths:
            self.note("heidenhain-tool-unknown", f"tool {self.tool} has no TOOL DEF: its length counts as 0")
        self._frame()

    def _frame(self) -> None:
        tool, shift = [0.0] * 9, list(self.shift)
        tool[2] = self.lengths.get(self.tool, 0.0)
        self.frames.append(Frame(shift=shift, tool=tool))  # type: ignore[arg-type]

    def _cycle(self, text: str) -> None:
        found = re.match(r"CYCLE? DEF\s*(\d+)\s*(?:\.\s*(\d+))?\s*(.*)", text)
        if found is None:
            raise InputError(f"{text!r}: CYCL DEF must have a number")
        number, part, body = int(found[1]), int(found[2] or 0), found[3]
        if number == 7:
            if part > 0:
                hit = _SHIFT.match(body)
                if hit is None:
                    raise InputError(f"{text!r}: must be an axis and its shift")
                k = AXES.index(hit[2])
                value = self.q.formula(hit[3]) * (self.scale if k < 3 else math.pi / 180.0)
                value = value + self.shift[k] if hit[1] else value
                self.at[k] += self.shift[k] - value
                self.shift[k] = value
                self._frame()
            return
        for key, value in _Q_VALUE.findall(body):
            self.q.set(int(key), self.q.formula(value))
        dwell = self.cycles.define(number, part, body, self.scale)
        if dwell is not None:
            self._row(DWELL, self.at, feed=dwell)

    # -- motions ----------------------------------------------------------------------------------------------
    def _amount(self, text: str) -> float:
        return self.q.read(int(text[1:])) if text.startswith("Q") else _number(text)

    def _ends(self, text: str) -> tuple[list[float], set[int]]:
        """The end of a motion and which axes it names."""
        end, named = list(self.at), set()
        for step, letter, sign, value in _WORD.findall(text):
            k = AXES.index(letter)
            amount = self._amount(value) * (-1.0 if sign == "-" else 1.0)
            amount *= self.scale if k < 3 else math.pi / 180.0
            if not abs(amount) <= FARTHEST:
                raise InputError(f"{letter} = {amount:g}: must be at most {FARTHEST:g}")
            if step and k in self.unknown:
                raise InputError(f"I{letter}: where the axis stands is not known: give {letter} first")
            end[k] = end[k] + amount if step else amount
            named.add(k)
        return end, named

    def _motion(self, text: str) -> None:
        side = _SIDE.search(text)
        if side and side[1] != "0":
            raise InputError(f"R{side[1]}: radius compensation is not read: give the path of the tool's centre")
        fast, feed = self._feed(text)
        codes = [int(m) for m in _M.findall(text)]
        self._left_over(text)
        end, named = self._ends(text)
        self._before(codes)
        if named and 91 in codes:
            self.note("heidenhain-m91", "M91: a motion in the machine's own coordinates is left out")
            self.unknown |= {k for k in named if k < 3}
        elif named:
            if 92 in codes:
                raise InputError("M92: coordinates of the machine builder's point are not known here")
            self.at = end
            self.unknown -= named
            if fast:
                self._row(RAPID, end)
            else:
                self._row(LINE, end, feed=self._need(feed))
        self._after(codes)
        if 99 in codes or (self.cycles.modal and named):
            self._drill()

    def _pole(self, text: str) -> None:
        end, named = self._ends(text)
        for k in (0, 1):
            if k in named or not named:
                self.pole[k] = end[k]

    def _arc(self, text: str) -> None:
        turn = _TURN.search(text)
        if turn is None:
            raise InputError("C: DR+ or DR- is missing")
        fast, feed = self._feed(text)
        codes = [int(m) for m in _M.findall(text)]
        self._left_over(text)
        end, _ = self._ends(text)
        self._turn(end, 1 if turn[1] == "+" else -1, fast, feed, codes)

    def _helix(self, text: str) -> None:
        """CP IPA sweep IZ rise DR: about the pole from where the tool stands."""
        turn, sweep = _TURN.search(text), re.search(r"\bIPA\s*([-+]?)\s*(Q\d+|[\d.]+)", text)
        if turn is None or sweep is None:
            raise InputError("CP: IPA and DR must be given")
        fast, feed = self._feed(text)
        codes = [int(m) for m in _M.findall(text)]
        end, _ = self._ends(re.sub(r"\bIPA\s*[-+]?\s*(Q\d+|[\d.]+)", "", text))
        angle = math.radians(self._amount(sweep[2]) * (-1.0 if sweep[1] == "-" else 1.0))
        sense = 1 if turn[1] == "+" else -1
        if angle * sense < 0.0:
            raise InputError("CP: IPA and DR have different signs")
        x, y = self._centre()
        vx, vy = self.at[0] - x, self.at[1] - y
        end[0] = x + vx * math.cos(angle) - vy * math.sin(angle)
        end[1] = y + vx * math.sin(angle) + vy * math.cos(angle)
        turns = max(1, math.ceil(abs(angle) / math.tau - 1e-9))
        if turns > 10_000:
            raise InputError(f"CP: {turns} turns: must be at most 10000")
        self._turn(end, sense * turns, fast, feed, codes)

    def _centre(self) -> tuple[float, float]:
        x, y = self.pole
        if x is None or y is None:
            raise InputError("the pole is not known: give CC X Y first")
        return x, y

    def _turn(self, end: list[float], turns: int, fast: bool, feed: float | None, codes: list[int]) -> None:
        if {0, 1} & self.unknown:
            raise InputError("an arc begins where the tool stands, which is not known: move there first")
        x, y = self._centre()
        r0, r1 = math.hypot(self.at[0] - x, self.at[1] - y), math.hypot(end[0] - x, end[1] - y)
        if r0 < 1e-9 or abs(r1 - r0) > 0.02:
            raise InputError(
                f"an arc begins {r0:.6g} mm from its pole and ends {r1:.6g} mm from it: must agree to 0.02 mm"
            )
        if fast:
            raise InputError("an arc at FMAX is not read: give its feed")
        # the text rounds: the centre moves along the chord's bisector until both ends are as far
        dx, dy = end[0] - self.at[0], end[1] - self.at[1]
        chord = math.hypot(dx, dy)
        if chord > 1e-9:
            mx, my = 0.5 * (end[0] + self.at[0]), 0.5 * (end[1] + self.at[1])
            along = (-dy * (x - mx) + dx * (y - my)) / chord
            x, y = mx - dy / chord * along, my + dx / chord * along
        self._before(codes)
        self.at = end
        self._row(ARC, end, feed=self._need(feed), centre=(x, y), turns=turns)
        self._after(codes)

    def _feed(self, text: str) -> tuple[bool, float | None]:
        """Whether at rapid, and the feed that holds [mm/s]."""
        found = _FEED.search(text)
        if found is not None and found[1] == "AUTO":
            raise InputError("F AUTO: the feed of a tool table is not known: give a number")
        if found is not None and found[1] != "MAX":
            value = self._amount(found[1]) * self.scale
            if not 0.0 < value < FARTHEST:
                raise InputError(f"F{value:g}: must be above 0 and below {FARTHEST:g}")
            self.feed = mm_s_from_mm_min(value)
        return found is not None and found[1] == "MAX", self.feed

    def _need(self, feed: float | None) -> float:
        if feed is None:
            raise InputError("a cut has no feed: give F")
        return feed

    def _left_over(self, text: str) -> None:
        """Words that no rule of a motion reads are refused: they may move something."""
        rest = text
        for pattern in (_WORD, _FEED, _M, _SIDE, _TURN):
            rest = pattern.sub(" ", rest)
        if rest.strip():
            raise InputError(f"{rest.strip()[:40]!r}: is not read in a motion")

    def _drill(self) -> None:
        """The drilling cycle where the tool stands."""
        if self.unknown:
            raise InputError("a cycle is called where the tool stands, which is not known: move there first")
        number = self.cycles.number
        if number in LEFT_OUT:
            self.gap("heidenhain-cycle", f"CYCL DEF {number}: is not read: what it cuts here is left out")
            return
        if number in CYCLES:
            self._q_cycle(number)
            return
        for motion, z, value in self.cycles.call(self.at[2]):
            end = list(self.at)
            if motion != DWELL:
                end[2] = z
                self.at = end
            self._row(motion, end, feed=value)

    def _q_cycle(self, number: int) -> None:
        """A cycle that takes Q parameters, where the tool stands."""

        def q(key: int, else_: float | None) -> float:
            return else_ if else_ is not None and key not in self.q.values else self.q.read(key)

        sense = self.sense
        if number in (206, 207) and sense == 0.0:
            # tapping starts the spindle itself
            sense = 1.0
        before, self.sense = self.sense, sense
        for kind, z, value in q_cycle_steps(number, q, self.speed / math.tau, self.scale):
            if kind == SPIN:
                self.sense = value * sense
                continue
            end = list(self.at)
            end[2] = z
            self.at = end
            self._row(kind, end, feed=value)
        self.sense = before

    # -- switches ---------------------------------------------------------------------------------------------
    def _functions(self, text: str) -> None:
        codes = [int(m) for m in _M.findall(text)]
        self._before(codes)
        self._after(codes)

    def _before(self, codes: list[int]) -> None:
        """M functions that act at the beginning of their block."""
        for m in codes:
            if m in (3, 13):
                self.sense = 1.0
            elif m in (4, 14):
                self.sense = -1.0
            elif m in (128, 129):
                self.tcp = m == 128
                self.note("nc-tip", f"M{m}: tool centre point control {'on' if self.tcp else 'off'}")
            if m in (7, 8, 9, 13, 14):
                word = 9 if m == 9 else 8
                self.note("nc-coolant", f"M{word}: coolant does not concern the path and is left out")

    def _after(self, codes: list[int]) -> None:
        """M functions that act at the end of their block."""
        known = (0, 1, 2, 3, 4, 5, 7, 8, 9, 13, 14, 30, 89, 91, 92, 99, 128, 129)
        for m in codes:
            if m == 5:
                self.sense = 0.0
            elif m == 89:
                self.cycles.modal = True
            elif m in (0, 1):
                self.note("nc-stop", f"M{m}: the program stops until it is started again")
            elif m in (2, 30):
                self.ended = True
            elif m not in known:
                self.note("heidenhain-unknown", f"M{m}: what it does is not known here")
        if 99 in codes:
            self.cycles.modal = False

    def gap(self, code: str, text: str) -> None:
        """Keep a finding on something that is left out, so that the program is unproven."""
        self.note(code, text, Severity.UNPROVEN)

    def note(self, code: str, text: str, severity: Severity = Severity.NOTE) -> None:
        """Keep a finding; one that was there is not repeated."""
        if len(self.findings) < KEPT or severity > Severity.NOTE:
            found = Finding(code, self.line, text, severity)
            if found not in self.findings[-50:]:
                self.findings.append(found)

    def _row(
        self,
        motion: int,
        end: list[float],
        feed: float = 0.0,
        centre: tuple[float, float] = (0.0, 0.0),
        turns: int = 0,
    ) -> None:
        spindle = self.speed * self.sense
        frame = len(self.frames) - 1
        self.rows.append(
            (motion, tuple(end), XY, centre, turns, feed, spindle, self.tool, self.tcp, frame, self.line, 0)
        )  # fmt: skip


def _bare(raw: str) -> str:
    """A block without number, comment and needless blanks, in capitals."""
    # ~ says that the block goes on in the next line, where Q parameters stand by themselves
    text = raw.split(";", 1)[0].replace("~", " ").upper()
    return re.sub(r"^\d+ ?(?=[A-Z]|$)", "", re.sub(r"\s+", " ", text).strip())


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise InputError(f"{text!r}: must be a number") from None
