"""Feeds of a conversational text changed in the text itself: F words and nothing else.

Notation: as in :mod:`chipload.program.gcode.feed_words`; F is modal, FMAX counts in its block alone. A block without
an F word whose feed differs gets one before its M functions.

Some blocks keep their feed: those that run a cycle, whose feeds are its Q parameters, and those beside RND, CHF and
APPR, which take the feed of the block before or after them.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping

from chipload.errors import InputError
from chipload.program.gcode.feed_words import written_feed
from chipload.program.heidenhain.din_iso import is_din_iso
from chipload.program.heidenhain.words import FEED, M_CODE, PLUNGING, TURN_FEED

#: comments and texts, in which no word stands
_COMMENTS = re.compile(r";.*|\"[^\"]*\"?")
_NUMBER = re.compile(r"\d+\.?\d*|\.\d+")
_BLOCK = re.compile(r"\s*\d*\s*([A-Z]+)\s*([A-Z]*)")
_JUMP = re.compile(r"\b(?:CALL\s+(?:LBL|PGM|SELECTED)|GOTO\s+LBL|SEL\s+PGM|PGM\s+CALL)\b")
#: how the blocks of motions begin
_MOTIONS = {"L", "LP", "LN", "C", "CR", "CT", "CP", "CTP", "APPR", "DEP"}
_UNITS = {"136": "turn", "137": "minute"}
#: feed of the motions that TCPM adds, no feed of a cut
_ADDED = re.compile(r"\bM\s*128\s*F")
_CYCLE = re.compile(r"\bCYCLE?\s+CALL\b|\bM\s*(?:89|99)\b")


def kept_feeds(text: str) -> frozenset[int]:
    r"""Return the lines, from 1, whose feed cannot be changed by a word of their own.

    >>> sorted(kept_feeds("L X+1 F100\nRND R2\nL Y+1\nL Y+2\nL X+3 M99\nL X+4\nCYCL CALL"))
    [1, 2, 3, 5, 7]
    """
    blocks = _open_blocks(text)
    moves = [k for k, block in enumerate(blocks) if _word(block) in _MOTIONS]
    out, modal = set[int](), False
    for k, block in enumerate(blocks):
        word = _word(block)
        if word in ("RND", "CHF", "APPR"):
            out.add(k)
            out |= {max((m for m in moves if m < k), default=k)}
            if word != "APPR":
                out |= {min((m for m in moves if m > k), default=k)}
        modal |= re.search(r"\bM\s*89\b", block) is not None
        if modal or word in ("CYCL", "CYCLE") or _CYCLE.search(block):
            out.add(k)
        modal &= re.search(r"\bM\s*99\b", block) is None
    return frozenset(k + 1 for k in out)


def with_feeds(text: str, lines: Mapping[int, float]) -> str:
    r"""Return the text with other feeds; O(length).

    Parameters
    ----------
    lines : factor by line, from 1, of every line that moves at a feed; a new feed is rounded down to four digits. A
        line of :func:`kept_feeds` has the factor 1

    Raises
    ------
    InputError
        The text does not run straight through, a feed is calculated or comes from a tool table, or it was stated in
        another unit than the line that needs a new one moves in: the line is named.

    >>> with_feeds("L X+10 F600 ; wall\nL Y+5 R0 M8\nL Z+9 FMAX\nL X0", {1: 1.0, 2: 0.5, 4: 1.0})
    'L X+10 F600 ; wall\nL Y+5 R0 F300 M8\nL Z+9 FMAX\nL X0 F600'
    """
    for line, times in lines.items():
        if not 0.0 < times < math.inf:
            raise InputError(f"line {line}: a feed {times:g} times the old one: must be above 0")
    if is_din_iso(text):
        raise InputError("a DIN/ISO program: feeds are changed in conversational programs only: export one")
    out = text.split("\n")
    old, now, letters = math.nan, "", "F"
    unit = stated_in = "minute"
    kept = kept_feeds(text)
    for k, block in enumerate(_open_blocks(text)):
        number = k + 1
        if (jump := _JUMP.search(block)) is not None:
            raise InputError(
                f"line {number}: {jump[0]}: feeds are changed only in a program without jumps: convert it first "
                "(chipload convert)"
            )
        place = None if _word(block) in ("CYCL", "CYCLE", "RND", "CHF") else _feed_word(block, number)
        for m in M_CODE.findall(block):
            unit = _UNITS.get(m, unit)
        if place is not None:
            stated_in, letters = unit, "FU" if place[2] else "F"
            now = block[place[0] : place[1]]
            old = float(now)
        factor = lines.get(number)
        if factor is None or (number in kept and factor == 1.0 and float(now or "nan") == old):
            continue
        if math.isnan(old):
            raise InputError(f"line {number}: moves at a feed that no line above it states: state one")
        new = now if factor == 1.0 and place is not None else written_feed(old, factor, False)
        if place is not None:
            out[k], now = out[k][: place[0]] + new + out[k][place[1] :], new
        elif float(new) != float(now):
            if unit != stated_in:
                raise InputError(f"line {number}: moves at a feed that was stated in another unit: state it again here")
            m_word = M_CODE.search(block)
            end = len(block[: m_word.start() if m_word else None].rstrip())
            out[k], now = f"{out[k][:end]} {letters}{new}{out[k][end:]}", new
    return "\n".join(out)


def _open_blocks(text: str) -> list[str]:
    """Return each line in capitals, as long as it is, without comments and texts; empty where it continues a cycle."""
    blocks, goes_on = [], False
    for raw in text.split("\n"):
        block = _COMMENTS.sub(lambda found: " " * len(found[0]), raw).upper()
        blocks.append("" if goes_on else block)
        goes_on = raw.rstrip().endswith("~")
    return blocks


def _word(block: str) -> str:
    """Return the word that a block begins with, behind its number."""
    found = _BLOCK.match(block)
    return "" if found is None else found[1]


def _feed_word(block: str, number: int) -> tuple[int, int, bool] | None:
    """Return where the number of the feed of a block begins and ends, and whether it is for each turn; None: no F."""
    if (added := _ADDED.search(block)) is not None:
        raise InputError(f"line {number}: {added[0].strip()}: is no feed of a cut: write M128 in a block of its own")
    block = PLUNGING.sub(lambda hit: " " * len(hit[0]), block)
    turned = TURN_FEED.search(block)
    found = turned or FEED.search(block)
    if found is None or found[1] == "MAX":
        return None
    digits = _NUMBER.search(block, found.start(1), found.end(1))
    if digits is None or "Q" in found[1] or found[1] == "AUTO":
        raise InputError(f"line {number}: {found[0].strip()}: a feed that is no number cannot be changed: write it")
    return digits.start(), digits.end(), turned is not None
