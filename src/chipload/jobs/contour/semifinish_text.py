"""Semi-finish passes as lines of a program: NC, conversational (Heidenhain), APT CL data.

The lines begin and end where the old program is after its row k, at a safe height; modes that last beyond a line (feed,
motion mode) are restored. Work offset, tool and spindle speed are those of the old program.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import fields, replace

import numpy as np
from numpy.typing import NDArray

from chipload.program.apt.writer import write_apt
from chipload.program.control import control_named, is_cl_data
from chipload.program.gcode.blocks import decimal
from chipload.program.program import ARC_CCW, ARC_CW, LINE, RAPID, Program
from chipload.program.read import Dialect
from chipload.program.release import NOT_SIMULATED
from chipload.units import mm_min_from_mm_s

Ints = NDArray[np.int64]

COMMENT = "semi-finish passes by chipload"
#: records of CL data that belong to a whole program, or that the old program has set
_WHOLE = re.compile(r"PARTNO|UNITS|PPRINT|LOADTL|SPINDL|FINI")
_NUMBERED = re.compile(r"\s*\d+\s")


def inserted_lines(dialect: Dialect, planned: Program, rows: Ints, p: Program, k: int, decimals: int) -> list[str]:
    """Lines that run the ``rows`` of a plan and leave the machine where, and in the modes in which, row k of the old
    program ``p`` left it.
    """
    if is_cl_data(dialect):
        return _cl_data(planned, rows, p, k)
    if control_named(dialect).lines.form == "conversational":
        return _conversational(planned, rows, p, k, decimals)
    return _blocks(planned, rows, p, k, decimals)


def put_in(dialect: Dialect, old: Sequence[str], line: int, new: Sequence[str]) -> list[str]:
    """The old lines with the new ones after the line number ``line``; block numbers of conversational text continue.

    >>> put_in("heidenhain", ["0 BEGIN PGM A MM", "1 L Z+9", "2 END PGM A MM"], 2, ["L X+1"])
    ['0 BEGIN PGM A MM', '1 L Z+9', '2 L X+1', '3 END PGM A MM']
    """
    numbered = not is_cl_data(dialect) and control_named(dialect).lines.numbered
    if not numbered or not old or _NUMBERED.match(old[line - 1]) is None:
        return [*old[:line], *new, *old[line:]]
    first = int(old[line - 1].split()[0])
    rest = [re.sub(r"^(\s*)(\d+)(?=\s)", lambda m: f"{m[1]}{int(m[2]) + len(new)}", text) for text in old[line:]]
    return [*old[:line], *(f"{first + 1 + j} {text}" for j, text in enumerate(new)), *rest]


def _feed_after(p: Program, k: int) -> float | None:
    """Feed [mm/min] of the first cut behind row k: what it relies on unless it states its own."""
    cuts = np.flatnonzero(np.isin(p.motion[k + 1 :], (LINE, ARC_CW, ARC_CCW)))
    return float(mm_min_from_mm_s(1.0) * p.feed[k + 1 + cuts[0]]) if len(cuts) else None


def _blocks(planned: Program, rows: Ints, p: Program, k: int, decimals: int) -> list[str]:
    def words_of(letters: str, values: Sequence[float]) -> str:
        return " ".join(f"{a}{decimal(v, decimals, point=True)}" for a, v in zip(letters, values, strict=True))

    x, y, z = p.p_work[k].tolist()
    safe = float(planned.p_work[rows, 2].max())
    out = [f"({COMMENT})"]
    if safe > z:
        out.append(f"G0 {words_of('Z', [safe])}")
    place = np.array([x, y, max(safe, z)])
    feed = 0.0
    for row in rows.tolist():
        to, motion = planned.p_work[row], int(planned.motion[row])
        word = f" F{decimal(mm_min_from_mm_s(1.0) * planned.feed[row], 3, point=True)}" if motion != RAPID else ""
        word = "" if planned.feed[row] == feed else word
        if motion != RAPID:
            feed = float(planned.feed[row])
        if motion == RAPID and place[2] < safe:
            out.append(f"G0 {words_of('Z', to[2:])}")
            place = np.array([*place[:2], to[2]])
        if motion in (ARC_CW, ARC_CCW):
            centre = planned.centre[row, :2] - place[:2]
            out.append(f"G{2 if motion == ARC_CW else 3} {words_of('XY', to[:2])} {words_of('IJ', centre)}{word}")
        else:
            out.append(f"G{0 if motion == RAPID else 1} {words_of('XYZ', to)}{word}")
        place = to
    out += [f"G0 {words_of('XY', [x, y])}"]
    if z < safe:
        out.append(f"G0 {words_of('Z', [z])}")
    cut = np.flatnonzero(np.isin(p.motion[: k + 1], (LINE, ARC_CW, ARC_CCW)))
    if len(cut):  # the modes that the next lines rely on
        modal = f"F{decimal(mm_min_from_mm_s(1.0) * p.feed[cut[-1]], 3, point=True)}"
        out.append(modal if p.motion[k] == RAPID else f"G1 {words_of('XYZ', [x, y, z])} {modal}")
    return out


def _conversational(planned: Program, rows: Ints, p: Program, k: int, decimals: int) -> list[str]:
    def words_of(letters: str, values: Sequence[float]) -> str:
        pairs = zip(letters, values, strict=True)
        return " ".join(f"{a}{'' if v < 0.0 else '+'}{decimal(v, decimals)}" for a, v in pairs).replace("+-0", "+0")

    x, y, z = p.p_work[k].tolist()
    safe = max(float(planned.p_work[rows, 2].max()), z)
    out = [f"; {COMMENT}", f"L {words_of('Z', [safe])} R0 FMAX"]
    low = False
    for row in rows.tolist():
        to, motion = planned.p_work[row], int(planned.motion[row])
        word = f"F{decimal(mm_min_from_mm_s(1.0) * planned.feed[row], 3)}"
        if motion == RAPID:
            if low:
                out.append(f"L {words_of('Z', [safe])} FMAX")
            out.append(f"L {words_of('XYZ', to)} FMAX")
        elif motion == LINE:
            out.append(f"L {words_of('XYZ', to)} {word}")
        else:
            out.append(f"CC {words_of('XY', planned.centre[row, :2].tolist())}")
            out.append(f"C {words_of('XY', to[:2])} DR{'-' if motion == ARC_CW else '+'} {word}")
        low = to[2] < safe - 1e-9
    out += [f"L {words_of('Z', [safe])} FMAX", f"L {words_of('XY', [x, y])} FMAX"]
    feed = _feed_after(p, k)
    if z < safe or feed is not None:
        out.append(f"L {words_of('Z', [z])} " + ("FMAX" if feed is None else f"F{decimal(feed, 3)}"))
    return out


def _first_rows(program: Program, count: int) -> Program:
    """The first rows of a program."""
    columns = [f.name for f in fields(program) if f.name != "labels"]
    return replace(program, **{name: getattr(program, name)[:count] for name in columns})


def _cl_data(planned: Program, rows: Ints, p: Program, k: int) -> list[str]:
    x, y, z = p.p_work[k].tolist()
    safe = max(float(planned.p_work[rows, 2].max()), z)
    text = write_apt(_first_rows(planned, len(rows)), None, title="", release=NOT_SIMULATED)
    body = [line for line in text.splitlines() if _WHOLE.match(line) is None]

    def rapid(to: Sequence[float]) -> list[str]:
        return ["RAPID", "GOTO/" + ",".join(decimal(v, 6, point=True) for v in to)]

    last = planned.p_work[rows[-1]]
    out = [f"PPRINT/{COMMENT.upper()}", *rapid([x, y, safe]), *body, *rapid([last[0], last[1], safe])]
    out += rapid([x, y, safe])
    if z < safe:
        out += rapid([x, y, z])
    feed = _feed_after(p, k)
    return [*out, f"FEDRAT/{decimal(feed, 3, point=True)},MMPM"] if feed is not None else out
