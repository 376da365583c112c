"""The panel with the linked plots of chosen columns; the cursor follows the row, a click selects one."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from nicegui import ui

from chipload.report.colouring import FIRST
from chipload.web.checks import Bound, label_and_unit
from chipload.web.comparison import Side
from chipload.web.panels import RELEASE
from chipload.web.plots import POINTS, abscissa, annotation, bounds_of, plots
from chipload.web.result import PageResult, PageTrack, TextColumn

#: a click on a plot gives the abscissa of the nearest point
CLICK = "(e) => { if (e.points && e.points.length) emit(e.points[0].x) }"
#: a zoom gives the ends of its part of the abscissa, its undoing none; what the page itself changes is no zoom
ZOOM = """(e) => { if (!e || !Object.keys(e).some((k) => k.startsWith('xaxis.'))) return;
    const [a, b] = e['xaxis.range'] ?? [e['xaxis.range[0]'], e['xaxis.range[1]']];
    emit([Number(a), Number(b)].every(Number.isFinite) ? [Number(a), Number(b)] : []); }"""
#: columns that are drawn at a time, and at first
MOST, AT_FIRST = 4, 2


class PlotPanel:
    """The plots of a track."""

    def __init__(self, pick: Callable[[int], None], turned: Callable[[], None]) -> None:
        self.pick, self.turned = pick, turned
        self.result: PageResult | None = None
        self.track: PageTrack | None = None
        self.row, self.drawn = 0, -1
        self.bounds: dict[str, Bound | None] = {}
        self.sides: tuple[Side, ...] = ()
        self.zoomed: tuple[float, float] | None = None
        with ui.element("div").classes("cl-panel cl-plots").props('role=region aria-label="plots"'):
            with ui.element("div").classes("cl-head"):
                self.columns = ui.select({}, multiple=True, on_change=self._change_columns).props(
                    f"dense options-dense borderless use-chips hide-bottom-space max-values={MOST} aria-label=columns"
                ).classes("cl-columns").mark("columns")  # fmt: skip
                self.columns.on("popup-hide", js_handler=RELEASE)
                self.against = ui.toggle(
                    {"time": "time", "path": "path"}, value="time", on_change=self._change_abscissa
                ).props("dense no-caps size=sm unelevated toggle-color=blue-grey-7")
            self.figure = ui.plotly({"data": [], "layout": {}, "config": {}}).classes("cl-figure")
            self.figure.on("plotly_click", self._on_click, js_handler=CLICK)
            self.figure.on("plotly_relayout", self._on_zoom, js_handler=ZOOM)

    def compare(self, sides: tuple[Side, ...]) -> None:
        """Draw other tracks over the own one, the first of ``sides``; empty: it alone."""
        self.sides = sides
        self._draw()

    def open(self, result: PageResult, track: PageTrack, row: int = 0) -> None:
        """Show a track, the cursor at a row."""
        same = self.result is result
        self.sides, self.zoomed = (), None
        self.result, self.track, self.row = result, track, row
        if not same:
            options = {c: _column_label(c) for c in result.columns}
            kept = [c for c in self.columns.value or [] if c in options]
            first = [c for c in FIRST if c in options and not _flat(result, track, c)][:AT_FIRST]
            self.columns.set_options(options, value=kept or first or [result.columns[0]])
        self._draw()

    def at(self, row: int) -> None:
        """Put the cursor at a row, and show the values there."""
        self.row = row
        if self.result is None or self.track is None or self.drawn == row:
            return
        self.drawn = row
        x = float(abscissa(self.track, self.against.value)[row])
        change: dict[str, Any] = {"shapes[0].x0": x, "shapes[0].x1": x}
        for k, (column, bound) in enumerate(self.bounds.items()):
            change[f"annotations[{k}].text"] = annotation(
                self.result, self.track, column, row, bound, self.sides, self.against.value
            )
        self.figure.run_plot_method("relayout", change)

    def _chosen_columns(self) -> list[str]:
        return [c for c in self.columns.value or [] if isinstance(c, str)][:MOST]

    def _draw(self) -> None:
        if self.result is not None and self.track is not None:
            self.bounds = bounds_of(self.result, self.track, self._chosen_columns())
            figure = plots(self.result, self.track, self.bounds, self.against.value, self.row, self.sides, self.zoomed)
            self.figure.update_figure(figure)
            self.drawn = self.row

    def _change_columns(self) -> None:
        self._draw()

    def _change_abscissa(self) -> None:
        self.zoomed = None
        self._draw()
        self.turned()

    def _on_zoom(self, event: Any) -> None:
        """Draw the part that is zoomed into with as many points as the whole had."""
        ends = [float(x) for x in event.args] if isinstance(event.args, list) else []
        zoomed = (min(ends), max(ends)) if len(ends) == 2 else None
        if self.track is None or self.result is None or zoomed == self.zoomed:
            return
        self.zoomed = zoomed
        if len(self.track) > POINTS:
            self._draw()

    def _on_click(self, event: Any) -> None:
        if self.track is not None and isinstance(event.args, (int, float)):
            x = abscissa(self.track, self.against.value)
            self.pick(nearest(x, float(event.args)))


def nearest(x: Any, value: float) -> int:
    """Row of the nearest of rising numbers.

    >>> nearest(np.array([0.0, 1.0, 4.0]), 2.9)
    2
    """
    k = int(np.clip(np.searchsorted(x, value), 1, max(len(x) - 1, 1)))
    return k - 1 if len(x) == 1 or abs(x[k - 1] - value) <= abs(x[min(k, len(x) - 1)] - value) else k


def _flat(result: PageResult, track: PageTrack, column: str) -> bool:
    values = result.column(track, column)
    return isinstance(values, TextColumn) or not np.nanmax(np.abs(np.nan_to_num(values)), initial=0.0) > 0.0


def _column_label(column: str) -> str:
    word, unit = label_and_unit(column)
    return f"{word} [{unit}]" if unit else word
