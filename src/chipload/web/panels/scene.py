"""The 3D view: bodies, the path in the colours of a column, the cutter at the row, marks where a limit is exceeded."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Callable
from html import escape
from typing import Any

import numpy as np
from nicegui import ui
from numpy.typing import NDArray

from chipload.report.figures import SCALE
from chipload.result import Verdict
from chipload.web.asset_cache import AssetCache
from chipload.web.checks import label_and_unit, limits, row_of
from chipload.web.cutters import cutters_of
from chipload.web.panels import RELEASE
from chipload.web.result import PageResult, PageTrack
from chipload.web.scene import POINTS, Body, Scale, bodies, edges_glb, path_glb, radius

Floats = NDArray[np.float64]

BACKGROUND = "#eef1f5"
MARK = "#c81e1e"
#: the box that leaves of bodies their edges
CLEAR = "see through"
#: opening of the camera from below to above, width of the view by its height at least, and room around a box
FOV_DEG, ASPECT, MORE = 36.0, 2.0, 1.06
#: directions that the camera looks from
VIEWS = {"iso": (0.62, -1.0, 0.78), "top": (0.0, -0.001, 1.0), "front": (0.0, -1.0, 0.02), "side": (1.0, 0.0, 0.02)}
#: columns that a path is coloured by first, where the history has them
FIRST = ("engagement_deg", "force_n", "force_xy_n", "deflection_um", "form_error_um", "feed_mm_min")


class ScenePanel:
    """The 3D view of a result."""

    def __init__(self, assets: AssetCache, pick: Callable[[int], None]) -> None:
        self.assets, self.pick = assets, pick
        self.result: PageResult | None = None
        self.track: PageTrack | None = None
        self.box: tuple[Floats, Floats] = (np.zeros(3), np.ones(3))
        self.view: Any = None
        self.path: Any = None
        self.cutters: dict[int, Any] = {}
        self.marks: list[Any] = []
        self.layers: dict[str, Any] = {}
        self.seen: dict[str, bool] = {}
        self.bodies: tuple[Body, ...] = ()
        self.bodies_notice = ""
        with ui.element("div").classes("cl-panel cl-space") as self.frame:
            self.stage = ui.element("div").classes("cl-stage")
            with ui.element("div").classes("cl-over cl-over-left"):
                self.column = ui.select({}, label="path coloured by", on_change=self._recoloured).props(
                    "dense options-dense outlined hide-bottom-space"
                ).classes("cl-colour").mark("colour")  # fmt: skip
                self.column.on("popup-hide", js_handler=RELEASE)
                self.boxes = ui.element("div").classes("cl-layers")
            with ui.element("div").classes("cl-over cl-over-right"):
                for name in VIEWS:
                    ui.button(name, on_click=lambda n=name: self.view_from(n)).props("flat dense no-caps size=sm").on(
                        "mousedown.prevent"
                    )
            self.legend = ui.html("", sanitize=True).classes("cl-over cl-legend")
            self.notice = ui.label("").classes("cl-over cl-notice")

    async def open(self, result: PageResult, track: PageTrack) -> None:
        """Show a result from its beginning."""
        self.result, self.track = result, track
        found, notice = await asyncio.to_thread(bodies, result)
        lows = [t.place.min(axis=0) for t in result.tracks] + [b.low for b in found]
        highs = [t.place.max(axis=0) for t in result.tracks] + [b.high for b in found]
        self.box = (np.min(lows, axis=0), np.max(highs, axis=0))
        size = max(float(np.linalg.norm(self.box[1] - self.box[0])), 1e-3)
        self.stage.clear()
        self.path, self.cutters, self.marks, self.layers = None, {}, [], {}
        with self.stage:
            camera = ui.scene.perspective_camera(fov=FOV_DEG, near=size * 2e-3, far=size * 60.0)
            self.view = ui.scene(grid=False, camera=camera, background_color=BACKGROUND, fps=25).classes("cl-scene")
            self.view.axes_helper(0.12 * size)
        self.bodies = found
        await self._bodies()
        self.bodies_notice = notice
        self.view_from("iso", 0.0)
        columns = {c: _called(c) for c in result.columns}
        chosen = self.column.value if self.column.value in columns else None
        self.column.set_options(columns, value=chosen or next((c for c in FIRST if c in columns), result.columns[0]))
        await self.follow(result, track)

    async def follow(self, result: PageResult, track: PageTrack) -> None:
        """Show another track of the same result."""
        self.track = track
        size = 0.25 * float(np.linalg.norm(self.box[1] - self.box[0]))
        made, unknown = await asyncio.to_thread(cutters_of, result, track, size)
        for shape in (*self.cutters.values(), *self.marks):
            shape.delete()
        self.cutters = {n: self.view.gltf(self.assets.put(glb)).visible(False) for n, glb in made.items()}
        few = f"The path is drawn by some {POINTS} of its {len(track)} steps." if len(track) > POINTS else ""
        self.notice.set_text(" ".join(t for t in (self.bodies_notice, unknown, few) if t))
        self.marks = []
        mark = 4.0 * radius(track)
        for check in limits(track):
            row = row_of(track, check)
            if check.state is Verdict.EXCEEDS and row is not None:
                with self.view:
                    ball = self.view.sphere(mark, 16, 12).material(MARK).move(*track.place[row].tolist())
                self.marks.append(ball)
        self._boxes()
        await self._colour()

    def at(self, row: int) -> None:
        """Put the cutter at a row."""
        if self.track is None:
            return
        number = int(self.track.tool[row]) if self.track.tool is not None else 0
        number = number if number in self.cutters else 0
        for n, shape in self.cutters.items():
            shape.visible(n == number and self.seen.get("cutter", True))
        shape = self.cutters.get(number)
        if shape is not None:
            shape.move(*self.track.place[row].tolist())
            shape.rotate_R(frame(self.track.axis[row]).tolist())

    def view_from(self, name: str, seconds: float = 0.4) -> None:
        """Look from a side, at everything."""
        if self.view is None:
            return
        middle = 0.5 * (self.box[0] + self.box[1])
        eye = seen_from(*self.box, np.array(VIEWS[name]))
        x, y, z = middle.tolist()
        self.view.move_camera(*eye.tolist(), x, y, z, 0, 0, 1, duration=seconds)

    async def _recoloured(self) -> None:
        if self.view is not None:
            await self._colour()

    async def _colour(self) -> None:
        result, track, column = self.result, self.track, self.column.value
        if result is None or track is None or not isinstance(column, str):
            return
        glb, scale = await asyncio.to_thread(path_glb, result, track, column)
        if (track, column) != (self.track, self.column.value):
            return
        if self.path is not None:
            self.path.delete()
        self.path = self.view.gltf(self.assets.put(glb)).visible(self.seen.get("path", True))
        self.legend.set_content(legend(column, scale))

    async def _bodies(self) -> None:
        """The bodies, as they are or their edges."""
        clear, found = self.seen.get(CLEAR, False), self.bodies
        made = await asyncio.to_thread(lambda: [edges_glb(b) if clear else b.glb for b in found])
        if found is not self.bodies:
            return
        for layer in self.layers.values():
            layer.delete()
        for body, glb in zip(found, made, strict=True):
            layer = self.view.gltf(self.assets.put(glb))
            self.layers[body.name] = layer.visible(self.seen.get(body.name, True))

    def _boxes(self) -> None:
        self.boxes.clear()
        with self.boxes:
            if self.layers:
                ui.checkbox(CLEAR, value=self.seen.get(CLEAR, False)).props("dense size=xs").on_value_change(
                    lambda e: self._see(CLEAR, bool(e.value))
                )
            for name in (*self.layers, "path", "cutter"):
                ui.checkbox(_plain(name), value=self.seen.get(name, True)).props("dense size=xs").on_value_change(
                    lambda e, n=name: self._see(n, bool(e.value))
                )

    async def _see(self, name: str, wanted: bool) -> None:
        self.seen[name] = wanted
        if name == CLEAR:
            await self._bodies()
        elif name == "path" and self.path is not None:
            self.path.visible(wanted)
        elif name == "cutter":
            for shape in self.cutters.values():
                shape.visible(False)
            self.pick(-1)
        elif name in self.layers:
            self.layers[name].visible(wanted)


def seen_from(low: Floats, high: Floats, away: Floats) -> Floats:
    """(3,) where a camera stands [mm] that looks along -``away`` at the middle of a box and sees all of it.

    >>> eye = seen_from(np.array([-1.0, -1.0, -1.0]), np.array([1.0, 1.0, 1.0]), np.array([0.0, -1.0, 0.0]))
    >>> eye.round(3).tolist()
    [0.0, -4.322, 0.0]
    """
    e = away / np.linalg.norm(away)
    right = np.cross([0.0, 0.0, 1.0], e)
    right /= np.linalg.norm(right)
    up = np.cross(e, right)
    signs = np.array(np.meshgrid([-0.5, 0.5], [-0.5, 0.5], [-0.5, 0.5])).reshape(3, 8).T
    corners = signs * np.maximum(high - low, 1e-3)
    half = math.tan(0.5 * math.radians(FOV_DEG))
    wide = np.maximum(np.abs(corners @ up) / half, np.abs(corners @ right) / (half * ASPECT))
    return np.asarray(0.5 * (low + high) + MORE * float((corners @ e + wide).max()) * e)


def frame(axis: Floats) -> Floats:
    """(3, 3) a rotation that takes z to a unit vector.

    >>> (frame(np.array([1.0, 0.0, 0.0])) @ [0.0, 0.0, 1.0]).round(12).tolist()
    [1.0, 0.0, 0.0]
    """
    length = float(np.linalg.norm(axis))
    w = np.asarray(axis) / length if length > 0.0 else np.array([0.0, 0.0, 1.0])
    other = np.array([1.0, 0.0, 0.0]) if abs(w[0]) < 0.9 else np.array([0.0, 1.0, 0.0])
    v = np.cross(w, other)
    v /= np.linalg.norm(v)
    return np.column_stack([np.cross(v, w), v, w])


def legend(column: str, scale: Scale) -> str:
    """The scale of the colours as HTML."""
    word, unit = label_and_unit(column)
    title = escape(f"{word} [{unit}]" if unit else word)
    if scale.words:
        rows = "".join(
            f'<div><span class="cl-dot" style="background:{colour}"></span>{escape(text)}</div>'
            for text, colour in scale.words[:12]
        )
        return f'<div class="cl-title">{title}</div>{rows}'
    stops = ", ".join(f"{colour} {100.0 * float(str(share)):g}%" for share, colour in SCALE)
    above = scale.limit is not None and scale.high > scale.limit
    red = f'<div class="cl-red">red: above {scale.limit:g}</div>' if above else ""
    return (
        f'<div class="cl-title">{title}</div><div class="cl-bar" style="background:linear-gradient(to right, {stops})">'
        f'</div><div class="cl-ends"><span>{scale.low:.4g}</span><span>{scale.high:.4g}</span></div>{red}'
    )


def _called(column: str) -> str:
    word, unit = label_and_unit(column)
    return f"{word} [{unit}]" if unit else word


def _plain(name: str) -> str:
    """A node's name without the number of its operation."""
    head, _, tail = name.partition("-")
    return tail if head == "0" and tail else name
