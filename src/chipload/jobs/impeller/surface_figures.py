"""Figures of an impeller's surfaces in plotly: the largest diameter over a surface and by table angle, pallet angles.

Notation: alpha table angle, B pallet angle [deg]; u along, v up the surface as in ``planning/impeller/surfaces.py``.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import plotly.graph_objects as go
from numpy.typing import NDArray

from chipload.cutter.catalogue import CatalogueCutter
from chipload.jobs.impeller.mesh import grid_faces, surface_mesh
from chipload.jobs.impeller.outcome import Searched
from chipload.planning.impeller.closed_form import axis_at
from chipload.result.style import FONT, GRID, INK, LIMIT, SCALE

Floats = NDArray[np.float64]

#: colours of corner radii, of table angles
LINES = ("#0b7a75", "#c9821a", "#3457a6", "#8a4f9e", "#5b8c2a", "#a8793a")
#: cells of a map that still have room for their number
WRITTEN = 420
#: check points round a channel that a view in space shows at most
SHOWN = 6000


def map_figure(op: Searched) -> go.Figure:
    """Largest diameter over the surface, unrolled: one cell for each contact point."""
    a, b = op.surface.shape
    answer, s = op.answer, op.surface
    d = answer.diameter.reshape(a, b).T
    missed = d == 0.0
    cutters = [*answer.catalogue.cutters, None]
    hover = [
        _hover(op, k, cutters[answer.cutter[k]] if answer.cutter[k] >= 0 else None) for k in range(len(answer.cutter))
    ]
    out = go.Figure(
        go.Heatmap(
            x=s.u.round(4), y=s.v.round(4), z=np.where(missed, np.nan, d), colorscale=SCALE, xgap=1, ygap=1,
            text=np.array(hover, dtype=object).reshape(a, b).T, hovertemplate="%{text}<extra></extra>",
            texttemplate="%{z}" if a * b <= WRITTEN else None, textfont={"size": 10},
            colorbar={"title": {"text": "D [mm]", "side": "right"}, "thickness": 12, "outlinewidth": 0},
        )
    )  # fmt: skip
    if missed.any():
        j, i = np.nonzero(missed)
        out.add_trace(
            go.Scatter(
                x=s.u[i].round(4), y=s.v[j].round(4), mode="markers", name="not reached",
                marker={"symbol": "x", "size": 10, "color": LIMIT}, hoverinfo="skip", showlegend=True,
            )
        )  # fmt: skip
    style_figure(out, 340)
    out.update_xaxes(title="u, from the leading to the trailing edge", range=None, zeroline=False)
    across = "v, across the channel from the plus side" if op.surface.side == "floor" else "v, from hub to shroud"
    out.update_yaxes(title=across, zeroline=False)
    return out


def table_figure(op: Searched) -> go.Figure:
    """One cutter for the whole surface by table angle: the proved limit, and the size of the catalogue below it."""
    out = go.Figure()
    for n, r in enumerate(sorted({x.corner_radius for x in op.limiting})):
        rows = [x for x in op.limiting if x.corner_radius == r]
        alpha = [float(np.degrees(op.table.angle[x.table])) for x in rows]
        colour = LINES[n % len(LINES)]
        for name, values, dash, mode in (
            (f"r {r:g}: proved limit", [x.most for x in rows], "dash", "lines+markers"),
            (f"r {r:g}: catalogue", [x.size for x in rows], "solid", "lines+markers"),
        ):
            out.add_trace(
                go.Scatter(
                    x=alpha, y=values, mode=mode, name=name, connectgaps=False,
                    line={"color": colour, "dash": dash, "width": 1.6, "shape": "linear"},
                    marker={"size": 6, "symbol": "line-ew-open" if dash == "dash" else "circle", "color": colour},
                    hovertemplate="%{x:.6g} deg: D %{y:.3f} mm<extra></extra>",
                )
            )  # fmt: skip
    if op.one is not None:
        x = float(np.degrees(op.table.angle[op.one.table]))
        out.add_trace(
            go.Scatter(
                x=[x], y=[op.one.cutter.diameter], mode="markers", name="taken",
                marker={"symbol": "circle-open", "size": 16, "color": INK, "line": {"width": 2, "color": INK}},
            )
        )  # fmt: skip
    style_figure(out, 320)
    out.update_xaxes(title="table angle [deg]")
    out.update_yaxes(title="one cutter for all, D [mm]", rangemode="tozero")
    return out


def ranges_figure(op: Searched) -> go.Figure:
    """Pallet angles: of the one cutter at its table angle, else of each contact point's own largest cutter."""
    out = go.Figure()
    one = op.one
    points = one.points if one is not None else np.flatnonzero(op.answer.cutter >= 0)
    ranges = one.ranges if one is not None else [op.answer.ranges[k] for k in points]
    b = op.surface.shape[1]
    v = points % b
    for n in np.unique(v).tolist():
        x: list[float | None] = []
        y: list[float | None] = []
        label: list[str] = []
        for k, rows in zip(points.tolist(), ranges, strict=True):
            if k % b != n:
                continue
            for low, high in np.degrees(rows):
                at = k // b + 0.7 * (n / max(b - 1, 1) - 0.5)
                x += [at, at, None]
                y += [float(low), float(high), None]
                label += [f"contact point {k}: {low:.2f} to {high:.2f} deg"] * 3
        share = n / max(b - 1, 1)
        colour = f"rgb({int(48 + 140 * share)},{int(60 + 110 * share)},{int(120 + 40 * share)})"
        out.add_trace(
            go.Scatter(
                x=x, y=y, mode="lines", text=label, hovertemplate="%{text}<extra></extra>",
                name=f"v {op.surface.v[n]:.2f}", line={"color": colour, "width": 3},
            )
        )  # fmt: skip
    style_figure(out, 380)
    ticks = np.unique(np.linspace(0, len(op.surface.u) - 1, 10).round().astype(int))
    out.update_xaxes(
        title="u of the contact points; beside one another those of one u, from hub to shroud",
        tickvals=ticks.tolist(), ticktext=[f"{op.surface.u[i]:.2f}" for i in ticks],
    )  # fmt: skip
    out.update_yaxes(title="pallet angle B [deg]")
    return out


def space_figure(op: Searched) -> go.Figure:
    """The surface coloured by its largest diameter, what is round it, and the cutter where it is tightest."""
    s, answer = op.surface.scene, op.answer
    out = go.Figure()
    keep = np.arange(0, len(s.check), max(1, -(-len(s.check) // SHOWN)))
    p = s.check[keep].astype(np.float32)
    dots = {"size": 1.4, "color": "#8d97a3"}
    out.add_trace(_points(p, dots, "check points"))
    points, faces = surface_mesh(op)
    d = np.where(answer.cutter >= 0, answer.diameter, np.nan)
    out.add_trace(
        go.Mesh3d(
            **_xyz(points), **_ijk(faces), intensity=np.nan_to_num(d).astype(np.float32), colorscale=SCALE,
            colorbar={"title": {"text": "D [mm]", "side": "right"}, "thickness": 12}, name="largest diameter",
            flatshading=True, hovertemplate="D %{intensity:g} mm<extra></extra>", showlegend=False,
            lighting={"ambient": 0.75, "diffuse": 0.5, "specular": 0.05},
        )
    )  # fmt: skip
    if (answer.cutter < 0).any():
        missed = op.place[answer.cutter < 0].astype(np.float32)
        out.add_trace(_points(missed, {"size": 5, "symbol": "x", "color": LIMIT}, "not reached"))
    tight = tightest(op)
    if tight is not None:
        k, cutter, table, pallet, who = tight
        T = axis_at(op.table.angle[table], pallet)
        mesh, tris = cutter_mesh(cutter, op.place[k], s.normal[k], T)
        out.add_trace(
            go.Mesh3d(
                **_xyz(mesh), **_ijk(tris), color="#b9c2cc", opacity=0.55, hoverinfo="skip", showlegend=True,
                name=f"{cutter.label} at contact point {k}",
            )
        )  # fmt: skip
        at = s.check[[i for i in who if i >= 0]].astype(np.float32)
        if len(at):
            out.add_trace(_points(at, {"size": 5, "color": LIMIT}, "check points that stop a larger one"))
    camera = {"eye": {"x": 1.3, "y": -1.3, "z": 1.1}}
    axes = {f"{x}axis": {"title": f"{x.upper()} [mm]", "gridcolor": GRID} for x in "xyz"}
    out.update_layout(
        template="none", height=560, font=FONT, scene={"aspectmode": "data", "camera": camera, **axes},
        margin={"l": 0, "r": 0, "t": 10, "b": 0}, showlegend=True, legend={"x": 0.0, "y": 1.0},
    )  # fmt: skip
    return out


def tightest(op: Searched) -> tuple[int, CatalogueCutter, int, float, tuple[int, ...]] | None:
    """Contact point where the one cutter has least room, the cutter, its table angle, its pallet angle, and the limit
    of a larger one.
    """
    one = op.one
    if one is None:
        return None
    x = next(x for x in op.limiting if (x.corner_radius, x.table) == (one.cutter.corner_radius, one.table))
    rows = one.ranges[int(np.flatnonzero(one.points == x.point)[0])]
    widest = rows[(rows[:, 1] - rows[:, 0]).argmax()]
    return x.point, one.cutter, one.table, float(widest.mean()), x.blockers


def cutter_mesh(
    cutter: CatalogueCutter, contact: Floats, normal: Floats, axis: Floats, sides: int = 48
) -> tuple[Floats, NDArray[np.int64]]:
    """Vertices (n, 3) [mm] and triangles of a cutter that touches a surface; parts without end are drawn 80 mm long."""
    r, rho = cutter.corner_radius, cutter.rho
    t = np.linspace(-0.5 * math.pi, 0.0, 9)
    profile = [(0.0, -r), *zip(rho + r * np.cos(t), r * np.sin(t), strict=True)]
    stages = cutter.enclosing(0.0) if cutter.barrel_radius is None else cutter.stages(0.0)
    for k, (low, radius) in enumerate(stages):
        high = stages[k + 1, 0] if k + 1 < len(stages) else max(80.0, low + 25.0)
        profile += [(radius, max(low, 0.0)), (radius, high)]
    profile.append((0.0, profile[-1][1]))
    q = np.array(profile)
    n = float(normal @ axis)
    V = (normal - n * axis) / math.sqrt(1.0 - n * n)
    W = np.cross(axis, V)
    centre = contact + r * normal + rho * V
    phi = np.linspace(0.0, 2.0 * math.pi, sides + 1)
    round_ = np.cos(phi)[:, None] * V + np.sin(phi)[:, None] * W
    points = centre + q[:, 0][:, None, None] * round_ + q[:, 1][:, None, None] * axis
    return points.reshape(-1, 3), grid_faces(len(q), sides + 1)


# -- parts ------------------------------------------------------------------------------------------------------
def _hover(op: Searched, k: int, cutter: CatalogueCutter | None) -> str:
    x, y, z = op.place[k]
    at = f"contact point {k} ({x:.1f}, {y:.1f}, {z:.1f})"
    if cutter is None:
        return f"{at}<br>not reached"
    alpha, wide = np.degrees(op.table.angle[op.answer.table[k]]), np.degrees(op.answer.ranges[k])
    spans = ", ".join(f"{low:.1f} to {high:.1f}" for low, high in wide[:3])
    return f"{at}<br>{cutter.label} at {alpha:.4g} deg<br>B {spans} deg"


def _points(p: NDArray[np.float32], marker: dict[str, Any], name: str) -> go.Scatter3d:
    return go.Scatter3d(x=p[:, 0], y=p[:, 1], z=p[:, 2], mode="markers", marker=marker, name=name, hoverinfo="skip")


def _xyz(p: Floats) -> dict[str, Any]:
    q = p.astype(np.float32)
    return {"x": q[:, 0], "y": q[:, 1], "z": q[:, 2]}


def _ijk(f: NDArray[np.int64]) -> dict[str, Any]:
    return {"i": f[:, 0].astype(np.int32), "j": f[:, 1].astype(np.int32), "k": f[:, 2].astype(np.int32)}


def style_figure(figure: go.Figure, height: int) -> None:
    """Give a figure a white background and a thin grid."""
    figure.update_layout(
        template="none", height=height, margin={"l": 70, "r": 20, "t": 14, "b": 54}, font=FONT, paper_bgcolor="white",
        plot_bgcolor="white",
    )  # fmt: skip
    figure.update_xaxes(gridcolor=GRID, zeroline=False, linecolor="#9aa3ad", ticks="outside", tickcolor="#9aa3ad")
    figure.update_yaxes(gridcolor=GRID, zeroline=False, linecolor="#9aa3ad", ticks="outside", tickcolor="#9aa3ad")
