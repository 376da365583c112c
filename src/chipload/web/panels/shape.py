"""The panel of a result without a motion, as of a distortion: verdict, limits, and its surfaces."""

from __future__ import annotations

from html import escape

from nicegui import ui

from chipload.number_text import number_text
from chipload.report.answer import bar_html, critical_html
from chipload.report.shape_figure import shape_figure, shape_note
from chipload.result import Result
from chipload.web.result_view import VERDICTS


def variant_table(result: Result) -> str:
    """The limits of all variants as HTML, those in use first."""
    rows = []
    for track in sorted(result.tracks, key=lambda one: not one.in_use):
        for check in track.limits:
            name = escape(track.name) + (" <b>in use</b>" if track.in_use else "")
            state = VERDICTS[check.state]
            rows.append(
                f"<tr><td>{name}</td><td>{escape(check.column.label)}</td><td class=n>{check.worst_text}</td>"
                f"<td class=n>{number_text(check.limit, 6)} {escape(check.column.unit)}</td><td>{bar_html(check)}</td>"
                f'<td class="cl-{state}">{check.state.value}</td><td class="cl-reason">{escape(check.reason)}</td></tr>'
            )
    head = "".join(
        f"<th{' class=n' if name in ('worst', 'limit value') else ''}>{name}</th>"
        for name in ("variant", "limit", "worst", "limit value", "share", "state", "reason")
    )
    return f'<table class="cl-limits"><thead><tr>{head}</tr></thead><tbody>{"".join(rows)}</tbody></table>'


class ShapePanel:
    """A result without a motion."""

    def __init__(self) -> None:
        self.box = ui.element("div").classes("cl-home").mark("shape")
        self.box.set_visibility(False)

    def close(self) -> None:
        """Show nothing."""
        self.box.clear()
        self.box.set_visibility(False)

    def open(self, result: Result) -> None:
        """Show a result."""
        self.box.clear()
        self.box.set_visibility(True)
        with self.box, ui.element("div").classes("cl-card"):
            with ui.element("div").classes(f"cl-verdict cl-open cl-{VERDICTS[result.verdict]}"):
                with ui.element("div").classes("cl-answer"):
                    ui.label(result.verdict.value).classes("cl-word").mark("verdict")
                    ui.html(critical_html(result), sanitize=True).mark("answer")
                ui.label(result.first_lines[0]).classes("cl-message").props("role=status")
                for line in result.first_lines[1:]:
                    ui.label(line).classes("cl-lines")
            for change in result.changes:
                ui.label(f"change: {change.line_text}")
            ui.html(variant_table(result), sanitize=True).classes("cl-scroll").props("tabindex=0").mark("variants")
            for one in (m for m in result.maps if len(m.faces)):
                ui.label(shape_note(one)).classes("cl-note")
                ui.plotly(shape_figure(one)).classes("cl-shape")
            for finding in result.findings:
                ui.label(str(finding)).classes("cl-note")
