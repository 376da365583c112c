"""The runs of a page: what is asked before one, the bar that shows where it is, and what is shown at its end."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Sequence
from pathlib import PurePosixPath
from typing import Any

from nicegui import background_tasks, ui

from chipload.errors import InputError, OutputError
from chipload.report.folder import check_target
from chipload.result.changes import Change
from chipload.web.dropped import DroppedFile, write_answers
from chipload.web.folder_access import OpenedFolder, is_job, is_result, resolve_name, target_in
from chipload.web.panels.dropped import Questions
from chipload.web.result import PageResult
from chipload.web.runs import JobRun, Runs

#: seconds between two looks at a run
LOOK = 0.25


class RunPanel:
    """Dialog and bar of runs.

    Parameters
    ----------
    label : the text of a name
    show, show_home : show a result by its name; the list of results, with a job or without
    compare : compare the result that is shown with another one
    """

    def __init__(
        self,
        opened: OpenedFolder,
        runs: Runs,
        label: Callable[[str], str],
        show: Callable[[str], Awaitable[None]],
        show_home: Callable[[str | None], Awaitable[None]],
        compare: Callable[[str], object],
    ) -> None:
        self.opened, self.runs, self.label = opened, runs, label
        self.show, self.show_home, self.compare = show, show_home, compare
        self.own: JobRun | None = None
        self.seen: JobRun | None = runs.now if runs.now is not None and runs.now.ended else None
        self._bar()
        with ui.dialog().props('aria-label="Before the run"') as self.dialog, ui.card().classes("cl-dialog"):
            ui.label("Before the run").classes("cl-dialog-title").props("role=heading aria-level=2")
            self.ask = ui.element("div").classes("cl-list")
        ui.timer(LOOK, self._poll)

    @property
    def asks(self) -> bool:
        """Whether the dialog is open."""
        return bool(self.dialog.value)

    # -- before a run -------------------------------------------------------------------------------------------
    def ask_folder(self, job: str, overrides: Sequence[str] = ()) -> None:
        """Where the result goes; one with changed values goes next to the last one and is compared with it."""
        stem, folder = PurePosixPath(job).stem, PurePosixPath(job).parent
        last = (folder / ("result" if stem == "job" else f"result-{stem}")).as_posix()
        known = is_result(self.opened.root / last)
        out = f"{last}-changed" if overrides else last
        self.ask.clear()
        with self.ask:
            ui.label(f"{self.label(job)}: folder for the result, in the opened folder:").classes("cl-note")
            where = ui.input(value=out).props("dense outlined").classes("cl-out").mark("out")
            for text in overrides:
                ui.label(text).classes("cl-note cl-changed")
            message = ui.label("").classes("cl-no")
            compared = last if overrides and known else None
            with ui.element("div").classes("cl-entry"):
                _button(
                    "Run", lambda: self._run(job, str(where.value), message, overrides, compared), "play_arrow"
                ).props("unelevated color=primary").props(remove="flat").mark("start")
                _button("Cancel", self.dialog.close)
        self.dialog.open()

    def ask_questions(self, dropped: DroppedFile) -> None:
        """Ask what a dropped file leaves open; the answers become a job in the opened folder."""
        self.ask.clear()
        with self.ask:
            questions = Questions(dropped)
            with ui.element("div").classes("cl-asked"):
                ui.label("Folder of the job, in the opened folder:").classes("cl-note")
                where = ui.input(value=dropped.folder).props('dense outlined aria-label="folder of the job"')
                where.classes("cl-out").mark("out")
                message = ui.label("").classes("cl-no")

                async def write(run: bool) -> None:
                    await self._write_job(dropped, questions, str(where.value).strip(), message, run)

                with ui.element("div").classes("cl-entry"):
                    _button("Run", lambda: write(True), "play_arrow").props("unelevated color=primary").props(
                        remove="flat"
                    ).mark("start")
                    _button("Save the job only", lambda: write(False)).mark("save-job")
                    _button("Cancel", self.dialog.close)
        self.dialog.open()

    async def _write_job(
        self, dropped: DroppedFile, questions: Questions, folder: str, message: Any, run: bool
    ) -> None:
        """Write the job of a dropped file, and run it: the verdict of a coarse run comes first."""
        try:
            if run and self.runs.now is not None and not self.runs.now.ended:
                raise InputError("a job is running: stop it first")
            target = target_in(self.opened.root, folder)
            path = await asyncio.to_thread(write_answers, dropped, questions.answers, target)
        except (InputError, OutputError) as err:
            message.set_text(str(err).replace(f"{self.opened.root}/", ""))
            return
        job = path.relative_to(self.opened.root).as_posix()
        if run:
            self._run(job, f"{folder}/result", message, (), None, draft=True)
            await self.show_home(None)
        else:
            self.dialog.close()
            await self.show_home(job)

    # -- changes of a result ------------------------------------------------------------------------------------
    def job_of(self, result: PageResult | None) -> str | None:
        """The job of a result of a program; None: it is not in the folder, or its feeds are not changed."""
        if result is None or result.result.capability != "program":
            return None
        name = PurePosixPath(result.name)
        stem = "job" if name.name == "result" else name.name.removeprefix("result-")
        job = (name.parent / f"{stem}.toml").as_posix()
        try:
            return job if is_job(resolve_name(self.opened.root, job)) else None
        except InputError:
            return None

    def try_change(self, result: PageResult | None, change: Change) -> None:
        """Run the job of a result with new feeds of the lines that load too much, and compare the two results."""
        job = self.job_of(result)
        if job is None or result is None:
            return
        slowest = min(20.0, 50.0 * change.factor)
        overrides = [f"operation.0.feeds.{key}={value:g}" for key, value in (
            ("slowest_percent", slowest), ("fastest_percent", 100.0),
        )]  # fmt: skip
        message = ui.label("").classes("cl-no")
        self._run(job, f"{result.name}-changed", message, overrides, result.name)
        if message.text:
            ui.notify(message.text, type="negative")
        message.delete()

    # -- a run --------------------------------------------------------------------------------------------------
    def _run(
        self, job: str, out: str, message: Any, overrides: Sequence[str], compared: str | None, draft: bool = False
    ) -> None:
        """Start a run, unless one runs or its folder cannot be written."""
        root = self.opened.root
        try:
            if self.runs.now is not None and not self.runs.now.ended:
                raise InputError("a job is running: stop it first")
            path = resolve_name(root, job)
            if not is_job(path):
                raise InputError(f"{job}: is no longer a job")
            target = target_in(root, out)
            check_target(target)
        except (InputError, OutputError) as err:
            message.set_text(str(err).replace(f"--out {root}/", ""))
            return
        self.dialog.close()
        self.runs.now = now = JobRun(job, target.relative_to(root).as_posix(), overrides, compared, draft)
        self.seen, self.own = None, now
        self.bar.set_visibility(True)
        background_tasks.create(now.work(path, target))

    def _bar(self) -> None:
        """Where a run is."""
        with ui.element("div").classes("cl-run").mark("run") as self.bar:
            self.bar_text = ui.label("").classes("cl-run-text").props("role=status").mark("run-text")
            self.bar_line = (
                ui.linear_progress(0.0, show_value=False, size="8px")
                .classes("cl-run-line")
                .props('aria-label="progress of the run"')
            )
            self.bar_stop = ui.button("Stop", on_click=self.runs.stop).props("outline dense no-caps color=red")
            self.bar_stop.mark("stop")
            self.bar_close = ui.button(icon="close", on_click=lambda: self.bar.set_visibility(False)).props(
                "flat dense round size=sm aria-label=close"
            )
        self.bar.set_visibility(False)

    async def _poll(self) -> None:
        now = self.runs.now
        if now is None or self.seen is now:
            return
        self.bar.set_visibility(True)
        self.bar_line.set_value(round(now.done, 3))
        self.bar_line.set_visibility(not now.ended)
        self.bar_stop.set_visibility(now.state == "running")
        self.bar_close.set_visibility(now.ended)
        self.bar_text.set_text(_run_text(now))
        if now.ended:
            self.seen = now
            if now.state == "done" and now is self.own:
                await self.show(now.out)
                if now.compared is not None and now.compared != now.out:
                    self.compare(now.compared)
                self.bar.set_visibility(False)


def _run_text(now: JobRun) -> str:
    """Where a run is, in words."""
    return {
        "running": f"{now.job}: {100.0 * now.done:.0f} % \u00b7 {now.what}"
        + (f" \u00b7 first look, coarse: {now.first}" if now.first else ""),
        "stopping": f"{now.job}: stopping",
        "done": f"{now.job}: done. {now.message}",
        "stopped": f"{now.job}: stopped, {now.message.removeprefix('stopped: ') or 'nothing was written'}",
        "failed": f"{now.job}: {now.message}",
    }[now.state]


def _button(text: str, act: Any, icon: str | None = None) -> Any:
    return ui.button(text, on_click=act, icon=icon).props("flat dense no-caps size=md").on("mousedown.prevent")
