"""The page: shows the folder, a job or a result, and handles the keyboard."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Sequence
from html import escape
from importlib import resources
from typing import Any
from urllib.parse import quote

from nicegui import ui

from chipload.errors import InputError
from chipload.report.answer import STYLE as ANSWER_STYLE
from chipload.result import Result, Verdict
from chipload.web.asset_cache import AssetCache
from chipload.web.comparison import MOST
from chipload.web.folder_access import (
    ENTRIES,
    FolderEntry,
    OpenedFolder,
    list_folder,
    resolve_name,
)
from chipload.web.home import home_groups
from chipload.web.panels import RELEASE
from chipload.web.panels.dropped import DropZone
from chipload.web.panels.home import HomePanel, list_unread
from chipload.web.panels.job_form import JobForm
from chipload.web.panels.run import RunPanel
from chipload.web.panels.shape import ShapePanel
from chipload.web.result import NoMotionError, PageResult, open_result
from chipload.web.result_view import VERDICTS, ResultView
from chipload.web.runs import Runs

KEYS = (
    ("\u2190 \u2192", "one step back or forward; with Shift twenty"),
    ("\u2191 \u2193", "previous or next line of the program"),
    ("Home, End", "to the beginning, to the end"),
    ("Space", "play, pause"),
    ("1 2 3 4", "view from a corner, from above, from the front, from the side"),
    ("t", "the next operation or strategy"),
    ("h", "all results and jobs of the folder, with pictures"),
    ("o", "open a result or a job"),
    ("+ \u2212", "play faster, slower; also the wheel over the speed"),
    ("wheel", "over the slider: one step back or forward; with Shift a line of the program"),
    ("d", "dark or light"),
    ("?", "this list"),
)


class Page:
    """One window."""

    def __init__(self, opened: OpenedFolder, runs: Runs, assets: AssetCache) -> None:
        self.opened, self.assets = opened, assets
        self.result: PageResult | None = None
        ui.add_css(ANSWER_STYLE)
        ui.add_css(resources.files(__package__).joinpath("page.css").read_text("utf-8"))
        ui.add_head_html(
            '<script>document.documentElement.lang = "en"</script><script src="/viewer.js"></script>'
            "<script>chiploadViewer.ownKeys(); chiploadViewer.printsPlots()</script>"
        )
        ui.colors(primary="#2f5d8a")
        self.dark = ui.dark_mode(None)
        with ui.element("div").classes("cl-page"):
            self._header()
            self.run = RunPanel(
                opened, runs, self._folder_name, self.show, self._home,
                lambda name: self.others.set_value([f"result {name}"]),
            )  # fmt: skip
            self.home = ui.element("div").classes("cl-home")
            with ui.element("div").classes("cl-view") as self.stage:
                self.view = ResultView(assets)
            self.shape = ShapePanel()
        self.view.moved_on = self._moved_on
        self.view.can_run = lambda: self.run.job_of(self.result) is not None
        self.view.run_change = lambda change: self.run.try_change(self.result, change)
        self.opening, self.list = self._dialog("Open")
        self._help()
        ui.keyboard(on_key=self._key, ignore=["input", "textarea"])
        self.stage.set_visibility(False)

    async def begin(self, name: str | None) -> None:
        """Show what the address or the command names, else what there is."""
        first = name if name is not None else self.opened.first
        if first is None:
            await self._home()
            return
        try:
            path = resolve_name(self.opened.root, first)
            if path.is_file():
                await self._home(first)
            else:
                await self.show(first)
        except InputError as err:
            await self._home()
            ui.notify(str(err), type="negative")

    async def show(self, name: str) -> None:
        """Show a result."""
        self.opening.close()
        self.busy.set_visibility(True)
        try:
            result = await asyncio.to_thread(open_result, self.opened.root, name)
            self.result = result
            self.home.set_visibility(False)
            self.shape.close()
            self.stage.set_visibility(True)
            title = result.result.title or "result"
            self.title.set_text(title)
            ui.page_title(f"{result.result.verdict.value}: {title} - chipload")
            self.name.set_text(self._folder_name(name))
            options = {k: t.title for k, t in enumerate(result.tracks)}
            self.tracks.set_options(options, value=result.first)
            self.tracks.set_visibility(len(options) > 1)
            self.report.set_visibility(True)
            self.report.props(f'href="/report?name={quote(name)}"')
            ui.navigate.history.replace(f"/?show={quote(name)}")
            await self.view.open(result)
            await self._offer(name, result)
        except NoMotionError as err:
            self._show_shape(name, err.result)
        except InputError as err:
            ui.notify(str(err), type="negative")
            if self.result is None:
                await self._home()
        finally:
            self.busy.set_visibility(False)

    def _show_shape(self, name: str, result: Result) -> None:
        """Show a result without a motion."""
        self.result = None
        self.home.set_visibility(False)
        self.stage.set_visibility(False)
        self.tracks.set_visibility(False)
        self.others.set_visibility(False)
        title = result.title or "result"
        self.title.set_text(title)
        ui.page_title(f"{result.verdict.value}: {title} - chipload")
        self.name.set_text(self._folder_name(name))
        self.report.set_visibility(True)
        self.report.props(f'href="/report?name={quote(name)}"')
        ui.navigate.history.replace(f"/?show={quote(name)}")
        self.shape.open(result)

    # -- frame --------------------------------------------------------------------------------------------------
    def _header(self) -> None:
        with ui.element("div").classes("cl-header"):
            _button("", self._go_home, "home", "results and jobs of this folder (h)").mark("home")
            _button("Open", self._open, "folder_open").mark("open")
            self.title = ui.label("chipload").classes("cl-name").props("role=heading aria-level=1")
            self.name = ui.label("").classes("cl-path")
            self.tracks = ui.select({0: ""}, value=0, on_change=self._show_track).props(
                'dense options-dense outlined hide-bottom-space aria-label="track"'
            ).classes("cl-tracks").mark("track")  # fmt: skip
            self.tracks.on("popup-hide", js_handler=RELEASE)
            self.tracks.set_visibility(False)
            self.others = ui.select({}, multiple=True, on_change=self._show_comparison).props(
                f'dense options-dense outlined hide-bottom-space max-values={MOST - 1} aria-label="compare with"'
                ' display-value="compare with \u2026"'
            ).classes("cl-tracks").mark("compare")  # fmt: skip
            self.others.on("popup-hide", js_handler=RELEASE)
            self.others.set_visibility(False)
            self.busy = ui.spinner(size="sm")
            self.busy.set_visibility(False)
            ui.element("div").classes("cl-gap")
            self.report = ui.element("a").props('target="_blank" rel="noopener"').classes("cl-link")
            with self.report:
                ui.label("Report")
            self.report.set_visibility(False)
            _button("", self._switch_dark, "contrast", "dark or light (d)").mark("dark")
            _button("", lambda: self.help.open(), "help_outline", "keys (?)").mark("help")

    async def _switch_dark(self) -> None:
        """Turn from light to dark or back; before that the page is as the system is."""
        with contextlib.suppress(TimeoutError):
            self.dark.set_value(not await ui.run_javascript("document.body.classList.contains('body--dark')"))

    def _dialog(self, title: str) -> tuple[Any, Any]:
        with ui.dialog().props(f'aria-label="{title}"') as dialog, ui.card().classes("cl-dialog"):
            ui.label(title).classes("cl-dialog-title").props("role=heading aria-level=2")
            box = ui.element("div").classes("cl-list")
        return dialog, box

    def _help(self) -> None:
        with ui.dialog().props('aria-label="Keys"') as self.help, ui.card().classes("cl-dialog").mark("keys"):
            ui.label("Keys").classes("cl-dialog-title")
            with ui.element("div").classes("cl-keys"):
                for key, meaning in KEYS:
                    ui.label(key).classes("cl-key")
                    ui.label(meaning)
            ui.label(
                "Click a plot, a line of the program, a limit or a finding to jump to its step. In the 3D view, "
                "drag to turn, scroll to zoom, drag with the right button to pan. In a plot, drag to zoom, "
                "double-click to undo."
            ).classes("cl-note")

    # -- opening ------------------------------------------------------------------------------------------------
    async def _open(self) -> None:
        found, all_seen = await asyncio.to_thread(list_folder, self.opened.root)
        self.list.clear()
        with self.list:
            self._list_results(found, all_seen)
        self.opening.open()

    async def _home(self, job: str | None = None) -> None:
        """What the folder holds, where no result is shown."""
        self.result = None
        found, all_seen = await asyncio.to_thread(list_folder, self.opened.root)
        groups = await asyncio.to_thread(home_groups, self.opened.root, found)
        self.stage.set_visibility(False)
        self.shape.close()
        self.home.set_visibility(True)
        self.home.clear()
        self.title.set_text("chipload")
        self.name.set_text(str(self.opened.root.name))
        self.report.set_visibility(False)
        self.tracks.set_visibility(False)
        self.others.set_visibility(False)
        with self.home, ui.element("div").classes("cl-card"):
            if job is not None:
                ui.label(self._folder_name(job)).classes("cl-dialog-title")
                with ui.element("div").classes("cl-entry"):
                    _button("Run", lambda: self._request_folder(job), "play_arrow").mark(f"run-{job}")
                    ui.label("plans, checks and writes a result; you can stop it").classes("cl-note")
                with ui.element("div").classes("cl-job-two"):
                    with ui.element("div").classes("cl-scroll cl-job"):
                        JobForm(resolve_name(self.opened.root, job), lambda values: self._request_folder(job, values))
                    ui.html(self._text(job), sanitize=True).classes("cl-scroll cl-code cl-job").props("tabindex=0")
            DropZone(self.run.ask_questions, lambda text: ui.notify(text, type="negative"))
            ui.label("Results and jobs in this folder").classes("cl-dialog-title").props("role=heading aria-level=2")
            _list_notes(found, all_seen)
            HomePanel(groups, self._folder_name, self.show, self._job, self._request_folder)
            list_unread(found, self._folder_name)

    def _list_results(self, found: list[FolderEntry], all_seen: bool) -> None:
        _list_notes(found, all_seen)
        list_unread(found, self._folder_name)
        for f in (f for f in found if f.kind != "unread"):
            with ui.element("div").classes("cl-entry"):
                ui.icon("analytics" if f.kind == "result" else "description").classes("cl-icon")
                ui.label(self._folder_name(f.name)).classes("cl-what")
                if f.kind == "result":
                    ui.label(f.word).classes(f"cl-pill cl-{VERDICTS[Verdict(f.word)]}")
                    _button("Show", lambda n=f.name: self.show(n)).mark(f"show-{f.name}")
                else:
                    ui.label("job").classes("cl-pill")
                    _button("Look", lambda n=f.name: self._job(n))
                    _button("Run", lambda n=f.name: self._request_folder(n), "play_arrow").mark(f"run-{f.name}")

    async def _go_home(self) -> None:
        """Leave the result that is shown for the list of results."""
        self.opening.close()
        self.view.pause()
        ui.page_title("chipload")
        ui.navigate.history.replace("/")
        await self._home()

    async def _job(self, name: str) -> None:
        """Show a job."""
        self.opening.close()
        await self._home(name)

    def _request_folder(self, job: str, overrides: Sequence[str] = ()) -> None:
        """Ask where the result of a job goes, and run it."""
        self.opening.close()
        self.run.ask_folder(job, overrides)

    def _folder_name(self, name: str) -> str:
        return self.opened.root.name if name == "." else name

    def _text(self, job: str) -> str:
        lines = resolve_name(self.opened.root, job).read_text("utf-8", "replace").splitlines()
        return "".join(f'<div class="cl-line"><i>{k}</i>{escape(t) or " "}</div>' for k, t in enumerate(lines, 1))

    # -- keys ---------------------------------------------------------------------------------------------------
    async def _show_track(self) -> None:
        if self.result is not None and isinstance(self.tracks.value, int):
            await self.view.follow(self.tracks.value)
            if self.others.value:
                self.others.set_value([])

    def _moved_on(self, number: int) -> None:
        """The panels show another track by themselves."""
        self.tracks.set_value(number)

    async def _offer(self, name: str, result: PageResult) -> None:
        """What the result can be compared with: its other tracks, and the other results of the folder."""
        found, _ = await asyncio.to_thread(list_folder, self.opened.root)
        options = {f"track {k}": t.title for k, t in enumerate(result.tracks)}
        options |= {
            f"result {f.name}": self._folder_name(f.name) for f in found if f.kind == "result" and f.name != name
        }
        self.others.set_options(options, value=[])
        self.others.set_visibility(len(options) > 1)

    async def _show_comparison(self) -> None:
        result, chosen = self.result, [str(v) for v in self.others.value or []]
        if result is None:
            return
        others = []
        for value in chosen:
            kind, _, rest = value.partition(" ")
            try:
                if kind == "track":
                    track = result.tracks[int(rest)]
                    if track is not self.view.track:
                        others.append((result, track, track.title))
                else:
                    other = await asyncio.to_thread(open_result, self.opened.root, rest)
                    others.append((other, other.tracks[0], f"{self._folder_name(rest)}: {other.tracks[0].own.name}"))
            except InputError as err:
                ui.notify(str(err), type="negative")
        self.others.props["display-value"] = "; ".join(title for *_, title in others) or "compare with \u2026"
        self.others.update()
        await self.view.compare(others)

    async def _key(self, event: Any) -> None:
        if not event.action.keydown or event.modifiers.ctrl or event.modifiers.meta or event.modifiers.alt:
            return
        key, steps = event.key, 20 if event.modifiers.shift else 1
        if key.name == "?":
            self.help.open()
        elif key.name == "o" and not event.action.repeat:
            await self._open()
        elif key.name == "d" and not event.action.repeat:
            await self._switch_dark()
        elif key.name == "h" and not event.action.repeat:
            await self._go_home()
        elif self.result is None or self.help.value or self.opening.value or self.run.asks:
            return
        elif key.arrow_left or key.arrow_right:
            self.view.move(steps if key.arrow_right else -steps)
        elif key.arrow_up or key.arrow_down:
            self.view.line(1 if key.arrow_down else -1)
        elif key.home:
            self.view.go(0)
        elif key.end:
            self.view.go(len(self.view.track or ()) - 1)
        elif key.name == " " and not event.action.repeat:
            self.view.toggle()
        elif key.name in ("+", "-", "="):
            self.view.change_speed(-1 if key.name == "-" else 1)
        elif key.name in ("1", "2", "3", "4"):
            self.view.scene.view_from(("iso", "top", "front", "side")[int(key.name) - 1])
        elif key.name == "t":
            self.tracks.set_value((int(self.tracks.value or 0) + 1) % len(self.result.tracks))


def _list_notes(found: list[FolderEntry], all_seen: bool) -> None:
    """State what a list of a folder leaves out, or that it is empty."""
    if not all_seen:
        ui.label(f"The folder holds more than {ENTRIES} files; the others were not read.").classes("cl-note")
    if not found:
        ui.label("This folder holds no result and no job. `chipload example` copies one.").classes("cl-note")


def _button(text: str, act: Any, icon: str | None = None, tip: str = "") -> Any:
    button = ui.button(text, on_click=act, icon=icon).props("flat dense no-caps size=md").on("mousedown.prevent")
    if tip:
        button.props(f'aria-label="{tip}"')
        with button:
            ui.tooltip(tip)
    return button
