"""The limit table, and what else does not hold or was noticed; a click goes to the place."""

from __future__ import annotations

from collections.abc import Callable
from html import escape
from typing import Any

from nicegui import ui

from chipload.web.findings import Failing, Held, failures, limits
from chipload.web.result import Result, Track

#: how a state is written
CLASSES = {"holds": "ok", "does not hold": "no", "unproven": "may"}
#: a click on a row of the table gives its row of the history
CLICK = "(e) => { const r = e.target.closest('[data-row]'); if (r) emit(Number(r.getAttribute('data-row'))) }"


class Tables:
    """Limits and findings of a track."""

    def __init__(self, pick: Callable[[int], None]) -> None:
        self.pick = pick
        with ui.element("div").classes("cl-panel cl-tables"):
            self.html = ui.html("", sanitize=True).classes("cl-scroll").on("click", self._clicked, js_handler=CLICK)
            self.html.mark("limits")

    def open(self, result: Result, track: Track) -> None:
        """Show a track."""
        self.html.set_content(limit_table(limits(result, track)) + finding_list(failures(result, track)))

    def _clicked(self, event: Any) -> None:
        if isinstance(event.args, int) and event.args >= 0:
            self.pick(event.args)


def limit_table(rows: list[Held]) -> str:
    """The limits as HTML."""
    if not rows:
        return '<div class="cl-none">No limit is stated that this result was held against.</div>'
    out = []
    for h in rows:
        go = f' data-row="{h.row}" class="cl-go" title="go there"' if h.row is not None else ""
        worst = "" if h.worst is None else f"{h.worst:.4g}"
        share = min(100.0 * h.worst / h.limit, 100.0) if h.worst is not None and h.limit > 0.0 else 0.0
        bar = f'<div class="cl-share"><div class="cl-{CLASSES[h.state]}-bar" style="width:{share:.0f}%"></div></div>'
        out.append(
            f"<tr{go}><td>{escape(h.name)}</td><td class=n>{worst}</td><td class=n>{h.limit:g} {escape(h.unit)}</td>"
            f"<td>{bar}</td><td class=cl-{CLASSES[h.state]}>{h.state}</td><td class=w>{escape(h.where)}</td></tr>"
        )
    head = "<tr><th>limit</th><th class=n>worst</th><th class=n>at most</th><th></th><th></th><th>where</th></tr>"
    return f'<table class="cl-limits"><thead>{head}</thead><tbody>{"".join(out)}</tbody></table>'


def finding_list(rows: list[Failing]) -> str:
    """What fails and what was noticed as HTML."""
    items = []
    for f in rows:
        go = f' data-row="{f.row}"' if f.row is not None else ""
        kind = ("cl-grave" if f.grave else "cl-note") + (" cl-go" if f.row is not None else "")
        items.append(f'<div class="{kind}"{go}>{escape(f.text)}</div>')
    return f'<div class="cl-found">{"".join(items)}</div>' if items else ""
