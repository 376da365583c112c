"""Jumps and loops of a Sinumerik: GOTO, IF, ELSE, WHILE, FOR, LOOP, REPEAT, REPEATB and CASE.

Notation: lines count from 0. A jump leads to a label (``NAME:`` at the beginning of a block) or a block number: GOTOF
forward, GOTOB backward, GOTO and GOTOC forward and, where there is none, from the start of the text. IF, WHILE, FOR,
LOOP and REPEAT without a label open a loop or a branch, which a word of its own closes. REPEAT with labels repeats a
section of the text, REPEATB one block.

Comparisons have the lowest precedence, so that ``R1 > 5 AND R2 < 3`` needs brackets; without them it is not read. A
condition on a value that only the controller knows counts as false, and the result is unproven. Blocks are counted by
:mod:`~chipload.program.gcode.flow`: a loop without an end is refused.

Reference: Siemens, SINUMERIK 840D sl / 828D, Programming Manual Job Planning, "Program jumps", "Check structures",
"Repetition of program sections".
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from chipload.errors import InputError
from chipload.program.gcode.controller import Controller
from chipload.program.gcode.dialect import NotReadError
from chipload.program.gcode.expression import integer_of
from chipload.program.gcode.source import Source

if TYPE_CHECKING:
    from chipload.program.gcode.flow import Flow

#: value of an expression
Value = Callable[[str, Controller], float]

_HEAD = re.compile(r"\s*(?:/[0-9]?\s*)?(?::?N?([0-9]+)\s*(?![0-9.=]))?(?:([A-Z_][A-Z0-9_]{1,31})\s*:(?!=)\s*)?")
_WORD = re.compile(
    r"(IF|ELSE|ENDIF|WHILE|ENDWHILE|FOR|ENDFOR|LOOP|ENDLOOP|REPEATB|REPEAT|UNTIL|GOTO[FBCS]?|CASE)(?![A-Z0-9_])\s*(.*)",
    re.DOTALL,
)
_GOTO = re.compile(r"\bGOTO([FBCS]?)\s*([A-Z_][A-Z0-9_]*|N?[0-9]+)?\s*\Z")
_BRANCH = re.compile(r"([^\s]+)\s+GOTO([FBC]?)\s+([A-Z_][A-Z0-9_]*|N?[0-9]+)")
_FOR = re.compile(r"([A-Z_][A-Z0-9_]*)\s*=\s*(.+?)\s+TO\s+(.+)\Z")
_TIMES = re.compile(r"\bP\s*=?\s*(.+)\Z")
_SIGNS = re.compile(r"==|<>|>=|<=|>|<")
_JOINS = re.compile(r"(?<![A-Z0-9_])(AND|OR|XOR)(?![A-Z0-9_])")
#: closing word: the word that opens
CLOSES = {"ENDIF": "IF", "ENDWHILE": "WHILE", "ENDFOR": "FOR", "ENDLOOP": "LOOP", "UNTIL": "REPEAT"}
#: two numbers are equal within this share
EQUAL = 1e-12
#: greatest number of repeats of a section
MOST_TIMES = 9999
_TESTS: dict[str, Callable[[float, float], bool]] = {
    "==": lambda a, b: abs(a - b) <= EQUAL * max(abs(a), abs(b)),
    "<>": lambda a, b: abs(a - b) > EQUAL * max(abs(a), abs(b)),
    ">=": lambda a, b: a >= b,
    "<=": lambda a, b: a <= b,
    ">": lambda a, b: a > b,
    "<": lambda a, b: a < b,
}


@dataclass(frozen=True)
class Statement:
    """A line that controls which block comes next: its word and the text after it."""

    word: str
    rest: str

    @property
    def opens(self) -> bool:
        """Whether it needs a closing word."""
        if self.word == "IF":
            return _GOTO.search(self.rest) is None
        return self.word in ("WHILE", "FOR", "LOOP") or (self.word == "REPEAT" and not self.rest)


@dataclass(eq=False)
class Statements:
    """Control statements and labels of a program.

    Parameters
    ----------
    at : statement by line
    labels : lines of each label or block number
    partner : closing line of each opening line, and opening line of each closing line
    other : line of ELSE by line of its IF
    left : remaining repeats, by line
    wrong : what is wrong with a statement that is not closed, or that closes nothing, by line
    """

    at: dict[int, Statement] = field(default_factory=dict)
    labels: dict[str, list[int]] = field(default_factory=dict)
    partner: dict[int, int] = field(default_factory=dict)
    other: dict[int, int] = field(default_factory=dict)
    left: dict[int, int] = field(default_factory=dict)
    wrong: dict[int, str] = field(default_factory=dict)


def statements_of(source: Source) -> Statements:
    """Jumps, loops and labels of a text."""
    out, open_ones = Statements(), list[int]()
    for k, raw in enumerate(source.lines):
        body = _plain(raw)
        begin = 0
        if head := _HEAD.match(body):
            begin = head.end()
            if head[1]:
                out.labels.setdefault(f"N{int(head[1][:12])}", []).append(k)
            if head[2]:
                out.labels.setdefault(head[2], []).append(k)
        found = _WORD.match(body, begin)
        if found is None:
            continue
        out.at[k] = one = Statement(found[1], found[2].strip())
        if one.word in CLOSES or one.word == "ELSE":
            wanted = CLOSES.get(one.word, "IF")
            if not open_ones or out.at[open_ones[-1]].word != wanted:
                out.wrong[k] = f"{one.word} has no {wanted} before it"
            elif one.word == "ELSE":
                out.other[open_ones[-1]] = k
            else:
                first = open_ones.pop()
                out.partner |= {first: k, k: first}
                if first in out.other:
                    out.partner[out.other[first]] = k
        elif one.opens:
            open_ones.append(k)
    for k in open_ones:
        ends = next(end for end, begin in CLOSES.items() if begin == out.at[k].word)
        out.wrong[k] = f"{out.at[k].word}: {ends} is missing"
        if k in out.other:
            out.wrong[out.other[k]] = f"ELSE: {ends} is missing"
    return out


def flow_step(flow: Flow, raw: str, value: Value) -> bool:
    """Carry out a line that controls which block comes next; False if it is not one.

    Parameters
    ----------
    value : function that evaluates an expression

    Raises
    ------
    InputError
        The line cannot be read, or its target does not exist.
    """
    source = flow.source
    if source.statements is None:
        source.statements = statements_of(source)
    some = source.statements
    one = some.at.get(flow.line)
    if one is None:
        return False
    if flow.line in some.wrong:
        if not flow.lenient:
            raise InputError(some.wrong[flow.line])
        flow.c.leave_out("nc-jump", f"{some.wrong[flow.line]}: the statement is left out")
        flow.line += 1
        return True
    try:
        flow.line = _next(flow, some, one, value)
    except NotReadError as error:
        flow.c.leave_out("nc-jump", f"{error}: {one.word} {one.rest[:40]}: the jump is not taken")
        flow.line = _block_without(flow.line, some, one)
    return True


def _block_without(line: int, some: Statements, one: Statement) -> int:
    """The block after a statement whose condition is not known: a branch or loop is not entered, or left."""
    if one.word == "IF" and one.opens:
        return some.other.get(line, some.partner[line]) + 1
    if one.word in ("WHILE", "FOR"):
        return some.partner[line] + 1
    return line + 1


def _next(flow: Flow, some: Statements, one: Statement, value: Value) -> int:
    """The line that comes next."""
    line, rest = flow.line, one.rest
    match one.word:
        case "IF":
            jump = _GOTO.search(rest)
            if jump is not None:
                holds = condition(rest[: jump.start()], flow.c, value)
                return _target(flow, some, jump) if holds else line + 1
            if condition(rest, flow.c, value):
                return line + 1
            return some.other.get(line, some.partner[line]) + 1
        case "ELSE":
            return some.partner[line] + 1
        case "WHILE":
            return line + 1 if condition(rest, flow.c, value) else some.partner[line] + 1
        case "ENDWHILE" | "ENDLOOP":
            return some.partner[line]
        case "UNTIL":
            return line + 1 if condition(rest, flow.c, value) else some.partner[line]
        case "FOR":
            return _begin_for(flow, some, rest, value)
        case "ENDFOR":
            return _go_on_for(flow, some, value)
        case "REPEAT" | "REPEATB" if rest:
            return _repeat(flow, some, one, value)
        case "CASE":
            return _case(flow, some, rest, value)
        case word if word.startswith("GOTO"):
            jump = _GOTO.search(f"{word} {rest}")
            if jump is None:
                raise NotReadError(f"{rest[:24]!r}: is no label")
            return _target(flow, some, jump)
        case _:
            return line + 1  # LOOP, REPEAT that UNTIL closes, ENDIF


def _target(flow: Flow, some: Statements, jump: re.Match[str]) -> int:
    """The line that a jump leads to."""
    direction, name, line = jump[1], jump[2], flow.line
    if direction == "S":
        raise NotReadError("GOTOS starts the program again without end: it is read once")
    if not name:
        raise NotReadError("a jump to a label that is calculated")
    places = some.labels.get(name, some.labels.get(f"N{name}", []))
    later, earlier = [k for k in places if k > line], [k for k in places if k <= line]
    order = {"F": later, "B": earlier[::-1]}.get(direction, [*later, *earlier])
    if order:
        return order[0]
    if name in flow.c.parameters.shared or re.fullmatch(r"R[0-9]+", name):
        raise NotReadError(f"{name}: a label that is calculated")
    if direction == "C":
        return line + 1
    raise NotReadError(f"GOTO{direction} {name}: there is no such label")


def _case(flow: Flow, some: Statements, rest: str, value: Value) -> int:
    """CASE value OF 1 GOTOF A 2 GOTOF B DEFAULT GOTOF C."""
    head, _, tail = rest.partition(" OF ")
    if not tail:
        raise NotReadError(f"{rest[:24]!r}: CASE is followed by a value and OF")
    number = value(head, flow.c)
    for found in _BRANCH.finditer(tail):
        if found[1] == "DEFAULT" or abs(value(found[1], flow.c) - number) <= EQUAL * max(1.0, abs(number)):
            jump = _GOTO.search(f"GOTO{found[2]} {found[3]}")
            if jump is not None:
                return _target(flow, some, jump)
    return flow.line + 1


def _variable(name: str) -> int | str:
    return int(name[1:]) if re.fullmatch(r"R[0-9]{1,4}", name) else f"_{name.lower()}"


def _counter(rest: str) -> tuple[str, str, str]:
    found = _FOR.match(rest)
    if found is None:
        raise InputError(f"FOR {rest[:24]!r}: must be FOR variable = value TO value")
    return found[1], found[2], found[3]


def _begin_for(flow: Flow, some: Statements, rest: str, value: Value) -> int:
    name, first, last = _counter(rest)
    start, end = value(first, flow.c), value(last, flow.c)
    flow.c.parameters.assign(_variable(name), start)
    return flow.line + 1 if start <= end else some.partner[flow.line] + 1


def _go_on_for(flow: Flow, some: Statements, value: Value) -> int:
    head = some.partner[flow.line]
    name, _, last = _counter(some.at[head].rest)
    count = value(name, flow.c) + 1.0
    flow.c.parameters.assign(_variable(name), count)
    return head + 1 if count <= value(last, flow.c) else flow.line + 1


def _repeat(flow: Flow, some: Statements, one: Statement, value: Value) -> int:
    """REPEAT label, REPEAT label label and REPEATB label, with P times."""
    line = flow.line
    times = _TIMES.search(one.rest)
    count = integer_of(value(times[1], flow.c), "P") if times is not None else 1
    if not 0 <= count <= MOST_TIMES:
        raise InputError(f"{one.word} P={count}: must be from 0 to {MOST_TIMES}")
    names = one.rest[: times.start() if times is not None else None].split()
    places = [some.labels[name][0] for name in names if some.labels.get(name)]
    if not 1 <= len(names) <= 2 or len(places) < len(names):
        raise NotReadError(f"{' '.join(names)[:40]}: no section of the text")
    first = places[0]
    if one.word == "REPEAT" and len(places) == 1 and first < line:
        # the section ends here: it is run again as it stands
        left = some.left.get(line, count)
        some.left[line] = left - 1
        if left > 0:
            return first
        del some.left[line]
        return line + 1
    last = first if one.word == "REPEATB" else places[-1]
    if any(first <= k <= last for k in some.at):
        raise NotReadError(f"{one.word}: a section with jumps of its own")
    for _ in range(count):
        for k in range(first, last + 1):
            flow.again(k)
    return line + 1


def condition(text: str, c: Controller, value: Value) -> bool:
    """Whether a condition holds.

    >>> condition("(1 < 2) AND NOT (3 == 4)", None, lambda text, _: float(text))
    True
    """
    text = text.strip()
    parts = _split(text, _SIGNS)
    if len(parts) > 1:
        if len(parts) != 3 or any(len(_split(side, _JOINS)) > 1 for side in parts[::2]):
            raise NotReadError(f"{text[:40]!r}: several comparisons need brackets")
        return _TESTS[parts[1]](_side(parts[0], c, value), _side(parts[2], c, value))
    for join in ("OR", "XOR", "AND"):
        parts = _split(text, re.compile(_JOINS.pattern.replace("AND|OR|XOR", join)))
        if len(parts) > 1:
            sides = [condition(side, c, value) for side in parts[::2]]
            return any(sides) if join == "OR" else all(sides) if join == "AND" else sum(sides) % 2 == 1
    if re.match(r"NOT(?![A-Z0-9_])", text):
        return not condition(text[3:], c, value)
    if text.startswith("(") and _closing_bracket(text) == len(text) - 1:
        return condition(text[1:-1], c, value)
    return _side(text, c, value) != 0.0


def _side(text: str, c: Controller, value: Value) -> float:
    plain = text.strip()
    return {"TRUE": 1.0, "FALSE": 0.0}[plain] if plain in ("TRUE", "FALSE") else value(plain, c)


def _closing_bracket(text: str) -> int:
    """Where the bracket that opens a text closes; -1: nowhere."""
    depth = 0
    for k, character in enumerate(text):
        depth += {"(": 1, ")": -1}.get(character, 0)
        if depth == 0:
            return k
    return -1


def _split(text: str, pattern: re.Pattern[str]) -> list[str]:
    """Parts of a text and the separators between them that are outside brackets, alternately."""
    depths, depth = list[int](), 0
    for character in text:
        depth += {"(": 1, ")": -1}.get(character, 0)
        depths.append(depth)
    out, at = list[str](), 0
    for found in pattern.finditer(text):
        if depths[found.start()] == 0:
            out += [text[at : found.start()], found[0]]
            at = found.end()
    return [*out, text[at:]]


def _plain(raw: str) -> str:
    """A line without its comment and texts, in capitals."""
    return re.sub(r'"[^"]*"', '""', raw).split(";", 1)[0].upper().rstrip()
