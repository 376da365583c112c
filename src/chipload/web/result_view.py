"""One result on the page: its panels, and the row that they all stand at.

The row is the one thing that moves: slider, plots, lines, table and keys set it, every panel follows.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Any

import numpy as np
from nicegui import ui

from chipload.result import Verdict
from chipload.web.asset_cache import AssetCache
from chipload.web.panels import RELEASE
from chipload.web.panels.limits import LimitPanel
from chipload.web.panels.plots import PlotPanel, nearest
from chipload.web.panels.scene import ScenePanel
from chipload.web.panels.source import SourcePanel
from chipload.web.plots import abscissa
from chipload.web.result import PageResult, PageTrack

#: seconds that a whole track takes where no speed is chosen
WHOLE = 30.0
SPEEDS = {0: "30 s", 1: "\u00d71", 10: "\u00d710", 100: "\u00d7100"}
#: classes of a verdict
VERDICTS = {Verdict.HOLDS: "ok", Verdict.UNPROVEN: "may", Verdict.EXCEEDS: "no"}
#: steps of the slider
STEPS = 4000


class ResultView:
    """A result with its slider."""

    def __init__(self, assets: AssetCache) -> None:
        self.result: PageResult | None = None
        self.track: PageTrack | None = None
        self.row = 0
        self.playing = False
        self.turn = asyncio.Lock()
        with ui.element("div").classes("cl-verdict") as self.verdict:
            self.word = ui.label("").classes("cl-word").mark("verdict")
            self.message = ui.label("").classes("cl-message").props("role=status")
            with self.message:
                self.tip = ui.tooltip("").classes("cl-tip")
        with ui.element("div").classes("cl-body"):
            with ui.element("div").classes("cl-left"):
                self.scene = ScenePanel(assets, self._viewed)
                self.plots = PlotPanel(self.pick, self._turned)
            with ui.element("div").classes("cl-right"):
                self.limits = LimitPanel(self.find)
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
            with self.speed:
                ui.tooltip("the whole in 30 s, or times as fast as the machine")
            self.slider = (
                ui.slider(min=0.0, max=1.0, step=0.001, value=0.0).props('dense aria-label="step"').classes("cl-slider")
            )
            self.slider.mark("slider")
            self.slider.on("update:model-value", self._slid, throttle=0.05)
            # the 3D view follows at once, the other panels when the server has answered
            self.slider.on("update:model-value", js_handler=self.scene.slide)
            self.slider.on("change", js_handler=RELEASE)
            self.where = ui.label("").classes("cl-where").mark("where")

    async def open(self, result: PageResult) -> None:
        """Show a result from the beginning of its first track."""
        async with self.turn:
            await self._open(result)

    async def follow(self, k: int) -> None:
        """Show another track of the result."""
        async with self.turn:
            if self.result is None or not 0 <= k < len(self.result.tracks) or self.track is self.result.tracks[k]:
                return
            self.pause()
            self.track = self.result.tracks[k]
            await self.scene.follow(self.result, self.track)
            await self._tracked(self.result, self.track)

    def first(self) -> None:
        """Stand at the worst that was found, or at the beginning."""
        self.go(self.row)
        if self.scene.marks:
            self.scene.show(0)

    def find(self, row: int) -> None:
        """A limit or a finding asks for its row: what touches there is shown."""
        self.pause()
        self.go(row)
        found = [k for k, m in enumerate(self.scene.marks) if m.row == row]
        touching = [k for k in found if self.scene.marks[k].bodies]
        if found:
            self.scene.show((touching or found)[0])

    def pick(self, row: int) -> None:
        """A panel asks for a row; below 0: to be told again where it is."""
        self.go(row if row >= 0 else self.row)

    def go(self, row: int) -> None:
        """Stand at a row."""
        if self.track is None:
            return
        self.row = int(np.clip(row, 0, len(self.track) - 1))
        self.slider.set_value(float(abscissa(self.track, self.plots.against.value)[self.row]))
        self.scene.at(self.row)
        self._shown(self.track)

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

    def toggle(self) -> None:
        """Play, or stop playing."""
        if self.playing:
            self.pause()
        elif self.track is not None:
            if self.row >= len(self.track) - 1:
                self.go(0)
            self.playing = True
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
        track = result.tracks[0]
        self.result, self.track = result, track
        verdict, message = result.result.verdict, result.result.message
        for state in VERDICTS.values():
            self.verdict.classes(remove=f"cl-{state}")
        self.verdict.classes(f"cl-{VERDICTS[verdict]}")
        self.word.set_text(verdict.value)
        self.message.set_text(message)
        self.tip.set_text(message)
        await self.scene.open(result, track)
        await self._tracked(result, track)

    async def _tracked(self, result: PageResult, track: PageTrack) -> None:
        self.limits.open(result, track)
        marks = self.scene.marks
        self.row = marks[0].row if marks else 0
        self.plots.open(result, track, self.row)
        self._turned()
        await self.source.open(result, track)
        self.first()

    def _turned(self) -> None:
        """The slider counts as the plots do."""
        if self.track is None:
            return
        x = abscissa(self.track, self.plots.against.value)
        self.scene.against(self.plots.against.value)
        low, high = float(x[0]), float(x[-1]) if x[-1] > x[0] else float(x[0]) + 1.0
        self.slider.props.update({"min": low, "max": high, "step": (high - low) / STEPS})
        self.slider.update()
        self.slider.set_value(float(x[self.row]) if self.row < len(x) else low)

    def _slid(self, event: Any) -> None:
        if self.track is None or not isinstance(event.args, (int, float)):
            return
        self.pause()
        self.row = nearest(abscissa(self.track, self.plots.against.value), float(event.args))
        self._shown(self.track)

    def _viewed(self, row: int, playing: bool) -> None:
        """The 3D view stands at a row: it plays, or its path was clicked."""
        if self.track is None:
            return
        if not playing and not self.playing:
            self.go(row)
            return
        if not self.playing:  # a message that was on its way when it was stopped
            return
        self.row = int(np.clip(row, 0, len(self.track) - 1))
        self.slider.set_value(float(abscissa(self.track, self.plots.against.value)[self.row]))
        self._shown(self.track)
        if not playing:
            self.pause()

    def _shown(self, track: PageTrack) -> None:
        k = self.row
        self.plots.at(k)
        self.source.at(k)
        x, y, z = track.place[k].tolist()
        clock = f"{track.t[k]:.3f} of {track.t[-1]:.5g} s \u00b7 "
        line = f" \u00b7 line {int(self.source.text.of_row[k])}" if self.source.text is not None else ""
        self.where.set_text(f"{clock}step {k + 1} of {len(track)}{line} \u00b7 X {x:.3f} Y {y:.3f} Z {z:.3f}")

    def _button(self, icon: str, tip: str, act: Callable[[], None]) -> Any:
        button = ui.button(icon=icon, on_click=lambda: act()).props(f'flat dense round size=sm aria-label="{tip}"')
        button.on("mousedown.prevent")
        with button:
            ui.tooltip(tip)
        return button
