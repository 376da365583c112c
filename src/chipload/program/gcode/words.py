"""One block of RS-274 text: its comments, words, G and M codes and assignments.

Notation: a code of G is kept in tenths, so G38.2 is 382. Spaces and case mean nothing outside comments. A comment
leaves ``(`` in the text so that what stands around it does not grow together.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field

from chipload.errors import InputError
from chipload.program.gcode.expression import integer_of, read_parameter_key, read_value
from chipload.program.gcode.parameters import Parameters

#: letters that a block may give once
LETTERS = frozenset("abcdefhijklpqrstuvwxyz@^$")
#: longest block, comments apart
LONGEST = 255
#: a block may give as many M codes
MOST_M = 10

_NUMBERED = re.compile(r"n([0-9]+)(?:\.[0-9]*)?")
_COMMENTED = re.compile(r"[(;]")


@dataclass(frozen=True)
class MacroCall:
    """A call of a macro: the label of its program, repeats, variables by number; ``modal``: after each motion (G66)."""

    label: str
    times: int
    values: tuple[tuple[int, float], ...]
    words: dict[str, float]
    modal: bool = False


@dataclass(slots=True)
class Block:
    """What one block says.

    Parameters
    ----------
    words : value by letter, G M N apart
    g : codes in tenths, in the order of the text
    m : codes
    sets : (parameter, value)
    comments : text of each
    number : N word, -1 without
    after : blocks that are carried out behind it
    hole : Sinumerik's drilling cycle, its name and its arguments; ``modal``: MCALL stands before it
    macro, block_call : call of a macro (G65, G66), and words of M97 of a Haas
    pointless : letters whose numbers are written without a decimal point
    frame : Sinumerik's word that sets the coordinates (TRANS, ROT ...)
    point : Sinumerik's words of a point without coordinates (RP, AP, ANG, AR, I1 ...): how, and the value
    pole : G110 to G112 of a Sinumerik; ``circle``: CIP, ``tangent``: CT
    pattern : Sinumerik's pattern of holes, its name and its arguments
    returns_to : N number that M99 P goes on at; None: behind the call
    pocket : Sinumerik's pocket, its name and its arguments
    program_call, arguments : name of the subprogram that a Sinumerik calls and how often, and its arguments
    """

    words: dict[str, float] = field(default_factory=dict)
    g: list[int] = field(default_factory=list)
    m: list[int] = field(default_factory=list)
    sets: list[tuple[int | str, float]] = field(default_factory=list)
    comments: list[str] = field(default_factory=list)
    number: int = -1
    after: list[Block] = field(default_factory=list)
    hole: tuple[str, list[float | None]] | None = None
    modal: bool = False
    macro: MacroCall | None = None
    block_call: dict[str, float] = field(default_factory=dict)
    frame: str = ""
    pointless: set[str] = field(default_factory=set)
    point: dict[str, tuple[str, float]] = field(default_factory=dict)
    pole: int | None = None
    circle: bool = False
    tangent: bool = False
    pattern: tuple[str, list[float | None]] | None = None
    pocket: tuple[str, list[float | None]] | None = None
    program_call: tuple[str, int] | None = None
    arguments: list[float | None] = field(default_factory=list)
    returns_to: int | None = None


def bare(line: str) -> tuple[str, list[str]]:
    """The block in lower case without spaces and comments, and the comments.

    >>> bare("G0 X1 (over it) ; quick")
    ('g0x1(', ['over it', ' quick'])
    """
    comments: list[str] = []
    if _COMMENTED.search(line):
        parts: list[str] = []
        at = 0
        while at < len(line):
            found = _COMMENTED.search(line, at)
            if found is None:
                parts.append(line[at:])
                break
            parts.append(line[at : found.start()])
            if found[0] == ";":
                comments.append(line[found.end() :].rstrip("\r\n"))
                break
            end = line.find(")", found.end())
            if end < 0:
                raise InputError("a comment is not closed by )")
            text = line[found.end() : end]
            if "(" in text:
                raise InputError("a comment within a comment: write [ ] inside")
            comments.append(text)
            parts.append("(")
            at = end + 1
        line = "".join(parts)
    text = "".join(line.split())
    if not text.isascii():
        odd = next(c for c in text if not c.isascii())
        raise InputError(f"character {odd!r}: only ASCII is allowed outside comments")
    if len(text) > LONGEST:
        raise InputError(f"{len(text)} characters: a block has at most {LONGEST}")
    return text.lower(), comments


def strip_number(text: str) -> tuple[int, int]:
    """(N word or -1, where the block goes on after ``/`` and N)."""
    at = 1 if text.startswith("/") else 0
    if text[at : at + 1] != "n":
        return -1, at
    found = _NUMBERED.match(text, at)
    if found is None:
        raise InputError(f"{text[at : at + 8]!r}: N is followed by a whole number, 0 or more")
    return int(found[1][:12]), found.end()


def read_block(text: str, comments: list[str], parameters: Parameters) -> Block:
    """The words of a block that :func:`bare` has cleaned.

    Raises
    ------
    InputError
        A character means nothing, a value is missing or has no value, a letter appears twice.
    """
    number, at = strip_number(text)
    block = Block(number=number, comments=comments)
    words, end = block.words, len(text)
    while at < end:
        letter = text[at]
        at += 1
        if letter == "(":
            continue
        if letter == "g":
            value, at = read_value(text, at, parameters)
            code = round(10.0 * value)
            if value < 0.0 or abs(10.0 * value - code) > 1e-3 or code > 9999:
                raise InputError(f"G{value:g}: there is no such code")
            block.g.append(code)
        elif letter == "m":
            value, at = read_value(text, at, parameters)
            code = integer_of(value, "code M")
            if not 0 <= code <= 999_999:
                raise InputError(f"M{code}: there is no such code")
            block.m.append(code)
        elif letter == "#":
            key, at = read_parameter_key(text, at, parameters)
            if text[at : at + 1] != "=":
                raise InputError(f"#{_word_text(key)}: = is missing after it")
            value, at = read_value(text, at + 1, parameters)
            parameters.declare(key)
            block.sets.append((key, value))
        elif letter in LETTERS:
            if letter in words:
                raise InputError(f"{letter.upper()}: appears twice in one block")
            begin = at
            words[letter], at = read_value(text, at, parameters)
            if text[begin:at].lstrip("+-").isdigit():
                block.pointless.add(letter)
        else:
            raise InputError(f"character {letter!r}: does not begin a word")
    if len(block.m) > MOST_M:
        raise InputError(f"{len(block.m)} M codes: a block has at most {MOST_M}")
    return block


def _word_text(key: int | str) -> str:
    return str(key) if isinstance(key, int) else f"<{key}>"
