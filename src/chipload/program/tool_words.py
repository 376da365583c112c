"""What a comment or a name says about a tool: its kind, and the numbers with what they measure.

Read are the words of common posts and of programs by hand, in English, German and French: ``3/8 BULL ENDMILL .03 RAD``,
``#7 JOBBER DRILL``, ``1/2 X 90DEG CRB SPOT DRILL``, ``M8X1.25 TAP``, ``EM12R1``, ``V-Bit {60 deg 12.7mm}``,
``DM=8 CR=0.5``.

Notation: numbers are found in the order keyed diameter (``D=``, ``DIA``), thread, unit, fraction of an inch, number or
letter of a drill, decimal number, whole number. A number that measures something else (teeth, angle, length, offset)
is taken out of the text first.
"""

from __future__ import annotations

import re
from enum import Enum
from typing import Any

from chipload.program.reconcile import length_of
from chipload.program.tool_sizes import drill_size, thread_size

#: value and where it stands, by key of the ``[[cutter]]``; ``kind`` is a
#: :class:`ToolKind`, ``number_mm`` a number that may be the diameter
Stated = dict[str, tuple[Any, str]]


class ToolKind(Enum):
    """Kinds of tools that a draft tells apart."""

    END_MILL = "end mill"
    BALL = "ball nose"
    BULL = "bull nose"
    FACE = "face mill"
    CHAMFER = "chamfer mill"
    COUNTERSINK = "countersink"
    DRILL = "drill"
    SPOT = "spot drill"
    TAP = "tap"
    THREAD_MILL = "thread mill"
    REAMER = "reamer"
    BORING = "boring bar"
    TAPERED = "tapered mill"
    DOVETAIL = "dovetail mill"
    LOLLIPOP = "lollipop mill"
    SLOT = "T-slot mill"
    PROBE = "probe"


_MAKES_HOLES = frozenset({ToolKind.DRILL, ToolKind.SPOT, ToolKind.TAP, ToolKind.REAMER, ToolKind.BORING})
#: words of each kind, the first that is found decides
_KINDS = (
    (ToolKind.DRILL, r"\bTAP\s*-?\s*DRILL|KERNLOCH"),
    (ToolKind.PROBE, r"PROBE|RENISHAW|TASTER\b|PALPEUR|EDGE\s*FINDER"),
    (ToolKind.THREAD_MILL, r"TH(?:REA|R)D\s*-?\s*MILL|GEWINDEFR"),
    (ToolKind.TAP, r"\bTAP(?:PED|PING|S|RH|LH)?\b|GEWINDEBOHR|GEWINDEFORM|TARAUD"),
    (ToolKind.REAMER, r"\bREAM|REIBAHLE|ALESOIR"),
    (ToolKind.BORING, r"\bBOR(?:E|ING)\s*-?\s*(?:BAR|HEAD|TOOL)|AUSDREH"),
    (ToolKind.SPOT, r"SPOT|C(?:EN)?T(?:ER|RE|R)\.?\s*-?\s*DR|\bNC.?DRILL|ZENTRIER|ANBOHR|POINTER"),
    (ToolKind.END_MILL, r"SLOT\s*-?\s*DRILL"),
    (ToolKind.COUNTERSINK, r"C(?:OUNTER|\.|')?\s*-?\s*SINK|\bCSK\b|SENKER"),
    (ToolKind.CHAMFER, r"CHAM(?:FER)?\b|CHAMFER|\bCHMF|\bV.?BIT|\bV.?CARV|ENGRAV|GRAVI|FASE[NR]?|DEBURR|\bDRILL.?MILL"),
    (ToolKind.FACE, r"FACE\s*-?\s*MILL|FACING|SHELL\s*-?\s*MILL|PLANFR|FLY\s*-?\s*CUT|SURFAC(?:ER|ING)|\bMESSERKOPF"),
    (ToolKind.DOVETAIL, r"DOVE\s*-?TAIL|SCHWALBEN"),
    (ToolKind.LOLLIPOP, r"LOLLI|UNDERCUT"),
    (ToolKind.SLOT, r"\bT.?SLOT|KEY\s*-?\s*(?:SEAT|CUT)|WOODRUFF|SLITTING|\bSAW\b|\bSLOT\s*MILL"),
    (ToolKind.TAPERED, r"\bTAPERED|\bTAPER\s+(?:BALL|MILL|END)"),
    (ToolKind.BALL, r"\bBALL|KUGEL|RADIUSFR|HEMISPH|\bBN\b|\bB[EN]?M(?=[0-9 ])"),
    (ToolKind.BULL, r"\bBULL|TORUS|TOROID|TORIQUE|TORISCH|CORNER\s*-?RAD|RADIUSED"),
    (ToolKind.DRILL, r"DRILL|BOHRER|\bFORET|\bJOBBER|\bDRL?(?=[0-9 ])|\bBORER\b"),
    (
        ToolKind.END_MILL,
        r"END\s*-?\s*MILL|\bE\.?M\.?(?=[0-9 ]|$)|MILL\b|MILL(?=[0-9 ])|CUTTER|FR(?:AE|Ä|A)S|FRAISE|ROUGH(?:ER|ING)|"
        r"\bFLAT\b|\bCRB\b|\bSHOULDER",
    ),
)  # fmt: skip
_KIND = tuple((kind, re.compile(words)) for kind, words in _KINDS)
_N = r"(?:[0-9]+\.?[0-9]*|\.[0-9]+)"
_UNIT = r"(?:MM\b|IN(?:CH(?:ES)?)?\b|\")"
_SIZE = rf"(?:[0-9]+[- ][0-9]+/[0-9]+|[0-9]+/[0-9]+|{_N})(?![0-9./])"
_FREE = r"(?<![-+.0-9/A-Z])"
#: what is measured by numbers that are no diameter: taken out of the text, the first group being the value
_CORNER = re.compile(
    rf"(?:\bCR\s*[=:]?|\bTORUS\s+RADIUS\s*[=:]|\bCORNER\s*-?RAD(?:IUS)?\.?\s*[-=:]?|(?<![A-Z])R\s*[=:]?)\s*({_SIZE})\s*({_UNIT})?"
    rf"|{_FREE}({_SIZE})\s*({_UNIT})?\s*(?:CR|R|RAD|RADIUS|CORNER\s*-?RAD(?:IUS)?)\b(?!\s*[=:]?\s*[.0-9])"
)
_ANGLE = re.compile(
    rf"(?P<key>\bTAPER\s*[=:]\s*)?(?<![.0-9])({_N})\s*-?\s*(?:DEG(?:REES?)?\b|°)|\b(?:DEG|ANGLE|ANG)\.?\s*[-=:]?\s*({_N})"
)
_FLUTES = re.compile(
    rf"{_FREE}([0-9]{{1,2}})\s*-?\s*(?:FL(?:T|UTES?|UTED)?S?|F)\b|\bFLUTES?\s*[=:]\s*([0-9]{{1,2}})\b"
    r"|\bZ\s*=?\s*([0-9]{1,2})(?![0-9.])"
)
_FLUTE_LENGTH = re.compile(
    rf"{_FREE}({_SIZE})\s*({_UNIT})?\s*LOC\b|\b(?:LOC|FLUTE\s+LEN(?:GTH)?|LCF)\s*[-=:]?\s*({_SIZE})\s*({_UNIT})?"
)
_OVERHANG = re.compile(
    rf"\b(?:STICK\s*-?OUT|FLUTE\s+EXT|OHL|OVERHANG)\s*[-=:]?\s*({_SIZE})\s*({_UNIT})?"
    rf"|{_FREE}({_SIZE})\s*({_UNIT})?\s*STICK\s*-?OUT"
)
#: numbers of no use here: heights, offsets, whole lengths, numbers of tools and holders
_OTHER = re.compile(
    rf"\bZ(?:MIN|MAX)\s*=\s*[-+]?{_N}|\b[HD]\s?[0-9]{{1,3}}(?![0-9./]|\s*{_UNIT}|\s*R)|\b(?:DIA|LEN)\.?\s*OFF(?:SET)?\.?"
    rf"\s*[-=:]?\s*[0-9]+|\bLEN\.?\s*[-=]\s*[0-9]+(?=\s)|\b(?:OAL|TL|GL|L|LEN(?:GTH)?)\s*[=:]?\s*{_SIZE}\s*{_UNIT}?"
    rf"|{_FREE}{_SIZE}\s*{_UNIT}?\s*(?:OAL|LG|LONG|BELOW|ABOVE|UNDER|DEEP|DEPTH|DOC|TALL|HIGH|THICK)\b|\bER\s?[0-9]{{2}}\b|\b(?:HSK|CAT|BT|SK)\s*-?[0-9]{{2}}\b"
    r"|\bTOOL\s*#?\s*[0-9]+\b"
)
_DIAMETER = re.compile(
    rf"(?:\bDM|\bD(?=\s*[=:])|\bD(?=[0-9.])|\bD(?=\s+{_SIZE}\s*{_UNIT})|Ø|\b(?:DIAMETER|DIAM|DIA)\.?)\s*[-=:]?\s*({_SIZE})\s*({_UNIT})?"
    rf"|{_FREE}({_SIZE})\s*({_UNIT})?\s*-?\s*(?:IN\s+)?(?:DIA|DIAM|DIAMETER)\b"
)
_RADIUS = re.compile(rf"\bTOOL\s+RADIUS\s*[=:]\s*({_SIZE})\s*({_UNIT})?")
#: a diameter of the workpiece: that of the tool only where it makes the hole
_OF_PART = re.compile(
    rf"{_FREE}{_SIZE}\s*{_UNIT}?\s*-?\s*(?:DIAMETER|DIAM|DIA)\b\.?\s+(?:OF\s+(?:THE\s+)?)?(?:HOLES?|BORES?|POCKETS?|CIRCLE|"
    r"BOLT|BOSS|PART|RINGS?|BEZEL|STOCK|BLANK|DISCS?|DISKS?|WHEEL|ROUND|BAR|SHAFT|TUBE)\b"
)
#: name of a tool with its diameter behind it: ``EM12R1``
_NAMED = re.compile(rf"\b(?:EM|BEM|BNM|BM|FM|DR|DRL|MILL|DRILL|CUTTER|REAM(?:ER)?)\s?({_SIZE})\s*({_UNIT})?")
_WITH_UNIT = re.compile(rf"{_FREE}({_SIZE})\s*-?\s*({_UNIT})")
_FRACTION = re.compile(rf"{_FREE}((?:[0-9]+[- ])?[0-9]+/[0-9]+)(?![0-9/])()")
_POINT = re.compile(rf"{_FREE}([0-9]+\.[0-9]*|\.[0-9]+)(?![0-9/])()")
_WHOLE = re.compile(r"(?<![-+.0-9/A-Z#])([0-9]{1,3})(?![-0-9./])()")
#: largest diameter that a whole number may state without a unit [mm]
LARGEST_MM = 200.0
_MODULI = (
    (re.compile(r"\b(?:CRB|CARB|CARBIDE|VHM|SOLID\s*CARB)\b"), 580.0, "carbide"),
    (re.compile(r"\bHSS|\bHSCO\b|\bCOBALT\b"), 210.0, "high-speed steel"),
)


def kind_of(text: str) -> ToolKind | None:
    """Kind of the tool that a text names; None: it names none.

    >>> kind_of("3/8 BALL ENDMILL").value, kind_of("M6 TAP DRILL").value, kind_of("SIDE 2")
    ('ball nose', 'drill', None)
    """
    words = _plain(text)
    return next((kind for kind, pattern in _KIND if pattern.search(words)), None)


def names_diameter(text: str, unit: bool = False) -> bool:
    """Whether a text says of a number that it is a diameter; with ``unit`` also whether a number has a unit.

    >>> names_diameter("D16R0.8"), names_diameter("IS 5 MM ABOVE THE PART")
    (True, False)
    """
    words = _without_part(_plain(text), kind_of(text))
    return any(p.search(words) is not None for p in (_DIAMETER, _RADIUS)) or (
        unit and _WITH_UNIT.search(words) is not None
    )


def describe_tool(text: str, mm: float, where: str = "") -> Stated:
    """What a text states about a tool; no diameter where no number of it is one.

    Parameters
    ----------
    mm : in the unit of numbers without one
    where : the text stands, for the draft

    >>> said = describe_tool("1/2 X 90DEG CRB SPOT DRILL 2FL", 1.0)
    >>> [said[key][0] for key in ("diameter_mm", "bottom_deg", "flutes", "modulus_gpa")]
    [12.7, 45.0, 2, 580.0]
    """
    where = where or f"the comment ({' '.join(text.split())[:50]})"
    words = _plain(text)
    kind = next((k for k, pattern in _KIND if pattern.search(words)), None)
    out: Stated = {"name": (" ".join(text.split()), where)}
    if kind is not None:
        out["kind"] = (kind, where)
    for pattern, modulus, body in _MODULI:
        if pattern.search(words):
            out.setdefault("modulus_gpa", (modulus, f"{body}: {where}"))
    taper = re.search(r"\bTAPER\s*[=:]", words) is not None
    of_part = _without_part(words, kind) != words
    words = _without_part(words, kind)
    keyed, words = _take_length(_DIAMETER, words, mm)
    radius, words = _take_length(_RADIUS, words, mm)
    if keyed is None and radius is not None:
        keyed = 2.0 * radius
    words, numbers = _measures(words, mm)
    for key, value in numbers.items():
        if key != "angle":
            out[key] = (value, where)
    thread = thread_size(words) if kind in (ToolKind.TAP, ToolKind.THREAD_MILL) else None
    diameter = keyed
    if thread is not None:
        diameter = thread[0]
        if thread[1] is not None:
            out["thread_pitch_mm"] = (thread[1], where)
    if diameter is None and not of_part:
        diameter = _first_size(words, kind, mm)
    if diameter is not None and diameter > 0.0:
        out["diameter_mm"] = (diameter, where)
    out.pop("corner_radius_mm", None)
    return out | _tip(kind, diameter, numbers, taper, where)


def _without_part(words: str, kind: ToolKind | None) -> str:
    """Words without the diameters of the workpiece that their tool does not have."""
    return words if kind in _MAKES_HOLES else _OF_PART.sub(" ", words)


def _plain(text: str) -> str:
    return " ".join(re.sub(r"[_{}\[\]|,;()]", " ", text.upper()).split())


def _take_length(pattern: re.Pattern[str], words: str, mm: float) -> tuple[float | None, str]:
    """The first length [mm] of a pattern, and the text without it."""
    found = pattern.search(words)
    if found is None:
        return None, words
    groups = list(found.groups())
    k = next(k for k in range(0, len(groups), 2) if groups[k] is not None)
    return _length(groups[k], groups[k + 1] or None, mm), f"{words[: found.start()]} {words[found.end() :]}"


def _length(value: str, unit: str | None, mm: float) -> float:
    """A length [mm], also ``1-1/2``."""
    whole, _, rest = value.replace("-", " ").partition(" ")
    return length_of(whole, unit, mm) if not rest else length_of(whole, "IN", mm) + length_of(rest, unit, mm)


def _measures(words: str, mm: float) -> tuple[str, dict[str, float | int]]:
    """The text without the numbers that are no diameter, and those that a cutter has."""
    out: dict[str, float | int] = {}
    angle = _ANGLE.search(words)
    if angle is not None:
        out["angle"] = float(angle[2] or angle[3])
        words = f"{words[: angle.start()]} {words[angle.end() :]}"
    flutes = _FLUTES.search(words)
    if flutes is not None:
        count = int(next(group for group in flutes.groups() if group is not None))
        if 1 <= count <= 20:
            out["flutes"] = count
        words = f"{words[: flutes.start()]} {words[flutes.end() :]}"
    for pattern, key in ((_FLUTE_LENGTH, "flute_length_mm"), (_OVERHANG, "overhang_mm"), (_CORNER, "corner_radius_mm")):
        value, words = _take_length(pattern, words, mm)
        if value is not None and value > 0.0:
            out[key] = value
    return _OTHER.sub(" ", words), out


def _first_size(words: str, kind: ToolKind | None, mm: float) -> float | None:
    """The diameter [mm] by the surest form of a number."""
    hole = kind in (ToolKind.DRILL, ToolKind.SPOT, ToolKind.REAMER)
    for pattern in (_NAMED, _WITH_UNIT, _FRACTION, _POINT):
        value, _ = _take_length(pattern, words, mm)
        if value is not None and 0.0 < value <= 2.0 * LARGEST_MM:
            return value
    if hole and (size := drill_size(words)) is not None:
        return size
    value, _ = _take_length(_WHOLE, words, mm) if kind is not None else (None, words)
    return value if value is not None and 0.0 < value <= LARGEST_MM else None


def _tip(kind: ToolKind | None, d: float | None, numbers: dict[str, float | int], keyed: bool, where: str) -> Stated:
    """Corner, point and taper of a kind; ``keyed``: the angle is that of ``TAPER=``, which CAM systems give."""
    angle = float(numbers.get("angle", 0.0))
    out: Stated = {}
    if d is not None and kind is ToolKind.BALL:
        out["corner_radius_mm"] = (0.5 * d, where)
    elif d is not None and "corner_radius_mm" in numbers:
        out["corner_radius_mm"] = (min(float(numbers["corner_radius_mm"]), 0.5 * d), where)
    if not 0.0 < angle < 180.0:
        return out
    if kind in (ToolKind.DRILL, ToolKind.SPOT, ToolKind.COUNTERSINK):
        out["bottom_deg"] = (90.0 - 0.5 * angle, where)
    elif kind is ToolKind.CHAMFER:
        # TAPER= of CAM systems is half the angle of the point
        half = angle if keyed else 0.5 * angle
        if half < 90.0:
            out["bottom_deg"] = (90.0 - half, where)
    elif kind in (ToolKind.TAPERED, None, ToolKind.END_MILL) and keyed and angle < 80.0:
        out["taper_deg"] = (angle, where)
    return out
