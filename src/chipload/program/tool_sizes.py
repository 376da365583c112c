"""Sizes that shops write as names: number and letter drills, threads, fractions of an inch.

References: sizes of drills ASME B94.11M, unified threads ASME B1.1 (number n: 0.060 + 0.013 n in), metric threads
ISO 261.
"""

from __future__ import annotations

import re

from chipload.program.tapping import COARSE
from chipload.units import MM_PER

#: diameters of number drills 1 to 80 [0.0001 in]
_NUMBERS = (
    2280, 2210, 2130, 2090, 2055, 2040, 2010, 1990, 1960, 1935, 1910, 1890, 1850, 1820, 1800, 1770, 1730, 1695, 1660,
    1610, 1590, 1570, 1540, 1520, 1495, 1470, 1440, 1405, 1360, 1285, 1200, 1160, 1130, 1110, 1100, 1065, 1040, 1015,
    995, 980, 960, 935, 890, 860, 820, 810, 785, 760, 730, 700, 670, 635, 595, 550, 520, 465, 430, 420, 410, 400, 390,
    380, 370, 360, 350, 330, 320, 310, 292, 280, 260, 250, 240, 225, 210, 200, 180, 160, 145, 135,
)  # fmt: skip
#: diameters of letter drills A to Z [0.001 in]
_LETTERS = (
    234, 238, 242, 246, 250, 257, 261, 266, 272, 277, 281, 290, 295, 302, 316, 323, 332, 339, 348, 358, 368, 377, 386,
    397, 404, 413,
)  # fmt: skip
#: diameters of the bodies of centre drills 00 to 8 (ASME B94.11M) [1/64 in]
_CENTRE = {"00": 5, "0": 8, "1": 8, "2": 12, "3": 16, "4": 20, "5": 28, "6": 32, "7": 40, "8": 48}
_CENTRE_DRILL = re.compile(
    r"(?:#\s*|\bNO\.?\s*|\bNUMBER\s*)(?P<before>00|[0-8])(?![0-9./]).*?C(?:EN)?T(?:ER|RE|R)?\.?\s*-?\s*DR"
    r"|C(?:EN)?T(?:ER|RE|R)?\.?\s*-?\s*DR(?:IL)?L?\s*(?:#\s*|\bNO\.?\s*)(?P<after>00|[0-8])(?![0-9./])"
)
_DRILL = re.compile(
    r"(?:#|\bNO\.?\s*|\bNUMBER\s*|\bNUM\.?\s*)(?P<number>[0-9]{1,2})(?![0-9./])"
    r"|(?:\bLTR\.?\s*|\bLETTER\s*)(?P<letter>[A-Z])\b|(?<![A-Z0-9.])(?P<own>[A-Z])\s*-?\s*(?:SIZE\s*)?DRILL"
)
_DECIMAL = r"(?:[0-9]+\.?[0-9]*|\.[0-9]+)"
_METRIC = re.compile(rf"\bM\s?(?P<d>{_DECIMAL})(?:\s*[X*-]\s*(?P<p>{_DECIMAL}))?(?![0-9.])")
_INCH = re.compile(
    rf"(?<![0-9./])(?:#\s*|\bNO\.?\s*)?(?:(?P<whole>[0-9])[- ])?(?P<d>[0-9]{{1,2}}/[0-9]{{1,2}}|{_DECIMAL})\"?\s*-\s*"
    r"(?P<n>[0-9]{1,2})(?![0-9./])"
)


def drill_size(words: str) -> float | None:
    """Diameter [mm] of a drill by its number or letter, of a centre drill that of its body; None: there is neither.

    >>> round(drill_size("#4 CENTER DRILL"), 4), round(drill_size("NO. 3 CTR DRILL"), 4)
    (7.9375, 6.35)
    >>> round(drill_size("#7 DRILL"), 4), round(drill_size("LTR. F DRILL"), 4), drill_size("6.8 DRILL")
    (5.1054, 6.5278, None)
    """
    if (centre := _CENTRE_DRILL.search(words)) is not None:
        return _CENTRE[centre["before"] or centre["after"]] * MM_PER["inch"] / 64.0
    found = _DRILL.search(words)
    if found is None:
        return None
    if found["number"] is not None:
        number = int(found["number"])
        return _NUMBERS[number - 1] * MM_PER["inch"] / 1e4 if 1 <= number <= len(_NUMBERS) else None
    return _LETTERS[ord(found["letter"] or found["own"]) - ord("A")] * MM_PER["inch"] / 1e3


def thread_size(words: str) -> tuple[float, float | None] | None:
    """Major diameter and pitch [mm] of a thread's designation; a pitch None is not stated and no coarse one.

    >>> thread_size("M6X1. TAP"), thread_size("M8 TAP"), thread_size("1/4-20 UNC")
    ((6.0, 1.0), (8.0, 1.25), (6.35, 1.27))
    >>> tuple(round(x, 5) for x in thread_size("#10-32 TAP"))
    (4.826, 0.79375)
    """
    metric = _METRIC.search(words)
    if metric is not None:
        d = float(metric["d"])
        pitch = float(metric["p"]) if metric["p"] else COARSE.get(d)
        return (d, pitch) if d > 0.0 and (pitch is None or 0.0 < pitch < d) else None
    inch = _INCH.search(words)
    if inch is None or int(inch["n"]) < 4:
        return None
    over, _, below = inch["d"].partition("/")
    if below:
        d = float(inch["whole"] or 0) + (float(over) / float(below) if float(below) > 0.0 else 0.0)
    else:
        # a whole number is the number of a screw, 0 to 14; a fraction or a decimal is in inches
        d = 0.060 + 0.013 * float(over) if "." not in over and float(over) <= 14.0 else float(over)
    pitch = 1.0 / int(inch["n"])
    return (d * MM_PER["inch"], pitch * MM_PER["inch"]) if pitch < d <= 6.0 else None
