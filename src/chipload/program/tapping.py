"""Tapping motions of a program, whichever cycle wrote them, against the taps that are stated.

Notation: a tapping motion goes in at a feed f [mm/s] with the spindle turning at w [rad/s] and comes straight back with
the spindle reversed; it cuts a thread of the pitch 2 pi f / |w| [mm]. A tap follows its own thread: where its pitch is
another, the thread is stripped or the tap breaks.

A comment states a thread by the number of the tool, the word TAP and a designation: ``(T1 10-32 TAP)``, ``(T4 M6X1 RH
TAP)``, ``(T2 1/4-20 TAP)``, ``(T3 M8 TAP)``.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from chipload.cutter.cutter import Cutter
from chipload.errors import Finding, Severity
from chipload.program.program import DWELL, LINE, Program
from chipload.program.reconcile import COMMENT, TOOL
from chipload.units import MM_PER

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

#: pitches that differ by less, relative, are one: the last digits of F
SAME_PITCH = 0.01
#: a motion comes straight back if the cosine between both is below this
BACK = -0.9999
#: pitch [mm] of coarse metric threads by their diameter [mm]. Reference: [ISO261]
COARSE = {
    1.6: 0.35, 2.0: 0.4, 2.5: 0.45, 3.0: 0.5, 3.5: 0.6, 4.0: 0.7, 5.0: 0.8, 6.0: 1.0, 7.0: 1.0, 8.0: 1.25, 10.0: 1.5,
    12.0: 1.75, 14.0: 2.0, 16.0: 2.0, 18.0: 2.5, 20.0: 2.5, 22.0: 2.5, 24.0: 3.0, 27.0: 3.0, 30.0: 3.5,
}  # fmt: skip
_TAP = re.compile(r"\bTAP(?:PED|PING|S)?\b")
_NUMBER = r"[0-9]+(?:\.[0-9]+)?"
_METRIC = re.compile(rf"\bM({_NUMBER})(?:\s*[X*]\s*({_NUMBER}))?(?![0-9.])")
_INCH = re.compile(r"(?<![0-9.])(?:#?[0-9]{1,2}|[0-9]/[0-9]{1,2}|\.[0-9]+)\s*-\s*([0-9]{1,2})(?![0-9.])")


@dataclass(frozen=True, eq=False)
class Tapping:
    """Tapping motions: their rows, and the pitch [mm] that each cuts."""

    rows: Ints
    pitch: Floats


def tapping_motions(program: Program) -> Tapping:
    """Return the tapping motions of a program; O(n)."""
    moving = np.flatnonzero(program.motion != DWELL)
    if len(moving) < 3:
        return Tapping(np.zeros(0, dtype=np.int64), np.zeros(0))
    p = program.p_work[moving]
    d = np.diff(p, axis=0, prepend=p[:1])
    size = np.linalg.norm(d, axis=1)
    spindle = program.spindle[moving]
    line = (program.motion[moving] == LINE) & (size > 0.0)
    turns = (spindle[:-1] * spindle[1:] < 0.0) & line[:-1] & line[1:]
    # the way in goes down the axis
    down = -(d[:-1] * program.axis[moving][:-1]).sum(axis=1) >= -BACK * size[:-1]
    back = (d[:-1] * d[1:]).sum(axis=1) <= BACK * size[:-1] * size[1:]
    rows = moving[:-1][turns & down & back]
    return Tapping(rows, math.tau * program.feed[rows] / np.abs(program.spindle[rows]))


def tapping_findings(
    program: Program, cutters: Mapping[int, Cutter], pitches: Mapping[int, tuple[float, str]] = MappingProxyType({})
) -> tuple[Finding, ...]:
    """Return findings on tapping motions, the first of each tool and code.

    Codes: ``tap-pitch`` (exceeds: the motion has another pitch than the tap), ``tap-cutter`` (exceeds: the tool is no
    tap), ``tap-pitch-unknown`` (unproven).

    Parameters
    ----------
    cutters : by tool; empty: not known, and only stated pitches are compared
    pitches : pitch [mm] that the text of the program states, and where, by tool
    """
    found = tapping_motions(program)
    out: dict[tuple[int, str], Finding] = {}
    for row, pitch in zip(found.rows.tolist(), found.pitch.tolist(), strict=True):
        number, line = int(program.tool[row]), int(program.line[row])
        cutter = cutters.get(number)
        own, where = pitches.get(number, (None, ""))
        if cutter is not None and not cutter.shape and cutter.thread_pitch is not None:
            own, where = cutter.thread_pitch, "thread_pitch_mm of its [[cutter]]"
        text, code, severity = "", "", Severity.EXCEEDS
        if cutter is not None and not cutter.body and (cutter.thread_pitch is None or cutter.shape):
            code = "tap-cutter"
            text = (
                f"tool {number} taps, and its [[cutter]] is no tap but a cutter with {cutter.flutes} teeth: state "
                "thread_pitch_mm and body_mm of the tap, or call the right tool"
            )
        elif own is None and not cutters:
            continue
        elif own is None:
            code, severity = "tap-pitch-unknown", Severity.UNPROVEN
            text = (
                f"tool {number} taps with a pitch of {pitch:.5g} mm, and that of the tap is not stated: state "
                "thread_pitch_mm in its [[cutter]]"
            )
        elif abs(pitch - own) > SAME_PITCH * own:
            code = "tap-pitch"
            text = (
                f"tool {number} taps with a pitch of {pitch:.5g} mm (feed over spindle speed), and {where} states "
                f"{own:.5g} mm: the tap breaks: the feed must be {own:.5g} mm times the spindle speed"
            )
        if code:
            x, y, z = (float(v) for v in program.p_work[row])
            out.setdefault((number, code), Finding(code, line, text, severity, (x, y, z)))
    return tuple(out.values())


def thread_comments(text: str) -> dict[int, tuple[float, str]]:
    r"""Pitch [mm] of the tap of each tool that the comments of an NC text state, and the comment; the first of a tool.

    >>> thread_comments("(T1 10-32 TAP)")[1][0], thread_comments("(T4 M6X1. RH TAP)")[4][0]
    (0.79375, 1.0)
    >>> thread_comments("(T3 M8 TAP)\n(T2 D6 END MILL)")
    {3: (1.25, 'the comment (T3 M8 TAP)')}
    """
    out: dict[int, tuple[float, str]] = {}
    for line in text.split("\n") if "TAP" in text.upper() else ():
        for comment in COMMENT.finditer(line) if "TAP" in line.upper() else ():
            words = (comment[1] if comment[1] is not None else comment[2]).upper()
            tool = re.search(TOOL, words)
            pitch = (
                _pitch(words[tool.end() :])
                if tool is not None and re.search(r"\bTAP(?:PED|PING|S)?\b", words)
                else None
            )
            if tool is not None and pitch is not None:
                out.setdefault(int(tool["tool"]), (pitch, f"the comment ({' '.join(words.split())[:60]})"))
    return out


def _pitch(words: str) -> float | None:
    """Pitch [mm] of a thread's designation; None: there is none that is known."""
    metric = _METRIC.search(words)
    if metric is not None:
        return float(metric[2]) if metric[2] else COARSE.get(float(metric[1]))
    inch = _INCH.search(words)
    return MM_PER["inch"] / float(inch[1]) if inch is not None and float(inch[1]) > 0.0 else None
