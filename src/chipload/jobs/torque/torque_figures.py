"""Figures of a result on a thin tube or cone."""

from __future__ import annotations

from typing import Any

import numpy as np
import plotly.graph_objects as go
from numpy.typing import NDArray
from plotly.subplots import make_subplots

from chipload.control.fuzzy import FuzzyTable, surface
from chipload.jobs.torque.outcome import HELD, ControllerCase, ShellWall, TorqueResult
from chipload.number_text import number_text
from chipload.result.style import FONT, GRID, INK, LIMIT, LINE_POINTS, SCALE, STOCK
from chipload.result.thinning import thin_rows
from chipload.units import mm_min_from_mm_s

Floats = NDArray[np.float64]

COLOURS = {
    "constant": "#8a8f98",
    "model": "#7a4f9a",
    "model_not_derated": "#a8793a",
    "pi": "#3457a6",
    "fuzzy": "#c9821a",
    "fuzzy_feedforward": "#0b7a75",
}
NAMES = {
    "constant": "greatest constant feed",
    "model": "feed schedule of the model, derated, open loop",
    "model_not_derated": "the same, not derated",
    "pi": "PI",
    "fuzzy": "fuzzy",
    "fuzzy_feedforward": "fuzzy with the model",
}
#: largest displacement in the picture of the rim, over its radius
EXAGGERATED = 0.35


def torques_along(outcome: TorqueResult, case: ControllerCase, by: str) -> go.Figure:
    """Torque over what is allowable, override, feed and form error of every controller, by ``path`` or ``time``."""
    titles = ("torque / allowable", "override", "feed [mm/min]", "form error [µm]")
    figure = make_subplots(rows=4, cols=1, shared_xaxes=True, vertical_spacing=0.03)
    path = outcome.allowable.path
    for name, run in case.runs.items():
        o = run.outcome
        x = o.s if by == "path" else o.t
        relief = np.interp(o.s, path.model.s, path.relief)
        values = (
            o.torque / (outcome.allowable.torque * relief),
            o.override,
            mm_min_from_mm_s(1.0) * o.feed,
            1e3 * run.error,
        )
        for row, (y, title) in enumerate(zip(values, titles, strict=True), start=1):
            keep = thin_rows(y, LINE_POINTS // 4)
            figure.add_trace(
                go.Scatter(
                    x=x[keep].astype(np.float32), y=y[keep].astype(np.float32), name=NAMES[name], legendgroup=name,
                    showlegend=row == 1, mode="lines",
                    line={"color": COLOURS[name], "width": 2.0 if name == HELD else 1.1},
                    hovertemplate=f"{NAMES[name]}: %{{y:.4g}}<extra>{title}</extra>",
                ),
                row=row, col=1,
            )  # fmt: skip
    for row, limit in ((1, 1.0), (4, outcome.job.limits["form_error_um"])):
        label = {"text": f"limit {limit:.4g}", "font": {"color": LIMIT, "size": 11}}
        line = {"color": LIMIT, "width": 1.2, "dash": "dash"}
        figure.add_hline(y=limit, line=line, annotation=label, annotation_position="top left", row=row, col=1)
    for row, title in enumerate(titles, start=1):
        figure.update_yaxes(title_text=title, rangemode="tozero", row=row, col=1)
    figure.update_xaxes(title_text="along the path [mm]" if by == "path" else "time [s]", row=4, col=1)
    figure.update_layout(legend={"orientation": "h", "y": 1.01, "yanchor": "bottom", "x": 0.0})
    return _style_figure(figure, 860)


def allowable(outcome: TorqueResult) -> go.Figure:
    """Torque at the programmed feed, planned and true, against the allowable one along the path."""
    path = outcome.allowable.path
    s = path.model.s
    lines: list[tuple[str, Floats, str, Any]] = [
        ("planned", path.model.torque(1.0), STOCK, "solid"),
        ("true", path.truth.torque(1.0), INK, "solid"),
        ("of the edge alone, planned", path.model.edge, "#8a8f98", "dot"),
    ]
    if outcome.attainable:
        what = "wall" if isinstance(outcome.wall, ShellWall) else "workpiece"
        lines.append((f"allowable for the {what}", outcome.allowable.torque * path.relief, LIMIT, "dash"))
    figure = go.Figure()
    for name, y, colour, dash in lines:
        keep = thin_rows(y, LINE_POINTS)
        style = {"color": colour, "width": 1.5, "dash": dash}
        figure.add_trace(go.Scatter(x=s[keep], y=1e-3 * y[keep], name=name, mode="lines", line=style))
    figure.update_xaxes(title_text="along the path [mm]")
    figure.update_yaxes(title_text="torque at the programmed feed [N m]", rangemode="tozero")
    figure.update_layout(legend={"orientation": "h", "y": 1.02, "yanchor": "bottom", "x": 0.0})
    return _style_figure(figure, 380)


def ovalisation_figure(wall: ShellWall) -> go.Figure:
    """Rim under the cutter's force, and the part of each harmonic, compared with a beam."""
    oval, shell = wall.oval, wall.shell
    figure = make_subplots(
        rows=1, cols=2, specs=[[{"type": "polar"}, {"type": "xy"}]], column_widths=[0.45, 0.55],
        subplot_titles=("rim, pushed inwards at 0 deg", "normal deflection under 1 N, by harmonic [µm]"),
    )  # fmt: skip
    radius = float(shell.radius_at(wall.oval_s))
    scale = EXAGGERATED * radius / float(np.abs(oval.rim).max())
    degrees = np.degrees(oval.theta)
    shapes = [
        ("round", np.full(len(degrees), radius), "#8a8f98", "dot"),
        ("shell", radius - scale * oval.rim, "#0b7a75", "solid"),
    ]
    if wall.oval.beam is not None:
        shapes.append(("beam", radius - scale * wall.oval.beam * np.cos(oval.theta), LIMIT, "dash"))
    for name, r, colour, dash in shapes:
        style = {"color": colour, "width": 2.0, "dash": dash}
        figure.add_trace(go.Scatterpolar(r=r, theta=degrees, mode="lines", name=name, line=style), row=1, col=1)
    n = np.asarray(oval.harmonics)[:16]
    figure.add_trace(
        go.Bar(x=n, y=1e3 * oval.share[:16], name="of the shell", marker={"color": "#0b7a75"}), row=1, col=2
    )
    if wall.oval.beam is not None:
        style = {"color": LIMIT, "width": 1.4, "dash": "dash"}
        whole = f"a beam with shear, in all {number_text(1e3 * wall.oval.beam, 3)} µm"
        ends = [-0.5, float(n[-1]) + 0.5]
        figure.add_trace(
            go.Scatter(x=ends, y=[1e3 * wall.oval.beam] * 2, mode="lines", line=style, name=whole), row=1, col=2
        )
    figure.update_xaxes(title_text="harmonic around the wall (1: bending of a beam, 2: oval)", dtick=1, row=1, col=2)
    figure.update_polars(radialaxis={"visible": False})
    figure.update_layout(legend={"orientation": "h", "y": -0.15, "x": 0.0})
    return _style_figure(figure, 430)


def answers(table: FuzzyTable) -> go.Figure:
    """Output of the fuzzy rules over the error and its change."""
    e, d, f = surface(table)
    figure = go.Figure(go.Surface(x=d, y=e, z=f, colorscale=SCALE, colorbar={"thickness": 12, "title": "answer"}))
    axes = {"xaxis": {"title": "change"}, "yaxis": {"title": "error"}, "zaxis": {"title": "answer"}}
    figure.update_layout(scene={**axes, "camera": {"eye": {"x": -1.5, "y": -1.6, "z": 0.9}}})
    return _style_figure(figure, 460)


def measured_torque_figure(outcome: TorqueResult) -> go.Figure:
    """Measured and true torque of the controller of the verdict, and the measurements that it does not trust."""
    run_of = outcome.control.cases[-1].runs[HELD]
    run = run_of.outcome
    keep = np.unique(np.linspace(0, len(run.t) - 1, min(len(run.t), 3000)).astype(np.int64))
    figure = go.Figure(
        go.Scattergl(
            x=1e-3 * run.torque[keep], y=1e-3 * run.measured[keep], mode="markers", name="each step of the controller",
            marker={"size": 3, "color": "#3457a6"},
        )
    )  # fmt: skip
    top = 1e-3 * float(max(run.torque.max(), run.measured.max()))
    line = {"color": INK, "width": 1.0}
    figure.add_trace(go.Scatter(x=[0.0, top], y=[0.0, top], mode="lines", line=line, name="equal"))
    low = min(0.0, 1e-3 * float(run.measured.min()))
    figure.add_hrect(
        y0=low, y1=1e-3 * run_of.config.light, fillcolor=LIMIT, opacity=0.12, line_width=0,
        annotation={"text": "not trusted", "font": {"color": LIMIT, "size": 11}},
    )  # fmt: skip
    figure.update_xaxes(title_text="true torque [N m]")
    figure.update_yaxes(title_text="measured by the spindle [N m]")
    return _style_figure(figure, 400)


def _style_figure(figure: go.Figure, height: int) -> go.Figure:
    figure.update_xaxes(gridcolor=GRID, zeroline=False)
    figure.update_yaxes(gridcolor=GRID, zeroline=False)
    figure.update_layout(template="none", height=height, font=FONT, margin={"l": 70, "r": 20, "t": 46, "b": 50})
    return figure
