"""The place where a file is dropped, and the questions about it: lists with search, then one button that runs it."""

from __future__ import annotations

import asyncio
import json
import re
from collections.abc import Callable
from html import escape
from typing import Any

from nicegui import ui

from chipload.errors import ChiploadError
from chipload.jobs.drafts.draft import toml
from chipload.web.dropped import (
    LARGEST,
    LARGEST_MODEL,
    MODELS,
    AskedKey,
    AskedQuestion,
    DroppedFile,
    Upload,
    read_dropped,
)

#: what a question says of the command line
_COMMAND = re.compile(r"; (?:--|chipload )[^;]*")
#: findings of the draft that are listed
NOTES = 4


class DropZone:
    """Takes a file by drop or by choice; ``receive`` is told what it asks, ``refuse`` why it is not taken."""

    def __init__(self, receive: Callable[[DroppedFile], None], refuse: Callable[[str], None]) -> None:
        self.receive, self.refuse = receive, refuse
        self.upload = Upload()
        send = f"chiploadViewer.send(%s, {LARGEST}, {LARGEST_MODEL}, {json.dumps(MODELS)}, emit)".replace('"', "'")
        with ui.element("div").classes("cl-drop").mark("drop") as zone:
            ui.label("Drop a program here (NC, CL data), a drawing (DXF) or a model (STEP, STL)").classes(
                "cl-drop-title"
            )
            ui.label("or").classes("cl-note")
            file = ui.element("input").props('type=file aria-label="choose a file"').mark("program")
            self.state = ui.label("").classes("cl-note").props("role=status").mark("drop-state")
        zone.on("dragover", js_handler="(e) => { e.preventDefault(); }")
        zone.on("drop", self._take, js_handler=f"(e) => {{ e.preventDefault(); {send % 'e.dataTransfer.files[0]'}; }}")
        file.on("change", self._take, js_handler=f"(e) => {{ {send % 'e.target.files[0]'}; e.target.value = ''; }}")

    async def _take(self, event: Any) -> None:
        try:
            whole = self.upload.take(event.args)
            if whole is None:
                return
            self.state.set_text(f"reading {whole[0]} \u2026")
            dropped = await asyncio.to_thread(read_dropped, *whole)
        except ChiploadError as err:
            self.refuse(str(err))
            self.state.set_text(str(err))
            return
        self.state.set_text("")
        self.receive(dropped)


class Questions:
    """The questions about a file; ``answers`` are those that were changed or confirmed."""

    def __init__(self, dropped: DroppedFile) -> None:
        self.entered: dict[tuple[int, str], Any] = {}
        self.changed: set[tuple[int, str]] = set()
        self.confirmed: set[tuple[int, str]] = set()
        ui.label(dropped.draft.title).classes("cl-note")
        for note in dropped.draft.notes[:NOTES]:
            ui.label(f"found: {note}").classes("cl-note")
        if not dropped.questions:
            ui.label("The file leaves no question open.").classes("cl-note")
        for number, question in enumerate(dropped.questions, 1):
            self._question(number, question)

    @property
    def answers(self) -> dict[tuple[int, str], Any]:
        """By table and key: what was changed, and what was confirmed as it stands."""
        return {key: value for key, value in self.entered.items() if key in self.changed | self.confirmed}

    def _question(self, number: int, question: AskedQuestion) -> None:
        keys = {(one.table, one.key) for one in question.keys}

        def confirm(on: bool) -> None:
            self.confirmed = self.confirmed | keys if on else self.confirmed - keys

        with ui.element("fieldset").classes("cl-question").mark(f"question-{number}"):
            # what is asked comes before what was guessed, which the fields show
            with ui.element("legend"):
                ui.label(f"{number}. {_COMMAND.sub('', question.text)}")
            with ui.element("div").classes("cl-answers"):
                for one in question.keys:
                    self._field(one)
                if keys:
                    box = ui.checkbox("it is so", on_change=lambda e: confirm(bool(e.value))).props("dense")
                    box.props(f'aria-label="question {number}: it is so"').mark(f"confirm-{number}")

    def _field(self, asked: AskedKey) -> None:
        key, field = (asked.table, asked.key), asked.field
        self.entered[key] = asked.value

        def change(event: Any) -> None:
            self.entered[key] = event.value
            self.changed.add(key)

        made: Any
        if field is not None and field.kind == "switch":
            made = ui.checkbox(asked.path, value=bool(asked.value), on_change=change).props("dense")
        elif asked.choices:
            words = list(dict.fromkeys([*asked.choices, *([asked.value] if asked.value is not None else [])]))
            made = ui.select(words, label=asked.path, value=asked.value, with_input=True, on_change=change)
        else:
            text = "" if asked.value is None else toml(asked.value).strip('[]"')
            made = ui.input(asked.path, value=text, on_change=change)
            made.props(f'suffix="{escape(field.unit if field is not None else "mm")}"')
        made.props(f'dense outlined hide-bottom-space aria-label="{escape(asked.path)}"').mark(f"answer-{asked.path}")
