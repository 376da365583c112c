"""Figures of a contour or pocket: loads along the pass, the plan view, and the path in space.

Strategies keep one colour each in every figure. Long columns are thinned so that every extreme stays.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import plotly.graph_objects as go
from numpy.typing import NDArray
from plotly.colors import sample_colorscale
from plotly.subplots import make_subplots

from chipload.geometry.contour import Contour
from chipload.jobs.contour.outcome import Operation
from chipload.jobs.contour.result import ON_WALL, limits_of
from chipload.machine.machine import Machine
from chipload.planning.result import StrategyResult
from chipload.report.shape import CHORD_MM, stretches
from chipload.result import COLUMNS, LimitCheck, Verdict
from chipload.result.style import (
    FONT,
    GRID,
    INK,
    LIMIT,
    LINE_POINTS,
    PLAN_POINTS,
    SCALE,
    SHADES,
    STOCK,
    WALL,
)
from chipload.result.thinning import thin_rows

Floats = NDArray[np.float64]

COLOURS = {
    "plain": "#8a8f98",
    "backward": "#0b7a75",
    "feed": "#c9821a",
    "forward": "#3457a6",
    "pocket": "#3457a6",
    "trochoidal": "#8a4fa0",
}
DASHES = {"plain": "dot", "feed": "dash"}
#: columns along the pass; a limit of the column's name is drawn with it
ROWS = ("engagement_deg", "force_xy_n", "form_error_um", "feed_mm_min")
#: a limit farther above the values than this is named but would flatten them if it were drawn
FAR = 1.8


def shown_rows(strategy: StrategyResult) -> NDArray[np.bool_]:
    """Rows that the figures along the pass show: the finish pass, or all cutting where there is none."""
    names = np.asarray(strategy.history["pass"]).astype(str)
    finish: NDArray[np.bool_] = np.isin(names, ["finish", "closing"])
    cut: NDArray[np.bool_] = np.isin(names, ["entry", "pocket", "floor", "wall", "semifinish"])
    return next((some for some in (finish, cut) if some.any()), np.ones(len(names), dtype=np.bool_))


def loads_along_pass(operation: Operation) -> go.Figure:
    """Engagement, force, form error and feed along the finish pass, all strategies overlaid."""
    shown = [r for r in ROWS if any(s.history[r][shown_rows(s)].any() for s in operation.result.strategies.values())]
    shown = shown or [ROWS[0]]
    figure = make_subplots(rows=len(shown), cols=1, shared_xaxes=True, vertical_spacing=0.035)
    highest = np.zeros(len(shown))
    for name, strategy in operation.result.strategies.items():
        where = np.flatnonzero(shown_rows(strategy))
        s, apart = _abscissa(strategy.history, where)
        for row, column in enumerate(shown, start=1):
            values = np.abs(np.asarray(strategy.history[column], dtype=np.float64)[where])
            x, y = _leave_gaps(s, values, apart)
            keep = thin_rows(y, LINE_POINTS)
            highest[row - 1] = max(highest[row - 1], float(values.max(initial=0.0)))
            figure.add_trace(
                go.Scatter(
                    x=x[keep].astype(np.float32),
                    y=y[keep].astype(np.float32),
                    name=name,
                    legendgroup=name,
                    showlegend=row == 1,
                    mode="lines",
                    line={"color": COLOURS[name], "width": 1.8, "dash": DASHES.get(name, "solid")},
                    hovertemplate=f"{name}: %{{y:.4g}}<extra>{COLUMNS[column].title}</extra>",
                ),
                row=row,
                col=1,
            )
    limits = operation.limits
    for row, (column, top) in enumerate(zip(shown, highest, strict=True), start=1):
        limit = limits.get(column)
        near = limit is not None and limit <= FAR * top
        reach = 1.12 * max(top, limit if near and limit is not None else 0.0)
        figure.update_yaxes(title_text=COLUMNS[column].title, range=[0.0, reach or 1.0], row=row, col=1)
        if limit is None:
            continue
        covered = ", where the wall is made" if operation.result.kind == "contour" else ", in the passes"
        covered = covered if column in ON_WALL else ""
        text = f"limit {limit:g}{covered}" + ("" if near else ", far above")
        label = {"text": text, "font": {"color": LIMIT, "size": 11}}
        if near:
            line = {"color": LIMIT, "width": 1.2, "dash": "dash"}
            figure.add_hline(y=limit, line=line, annotation=label, annotation_position="top left", row=row, col=1)
        else:
            at = {"x": 0.0, "y": reach, "xref": "x domain", "xanchor": "left", "yanchor": "top", "showarrow": False}
            figure.add_annotation(**label, **at, row=row, col=1)
    figure.update_xaxes(title_text="length along the pass [mm]", row=len(shown), col=1)
    figure.update_layout(hovermode="x unified", legend={"orientation": "h", "y": 1.02, "yanchor": "bottom", "x": 0.0})
    return _style_figure(figure, 110 + 172 * len(shown), {"l": 64, "r": 16, "t": 30, "b": 44})


def plan(machine: Machine, operation: Operation) -> go.Figure:
    """Wall, stock and paths from above; the finish pass coloured by engagement, events marked."""
    figure = go.Figure()
    used = operation.result.strategies[operation.result.use]
    scale = _scale(operation)
    _chains(figure, used.drawn.get("stock", ()), "stock before the finish pass", STOCK, 1.4, "dot")
    _chains(figure, used.drawn.get("leftover", ()), "left over", LIMIT, 1.5, "solid")
    _chains(figure, used.drawn.get("wall", ()), "wall", WALL, 3.4, "solid")
    for name, strategy in operation.result.strategies.items():
        visible: Any = True if name == operation.result.use else "legendonly"
        h = strategy.history
        names = np.asarray(h["pass"]).astype(str)
        before = np.flatnonzero(names == "semifinish")
        if len(before):
            keep = before[:: max(1, len(before) // LINE_POINTS)]
            x, y = _places_of_rows(h, keep)
            figure.add_trace(
                go.Scatter(
                    x=x, y=y, mode="lines", legendgroup=name, showlegend=False, visible=visible,
                    line={"color": COLOURS[name], "width": 1.1, "dash": "dash"}, hoverinfo="skip",
                )
            )  # fmt: skip
        _shaded_lines(figure, name, strategy, scale, visible)
        _marks(figure, name, strategy, limits_of(machine, operation, strategy, name), visible)
    bar = {**_shade(np.array(scale), scale, True), "size": 0.1, "opacity": 0.0}
    figure.add_trace(go.Scatter(x=[None], y=[None], mode="markers", marker=bar, showlegend=False, hoverinfo="skip"))
    figure.update_yaxes(scaleanchor="x", scaleratio=1.0, title_text="y [mm]")
    figure.update_xaxes(title_text="x [mm]")
    figure.update_layout(legend={"orientation": "h", "y": 1.02, "yanchor": "bottom", "x": 0.0})
    return _style_figure(figure, 640, {"l": 64, "r": 16, "t": 60, "b": 44})


# -- parts ------------------------------------------------------------------------------------------------------
def _style_figure(figure: go.Figure, height: int, margin: Mapping[str, int]) -> go.Figure:
    figure.update_layout(
        template="none", height=height, margin=dict(margin), font=FONT, paper_bgcolor="white", plot_bgcolor="white"
    )
    figure.update_xaxes(gridcolor=GRID, zeroline=False, linecolor="#9aa3ad", ticks="outside", tickcolor="#9aa3ad")
    figure.update_yaxes(gridcolor=GRID, zeroline=False, linecolor="#9aa3ad", ticks="outside", tickcolor="#9aa3ad")
    return figure


def _abscissa(history: Mapping[str, NDArray[Any]], where: NDArray[np.int64]) -> tuple[Floats, NDArray[np.int64]]:
    """Length from the beginning of what is shown, links left out, and the rows before which a gap lies."""
    s = np.asarray(history["s_mm"], dtype=np.float64)[where]
    apart = np.flatnonzero(np.diff(where) > 1) + 1
    step = np.diff(s, prepend=s[:1])
    step[apart] = 0.0
    return np.cumsum(step), apart


def _leave_gaps(x: Floats, y: Floats, apart: NDArray[np.int64]) -> tuple[Floats, Floats]:
    return np.insert(x, apart, x[apart]), np.insert(y, apart, np.nan)


def _places_of_rows(history: Mapping[str, NDArray[Any]], rows: NDArray[np.int64]) -> tuple[Floats, Floats]:
    """Places of rows, x and y, with a gap where rows between them belong to something else."""
    piece = stretches(history)[rows]
    apart = np.flatnonzero(piece[1:] != piece[:-1]) + 1
    x, y = (np.asarray(history[c], dtype=np.float64)[rows] for c in ("x_mm", "y_mm"))
    return np.insert(x, apart, np.nan).astype(np.float32), np.insert(y, apart, np.nan).astype(np.float32)


def _scale(operation: Operation) -> tuple[float, float]:
    """Least and greatest engagement of what is shown, over all strategies: one colour scale for all."""
    seen = np.concatenate([s.history["engagement_deg"][shown_rows(s)] for s in operation.result.strategies.values()])
    cut = seen[seen > 0.0]
    return (float(cut.min()), float(cut.max())) if len(cut) else (0.0, 1.0)


def _shade(engagement: Floats, scale: tuple[float, float], bar: bool) -> dict[str, Any]:
    out: dict[str, Any] = {"color": engagement.astype(np.float32), "colorscale": SCALE}
    out |= {"cmin": scale[0], "cmax": scale[1], "showscale": bar}
    if bar:
        title = {"text": "engagement [deg]", "side": "right"}
        out["colorbar"] = {"title": title, "thickness": 12, "len": 0.8, "outlinewidth": 0}
    return out


def _chains(figure: go.Figure, contours: Sequence[Contour], name: str, colour: str, width: float, dash: str) -> None:
    if not contours:
        return
    parts = [np.vstack([c.flatten(CHORD_MM), [[np.nan, np.nan]]]) for c in contours]
    x, y = np.vstack(parts).astype(np.float32).T
    line = {"color": colour, "width": width, "dash": dash}
    figure.add_trace(go.Scatter(x=x, y=y, mode="lines", name=name, line=line, hoverinfo="skip"))


def _shaded_lines(
    figure: go.Figure, name: str, strategy: StrategyResult, scale: tuple[float, float], visible: Any
) -> None:
    """The pass as lines in :data:`SHADES` colours of engagement, one trace a colour."""
    h = strategy.history
    rows = np.flatnonzero(shown_rows(strategy))
    engagement = np.asarray(h["engagement_deg"], dtype=np.float64)
    even = rows[:: max(1, len(rows) // PLAN_POINTS)]
    keep = np.union1d(even, rows[thin_rows(engagement[rows], PLAN_POINTS // 2)])
    piece = stretches(h)[keep]
    joined = np.flatnonzero(piece[1:] == piece[:-1])
    a = engagement[keep[joined + 1]]
    share = np.clip((a - scale[0]) / (scale[1] - scale[0]), 0.0, 1.0) if scale[1] > scale[0] else np.zeros(len(a))
    shade = np.minimum((share * SHADES).astype(np.int64), SHADES - 1)
    x, y = (np.asarray(h[c], dtype=np.float64) for c in ("x_mm", "y_mm"))
    colours = sample_colorscale(SCALE, np.linspace(0.0, 1.0, SHADES).tolist())
    first = True
    for k in np.unique(shade).tolist():
        ends = joined[shade == k]
        runs = np.split(ends, np.flatnonzero(np.diff(ends) != 1) + 1)
        flat = np.concatenate([np.append(keep[run[0] : run[-1] + 2], -1) for run in runs])
        gap = flat == -1
        at = np.where(gap, 0, flat)
        hover = np.column_stack([engagement[at], np.asarray(h["force_xy_n"])[at]]).astype(np.float32)
        figure.add_trace(
            go.Scatter(
                x=np.where(gap, np.nan, x[at]).astype(np.float32), y=np.where(gap, np.nan, y[at]).astype(np.float32),
                mode="lines", name=name, legendgroup=name, showlegend=first, visible=visible, customdata=hover,
                line={"color": colours[k], "width": 3.0},
                hovertemplate="(%{x:.3f}, %{y:.3f})<br>%{customdata[0]:.3f} deg, %{customdata[1]:.1f} N<extra></extra>",
            )
        )  # fmt: skip
        first = False


def _marks(figure: go.Figure, name: str, strategy: StrategyResult, checks: Sequence[LimitCheck], visible: Any) -> None:
    """Events, and the worst places of limits that do not hold."""
    marks = [(e.x, e.y, e.text, e.failure) for e in strategy.events]
    marks += [(c.place[0], c.place[1], c.text, True) for c in checks if c.place and c.state is Verdict.EXCEEDS]
    for failed, symbol, colour in ((False, "diamond-open", INK), (True, "x", LIMIT)):
        some = [m for m in marks if m[3] == failed]
        if some:
            figure.add_trace(
                go.Scatter(
                    x=[m[0] for m in some], y=[m[1] for m in some], text=[m[2] for m in some], mode="markers",
                    legendgroup=name, showlegend=False, visible=visible, hovertemplate="%{text}<extra></extra>",
                    marker={"symbol": symbol, "size": 11, "color": colour, "line": {"width": 2, "color": colour}},
                )
            )  # fmt: skip
