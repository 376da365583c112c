"""The override gauge: the feed override of the step, and its torque against the allowable one."""

from __future__ import annotations

from collections.abc import Mapping
from html import escape
from typing import Any

from nicegui import ui

from chipload.number_text import number_text
from chipload.web.result import PageResult, PageTrack, TextColumn

#: columns that are shown where a track has the first of them
OVERRIDE, STATE, TORQUE, ALLOWED, PLANNED = (
    "override", "override_state", "torque_nm", "torque_allowable_nm", "torque_planned_nm",
)  # fmt: skip


class OverrideGauge:
    """Bars of the override and of the torque over what is allowable, at the row of the other panels."""

    def __init__(self) -> None:
        self.html = ui.html("", sanitize=True).classes("cl-over cl-gauge").props('role=img aria-label="override"')
        self.html.set_visibility(False)
        self.columns: dict[str, Any] = {}

    def open(self, result: PageResult, track: PageTrack) -> None:
        """Show the override of a track, if it has one."""
        known = OVERRIDE in result.columns
        names = [c for c in (OVERRIDE, STATE, TORQUE, ALLOWED, PLANNED) if known and c in result.columns]
        self.columns = {name: result.column(track, name) for name in names}
        self.html.set_visibility(known)

    def at(self, row: int) -> None:
        """Stand at a row."""
        if self.columns:
            self.html.set_content(gauge({name: _value_in_row(column, row) for name, column in self.columns.items()}))


def _value_in_row(column: Any, row: int) -> float | str:
    """Value of a row, or its word."""
    return column.words[column.codes[row]] if isinstance(column, TextColumn) else float(column[row])


def gauge(values: Mapping[str, float | str]) -> str:
    """Gauge as HTML, of the columns of a row.

    >>> gauge({"override": 0.83}).count("cl-gauge-bar")
    1
    >>> "width:75.0%;background:#2f5d8a" in gauge({"override": 1.0, "torque_nm": 1.5, "torque_allowable_nm": 2.0})
    True
    """
    override = float(values[OVERRIDE])
    lines = [_bar("override", f"{100.0 * override:.0f} %", override, False)]
    if TORQUE in values and ALLOWED in values and float(values[ALLOWED]) > 0.0:
        torque, allowed = float(values[TORQUE]), float(values[ALLOWED])
        lines.append(
            _bar(
                "torque",
                f"{number_text(torque, 3)} of {number_text(allowed, 3)} N m",
                torque / allowed,
                torque > allowed,
            )
        )
    if PLANNED in values:
        lines.append(f"<div>planned {number_text(float(values[PLANNED]), 3)} N m</div>")
    if STATE in values:
        lines.append(f"<div>{escape(str(values[STATE]))}</div>")
    return "".join(lines)


def _bar(name: str, text: str, share: float, over: bool) -> str:
    colour = "#c81e1e" if over else "#2f5d8a"
    width = 100.0 * min(max(share, 0.0), 1.0)
    return (
        f"<div>{escape(name)} {escape(text)}</div><div class='cl-gauge-bar'>"
        f"<b style='width:{width:.1f}%;background:{colour}'></b></div>"
    )
