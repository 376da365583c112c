"""The report section on chatter: the step with the least margin, quiet speeds, chart, margin along the path."""

from __future__ import annotations

from html import escape

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from chipload.checking.outcome import SimulationResult, SpeedResult
from chipload.checking.stability import (
    SURE,
    StabilityResult,
    filled_margins,
    stability_numbers,
)
from chipload.checking.stability_watch import engaged_edge
from chipload.number_text import number_text
from chipload.report.sheet import figure, table
from chipload.result.limits import Columns
from chipload.result.style import FONT, GRID, INK, LIMIT, LINE_POINTS, STOCK
from chipload.result.thinning import thin_rows
from chipload.stability.chart import StabilityChart, stability_chart
from chipload.stability.cuts import join_dynamic_cuts
from chipload.stability.margin import MOST_MARGIN
from chipload.units import rpm_from_rad_s

#: colours of the margin before and after new speeds
BEFORE, AFTER = "#c9821a", "#3457a6"
#: speeds and depths of the chart, and its greatest depth in depths of the cut
SPEEDS, DEPTHS, DEEPEST = 240, 60, 3.0
#: values that are listed by what they make unsure
MEASURED = 6


def stability_sections(
    simulation: SimulationResult, speeds: SpeedResult | None, figures: dict[str, go.Figure]
) -> list[str]:
    """Return the report sections and add their figures to ``figures``; none if no modes are stated."""
    stability, columns = simulation.stability, simulation.removal.columns
    if stability is None:
        return []
    what = stability_numbers(stability, columns)
    body = ["<h2>Stability</h2>"]
    if what["margin_min"] is None:
        return [*body, "<p>No margin is known.</p>"]
    over = " or more" if what["margin_min"] >= MOST_MARGIN else ""
    rows = [["least stability margin", f"{number_text(what['margin_min'])}{over}"], ["line", str(what["line"])]]
    if what["chatter_hz"]:
        rows += [["frequency there [Hz]", number_text(what["chatter_hz"])], ["mode", escape(str(what["mode"]))]]
    rows += [["tool", str(what["tool"])], ["spindle speed [rpm]", number_text(what["speed_rpm"])]]
    if what["speed_rpm_advised"] is not None:
        advised = f"{what['speed_rpm_advised']:g}, margin {number_text(what['margin_advised'])}"
        rows.append(["speed with the greatest margin [rpm]", advised])
    process = stability.watch.dynamics.process
    left_out = "" if process is not None else ", process damping is left out"
    if process is not None:
        land = f"wear land {process.wear_land:g} mm, {process.indentation:g} N/mm3, friction {process.friction:g}"
        rows.append(["process damping is included", land])
    axial = "The axial direction is rigid"
    if stability.watch.spatial(int(what["tool"])):
        axial = "Cutter and workpiece move along the axis as well"
    body += [
        '<p class="note">The margin is the factor by which the cutting force could grow before a step chatters; below '
        f"1 it chatters. {axial}{left_out}.</p>",
        table(["", ""], rows),
    ]
    if speeds is not None:
        speed_rows = [
            [
                str(t.tool), f"{t.lines[0]} to {t.lines[1]}", ", ".join(map(number_text, t.before)),
                number_text(t.rpm), f"{t.margin:.3g}",
            ]
            for t in speeds.tools
        ]  # fmt: skip
        head = ["tool", "lines", "before [rpm]", "new [rpm]", "margin expected"]
        body += ["<h3>New speeds</h3>", table(head, speed_rows)]
    if what["windows"]:
        cells = [[number_text(w["low_rpm"]), number_text(w["high_rpm"]), f"{w['margin']:.3g}"] for w in what["windows"]]
        head = ["from [rpm]", "to [rpm]", "greatest margin"]
        body += [
            f"<h3>Quiet speeds of tool {what['tool']}</h3>",
            f'<p class="note">Speeds at which the least margin of its steps is at least {stability.wanted:g}.</p>',
            table(head, cells, numbers=(0, 1, 2)),
        ]
    for share in SURE:
        some = what.get(f"windows_{share}_percent")
        if some is not None:
            cells = [[number_text(w["low_rpm"]), number_text(w["high_rpm"]), f"{w['probability']:.3g}"] for w in some]
            body += [
                f"<h3>Quiet speeds with a probability of {share} %</h3>",
                '<p class="note">Probability that the cut with the least margin does not chatter at each speed, from '
                "the stated deviations of the modes and the spread of the coefficients.</p>",
                table(["from [rpm]", "to [rpm]", "greatest probability"], cells, numbers=(0, 1, 2)),
            ]
    if what.get("variance_shares"):
        cells = [[escape(name), f"{100.0 * share:.0f}"] for name, share in what["variance_shares"].items()]
        body += [
            "<h3>What to measure next</h3>",
            '<p class="note">Share of each value in the uncertainty of the cut with the least margin.</p>',
            table(["value", "share of the variance [%]"], cells[:MEASURED], numbers=(1,)),
        ]
    tool = int(what["tool"])
    drawn = worst_chart(stability, tool)
    if drawn is not None:
        body += [
            "<h3>Stability chart</h3>",
            '<p class="note">Limit of the cut with the least margin: above the line it chatters. Dots are the '
            "different cuts of the tool, each with its own limit; a red dot is below the required margin.</p>",
            figure(
                "stability", chart_figure(drawn, tool, stability, None if speeds is None else speeds.stability), figures
            ),
        ]
    body += [
        "<h3>Margin along the path</h3>",
        figure("margin", margin_figure(columns, None if speeds is None else speeds.before.columns, stability), figures),
    ]
    return body


def worst_chart(stability: StabilityResult, tool: int) -> StabilityChart | None:
    """Return the stability chart of the cut of a tool that is nearest to chatter; None if the tool has no cut."""
    some = stability.watch.cuts.get(tool, [])
    low, high = stability.range_of(tool)
    if not some or not high > low:
        return None
    cuts = join_dynamic_cuts(some)
    margin = np.array([x[0] for x in stability.watch.known[tool].values()])
    # of those with the same margin, the one with most edge in cut
    cut = cuts.chosen([int(np.lexsort((-engaged_edge(cuts), margin))[0])])
    depth = float(cut.rows[0, 4]) if len(cut.rows) == 1 else 1.0
    grid = np.linspace(DEEPEST * depth / DEPTHS, DEEPEST * depth, DEPTHS)
    return stability_chart(cut, np.geomspace(low, high, SPEEDS), grid)


def chart_figure(
    chart: StabilityChart, tool: int, stability: StabilityResult, before: StabilityResult | None
) -> go.Figure:
    """Plot the critical depth of the worst cut over speed, with the cuts of the tool at new and old speeds."""
    out = go.Figure()
    out.add_trace(
        go.Scatter(
            x=(rpm_from_rad_s(1.0) * chart.speed).astype(np.float32), y=chart.limit.astype(np.float32), mode="lines",
            name="limit", line={"color": INK, "width": 1.6}, fill="tozeroy", fillcolor="rgba(11,122,117,0.12)",
            hovertemplate="%{x:.5g} rpm: %{y:.3g}<extra>limit</extra>",
        )
    )  # fmt: skip
    marks = [(stability, "circle", "cuts"), *([(before, "x", "before")] if before is not None else [])]
    for own, symbol, name in marks:
        some = own.watch.cuts.get(tool, [])
        if not some:
            continue
        cuts, margin = join_dynamic_cuts(some), np.array([x[0] for x in own.watch.known[tool].values()])
        single = np.diff(cuts.start) == 1
        depth = np.ones(len(cuts))
        if chart.is_depth:
            depth = np.where(single, cuts.rows[np.minimum(cuts.start[:-1], len(cuts.rows) - 1), 4], np.nan)
        speed, bad = rpm_from_rad_s(1.0) * cuts.pitch / cuts.period, margin < stability.wanted
        for chosen, colour, what in ((~bad, STOCK, name), (bad, LIMIT, f"{name}, below the required margin")):
            shown = np.isfinite(depth) & chosen
            if shown.any():
                out.add_trace(
                    go.Scatter(
                        x=speed[shown], y=depth[shown], mode="markers", name=what, customdata=margin[shown],
                        marker={"color": colour, "size": 8, "symbol": symbol},
                        hovertemplate="margin %{customdata:.3g}<extra></extra>",
                    )
                )  # fmt: skip
    out.update_layout(
        template="none", height=380, font=FONT, margin={"l": 74, "r": 16, "t": 30, "b": 50},
        legend={"orientation": "h", "y": 1.01, "yanchor": "bottom", "x": 0.0},
    )  # fmt: skip
    out.update_xaxes(title_text="spindle speed [rpm]", gridcolor=GRID, zeroline=False)
    title = "axial depth of cut [mm]" if chart.is_depth else "factor on the cutting force"
    out.update_yaxes(title_text=title, gridcolor=GRID, range=[0.0, float(chart.depth[-1])])
    return out


def margin_figure(columns: Columns, before: Columns | None, stability: StabilityResult) -> go.Figure:
    """Plot margin and surface location error along the path, before and after new speeds."""
    out = make_subplots(rows=2, cols=1, shared_xaxes=True, vertical_spacing=0.06)
    tracks = [(columns, "after" if before is not None else "program", AFTER)]
    if before is not None:
        tracks.insert(0, (before, "before", BEFORE))
    for c, name, colour in tracks:
        s = np.asarray(c["s_mm"])
        for row, values in enumerate((filled_margins(c), np.asarray(c["sle_um"])), start=1):
            # troughs of the margin are what matters
            keep = thin_rows(-values if row == 1 else values, LINE_POINTS)
            out.add_trace(
                go.Scatter(
                    x=s[keep].astype(np.float32), y=values[keep].astype(np.float32), mode="lines", name=name,
                    line={"color": colour, "width": 1.3, "shape": "vh"}, showlegend=row == 1,
                    customdata=np.asarray(c["line"])[keep],
                    hovertemplate="%{y:.3g}, line %{customdata}<extra>" + name + "</extra>",
                ),
                row=row, col=1,
            )  # fmt: skip
    out.add_hline(y=stability.wanted, line={"color": LIMIT, "width": 1.2, "dash": "dash"}, row=1, col=1)
    out.update_yaxes(title_text="stability margin", range=[0.0, 1.05 * MOST_MARGIN], row=1, col=1)
    out.update_yaxes(title_text="surface location error [\u00b5m]", row=2, col=1)
    out.update_xaxes(title_text="path [mm]", row=2, col=1)
    out.update_xaxes(gridcolor=GRID, zeroline=False)
    out.update_yaxes(gridcolor=GRID, zerolinecolor=GRID)
    out.update_layout(
        template="none", height=460, font=FONT, margin={"l": 74, "r": 16, "t": 30, "b": 46},
        legend={"orientation": "h", "y": 1.01, "yanchor": "bottom", "x": 0.0},
    )  # fmt: skip
    return out
