"""Colours of a path by a column: the rows that are drawn, the rows beyond a limit, values on the stock."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from chipload.report.view import Colouring, ViewPath
from chipload.result import COLUMNS, LimitCheck, Track
from chipload.result.coverage import CUTTING
from chipload.result.thinning import thin_rows
from chipload.simulation.removal_mesh import RemovalMesh

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]

#: rows that a drawn path goes through at most, about
POINTS = 16_000
#: colours of words, one after another
WORDS = ("#3457a6", "#c9821a", "#0b7a75", "#8a4fa3", "#7a8a2e", "#b0567a", "#4d8fb8", "#6b5b4b", "#94a0ae", "#2f6f3e")
#: columns that a path is coloured by, and that are drawn, first, where the history has them
FIRST = (
    "engagement_deg",
    "force_n",
    "force_xy_n",
    "torque_nm",
    "deflection_um",
    "form_error_um",
    "tool_clearance_mm",
    "feed_mm_min",
)


def rows_in_air(column: Callable[[str], Floats | None]) -> Bools | None:
    """(n,) rows that do not cut, by the first column of loads that the history has; None: it has none.

    ``column`` (n,) of the history by its name; None: there is none.

    >>> rows_in_air({"force_n": np.array([0.0, 80.0])}.get).tolist()
    [True, False]
    """
    for name in CUTTING:
        values = column(name)
        if values is not None:
            return np.asarray(~(np.nan_to_num(values) > 0.0))
    return None


def rows_beyond(values: Floats, check: LimitCheck) -> Bools:
    """(n,) rows beyond a limit, of those that the check covers."""
    size = np.abs(np.nan_to_num(values)) if check.column.signed else np.nan_to_num(values)
    above = size < check.limit if check.column.least else size > check.limit
    return np.asarray(above & check.coverage.mask(len(size)), dtype=np.bool_)


def lowest_limit(limits: Sequence[LimitCheck], column: str) -> LimitCheck | None:
    """The check of a column with the lowest limit."""
    return min((c for c in limits if c.column.name == column), key=lambda c: c.limit, default=None)


def bounds_of(track: Track) -> dict[str, float]:
    """The lowest limit of each column of a track."""
    return {c.column.name: c.limit for c in sorted(track.limits, key=lambda c: -c.limit)}


def drawn_rows(path: ViewPath, values: Floats, points: int = POINTS) -> Ints:
    """(m,) rows that a drawn path goes through: extremes of place and value, and where it breaks."""
    n = len(path.t)
    if n <= points:
        return np.arange(n)
    filled = np.where(np.isfinite(values), values, 0.0)
    keep = [thin_rows(path.place[:, k], points // 4) for k in range(3)] + [thin_rows(filled, points // 4)]
    gaps = np.flatnonzero(path.apart)
    if len(gaps) <= points:
        keep += [gaps, gaps - 1]
    return np.unique(np.concatenate(keep))


def colouring_of(
    column: str,
    values: Floats,
    path: ViewPath,
    check: LimitCheck | None,
    removal: RemovalMesh | None,
    points: int = POINTS,
) -> Colouring:
    """The colours of a column of numbers; the path is drawn through about ``points`` rows at most.

    The worse end of their scale is the worst value of the rows that the limit of the column covers.
    """
    known = COLUMNS.get(column)
    label, unit = (known.label, known.unit) if known is not None else (column.replace("_", " "), "")
    rows = drawn_rows(path, values, points)
    low, high = _scale(values, check)
    above = rows_beyond(values, check) if check is not None else np.zeros(len(values), dtype=np.bool_)
    least = known is not None and known.least
    return Colouring(
        label, unit, low, high, None if check is None else check.limit, least, (), rows, values[rows], above[rows],
        None if removal is None else frame_values(values, removal, least=least),
        None if removal is None else frame_values(above.astype(np.float64), removal) > 0.5,
    )  # fmt: skip


def _scale(values: Floats, check: LimitCheck | None) -> tuple[float, float]:
    """Ends of the scale. Its worse end is that of the rows that the limit covers: an entry, which it leaves out, would
    hide their differences.
    """
    finite = values[np.isfinite(values)]
    if not len(finite):
        return 0.0, 0.0
    low, high = float(finite.min()), float(finite.max())
    counts = values if check is None else values[check.coverage.mask(len(values))]
    counts = counts[np.isfinite(counts)]
    if check is None or not len(counts):
        return low, high
    if check.column.signed or check.column.least:
        low = float(counts.min())
    if check.column.signed or not check.column.least:
        high = float(counts.max())
    return low, high


def colouring_of_words(column: str, codes: Ints, words: Sequence[str], path: ViewPath) -> Colouring:
    """The colours of a column of words; a code below 0 is none."""
    known = COLUMNS.get(column)
    label = known.label if known is not None else column.replace("_", " ")
    rows = drawn_rows(path, codes.astype(np.float64))
    here = set(np.unique(codes[codes >= 0]).tolist())
    # the colour goes by the code, also of words that no row has
    named = tuple((word if k in here else "", WORDS[k % len(WORDS)]) for k, word in enumerate(words))
    none = np.zeros(len(rows), dtype=np.bool_)
    return Colouring(label, "", 0.0, 1.0, None, False, named, rows, codes[rows].astype(np.float64), none)


def frame_values(values: Floats, removal: RemovalMesh, *, least: bool = False) -> Floats:
    """(m,) greatest value (least: least) in the rows of each frame after the first; nan: there is none."""
    if len(removal.rows) == 0:
        return np.zeros(0)
    starts = np.concatenate([[0], removal.rows[:-1] + 1])
    worst = np.inf if least else -np.inf
    filled = np.where(np.isfinite(values), values, worst)[: int(removal.rows[-1]) + 1]
    out = (np.minimum if least else np.maximum).reduceat(filled, np.minimum(starts, len(filled) - 1))
    return np.where(np.isfinite(out), out, np.nan)
