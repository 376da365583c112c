"""HTML of a result for notebooks: message, limits, tracks and findings."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape
from typing import TYPE_CHECKING

from chipload.number_text import number_text
from chipload.result.times import time_text
from chipload.result.verdict import Verdict

if TYPE_CHECKING:
    from chipload.errors import Finding
    from chipload.result.result import Result

#: colours of the verdicts
COLOURS = {Verdict.HOLDS: "#0b6b4f", Verdict.UNPROVEN: "#8a6100", Verdict.EXCEEDS: "#b3261e"}
#: most findings that are shown; the others are counted
FINDINGS = 8


def message_html(verdict: Verdict, message: str) -> str:
    """Return the message as HTML in the colour of its verdict."""
    colour = COLOURS[verdict]
    return f"<div style='border-left:5px solid {colour};padding:4px 12px;color:{colour}'>{escape(message)}</div>"


def table_html(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return an HTML table with numbers aligned right; empty without rows."""
    lines = [
        "<tr>" + "".join(f"<td{_side(cell)}>{escape(cell)}</td>" for cell in row) + "</tr>" for row in rows
    ]  # fmt: skip
    titles = "".join(f"<th style='text-align:left'>{escape(title)}</th>" for title in head)
    return f"<table><thead><tr>{titles}</tr></thead><tbody>{''.join(lines)}</tbody></table>" if lines else ""


def result_html(result: Result) -> str:
    """Return HTML: the message, tables of the limits of the tracks in use and of all tracks, and the first findings."""
    limits = table_html(
        ("limit", "worst", "allowed", "unit", "state", "track", "where"),
        (
            (check.column.label, check.worst_text, number_text(check.limit, 6), check.column.unit,
             check.state.value, track.name, check.where)
            for track in result.in_use
            for check in track.limits
        ),
    )  # fmt: skip
    tracks = table_html(
        (result.tracks[0].kind.value if result.tracks else "track", "in use", "time [s]", "verdict"),
        (
            (
                track.name,
                "yes" if track.in_use else "no",
                time_text(track.time_s, track.time_high_s),
                track.verdict.value,
            )
            for track in result.tracks
        ),
    )
    found = [*result.findings, *(finding for track in result.in_use for finding in track.findings)]
    return message_html(result.verdict, "\n".join(result.first_lines)) + limits + tracks + _findings(found)


def _findings(found: Sequence[Finding]) -> str:
    texts = list(dict.fromkeys(f"line {f.line}: {f.text}" if f.line else f.text for f in found))
    items = [f"<li>{escape(text)}</li>" for text in texts[:FINDINGS]]
    if len(texts) > FINDINGS:
        items.append(f"<li>and {len(texts) - FINDINGS} more</li>")
    return f"<ul>{''.join(items)}</ul>" if items else ""


def _side(cell: str) -> str:
    return " style='text-align:right'" if cell[:1].isdigit() or cell[:1] == "-" else ""
