"""Motions of conversational programs: L and LP, C, CR, CT and CP about poles CC, approach and departure.

Notation: ``text`` is a block without its first word; DR+ counter-clockwise; PR, PA polar coordinates about the pole.
Approaches and departures (APPR, DEP) are in :mod:`~chipload.program.heidenhain.approaches`, roundings (RND) and
chamfers (CHF) in :mod:`~chipload.program.corners`; one that the contour has no room for stays sharp. A motion in the
machine's own coordinates (M91) is left out: where they lie in the work is not known.

Reference: Heidenhain, iTNC 530 User's Manual HEIDENHAIN Conversational, "Programming: Programming Contours".
"""

from __future__ import annotations

import cmath
import math
import re

from chipload.errors import InputError
from chipload.program.commands import LINE, PLANE_AXES, RAPID, XY, YZ, ZX
from chipload.program.corners import Corner
from chipload.program.heidenhain import approaches, tilted_plane, words
from chipload.program.heidenhain.formula import NotKnownError
from chipload.program.heidenhain.state import FARTHEST, ConversationalState
from chipload.program.heidenhain.switches import act_after, act_before, m_codes

#: an arc may end so much nearer to its pole than it begins, or farther [mm]
ROUNDED = 0.02
MOST_TURNS = 10_000
_NORMAL = re.compile(rf"\bN[XYZ]\s*[-+]?\s*(?:{words.VALUE})")
_SPAN = re.compile(rf"\bIPA\s*([-+]?)\s*({words.VALUE})")


def line(s: ConversationalState, text: str) -> None:
    """L: a straight motion; or only functions, where no axis is named."""
    codes, fast = _read(s, text)
    end, named = s.ends(text)
    _straight(s, text, end, named, codes, fast)


def line_with_normal(s: ConversationalState, text: str) -> None:
    """LN: a straight motion; the normal NX NY NZ of the surface moves only a tool of another radius than planned."""
    if re.search(r"\bT[XYZ]", text):
        raise NotKnownError("LN: tool directions by TX TY TZ are not read: output rotary axes")
    if not any(f.code == "heidenhain-normal" for f in s.findings[-50:]):
        s.note("heidenhain-normal", "LN: NX NY NZ: the tool is taken as the one that was planned, with DR 0")
    line(s, _NORMAL.sub(" ", text))


def polar_line(s: ConversationalState, text: str) -> None:
    """LP: a straight motion to polar coordinates; the one that is missing stays."""
    codes, fast = _read(s, text)
    end, named = _polar_end(s, text)
    _straight(s, text, end, named, codes, fast)


def _polar_end(s: ConversationalState, text: str) -> tuple[list[float], set[int]]:
    """The end of a motion in polar coordinates, and the axes that it names."""
    end, named = s.ends(words.POLAR.sub(" ", text))
    x, y = _centre(s)
    if s.pole_plane != XY:
        raise NotKnownError("LP: polar coordinates in a plane along the tool's axis are not read")
    a, b, _ = s.factor
    radius, angle = cmath.polar(complex((s.at[0] - x) / a, (s.at[1] - y) / b))
    if {0, 1} & s.unknown and len(words.POLAR.findall(text)) < 2:
        raise NotKnownError("LP: the position of the tool is not known: give PR and PA")
    for step, letter, sign, value in words.POLAR.findall(text):
        amount = s.signed(sign, value)
        if letter == "R":
            radius = amount * s.scale + (radius if step else 0.0)
        else:
            angle = math.radians(amount) + (angle if step else 0.0)
    end[0], end[1] = x + a * radius * math.cos(angle), y + b * radius * math.sin(angle)
    return end, named | {0, 1}


def _straight(
    s: ConversationalState, text: str, end: list[float], named: set[int], codes: list[int], fast: bool
) -> None:
    act_before(s, codes)
    if s.left_out:
        s.unknown |= {k for k in named if k < 3}
    elif named and 91 in codes:
        s.note("heidenhain-m91", "M91: a motion in the machine's own coordinates is left out")
        s.end_contour()
        s.unknown |= {k for k in named if k < 3}
    elif named:
        if 92 in codes:
            raise InputError("M92: coordinates of the machine builder's point are not known here")
        s.select(_side(s, text), named)
        if s.tilt is not None and named & {3, 4, 5}:
            _turn(s, end, named, RAPID if fast else LINE)
            named &= {0, 1, 2}
            end = [x if k in named else s.at[k] for k, x in enumerate(end)]
        first, rows = bool(fast and named & s.unknown & {0, 1, 2}), len(s.rows)
        s.unknown -= named
        if named:
            s.straight(RAPID if fast else LINE, end)
            if first and len(s.rows) == rows + 1:
                s.unplaced.append(rows)
    else:
        s.select(_side(s, text), named)
    _retract(s, text)
    act_after(s, codes)


def _turn(s: ConversationalState, end: list[float], named: set[int], motion: int) -> None:
    """Rotary axes that a block names in a tilted plane: they turn first, X Y Z of the machine where they are."""
    target = tilted_plane.axes_of(s)
    for k in named & {3, 4, 5}:
        target[k] = end[k] + s.shift[k]
    tilted_plane.turn(s, target, motion)


def _retract(s: ConversationalState, text: str) -> None:
    """M140: back along Z of the working plane, in which the tool stands."""
    found = words.RETRACT.search(text)
    if found is None:
        return
    s.end_contour()
    if found[1] == "MAX" or 2 in s.unknown:
        s.note("heidenhain-m91", "M140: a retraction to a position of the machine is left out")
        s.unknown.add(2)
    else:
        s.plunge(RAPID, s.at[2] + abs(s.amount(found[1])) * s.scale, 0.0)


def pole(s: ConversationalState, text: str) -> None:
    """CC: the pole, in the plane of the axes that it names; without coordinates it is where the tool stands, in XY."""
    end, named = s.ends(text)
    if not named and {0, 1} & s.unknown:
        raise NotKnownError("CC: the position of the tool is not known: give X and Y")
    plane = YZ if {1, 2} <= named else ZX if {0, 2} <= named else XY
    if plane != s.pole_plane:
        s.pole, s.pole_plane = [None, None], plane
    for place, k in enumerate(PLANE_AXES[plane][:2]):
        if k in named or not named:
            s.pole[place] = end[k]


def arc(s: ConversationalState, text: str) -> None:
    """C: an arc about the pole."""
    codes, fast = _read(s, text)
    sense = _sense(text, "C") * _arc_sense(s, s.pole_plane)
    end, _ = s.ends(text)
    _arc(s, text, end, _centre(s), sense, codes, fast, about_pole=True)


def arc_of_radius(s: ConversationalState, text: str) -> None:
    """CR: an arc by its radius; below 0 it is the longer one of the two."""
    found = words.RADIUS.search(text)
    if found is None:
        raise InputError("CR: R is missing: the radius")
    without = words.RADIUS.sub(" ", text)
    codes, fast = _read(s, without)
    sense = _sense(text, "CR") * _arc_sense(s, XY)
    end, _ = s.ends(without)
    _require_place(s)
    radius = s.signed(found[1], found[2]) * s.scale * abs(s.size_factor())
    start, chord = complex(*s.at[:2]), complex(end[0] - s.at[0], end[1] - s.at[1])
    under = radius**2 - 0.25 * abs(chord) ** 2
    if abs(chord) < 1e-9 or under < -ROUNDED * abs(radius):
        raise InputError(
            f"CR: R = {radius:g} mm: start and end are {abs(chord):.6g} mm apart: must be at least half of that in size"
        )
    out = math.copysign(math.sqrt(max(under, 0.0)), radius * sense)
    centre = start + 0.5 * chord + 1j * chord / abs(chord) * out
    _arc(s, text, end, (centre.real, centre.imag), sense, codes, fast)


def tangent_arc(s: ConversationalState, text: str) -> None:
    """CT: an arc that goes on in the direction of the motion before it."""
    codes, fast = _read(s, text)
    end, named = s.ends(text)
    _require_place(s)
    if s.heading is None:
        raise NotKnownError("CT: the direction before it is not known: move in the plane first")
    chord = complex(end[0] - s.at[0], end[1] - s.at[1])
    across = (chord / (1j * s.heading)).real
    if abs(across) < 1e-9:
        _straight(s, text, end, named, codes, fast)
        return
    centre = complex(*s.at[:2]) + 1j * s.heading * abs(chord) ** 2 / (2.0 * across)
    _arc(s, text, end, (centre.real, centre.imag), 1 if across > 0.0 else -1, codes, fast)


def helix(s: ConversationalState, text: str) -> None:
    """CP: about the pole, by IPA or to PA, with a rise along the axis across its plane."""
    sweep, to = _SPAN.search(text), words.POLAR.search(text)
    sense = _sense(text, "CP")
    without = words.POLAR.sub(" ", text)
    codes, fast = _read(s, without)
    end, _ = s.ends(without)
    x, y = _centre(s)
    first, second, _ = PLANE_AXES[s.pole_plane]
    if {first, second} & s.unknown:
        raise NotKnownError("an arc begins at a position that is not known: move there first")
    a, b = s.factor[first], s.factor[second]
    vx, vy = (s.at[first] - x) / a, (s.at[second] - y) / b
    if sweep is not None:
        angle = math.radians(s.signed(sweep[1], sweep[2]))
        if angle * sense < 0.0:
            raise InputError("CP: IPA and DR have different signs")
    elif to is not None and to[2] == "A":
        angle = sense * ((sense * (math.radians(s.signed(to[3], to[4])) - math.atan2(vy, vx))) % math.tau or math.tau)
    else:
        raise InputError("CP: IPA or PA must be given")
    end[first] = x + a * (vx * math.cos(angle) - vy * math.sin(angle))
    end[second] = y + b * (vx * math.sin(angle) + vy * math.cos(angle))
    sense *= _arc_sense(s, s.pole_plane)
    turns = max(1, math.ceil(abs(angle) / math.tau - 1e-9))
    if turns > MOST_TURNS:
        raise InputError(f"CP: {turns} turns: must be at most {MOST_TURNS}")
    _arc(s, text, end, (x, y), sense * turns, codes, fast, about_pole=True)


def approach(s: ConversationalState, text: str) -> None:
    """APPR: to the start of the contour, once the motion behind it is known."""
    found = approaches.FORM.match(text)
    if found is None:
        raise InputError(f"APPR{text[:20]}: must be LT, LN, CT or LCT")
    form, rest = approaches.form_of(s, found[2], found[3])
    lasting, moved = s.feed, s.last_motion()
    codes, fast = _read(s, rest)
    end, named = _polar_end(s, rest) if found[1] else s.ends(rest)
    act_before(s, codes)
    side = _side(s, rest)
    if s.left_out:
        s.unknown |= {k for k in named if k < 3}
    elif not side or s.unknown & {0, 1}:
        raise NotKnownError("APPR: needs RL or RR and a known position: move there first")
    else:
        s.end_contour()
        quick = fast or moved in (None, RAPID)
        s.approaching = approaches.Approach(s, form, f"APPR{text}", end, side, lasting, quick)
        s.at, s.unknown = end, s.unknown - named
    act_after(s, codes)


def corner(s: ConversationalState, text: str) -> None:
    """RND and CHF: the corner between the motion before and the next one; the feed is that of the corner alone."""
    lasting = s.feed
    s.feed_of(text)
    feed, s.feed = s.feed if words.FEED.search(text) else None, lasting
    round_off = text.startswith("RND")
    found = re.match(rf"(?:RND\s*R|CHF)\s*(\+?)\s*({words.VALUE})", text)
    if found is None:
        raise InputError(f"{text!r}: must be RND R and a radius, or CHF and a length")
    size = s.amount(found[2]) * s.scale * abs(s.size_factor())
    if s.left_out:
        return
    if not 0.0 < size <= FARTHEST or not s.corner(Corner(round_off, size, feed, text)):
        s.sharp(text)


def departure(s: ConversationalState, text: str) -> None:
    """DEP: away from the end of the contour; R0 after it."""
    found = approaches.FORM.match(text[3:])
    if found is None:
        raise InputError(f"{text[:20]}: must be DEP LT, LN, CT or LCT")
    form, rest = approaches.form_of(s, found[2], found[3])
    codes, fast = _read(s, rest)
    end, named = _polar_end(s, rest) if found[1] else s.ends(rest)
    act_before(s, codes)
    if s.left_out:
        s.unknown |= {0, 1} | {k for k in named if k < 3}
    else:
        approaches.depart(s, form, end, named, fast)
    act_after(s, codes)


def _read(s: ConversationalState, text: str) -> tuple[list[int], bool]:
    """M functions and whether at rapid; words that nothing reads are refused: they may move something."""
    fast = s.feed_of(text)
    left = words.rest_of(
        text, words.RETRACT, words.SETTINGS, words.POLAR, words.AXIS, words.TURN_FEED, words.FEED, words.M_CODE,
        words.SIDE, words.TURN,
    )  # fmt: skip
    if left:
        raise InputError(f"{left[:40]!r}: is not read in a motion")
    return m_codes(text), fast


def _side(s: ConversationalState, text: str) -> int:
    """Side of the tool: that of the block, else the one that lasts."""
    found = words.SIDE.search(text)
    if found is None:
        return s.side
    # a mirrored contour lies on the other side
    mirrored = s.factor[0] * s.factor[1] < 0.0
    return {"L": 1, "R": -1, "0": 0}[found[1]] * (-1 if mirrored else 1)


def _sense(text: str, word: str) -> int:
    turn = words.TURN.search(text)
    if turn is None:
        raise InputError(f"{word}: DR+ or DR- is missing")
    return 1 if turn[1] == "+" else -1


def _arc_sense(s: ConversationalState, plane: int) -> int:
    """-1 where mirrored coordinates turn an arc of a plane the other way."""
    return 1 if s.size_factor(plane) > 0.0 else -1


def _centre(s: ConversationalState) -> tuple[float, float]:
    x, y = s.pole
    if x is None or y is None:
        raise InputError("the pole is not known: give CC X Y first")
    return x, y


def _require_place(s: ConversationalState) -> None:
    if {0, 1} & s.unknown:
        raise NotKnownError("an arc begins at a position that is not known: move there first")


def _arc(
    s: ConversationalState,
    text: str,
    end: list[float],
    centre: tuple[float, float],
    turns: int,
    codes: list[int],
    fast: bool,
    about_pole: bool = False,
) -> None:
    first, second, _ = PLANE_AXES[s.pole_plane if about_pole else XY]
    if {first, second} & s.unknown:
        raise NotKnownError("an arc begins at a position that is not known: move there first")
    x, y = centre
    r0 = math.hypot(s.at[first] - x, s.at[second] - y)
    r1 = math.hypot(end[first] - x, end[second] - y)
    if r0 < 1e-9 or abs(r1 - r0) > ROUNDED:
        raise InputError(
            f"an arc begins {r0:.6g} mm from its pole and ends {r1:.6g} mm from it: must agree to {ROUNDED:g} mm"
        )
    if fast:
        raise InputError("an arc at FMAX is not read: give its feed")
    # the text rounds: the centre moves along the chord's bisector until both ends are as far
    dx, dy = end[first] - s.at[first], end[second] - s.at[second]
    chord = math.hypot(dx, dy)
    if chord > 1e-9:
        mx, my = 0.5 * (end[first] + s.at[first]), 0.5 * (end[second] + s.at[second])
        along = (-dy * (x - mx) + dx * (y - my)) / chord
        x, y = mx - dy / chord * along, my + dx / chord * along
    act_before(s, codes)
    s.select(_side(s, text), {first, second})
    if s.left_out:
        s.unknown |= {first, second}
    elif about_pole and s.pole_plane != XY:
        s.upright_arc(end, (x, y), turns, s.pole_plane)
    else:
        s.arc(end, (x, y), turns)
    act_after(s, codes)
