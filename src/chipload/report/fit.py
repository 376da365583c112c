"""The result of a fit of force coefficients: material, numbers, and a page with what was measured beside what the model
says: over a turn, what is left, and means against feed.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import replace
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import plotly.graph_objects as go
from numpy.typing import NDArray
from plotly.subplots import make_subplots

from chipload.cutting.fit import NAMES, predicted, predicted_mean
from chipload.cutting.fit_job import CHANNELS, Comparison, Fitted, material_text
from chipload.report import folder
from chipload.report.figures import FONT, GRID, INK, LIMIT
from chipload.report.sheet import definitions, figure, framed, heading, items, table
from chipload.units import mm_min_from_mm_s, rpm_from_rad_s

Floats = NDArray[np.float64]

#: files of a result
MATERIAL, SUMMARY, PAGE = "material.toml", "summary.json", "report.html"
UNITS = ("MPa", "MPa", "MPa", "N/mm", "N/mm", "N/mm")
COLOURS = ("#0b7a75", "#3457a6", "#c9821a")
SEEN = "#aab2bb"
#: points of a cloud of samples, of a line
CLOUD, LINE = 1200, 360
#: what a summary of ours says of itself
KIND = "fit"


def verdict(done: Fitted) -> tuple[bool, str]:
    """Whether the fit holds, and one sentence."""
    if done.failures:
        more = f"; and {len(done.failures) - 1} more" if len(done.failures) > 1 else ""
        return False, f"{done.failures[0]}{more}"
    ktc, krc = done.fit.values[:2]
    off = [c for c in done.comparisons if c.use == "predict"]
    says = f"Ktc {ktc:.4g} MPa, Krc {krc:.4g} MPa"
    if off:
        worst = np.nanmax([np.nanmax(np.abs(c.mean_percent)) for c in off])
        says += f"; predicted means are off by {worst:.3g} % at most"
    return True, says


def check_fit_target(out: str | Path) -> Path:
    """The absolute target folder, if a fit may be put there.

    Raises
    ------
    InputError
        It holds something else than a fit, or nothing can be written there.
    """
    return folder.check_target(out, _ours, "fit")


def write_fit(done: Fitted, out: str | Path) -> Path:
    """Write the whole result folder and return it; an older fit there is replaced when the new one stands.

    Raises
    ------
    InputError
        The folder cannot be written; nothing is left behind.
    """
    files = {SUMMARY: lambda: summary_bytes(done), PAGE: lambda: page_bytes(done)}
    material = done.material
    if material is not None:
        files[MATERIAL] = lambda: material_text(material).encode()
    return folder.write_files(list(files.items()), out, ours=_ours, what="fit")


def _ours(target: Path) -> bool:
    """Whether a folder holds a fit and nothing else."""
    try:
        said = json.loads((target / SUMMARY).read_bytes())
    except (OSError, ValueError):
        return False
    names = {p.name for p in target.iterdir()}
    return isinstance(said, dict) and said.get("kind") == KIND and names <= {MATERIAL, SUMMARY, PAGE}


# -- numbers ----------------------------------------------------------------------------------------------------
def summary(done: Fitted) -> dict[str, Any]:
    """The numbers of the page as JSON values; what is not known is null."""
    fit = done.fit
    holds, says = verdict(done)
    size, direction = fit.cutter.runout
    return {
        "kind": KIND,
        "holds": holds,
        "says": says,
        "failures": list(done.failures),
        "material": done.job.table.name,
        "method": fit.method,
        "coefficients": {
            f"{name.lower()}_{unit.lower().replace('/', '_')}": {
                "value": _number(fit.values[k]),
                "identified": bool(fit.identified[k]),
                "low_95": _number(fit.interval[k, 0]),
                "high_95": _number(fit.interval[k, 1]),
                "sd": _number(math.sqrt(fit.covariance[k, k]) if fit.covariance[k, k] >= 0.0 else math.nan),
            }
            for k, (name, unit) in enumerate(zip(NAMES, UNITS, strict=True))
        },
        "covariance": [[_number(v) for v in row] for row in fit.covariance],
        "degrees_of_freedom": fit.freedom,
        "harmonics": fit.harmonics,
        "runout_mm": _number(size),
        "runout_deg": _number(math.degrees(direction)) if fit.cutter.flutes > 2 else None,
        "residual_sd_n": _named(fit.residual),
        "r2": _named(fit.r2),
        "dynamometer_hz": _named(fit.resonance[:, 0] / math.tau),
        "dynamometer_damping": _named(fit.resonance[:, 1]),
        "measurements": [_measurement(c) for c in done.comparisons],
        "notes": list(done.notes),
        "findings": [f"{f.text} ({f.code})" for f in done.job.findings],
        "provenance": {**done.job.provenance, "chipload": version("chipload"), "source": done.job.table.source},
    }


def summary_bytes(done: Fitted) -> bytes:
    """summary.json."""
    return (json.dumps(summary(done), indent=2, ensure_ascii=False, allow_nan=False) + "\n").encode()


def _measurement(c: Comparison) -> dict[str, Any]:
    said = c.said
    rows = {
        "mean": (c.mean, said.mean, said.half[0]),
        "high": (c.high, said.high, said.half[1]),
        "low": (c.low, said.low, said.half[2]),
        "band_high": (c.band_high, said.band_high, said.half[3]),
        "band_low": (c.band_low, said.band_low, said.half[4]),
    }
    return {
        "file": c.cut.name,
        "use": c.use,
        "feed_mm_min": mm_min_from_mm_s(c.cut.feed),
        "speed_rpm": rpm_from_rad_s(c.turns.speed),
        "turns": len(c.turns.mean),
        "scatter_n": _named(c.turns.scatter),
        **{
            f"{key}_n": {"measured": _named(seen), "model": _named(says), "half_95": _named(half)}
            for key, (seen, says, half) in rows.items()
        },
        "plane_max_n": {"measured": _number(c.plane), "model": _number(said.resultant)},
        "mean_error_percent": _named(c.mean_percent),
        "peak_error_percent": _named(c.peak_percent),
    }


def _number(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None


def _named(values: Floats) -> dict[str, float | None]:
    return {key: _number(v) for key, v in zip(CHANNELS, values, strict=True)}


# -- page -------------------------------------------------------------------------------------------------------
def page_bytes(done: Fitted) -> bytes:
    """report.html."""
    holds, says = verdict(done)
    fit, title = done.fit, f"coefficients of {done.job.table.name}"
    figures: dict[str, go.Figure] = {}
    body = heading(title, holds, "Fitted" if holds else "Does not hold", says)
    if done.failures:
        body += ["<h3>What does not hold</h3>", items(done.failures)]
    rows = [
        [name, _said(fit.values[k], "not identified"), _span(fit.interval[k]), unit]
        for k, (name, unit) in enumerate(zip(NAMES, UNITS, strict=True))
    ]
    known: dict[str, str] = {"method": fit.method, "degrees of freedom": str(fit.freedom)}
    if fit.method == "instantaneous":
        known["harmonics of the spindle that count"] = str(fit.harmonics)
        known["runout"] = f"{fit.cutter.runout[0] * 1000.0:.3g} um"
        for key, (w0, zeta) in zip(CHANNELS, fit.resonance, strict=True):
            rings = f"{w0 / math.tau:.4g} Hz, damping {zeta:.3g}" if math.isfinite(w0) else "taken as rigid"
            known[f"dynamometer, {key}"] = rings
    for key, left, r2 in zip(CHANNELS, fit.residual, fit.r2, strict=True):
        known[f"left over, {key}"] = f"{_said(left)} N, R2 {_said(r2)}"
    body += [
        "<h2>Coefficients</h2>",
        table(["coefficient", "value", "95 % interval", "unit"], rows, numbers=(1, 2)),
        definitions(known),
        items(done.notes),
        "<h2>Measured and predicted</h2>",
        _errors(done),
        '<p class="note">Forces on the cutter. Peaks are means over the turns of the greatest and the least of each '
        "turn, as the dynamometer shows them; the half width is that of the 95 % band of runout and coefficients.</p>",
        "<h3>Mean force against feed</h3>",
        figure("means", _means(done), figures),
        "<h3>Over a turn</h3>",
        '<p class="note">Dots are samples, lines are the model; tooth 0 is at the start of the slot at 0 deg.</p>',
        figure("turn", _turn(done, False), figures),
        "<h3>What is left</h3>",
        figure("left", _turn(done, True), figures),
    ]
    if done.job.findings:
        body += ["<h2>Findings</h2>", items(f"{f.text} ({f.code})" for f in done.job.findings)]
    provenance: Mapping[str, Any] = summary(done)["provenance"]
    body += ["<h2>Where the numbers come from</h2>", definitions(provenance)]
    return framed(title, "fitted" if holds else "does not hold", body, figures)


def _said(value: float, otherwise: str = "not known") -> str:
    return f"{value:.4g}" if math.isfinite(value) else otherwise


def _span(interval: Floats) -> str:
    return f"{interval[0]:.4g} to {interval[1]:.4g}" if np.isfinite(interval).all() else ""


def _errors(done: Fitted) -> str:
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
                f"{c.mean[k]:.4g}",
                f"{_said(c.said.mean[k])} &plusmn; {_said(c.said.half[0, k], '?')}",
                _said(c.mean_percent[k]),
                f"{c.low[k]:.4g} to {c.high[k]:.4g}",
                f"{_said(c.said.low[k])} to {_said(c.said.high[k])}",
                _said(c.peak_percent[k]),
            ]
            for k in np.flatnonzero(c.cut.measured)
        ]
    used = [row[1] == "predict" for row in rows]
    return table(head, rows, numbers=(3, 4, 5, 6, 7, 8), used=used)


def _means(done: Fitted) -> go.Figure:
    """Mean force of each channel against feed per tooth, with the model and its band."""
    out = go.Figure()
    cuts = [c.cut for c in done.comparisons]
    flutes = done.fit.cutter.flutes
    largest = max(cuts, key=lambda c: c.feed_per_tooth(flutes))
    feeds = np.linspace(0.02, 1.1, 40)
    along = [replace(largest, feed=largest.feed * x) for x in feeds]
    x = np.array([c.feed_per_tooth(flutes) for c in along])
    said = np.array([predicted_mean(done.fit, c) for c in along])
    for k in np.flatnonzero(np.any([c.measured for c in cuts], axis=0)):
        mean, half = said[:, :, k].T
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
                    x=[c.cut.feed_per_tooth(flutes) for c in mine], y=[c.mean[k] for c in mine], mode="markers",
                    name=f"{CHANNELS[k]}, measured, {use}", showlegend=bool(mine),
                    marker={"color": colour, "size": 10, "symbol": symbol, "line": {"width": 2}},
                )
            )  # fmt: skip
    out.update_xaxes(title_text="feed per tooth [mm]", rangemode="tozero")
    out.update_yaxes(title_text="mean force on the cutter [N]")
    return _styled(out, 380)


def _turn(done: Fitted, left: bool) -> go.Figure:
    """Samples and model over a turn, or their difference; a column a cut, a row a channel."""
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
        model = predicted(done.fit, c.cut, theta if left else angles)
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
    return _styled(out, 114 + 190 * len(shown))


def _styled(out: go.Figure, height: int) -> go.Figure:
    out.update_layout(
        height=height, font=FONT, plot_bgcolor="white", paper_bgcolor="white",
        margin={"l": 64, "r": 16, "t": 58, "b": 48},
    )  # fmt: skip
    out.update_xaxes(gridcolor=GRID, zeroline=False)
    out.update_yaxes(gridcolor=GRID, zeroline=False)
    return out
