"""Spindle speeds of an NC text changed in the text itself: S words, and F words where the feed is counted in time.

Notation: an S word holds from its line to the line of the next one. A feed per minute or in inverse time (G94, G93)
follows the speed, so that the feed per tooth stays; a feed per revolution (G95) stays as it is.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass

from chipload.errors import InputError
from chipload.program.gcode.feed_words import COMMENTS, with_feeds

#: an S word with its number, also ``S1=6000``, or the beginning of one that is calculated
_S = re.compile(
    r"(?<![A-Za-z_])[Ss](?:\d+\s*=\s*|\s*=?\s*)"
    r"(?:([+-]?(?:\d+\.?\d*|\.\d+))(?![A-Za-z_\[\d=])|(?=[\[#]|[A-Za-z_]\w*\s*[\[(]))"
)
_TIME = re.compile(r"(?<![A-Za-z_])[gG]\s*0*(93|94|95)(?![\d.])")
#: constant surface speed
_SURFACE = re.compile(r"(?<![A-Za-z_])[gG]\s*96(?!\d)")


@dataclass(frozen=True)
class SpeedWord:
    """An S word: its line, from 1, and its number [1/min]."""

    line: int
    rpm: float


def speed_words(text: str) -> tuple[SpeedWord, ...]:
    r"""The S words of a text, in its order.

    Raises
    ------
    InputError
        A speed is calculated, a line has two, or the text asks for a constant surface speed: the line is named.

    >>> speed_words("T1 M6 (S 12)\nS6000 M3\nG1 X1 F100 S7000.")
    (SpeedWord(line=2, rpm=6000.0), SpeedWord(line=3, rpm=7000.0))
    """
    return tuple(SpeedWord(line, float(found[1])) for line, found in _find_speeds(text))


def with_speeds(
    text: str, speeds: Mapping[int, float], feeds: Mapping[int, float], added: Mapping[int, float] | None = None
) -> str:
    r"""The text with other speeds; O(length).

    Parameters
    ----------
    speeds : new number [1/min] of the S word of a line
    feeds : factor on the speed by line, of every line that moves at a feed
    added : number [1/min] of a new S word behind the last word of a line that has none

    Returns
    -------
    The text; every line as it was but for S and F words.

    Raises
    ------
    InputError
        As :func:`speed_words` and :func:`chipload.program.gcode.feed_words.with_feeds`, or a line has no S word, or has
        one where one is to be added.

    >>> with_speeds("S6000 M3\nG1 X10 F600\nG95 G1 X20 F0.1", {1: 9000.0}, {2: 1.5, 3: 1.5})
    'S9000 M3\nG1 X10 F900\nG95 G1 X20 F0.1'
    >>> with_speeds("S6000 M3\nG0 Z5 (up)\nG1 X20 F600", {}, {3: 1.5}, {2: 9000.0})
    'S6000 M3\nG0 Z5 S9000 (up)\nG1 X20 F900'
    """
    lines = text.split("\n")
    left, more, address = dict(speeds), dict(added or {}), "S"
    for line, found in _find_speeds(text):
        address = found[0][: found.start(1) - found.start()]
        if line in more:
            raise InputError(f"line {line}: has an S word: change it")
        if line in left:
            new = _possible(line, left.pop(line))
            raw = lines[line - 1]
            lines[line - 1] = f"{raw[: found.start(1)]}{new:.10g}{raw[found.end(1) :]}"
    if left:
        raise InputError(f"line {min(left)}: has no S word")
    for line, new in more.items():
        end = len(COMMENTS.sub(lambda found: " " * len(found[0]), lines[line - 1]).rstrip())
        lines[line - 1] = f"{lines[line - 1][:end]} {address}{_possible(line, new):.10g}{lines[line - 1][end:]}"
    per_turn = _per_turn(text)
    factors = {line: 1.0 if line in per_turn else factor for line, factor in feeds.items()}
    return with_feeds("\n".join(lines), factors)


def _possible(line: int, speed: float) -> float:
    """A new speed of a line, which must be above 0."""
    if not 0.0 < speed < math.inf:
        raise InputError(f"line {line}: a speed of {speed:g}: must be above 0")
    return speed


def _find_speeds(text: str) -> list[tuple[int, re.Match[str]]]:
    out = []
    for line, raw in enumerate(text.split("\n"), 1):
        open_text = COMMENTS.sub(lambda found: " " * len(found[0]), raw)
        if _SURFACE.search(open_text):
            raise InputError(f"line {line}: G96: a constant surface speed has no spindle speed that could be changed")
        words = list(_S.finditer(open_text))
        if len(words) > 1:
            raise InputError(f"line {line}: two S words: write one")
        if words:
            if words[0][1] is None:
                shown = open_text[words[0].start() :].strip()[:20]
                raise InputError(
                    f"line {line}: {shown}: a speed that is calculated cannot be changed: write the number"
                )
            out.append((line, words[0]))
    return out


def _per_turn(text: str) -> set[int]:
    """Lines whose feed is counted per revolution."""
    out, time = set(), "94"
    for line, raw in enumerate(text.split("\n"), 1):
        for found in _TIME.finditer(COMMENTS.sub(" ", raw)):
            time = found[1]
        if time == "95":
            out.add(line)
    return out
