"""What new feeds made of a program: time, loads and feed before and after, and what still exceeds a limit.

Notation: before, the program as it was; after, its text with other F words, read and simulated again. Both have the
same steps.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from html import escape
from typing import Any

import numpy as np
import plotly.graph_objects as go
from numpy.typing import NDArray
from plotly.subplots import make_subplots

from chipload.report.figures import FONT, GRID, LIMIT, LINE_POINTS
from chipload.report.held import LIMITS
from chipload.report.shape import thinned
from chipload.report.sheet import figure, table
from chipload.report.simulated import Simulated

Floats = NDArray[np.float64]

#: columns that are compared, their units and names
COMPARED = {
    "force_n": ("force", "N"),
    "torque_nm": ("torque", "N m"),
    "power_w": ("power", "W"),
    "chip_max_mm": ("chip", "mm"),
    "deflection_um": ("deflection", "\u00b5m"),
}
#: colours of the program as it was, and with its new feeds
BEFORE, AFTER = "#c9821a", "#3457a6"
#: what holds a line, beside limits
HELD = {
    "fastest": "the greatest feed that the job allows",
    "machine": "what the machine reaches",
    "air": "the feed in air",
    "programmed": "touches nothing, or films only: as programmed",
    "slowest": "a limit asks for less than the least feed",
}
#: lines that the page lists, and lines that summary.json does
LISTED, MOST_LINES = 60, 2000


@dataclass(frozen=True, eq=False)
class Fed:
    """New feeds of a program.

    Parameters
    ----------
    text : the program with them
    dialect : of the text
    line : (m,) int, lines that move at a feed
    factor : (m,) float, the new feed of each over the programmed one
    by : (m,) what holds each: a limit by its name or one of :data:`HELD`
    before : (n,) columns of the steps at the programmed feeds
    rubs : lines that cut below the least feed per tooth, and their feeds per tooth [mm]
    tooth_feed_least : [mm]; None: none is asked for
    seconds_before : time of the program at the programmed feeds [s]
    """

    text: str
    dialect: str
    line: NDArray[np.int64]
    factor: Floats
    by: tuple[str, ...]
    before: Mapping[str, Floats]
    rubs: tuple[tuple[int, float], ...]
    tooth_feed_least: float | None
    seconds_before: float

    @property
    def fails(self) -> tuple[str, ...]:
        """What was asked of feeds and is not reached, beside limits."""
        return tuple(
            f"line {line}: {feed:.3g} mm a tooth is less than {self.tooth_feed_least:g}" for line, feed in self.rubs
        )


def limited(fed: Fed, simulated: Simulated) -> dict[str, float]:
    """Limits that the feed can hold, stated ones and those of the spindle."""
    return {h.name: h.limit for h in simulated.held if LIMITS[h.name][0] in fed.before}


def exceeding(fed: Fed, simulated: Simulated) -> list[dict[str, Any]]:
    """Lines that exceed a limit of a load after all: the worst step of each."""
    c, out = simulated.removal.columns, []
    factor = dict(zip(fed.line.tolist(), zip(fed.factor.tolist(), fed.by, strict=True), strict=True))
    for name, limit in limited(fed, simulated).items():
        values = c[LIMITS[name][0]]
        over = np.flatnonzero(values > limit)
        order = over[np.argsort(-values[over], kind="stable")]
        lines, first = np.unique(c["line"][order], return_index=True)
        at = order[first]
        before, feed, t = fed.before[LIMITS[name][0]], c["feed_mm_min"], c["t_s"]
        place = np.column_stack([c[f"{x}_mm"] for x in "xyz"])
        for line, k in zip(lines.tolist(), at.tolist(), strict=True):
            times, by = factor[line]
            out.append(
                {
                    "line": line,
                    "limit": name,
                    "allowed": limit,
                    "worst": float(values[k]),
                    "before": float(before[k]),
                    "feed_mm_min": float(feed[k]),
                    "factor": times,
                    "slowest": by == "slowest",
                    "at_mm": place[k].tolist(),
                    "t_s": float(t[k]),
                }
            )
    return sorted(out, key=lambda x: (x["line"], x["limit"]))


def summary(fed: Fed, simulated: Simulated, seconds_after: float, name: str, verified: bool) -> dict[str, Any]:
    """``feeds`` of the operation in summary.json."""
    c, listed = simulated.removal.columns, exceeding(fed, simulated)
    changed = fed.factor != 1.0
    cuts = (c["chip_pieces"] > 0) & ~c["rapid"]

    def greatest(columns: Mapping[str, Floats]) -> dict[str, float]:
        return {k.replace("_max_", "_"): float(columns[k].max(initial=0.0)) for k in COMPARED}

    def feeds(columns: Mapping[str, Floats]) -> dict[str, float] | None:
        some = columns["feed_mm_min"][cuts]
        return {"min": float(some.min()), "max": float(some.max())} if len(some) else None

    return {
        "program": name,
        "verified": verified,
        "time_before_s": fed.seconds_before,
        "time_after_s": seconds_after,
        "before": greatest(fed.before) | {"feed_mm_min": feeds(fed.before)},
        "after": greatest(c) | {"feed_mm_min": feeds(c)},
        "lines": len(fed.line),
        "lines_changed": int(changed.sum()),
        "lines_slower": int((fed.factor < 1.0).sum()),
        "lines_faster": int((fed.factor > 1.0).sum()),
        "by": dict(sorted(Counter(fed.by).items())),
        "still_exceeding": listed[:MOST_LINES],
        "still_exceeding_count": len(listed),
        "rubbing": [{"line": line, "tooth_feed_mm": feed} for line, feed in fed.rubs[:MOST_LINES]],
        "rubbing_count": len(fed.rubs),
    }


def columns(fed: Fed, simulated: Simulated) -> dict[str, NDArray[Any]]:
    """Columns of history.parquet, a row a step."""
    line = simulated.removal.columns["line"]
    at = np.searchsorted(fed.line, line).clip(0, max(len(fed.line) - 1, 0))
    known = (fed.line[at] == line) & ~simulated.removal.columns["rapid"] if len(fed.line) else np.zeros(len(line), bool)
    by = np.array([*fed.by, ""], dtype=object)
    return {
        "feed_before_mm_min": fed.before["feed_mm_min"],
        "force_before_n": fed.before["force_n"],
        "torque_before_nm": fed.before["torque_nm"],
        "feed_held_by": by[np.where(known, at, len(fed.by))],
    }


def along(fed: Fed, simulated: Simulated) -> go.Figure:
    """Feed, and what is limited, before and after, along the path."""
    c = simulated.removal.columns
    s = np.asarray(c["s_mm"])
    rows: list[tuple[str, str, float | None]] = [("feed_mm_min", "feed [mm/min]", None)]
    for name, limit in limited(fed, simulated).items():
        column = LIMITS[name][0]
        if column in COMPARED and not name.startswith("spindle"):
            rows.append((column, f"{COMPARED[column][0]} [{COMPARED[column][1]}]", limit))
    if len(rows) == 1:
        rows.append(("force_n", "force [N]", None))
    out = make_subplots(rows=len(rows), cols=1, shared_xaxes=True, vertical_spacing=0.04)
    at_feed = ~np.asarray(c["rapid"])
    for k, (column, title, most) in enumerate(rows, start=1):
        for values, name, colour in ((fed.before, "before", BEFORE), (c, "after", AFTER)):
            y = np.where(at_feed, np.asarray(values[column], dtype=np.float64), 0.0)
            keep = thinned(y, LINE_POINTS)
            out.add_trace(
                go.Scatter(
                    x=s[keep].astype(np.float32), y=y[keep].astype(np.float32), name=name, mode="lines",
                    line={"color": colour, "width": 1.2, "shape": "vh"}, customdata=c["line"][keep],
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


def section(
    fed: Fed, simulated: Simulated, seconds_after: float, name: str, verified: bool, figures: dict[str, go.Figure]
) -> list[str]:
    """The part of the page about new feeds."""
    what = summary(fed, simulated, seconds_after, name, verified)
    gain = 100.0 * (1.0 - seconds_after / fed.seconds_before) if fed.seconds_before > 0.0 else 0.0
    before, after, limits = what["before"], what["after"], limited(fed, simulated)
    rows = [["time of the program [s]", f"{fed.seconds_before:.5g}", f"{seconds_after:.5g}", ""]]
    if before["feed_mm_min"] is not None:
        spans = (f"{x['feed_mm_min']['min']:.4g} to {x['feed_mm_min']['max']:.4g}" for x in (before, after))
        rows.append(["feeds that cut [mm/min]", *spans, ""])
    for column, (word, unit) in COMPARED.items():
        key = column.replace("_max_", "_")
        limit = next((f"{v:g}" for k, v in limits.items() if LIMITS[k][0] == column), "")
        rows.append([f"greatest {word} [{unit}]", f"{before[key]:.4g}", f"{after[key]:.4g}", limit])
    how = "less" if gain >= 0.0 else "more"
    body = [
        "<h2>Feeds</h2>",
        f"<p>{what['lines_changed']} of {what['lines']} lines that move at a feed have another one: "
        f"{what['lines_slower']} slower, {what['lines_faster']} faster. The program takes {abs(gain):.3g} % {how} "
        f"time. <b>{escape(name)}</b> is the text, read again and simulated from fresh stock"
        f"{'' if verified else '; it does not hold, and its first line says so'}.</p>",
        table(["", "before", "after", "limit"], rows, numbers=(1, 2, 3)),
        figure("feeds", along(fed, simulated), figures),
    ]
    counts = [[escape(HELD.get(k, f"limit {k}")), str(n)] for k, n in what["by"].items()]
    body += ["<h3>What holds the lines</h3>", table(["", "lines"], counts, numbers=(1,))]
    listed = exceeding(fed, simulated)
    if listed:
        cells = [
            [
                str(x["line"]), escape(f"{x['limit']} {x['allowed']:g}"), f"{x['before']:.4g}", f"{x['worst']:.4g}",
                f"{x['feed_mm_min']:.4g}", "slowest" if x["slowest"] else "", ", ".join(f"{v:.4g}" for v in x["at_mm"]),
            ]
            for x in sorted(listed, key=lambda x: -x["worst"] / x["allowed"])[:LISTED]
        ]  # fmt: skip
        head = ["line", "limit", "before", "after", "feed [mm/min]", "", "tip at [mm]"]
        body += ["<h3>What still exceeds a limit</h3>", table(head, cells, numbers=(2, 3, 4))]
        if len(listed) > LISTED:
            body.append(f'<p class="note">{len(listed) - LISTED} more in summary.json.</p>')
    else:
        body.append("<p>No line exceeds a limit of a load.</p>")
    if fed.rubs:
        cells = [[str(line), f"{feed:.3g}"] for line, feed in fed.rubs[:LISTED]]
        body += ["<h3>What may rub</h3>", table(["line", "feed per tooth [mm]"], cells, numbers=(1,))]
    return body


def program_text(fed: Fed, unless: str | None) -> str:
    """The text; where it does not hold, ``unless`` says why behind the words of its first line; no line is added.

    A line of ``%`` alone is passed over, and Sinumerik's paths.
    """
    if unless is None:
        return fed.text
    plain = "".join(ch if ch.isascii() and ch.isprintable() and ch not in "()" else "_" for ch in unless)
    said = f"; NOT VERIFIED: {plain}" if fed.dialect == "sinumerik" else f"(NOT VERIFIED: {plain})"
    lines = fed.text.split("\n")
    for k, line in enumerate(lines):
        body = line.rstrip()
        if body and not body.startswith(("%", ";$")):
            lines[k] = f"{body} {said}{line[len(body) :]}"
            break
    return "\n".join(lines)
