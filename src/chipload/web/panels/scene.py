"""The 3D view: bodies, stock at the row, path coloured by a column, cutter, marks.

The view itself runs in the browser (viewer/src, built into report/viewer/viewer.js): it moves by itself while a track
is played and reports the row. This module holds its controls and the calls to it.
"""

from __future__ import annotations

import asyncio
import contextlib
import html
import json
from collections.abc import Awaitable, Callable
from enum import StrEnum
from functools import partial
from typing import Any

from nicegui import ui

from chipload.report.colouring import FIRST, POINTS
from chipload.report.view import ViewMark, colouring_document
from chipload.web.asset_cache import AssetCache
from chipload.web.checks import label_and_unit
from chipload.web.comparison import Side, common_span, knots, matching_row
from chipload.web.panels import RELEASE
from chipload.web.panels.override import OverrideGauge
from chipload.web.result import PageResult, PageTrack
from chipload.web.scene import PageScene, bodies, colour_column, page_scene, view_path

#: names of views and what is said of them
VIEWS = {"iso": "from a corner", "top": "from above", "front": "from the front", "side": "from the side"}
#: boxes that are no bodies
GLASS, DRAPE, UPRIGHT = "see through", "values on stock", "tool upright"
#: the engaged sector and surface of the cutter
ENGAGED = "engagement"
#: end of the name of a map in the colours of its tolerance, as viewer/src/view.ts has it
BANDED = "|tolerance"
#: planes that cut the picture away
SECTIONS = {"": "no section", "x": "section X", "y": "section Y", "z": "section Z"}


class Standing(StrEnum):
    """Why the view reports its row."""

    PLAYING = "playing"
    STOPPED = "stopped"
    ENDED = "ended"
    CLICKED = "clicked"


class ScenePanel:
    """The 3D view of a result."""

    def __init__(self, assets: AssetCache, report_row: Callable[[int, Standing], Awaitable[None]]) -> None:
        self.assets, self.report_row = assets, report_row
        self.result: PageResult | None = None
        self.track: PageTrack | None = None
        self.scene: PageScene | None = None
        self.second_scene: PageScene | None = None
        self.found: Any = ((), "")
        self.seen: dict[str, bool] = {}
        self.sides: tuple[Side, ...] = ()
        self.counted = "time"
        with ui.element("div").classes("cl-panel cl-space").props('role=region aria-label="3D view"') as self.frame:
            self.stage = ui.element("div").classes("cl-stage")
            self.stage.on("viewrow", self._move_slider, js_handler="(e) => emit(e.detail)")
            self.second = ui.element("div").classes("cl-second")
            self.second.on("viewrow", self._moved_second, js_handler="(e) => emit(e.detail)")
            self.second.set_visibility(False)
            self.titles = [ui.label("").classes(f"cl-over cl-side cl-side-{k}") for k in range(2)]
            with ui.element("div").classes("cl-controls"):
                self.column = ui.select({}, label="path coloured by", on_change=lambda: self._recolour_path()).props(
                    "dense options-dense outlined hide-bottom-space"
                ).classes("cl-colour").mark("colour")  # fmt: skip
                self.column.on("popup-hide", js_handler=RELEASE)
                self.map = ui.select({"": "no map"}, value="", label="surface map", on_change=self._map).props(
                    "dense options-dense outlined hide-bottom-space"
                ).classes("cl-colour").mark("map")  # fmt: skip
                self.map.on("popup-hide", js_handler=RELEASE)
                self.bent = ui.slider(min=0.0, max=1.0, step=0.01, value=0.0, on_change=self._map).props(
                    'dense aria-label="scale of the deflection"'
                )
                self.bent.on("change", js_handler=RELEASE)
                self.factor = ui.label("").classes("cl-note").mark("factor")
                self.boxes = ui.element("div").classes("cl-layers")
                self.notice = ui.label("").classes("cl-notice")
            with ui.element("div").classes("cl-buttons"):
                for name, meaning in VIEWS.items():
                    self._button(name, f"look {meaning}", partial(self.view_from, name))
                self._button("measure", "measure between two places", self._measure).mark("measure")
                self._button("picture", "save the picture (PNG)", lambda: self._call("save('chipload.png')"))
                self._button("video", "record a video (WebM) until pressed again", lambda: self._call("record()"))
                with ui.element("div").classes("cl-section"):
                    self.axis = ui.select(SECTIONS, value="", on_change=self._section).props(
                        'dense options-dense borderless aria-label="section plane"'
                    ).classes("cl-axis").mark("section")  # fmt: skip
                    self.axis.on("popup-hide", js_handler=RELEASE)
                    self.share = ui.slider(min=0.0, max=1.0, step=0.005, value=0.5, on_change=self._section).props(
                        'dense aria-label="place of the section"'
                    ).classes("cl-share-slider")  # fmt: skip
                    self.share.on("change", js_handler=RELEASE)
                    self.share.set_visibility(False)
            self.override = OverrideGauge()
        self.measures = False

    @property
    def view_id(self) -> str:
        """The element that the view fills."""
        return f"c{self.stage.id}"

    @property
    def slide(self) -> str:
        """JavaScript that takes the value of the slider."""
        return (
            f"(v) => {{ const e = document.getElementById('{self.view_id}');"
            f" chiploadViewer.of('{self.view_id}').abscissa(v, e.dataset.against || 'time'); }}"
        )

    @property
    def marks(self) -> tuple[ViewMark, ...]:
        """Places that are marked in the view."""
        return () if self.scene is None else self.scene.marks

    def against(self, what: str) -> None:
        """What the slider counts: time or path."""
        self.counted = what
        self.stage.props(f"data-against={what}")
        if self.sides:
            here, there = (json.dumps(v.tolist()) for v in knots(self.sides[0], self.sides[1], what))
            second = f"chiploadViewer.of('c{self.second.id}')"
            self._first(f"lead({second}, '{what}', {here}, {there})")

    async def compare(self, sides: tuple[Side, ...], found: Any) -> None:
        """Show the first two sides next to each other; empty: the own track alone. ``found``: bodies of the second."""
        self.sides, self.second_scene = sides, None
        self.frame.classes(**{"add" if sides else "remove": "cl-two"})
        self.second.set_visibility(bool(sides))
        for k, title in enumerate(self.titles):
            title.set_text(sides[k].title if sides else "")
            title.style(f"color: {sides[k].colour if sides else 'inherit'}")
        if sides:
            await self._open_second(found)
        else:
            self._first("alone()")
        if sides is self.sides:
            await self._recolour_path(1)

    async def _open_second(self, found: Any) -> None:
        """The second view, led by the first."""
        sides, column = self.sides, str(self.column.value)
        other = sides[1]
        shown = column if column in other.result.columns else other.result.columns[0]
        scene = await asyncio.to_thread(
            page_scene, other.result, other.track, found, shown, common_span(sides[:2], column)
        )
        if sides is not self.sides:
            return
        self.second_scene = scene
        here, there = (json.dumps(v.tolist()) for v in knots(sides[0], other, self.counted))
        url, second = self.assets.put(scene.document), f"c{self.second.id}"
        ui.run_javascript(
            f"chiploadViewer.beside('{second}', '{url}', '{self.view_id}', '{self.counted}', {here}, {there})"
            ".then(() => {" + "".join(self._layer(name, on) for name, on in self.seen.items()) + "})"
        )

    async def open(self, result: PageResult, track: PageTrack) -> None:
        """Show a result from its beginning."""
        self.result, self.track = result, track
        self.found = await asyncio.to_thread(bodies, result)
        columns = {c: _column_label(c) for c in result.columns}
        chosen = self.column.value if self.column.value in columns else None
        self.track = None
        self.column.set_options(columns, value=chosen or next((c for c in FIRST if c in columns), result.columns[0]))
        await self.follow(result, track, keep=False)

    async def follow(self, result: PageResult, track: PageTrack, *, keep: bool = True) -> None:
        """Show another track of the same result."""
        if self.sides:
            await self.compare((), None)
        self.track = track
        scene = await asyncio.to_thread(page_scene, result, track, self.found, str(self.column.value))
        if track is not self.track:
            return
        self.scene = scene
        self._offer_maps(scene)
        few = f"The drawn path has about {POINTS} of its {len(track)} steps." if len(track) > POINTS else ""
        self.notice.set_text(" ".join(t for t in (scene.notice, few) if t))
        url = self.assets.put(scene.document)
        self._boxes(scene)
        ui.run_javascript(
            f"chiploadViewer.open('{self.view_id}', '{url}', {json.dumps(keep)}).then(() => {{"
            + "".join(self._layer(name, self.seen[name]) for name in self.seen)
            + "})"
        )

    def at(self, row: int) -> None:
        """Stand at a row."""
        if self.track is not None:
            self._first(f"go({int(row)})")

    def show(self, mark: int, *, near: bool = True) -> None:
        """Show what touches at a mark; ``near``: the picture shows its place alone."""
        self._first(f"show({int(mark)}, {json.dumps(near)})")

    def play(self, rate: float) -> None:
        """Play, in seconds of the machine in a second; 0 stops."""
        self._first(f"play({rate!r})")

    def view_from(self, name: str) -> None:
        """Look from a side, at everything."""
        self._first(f"look({json.dumps(name)})")

    # -- parts --------------------------------------------------------------------------------------------------
    def _first(self, what: str) -> None:
        """Call the own view; a second view follows."""
        if self.track is not None:
            ui.run_javascript(f"window.chiploadViewer && chiploadViewer.of('{self.view_id}').{what}")

    def _call(self, what: str) -> None:
        """Call every view that is shown."""
        self._first(what)
        if self.sides:
            ui.run_javascript(f"window.chiploadViewer && chiploadViewer.of('c{self.second.id}').{what}")

    async def _moved_second(self, event: Any) -> None:
        """The path of the second view was clicked: to the row of the own track that belongs there."""
        detail = event.args
        if self.sides and isinstance(detail, dict) and isinstance(detail.get("row"), int):
            row = min(max(detail["row"], 0), len(self.sides[1].track) - 1)
            if detail.get("why") == Standing.CLICKED:
                await self.report_row(matching_row(self.sides[1], self.sides[0], self.counted, row), Standing.CLICKED)

    async def _move_slider(self, event: Any) -> None:
        detail = event.args
        if isinstance(detail, dict) and isinstance(detail.get("row"), int) and detail.get("why") in set(Standing):
            await self.report_row(detail["row"], Standing(detail["why"]))

    async def _recolour_path(self, views: int = 2) -> None:
        """Colour the path by the column that is chosen, in the first views."""
        result, track, column, scene = self.result, self.track, self.column.value, self.scene
        if result is None or track is None or scene is None or not isinstance(column, str):
            return

        shown = [(self.view_id, Side(result, track, "", ""), scene)]
        if self.sides and self.second_scene is not None and column in self.sides[1].result.columns:
            shown.append((f"c{self.second.id}", self.sides[1], self.second_scene))
        span = common_span([side for _, side, _ in shown], column) if len(shown) > 1 else None

        def document(side: Side, own: PageScene) -> bytes:
            made = colour_column(side.result, side.track, column, own.removal, span)
            return colouring_document(made, view_path(side.result, side.track))

        for view, side, own in shown[:views]:
            data = await asyncio.to_thread(document, side, own)
            if (track, column) == (self.track, self.column.value):
                ui.run_javascript(f"chiploadViewer.paint('{view}', '{self.assets.put(data)}')")

    def _boxes(self, scene: PageScene) -> None:
        """A box for each thing that can be hidden."""
        names = [*scene.bodies, "path", "cutter"]
        names += [ENGAGED] if scene.engaged else []
        if scene.marks:
            names.append("marks")
        more = [GLASS] if scene.bodies else []
        if self.track is not None and (self.track.axis[:, 2] < 1.0 - 1e-9).any():
            more.append(UPRIGHT)
        if scene.removal is not None:
            more.append(DRAPE)
        self.seen = {n: self.seen.get(n, n not in scene.covered) for n in names} | {
            n: self.seen.get(n, False) for n in more
        }
        self.boxes.clear()
        with self.boxes:
            for name, on in self.seen.items():
                box = ui.checkbox(
                    _plain(name), value=on, on_change=lambda e, n=name: self._set_visible(n, bool(e.value))
                )
                box.props(f'dense size=xs aria-label="{html.escape(_plain(name))}"')
                box.on("update:model-value", js_handler=RELEASE)

    def _set_visible(self, name: str, wanted: bool) -> None:
        self.seen[name] = wanted
        if self.track is not None:
            ui.run_javascript(self._layer(name, wanted))

    def _layer(self, name: str, on: bool) -> str:
        """JavaScript that shows or hides a thing in every view."""
        value, special = json.dumps(on), {GLASS: "glass", DRAPE: "drape", UPRIGHT: "stands"}.get(name)
        what = f"{special}({value})" if special else f"layer({json.dumps(name)}, {value})"
        views = [self.view_id, *([f"c{self.second.id}"] if self.sides else [])]
        return "".join(f"chiploadViewer.of('{view}').{what};" for view in views)

    def _section(self) -> None:
        axis, share = str(self.axis.value or ""), float(self.share.value or 0.0)
        self.share.set_visibility(bool(axis))
        self._call(f"section({json.dumps(axis)}, {share!r})")

    def _offer_maps(self, scene: PageScene) -> None:
        """Surface maps to choose from; none is shown."""
        names = {one.name: f"{one.name}: {one.label}" for one in scene.maps}
        names |= {f"{one.name}{BANDED}": f"{one.name}: tolerance" for one in scene.maps if one.tolerance is not None}
        self.bent.set_value(0.0)
        self.map.set_options({"": "no map", **names}, value="")
        self.map.set_visibility(bool(names))
        self._map_controls()

    def _map_controls(self) -> None:
        name = str(self.map.value or "").removesuffix(BANDED)
        chosen = next((m for m in (self.scene.maps if self.scene else ()) if m.name == name), None)
        bends = chosen is not None and chosen.moved is not None
        self.bent.set_visibility(bends)
        self.factor.set_visibility(bends)

    async def _map(self) -> None:
        """Show the chosen map, deflected by the scale of the slider."""
        self._map_controls()
        if self.track is None or self.scene is None:
            return
        call = (
            f"chiploadViewer.of('{self.view_id}').map({json.dumps(self.map.value or '')}, {float(self.bent.value)!r})"
        )
        if not self.bent.visible:
            ui.run_javascript(call)
            return
        with contextlib.suppress(TimeoutError):
            found = await ui.run_javascript(call, timeout=30.0)
            self.factor.set_text(f"deflection x {float(found or 0.0):.3g}" if self.bent.value else "no deflection")

    def _measure(self) -> None:
        self.measures = not self.measures
        self._call(f"measuring({json.dumps(self.measures)})")

    def _button(self, text: str, tip: str, act: Callable[[], None]) -> Any:
        button = ui.button(text, on_click=lambda: act()).props(f'flat dense no-caps size=sm aria-label="{tip}"')
        button.on("mousedown.prevent")
        with button:
            ui.tooltip(tip)
        return button


def _column_label(column: str) -> str:
    word, unit = label_and_unit(column)
    return f"{word} [{unit}]" if unit else word


def _plain(name: str) -> str:
    """A node's name without the number of its operation."""
    head, _, tail = name.partition("-")
    return tail if head == "0" and tail else name
