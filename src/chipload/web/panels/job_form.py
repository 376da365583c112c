"""The form with the keys of a job. It checks input at once; a run uses the changed values, the file stays."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Sequence
from html import escape
from pathlib import Path
from typing import Any

from nicegui import ui

from chipload.errors import InputError
from chipload.web.job_form import FormField, job_errors, job_fields, override_of


class JobForm:
    """The form of one job."""

    def __init__(self, path: Path, run: Callable[[Sequence[str]], None]) -> None:
        self.path, self.run = path, run
        self.entered: dict[str, Any] = {}
        self.inputs: dict[str, Any] = {}
        self.checks = 0
        try:
            self.fields = job_fields(path)
        except InputError as err:
            self.fields = []
            ui.label(str(err)).classes("cl-no")
            return
        with ui.element("div").classes("cl-entry"):
            self.start = ui.button("Run", icon="play_arrow", on_click=self._run).props("dense no-caps").mark("run-form")
            self.state = ui.label("").classes("cl-note").props("role=status").mark("form-state")
        self.errors = ui.html("", sanitize=True).classes("cl-form-errors")
        for table in dict.fromkeys(f.table for f in self.fields):
            self._table(table, [f for f in self.fields if f.table == table])
        ui.timer(0.01, self._check, once=True)

    @property
    def overrides(self) -> list[str]:
        """What was changed, as `--set` takes it."""
        made = (override_of(f, self.entered.get(f.path)) for f in self.fields)
        return [text for text in made if text is not None]

    # -- parts --------------------------------------------------------------------------------------------------
    def _table(self, table: str, fields: Sequence[FormField]) -> None:
        """Stated keys, and the others behind a line that opens."""
        ui.label(f"[{table}]" if table else "keys before the first table").classes("cl-form-table")
        with ui.element("div").classes("cl-form"):
            for field in fields:
                if field.value is not None:
                    self._field(field)
        others = [f for f in fields if f.value is None]
        if others:
            with ui.expansion(f"{len(others)} keys that are not stated").props("dense").classes("cl-form-more") as more:
                box = ui.element("div").classes("cl-form")

            def fill() -> None:
                if more.value and not box.default_slot.children:
                    with box:
                        for field in others:
                            self._field(field)

            more.on_value_change(fill)

    def _field(self, field: FormField) -> None:
        title = field.key
        hint = "; ".join(text for text in (field.bounds, field.meaning) if text)

        def change_value(event: Any, path: str = field.path) -> Any:
            self.entered[path] = event.value
            return self._check()

        made: Any
        if field.kind == "switch":
            made = ui.checkbox(title, value=bool(field.value), on_change=change_value).props("dense")
        elif field.kind == "choice":
            words = list(dict.fromkeys([*field.choices, *([field.value] if field.value is not None else [])]))
            made = ui.select(words, label=title, value=field.value, on_change=change_value)
        else:
            text = "" if field.value is None else f"{field.value}"
            made = ui.input(title, value=text, on_change=change_value)
        made.props(f'dense outlined debounce=250 aria-label="{escape(field.path)}"').mark(f"field-{field.path}")
        if field.kind != "switch":
            made.props(f'suffix="{escape(field.unit)}" hide-bottom-space')
        if hint:
            with made:
                ui.tooltip(hint).classes("cl-tip")
            ui.label(hint).classes("cl-form-hint")
        else:
            ui.label("")
        self.inputs[field.path] = made

    async def _check(self) -> None:
        """Read the job with what was entered, as a run would."""
        self.checks += 1
        check, overrides = self.checks, self.overrides
        errors = await asyncio.to_thread(job_errors, self.path, overrides)
        if check != self.checks:
            return
        self.start.set_enabled(not errors)
        for field in self.fields:
            made = self.inputs.get(field.path)
            if made is not None:
                wrong = any(field.path in text for text in errors)
                made.classes(**{"add" if wrong else "remove": "cl-form-wrong"})
                same = override_of(field, self.entered.get(field.path)) is None
                made.classes(**{"remove" if same else "add": "cl-form-changed"})
        count = len(overrides)
        count_text = f"{count} values changed" if count != 1 else "1 value changed"
        changed = f"{count_text}: the file stays" if count else "as in the file"
        self.state.set_text(f"{len(errors)} wrong" if errors else f"right, {changed}")
        self.errors.set_content("".join(f"<div class='cl-no'>{escape(text)}</div>" for text in errors))

    def _run(self) -> None:
        self.run(self.overrides)
