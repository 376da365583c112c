"""Comparison of tracks: key numbers with their differences, and corresponding rows.

By time, rows belong together that are reached at the same moment. By path, rows that have gone the same share of the
way: of each pass where both tracks have the same passes in the same order, else of the whole path.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chipload.result import COLUMNS, LimitCheck
from chipload.web.loads import cutting_rows
from chipload.web.result import PageResult, PageTrack, TextColumn

Floats = NDArray[np.float64]

#: greatest number of compared tracks, and their colours, which colour-blind readers can distinguish
MOST = 5
COLOURS = ("#1f5fa8", "#d17a00", "#0b7a75", "#8a4fa3", "#6b7683")
#: columns whose greatest size (least value, where a limit is a least value) is compared
WORST = (
    "engagement_deg", "chip_max_mm", "force_n", "force_xy_n", "force_normal_n", "force_over_allowable", "torque_nm",
    "torque_mean_nm", "torque_over_percent", "power_w", "cutter_stress_mpa", "deflection_um", "deflection_cutter_um",
    "deflection_workpiece_um", "form_error_um", "sle_um", "stability_margin",
)  # fmt: skip


@dataclass(frozen=True, eq=False)
class Side:
    """A track of a result that is compared, its title and its colour."""

    result: PageResult
    track: PageTrack
    title: str
    colour: str


@dataclass(frozen=True)
class KeyNumber:
    """A number of each side; None: a side does not have it."""

    label: str
    unit: str
    values: tuple[float | None, ...]

    def difference(self, k: int) -> tuple[float | None, float | None]:
        """What side ``k`` has more than the first, and in percent of the first.

        >>> KeyNumber("force", "N", (400.0, 300.0)).difference(1)
        (-100.0, -25.0)
        """
        first, other = self.values[0], self.values[k]
        if first is None or other is None:
            return None, None
        if abs(other - first) < 1e-9 * max(abs(first), abs(other)):
            return 0.0, 0.0 if first != 0.0 else None  # sums in another order
        return other - first, 100.0 * (other - first) / abs(first) if first != 0.0 else None


def key_numbers(sides: Sequence[Side]) -> list[KeyNumber]:
    """Time, path, what is removed and the worst of each load that one of the sides has."""
    tracks = [side.track for side in sides]
    out = [
        KeyNumber("program time", "s", tuple(_time(t) for t in tracks)),
        KeyNumber("time in cut", "s", tuple(_in_cut(side) for side in sides)),
        KeyNumber("path", "mm", tuple(float(t.s[-1]) for t in tracks)),
        KeyNumber("removed volume", "mm\u00b3", tuple(_total(side, "chip_volume_mm3") for side in sides)),
    ]
    for column in WORST:
        least = COLUMNS[column].least
        label = ("least " if least else "greatest ") + COLUMNS[column].label
        out.append(KeyNumber(label, COLUMNS[column].unit, tuple(_worst(side, column) for side in sides)))
    return [n for n in out if any(v is not None and v != 0.0 for v in n.values)]


def knots(a: Side, b: Side, against: str) -> tuple[Floats, Floats]:
    """Rising times [s] or lengths of path [mm] of two sides that belong together, both of one length, two at least."""
    if against == "time":
        both = np.array([0.0, max(float(a.track.t[-1]), float(b.track.t[-1]), 1e-9)])
        return both, both
    passes = _passes(a), _passes(b)
    starts: tuple[list[int], list[int]] = ([], [])
    if passes[0] is not None and passes[1] is not None and passes[0][1] == passes[1][1]:
        starts = passes[0][0], passes[1][0]
    here, there = (
        np.array([0.0, *(float(side.track.s[k - 1]) for k in own), float(side.track.s[-1])])
        for side, own in zip((a, b), starts, strict=True)
    )
    return here, there


def matching_row(a: Side, b: Side, against: str, row: int) -> int:
    """Row of ``b`` that belongs to a row of ``a``."""
    here, there = knots(a, b, against)
    own, other = (a.track.t, b.track.t) if against == "time" else (a.track.s, b.track.s)
    value = float(np.interp(own[row], here, there))
    found = int(np.searchsorted(other, value - 1e-9 * max(abs(value), 1.0)))
    return min(found, len(other) - 1)


def rows_along(a: Side, b: Side, against: str) -> Floats:
    """(n,) time or path of the rows of ``b`` as they lie along ``a``."""
    if against == "time":
        return b.track.t
    here, there = knots(a, b, against)
    return np.asarray(np.interp(b.track.s, there, here))


def common_span(sides: Sequence[Side], column: str) -> tuple[float, float] | None:
    """Least and greatest value of a column over all sides, for one scale of colours; None: words, or none."""
    low, high = np.inf, -np.inf
    for side in sides:
        values = side.result.column(side.track, column) if column in side.result.columns else None
        if values is None or isinstance(values, TextColumn) or not np.isfinite(values).any():
            return None
        low, high = min(low, float(np.nanmin(values))), max(high, float(np.nanmax(values)))
    return low, high


def _time(track: PageTrack) -> float:
    return track.own.time_s if track.own.time_s is not None else float(track.t[-1])


def _numbers(side: Side, column: str) -> Floats | None:
    values = side.result.column(side.track, column) if column in side.result.columns else None
    return None if values is None or isinstance(values, TextColumn) or not np.isfinite(values).any() else values


def _total(side: Side, column: str) -> float | None:
    values = _numbers(side, column)
    return None if values is None else float(np.nansum(values))


def _in_cut(side: Side) -> float | None:
    cut = cutting_rows(side.result, side.track)
    return None if cut is None else float(np.diff(side.track.t, prepend=0.0)[cut].sum())


def _worst(side: Side, column: str) -> float | None:
    """What the limit was held against, where there is one: not all rows count for it."""
    checks: list[LimitCheck] = [c for c in side.track.own.limits if c.column.name == column and c.worst is not None]
    if checks:
        return checks[0].worst
    values = _numbers(side, column)
    if values is None:
        return None
    if COLUMNS[column].least:
        known = values[values > 0.0]
        return float(known.min()) if len(known) else None
    return float(np.nanmax(np.abs(values)))


def _passes(side: Side) -> tuple[list[int], list[str]] | None:
    """Rows at which another pass begins, and the names of the passes in their order."""
    column = side.result.column(side.track, "pass") if "pass" in side.result.columns else None
    if not isinstance(column, TextColumn):
        return None
    new = np.flatnonzero(np.diff(column.codes)) + 1
    rows = [0, *new.tolist()]
    return rows[1:], [column.words[int(column.codes[k])] if column.codes[k] >= 0 else "" for k in rows]
