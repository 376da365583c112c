"""The report of new feeds: an additional section of the report of a simulation."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from chipload.checking.figures import program_presentation
from chipload.checking.outcome import SimulationResult
from chipload.checking.result import changed_name
from chipload.jobs.feeds.numbers import COMPARED, feed_numbers, lines_that_exceed
from chipload.jobs.feeds.outcome import FeedResult, FeedsProgram
from chipload.jobs.feeds.result import division_notes, result_of
from chipload.number_text import number_text, place_text
from chipload.report.presentation import Presentation
from chipload.report.sheet import figure, table
from chipload.result import COLUMNS, LimitCheck
from chipload.result.style import FONT, GRID, LIMIT, LINE_POINTS
from chipload.result.thinning import thin_rows

#: colours of the program as it was, and with its new feeds
BEFORE, AFTER = "#c9821a", "#3457a6"
#: what limits the feed of a line besides limits of loads
CAUSES = {
    "fastest": "the greatest feed that the job allows",
    "machine": "the acceleration and the rates of the machine",
    "air": "the feed in air",
    "programmed": "programmed feed kept: the line cuts nothing, or only thin films",
    "slowest": "the least feed that the job allows, although a limit requires less",
}
#: lines that the report lists
LISTED = 60


def presentation_of(program: FeedsProgram) -> Presentation:
    """Return the presentation of a program with new feeds."""
    result, name = result_of(program), changed_name(program, "feeds")
    own, checks, time_s = program.feeds, result.in_use[0].limits, float(program.seconds.sum())
    return program_presentation(
        program, result, {name: own},
        lambda figures: feed_sections(own, program.simulated, checks, time_s, name, figures),
    )  # fmt: skip


def feed_sections(
    feeds: FeedResult,
    simulation: SimulationResult,
    checks: Sequence[LimitCheck],
    time_s: float,
    program: str,
    figures: dict[str, go.Figure],
) -> list[str]:
    """Return the report sections on new feeds; their figures are added to ``figures``."""
    what = feed_numbers(feeds, simulation, checks, time_s, program)
    before, after = what["before"], what["after"]
    gain = 100.0 * (1.0 - time_s / feeds.seconds_before) if feeds.seconds_before > 0.0 else 0.0
    rows = [["time of the program [s]", number_text(feeds.seconds_before), number_text(time_s), ""]]
    if before["feed_mm_min"] is not None:
        spans = (
            f"{number_text(x['feed_mm_min']['min'])} to {number_text(x['feed_mm_min']['max'])}" for x in (before, after)
        )
        rows.append(["feeds that cut [mm/min]", *spans, ""])
    bounds = {check.column.name: f"{check.limit:g}" for check in checks}
    for name in (name for name in COMPARED if name in before and name in after):
        cells = [number_text(before[name]), number_text(after[name]), bounds.get(name, "")]
        rows.append([escape(f"greatest {COLUMNS[name].title}"), *cells])
    body = [
        "<h2>Feeds</h2>",
        f"<p>{what['lines_changed']} of {what['lines']} lines with a feed have a new one: {what['lines_slower']} are "
        f"slower, {what['lines_faster']} faster. The program takes {number_text(abs(gain), 3)} % "
        f"{'less' if gain >= 0.0 else 'more'} time. {escape(' '.join((*division_notes(feeds), '')))}"
        f"<b>{escape(program)}</b> is its text; it was read again and simulated from fresh stock.</p>",
        table(["", "before", "after", "limit"], rows, numbers=(1, 2, 3)),
        figure("feeds", feed_along_path(feeds, simulation, checks), figures),
    ]
    counts = [[escape(CAUSES.get(k, f"limit {k}")), str(n)] for k, n in what["by"].items()]
    body += ["<h3>What limits the feed of the lines</h3>", table(["cause", "lines"], counts, numbers=(1,))]
    listed = lines_that_exceed(feeds, simulation, checks)
    if listed:
        cells_of = [
            [
                str(x["line"]), escape(f"{x['limit']} {x['allowed']:g}"), number_text(x["before"]),
                number_text(x["worst"]), number_text(x["feed_mm_min"]), "slowest" if x["slowest"] else "",
                place_text(x["place"]),
            ]
            for x in sorted(listed, key=lambda x: -x["worst"] / x["allowed"])[:LISTED]
        ]  # fmt: skip
        head = ["line", "limit", "before", "after", "feed [mm/min]", "", "place [mm]"]
        body += ["<h3>Lines that still exceed a limit</h3>", table(head, cells_of, numbers=(2, 3, 4))]
        if len(listed) > LISTED:
            body.append(f'<p class="note">{len(listed) - LISTED} more in summary.json.</p>')
    return body


def feed_along_path(feeds: FeedResult, simulation: SimulationResult, checks: Sequence[LimitCheck]) -> go.Figure:
    """Plot the feed and the limited loads along the path, before and after the change."""
    c = simulation.removal.columns
    rows: list[tuple[str, str, float | None]] = [("feed_mm_min", "feed [mm/min]", None)]
    rows += [(check.name, check.column.title, check.limit) for check in checks if check.name in COMPARED]
    if len(rows) == 1:
        rows.append(("force_n", "force [N]", None))
    out = make_subplots(rows=len(rows), cols=1, shared_xaxes=True, vertical_spacing=0.04)
    for k, (column, title, most) in enumerate(rows, start=1):
        for values, name, colour in ((feeds.before.columns, "before", BEFORE), (c, "after", AFTER)):
            s = np.asarray(values["s_mm"])
            y = np.where(~np.asarray(values["rapid"]), np.asarray(values[column], dtype=np.float64), 0.0)
            keep = thin_rows(y, LINE_POINTS)
            out.add_trace(
                go.Scatter(
                    x=s[keep].astype(np.float32), y=y[keep].astype(np.float32), name=name, mode="lines",
                    line={"color": colour, "width": 1.2, "shape": "vh"}, customdata=values["line"][keep],
                    hovertemplate=f"{name}: %{{y:.4g}}, line %{{customdata}}<extra>{title}</extra>",
                    showlegend=k == 1,
                ),
                row=k, col=1,
            )  # fmt: skip
        if most is not None:
            out.add_hline(
                y=most, line={"color": LIMIT, "width": 1.2, "dash": "dash"}, row=k, col=1,
                annotation={"text": f"limit {most:g}", "font": {"color": LIMIT, "size": 11}},
                annotation_position="top left",
            )  # fmt: skip
        out.update_yaxes(title_text=title, row=k, col=1, rangemode="tozero")
    out.update_xaxes(gridcolor=GRID, zeroline=False)
    out.update_yaxes(gridcolor=GRID, zerolinecolor=GRID)
    out.update_xaxes(title_text="path [mm]", row=len(rows), col=1)
    out.update_layout(
        template="none", height=210 * len(rows) + 60, font=FONT, margin={"l": 74, "r": 16, "t": 30, "b": 46},
        legend={"orientation": "h", "y": 1.01, "yanchor": "bottom", "x": 0.0},
    )  # fmt: skip
    return out
