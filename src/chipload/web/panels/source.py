"""The panel with the program; it highlights the line of the row, and a click on a line selects it."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from html import escape
from typing import Any

from nicegui import ui

from chipload.web.result import PageResult, PageTrack
from chipload.web.source import TrackText, source_of

#: lines that are in the page at a time, and how near to their end a new part is brought
WINDOW, MARGIN = 600, 60
#: characters of a line that are shown
WIDEST = 300
CLICK = "(e) => { const r = e.target.closest('[data-line]'); if (r) emit(Number(r.getAttribute('data-line'))) }"


class SourcePanel:
    """The source text of a track."""

    def __init__(self, pick: Callable[[int], None]) -> None:
        self.pick = pick
        self.text: TrackText | None = None
        self.first, self.line = 0, 0
        with ui.element("div").classes("cl-panel cl-source").props('role=region aria-label="program"'):
            self.name = ui.label("").classes("cl-head cl-file")
            self.html = ui.html("", sanitize=True).classes("cl-scroll cl-code").props("tabindex=0").on(
                "click", self._on_click, js_handler=CLICK
            ).mark("source")  # fmt: skip

    async def open(self, result: PageResult, track: PageTrack) -> None:
        """Show the text of a track."""
        self.text = await asyncio.to_thread(source_of, result, track)
        self.line = 0
        if self.text is None:
            self.name.set_text("program")
            self.html.set_content('<div class="cl-none">The text of the program is not in the opened folder.</div>')
            return
        self.name.set_text(self.text.name + (f" \u00b7 {self.text.note}" if self.text.note else ""))
        self._window(self.text, 1)

    def at(self, row: int) -> None:
        """Stand at the line of a row."""
        if self.text is None or row >= len(self.text.of_row):
            return
        line = int(self.text.of_row[row])
        if line == self.line or not 0 < line <= len(self.text.lines):
            return
        self.line = line
        last = min(self.first + WINDOW, len(self.text.lines))
        near = line - self.first <= MARGIN and self.first > 0
        if line <= self.first or line > last or near or (last - line < MARGIN and last < len(self.text.lines)):
            self._window(self.text, line)
        place = f"document.getElementById('c{self.html.id}')"
        ui.run_javascript(
            f"setTimeout(() => {{ const box = {place}; if (!box) return;"
            "box.querySelectorAll('.cl-now').forEach(x => x.classList.remove('cl-now'));"
            f"const now = box.querySelector('[data-line=\"{line}\"]'); if (!now) return; now.classList.add('cl-now');"
            "const top = now.offsetTop - box.offsetTop;"
            "if (top < box.scrollTop + 20 || top > box.scrollTop + box.clientHeight - 40)"
            "box.scrollTop = top - box.clientHeight / 3; }, 20)"
        )

    def step(self, row: int, by: int) -> int | None:
        """The first row of the line after or before that of a row."""
        if self.text is None:
            return None
        lines, here = self.text.of_row, int(self.text.of_row[row])
        if by > 0:
            return self.text.row_of(here + 1)
        before = lines[(lines < here) & (lines > 0)]
        return self.text.row_of(int(before.max())) if len(before) else None

    def _window(self, text: TrackText, line: int) -> None:
        count = len(text.lines)
        self.first = max(0, min(line - WINDOW // 2, count - WINDOW))
        last = min(self.first + WINDOW, count)
        out = [f'<div class="cl-none">\u2026 {self.first} lines above</div>'] if self.first else []
        out += [
            f'<div class="cl-line{" cl-now" if k == self.line else ""}" data-line="{k}"><i>{k}</i>'
            f"{escape(text.lines[k - 1][:WIDEST]) or ' '}</div>"
            for k in range(self.first + 1, last + 1)
        ]
        out += [f'<div class="cl-none">\u2026 {count - last} lines below</div>'] if last < count else []
        self.html.set_content("".join(out))

    def _on_click(self, event: Any) -> None:
        if self.text is not None and isinstance(event.args, int):
            row = self.text.row_of(event.args)
            if row is not None:
                self.pick(row)
