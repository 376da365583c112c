"""A program as APT cutter location data.

Notation: GOTO/x,y,z[,i,j,k] the tip and, under MULTAX, the axis; CUTTER/d,r,e,f,alpha,beta,h in mm and degrees.
An arc is a CIRCLE/x,y,z,i,j,k record before the GOTO to its end, as CAM systems write it: the centre at the height of
the end along the normal, the arc counter-clockwise about (i, j, k). Arcs of more than 3/4 of a turn are several of
them. A helical arc has no such record: it is written as GOTO whose chords leave it by at most ``chord_mm``. Where the
tip stands and the axis turns, the feed is in degrees a minute (DPM).
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping

import numpy as np
from numpy.typing import ArrayLike

from chipload.cutter.cutter import Cutter
from chipload.errors import InputError
from chipload.program.build import LONGEST_ARC
from chipload.program.motions import is_arc, lengths, radii, rises, spans, starts, straighten_arcs, sweeps
from chipload.program.program import DWELL, LINE, RAPID, Program
from chipload.program.release import Release
from chipload.units import mm_min_from_mm_s, rpm_from_rad_s

#: an arc that moves further along its normal [mm] is helical
HELIX_MM = 1e-9
#: an arc whose ends are nearer [mm] than this is a GOTO: rounded, they could be one point, and that a full turn
SHORT_MM = 5e-6
#: what a number with decimals does without at its end, and a zero below zero
ZEROS, NEGATIVE_ZERO = re.compile(r"\.?0+(?=[,\n])"), re.compile(r"(?<![\d.])-0(?=[,\n])")


def write_apt(
    program: Program,
    cutters: Mapping[int, Cutter] | None,
    *,
    title: str,
    release: Release,
    chord_mm: float = 1e-3,
) -> str:
    """CL data of a program.

    Parameters
    ----------
    cutters : cutter of each tool number but 0, which is no tool; None: not known, no CUTTER is written
    title : of the part, in PARTNO
    release : whether an independent simulation has verified the program; stated in the first PPRINT
    chord_mm : greatest distance of a helical arc from its chords [mm], > 0

    Raises
    ------
    InputError
        A tool number has no cutter.
    """
    status = release.text.upper() if release.verified else release.text
    out = [f"PARTNO/{_text(title)}", f"PPRINT/{_text(f'CHIPLOAD: {status}')}", "UNITS/MM"]
    tilted = bool((np.abs(program.axis - (0.0, 0.0, 1.0)).max(axis=1) > 1e-12).any())
    if tilted:
        out.append("MULTAX/ON")
    helical = np.abs(rises(program)) > HELIX_MM
    r = radii(program)
    turn = 2.0 * np.arccos(1.0 - np.minimum(chord_mm / np.where(r > 0.0, r, math.inf), 1.0))
    program = straighten_arcs(program, np.where(helical & (r > 0.0), turn, math.inf))
    p0, sweep = starts(program), sweeps(program)
    short = (np.linalg.norm(program.p_work - p0, axis=1) < SHORT_MM) & (np.abs(sweep) < 1.0)
    arc = is_arc(program) & (sweep != 0.0) & ~short
    stands = (spans(program) != lengths(program)) | (lengths(program) == 0.0)
    tool: int | None = None
    spindle, feed, label = 0.0, "", -1
    ends = _points(program.p_work, 6)
    axes = _points(program.axis, 9) if tilted else []
    tools, speeds, labels = program.tool.tolist(), program.spindle.tolist(), program.label.tolist()
    motions, feeds, arcs, turns = program.motion.tolist(), program.feed.tolist(), arc.tolist(), stands.tolist()
    last = (math.nan, False)
    # rows that go on as the one before them
    same = (program.tool, program.spindle, program.label, program.feed, stands, program.motion)
    goes_on = np.all([np.append(False, column[1:] == column[:-1]) for column in same], axis=0)
    plain = (goes_on & (program.motion == LINE) & ~tilted).tolist()
    for k in range(len(program)):
        if plain[k]:
            out.append(f"GOTO/{ends[k]}")
            continue
        if tools[k] != tool:
            tool = tools[k]
            if cutters is not None and tool not in cutters and tool != 0:
                raise InputError(f"program row {k}: tool {tool} has no cutter: give its [[cutter]]")
            if cutters is not None and tool in cutters and not cutters[tool].body:
                own = cutters[tool]
                if own.flank_arc is not None and own.corner_radius > 0.0:
                    out.append(f"PPRINT/{_text(f'BARREL CUTTER, TIP RADIUS {_number(own.corner_radius)}')}")
                if own.shape:
                    out.append(
                        f"PPRINT/{_text(f'CUTTER {tool} HAS NO SEVEN NUMBERS, DIAMETER {_number(own.diameter)}')}"
                    )
                else:
                    out.append(cutter_statement(own))
            out.append(f"LOADTL/{tool}")
        if speeds[k] != spindle:
            spindle = speeds[k]
            sense = "CLW" if spindle > 0.0 else "CCLW"
            out.append(f"SPINDL/{_number(abs(rpm_from_rad_s(spindle)), 3)},RPM,{sense}" if spindle else "SPINDL/OFF")
        if labels[k] != label:
            label = labels[k]
            out.append(f"PPRINT/{_text(program.labels[label])}")
        if motions[k] == DWELL:
            out.append(f"DELAY/{_number(feeds[k])}")
            continue
        if motions[k] == RAPID:
            out.append("RAPID")
        elif (feeds[k], turns[k]) != last:
            last = (feeds[k], turns[k])
            text = f"{_number(mm_min_from_mm_s(feeds[k]))},MMPM"
            if turns[k]:
                text = f"{_number(60.0 * math.degrees(feeds[k]))},DPM"
            if text != feed:
                out.append(f"FEDRAT/{text}")
                feed = text
        axis = f",{axes[k]}" if tilted else ""
        if not arcs[k]:
            out.append(f"GOTO/{ends[k]}{axis}")
            continue
        end, n = program.p_work[k], program.normal[k]
        centre = program.centre[k] + ((end - program.centre[k]) @ n) * n
        circle = f"CIRCLE/{_numbers(centre)},{_numbers(math.copysign(1.0, sweep[k]) * n, 9)}"
        v = p0[k] - program.centre[k]
        v = v - (v @ n) * n
        pieces = math.ceil(abs(sweep[k]) / math.pi - 1e-9) if abs(sweep[k]) > LONGEST_ARC else 1
        for piece in range(1, pieces):
            a = sweep[k] * piece / pieces
            between = centre + math.cos(a) * v + math.sin(a) * np.cross(n, v)
            out += [circle, f"GOTO/{_numbers(between)}{axis}"]
        out += [circle, f"GOTO/{ends[k]}{axis}"]
    out += ["SPINDL/OFF", "FINI"]
    return "\n".join(out) + "\n"


def cutter_statement(cutter: Cutter) -> str:
    """CUTTER/d,r,e,f,alpha,beta,h in mm and degrees; r, e, f of a barrel are those of its flank arc, without the tip.

    >>> cutter_statement(Cutter(14.0, 2, 0.0, 30.0, 73.0, 6e5, corner_radius=7.0))
    'CUTTER/14,7,0,7,0,0,30'
    """
    d, _, _, _, alpha, beta, h = cutter.apt
    r, e, f = cutter.finishing_arc
    return f"CUTTER/{_numbers((d, r, e, f, math.degrees(alpha), math.degrees(beta), h))}"


def _number(value: float, decimals: int = 6) -> str:
    text = f"{value:.{max(decimals, 1)}f}".rstrip("0").rstrip(".")
    return "0" if text == "-0" else text


def _numbers(values: Iterable[float], decimals: int = 6) -> str:
    return ",".join(_number(x, decimals) for x in values)


def _points(values: ArrayLike, decimals: int) -> list[str]:
    """:func:`_numbers` of each row.

    >>> _points([[1.0, -0.5, 100.0], [-1e-9, 0.25, 1e-6]], 6)
    ['1,-0.5,100', '0,0.25,0.000001']
    """
    rows = np.asarray(values, dtype=np.float64)
    layout = ",".join([f"%.{decimals}f"] * rows.shape[1])
    text = "\n".join([layout % tuple(row) for row in rows.tolist()]) + "\n"
    return NEGATIVE_ZERO.sub("0", ZEROS.sub("", text)).splitlines()


def _text(text: str) -> str:
    """Printable ASCII on one line; $ would go on to the next."""
    plain = " ".join(text.encode("ascii", "replace").decode("ascii").split()).replace("$", "S")
    return "".join(c for c in plain if c.isprintable())[:66]
