"""The panel with the tools over time and the program lines by load; a click selects the place."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Sequence
from html import escape
from typing import Any

from nicegui import ui

from chipload.number_text import number_text
from chipload.web.checks import label_and_unit
from chipload.web.loads import Ints, LineLoad, ToolUse, line_loads, shown_loads, tool_uses
from chipload.web.panels import RELEASE
from chipload.web.result import PageResult, PageTrack
from chipload.web.source import TrackText

#: a click gives the number of the track and the row of its history
CLICK = (
    "(e) => { const r = e.target.closest('[data-row]');"
    " if (r) emit([Number(r.dataset.track || -1), Number(r.dataset.row)]) }"
)
#: colours of the bars of tools, one after another
COLOURS = ("#1f5fa8", "#d17a00", "#0b7a75", "#8a4fa3", "#6b7683")
#: share of the time below which a bar is drawn as wide as this, in percent
THIN = 0.15


class ToolPanel:
    """When each tool cuts, how long and how far, and its greatest loads."""

    def __init__(self, pick: Callable[[int, int], Awaitable[None]]) -> None:
        self.pick = pick
        self.track: PageTrack | None = None
        self.starts: dict[int, float] = {}
        self.whole = 1.0
        self.html = _table_box(self._on_click).mark("tools")

    def open(self, result: PageResult, track: PageTrack) -> None:
        """Show the tools of a track, or of all programs that are run one after another."""
        self.track = track
        shown = sequence(result, track)
        self.starts, self.whole = {}, 0.0
        uses: list[tuple[int, PageTrack, ToolUse]] = []
        for one in shown:
            number = result.tracks.index(one)
            self.starts[number] = self.whole
            self.whole += float(one.t[-1])
            uses += [(number, one, use) for use in tool_uses(result, one)]
        self.whole = max(self.whole, 1e-9)
        self.number = result.tracks.index(track)
        self.html.set_content(tool_table(uses, shown_loads(result, track), self.starts, self.whole))

    def at(self, row: int) -> None:
        """Put the cursor of the timeline at a row."""
        if self.track is not None:
            share = 100.0 * (self.starts.get(self.number, 0.0) + float(self.track.t[row])) / self.whole
            cursors = f"document.querySelectorAll('#c{self.html.id} .cl-time-now')"
            ui.run_javascript(f"{cursors}.forEach(e => e.style.left = '{share:.3f}%')")

    async def _on_click(self, event: Any) -> None:
        if isinstance(event.args, list) and len(event.args) == 2:
            await self.pick(int(event.args[0]), int(event.args[1]))


class LinePanel:
    """Lines of the program by one of their loads, the greatest first."""

    def __init__(self, pick: Callable[[int, int], Awaitable[None]]) -> None:
        self.pick = pick
        self.result: PageResult | None = None
        self.track: PageTrack | None = None
        self.line: Ints | None = None
        with ui.element("div").classes("cl-lines-box") as self.box:
            self.by = ui.select({}, label="by", on_change=self._draw).props(
                "dense options-dense outlined hide-bottom-space"
            ).classes("cl-colour").mark("lines-by")  # fmt: skip
            self.by.on("popup-hide", js_handler=RELEASE)
            self.html = _table_box(self._on_click).mark("lines")

    def open(self, result: PageResult, track: PageTrack, source: TrackText | None) -> None:
        """Show the lines of a track, as its text counts them."""
        self.result, self.track = result, track
        self.line = source.of_row if source is not None else track.line
        options = {c: label_and_unit(c)[0] for c in shown_loads(result, track)}
        chosen = self.by.value if self.by.value in options else next(iter(options), None)
        self.by.set_options(options, value=chosen)
        self._draw()

    def _draw(self) -> None:
        if self.result is None or self.track is None:
            return
        by = self.by.value
        if not isinstance(by, str):
            self.html.set_content(NO_LOAD)
        else:
            lines = [] if self.line is None else line_loads(self.result, self.track, self.line, by)
            self.html.set_content(line_table(lines, by))

    async def _on_click(self, event: Any) -> None:
        if isinstance(event.args, list) and len(event.args) == 2:
            await self.pick(-1, int(event.args[1]))


NO_LOAD = '<div class="cl-none">The history of this track has no force, torque, deflection or engagement.</div>'


def sequence(result: PageResult, track: PageTrack) -> list[PageTrack]:
    """The tracks that are run one after another: all in use, in their order; one that is not in use stands alone."""
    used = sorted((t for t in result.tracks if t.own.in_use), key=lambda t: t.first)
    return used if track in used else [track]


def tool_table(
    uses: Sequence[tuple[int, PageTrack, ToolUse]], loads: Sequence[str], starts: dict[int, float], whole: float
) -> str:
    """Tools as HTML: a bar over time for each, and its numbers."""
    rows = []
    names = len({number for number, _, _ in uses}) > 1
    for k, (number, track, use) in enumerate(uses):
        tool = f"T{use.tool}" if use.tool else "cutter"
        label = f"{track.own.name}, {tool}" if names else tool
        bars = "".join(
            f'<b data-track="{number}" data-row="{p.first}" title="{escape(label)}: '
            f'{number_text(starts[number] + p.begin)} to {number_text(starts[number] + p.end)} s" '
            f'style="left:{100.0 * (starts[number] + p.begin) / whole:.3f}%;'
            f'width:{max(100.0 * (p.end - p.begin) / whole, THIN):.3f}%;background:{COLOURS[k % len(COLOURS)]}"></b>'
            for p in use.periods
        )
        rows.append(
            f'<div class="cl-time"><span>{escape(label)}</span><div class="cl-time-bar">{bars}'
            f'<i class="cl-time-now"></i></div></div>'
        )
    head = "".join(f"<th class=n>{escape(_axis_title(c))}</th>" for c in loads)
    body = []
    for number, track, use in uses:
        tool = f"T{use.tool}" if use.tool else "cutter"
        cells = "".join(
            f'<td class="n cl-go" data-track="{number}" data-row="{use.worst[c][1]}" title="go there">'
            f"{number_text(use.worst[c][0])}</td>" if c in use.worst else "<td class=n></td>"
            for c in loads
        )  # fmt: skip
        cut = "" if use.cut_s is None else number_text(use.cut_s)
        share = "" if use.cut_s is None or use.time_s <= 0.0 else f"{100.0 * use.cut_s / use.time_s:.0f}"
        length = "" if use.cut_mm is None else number_text(use.cut_mm)
        name = f"<td>{escape(track.own.name)}</td>" if names else ""
        body.append(
            f"<tr>{name}<td>{tool}</td><td class=n>{number_text(use.time_s)}</td><td class=n>{cut}</td>"
            f"<td class=n>{share}</td><td class=n>{length}</td>{cells}</tr>"
        )
    first = "<th>program</th>" if names else ""
    return (
        f'<div class="cl-times">{"".join(rows)}<div class="cl-time"><span></span><div class="cl-ends"><span>0 s</span>'
        f"<span>{number_text(whole)} s</span></div></div></div>"
        f'<table class="cl-limits cl-tools"><thead><tr>{first}<th>tool</th><th class=n>time [s]</th>'
        f"<th class=n>in cut [s]</th><th class=n>[%]</th><th class=n>length in cut [mm]</th>{head}</tr></thead>"
        f"<tbody>{''.join(body)}</tbody></table>"
    )


def line_table(lines: Sequence[LineLoad], by: str) -> str:
    """Lines by a load as HTML."""
    if not lines:
        return '<div class="cl-none">The history of this track names no lines of a program under load.</div>'
    columns = list(lines[0].worst)
    most = max(line.worst[by] for line in lines)
    head = "".join(f"<th class=n>{escape(_axis_title(c))}</th>" for c in columns)
    body = []
    for line in lines:
        share = 100.0 * line.worst[by] / most
        cells = "".join(f"<td class=n>{number_text(line.worst[c])}</td>" for c in columns)
        bar = f'<div class="cl-share"><div class="cl-plain-bar" style="width:{share:.0f}%"></div></div>'
        body.append(
            f'<tr data-row="{line.row}" class="cl-go" title="go there"><td class=n>{line.line}</td><td>{bar}</td>'
            f"{cells}<td class=n>{number_text(line.time_s)}</td></tr>"
        )
    return (
        f'<table class="cl-limits"><thead><tr><th class=n>line</th><th></th>{head}<th class=n>time [s]</th></tr>'
        f"</thead><tbody>{''.join(body)}</tbody></table>"
    )


def _axis_title(column: str) -> str:
    word, unit = label_and_unit(column)
    return f"{word} [{unit}]" if unit else word


def _table_box(clicked: Callable[[Any], Awaitable[None]]) -> Any:
    box = ui.html("", sanitize=True).classes("cl-scroll").props("tabindex=0")
    return box.on("click", clicked, js_handler=CLICK)
