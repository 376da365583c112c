"""One result on the page: its panels and their common row.

The row is the one thing that moves: slider, plots, lines, table and keys set it, every panel follows.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from nicegui import ui

from chipload.report.answer import answer_html
from chipload.result import Verdict
from chipload.result.changes import Change, ChangeKind
from chipload.web.asset_cache import AssetCache
from chipload.web.checks import row_of
from chipload.web.comparison import COLOURS, MOST, Side
from chipload.web.panels import RELEASE
from chipload.web.panels.comparison import ComparisonPanel
from chipload.web.panels.cut import CutPanel
from chipload.web.panels.limits import CLICK, LimitPanel
from chipload.web.panels.loads import LinePanel, ToolPanel, sequence
from chipload.web.panels.plots import PlotPanel, nearest
from chipload.web.panels.scene import ScenePanel, Standing
from chipload.web.panels.source import SourcePanel
from chipload.web.plots import abscissa
from chipload.web.result import PageResult, PageTrack
from chipload.web.scene import bodies

#: seconds that a whole track takes where no speed is chosen
WHOLE = 30.0
SPEEDS = {0: "30 s", 0.1: "\u00d70.1", 1: "\u00d71", 3: "\u00d73", 10: "\u00d710", 30: "\u00d730", 100: "\u00d7100"}
#: classes of a verdict
VERDICTS = {Verdict.HOLDS: "ok", Verdict.UNPROVEN: "may", Verdict.EXCEEDS: "no"}
#: what is said where nothing is left open
ALL_CHECKED = "Every limit and check that is stated holds for all cuts."
#: steps of the slider
STEPS = 4000
#: a turn of the wheel: its direction, with Shift (which some systems turn sideways) twice it
WHEEL = "(e) => { e.preventDefault(); emit(Math.sign(e.deltaY)); }"
WHEEL_SHIFT = "(e) => { e.preventDefault(); emit(Math.sign(e.deltaY || e.deltaX) * (e.shiftKey ? 2 : 1)); }"
#: tables and pictures next to the 3D view
TABLES = {"limits": "limits", "cut": "cut", "tools": "tools", "lines": "lines", "compare": "compare"}


class ResultView:
    """A result with its slider."""

    def __init__(self, assets: AssetCache) -> None:
        self.result: PageResult | None = None
        self.track: PageTrack | None = None
        self.row = 0
        self.playing = False
        #: the view was told to stop and has not reported its row yet
        self.stopping = False
        self.turn = asyncio.Lock()
        self.sides: tuple[Side, ...] = ()
        #: track and row of the limit with the least margin
        self.critical: tuple[PageTrack, int | None] | None = None
        #: whether the job of the result can be run with lower feeds, and what runs it
        self.can_run: Callable[[], bool] = lambda: False
        self.run_change: Callable[[Change], None] = lambda _: None
        #: called when another program of the sequence is shown
        self.moved_on: Callable[[int], None] = lambda _: None
        with ui.element("div").classes("cl-verdict") as self.verdict:
            with ui.element("div").classes("cl-answer"):
                self.word = ui.label("").classes("cl-word").mark("verdict")
                self.answer = ui.html("", sanitize=True).mark("answer")
                self.answer.on("click", self._go_to_critical, js_handler=CLICK)
            with ui.element("div").classes("cl-rest"):
                self.more = ui.label("").classes("cl-more").mark("more")
                self.fold = ui.button("all", on_click=self._unfold).props(
                    'flat dense no-caps aria-label="the whole message" aria-expanded=false'
                ).classes("cl-fold").mark("fold")  # fmt: skip
                self.fold.on("mousedown.prevent")
            self.changes = ui.element("div").classes("cl-changes").mark("changes")
            self.message = ui.label("").classes("cl-message").props("role=status")
            self.lines_below = ui.label("").classes("cl-lines")
        with ui.element("div").classes("cl-body"):
            with ui.element("div").classes("cl-left"):
                self.scene = ScenePanel(assets, self._row_reported)
                self.plots = PlotPanel(self.pick, self._change_slider)
            with ui.element("div").classes("cl-right"):
                with ui.element("div").classes("cl-panel cl-tables"):
                    self.table = ui.toggle(TABLES, value="limits", on_change=self._show_table).props(
                        "dense no-caps size=sm unelevated toggle-color=blue-grey-7"
                    ).classes("cl-tabs").mark("tables")  # fmt: skip
                    self.limits = LimitPanel(self.find)
                    self.cut = CutPanel()
                    self.tools = ToolPanel(self._go_to_row)
                    self.lines = LinePanel(self._go_to_row)
                    self.compared = ComparisonPanel()
                self._show_table()
                self.source = SourcePanel(self.pick)
        with ui.element("div").classes("cl-foot"):
            self._button("first_page", "to the beginning (Home)", lambda: self.go(0))
            self._button("chevron_left", "back (\u2190)", lambda: self.move(-1))
            self.play = self._button("play_arrow", "play (Space)", self.toggle).mark("play")
            self._button("chevron_right", "on (\u2192)", lambda: self.move(1))
            self._button("last_page", "to the end (End)", lambda: self.go(len(self.track or ()) - 1))
            self.speed = (
                ui.select(SPEEDS, value=0)
                .props('dense options-dense borderless aria-label="speed"')
                .classes("cl-speed")
            )
            self.speed.on("popup-hide", js_handler=RELEASE)
            self.speed.on("wheel.prevent", lambda e: self.change_speed(-1 if e.args > 0 else 1), js_handler=WHEEL)
            with self.speed:
                ui.tooltip("the whole track in 30 s, or a multiple of the machine's speed")
            self.slider = (
                ui.slider(min=0.0, max=1.0, step=0.001, value=0.0).props('dense aria-label="step"').classes("cl-slider")
            )
            self.slider.mark("slider")
            self.slider.on("update:model-value", self._slider_moved, throttle=0.05)
            # the 3D view follows at once, the other panels when the server has answered
            self.slider.on("update:model-value", js_handler=self.scene.slide)
            self.slider.on("change", js_handler=RELEASE)
            self.slider.on("wheel.prevent", self._turn_wheel, js_handler=WHEEL_SHIFT)
            self.where = ui.label("").classes("cl-where").mark("where")

    async def open(self, result: PageResult) -> None:
        """Show a result at the place of its critical limit."""
        async with self.turn:
            await self._open(result)

    async def follow(self, k: int) -> None:
        """Show another track of the result."""
        async with self.turn:
            if self.result is None or not 0 <= k < len(self.result.tracks) or self.track is self.result.tracks[k]:
                return
            self.pause()
            await self._stop_comparing()
            self.track = self.result.tracks[k]
            await self.scene.follow(self.result, self.track)
            await self._show_track(self.result, self.track)

    async def compare(self, others: Sequence[tuple[PageResult, PageTrack, str]]) -> None:
        """Show other tracks next to the own one and over it; empty: it alone."""
        async with self.turn:
            if self.result is None or self.track is None:
                return
            self.pause()
            if not others:
                await self._stop_comparing()
                return
            every = [(self.result, self.track, self.track.title), *others][:MOST]
            self.sides = tuple(Side(*side, COLOURS[k]) for k, side in enumerate(every))
            self.plots.compare(self.sides)
            found = await asyncio.to_thread(bodies, self.sides[1].result)
            await self.scene.compare(self.sides, found)
            self.table.set_value("compare")
            self.compared.show(self.sides, self.plots.against.value)
            self.go(self.row)

    async def _stop_comparing(self) -> None:
        """Compare no longer."""
        if self.sides:
            self.sides = ()
            self.plots.compare(())
            self.compared.show((), self.plots.against.value)
            await self.scene.compare((), None)

    def first(self) -> None:
        """Stand at the worst that was found, or at the beginning."""
        self.go(self.row)
        if self.scene.marks:
            self.scene.show(0, near=bool(self.scene.marks[0].bodies))

    def find(self, row: int) -> None:
        """A limit or a finding requests its row; the bodies that touch there are shown."""
        self.pause()
        self.go(row)
        found = [k for k, m in enumerate(self.scene.marks) if m.row == row]
        touching = [k for k in found if self.scene.marks[k].bodies]
        if found:
            self.scene.show((touching or found)[0])

    def pick(self, row: int) -> None:
        """A panel requests a row; below 0: it requests the current one."""
        self.go(row if row >= 0 else self.row)

    def go(self, row: int) -> None:
        """Stand at a row."""
        if self.track is None:
            return
        self.stopping = False
        self.row = int(np.clip(row, 0, len(self.track) - 1))
        self.slider.set_value(float(abscissa(self.track, self.plots.against.value)[self.row]))
        self.scene.at(self.row)
        self._show_views(self.track)

    def move(self, rows: int) -> None:
        """Some rows on, or back."""
        self.pause()
        self.go(self.row + rows)

    def line(self, by: int) -> None:
        """To the next line of the program that moves, or the one before."""
        self.pause()
        row = self.source.step(self.row, by) if self.track is not None else None
        if row is not None:
            self.go(row)

    def change_speed(self, by: int) -> None:
        """Play at the next faster or slower speed of the list; what plays goes on at it."""
        speeds = sorted(SPEEDS)[1:]
        now = speeds.index(self.speed.value) if self.speed.value in speeds else -1
        self.speed.set_value(speeds[min(max(now + by, 0), len(speeds) - 1)])
        if self.playing:
            self.scene.play(float(self.speed.value))

    def _turn_wheel(self, event: Any) -> None:
        """The wheel was turned over the slider: a step, or a line of the program."""
        if event.args in (-1, 1):
            self.move(event.args)
        elif event.args in (-2, 2):
            self.line(event.args // 2)

    def toggle(self) -> None:
        """Play, or stop playing."""
        if self.playing:
            self.pause()
            self.stopping = True
        elif self.track is not None:
            if self.row >= len(self.track) - 1:
                self.go(0)
            self.playing, self.stopping = True, False
            self.play.props('icon=pause aria-label="pause (Space)"')
            t, speed = self.track.t, float(self.speed.value or 0)
            self.scene.play(speed if speed > 0.0 else max(float(t[-1] - t[0]), 1e-3) / WHOLE)

    def pause(self) -> None:
        """Stop playing."""
        if self.playing:
            self.scene.play(0.0)
        self.playing = False
        self.play.props('icon=play_arrow aria-label="play (Space)"')

    # -- parts --------------------------------------------------------------------------------------------------
    async def _open(self, result: PageResult) -> None:
        self.pause()
        await self._stop_comparing()
        track = result.tracks[result.first]
        self.result, self.track = result, track
        verdict, message = result.result.verdict, result.result.message
        for state in VERDICTS.values():
            self.verdict.classes(remove=f"cl-{state}")
        self.verdict.classes(f"cl-{VERDICTS[verdict]}")
        self.word.set_text(verdict.value)
        critical = result.result.critical
        shown = critical is not None and any(check is critical for check in track.own.limits)
        self.critical = (track, row_of(track, critical)) if shown and critical is not None else None
        row = None if self.critical is None else self.critical[1]
        self.answer.set_content(answer_html(critical, row, result.result.critical_program))
        self.more.set_text(" ".join(result.result.open_lines) or ALL_CHECKED)
        self._show_changes(await asyncio.to_thread(lambda: result.result.changes))
        self.message.set_text(message)
        self.lines_below.set_text("\n".join(result.result.first_lines[1:]))
        await self.scene.open(result, track)
        await self._show_track(result, track)

    async def _show_track(self, result: PageResult, track: PageTrack) -> None:
        self.limits.open(result, track)
        self.tools.open(result, track)
        self.scene.override.open(result, track)
        marks = self.scene.marks
        self.row = marks[0].row if marks else 0
        self.plots.open(result, track, self.row)
        self._change_slider()
        await self.source.open(result, track)
        self.lines.open(result, track, self.source.text)
        self.first()

    def _show_changes(self, changes: Sequence[Change]) -> None:
        """Show what would settle the limits that do not hold; a lower feed can be run where the job is known."""
        self.changes.clear()
        self.changes.set_visibility(bool(changes))
        with self.changes:
            if changes:
                ui.label("What to change").classes("cl-changes-title")
            for change in changes:
                with ui.element("div").classes("cl-change"):
                    ui.label(change.line_text)
                    if change.kind is ChangeKind.FEED and self.can_run():
                        ui.button("Try", on_click=lambda c=change: self.run_change(c)).props(
                            'flat dense no-caps aria-label="run the job with feeds within the limits and compare"'
                        ).mark("try")  # fmt: skip

    async def _go_to_critical(self, event: Any) -> None:
        """The place of the critical limit is clicked."""
        if self.result is not None and self.critical is not None and isinstance(event.args, int):
            await self._go_to_row(self.result.tracks.index(self.critical[0]), event.args)

    def _unfold(self) -> None:
        """Show the whole message, or its most important part."""
        unfolds = "cl-open" not in self.verdict.classes
        self.verdict.classes(**{"add" if unfolds else "remove": "cl-open"})
        self.fold.set_text("less" if unfolds else "all")
        self.fold.props(f"aria-expanded={'true' if unfolds else 'false'}")

    def _change_slider(self) -> None:
        """The slider counts as the plots do."""
        if self.track is None:
            return
        x = abscissa(self.track, self.plots.against.value)
        self.scene.against(self.plots.against.value)
        if self.sides:
            self.compared.show(self.sides, self.plots.against.value)
        low, high = float(x[0]), float(x[-1]) if x[-1] > x[0] else float(x[0]) + 1.0
        self.slider.props.update({"min": low, "max": high, "step": (high - low) / STEPS})
        self.slider.update()
        self.slider.set_value(float(x[self.row]) if self.row < len(x) else low)

    def _show_table(self) -> None:
        """Show the table that is chosen."""
        chosen = self.table.value
        self.limits.box.set_visibility(chosen == "limits")
        self.cut.show(self.scene.view_id if chosen == "cut" else "")
        self.tools.html.set_visibility(chosen == "tools")
        self.lines.box.set_visibility(chosen == "lines")
        self.compared.html.set_visibility(chosen == "compare")
        if self.track is not None and chosen == "tools":
            self.tools.at(self.row)

    async def _go_to_row(self, number: int, row: int) -> None:
        """A table requests a row, of another track where it names one."""
        if self.result is None or self.track is None:
            return
        if 0 <= number < len(self.result.tracks) and self.result.tracks[number] is not self.track:
            await self.follow(number)
            self.moved_on(number)
        self.find(row)

    async def _next(self) -> None:
        """Play the program that is run after this one, where there is one."""
        if self.result is None or self.track is None or self.sides:
            return
        order = sequence(self.result, self.track)
        place = order.index(self.track) + 1
        if place < len(order):
            number = self.result.tracks.index(order[place])
            await self.follow(number)
            self.moved_on(number)
            self.go(0)
            self.toggle()

    def _slider_moved(self, event: Any) -> None:
        if self.track is None or not isinstance(event.args, (int, float)):
            return
        self.pause()
        self.stopping = False
        self.row = nearest(abscissa(self.track, self.plots.against.value), float(event.args))
        self._show_views(self.track)

    async def _row_reported(self, row: int, why: Standing) -> None:
        """The 3D view stands at a row: it plays or was stopped, or its path was clicked."""
        if self.track is None:
            return
        if why is Standing.CLICKED:
            self.pause()
            self.go(row)
        elif why is Standing.STOPPED:
            if self.stopping:
                self.go(row)
        elif self.playing:  # else a message that was on its way when it was stopped
            self.row = int(np.clip(row, 0, len(self.track) - 1))
            self.slider.set_value(float(abscissa(self.track, self.plots.against.value)[self.row]))
            self._show_views(self.track)
            if why is Standing.ENDED:
                self.pause()
                await self._next()

    def _show_views(self, track: PageTrack) -> None:
        k = self.row
        self.plots.at(k)
        self.source.at(k)
        self.scene.override.at(k)
        if self.table.value == "tools":
            self.tools.at(k)
        x, y, z = track.place[k].tolist()
        clock = f"{track.t[k]:.2f} of {track.t[-1]:.2f} s \u00b7 "
        line = f" \u00b7 line {int(self.source.text.of_row[k])}" if self.source.text is not None else ""
        self.where.set_text(f"{clock}step {k + 1} of {len(track)}{line} \u00b7 X {x:.3f} Y {y:.3f} Z {z:.3f}")

    def _button(self, icon: str, tip: str, act: Callable[[], None]) -> Any:
        button = ui.button(icon=icon, on_click=lambda: act()).props(f'flat dense round size=sm aria-label="{tip}"')
        button.on("mousedown.prevent")
        with button:
            ui.tooltip(tip)
        return button
