"""Macro statements of a Fanuc: IF, GOTO, WHILE and DO, G65 with arguments, M97 of a Haas.

Notation: lines count from 0. GOTO n leads to the next block N n, from the start of the text again where none follows. A
parameter that nothing has set is vacant (#0): ``#1 EQ #0`` asks for that.

Reference: Fanuc Series 0i-MF Operator's Manual, "Custom Macro".
"""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import TYPE_CHECKING

from chipload.errors import InputError
from chipload.program.commands import RAPID
from chipload.program.gcode.controller import Controller
from chipload.program.gcode.dialect import NotReadError
from chipload.program.gcode.expression import integer_of, read_value
from chipload.program.gcode.offsets import choose
from chipload.program.gcode.source import Source
from chipload.program.gcode.state import put
from chipload.program.gcode.words import Block, MacroCall, bare, strip_number

if TYPE_CHECKING:
    from chipload.program.gcode.flow import Flow

_START = r"(?:/[1-9]?)?(?:n[0-9]+)?"
_STATEMENT = re.compile(rf"{_START}(if\[|while\[|goto|end[1-9]|do[1-9])")
_TO = re.compile(r"goto(?P<value>[0-9]+|#|\[)")
_NUMBER = re.compile(r"^[ \t]*(?:/[1-9]?[ \t]*)?[nN][ \t]*0*([0-9]+)", re.MULTILINE)
_VACANT = re.compile(r"#([0-9]{1,5})(eq|ne)#0(?![0-9])")
_ASSIGN = re.compile(rf"({_START}#(?:[0-9]+|\[[^\]=]*\]))=(.*)\Z", re.DOTALL)
_CLEAR = re.compile(rf"{_START}#([0-9]{{1,5}})=#0\Z")
#: a call of a macro, once (G65) or after each motion (G66)
_CALL = re.compile(r"g(65|66)(?![0-9.])")
#: words of a call that are no arguments, and those of an argument list that may be repeated
_NO_ARGUMENT, _REPEATED = "glnop", "ijk"
#: variables of the arguments of a call
ARGUMENTS = range(1, 34)
#: setting this parameter stops the program with an alarm
ALARM = 3000
#: statements that write to a file or name parameters
OUTPUTS = re.compile(rf"{_START}(popen|pclos|dprnt|bprnt|setvn)")


def macro_step(flow: Flow, raw: str) -> bool:
    """Carry out a macro statement; whether the line is one.

    Raises
    ------
    InputError
        A statement cannot be read, or what it leads to is not there.
    """
    text, comments = bare(raw)
    text = text.replace("(", "")
    found = _STATEMENT.match(text)
    if found is None:
        return False
    for comment in comments:
        flow.i.comment(comment)
    word, rest = found[1].rstrip("["), text[found.end(1) :]
    if word == "goto":
        flow.line = target(flow, text[found.start(1) :])
    elif word == "if":
        _choose(flow, rest)
    elif word == "while":
        value, rest = _condition(flow, rest)
        if not re.fullmatch(r"do[1-9]", rest):
            raise InputError(f"{rest[:12]!r}: WHILE[...] is followed by DO and a number")
        end = _end_of(flow.source, flow.line, rest[2:])
        flow.line = flow.line + 1 if value else end + 1
    elif word.startswith("do"):
        _end_of(flow.source, flow.line, word[2:])
        flow.line += 1
    else:
        flow.line = _head_of(flow.source, flow.line, word[3:])
    return True


def _condition(flow: Flow, rest: str) -> tuple[bool, str]:
    """The value of a condition whose [ stands before ``rest``, and what follows it."""
    numbered = flow.c.parameters.numbered
    text = f"[{_VACANT.sub(lambda m: str(int((int(m[1]) not in numbered) == (m[2] == 'eq'))), rest)}"
    value, end = read_value(text, 0, flow.c.parameters)
    return value != 0.0, text[end:]


def _choose(flow: Flow, rest: str) -> None:
    """IF[...]GOTO n and IF[...]THEN with an assignment."""
    holds, rest = _condition(flow, rest)
    if rest.startswith("goto"):
        flow.line = target(flow, rest) if holds else flow.line + 1
    elif rest.startswith("then"):
        if holds:
            flow.statement(rest[4:])
        flow.line += 1
    else:
        raise InputError(f"{rest[:12]!r}: IF[...] is followed by GOTO or THEN")


def target(flow: Flow, text: str) -> int:
    """The line that GOTO leads to."""
    found = _TO.match(text)
    if found is None:
        raise InputError(f"{text[:12]!r}: GOTO is followed by the number of a block")
    value, end = read_value(text, found.start("value"), flow.c.parameters)
    if text[end:]:
        raise InputError(f"{text[end : end + 12]!r}: nothing may follow GOTO")
    return block_number(flow.source, flow.line, integer_of(value, "GOTO"))


def block_number(source: Source, line: int, number: int) -> int:
    """Line of the block N ``number``: the next one, else the first one."""
    if source.blocks is None:
        source.blocks = {}
        for k, text in enumerate(source.lines):
            hit = _NUMBER.match(text)
            if hit is not None:
                source.blocks.setdefault(int(hit[1][:12]), []).append(k)
    places = source.blocks.get(number, [])
    if not places:
        raise InputError(f"GOTO {number}: there is no block N{number}")
    return next((k for k in places if k > line), places[0])


def _marks(source: Source, k: int, pattern: str) -> bool:
    return re.search(pattern, "".join(source.lines[k].split("(")[0].split()).lower()) is not None


def _end_of(source: Source, line: int, number: str) -> int:
    """Line of the END of a DO, sought once."""
    if line not in source.loop_ends:
        source.loop_ends[line] = next(
            (k for k in range(line + 1, len(source.lines)) if _marks(source, k, rf"^{_START}end{number}$")), None
        )
    end = source.loop_ends[line]
    if end is None:
        raise InputError(f"DO{number}: END{number} is missing")
    return end


def _head_of(source: Source, line: int, number: str) -> int:
    for k in range(line - 1, -1, -1):
        if _marks(source, k, rf"do{number}$"):
            return k
    raise InputError(f"END{number}: DO{number} is missing before it")


def with_brackets(text: str) -> str:
    """An assignment whose value needs no brackets on a Fanuc, in LinuxCNC's words.

    >>> with_brackets("#101=#100/2.")
    '#101=[#100/2.]'
    """
    found = _ASSIGN.match(text)
    return f"{found[1]}=[{found[2]}]" if found is not None and found[2] else text


def clear_variable(text: str, c: Controller) -> bool:
    """Carry out ``#100=#0``, after which the variable is vacant; whether the text is such a block."""
    found = _CLEAR.fullmatch(text)
    if found is not None:
        c.parameters.numbered.pop(int(found[1]), None)
    return found is not None


def read_macro_call(text: str, comments: list[str], c: Controller) -> Block | None:
    """The block of a line with G65 or G66; None where it has neither.

    Every word but G L N O P is an argument, M S T and F too: none is carried out. I J K may be repeated, each set with
    variables of its own; of two words for one variable the later one counts.

    Reference: Fanuc B-63684EN, "Macro Call"; Haas Mill Operator's Manual, "G65 Macro Subprogram Call".
    """
    call = _CALL.search(text)
    if call is None or OUTPUTS.match(text) or text.startswith("#"):
        return None
    number, at = strip_number(text)
    block, numbers = Block(number=number, comments=comments), c.control.macros.arguments
    words: dict[str, float] = {}
    values: dict[int, float] = {}
    sets, last = 0, ""
    while at < len(text):
        letter, begin = text[at], at + 1
        if letter == "(":
            at = begin
            continue
        if not letter.isalpha():
            raise InputError(f"character {letter!r}: does not begin a word")
        value, at = read_value(text, begin, c.parameters)
        if letter == "g":
            code = round(10.0 * value)
            block.g += [] if code in (650, 660) else [code]
        elif letter in _NO_ARGUMENT:
            words[letter] = value
        elif letter not in numbers:
            raise InputError(f"{letter.upper()}: is no argument of a macro")
        else:
            pointless = text[begin:at].lstrip("+-").isdigit()
            value *= c.increment(letter) if pointless and value else 1.0
            sets += letter in _REPEATED and letter <= last
            last = letter if letter in _REPEATED else last
            words[letter] = value
            values[numbers[letter] + 3 * sets * (letter in _REPEATED)] = value
    label, times = integer_of(words.get("p", -1.0), "P"), integer_of(words.get("l", 1.0), "L")
    block.macro = MacroCall(str(label), max(1, times), tuple(values.items()), words, call[1] == "66")
    return block


def call_macro(flow: Flow, call: MacroCall) -> None:
    """G65: a subroutine of this text with parameters of its own."""
    place = flow.main.numbers.get(call.label)
    probing = flow.c.control.macros.probing.get(int(call.label), "") if place is None else ""
    if probing:
        probe(flow.c, call, probing)
        return
    if place is None:
        raise NotReadError(f"G65 P{call.label}: there is no O{call.label} in this text")
    flow.enter_macro(place, call.label, call.times)
    numbered = flow.c.parameters.numbered
    for number in ARGUMENTS:
        numbered.pop(number, None)
    numbered.update(call.values)


def probe(c: Controller, call: MacroCall, kind: str) -> None:
    """A program of a probe that the machine holds: it goes to X Y Z, measures, or is switched on and off."""
    name = f"G65 P{call.label}"
    if kind == "switch":
        c.once("nc-probe", f"{name}: switches the probe: does not move the path")
        return
    if kind == "measure":
        c.leave_out(
            "nc-probe",
            f"{name}: measures: its way is left out, and what it stores is not known: state the offsets that it sets "
            "in program.work_offsets or program.parameters",
        )
        return
    scale, at = c.state.scale, c.state.at
    target_axes = {k: call.words[x] * scale for k, x in enumerate("xyz") if x in call.words}
    if not c.state.absolute:
        target_axes = {k: at[k] + value for k, value in target_axes.items()}
    c.once("nc-probe", f"{name}: a guarded way of the probe: taken to its programmed end")
    c.straight(RAPID, put(at, target_axes))


def system_variables(c: Controller) -> dict[int | str, Callable[[], float]]:
    """Parameters that mirror the state: codes that hold, F, S, T, and where the tool is."""
    state = c.state
    c.tool_rows.moved = lambda number: choose(c, f"work offset {number}", number)

    def place(k: int) -> Callable[[], float]:
        return lambda: state.at[k] / (state.scale if k < 3 else 1.0)

    out: dict[int | str, Callable[[], float]] = {
        0: lambda: 0.0,
        4001: lambda: 0.0 if state.motion == 800 else state.motion / 10.0,
        4002: lambda: state.plane / 10.0,
        4003: lambda: 90.0 if state.absolute else 91.0,
        4005: lambda: state.feed_mode / 10.0,
        4006: lambda: 20.0 if state.scale != 1.0 else 21.0,
        4007: lambda: state.compensation / 10.0,
        4010: lambda: 98.0 if state.old_level else 99.0,
        4014: lambda: 53.0 + state.datum.number if state.datum.number < 7 else 54.1,
        4109: lambda: state.feed / state.scale,
        4119: lambda: state.speed,
        4120: lambda: float(state.tool),
    }
    for first in (5001, 5041, 5061):
        out |= {first + k: place(k) for k in range(6)}
    return out
