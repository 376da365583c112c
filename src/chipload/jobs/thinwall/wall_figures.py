"""Figures of a thin wall: maps over its sides, the three variants along their time, the path in space."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import plotly.graph_objects as go
from numpy.typing import NDArray
from plotly.subplots import make_subplots

from chipload.jobs.thinwall.outcome import ThinWallResult, Variant
from chipload.result.style import FONT, GRID, INK, LIMIT, LINE_POINTS, SCALE, SPACE_POINTS
from chipload.result.thinning import thin_rows

Floats = NDArray[np.float64]

COLOURS = {"variable": "#0b7a75", "constant": "#3457a6", "unconstrained": "#c9821a", "least_error": "#7a4fa3",
           "compensated": "#b3437d"}  # fmt: skip
#: blue where material is left, red where it is cut away, white where neither
BOTH = [[0.0, "#b3261e"], [0.5, "#ffffff"], [1.0, "#3457a6"]]


def lengths(points: Floats) -> tuple[Floats, Floats]:
    """Distance along a side at half its height, and height over the clamp, of places (n, m, 3) [mm]; of a level floor
    the distance across instead of the height.

    >>> floor = np.stack(np.meshgrid([0.0, 4.0], [1.0, 3.0], [5.0], indexing="ij"), axis=-1)[:, :, 0]
    >>> [x.tolist() for x in lengths(floor)]
    [[0.0, 4.0], [0.0, 2.0]]
    """
    along = _distances(points[:, points.shape[1] // 2])
    across = points[points.shape[0] // 2]
    return along, _distances(across) if _level(points) else np.asarray(across[:, 2])


def _distances(line: Floats) -> Floats:
    """Distance of the points of a line from its first one, along it [mm]."""
    return np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))])


def _level(points: Floats) -> bool:
    """Whether places are those of a level floor."""
    return bool(np.ptp(points[..., 2]) <= 1e-6)


def maps(
    values: Sequence[Floats],
    points: Sequence[Floats],
    titles: Sequence[str],
    unit: str,
    *,
    signed: bool = False,
    logarithmic: bool = False,
) -> go.Figure:
    """Values (n, m) over the places (n, m, 3) of sides, side by side under one colour scale."""
    columns = min(len(values), 4)
    rows = -(-len(values) // columns)
    out = make_subplots(
        rows=rows,
        cols=columns,
        subplot_titles=titles,
        horizontal_spacing=0.05,
        vertical_spacing=0.34 / max(rows, 1) / 1.4,
    )
    shown = [np.log10(v) if logarithmic else v for v in values]
    low = min(float(np.nanmin(v)) for v in shown)
    high = max(float(np.nanmax(v)) for v in shown)
    if signed:
        high = max(abs(low), abs(high))
        low = -high
    bar: dict[str, Any] = {"title": {"text": unit, "side": "right"}, "thickness": 12, "outlinewidth": 0}
    if logarithmic:
        ticks = [10.0**k * f for k in range(-2, 6) for f in (1, 2, 5) if low <= np.log10(10.0**k * f) <= high]
        bar |= {"tickvals": np.log10(ticks).tolist() if ticks else [], "ticktext": [f"{t:g}" for t in ticks]}
    for k, (value, drawn, p) in enumerate(zip(values, shown, points, strict=True)):
        x, z = lengths(p)
        out.add_trace(
            go.Heatmap(
                x=x.astype(np.float32),
                y=z.astype(np.float32),
                z=drawn.T.astype(np.float32),
                customdata=value.T.astype(np.float32),
                zmin=low,
                zmax=high if high > low else low + 1.0,
                colorscale=BOTH if signed else SCALE,
                zsmooth="best",
                showscale=k == 0,
                colorbar=bar,
                hovertemplate="%{x:.1f} along, %{y:.1f} up: %{customdata:.4g} " + unit + "<extra></extra>",
            ),
            row=k // columns + 1,
            col=k % columns + 1,
        )
    out.update_xaxes(showgrid=False, zeroline=False, title_font={"size": 11}, ticks="outside")
    out.update_yaxes(showgrid=False, zeroline=False, ticks="outside")
    for c in range(columns):
        out.update_xaxes(title_text="along [mm]", row=rows, col=c + 1)
    for r in range(rows):
        out.update_yaxes(title_text="across [mm]" if _level(points[0]) else "up [mm]", row=r + 1, col=1)
    out.update_annotations(font={"size": 12})
    out.update_layout(
        template="none", height=60 + 230 * rows, font=FONT, margin={"l": 56, "r": 20, "t": 34, "b": 46},
        paper_bgcolor="white", plot_bgcolor="white",
    )  # fmt: skip
    return out


def loads_along_time(walled: ThinWallResult) -> go.Figure:
    """Deflection of the wall, its force over the threshold, and its force, over the time at a feed, with the variants
    in rows of one figure.
    """
    rows = (
        ("deflection_workpiece_um", 1.0, "workpiece deflection [µm]", walled.limits["deflection_workpiece_um"]),
        ("force_over_allowable", 1.0, "force over threshold", 1.0),
        ("force_normal_n", 1.0, "normal force [N]", None),
        ("deflection_cutter_um", 1.0, "cutter deflection [µm]", None),
    )
    out = make_subplots(rows=len(rows), cols=1, shared_xaxes=True, vertical_spacing=0.03)
    for name in ("unconstrained", "constant", "least_error", "compensated", "variable"):
        if name not in walled.variants:
            continue
        c = walled.variants[name].columns
        t = np.asarray(c["t_s"]) / 60.0
        for k, (column, factor, title, _) in enumerate(rows, start=1):
            y = factor * np.asarray(c[column], dtype=np.float64)
            keep = thin_rows(y, LINE_POINTS // 2)
            out.add_trace(
                go.Scatter(
                    x=t[keep].astype(np.float32), y=y[keep].astype(np.float32), name=name, legendgroup=name,
                    showlegend=k == 1, mode="lines", line={"color": COLOURS[name], "width": 1.2},
                    hovertemplate=f"{name}: %{{y:.4g}}<extra>{title}</extra>",
                ),
                row=k, col=1,
            )  # fmt: skip
    for k, (_, _, title, limit) in enumerate(rows, start=1):
        out.update_yaxes(title_text=title, rangemode="tozero", row=k, col=1)
        if limit is not None:
            label = {"text": f"limit {limit:g}", "font": {"color": LIMIT, "size": 11}}
            line = {"color": LIMIT, "width": 1.2, "dash": "dash"}
            out.add_hline(y=limit, line=line, annotation=label, annotation_position="top right", row=k, col=1)
    out.update_xaxes(gridcolor=GRID, zeroline=False)
    out.update_yaxes(gridcolor=GRID, zeroline=False)
    out.update_xaxes(title_text="time at feed [min]", row=len(rows), col=1)
    out.update_layout(
        template="none", height=90 + 165 * len(rows), font=FONT, margin={"l": 64, "r": 16, "t": 30, "b": 44},
        legend={"orientation": "h", "y": 1.02, "yanchor": "bottom", "x": 0.0}, hovermode="x",
    )  # fmt: skip
    return out


def space(walled: ThinWallResult, one: Variant) -> go.Figure:
    """The finished wall, the workpiece before, its neighbours, and the contact points coloured by depth."""
    out = go.Figure()
    for (vertices, faces), name, colour, opacity in (
        (walled.geometry.finished, "finished wall", "#8b97a6", 1.0),
        (walled.geometry.stock, "stock", "#d6aa6e", 0.22),
        *((mesh, name, "#5c7a96", 0.5) for name, mesh in walled.geometry.neighbours.items()),
    ):
        x, y, z = vertices.astype(np.float32).T
        i, j, k = faces.astype(np.int32).T
        out.add_trace(
            go.Mesh3d(
                x=x, y=y, z=z, i=i, j=j, k=k, name=name, color=colour, opacity=opacity, flatshading=False,
                hoverinfo="skip", showlegend=True,
                lighting={"ambient": 0.7, "diffuse": 0.6, "specular": 0.05, "roughness": 1.0},
            )
        )  # fmt: skip
    c = one.columns
    cut = np.flatnonzero(c["force_normal_n"] > 0.0)
    cut = cut[:: max(1, -(-len(cut) // SPACE_POINTS))]
    apart = np.flatnonzero(np.diff(cut) > 1) + 1
    x, y, z = (np.insert(np.asarray(c[f"contact_{a}_mm"])[cut], apart, np.nan).astype(np.float32) for a in "xyz")
    depth = np.insert(np.asarray(c["depth_mm"])[cut], apart, 0.0).astype(np.float32)
    bar = {"title": {"text": "depth [mm]", "side": "right"}, "thickness": 12, "len": 0.8, "outlinewidth": 0}
    out.add_trace(
        go.Scatter3d(
            x=x, y=y, z=z, mode="lines", name="contact points",
            line={"color": depth, "colorscale": SCALE, "width": 5, "showscale": True, "colorbar": bar},
            hovertemplate="(%{x:.2f}, %{y:.2f}, %{z:.2f})<extra></extra>",
        )
    )  # fmt: skip
    axis = {"showbackground": False, "gridcolor": GRID, "zerolinecolor": GRID, "color": "#5f6b7a"}
    out.update_layout(
        template="none",
        height=560,
        font=FONT,
        margin={"l": 0, "r": 0, "t": 30, "b": 0},
        paper_bgcolor="white",
        scene={
            "aspectmode": "data",
            **{f"{a}axis": {**axis, "title": f"{a} [mm]"} for a in "xyz"},
            "camera": {"eye": {"x": 0.9, "y": 1.6, "z": 0.7}},
        },
        legend={"orientation": "h", "y": 1.02, "yanchor": "bottom", "x": 0.0},
    )
    return out


def bars(values: Mapping[str, Mapping[str, float]]) -> go.Figure:
    """Comparison of the variants: {what [unit]: {variant: value}}."""
    out = make_subplots(rows=1, cols=len(values), subplot_titles=list(values), horizontal_spacing=0.07)
    for k, given in enumerate(values.values(), start=1):
        names = list(given)
        out.add_trace(
            go.Bar(
                x=names, y=[given[n] for n in names], marker={"color": [COLOURS[n] for n in names]}, showlegend=False,
                text=[f"{given[n]:.3g}" for n in names], textposition="outside", cliponaxis=False, hoverinfo="skip",
            ),
            row=1, col=k,
        )  # fmt: skip
        out.update_yaxes(range=[0.0, 1.2 * max(max(given.values()), 1e-12)], row=1, col=k)
    out.update_yaxes(gridcolor=GRID, zeroline=False)
    out.update_annotations(font={"size": 12, "color": INK})
    out.update_layout(template="none", height=270, font=FONT, margin={"l": 44, "r": 10, "t": 34, "b": 34})
    return out
