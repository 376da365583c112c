"""The lines of one file, and where its O-words lead.

Notation: an O-word is ``o<label> keyword rest``: ``o100 if [#1 GT 2]``. A label belongs to the subroutine that it
stands in; ``key`` is (subroutine, label). Lines are counted from 0.
"""

from __future__ import annotations

import re
from bisect import bisect_left, bisect_right
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from chipload.errors import InputError
from chipload.program.gcode.words import bare, strip_number

if TYPE_CHECKING:
    from chipload.program.gcode.sinumerik_flow import Statements

KEYWORDS = (
    "endsub", "endif", "endwhile", "endrepeat", "elseif", "else", "sub", "call", "return", "if", "while", "do",
    "repeat", "break", "continue",
)  # fmt: skip
_CANDIDATE = re.compile(r"^[ \t]*(?:/[ \t]*)?(?:[nN][ \t.0-9]*)?[oO]", re.MULTILINE)
_LABEL = re.compile(r"o(?:([0-9]+)(?![0-9.])|<([^<>]+)>)")
_KEYWORD = re.compile("|".join(KEYWORDS))
#: lines of one file
MOST_LINES = 20_000_000


@dataclass(frozen=True, slots=True)
class OWord:
    """``label`` is empty where it has to be calculated; ``rest`` then begins with it."""

    label: str
    keyword: str
    rest: str
    key: tuple[str, str]


@dataclass(eq=False)
class Source:
    """A text by lines.

    Parameters
    ----------
    name : for messages
    lines : of the text
    words : O-words by line
    places : lines of a key, in order
    subs : line of ``sub`` by label
    numbers : line of a bare ``o`` by label: a subroutine in the manner of Fanuc
    blocks : lines by N word, where GOTO has asked for one
    statements : jumps and loops of a Sinumerik, where one was reached
    loop_ends : line of END by that of its DO, where one was reached; None: there is none
    """

    name: str
    lines: list[str]
    words: dict[int, OWord | str] = field(default_factory=dict)
    places: dict[tuple[str, str], list[int]] = field(default_factory=dict)
    subs: dict[str, int] = field(default_factory=dict)
    numbers: dict[str, int] = field(default_factory=dict)
    blocks: dict[int, list[int]] | None = None
    statements: Statements | None = None
    loop_ends: dict[int, int | None] = field(default_factory=dict)

    def keyword(self, line: int) -> str:
        """Keyword on a line."""
        word = self.words[line]
        return word.keyword if isinstance(word, OWord) else ""

    def after(self, line: int, key: tuple[str, str], keywords: tuple[str, ...]) -> int:
        """The next line of a key with one of some keywords."""
        places = self.places.get(key, [])
        for k in range(bisect_right(places, line), len(places)):
            if self.keyword(places[k]) in keywords:
                return places[k]
        raise InputError(f"o{key[1]}: {' or '.join(keywords)} is missing after line {line + 1}")

    def before(self, line: int, key: tuple[str, str], keywords: tuple[str, ...]) -> int:
        """The line of a key with one of some keywords before a line."""
        places = self.places.get(key, [])
        for k in range(bisect_left(places, line) - 1, -1, -1):
            if self.keyword(places[k]) in keywords:
                return places[k]
        raise InputError(f"o{key[1]} {self.keyword(line)}: {' or '.join(keywords)} is missing before it")


def lines_of(text: str, name: str) -> list[str]:
    """The lines of a text; too many are refused."""
    lines = text.split("\n")
    if len(lines) > MOST_LINES:
        raise InputError(f"{name}: more than {MOST_LINES} lines")
    return lines


def read_source(text: str, name: str) -> Source:
    """The lines of a text and its O-words; what cannot be read as one is refused when it is reached."""
    lines = lines_of(text, name)
    source = Source(name, lines)
    scope, line, at = "", 0, 0
    for found in _CANDIDATE.finditer(text):
        line += text.count("\n", at, found.start())
        at = found.start()
        try:
            word = _o_word(lines[line], scope)
        except InputError as error:
            source.words[line] = str(error)
            continue
        source.words[line] = word
        if word.keyword == "sub":
            source.subs.setdefault(word.label, line)
            scope = word.label
            word = OWord(word.label, word.keyword, word.rest, (scope, word.label))
            source.words[line] = word
        elif word.keyword == "" and word.label:
            source.numbers.setdefault(word.label, line)
        elif word.keyword == "endsub":
            scope = ""
        source.places.setdefault(word.key, []).append(line)
    return source


def _o_word(line: str, scope: str) -> OWord:
    text, _ = bare(line)
    _, at = strip_number(text)
    label = _LABEL.match(text, at)
    if label is None:
        return OWord("", "dynamic", text[at + 1 :], (scope, ""))
    name = str(int(label[1][:18])) if label[1] else label[2]
    keyword = _KEYWORD.match(text, label.end())
    if keyword is None:
        rest = text[label.end() :]
        if rest.strip("("):
            raise InputError(f"o{name} {rest[:12]}: no keyword of an O-word follows the label")
        return OWord(name, "", "", (scope, name))
    return OWord(name, keyword[0], text[keyword.end() :].replace("(", ""), (scope, name))
