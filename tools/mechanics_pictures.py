"""Run the code of docs/mechanics, write what it prints below it, and draw the picture of each page.

    python tools/mechanics_pictures.py [PAGE ...]           or: make figures

A page has blocks ``python``, which are run one after the other in one namespace, each with a block ``text`` of its
output behind it. The picture is drawn from the names of that code. Needs Chromium and playwright.
"""

from __future__ import annotations

import contextlib
import io
import re
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

import chipload
from chipload.result.style import FONT, GRID, INK, LIMIT, SCALE

ROOT = Path(__file__).parent.parent
FOLDER = ROOT / "docs" / "mechanics"
BLUE, GREEN = "#35608d", "#22a884"
CODE = re.compile(r"^```python\n(?P<code>.*?)^```\n\n```text\n(?P<text>.*?)^```", re.MULTILINE | re.DOTALL)
WIDE, HIGH = 860, 380

Names = dict[str, Any]


def run_page(text: str) -> tuple[str, Names]:
    """Return a page with the output of its code, and the names of that code."""
    names: Names = {}

    def block(found: re.Match[str]) -> str:
        out = io.StringIO()
        with contextlib.redirect_stdout(out):
            exec(compile(found["code"], "docs/mechanics", "exec"), names)
        return f"```python\n{found['code']}```\n\n```text\n{out.getvalue()}```"

    return CODE.sub(block, text), names


def line(x: Any, y: Any, name: str, colour: str, dash: str = "solid") -> go.Scatter:
    """Return a line of a figure."""
    return go.Scatter(x=x, y=y, name=name, mode="lines", line={"color": colour, "width": 2, "dash": dash})


def forces(n: Names) -> go.Figure:
    """Forces and torque over a turn."""
    turn, out = n["turn"], make_subplots(rows=1, cols=2, subplot_titles=("force on the cutter [N]", "torque [N m]"))
    parts = ("along the feed", "across", "along the axis")
    for name, colour, force in zip(parts, (BLUE, LIMIT, GREEN), turn.force_n.T, strict=True):
        out.add_trace(line(turn.rotation_deg, force, name, colour), 1, 1)
    out.add_trace(line(turn.rotation_deg, turn.torque_nm, "torque", INK), 1, 2)
    out.update_xaxes(title="rotation [deg]", dtick=90)
    return out


def chip(n: Names) -> go.Figure:
    """Chip of both teeth with and without runout."""
    plain, teeth = n["chip"], n["teeth"]
    out = go.Figure(line(plain.immersion_deg, 1000 * plain.thickness_mm[0], "without runout", INK, "dash"))
    for k, colour in enumerate((BLUE, LIMIT)):
        out.add_trace(line(teeth.immersion_deg, 1000 * teeth.thickness_mm[k], f"tooth {k}, runout 0.01 mm", colour))
    out.update_xaxes(title="immersion [deg]", dtick=30)
    out.update_yaxes(title="chip thickness [um]")
    return out


def stability(n: Names) -> go.Figure:
    """Stability chart: the limit, and growth as colour."""
    chart = n["chart"]
    scale = [[0.0, "#cfe3d8"], [0.4999, "#f3f8f5"], [0.5, "#fbe9e7"], [1.0, "#e0837d"]]
    out = go.Figure(
        go.Heatmap(
            x=chart.speed_rpm, y=chart.axial_depth_mm, z=chart.growth.T, zmin=-0.5, zmax=0.5, colorscale=scale,
            colorbar={"title": "growth"},
        )
    )  # fmt: skip
    out.add_trace(line(chart.speed_rpm, chart.limit_depth_mm, "limit", LIMIT))
    out.update_xaxes(title="spindle speed [rpm]")
    out.update_yaxes(title="axial depth [mm]")
    return out


def wall(n: Names) -> go.Figure:
    """Error over the height, and over the speed."""
    titles = ("bending of the cutter", "vibration, by speed")
    out = make_subplots(rows=1, cols=2, subplot_titles=titles)
    out.add_trace(line(n["bent"].error_um, n["bent"].height_mm, "", BLUE), 1, 1)
    out.add_trace(line(n["moved"].speed_rpm, n["moved"].error_um, "", LIMIT), 1, 2)
    out.update_xaxes(title="error [um]", row=1, col=1)
    out.update_yaxes(title="height [mm]", row=1, col=1)
    out.update_xaxes(title="spindle speed [rpm]", row=1, col=2)
    out.update_yaxes(title="error [um]", row=1, col=2)
    out.update_layout(showlegend=False)
    return out


def structure(n: Names) -> go.Figure:
    """Compliance over the plate."""
    out = go.Figure(
        go.Contour(
            x=n["x"][0], y=n["y"][:, 0], z=n["soft"], colorscale=SCALE, colorbar={"title": "um/N"}, ncontours=16,
            line={"width": 0.5},
        )
    )  # fmt: skip
    out.update_xaxes(title="x [mm]", scaleanchor="y")
    out.update_yaxes(title="y [mm]")
    return out


def coefficients(n: Names) -> go.Figure:
    """Mean forces of the cuts and those of the fit."""
    feeds = np.array([cut.feed_per_tooth(3) for cut in n["cuts"]])
    seen = np.array([cut.force.mean(axis=0) for cut in n["cuts"]])
    six = n["found"].coefficients.values
    metal = chipload.Material("fit", *map(float, six), source="fit of this page")
    some = np.linspace(0.02, 0.12, 21)
    drawn = np.array([chipload.tooth_forces(n["mill"], metal, n["slot"], f, 3000).mean_force_n for f in some])
    out = go.Figure()
    for k, (name, colour) in enumerate((("along the feed", BLUE), ("across", LIMIT), ("along the axis", GREEN))):
        out.add_trace(line(some, drawn[:, k], f"{name}, fit", colour))
        out.add_trace(
            go.Scatter(
                x=feeds, y=seen[:, k], name=f"{name}, measured", mode="markers", marker={"color": colour, "size": 9}
            )
        )
    out.update_xaxes(title="feed per tooth [mm]")
    out.update_yaxes(title="mean force [N]")
    return out


FIGURES: dict[str, Callable[[Names], go.Figure]] = {
    f.__name__: f for f in (forces, chip, stability, wall, structure, coefficients)
}


def photograph(figures: dict[str, go.Figure]) -> None:
    """Write docs/mechanics/NAME.png of each figure."""
    from pictures import CHROMIUM, FLAGS, fewer_colours
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright, tempfile.TemporaryDirectory() as folder:
        chromium = playwright.chromium.launch(executable_path=CHROMIUM, args=list(FLAGS))
        page = chromium.new_page(viewport={"width": WIDE, "height": HIGH}, device_scale_factor=1.5)
        for name, figure in figures.items():
            figure.update_layout(
                template="plotly_white", font=FONT, width=WIDE, height=HIGH, margin={"l": 60, "r": 20, "t": 40, "b": 50}
            )
            figure.update_xaxes(gridcolor=GRID)
            figure.update_yaxes(gridcolor=GRID)
            shown = Path(folder) / f"{name}.html"
            figure.write_html(shown, include_plotlyjs=True, config={"displayModeBar": False})
            page.goto(shown.as_uri())
            page.wait_for_selector(".main-svg")
            page.wait_for_timeout(500)
            page.locator(".plotly-graph-div").first.screenshot(path=FOLDER / f"{name}.png")
            fewer_colours(FOLDER / f"{name}.png")
        chromium.close()


def write(names: list[str]) -> None:
    """Write the output and the picture of some pages."""
    figures = {}
    for name in names:
        page = FOLDER / f"{name}.md"
        text, found = run_page(page.read_text(encoding="utf-8"))
        page.write_text(text, encoding="utf-8")
        figures[name] = FIGURES[name](found)
        print(page.relative_to(ROOT), flush=True)
    photograph(figures)


if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).parent))
    write(sys.argv[1:] or list(FIGURES))
