"""Heidenhain programs in DIN/ISO as conversational ones, block by block: lines stay where they are.

| DIN/ISO | taken as |
|---|---|
| %NAME G71, N99999999 %NAME, %OTHER | BEGIN PGM NAME MM (G70: INCH), END PGM, CALL PGM OTHER |
| G00 G01 G07, G10 G11 | L, LP with FMAX or F |
| G02 G03 G05, G06, G12 G13 G15 | CR with R, else C; CT; CP |
| I J K, G29 | CC |
| G24 R, G25 R | CHF, RND |
| G30, G31, G99, T | BLK FORM, TOOL DEF, TOOL CALL with the axis of G17 to G19 |
| G40 G41 G42, G90 G91 | R0 RL RR, I before the axes that follow |
| G98 L1, L1,0, L1,4 | LBL 1, CALL LBL 1, CALL LBL 1 REP 4 |
| G04, G28, G54, G72, G73, G80, G83 | cycles 9, 8, 7, 11, 10, 19, 1 |
| G79, M99, G200 on | CYCL CALL, M99, CYCL DEF of that number |
| D00 to D13 | FN 0 to FN 13 |

G26 and G27 are not read, pockets and slots (G74 to G78), old tapping cycles (G84 to G86) are cycles that are left out.
``AND`` separates two blocks that stand in one line.

Reference: Heidenhain, iTNC 530 User's Manual DIN/ISO Programming, "Overview of G Functions".
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field

#: between two blocks of a line
AND = " && "
_HEAD = re.compile(r"^\s*(?:N?\d+\s+)?%\s*([\w-]+)\s+G(7[01])\b", re.MULTILINE)
_NUMBER = re.compile(r"^\s*/?\s*N\d+\s*")
_VALUE = r"[-+]?\s*(?:Q[LR]?\d+|\d+\.?\d*|\.\d+)"
_WORD = re.compile(rf"(Q[LR]?\d+)\s*=\s*(\S+)|([A-Z])\s*({_VALUE}(?:,\d+)?|MAX|AUTO)|(%)([\w-]+)|(\S+)")
_SIDES = {40: "R0", 41: "RL", 42: "RR"}
_TOOL_AXES = {17: "Z", 18: "Y", 19: "X", 20: "U"}
#: cycles by other numbers, that are left out where they are called
_LEFT_OUT = {74: 3, 75: 4, 76: 4, 77: 5, 78: 5, 84: 2, 85: 17, 86: 18, 36: 13, 39: 12}
_MOTIONS = frozenset({0, 1, 2, 3, 5, 6, 7, 10, 11, 12, 13, 15, 16})
_SIGNS = {0: "", 1: "+", 2: "-", 3: "*", 4: "DIV", 5: "SQRT", 6: "SIN", 7: "COS", 8: "LEN", 13: "ANG"}
_TESTS = {9: "EQU", 10: "NE", 11: "GT", 12: "LT"}


def is_din_iso(text: str) -> bool:
    r"""Whether a text begins as a DIN/ISO program of a Heidenhain.

    >>> is_din_iso("%PLATE G71 *\nN10 G00 X+1*"), is_din_iso("%\nO1\nG71")
    (True, False)
    """
    first = next((line for line in text[:2000].splitlines() if line.strip() and not line.lstrip().startswith(";")), "")
    return _HEAD.match(first.upper()) is not None


def conversational(text: str) -> str:
    r"""Return a DIN/ISO program as a conversational one; any other text as it is.

    >>> print(conversational("%A G71 *\nN10 T2 G17 S900*\nN20 G00 G90 X+5 Z+2 M3*\nN30 G01 G91 Z-3 F80*\nN40 I+9 J+0*"))
    BEGIN PGM A MM
    TOOL CALL 2 Z S900
    L X+5 Z+2 FMAX M3
    L IZ-3 F80
    CC IX+9 IY+0
    """
    if not is_din_iso(text):
        return text
    modes, out, goes_on = _Modes(), [], False
    for raw in text.splitlines():
        out.append(raw if goes_on else modes.carry(raw))
        goes_on = raw.split(";", 1)[0].rstrip().endswith("~") or raw.rstrip().endswith("~")
    return "\n".join(out)


@dataclass
class _Block:
    """Words of a block, by kind."""

    codes: list[int] = field(default_factory=list)
    axes: list[str] = field(default_factory=list)
    pole: list[str] = field(default_factory=list)
    polar: list[str] = field(default_factory=list)
    m: list[str] = field(default_factory=list)
    words: dict[str, str] = field(default_factory=dict)
    parameters: list[str] = field(default_factory=list)
    points: list[str] = field(default_factory=list)
    others: list[str] = field(default_factory=list)


class _Modes:
    """What lasts from block to block."""

    def __init__(self) -> None:
        self.begun, self.step, self.motion, self.sense = False, "", 0, "-"
        self.axis = "Z"

    def carry(self, raw: str) -> str:
        """A line as conversational blocks."""
        text, _, comment = raw.partition(";")
        body = _NUMBER.sub("", text.upper()).strip()
        head = _HEAD.match(text.upper())
        if head is not None:
            word, self.begun = "END" if self.begun else "BEGIN", True
            return f"{word} PGM {head[1]} {'MM' if head[2] == '71' else 'INCH'}"
        tail = " ~" if body.endswith("~") else ""
        body = body.rstrip("~* ").strip()
        if not body:
            return f";{comment}" if comment else ""
        if body.startswith("%"):
            return f"CALL PGM {body[1:].strip()}"
        block = self._read(body)
        if block is None:
            return body + tail
        done = AND.join(self._blocks(block, body))
        return done + tail + (f" ;{comment}" if comment and not tail else "")

    def _read(self, body: str) -> _Block | None:
        """The words of a block; None: a statement that is written as in a conversational program."""
        block = _Block()
        if re.match(r"[A-Z]{2,}|Q[LR]?\d+\s*=", body):
            return None
        for hit in _WORD.finditer(body):
            parameter, value, letter, number = hit[1], hit[2], hit[3], (hit[4] or "").replace(" ", "")
            if parameter:
                block.parameters.append(f"{parameter}={value}")
            elif letter == "G" and number.isdigit():
                code = int(number)
                block.codes.append(code)
                if code in (90, 91):
                    self.step = "I" if code == 91 else ""
            elif letter in ("X", "Y", "Z", "A", "B", "C", "U", "V", "W"):
                block.axes.append(f"{self.step}{letter}{number}")
            elif letter in ("I", "J", "K"):
                block.pole.append(f"{self.step}{'XYZ'['IJK'.index(letter)]}{number}")
            elif letter == "H":
                block.polar.append(f"{self.step}PA{number}")
                block.words["H"] = number
            elif letter == "M":
                block.m.append(f"M{int(number)}" if number.isdigit() else f"M{number}")
            elif letter == "P":
                block.points.append(number)
            elif letter:
                block.words[letter] = number
            else:
                block.others.append(hit[0])
        return block

    def _blocks(self, b: _Block, body: str) -> Iterator[str]:
        """The conversational blocks of a block."""
        codes = [code for code in b.codes if code not in (90, 91)]
        other = next((c for c in codes if c not in _MOTIONS and c not in _SIDES and c not in _TOOL_AXES), None)
        for code in codes:
            if code in _TOOL_AXES:
                self.axis = _TOOL_AXES[code]
        if "D" in b.words:
            yield self._function(b, body)
        elif other is not None:
            yield from self._special(b, other, body)
        elif "T" in b.words:
            speed = f" S{b.words['S']}" if "S" in b.words else ""
            yield f"TOOL CALL {b.words['T']} {self.axis}{speed}"
            if b.m:
                yield " ".join(("L", *b.m))
        elif "L" in b.words and re.fullmatch(r"\d+(?:[,.]\d+)?", b.words["L"]):
            number, _, times = b.words["L"].replace(",", ".").partition(".")
            yield f"CALL LBL {number}" + (f" REP {times}" if times.strip("0") else "")
        elif b.others:
            yield body
        else:
            yield from self._motion(b, codes)

    def _motion(self, b: _Block, codes: list[int]) -> Iterator[str]:
        moved = [code for code in codes if code in _MOTIONS]
        if moved:
            self.motion = moved[-1]
        side = next((_SIDES[code] for code in codes if code in _SIDES), "")
        motion = self.motion
        if b.pole:
            yield " ".join(("CC", *b.pole))
        fast = motion in (0, 10)
        feed = "FMAX" if fast and (b.axes or b.polar) else f"F{b.words['F']}" if "F" in b.words else ""
        if motion in (2, 3, 12, 13):
            self.sense = "-" if motion in (2, 12) else "+"
        r = b.words.get("R", "")
        tail = [side, feed, *b.m]
        if not b.axes and not b.polar and not (r and motion in (10, 11)):
            if side or feed or b.m:
                yield " ".join(x for x in ("L", *tail) if x)
            elif "S" in b.words:
                yield f"TOOL CALL S{b.words['S']}"
            return
        if motion in (0, 1, 7):
            words = ["L", *b.axes]
        elif motion in (10, 11):
            words = ["LP", *([f"{self.step}PR{r}"] if r else []), *b.polar, *b.axes]
        elif motion in (6, 16):
            words = ["CT", *b.axes]
        elif motion in (12, 13, 15):
            words = ["CP", *b.polar, *b.axes, f"DR{self.sense}"]
        else:
            words = [*(("CR", *b.axes, f"R{r}") if r else ("C", *b.axes)), f"DR{self.sense}"]
        yield " ".join(x for x in (*words, *tail) if x)

    def _special(self, b: _Block, code: int, body: str) -> Iterator[str]:
        """Blocks of codes that are neither motions nor modes of them."""
        r, number = b.words.get("R", ""), b.words.get("L", "")
        if code in (30, 31):
            axis = f" {self.axis}" if code == 30 else ""
            yield f"BLK FORM 0.{code - 29}{axis} {' '.join(b.axes)}"
        elif code == 99:
            yield f"TOOL DEF {b.words.get('T', '0')} L{number or '+0'} R{r or '+0'}"
        elif code == 51:
            yield f"TOOL DEF {b.words.get('T', '0')}"
        elif code == 98:
            yield f"LBL {number}"
        elif code == 79:
            yield " ".join(("CYCL CALL", *b.m))
        elif code == 38:
            yield " ".join(("STOP", *b.m))
        elif code == 29:
            yield "CC"
        elif code == 24:
            yield f"CHF {r.lstrip('+')}"
        elif code == 25:
            yield f"RND R{r.lstrip('+')}"
        elif code == 4:
            yield from _cycle(9, "DWELL", [f"DWELL {b.words.get('F', '0')}"])
        elif code == 28:
            yield from _cycle(8, "MIRROR IMAGE", [" ".join(x.lstrip("I")[0] for x in b.axes) or " ".join(b.others)])
        elif code == 54:
            yield from _cycle(7, "DATUM SHIFT", b.axes)
        elif code == 72:
            yield from _cycle(11, "SCALING", [f"SCL {b.words.get('F', '1')}"])
        elif code == 73:
            yield from _cycle(10, "ROTATION", [f"{self.step}ROT{_with_sign(b.words.get('H', '+0'))}"])
        elif code == 80:
            yield from _cycle(19, "WORKING PLANE", [" ".join(b.axes)] if b.axes else [])
        elif code == 83:
            names = ("DIST", "DEPTH", "PLNGNG", "DWELL", "F")
            values = [f"{name} {value}" for name, value in zip(names, _points(body), strict=False)]
            yield from _cycle(1, "PECKING", values)
        elif code in _LEFT_OUT:
            yield f"CYCL DEF {_LEFT_OUT[code]}.0"
        elif code >= 200:
            yield " ".join((f"CYCL DEF {code}", *b.parameters))
        elif code in (70, 71):
            # the unit stands in the head of the program
            yield ""
        else:
            yield body

    @staticmethod
    def _function(b: _Block, body: str) -> str:
        """D00 to D13 as FN."""
        number = int(re.sub(r"\D", "", b.words["D"]) or 99)
        target = re.search(r"D\s*\d+\s+(Q[LR]?\d+)", body)
        values = _points(body)
        if number in _TESTS and len(values) == 3:
            return f"FN {number}: IF {values[0]} {_TESTS[number]} {values[1]} GOTO LBL {values[2].lstrip('+')}"
        if target is None or number not in _SIGNS or not values:
            return body
        sign = _SIGNS[number]
        if len(values) == 1:
            return f"FN {number}: {target[1]} = {sign} {values[0]}"
        return f"FN {number}: {target[1]} = {values[0]} {sign} {values[1]}"


def _points(body: str) -> list[str]:
    """Values of P01, P02 and so on."""
    return [hit.replace(" ", "") for hit in re.findall(rf"\bP\s*\d{{1,2}}\s+({_VALUE})", body)]


def _cycle(number: int, name: str, values: list[str]) -> Iterator[str]:
    yield f"CYCL DEF {number}.0 {name}"
    for k, value in enumerate(values, start=1):
        yield f"CYCL DEF {number}.{k} {value}".rstrip()


def _with_sign(value: str) -> str:
    return value if value[:1] in "+-" else f"+{value}"
