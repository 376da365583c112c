"""Allowable, planned and true torque on the unrolled wall, with the places of the surprises.

Notation: theta [deg] angle round the wall, counter-clockwise from +X, 0 to 360; z [mm] along it.
"""

from __future__ import annotations

import numpy as np
import plotly.graph_objects as go
from numpy.typing import NDArray
from plotly.subplots import make_subplots

from chipload.jobs.torque.outcome import HELD, TorqueResult
from chipload.result.style import FONT, GRID, LIMIT, SCALE

Floats = NDArray[np.float64]

#: places of the path that are drawn
PLACES = 2500


def unrolled_torques(outcome: TorqueResult) -> go.Figure:
    """The torques of :func:`torques` at each place of the wall, in one scale, with the angles of the surprises."""
    values = torques(outcome)
    rows = np.unique(np.linspace(0, len(values["allowable"]) - 1, min(len(values["allowable"]), PLACES)).astype(int))
    path = outcome.allowable.path
    theta, z = angles_and_heights(path.points[rows])
    most = max(float(v[rows].max(initial=0.0)) for v in values.values())
    figure = make_subplots(
        rows=len(values), cols=1, shared_xaxes=True, vertical_spacing=0.06, subplot_titles=tuple(values)
    )
    for row, (name, value) in enumerate(values.items(), start=1):
        bar = {"title": "N m", "thickness": 12} if row == 1 else None
        marker = {"size": 5, "color": value[rows], "colorscale": SCALE, "cmin": 0.0, "cmax": most, "colorbar": bar}
        figure.add_trace(
            go.Scattergl(
                x=theta, y=z, mode="markers", name=name, showlegend=False, marker=marker,
                hovertemplate=f"{name}: %{{marker.color:.4g}} N m at %{{x:.0f}} deg, z %{{y:.4g}} mm<extra></extra>",
            ),
            row=row, col=1,
        )  # fmt: skip
        for at, what in outcome.job.surprise_angles:
            label = {"text": what, "font": {"color": LIMIT, "size": 11}} if row == 1 else None
            line = {"color": LIMIT, "width": 1.3, "dash": "dash"}
            figure.add_vline(x=at % 360.0, line=line, annotation=label, row=row, col=1)
        figure.update_yaxes(title_text="z [mm]", gridcolor=GRID, zeroline=False, row=row, col=1)
    figure.update_xaxes(range=[0.0, 360.0], dtick=45, gridcolor=GRID, zeroline=False)
    figure.update_xaxes(title_text="round the wall from +X [deg]", row=len(values), col=1)
    figure.update_layout(
        template="none", height=220 * len(values) + 80, font=FONT, margin={"l": 70, "r": 20, "t": 46, "b": 50}
    )
    return figure


def torques(outcome: TorqueResult) -> dict[str, Floats]:
    """Torques at the points of the path, (n,) [N m]: allowable, planned and true at the programmed feed, and held."""
    path = outcome.allowable.path
    out = {
        "allowable": 1e-3 * outcome.allowable.torque * path.relief,
        "planned, at the programmed feed": 1e-3 * path.model.torque(1.0),
        "true, at the programmed feed": 1e-3 * path.truth.torque(1.0),
    }
    if outcome.control.cases:
        controlled = outcome.control.cases[-1].runs[HELD].outcome
        out["true, under the controller"] = 1e-3 * np.interp(path.model.s, controlled.s, controlled.torque)
    return out


def angles_and_heights(points: Floats) -> tuple[Floats, Floats]:
    """Angle [deg], 0 to 360, and height [mm] of points (n, 3).

    >>> theta, z = angles_and_heights(np.array([[0.0, -20.0, -3.0], [-20.0, 0.0, -5.0]]))
    >>> theta.tolist(), z.tolist()
    ([270.0, 180.0], [-3.0, -5.0])
    """
    return np.degrees(np.arctan2(points[:, 1], points[:, 0])) % 360.0, points[:, 2]
