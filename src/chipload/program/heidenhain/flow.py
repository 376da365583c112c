"""Which block is carried out next: labels, calls, jumps, programs that are called, and what FN functions calculate."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

from chipload.errors import InputError
from chipload.files import decode_text, is_file, read_regular
from chipload.program.heidenhain import words
from chipload.program.heidenhain.din_iso import conversational
from chipload.program.heidenhain.formula import q_number
from chipload.program.heidenhain.state import ConversationalState

#: calls inside one another
NESTED = 20
#: largest program that is called [bytes], and how many are
LARGEST_FILE, MOST_FILES = 50_000_000, 1000
_GOTO = re.compile(
    r'IF\s*(.+?)\s+(EQU|NE|GT|LT)\s*(.+?)\s+GOTO LBL\s*(\d+|"[^"]*"|Q[LR]?\d+)\s*$'
)  # fmt: skip
#: motions
_MOVES = re.compile(r"(?:L|LN|LP|C|CR|CT|CP|CTP|APPR|DEP)\s.*[-+]?[0-9]")
_TESTS = ("EQU", "NE", "GT", "LT")
#: functions of two values: root of the sum of squares, angle of two sides [deg]
_PAIRS: dict[int, tuple[str, Callable[[float, float], float]]] = {
    8: ("LEN", math.hypot),
    13: ("ANG", lambda a, b: math.degrees(math.atan2(a, b)) % 360.0),
}


@dataclass(eq=False)
class Text:
    """Blocks of one program, and where its labels are."""

    blocks: list[str]
    places: dict[str, int]


def text_of(raw: str) -> Text:
    """The blocks of a program with their labels."""
    blocks = words.blocks_of(conversational(raw))
    places: dict[str, int] = {}
    for k, block in enumerate(blocks):
        found = words.LABEL.match(block)
        if found and found[1] != "0":
            places.setdefault(found[1].lstrip("0") or "0", k)
    return Text(blocks, places)


def sections_behind(text: Text, reached: bytearray, end: int) -> Iterator[tuple[int, int, bool]]:
    """First and last line, from 1, of motions behind the end of a program that nothing carries out, and whether they
    are a subprogram: a section that begins with a label.

    Parameters
    ----------
    reached : whether each block has been carried out
    end : index of the last block of the program
    """
    begins = [k for k in range(end + 1, len(text.blocks)) if re.match(r"LBL|BEGIN PGM", text.blocks[k])]
    for first, last in pairwise([end + 1, *begins, len(text.blocks)]):
        moves = [k + 1 for k in range(first, last) if _MOVES.match(text.blocks[k])]
        if moves and not any(reached[first:last]):
            label = re.match(r"LBL\s*(?!0\s*$)", text.blocks[first])
            yield moves[0], moves[-1], label is not None


class HeidenhainFlow:
    """Where a program is in its texts.

    Parameters
    ----------
    text : the main program
    folder : the one folder that called programs may lie in; None: none
    """

    def __init__(self, state: ConversationalState, text: Text, folder: Path | None) -> None:
        self.s, self.text, self.folder = state, text, folder
        self.calls: list[tuple[Text, int, float]] = []
        self.repeats: dict[tuple[int, int], int] = {}
        self.files: dict[str, Text] = {}

    def label(self, block: str, at: int) -> int:
        """LBL: the index of the next block."""
        if not words.LABEL.match(block):
            raise InputError(f"{block!r}: LBL must have a number or a name in quotes")
        back = bool(re.match(r"^LBL\s*0$", block)) and bool(self.calls) and self.calls[-1][0] is self.text
        return self.calls.pop()[1] + 1 if back else at + 1

    def place(self, name: str) -> int:
        """Index of a label."""
        if name.startswith("Q"):
            value = self.s.amount(name)
            name = f"{value:g}"
        key = name if name.startswith('"') else name.lstrip("0") or "0"
        if key not in self.text.places:
            raise InputError(f"LBL {name} is missing")
        return self.text.places[key]

    def call(self, block: str, at: int) -> int:
        """CALL LBL, once or repeated."""
        found = re.fullmatch(
            r'CALL LBL\s*(\d+|"[^"]*"|Q[LR]?\d+)(?:\s+REP\s*(\d{1,9}|Q[LR]?\d+)(?:\s*/\s*\d+)?)?', block
        )
        if found is None:
            raise InputError(f"{block!r}: must be CALL LBL number, or CALL LBL number REP times")
        place = self.place(found[1])
        if found[2] is None:
            self._enter(self.text, at)
            return place + 1
        if place > at:
            self.s.unproven(
                "heidenhain-repeat",
                f"{block[:60]}: the label stands on line {place + 1}, behind the call: REP repeats what stands between "
                "a label and its call: what follows the label is read once",
            )
        key = (id(self.text), at)
        left = self.repeats.get(key, round(self.s.amount(found[2])))
        self.repeats[key] = left - 1
        if left > 0:
            return place + 1
        del self.repeats[key]
        return at + 1

    def _enter(self, text: Text, at: int) -> None:
        if len(self.calls) >= NESTED:
            raise InputError(f"calls are nested deeper than {NESTED}")
        self.calls.append((text, at, self.s.scale))

    def call_program(self, block: str, at: int) -> int:
        """CALL PGM: a program that lies beside this one; one that is not there is left out."""
        name = block[8:].strip().strip('"').split("\\")[-1].split("/")[-1]
        text = self._file(name)
        if text is None:
            self.s.unproven("heidenhain-call", f"{block[:60]}: is not in the folder of this program: it is left out")
            return at + 1
        self._enter(self.text, at)
        self.text = text
        return 0

    def _file(self, name: str) -> Text | None:
        stem = name.rsplit(".", 1)[0]
        if self.folder is None or not re.fullmatch(r"[\w-]{1,100}", stem):
            return None
        if name not in self.files:
            if len(self.files) >= MOST_FILES:
                raise InputError(f"more than {MOST_FILES} programs are called")
            root = self.folder.resolve()
            for ending in (".h", ".H"):
                for own in (stem, stem.lower()):
                    path = (root / f"{own}{ending}").resolve()
                    if path.parent == root and is_file(path):
                        data = read_regular(path, path.name, LARGEST_FILE)
                        self.files[name] = text_of(decode_text(data))
                        return self.files[name]
            return None
        return self.files[name]

    def end(self) -> int | None:
        """END PGM: the block after the call; None at the end of the main program."""
        while self.calls:
            text, at, scale = self.calls.pop()
            if text is not self.text:
                self.text, self.s.scale = text, scale
                return at + 1
        return None

    def function(self, block: str, at: int) -> int:
        """FN: calculations and jumps."""
        found = re.fullmatch(r"FN\s*(\d{1,4})\s*:\s*(.*)", block)
        if found is None:
            raise InputError(f"{block!r}: FN must be written FN number: ...")
        s, number, body = self.s, int(found[1]), found[2]
        if number <= 8 or number == 13:
            self._calculate(block, number, body)
        elif 9 <= number <= 12:
            hit = _GOTO.fullmatch(body)
            if hit is None or hit[2] != _TESTS[number - 9]:
                raise InputError(f"{block!r}: must be IF value {_TESTS[number - 9]} value GOTO LBL number")
            a, b = s.q.formula(hit[1]), s.q.formula(hit[3])
            if {"EQU": a == b, "NE": a != b, "GT": a > b, "LT": a < b}[hit[2]]:
                return self.place(hit[4]) + 1
        elif number == 18:
            hit = re.fullmatch(r"SYSREAD\s*(Q[LR]?)\s*(\d+)\s*=.*", body)
            if hit is None:
                raise InputError(f"{block!r}: must be SYSREAD Q = ...")
            key = q_number(hit[1], hit[2])
            s.q.set(key, None)
            if s.q.values[key] is None:
                s.note("heidenhain-sysread", f"{hit[1]}{hit[2]} comes from the controller and is not known here")
        elif number in (14, 15, 16, 19, 20, 29, 37, 38):
            s.note("heidenhain-unused", block)
        else:
            s.unproven("heidenhain-function", f"FN {number}: is not read: left out")
        return at + 1

    def _calculate(self, block: str, number: int, body: str) -> None:
        hit = re.fullmatch(r"(Q[LR]?)\s*(\d+)\s*=\s*(.+)", body)
        if hit is None:
            raise InputError(f"{block!r}: must be Q = ...")
        key, formula = q_number(hit[1], hit[2]), hit[3]
        if number in _PAIRS:
            word, function = _PAIRS[number]
            sides = formula.split(word)
            if len(sides) != 2:
                raise InputError(f"{block!r}: must be a value, {word} and a value")
            self.s.q.assign(key, *sides, by=function)
        else:
            signs = {"DIV": "/"}
            self.s.q.assign(key, " ".join(signs.get(w, w) for w in formula.split()))
