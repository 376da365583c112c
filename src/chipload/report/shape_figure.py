"""The figure of a surface with its values; one that is displaced as designed, and displaced with a magnification."""

from __future__ import annotations

import math

import numpy as np
import plotly.graph_objects as go
from numpy.typing import NDArray

from chipload.number_text import number_text
from chipload.result import COLUMNS, SurfaceMap
from chipload.result.style import FONT, SCALE

#: greatest displacement that is drawn over the size of the part, and the first digits of a magnification
SHARE, DIGITS = 0.1, (5, 2, 1)
#: colours of values below 0, at 0 and above
SIGNED = ((0.0, "#2f5d8a"), (0.5, "#eceff3"), (1.0, "#b5452c"))
DESIGNED = "#8b97a6"
#: an axis without its box
HIDDEN = {"visible": False, "showbackground": False}
#: from where it is seen, in sizes of the part
EYE = {"x": -1.3, "y": -2.1, "z": 1.4}


def magnification(points: NDArray[np.float64], displacement: NDArray[np.float64]) -> float:
    """The greatest 1, 2 or 5 times a power of ten by which a displacement stays below a tenth of the size.

    >>> magnification(np.array([[0.0, 0.0, 0.0], [100.0, 0.0, 0.0]]), np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 0.024]]))
    200.0
    """
    most = float(np.linalg.norm(displacement, axis=1).max(initial=0.0))
    if not most > 0.0:
        return 1.0
    wanted = SHARE * float(np.ptp(points, axis=0).max()) / most
    power = 10.0 ** math.floor(math.log10(wanted))
    return next((d * power for d in DIGITS if d * power <= wanted * (1.0 + 1e-9)), power)


def shape_figure(one: SurfaceMap) -> go.Figure:
    """A map, coloured by its values; with a displacement transparent as designed, and displaced."""
    column = COLUMNS[one.column]
    low, high = _range(one.values)
    most = max(-low, high) or 1.0
    signed = low < 0.0 or one.displacement is not None
    options = {
        "intensity": np.asarray(one.values, dtype=np.float32),
        "colorscale": SIGNED if signed else SCALE,
        "cmin": -most if signed else low,
        "cmax": most if signed else max(high, low + 1e-9 * most),
        "colorbar": {"title": {"text": f"{column.label} [{column.unit}]", "side": "right"}, "thickness": 12},
        "hovertemplate": f"%{{intensity:.3g}} {column.unit}<extra></extra>",
    }
    if one.displacement is None:
        shown = [(one.points, one.name, options)]
    else:
        times = magnification(one.points, one.displacement)
        shown = [
            (one.points, "as designed", {"color": DESIGNED, "opacity": 0.18, "hoverinfo": "skip"}),
            (one.points + times * one.displacement, f"{one.name}, displacement x {times:g}", options),
        ]
    i, j, k = one.faces.astype(np.int32).T
    light = {"ambient": 0.75, "diffuse": 0.5, "specular": 0.05, "roughness": 1.0}
    out = go.Figure()
    for place, name, own in shown:
        x, y, z = place.astype(np.float32).T
        mesh = go.Mesh3d(
            x=x, y=y, z=z, i=i, j=j, k=k, name=name, flatshading=True, showlegend=True, lighting=light, **own
        )
        out.add_trace(mesh)
    out.update_layout(
        template="none", height=520, font=FONT, paper_bgcolor="white", margin={"l": 0, "r": 0, "t": 30, "b": 0},
        legend={"orientation": "h", "x": 0.0, "y": 1.06}, showlegend=len(shown) > 1,
        scene={"aspectmode": "data", "camera": {"eye": EYE}, "xaxis": HIDDEN, "yaxis": HIDDEN, "zaxis": HIDDEN},
    )  # fmt: skip
    return out


def shape_note(one: SurfaceMap) -> str:
    """What the figure of a map shows, in a sentence."""
    if one.displacement is None:
        low, high = _range(one.values)
        return f"{one.name}: {number_text(low, 3)} to {number_text(high, 3)} {COLUMNS[one.column].unit}."
    most = 1e3 * float(np.linalg.norm(one.displacement, axis=1).max(initial=0.0))
    times = magnification(one.points, one.displacement)
    return f"The greatest displacement is {number_text(most, 3)} \u00b5m; it is drawn {times:g} times as large."


def _range(values: NDArray[np.float64]) -> tuple[float, float]:
    """The least and the greatest value that is known; 0 where none is."""
    known = values[np.isfinite(values)]
    return (float(known.min()), float(known.max())) if len(known) else (0.0, 0.0)
