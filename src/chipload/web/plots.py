"""The linked plots: chosen columns, one above the other, against time or path, with a common cursor."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from html import escape
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chipload.number_text import number_text
from chipload.result.style import FONT, GRID, INK, LIMIT
from chipload.result.thinning import thin_rows
from chipload.web.checks import Bound, bound_of, label_and_unit
from chipload.web.comparison import Side, matching_row, rows_along
from chipload.web.result import PageResult, PageTrack, TextColumn

Floats = NDArray[np.float64]

#: points of one line at most, about, over all rows and again over those that are zoomed into: a plot is 700 pixels
#: wide, and the browser spends more on its lines than on the 3D view (benchmarks/page.py --pictures)
POINTS = 1000
COLOURS = ("#3457a6", "#0b7a75", "#c9821a", "#8a4fa3")
CURSOR = "#b3261e"
#: columns that are drawn with another one, in its axis: what is allowed, planned and measured of it, with its dash
BESIDE = {
    "torque_nm": (("torque_allowable_nm", "#b3261e", "dash"), ("torque_planned_nm", "#6b7683", "dot")),
    "torque_measured_nm": (("torque_allowable_nm", "#b3261e", "dash"), ("torque_planned_nm", "#6b7683", "dot")),
    "force_normal_n": (("force_allowable_n", "#b3261e", "dash"), ("force_normal_planned_n", "#6b7683", "dot")),
}
#: a limit farther above the values than this is named but would flatten them if it were drawn
FAR = 1.8
#: room for the words of a plot above its greatest value, of the height of its values
HEAD = 0.42
#: an axis of values
VALUES: dict[str, Any] = {
    "gridcolor": GRID,
    "zerolinecolor": "#c9ced6",
    "nticks": 4,
    "tickfont": {"size": 10, "color": "#5f6b7a"},
    "automargin": False,
}


def bounds_of(result: PageResult, track: PageTrack, columns: Sequence[str]) -> dict[str, Bound | None]:
    """The stated limit of each column."""
    return {c: bound_of(result, track, c) for c in columns}


def plots(
    result: PageResult,
    track: PageTrack,
    bounds: Mapping[str, Bound | None],
    against: str,
    row: int,
    sides: Sequence[Side] = (),
    zoomed: tuple[float, float] | None = None,
) -> dict[str, Any]:
    """The figure (plotly, plain values) of columns and their limits with the cursor at a row.

    ``sides``: the track itself and those that it is compared with, each drawn in its colour along the first;
    ``zoomed``: part of the abscissa that is drawn in more detail, None: none.
    """
    x = abscissa(track, against)
    others = [(side, rows_along(sides[0], side, against)) for side in sides[1:]]
    at = float(x[row])
    data: list[dict[str, Any]] = []
    axes: dict[str, Any] = {}
    notes: list[dict[str, Any]] = []
    shapes: list[dict[str, Any]] = [cursor(at)]
    count = max(len(bounds), 1)
    gap = 0.05 if count > 1 else 0.0
    height = (1.0 - gap * (count - 1)) / count
    for k, (column, bound) in enumerate(bounds.items()):
        values = result.column(track, column)
        y = values.codes.astype(np.float64) if isinstance(values, TextColumn) else values
        rows = drawn_rows(y, x, zoomed)
        unit = escape(label_and_unit(column)[1])
        colour = sides[0].colour if sides else COLOURS[k % len(COLOURS)]
        axis = "" if k == 0 else str(k + 1)
        top = 1.0 - k * (height + gap)
        other_columns = [(side, xs, _numbers(side, column)) for side, xs in others]
        drawn = [y, *(v for _, _, v in other_columns if v is not None)]
        for name, paint, dash in BESIDE.get(column, ()):
            own = result.column(track, name) if name in result.columns else None
            if own is None or isinstance(own, TextColumn) or not np.isfinite(own).any():
                continue
            # an allowable value far above would flatten what it is compared with
            if float(np.nanmin(own)) <= FAR * float(np.nanmax(np.nan_to_num(y))):
                drawn.append(np.minimum(own, FAR * float(np.nanmax(np.nan_to_num(y)))))
            some = drawn_rows(own, x, zoomed)
            data.append(_line(name, x[some], own[some], axis, paint, f"%{{y:.5g}} {unit} {name}", dash))
        finite = np.concatenate([v[np.isfinite(v)] for v in drawn])
        low, high = (float(finite.min()), float(finite.max())) if len(finite) else (0.0, 1.0)
        limit = bound.limit if bound is not None else math.inf
        near = limit <= FAR * high
        reach = max(high, limit) if near else high
        span = (reach - min(low, 0.0)) or 1.0
        axes[f"yaxis{axis}"] = {
            "domain": [max(top - height, 0.0), top],
            "range": [min(low, 0.0) - 0.04 * span, reach + HEAD * span],
            **VALUES,
            **(_words(values) if isinstance(values, TextColumn) else {}),
        }
        data.append(
            {
                "type": "scatter", "mode": "lines", "name": column, "x": x[rows], "y": y[rows],
                "xaxis": "x", "yaxis": f"y{axis}", "connectgaps": False, "showlegend": False,
                "line": {"color": colour, "width": 1.3, "shape": "vh" if track.line is not None else "linear"},
                "hovertemplate": f"%{{y:.5g}} {unit}<extra></extra>",
            }
        )  # fmt: skip
        for side, xs, v in other_columns:
            if v is not None:
                some = drawn_rows(v, xs, zoomed)
                template = f"%{{y:.5g}} {unit} {escape(side.title)}"
                data.append(_line(f"{column}: {side.title}", xs[some], v[some], axis, side.colour, template))
        notes.append(
            {
                "text": annotation(result, track, column, row, bound, sides, against), "x": 0.004, "y": top,
                "xref": "paper", "yref": "paper", "xanchor": "left", "yanchor": "top", "showarrow": False,
                "font": {"size": 11, "color": colour},
                "bgcolor": "rgba(255,255,255,0.85)", "borderpad": 1,
            }
        )  # fmt: skip
        if near:
            shapes.append(
                {
                    "type": "line", "xref": "paper", "x0": 0, "x1": 1, "yref": f"y{axis}", "y0": limit, "y1": limit,
                    "line": {"color": LIMIT, "width": 1, "dash": "dash"},
                }
            )  # fmt: skip
    layout = {
        **_layout(against, _range([x, *(xs for _, xs in others)])),
        "shapes": shapes,
        "annotations": notes,
        "uirevision": f"{result.name}/{track.title}/{against}/{'/'.join(side.title for side in sides)}",
        **axes,
    }
    config = {"displaylogo": False, "displayModeBar": False, "doubleClick": "reset"}
    return {"data": data, "layout": layout, "config": config}


def _layout(against: str, span: list[float]) -> dict[str, Any]:
    """What all plots share: fonts, margins and the axis of time or path, which shows ``span``."""
    title = {"time": "time [s]", "path": "path [mm]"}[against]
    return {
        "font": {**FONT, "size": 11, "color": INK},
        "margin": {"l": 52, "r": 10, "t": 4, "b": 32},
        "paper_bgcolor": "white",
        "plot_bgcolor": "white",
        "hovermode": "x",
        "hoverdistance": -1,
        "dragmode": "zoom",
        "xaxis": {
            "title": {"text": title, "standoff": 2, "font": {"size": 11}},
            "anchor": "free",
            "position": 0.0,
            "gridcolor": GRID,
            "zeroline": False,
            "range": span,
            "tickfont": {"size": 10, "color": "#5f6b7a"},
        },
    }


def _line(
    name: str, x: Floats, y: Floats, axis: str, colour: str, template: str, dash: str = "solid"
) -> dict[str, Any]:
    """One line of the figure; ``axis`` is the ending of its y axis."""
    return {
        "type": "scatter", "mode": "lines", "name": name, "x": x, "y": y, "xaxis": "x", "yaxis": f"y{axis}",
        "connectgaps": False, "showlegend": False, "line": {"color": colour, "width": 1.3, "dash": dash},
        "hovertemplate": f"{template}<extra></extra>",
    }  # fmt: skip


def abscissa(track: PageTrack, against: str) -> Floats:
    """(n,) time or path of each row."""
    return track.t if against == "time" else track.s


def annotation(
    result: PageResult,
    track: PageTrack,
    column: str,
    row: int,
    bound: Bound | None,
    sides: Sequence[Side] = (),
    against: str = "time",
) -> str:
    """Name of a column, its value at a row, those of the other sides there, and its limit."""
    word, unit = label_and_unit(column)
    limit = ""
    if bound is not None:
        covers = f", {escape(bound.covers)}" if bound.covers else ""
        limit = f'  <span style="color:{LIMIT}">limit {bound.limit:g}{covers}</span>'
    values = [f"<b>{escape(_value(result, track, column, row))}</b>"]
    for side in sides[1:]:
        there = _value(side.result, side.track, column, matching_row(sides[0], side, against, row))
        values.append(f'<span style="color:{side.colour}"><b>{escape(there)}</b></span>')
    return f"{escape(word)} {' / '.join(values)} {escape(unit)}{limit}"


def _value(result: PageResult, track: PageTrack, column: str, row: int) -> str:
    """What a column holds at a row, as text; a dash: the result has no such column."""
    if column not in result.columns:
        return "-"
    values = result.column(track, column)
    if not isinstance(values, TextColumn):
        return number_text(float(values[row]))
    return values.words[int(values.codes[row])] if values.codes[row] >= 0 else ""


def _numbers(side: Side, column: str) -> Floats | None:
    """(n,) numbers of a column of a side; None: it has none."""
    values = side.result.column(side.track, column) if column in side.result.columns else None
    return None if values is None or isinstance(values, TextColumn) else values


def _range(x: Sequence[Floats]) -> list[float]:
    low, high = min(float(v[0]) for v in x), max(float(v[-1]) for v in x)
    return [low, high] if high > low else [low - 1.0, low + 1.0]


def cursor(at: float) -> dict[str, Any]:
    """The line that stands at the slider's time."""
    line = {"color": CURSOR, "width": 1.4}
    return {"type": "line", "xref": "x", "x0": at, "x1": at, "yref": "paper", "y0": 0, "y1": 1, "line": line}


def drawn_rows(values: Floats, x: Floats, zoomed: tuple[float, float] | None = None) -> NDArray[np.int64]:
    """(m,) rows of a line over a rising ``x``: each bucket's least and greatest; a zoomed part has its own buckets.

    Of a run of rows without a value only the first is drawn.

    >>> drawn_rows(np.array([1.0, np.nan, np.nan, 2.0]), np.arange(4.0)).tolist()
    [0, 1, 3]
    """
    void = np.isnan(values)
    some = np.flatnonzero(~(void & np.concatenate([[False], void[:-1]])))
    out = some[thin_rows(values[some], POINTS)]
    if zoomed is None:
        return out
    first, last = np.searchsorted(x[some], zoomed)
    part = some[max(int(first) - 1, 0) : int(last) + 1]
    return np.union1d(out, part[thin_rows(values[part], POINTS)]) if len(part) else out


def _words(values: TextColumn) -> dict[str, Any]:
    short = [escape(w if len(w) <= 8 else w[:7] + "\u2026") for w in values.words[:40]]
    return {"tickvals": list(range(len(short))), "ticktext": short}
