"""Feeds of an NC text changed in the text itself: F words and nothing else.

Notation: a factor is the new feed of a line over its old one, so that units, inverse time (G93) and feeds per
revolution (G95) need no conversion. F is modal: a line without an F word moves at the last one before it, so that a
line whose factor differs gets a word of its own, behind its last word.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping

from chipload.errors import InputError

#: comments, texts and names, in which no word stands
COMMENTS = re.compile(r"\([^)\n]*\)?|;[^\n]*|\"[^\"\n]*\"?|<[^>\n]*>?")
#: an F word that is a number, or the beginning of one that is calculated
_F = re.compile(
    r"(?<![A-Za-z_])[Ff]\s*=?\s*"
    r"(?:([+-]?(?:\d+\.?\d*|\.\d+))(?![A-Za-z_\[])|(?=[\[#+-]|[A-Za-z_]\w*\s*[\[(]))"
)
#: what a feed is counted in: inch or mm (G20 G21 G70 G71 G700 G710), a time, minutes or turns (G93 G94 G95)
_UNIT = re.compile(r"(?<![A-Za-z_])[gG]\s*0*(20|21|70|71|700|710|93|94|95)(?![\d.])")
_O_WORD = re.compile(r"\s*(?:/\s*)?(?:[nN][\s.0-9]*)?[oO]\s*(?:\d+|<[^>]*>)\s*([A-Za-z]\w*)")
_JUMP = re.compile(r"(?<![A-Za-z_])(?:[mM]\s*0*98(?!\d)|GOTO[BF]?\b)")
#: significant digits of a new feed; it is rounded towards the slower one
DIGITS = 4


def with_feeds(text: str, lines: Mapping[int, float]) -> str:
    r"""The text with other feeds; O(length).

    Parameters
    ----------
    lines : factor by line, from 1, of every line that moves at a feed; a new feed is rounded down to four digits

    Returns
    -------
    The text; every line as it was but for F words.

    Raises
    ------
    InputError
        The text does not run straight through, a feed is calculated or was stated in another unit than the line that
        needs a new one moves in: the line is named.

    >>> with_feeds("G1 X10 F600 (wall)\nY5 ; corner\nX0", {1: 1.0, 2: 0.5, 3: 1.0})
    'G1 X10 F600 (wall)\nY5 F300 ; corner\nX0 F600'
    """
    for line, times in lines.items():
        if not 0.0 < times < math.inf:
            raise InputError(f"line {line}: a feed {times:g} times the old one: must be above 0")
    out: list[str] = []
    old, now, pointed = math.nan, "", False
    units, stated_in = {"length": "mm", "time": "94"}, dict[str, str]()
    for number, raw in enumerate(text.split("\n"), 1):
        open_text = COMMENTS.sub(lambda found: " " * len(found[0]), raw)
        _straight(raw, open_text, number)
        word, factor = _feed_word(open_text, number), lines.get(number)
        if word is not None:
            # a control may count a number without a decimal point in thousandths
            old, now, stated_in, pointed = float(word[1]), word[1], units, "." in word[1]
        units = _units(open_text, units)
        if factor is None:
            out.append(raw)
            continue
        if math.isnan(old):
            raise InputError(f"line {number}: moves at a feed that no line above it states: state one")
        new = now if factor == 1.0 and word is not None else written_feed(old, factor, pointed)
        if word is not None:
            raw, now = raw[: word.start(1)] + new + raw[word.end(1) :], new
        elif float(new) != float(now):
            if units != stated_in:
                raise InputError(f"line {number}: moves at a feed that was stated in another unit: state it again here")
            end = len(open_text.rstrip())
            raw, now = f"{raw[:end]} F{new}{raw[end:]}", new
        out.append(raw)
    return "\n".join(out)


def _straight(raw: str, open_text: str, number: int) -> None:
    """Refuse what jumps: behind it the feed that stands depends on the way that was taken."""
    found = _O_WORD.match(raw) or _JUMP.search(open_text)
    if found is not None:
        raise InputError(
            f"line {number}: {found[0].strip()}: feeds are changed only in a program without jumps: convert it "
            "first (chipload convert)"
        )


def _units(open_text: str, units: dict[str, str]) -> dict[str, str]:
    """What feeds are counted in behind a line; a word of the line itself is counted in what stood before it."""
    for found in _UNIT.finditer(open_text):
        if found[1].startswith("9"):
            units = {**units, "time": found[1]}
        else:
            units = {**units, "length": "inch" if found[1] in ("20", "70", "700") else "mm"}
    return units


def _feed_word(open_text: str, number: int) -> re.Match[str] | None:
    found = _F.search(open_text)
    if found is not None and found[1] is None:
        shown = open_text[found.start() :].strip()[:20]
        raise InputError(f"line {number}: {shown}: a feed that is calculated cannot be changed: write the number")
    return found


def written_feed(old: float, factor: float, pointed: bool) -> str:
    """The new feed in digits, never above it; with a decimal point where ``pointed``.

    >>> written_feed(1200.0, 1 / 3, False), written_feed(0.25, 0.5, False), written_feed(15.0, 2.0, True)
    ('400', '0.125', '30.')
    """
    value = old * factor * (1.0 + 1e-12)
    if factor == 1.0:
        text = f"{old:.10f}"
    else:
        places = DIGITS - 1 - math.floor(math.log10(abs(value)))
        scale = 10.0**places
        text = f"{math.floor(value * scale) / scale:.{max(places, 0)}f}"
    text = text.rstrip("0").rstrip(".") if "." in text else text
    return text + "." if pointed and "." not in text else text
