"""The panel of a result without a motion, as of a distortion: verdict, limits, and its displaced surfaces."""

from __future__ import annotations

from nicegui import ui

from chipload.number_text import number_text
from chipload.report.shape_figure import shape_figure, shape_note
from chipload.result import Result
from chipload.web.result_view import VERDICTS


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
                ui.label(result.verdict.value).classes("cl-word")
                ui.label(result.first_lines[0]).classes("cl-message")
            for line in result.first_lines[1:]:
                ui.label(line)
            for check in (c for track in result.in_use for c in track.limits):
                worst = "not known" if check.worst is None else number_text(check.worst)
                unit, why = check.column.unit, f": {check.reason}" if check.reason else ""
                limit = number_text(check.limit, 6)
                ui.label(f"{check.column.label} {worst} of {limit} {unit}, {check.state.value}{why}")
            for one in (m for m in result.maps if len(m.faces)):
                ui.label(shape_note(one)).classes("cl-note")
                ui.plotly(shape_figure(one)).classes("cl-shape")
            for finding in result.findings:
                ui.label(str(finding)).classes("cl-note")
