"""The diagram of the boundary of a chip and the chip, with equal colours for equal pieces.

Notation: theta [deg] around the section of the cutter across, t from the start to the end of the move up; shaded where
the edge of the section moves outward.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import plotly.graph_objects as go
import shapely
from numpy.typing import NDArray
from plotly.subplots import make_subplots

from chipload.cutter.cutter import Cutter
from chipload.engagement.chips.chips import chips
from chipload.engagement.chips.covered import CoveredArea
from chipload.engagement.chips.diagram import diagram
from chipload.engagement.chips.move import Move
from chipload.engagement.chips.ring import Origin, Ring
from chipload.errors import InputError
from chipload.result.style import FONT, GRID, INK, STOCK

Floats = NDArray[np.float64]

PIECES = {
    Origin.FIRST: ("first section, leaving edge", "#3457a6"),
    Origin.LAST: ("last section, advancing edge", "#b3261e"),
    Origin.GRAZING: ("grazing points", "#0b7a75"),
    Origin.CHORD: ("envelope of the chord", "#7b3fa0"),
    Origin.CHORD_END: ("track of a chord's end", "#c9821a"),
    Origin.FIRST_CHORD: ("first chord", "#7f9bd6"),
    Origin.LAST_CHORD: ("last chord", "#e0837d"),
    Origin.STOCK: ("stock", STOCK),
}
CHIP, OUTWARD, FAINT = "rgba(251,182,26,0.30)", "rgba(34,168,132,0.10)", "#b8bec6"


def diagram_figure(
    move: Move,
    cutter: Cutter,
    height: float,
    stock_polygon: shapely.Polygon | shapely.MultiPolygon | None = None,
    title: str = "",
    before: CoveredArea | shapely.Polygon | shapely.MultiPolygon | None = None,
    tolerance: float = 1e-3,
) -> go.Figure:
    """The diagram of a move on a layer (left) and what it covers, or its chip (right).

    Parameters
    ----------
    height : h of the layer [mm]
    stock_polygon : section of the stock; None: all of the covered area is shown
    before : what was covered before, taken off the chip
    tolerance : of the polygons [mm]

    Raises
    ------
    InputError
        The layer isn't cut.
    """
    made = diagram(move, cutter, height, tolerance)
    if made.covered is None:
        raise InputError(
            f"diagram: height = {height:g} mm: the cutter is never in this layer: choose a layer that it cuts"
        )
    figure = make_subplots(rows=1, cols=2, column_widths=[0.5, 0.5], horizontal_spacing=0.09)
    outward = np.where(np.isnan(made.V), np.nan, (made.V > 0.0).astype(np.float64))
    shade = [[0.0, "rgba(255,255,255,0)"], [1.0, OUTWARD]]
    figure.add_trace(
        go.Heatmap(
            x=np.degrees(made.theta), y=made.t, z=outward, zmin=0.0, zmax=1.0, colorscale=shade, showscale=False,
            hoverinfo="skip",
        ),
        row=1,
        col=1,
    )  # fmt: skip
    faint: dict[str, Any] = {"mode": "lines", "line": {"color": FAINT, "width": 1.2}, "legendgroup": "other"}
    square = {"symbol": "square", "size": 12, "color": "rgba(34,168,132,0.25)"}
    figure.add_trace(go.Scatter(x=[None], y=[None], mode="markers", marker=square, name="edge moves outward"), 1, 1)
    e = made.edges
    x, y = _segments(np.degrees(e[:, 4]), e[:, 5], np.degrees(e[:, 6]), e[:, 7], True)
    figure.add_trace(go.Scatter(x=x, y=y, name="inside, no boundary", hoverinfo="skip", **faint), row=1, col=1)
    x, y = _segments(*e[:, :4].T)
    figure.add_trace(go.Scatter(x=x, y=y, showlegend=False, hoverinfo="skip", **faint), row=1, col=2)
    if len(made.corners):
        dots = {"size": 2, "color": FAINT}
        figure.add_trace(
            go.Scatter(
                x=np.degrees(made.corners[:, 0]), y=made.corners[:, 1], mode="markers", marker=dots,
                name="corners of the section", hoverinfo="skip",
            ),
            row=1,
            col=1,
        )  # fmt: skip
    rings = list(made.covered.rings)
    if stock_polygon is not None:
        found = chips(made.covered, stock_polygon, before)
        for polygon in shapely.get_parts(stock_polygon):
            if polygon.geom_type != "Polygon":  # where the cutter's surroundings only touch the stock
                continue
            line = {"color": STOCK, "width": 1.2, "dash": "dot"}
            _outline(figure, shapely.get_coordinates(polygon.exterior), "stock", line, None)
        for chip in found:
            _outline(figure, _close_rings(chip.rings), "chip", {"width": 0, "color": CHIP}, CHIP)
        shown = [ring for chip in found for ring in chip.rings]
    else:
        _outline(figure, _close_rings(made.covered.rings), "covered", {"width": 0, "color": CHIP}, CHIP)
        shown = rings
    _edges(figure, rings, 1)
    _edges(figure, shown, 2)
    return _style_figure(figure, title)


def _edges(figure: go.Figure, rings: list[Ring], col: int) -> None:
    """Edges of rings in the colours of their origins: in the diagram (col 1) or on the layer (col 2)."""
    for origin, (name, colour) in PIECES.items():
        xs, ys = [], []
        for ring in rings:
            of = ring.origin == origin
            if col == 1:
                a, b = np.degrees(ring.theta[of]), np.degrees(ring.end[of, 0])
                x, y = _segments(a, ring.t[of], b, ring.end[of, 1], True)
            else:
                q = np.roll(ring.points, -1, axis=0)
                x, y = _segments(ring.points[of, 0], ring.points[of, 1], q[of, 0], q[of, 1])
            xs.append(x)
            ys.append(y)
        x, y = np.concatenate(xs), np.concatenate(ys)
        if len(x) == 0 or (col == 1 and origin == Origin.STOCK):
            continue
        first = all(trace.name != name for trace in figure.data)
        figure.add_trace(
            go.Scatter(
                x=x, y=y, mode="lines", name=name, legendgroup=name, showlegend=first,
                line={"color": colour, "width": 3},
                hovertemplate=f"{name}<extra></extra>", cliponaxis=False,
            ),
            row=1,
            col=col,
        )  # fmt: skip


def _segments(x0: Floats, y0: Floats, x1: Floats, y1: Floats, angles: bool = False) -> tuple[Floats, Floats]:
    """Segments as one line with gaps; angles [deg] are brought to 0 .. 360 and cut where they pass it."""
    if angles:
        x0 = x0 % 360.0
        x1 = x0 + (x1 - x0 + 180.0) % 360.0 - 180.0
        x1 = np.clip(x1, 0.0, 360.0)
    gap = np.full(len(x0), np.nan)
    return np.column_stack([x0, x1, gap]).ravel(), np.column_stack([y0, y1, gap]).ravel()


def _close_rings(rings: tuple[Ring, ...]) -> Floats:
    """All rings as one line, each closed, gaps between."""
    parts = [np.vstack([ring.points, ring.points[:1], [[np.nan, np.nan]]]) for ring in rings]
    return np.vstack(parts)[:-1]


def _outline(figure: go.Figure, p: Floats, name: str, line: dict[str, Any], fill: str | None) -> None:
    first = all(trace.name != name for trace in figure.data)
    style = {"fill": "toself", "fillcolor": fill} if fill else {}
    figure.add_trace(
        go.Scatter(
            x=p[:, 0], y=p[:, 1], mode="lines", name=name, legendgroup=name, showlegend=first, line=line,
            hoverinfo="skip", **style,
        ),
        row=1,
        col=2,
    )  # fmt: skip


def _style_figure(figure: go.Figure, title: str) -> go.Figure:
    axis = {"gridcolor": GRID, "zeroline": False, "linecolor": INK, "showline": True, "ticks": "outside"}
    figure.update_xaxes(**axis)
    figure.update_yaxes(**axis)
    figure.update_xaxes(title_text="theta [deg]", range=[0, 360], dtick=60, row=1, col=1)
    figure.update_yaxes(title_text="t", range=[-0.02, 1.02], row=1, col=1)
    figure.update_xaxes(title_text="x [mm]", row=1, col=2)
    figure.update_yaxes(title_text="y [mm]", scaleanchor="x2", scaleratio=1, row=1, col=2)
    figure.update_layout(
        title={"text": title, "x": 0.0, "xanchor": "left", "font": {"size": 14}} if title else None,
        font=FONT,
        template="plotly_white",
        height=560,
        margin={"l": 60, "r": 16, "t": 56 if title else 24, "b": 100},
        legend={"orientation": "h", "y": -0.14, "yanchor": "top", "x": 0.0},
    )
    return figure
