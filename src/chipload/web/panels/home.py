"""The first page of a folder: its results with date, picture and verdict, grouped by job, and jobs to run."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Sequence
from typing import Any
from urllib.parse import quote

from nicegui import ui

from chipload.report.answer import answer_html
from chipload.web.folder_access import FolderEntry
from chipload.web.home import HomeGroup, HomeResult
from chipload.web.result_view import VERDICTS

#: groups that are shown at first, and results of each
GROUPS, RESULTS = 40, 6
#: columns of a wide window
COLUMNS = 4
#: a plain click is handled here, one with a key that opens another window by the browser
PLAIN_CLICK = "(e) => { if (!e.ctrlKey && !e.metaKey && !e.shiftKey) { e.preventDefault(); emit(); } }"


class HomePanel:
    """The groups of a folder. ``label`` gives the text of a name; the others act on a name."""

    def __init__(
        self,
        groups: Sequence[HomeGroup],
        label: Callable[[str], str],
        show: Callable[[str], Awaitable[None]],
        show_job: Callable[[str], Awaitable[None]],
        run: Callable[[str], None],
    ) -> None:
        self.label, self.show, self.show_job, self.run = label, show, show_job, run
        with ui.element("div").classes("cl-groups"):
            for group in groups[:GROUPS]:
                self._group(group)
        if len(groups) > GROUPS:
            ui.label(f"{len(groups) - GROUPS} more jobs: press Open for the whole list.").classes("cl-note")

    def _group(self, group: HomeGroup) -> None:
        wide = min(len(group.results), COLUMNS) or COLUMNS
        with ui.element("section").classes(f"cl-group cl-span-{wide}") as box:
            box.props["aria-label"] = self.label(group.title)
            with ui.element("div").classes("cl-entry"):
                ui.icon("description").classes("cl-icon")
                ui.label(self.label(group.title)).classes("cl-what").props("role=heading aria-level=3")
                job = group.job
                if job is not None:
                    ui.label("job").classes("cl-pill")
                    _button("Look", lambda: self.show_job(job))
                    _button("Run", lambda: self.run(job), "play_arrow").mark(f"run-{job}")
            with ui.element("div").classes("cl-results"):
                for result in group.results[:RESULTS]:
                    self._result(result)
            if len(group.results) > RESULTS:
                ui.label(f"{len(group.results) - RESULTS} older results: press Open for the whole list.").classes(
                    "cl-note"
                )

    def _result(self, result: HomeResult) -> None:
        """A result: the whole of it is a link, which another window may open too."""
        name = quote(result.name)
        with ui.element("a").props(f'href="/?show={name}"').classes("cl-result") as card:
            ui.element("img").props(
                f'src="/thumbnail?name={name}&at={result.changed_ns}" alt="" loading=lazy width=208 height=132'
            )
            with ui.element("span").classes("cl-result-head"):
                ui.label(result.verdict.value).classes(f"cl-pill cl-{VERDICTS[result.verdict]}")
                ui.label(result.date).classes("cl-note")
            ui.label(self.label(result.name)).classes("cl-result-name")
            answer = answer_html(result.critical)
            if answer:
                ui.html(answer, sanitize=True)
            else:
                ui.label(result.message).classes("cl-note cl-result-text")
        card.mark(f"show-{result.name}")
        card.on("click", lambda: self.show(result.name), js_handler=PLAIN_CLICK)


def list_unread(entries: Sequence[FolderEntry], label: Callable[[str], str]) -> None:
    """List results that this version does not read, each with the reason; nothing where there is none."""
    unread = [entry for entry in entries if entry.kind == "unread"]
    if not unread:
        return
    ui.label("Results that are not read").classes("cl-dialog-title").props("role=heading aria-level=2")
    for entry in unread[:GROUPS]:
        with ui.element("div").classes("cl-entry").mark(f"unread-{entry.name}"):
            ui.icon("history").classes("cl-icon")
            ui.label(label(entry.name)).classes("cl-what")
            ui.label(entry.word).classes("cl-note cl-why")
    if len(unread) > GROUPS:
        ui.label(f"{len(unread) - GROUPS} more are not read.").classes("cl-note")


def _button(text: str, act: Any, icon: str | None = None) -> Any:
    return ui.button(text, on_click=act, icon=icon).props("flat dense no-caps size=md").on("mousedown.prevent")
