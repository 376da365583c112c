"""The load of each tool and each program line: time and length in cut, and the greatest value of each load."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chipload.report.colouring import rows_in_air
from chipload.web.result import PageResult, PageTrack, TextColumn

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]

#: loads that are listed, where the history has them: at most so many
LOADS = (
    "force_n", "force_xy_n", "force_normal_n", "torque_nm", "torque_mean_nm", "power_w", "deflection_um",
    "deflection_workpiece_um", "cutter_stress_mpa", "engagement_deg", "form_error_um",
)  # fmt: skip
SHOWN = 4
#: lines that are listed at most; bars of a tool in the timeline
LINES, BARS = 200, 400


@dataclass(frozen=True)
class CutPeriod:
    """A time in which one tool works on one operation: rows ``first`` to ``last``, seconds ``begin`` to ``end``."""

    tool: int
    first: int
    last: int
    begin: float
    end: float


@dataclass(frozen=True)
class ToolUse:
    """What a tool does in a track.

    Parameters
    ----------
    tool : its number; 0: the history names none
    time_s, cut_s : with it in the spindle, and in material [s]; ``cut_s`` None: the history does not state it
    cut_mm : length of its path in material [mm]
    worst : greatest size of each load, and the row where it is
    periods : when it works
    """

    tool: int
    time_s: float
    cut_s: float | None
    cut_mm: float | None
    worst: dict[str, tuple[float, int]]
    periods: tuple[CutPeriod, ...]


@dataclass(frozen=True)
class LineLoad:
    """The greatest of each load on a line of the program, the row of the sorting load, and the line's time [s]."""

    line: int
    row: int
    time_s: float
    worst: dict[str, float]


def cutting_rows(result: PageResult, track: PageTrack) -> Bools | None:
    """(n,) rows in material; None: the history does not tell."""
    air = rows_in_air(lambda column: _numbers(result, track, column))
    return None if air is None else ~air


def shown_loads(result: PageResult, track: PageTrack) -> list[str]:
    """Loads that the history has and that are not 0 throughout."""
    out = []
    for column in LOADS:
        values = _numbers(result, track, column)
        if values is not None and float(np.nanmax(np.abs(values))) > 0.0:
            out.append(column)
    return out[:SHOWN]


def tool_uses(result: PageResult, track: PageTrack) -> list[ToolUse]:
    """What each tool does, in the order of their first use."""
    n = len(track)
    tool = track.tool if track.tool is not None else np.zeros(n, dtype=np.int64)
    lasts = np.diff(track.t, prepend=0.0)
    cut = cutting_rows(result, track)
    length = np.diff(track.s, prepend=0.0)
    loads = {c: np.abs(np.nan_to_num(_known_values(result, track, c))) for c in shown_loads(result, track)}
    out = []
    for number in dict.fromkeys(tool.tolist()):
        own = tool == number
        rows = np.flatnonzero(own)
        worst = {c: (float(v[rows].max()), int(rows[np.argmax(v[rows])])) for c, v in loads.items()}
        out.append(
            ToolUse(
                max(int(number), 0), float(lasts[own].sum()),
                None if cut is None else float(lasts[own & cut].sum()),
                None if cut is None else float(length[own & cut].sum()),
                worst, _cut_periods(track, own, cut, int(number)),
            )
        )  # fmt: skip
    return out


def line_loads(result: PageResult, track: PageTrack, line: Ints, by: str) -> list[LineLoad]:
    """Lines of the program by the greatest of a load, the greatest first; ``line`` (n,) of each row, 0: none."""
    lines, number = np.unique(line, return_inverse=True)
    lasts = np.bincount(number, np.diff(track.t, prepend=0.0), minlength=len(lines))
    table = {
        c: np.abs(np.nan_to_num(_known_values(result, track, c)))
        for c in dict.fromkeys((by, *shown_loads(result, track)))
    }
    most = {}
    for column, values in table.items():
        most[column] = np.zeros(len(lines))
        np.maximum.at(most[column], number, values)
    order = np.lexsort((lines, -most[by]))
    # of each line the row at which the load is greatest: the last of its rows in rising order
    rising = np.argsort(table[by], kind="stable")
    row = np.zeros(len(lines), dtype=np.int64)
    row[number[rising]] = rising
    return [
        LineLoad(int(lines[k]), int(row[k]), float(lasts[k]), {c: float(v[k]) for c, v in most.items()})
        for k in order[:LINES].tolist()
        if lines[k] > 0 and most[by][k] > 0.0
    ]


def _numbers(result: PageResult, track: PageTrack, column: str) -> Floats | None:
    values = result.column(track, column) if column in result.columns else None
    return None if values is None or isinstance(values, TextColumn) or not np.isfinite(values).any() else values


def _known_values(result: PageResult, track: PageTrack, column: str) -> Floats:
    values = _numbers(result, track, column)
    return np.zeros(len(track)) if values is None else values


def _cut_periods(track: PageTrack, own: Bools, cut: Bools | None, tool: int) -> tuple[CutPeriod, ...]:
    """Times in cut of a tool; the shortest breaks between them are left out where there are very many."""
    works = own if cut is None else own & cut
    edges = np.flatnonzero(np.diff(np.concatenate([[False], works, [False]]).astype(np.int8)))
    first, last = edges[::2], edges[1::2] - 1
    if len(first) > BARS:
        breaks = track.t[first[1:] - 1] - track.t[last[:-1]]
        kept = np.sort(np.argsort(-breaks, kind="stable")[: BARS - 1])
        first, last = np.concatenate([first[:1], first[1:][kept]]), np.concatenate([last[:-1][kept], last[-1:]])
    begins = np.concatenate([[0.0], track.t])[first]
    return tuple(
        CutPeriod(max(tool, 0), int(a), int(b), float(t), float(track.t[b]))
        for a, b, t in zip(first, last, begins, strict=True)
    )
