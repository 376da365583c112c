"""The presentation of a fit: coefficients, measured and predicted forces, scene of the cutter, material file."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import plotly.graph_objects as go
from numpy.typing import NDArray
from plotly.subplots import make_subplots

from chipload.cutting.fit import NAMES, predict_forces, predicted_mean
from chipload.cutting.material import material_text
from chipload.jobs.fit.job import CHANNELS
from chipload.jobs.fit.outcome import FitResult
from chipload.jobs.fit.result import MATERIAL, UNITS
from chipload.lazy import trimesh
from chipload.number_text import number_text
from chipload.report.presentation import Content, Presentation
from chipload.report.scene import TOOL
from chipload.report.sheet import definitions, figure, table
from chipload.result.style import FONT, GRID, INK, LIMIT
from chipload.units import mm_min_from_mm_s

Floats = NDArray[np.float64]

COLOURS = ("#0b7a75", "#3457a6", "#c9821a")
SEEN = "#aab2bb"
#: points of a cloud of samples, of a line
CLOUD, LINE = 1200, 360


def presentation_of(done: FitResult) -> Presentation:
    """Return the presentation of a fit."""
    return Presentation(
        lambda figures: sections(done, figures), lambda: scene_bytes(done), lambda result: files_of(done)
    )


def files_of(done: FitResult) -> Mapping[str, Content]:
    """Return the material file, if there is a material."""
    return {} if done.material is None else {MATERIAL: material_text(done.material).encode()}


def scene_bytes(done: FitResult) -> bytes:
    """Return scene.glb: the envelope of the cutter of the measurements."""
    cutter = done.job.cutter
    body = trimesh.creation.cylinder(radius=cutter.radius, height=cutter.overhang, sections=64)
    body.apply_translation([0.0, 0.0, 0.5 * cutter.overhang])
    body.visual.face_colors = TOOL
    scene = trimesh.Scene()
    scene.add_geometry(body, node_name="cutter", geom_name="cutter")
    glb: bytes = scene.export(file_type="glb", extension_webp=False)
    return glb


def sections(done: FitResult, figures: dict[str, go.Figure]) -> list[str]:
    """Return the sections of the report."""
    fit = done.fit
    rows = [
        [name, _text_of(fit.coefficients.values[k], "not identified"), _span(fit.coefficients.interval[k]), unit]
        for k, (name, unit) in enumerate(zip(NAMES, UNITS, strict=True))
    ]
    known: dict[str, str] = {"method": fit.method, "degrees of freedom": str(fit.search.freedom)}
    if fit.method == "instantaneous":
        known["harmonics of the spindle speed that are used"] = str(fit.search.harmonics)
        known["runout"] = f"{number_text(fit.cutter.runout[0] * 1000.0, 3)} µm"
        for key, (w0, zeta) in zip(CHANNELS, fit.channels.resonance, strict=True):
            rings = f"{number_text(w0 / math.tau)} Hz, damping {zeta:.3g}" if math.isfinite(w0) else "taken as rigid"
            known[f"dynamometer, {key}"] = rings
    for key, left, r2 in zip(CHANNELS, fit.channels.residual, fit.channels.r2, strict=True):
        known[f"residual, {key}"] = f"{_text_of(left)} N, R2 {_text_of(r2)}"
    return [
        "<h2>Coefficients</h2>",
        table(["coefficient", "value", "95 % interval", "unit"], rows, numbers=(1, 2)),
        definitions(known),
        "<h2>Measured and predicted</h2>",
        _errors(done),
        '<p class="note">Forces on the cutter. Peaks are means over the turns of the greatest and the least of each '
        "turn, as the dynamometer shows them; the half width is that of the 95 % band of runout and coefficients.</p>",
        "<h3>Mean force against feed</h3>",
        figure("means", _means(done), figures),
        "<h3>Over a turn</h3>",
        '<p class="note">Dots are samples, lines are the model; tooth 0 is at the start of the slot at 0 deg.</p>',
        figure("turn", _turn(done, False), figures),
        "<h3>Residuals</h3>",
        figure("left", _turn(done, True), figures),
    ]


def _text_of(value: float, otherwise: str = "not known") -> str:
    return number_text(value) if math.isfinite(value) else otherwise


def _span(interval: Floats) -> str:
    return f"{number_text(interval[0])} to {number_text(interval[1])}" if np.isfinite(interval).all() else ""


def _errors(done: FitResult) -> str:
    head = ["feed [mm/min]", "use", "channel", "mean, measured [N]", "model [N]", "off [%]"]
    head += ["peaks, measured [N]", "model [N]", "off [%]"]
    rows = []
    for c in done.comparisons:
        feed = f"{mm_min_from_mm_s(c.cut.feed):g}"
        rows += [
            [
                feed,
                c.use,
                CHANNELS[k],
                number_text(c.forces.mean[k]),
                f"{_text_of(c.predicted.mean[k])} &plusmn; {_text_of(c.predicted.half[0, k], '?')}",
                _text_of(c.mean_percent[k]),
                f"{number_text(c.forces.low[k])} to {number_text(c.forces.high[k])}",
                f"{_text_of(c.predicted.low[k])} to {_text_of(c.predicted.high[k])}",
                _text_of(c.peak_percent[k]),
            ]
            for k in np.flatnonzero(c.cut.measured)
        ]
    used = [row[1] == "predict" for row in rows]
    return table(head, rows, numbers=(3, 4, 5, 6, 7, 8), used=used)


def _means(done: FitResult) -> go.Figure:
    """Plot the mean force of each channel against feed per tooth, with the model and its band."""
    out = go.Figure()
    cuts = [c.cut for c in done.comparisons]
    flutes = done.fit.cutter.flutes
    largest = max(cuts, key=lambda c: c.feed_per_tooth(flutes))
    feeds = np.linspace(0.02, 1.1, 40)
    along = [replace(largest, feed=largest.feed * x) for x in feeds]
    x = np.array([c.feed_per_tooth(flutes) for c in along])
    model = np.array([predicted_mean(done.fit, c) for c in along])
    for k in np.flatnonzero(np.any([c.measured for c in cuts], axis=0)):
        mean, half = model[:, :, k].T
        colour = COLOURS[k]
        if np.isfinite(mean).all():
            if np.isfinite(half).all():
                out.add_trace(
                    go.Scatter(
                        x=np.concatenate([x, x[::-1]]), y=np.concatenate([mean + half, (mean - half)[::-1]]),
                        fill="toself", fillcolor=colour, opacity=0.15, line={"width": 0}, hoverinfo="skip",
                        showlegend=False,
                    )
                )  # fmt: skip
            out.add_trace(go.Scatter(x=x, y=mean, name=CHANNELS[k], mode="lines", line={"color": colour, "width": 2}))
        for use, symbol in (("fit", "circle"), ("predict", "circle-open")):
            mine = [c for c in done.comparisons if c.use == use and c.cut.measured[k]]
            out.add_trace(
                go.Scatter(
                    x=[c.cut.feed_per_tooth(flutes) for c in mine], y=[c.forces.mean[k] for c in mine], mode="markers",
                    name=f"{CHANNELS[k]}, measured, {use}", showlegend=bool(mine),
                    marker={"color": colour, "size": 10, "symbol": symbol, "line": {"width": 2}},
                )
            )  # fmt: skip
    out.update_xaxes(title_text="feed per tooth [mm]", rangemode="tozero")
    out.update_yaxes(title_text="mean force on the cutter [N]")
    return _style_figure(out, 380)


def _turn(done: FitResult, left: bool) -> go.Figure:
    """Plot samples and model over a turn, or their difference; a column for each cut, a row for each channel."""
    cuts = done.comparisons
    shown = np.flatnonzero(np.any([c.cut.measured for c in cuts], axis=0))
    titles = [f"{mm_min_from_mm_s(c.cut.feed):g} mm/min, {c.use}" for c in cuts]
    out = make_subplots(
        rows=len(shown), cols=len(cuts), shared_xaxes=True, shared_yaxes="rows", vertical_spacing=0.04,
        horizontal_spacing=0.03, column_titles=titles,
    )  # fmt: skip
    angles = np.linspace(0.0, math.tau, LINE)
    reach = np.full((3, 2), [math.inf, -math.inf])
    for col, c in enumerate(cuts, start=1):
        n = len(c.cut.force)
        some = np.unique(np.linspace(0, n - 1, min(n, CLOUD)).astype(int))
        theta = np.mod(c.turns.speed * some / c.cut.rate + c.phase, math.tau)
        model = predict_forces(done.fit, c.cut, theta if left else angles)
        for row, k in enumerate(shown, start=1):
            y = c.cut.force[some, k] - model[:, k] if left else c.cut.force[some, k]
            both = y if left or not np.isfinite(model[:, k]).all() else np.concatenate([y, model[:, k]])
            if np.isfinite(both).any():
                reach[k] = min(reach[k, 0], np.nanmin(both)), max(reach[k, 1], np.nanmax(both))
            dots = {"color": COLOURS[k] if left else SEEN, "size": 3}
            out.add_trace(
                go.Scatter(
                    x=np.degrees(theta).astype(np.float32), y=y.astype(np.float32), mode="markers", marker=dots,
                    showlegend=False,
                ),
                row=row, col=col,
            )  # fmt: skip
            if not left:
                line = {"color": COLOURS[k], "width": 2.2}
                out.add_trace(
                    go.Scatter(x=np.degrees(angles), y=model[:, k], mode="lines", line=line, showlegend=False),
                    row=row,
                    col=col,
                )
            out.add_hline(y=0.0, line={"color": LIMIT if left else INK, "width": 0.7}, row=row, col=col)
            if col == 1:
                out.update_yaxes(title_text=f"{CHANNELS[k]} [N]", row=row, col=col)
        out.update_xaxes(title_text="rotation of tooth 0 [deg]", row=len(shown), col=col)
    for row, k in enumerate(shown, start=1):
        if np.isfinite(reach[k]).all():
            room = 0.06 * (reach[k, 1] - reach[k, 0])
            out.update_yaxes(range=[reach[k, 0] - room, reach[k, 1] + room], row=row)
    out.update_xaxes(tickvals=[0, 90, 180, 270, 360], range=[0, 360])
    return _style_figure(out, 114 + 190 * len(shown))


def _style_figure(out: go.Figure, height: int) -> go.Figure:
    out.update_layout(
        height=height, font=FONT, plot_bgcolor="white", paper_bgcolor="white",
        margin={"l": 64, "r": 16, "t": 58, "b": 48},
    )  # fmt: skip
    out.update_xaxes(gridcolor=GRID, zeroline=False)
    out.update_yaxes(gridcolor=GRID, zeroline=False)
    return out
