"""Lines of an NC text divided into segments of the same path, in the text itself.

Notation: a line is divided at points of its path, in programmed coordinates. Its first segment is the line with another
target: number, modal words, feed and comment stay on it. The others are new lines behind it with the words that the
target needs and nothing else; the last one has the target of the line. Segments of an arc state the same centre by I, J
and K, also where the line states a radius.

What a line means is taken from the reader, not from the text: a line is divided only if its target is what its words
say in the active unit and mode (G20 G21 G70 G71, G90 G91), so that no other transformation lies between.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chipload.program.gcode.bare_chamfers import has_bare_chamfers
from chipload.program.gcode.feed_words import COMMENTS

Floats = NDArray[np.float64]

_NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)"
#: a line of plain words and nothing else: no expression, no name, no block that can be skipped
_WORD = re.compile(
    rf"\s*(?:(?P<radius>[cC][rR]\s*=)|(?P<letter>[A-Za-z])\s*=?)\s*(?P<number>{_NUMBER})(?=$|[A-Za-z\s])"
)
_CODE = re.compile(r"(?<![A-Za-z_])[gG]\s*0*(\d+(?:\.\d)?)(?![\d.])")
#: a corner that is rounded or chamfered moves the ends of its lines
_CORNER = re.compile(r",\s*[RCrc]|\b(?:RNDM?|CHF|CHR|FRCM?)\b", re.IGNORECASE)
_ANY_CORNER = re.compile(rf"{_CORNER.pattern}|[Cc]\s*[0-9.]", re.IGNORECASE)
#: codes that may stand in a line that is divided; all of them are modal
_PLAIN = {
    "1", "2", "3", "17", "18", "19", "20", "21", "40", "64", "70", "71", "90", "91", "91.1", "90.1", "94", "95", "700",
    "710",
}  # fmt: skip
#: M words that act before the motion of their line
_BEFORE = {3, 4, 7, 8}
_INCH = {"20", "70", "700"}
_MM = {"21", "71", "710"}
#: words of the target agree with the reader within this [mm]
_AGREES_MM = 1e-6
#: letters of the centre beside those of the axes
CENTRE = "IJK"


@dataclass(frozen=True)
class LineForm:
    """How the words of a line are written.

    Parameters
    ----------
    reason : why the line keeps one feed; empty: it can be divided
    absolute : G90 is active
    unit : [mm] of a length
    absolute_centre : I, J and K are coordinates (G90.1)
    words : letter (``CR`` for Sinumerik's radius), number, beginning and end of the number in the line
    """

    reason: str
    absolute: bool
    unit: float
    absolute_centre: bool
    words: tuple[tuple[str, str, int, int], ...]

    def value(self, letter: str) -> float | None:
        """Return the number of a word; None: it is not there."""
        return next((float(number) for name, number, _, _ in self.words if name == letter), None)


@dataclass(frozen=True, eq=False)
class LinePath:
    """The path of a line in programmed coordinates.

    Parameters
    ----------
    start, end : (3,) float [mm], X Y Z
    points : (k, 3) float [mm], where it is divided, in the order of the path
    plane : indices of the axes that an arc turns in; None: a straight line
    centre : (2,) float [mm], of an arc in its plane
    """

    start: Floats
    end: Floats
    points: Floats
    plane: tuple[int, int] | None = None
    centre: Floats | None = None


def line_forms(text: str) -> dict[int, LineForm]:
    """Return the forms of all lines of a text, from 1; O(length)."""
    out: dict[int, LineForm] = {}
    absolute, unit, compensated, inverse, centre, corner = True, 1.0, False, False, False, False
    corners = _ANY_CORNER if has_bare_chamfers(text) else _CORNER
    for number, raw in enumerate(text.split("\n"), 1):
        open_text = COMMENTS.sub(lambda found: " " * len(found[0]), raw).rstrip()
        codes = _CODE.findall(open_text)
        for code in codes:
            if code in ("90", "91"):
                absolute = code == "90"
            elif code in _INCH or code in _MM:
                unit = 25.4 if code in _INCH else 1.0
            elif code in ("40", "41", "42", "41.1", "42.1"):
                compensated = code != "40"
            elif code in ("93", "94", "95"):
                inverse = code == "93"
            elif code in ("90.1", "91.1"):
                centre = code == "90.1"
        words = _words(open_text)
        reason = "other words"
        if compensated:
            reason = "radius compensation"
        elif inverse:
            reason = "inverse time feed"
        elif corner or corners.search(open_text):
            reason = "rounded corner"
        elif words is not None and _plain(words, codes):
            reason = ""
        corner = corners.search(open_text) is not None if open_text.strip() else corner
        out[number] = LineForm(reason, absolute, unit, centre, words or ())
    return out


def _words(open_text: str) -> tuple[tuple[str, str, int, int], ...] | None:
    """Return the words of a line, None where something else stands in it."""
    at, out = 0, list[tuple[str, str, int, int]]()
    while at < len(open_text):
        found = _WORD.match(open_text, at)
        if found is None:
            return None if open_text[at:].strip() else tuple(out)
        letter = "CR" if found["radius"] else found["letter"].upper()
        out.append((letter, found["number"], found.start("number"), found.end("number")))
        at = found.end()
    return tuple(out)


def _plain(words: tuple[tuple[str, str, int, int], ...], codes: list[str]) -> bool:
    """Whether a line states a motion of X, Y and Z and nothing that acts in this line alone, or behind its motion."""
    letters = [letter for letter, *_ in words if letter not in "GM"]
    if len(set(letters)) < len(letters) or not set(letters) <= {*"NXYZIJKRFS", "CR"}:
        return False
    acts = {float(number) for letter, number, *_ in words if letter == "M"}
    return acts <= _BEFORE and set(codes) <= _PLAIN and len(codes) == sum(letter == "G" for letter, *_ in words)


def mismatch(form: LineForm, path: LinePath) -> str:
    """Return why the path of a line is not what its words say in plain coordinates; empty: it is.

    Raises nothing: a line that is not understood keeps its feed.
    """
    moved = path.end - path.start
    for k, letter in enumerate("XYZ"):
        value = form.value(letter)
        wanted = path.end[k] if form.absolute else moved[k]
        if value is None:
            if abs(moved[k]) > _AGREES_MM:
                return "transformed coordinates"
        elif abs(value * form.unit - wanted) > _AGREES_MM:
            return "transformed coordinates"
    if path.plane is None:
        return ""
    for k, axis in enumerate(path.plane):
        value = form.value(CENTRE[axis])
        arm = path.centre[k] - (0.0 if form.absolute_centre else path.start[axis])  # type: ignore[index]
        if value is not None and abs(value * form.unit - arm) > _AGREES_MM:
            return "transformed coordinates"
    return ""


def with_segments(
    text: str, forms: Mapping[int, LineForm], paths: Mapping[int, LinePath], decimals: int
) -> tuple[str, dict[int, int]]:
    r"""Return the text with lines in segments, and the first line of each line of it in the new text.

    Parameters
    ----------
    forms : of the lines, see :func:`line_forms`
    paths : of the lines that are divided; ``points`` are rounded already, see :func:`round_point`
    decimals : of a length in mm

    >>> text = "G90 G1 X10 Y4 F600 (wall)\nG91 X8 ; on"
    >>> one = LinePath(np.zeros(3), np.array([10.0, 4.0, 0.0]), np.array([[5.0, 2.0, 0.0]]))
    >>> two = LinePath(one.end, np.array([18.0, 4.0, 0.0]), np.array([[12.5, 4.0, 0.0]]))
    >>> new, first = with_segments(text, line_forms(text), {1: one, 2: two}, 3)
    >>> print(new)
    G90 G1 X5. Y2. F600 (wall)
    X10 Y4
    G91 X2.5 ; on
    X5.5
    >>> first
    {1: 1, 2: 3}
    """
    out, first = list[str](), dict[int, int]()
    for number, raw in enumerate(text.split("\n"), 1):
        first[number] = len(out) + 1
        path = paths.get(number)
        if path is None or not len(path.points):
            out.append(raw)
            continue
        form = forms[number]
        places = decimals if form.unit == 1.0 else decimals + 1
        targets = [_targets(form, path, k, places) for k in range(len(path.points) + 1)]
        end = "\r" if raw.endswith("\r") else ""
        between = " " if " " in COMMENTS.sub("", raw).strip() else ""
        out.append(_first_segment(raw, form, targets[0], between))
        out += [between.join(f"{name}{value}" for name, value in target.items()) + end for target in targets[1:]]
    return "\n".join(out), first


def _targets(form: LineForm, path: LinePath, segment: int, places: int) -> dict[str, str]:
    """Return the words of the target of a segment, by letter."""
    corners = np.vstack([path.start, path.points, path.end])
    here, there = corners[segment], corners[segment + 1]
    last = segment == len(path.points)
    arc, out = path.plane is not None, dict[str, str]()
    for k, letter in enumerate("XYZ"):
        stated = form.value(letter) is not None
        if not stated and not (arc and k in (path.plane or ())):
            continue
        if form.absolute:
            own = next((number for name, number, *_ in form.words if name == letter), "")
            out[letter] = own if last and stated else _length(there[k] / form.unit, places)
        elif last:
            # what the segments before left of the stated way
            given = round((form.value(letter) or 0.0), 9)
            done = sum(
                round((b - a) / form.unit, places) for a, b in zip(corners[:-2, k], corners[1:-1, k], strict=True)
            )
            out[letter] = _length(given - done, max(places, 6))
        else:
            out[letter] = _length((there[k] - here[k]) / form.unit, places)
    if arc:
        for k, axis in enumerate(path.plane or ()):
            arm = path.centre[k] - (0.0 if form.absolute_centre else here[axis])  # type: ignore[index]
            out[CENTRE[axis]] = _length(arm / form.unit, places)
    return out


def _first_segment(raw: str, form: LineForm, target: Mapping[str, str], between: str) -> str:
    """Return a line with another target; the words of its centre stay as they are."""
    changes, missing = list[tuple[int, int, str]](), list[str]()
    known = {name: (begin, end) for name, _, begin, end in form.words}
    radius = next((name for name in ("R", "CR") if name in known), None)
    for letter, value in target.items():
        if letter in known:
            if letter not in CENTRE:
                changes.append((*known[letter], value))
        elif letter not in CENTRE or radius is not None:
            missing.append(f"{letter}{value}")
    if radius is not None:
        begin, end = known[radius]
        begin = raw.upper().rindex("C" if radius == "CR" else "R", 0, begin)
        changes.append((begin, end, between.join(missing)))
    elif missing:
        where = min(raw.upper().rindex(name, 0, begin) for name, (begin, _) in known.items() if name in CENTRE)
        changes.append((where, where, between.join(missing) + between))
    for begin, end, new in sorted(changes, reverse=True):
        raw = raw[:begin] + new + raw[end:]
    return raw


def _length(value: float, places: int) -> str:
    """Return a length in digits, always with a point.

    >>> _length(-0.00001, 3), _length(12.5, 4)
    ('0.', '12.5')
    """
    text = f"{value:.{places}f}".rstrip("0")
    return "0." if text in ("-0.", "0.") else text


def point_at(path: LinePath, share: float, sweep: float) -> Floats:
    """Return the point (3,) [mm] of a path at a share of its length; ``sweep`` [rad] of an arc, signed.

    >>> quarter = LinePath(np.array([2.0, 0, 0]), np.array([0, 2.0, 1.0]), np.empty((0, 3)), (0, 1), np.zeros(2))
    >>> (point_at(quarter, 0.5, np.pi / 2) / np.array([np.sqrt(2.0), np.sqrt(2.0), 0.5])).round(9).tolist()
    [1.0, 1.0, 1.0]
    """
    out = np.asarray(path.start + share * (path.end - path.start))
    if path.plane is None or path.centre is None:
        return out
    plane = list(path.plane)
    arm = path.start[plane] - path.centre
    far = float(np.hypot(*(path.end[plane] - path.centre)))
    radius = float(np.hypot(*arm))
    turn = np.arctan2(arm[1], arm[0]) + share * sweep
    radius += share * (far - radius)
    out[plane] = path.centre + radius * np.array([np.cos(turn), np.sin(turn)])
    return out


def round_point(path: LinePath, shares: tuple[float, float], sweep: float, unit: float, decimals: int) -> Floats:
    """Return the point (3,) [mm] in the decimals of the text that is nearest to the path.

    The place of a cut is free within a range: of the points that can be written, the one that leaves the path least is
    taken.

    Parameters
    ----------
    shares : where the cut may lie, the wanted place first
    """
    places = decimals if unit == 1.0 else decimals + 1
    errors, points = [], []
    for share in np.linspace(*shares, 41).tolist():
        exact = point_at(path, share, sweep)
        point = np.round(exact / unit, places) * unit
        # along the path the place is free: only what lies across it counts
        step = point_at(path, share + 1e-6, sweep) - exact
        off = point - exact
        off = off - (off @ step) / (step @ step) * step
        errors.append(round(float(np.linalg.norm(off)), 9))
        points.append(point)
    return np.asarray(points[int(np.argmin(errors))])
