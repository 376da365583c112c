"""The panel with the limits and findings of a track; a click selects the place."""

from __future__ import annotations

from collections.abc import Callable
from html import escape
from typing import Any

from nicegui import ui

from chipload.errors import Severity
from chipload.number_text import number_text
from chipload.result import Verdict
from chipload.result.times import Times
from chipload.web.checks import PageFinding, findings, limits, row_of
from chipload.web.result import PageResult, PageTrack

#: how a state is written
CLASSES = {Verdict.HOLDS: "ok", Verdict.EXCEEDS: "no", Verdict.UNPROVEN: "may"}
#: classes of a finding
KINDS = {Severity.NOTE: "cl-note", Severity.UNPROVEN: "cl-grave cl-may", Severity.EXCEEDS: "cl-grave cl-no"}
#: a click on a row of the table gives its row of the history
CLICK = "(e) => { const r = e.target.closest('[data-row]'); if (r) emit(Number(r.getAttribute('data-row'))) }"


class LimitPanel:
    """Limits and findings of a track."""

    def __init__(self, pick: Callable[[int], None]) -> None:
        self.pick = pick
        self.box = ui.element("div").classes("cl-table-box").props('role=region aria-label="limits and findings"')
        with self.box:
            self.html = (
                ui.html("", sanitize=True)
                .classes("cl-scroll")
                .props("tabindex=0")
                .on("click", self._on_click, js_handler=CLICK)
            )
            self.html.mark("limits")

    def open(self, result: PageResult, track: PageTrack) -> None:
        """Show a track."""
        self.html.set_content(limit_table(track) + time_line(track.times) + finding_list(findings(result, track)))

    def _on_click(self, event: Any) -> None:
        if isinstance(event.args, int) and event.args >= 0:
            self.pick(event.args)


def limit_table(track: PageTrack) -> str:
    """The limits of a track as HTML."""
    rows = limits(track)
    if not rows:
        return '<div class="cl-none">No limit was checked in this track.</div>'
    out = []
    for c in rows:
        row, unit = row_of(track, c), escape(c.column.unit)
        go = f' data-row="{row}" class="cl-go" title="go there"' if row is not None else ""
        covers = "" if c.coverage.whole else f"<small>, {escape(c.coverage.name)}</small>"
        name = escape(c.column.label) + covers
        share = min(100.0 * c.worst / c.limit, 100.0) if c.worst is not None and c.limit > 0.0 else 0.0
        least = "\u2265 " if c.column.least else ""
        if c.column.least and c.worst:
            share = min(100.0 * c.limit / c.worst, 100.0)
        where, state = escape(c.reason or c.where), CLASSES[c.state]
        bar = f'<div class="cl-share"><div class="cl-{state}-bar" style="width:{share:.0f}%"></div></div>'
        out.append(
            f"<tr{go}><td>{name}</td><td class=n>{c.worst_text}</td>"
            f"<td class=n>{least}{number_text(c.limit, 6)} {unit}</td>"
            f"<td>{bar}</td><td class=cl-{state}>{c.state.value}</td>"
            f'<td class=w title="{where}"><div>{where}</div></td></tr>'
        )
    head = (
        "<tr><th>limit</th><th class=n>worst</th><th class=n>limit</th><th>share</th><th>state</th><th>where</th></tr>"
    )
    return f'<table class="cl-limits cl-checks"><thead>{head}</thead><tbody>{"".join(out)}</tbody></table>'


def time_line(times: Times | None) -> str:
    """The time of a program and its parts, which add up to it, as HTML; empty: it is not known.

    >>> time_line(Times(60.0, 6.5, 3.25, 0.0, 2.0))[21:]
    'Time 71.8 s: in cut 60, in air 6.5, rapids 3.25, dwell 0, tool change, start-up and approach 2 s</div>'
    """
    if times is None:
        return ""
    parts = {"in cut": times.cut, "in air": times.air, "rapids": times.rapid, "dwell": times.dwell}
    shown = ", ".join(f"{name} {number_text(value)}" for name, value in parts.items())
    other = f"tool change, start-up and approach {number_text(times.other)}"
    return f'<div class="cl-none">Time {number_text(times.whole)} s: {shown}, {other} s</div>'


def finding_list(rows: list[PageFinding]) -> str:
    """Findings as HTML."""
    items = []
    for f in rows:
        go = f' data-row="{f.row}"' if f.row is not None else ""
        kind = KINDS[f.severity] + (" cl-go" if f.row is not None else "")
        items.append(f'<div class="{kind}"{go}>{escape(f.text)}</div>')
    return f'<div class="cl-found">{"".join(items)}</div>' if items else ""
