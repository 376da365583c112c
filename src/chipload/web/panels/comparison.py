"""The panel with the key numbers of compared tracks and their differences from the first."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

from nicegui import ui

from chipload.number_text import number_text
from chipload.web.comparison import Side, key_numbers, knots
from chipload.web.panels.limits import CLASSES

HINT = "Choose in \u201ccompare with\u201d, at the top, a track of this result or another result of the folder."


class ComparisonPanel:
    """The table of differences."""

    def __init__(self) -> None:
        self.html = ui.html("", sanitize=True).classes("cl-scroll").props("tabindex=0").mark("comparison")
        self.show((), "time")

    def show(self, sides: Sequence[Side], against: str) -> None:
        """Compare; empty: nothing is compared."""
        self.html.set_content(
            comparison_table(sides, against) if sides else f'<div class="cl-none">{escape(HINT)}</div>'
        )


def comparison_table(sides: Sequence[Side], against: str) -> str:
    """Sides as columns of HTML, numbers as rows."""
    head = "".join(
        f'<th class=n><span class="cl-dot" style="background:{s.colour}"></span>{escape(s.title)}</th>'
        + ("<th class=n>difference</th>" if k else "")
        for k, s in enumerate(sides)
    )
    states = "".join(
        f"<td class='n cl-{CLASSES[s.track.own.verdict]}'>{s.track.own.verdict.value}</td>" + ("<td></td>" if k else "")
        for k, s in enumerate(sides)
    )
    body = [f"<tr><td>track</td>{states}</tr>"]
    for number in key_numbers(sides):
        cells = []
        for k, value in enumerate(number.values):
            cells.append(f"<td class=n>{'-' if value is None else number_text(value)}</td>")
            if k:
                more, percent = number.difference(k)
                sign = "+" if more is not None and more > 0.0 else ""
                share = "" if percent is None else f" ({'+' if percent > 0.0 else ''}{number_text(percent)} %)"
                text = "" if more is None else f"{sign}{number_text(more, 3)}{share}"
                cells.append(f"<td class=n>{text}</td>")
        unit = f" [{number.unit}]" if number.unit else ""
        body.append(f"<tr><td>{escape(number.label + unit)}</td>{''.join(cells)}</tr>")
    return (
        f'<table class="cl-limits cl-compared"><thead><tr><th></th>{head}</tr></thead><tbody>{"".join(body)}</tbody>'
        f'</table><div class="cl-none">{escape(_note(sides, against))}</div>'
    )


def _note(sides: Sequence[Side], against: str) -> str:
    if against == "time":
        return "All are at the same time. Plots against path put them at the same place of the path."
    passes = len(knots(sides[0], sides[1], against)[0]) > 2
    return f"All are at the same share of {'each pass' if passes else 'their path'}."
