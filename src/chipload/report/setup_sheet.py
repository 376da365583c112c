"""The setup sheet, one printed page for the machine: verdict, machine, programs, tools, limits, guesses.

As setup.html, which a browser prints, and as setup.pdf.
"""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

from chipload.errors import InputError
from chipload.number_text import number_text
from chipload.report.answer import critical_html
from chipload.report.page import BANNERS, limits_table
from chipload.report.pdf import Block, SheetLine, SheetTable, one_page
from chipload.report.sheet import definitions, heading_lines, items, style, table
from chipload.result import LimitCheck, Result, Track, TrackKind, Verdict
from chipload.result.times import time_text

#: guesses, things not checked and limits that a page has room for
ROOM = 12
#: limits of the page in PDF at first, and what is left out where they do not fit
LIMITS, FEWER = 24, (12, 6, 3, 1)
_PAGE = "@page { size: A4; margin: 12mm; } main { max-width: 190mm; } td, th { padding: 3px 6px; }"


def setup_sheet(result: Result) -> bytes:
    """The sheet as HTML that prints on one A4 page; no script, no figures."""
    verdict = result.verdict
    tracks = _tracks(result)
    rows = [
        [
            escape(t.name),
            ", ".join(f"<code>{escape(name)}</code>" for name in t.programs),
            time_text(t.time_s, t.time_high_s, ".2f", 60.0),
            t.verdict.value,
        ]
        for t in tracks
    ]
    guesses = _guesses(result)
    machine = definitions({"machine": result.provenance.machine, "materials": ", ".join(result.provenance.materials)})
    tools = [definitions({"tools": numbers, "motions [mm]": box}) for numbers, box in _travel(result)]
    body = [
        *heading_lines(result.title, BANNERS[verdict], verdict.value, result.first_lines, critical_html(result)),
        machine,
        "<h2>Programs</h2>",
        table(["program", "files", "time [min]", "verdict"], rows, numbers=(2,)),
        *(["<h2>Tools and travel</h2>", *tools] if tools else []),
        "<h2>Limits</h2>",
        *limits_table(tracks),
        *(["<h2>Guesses to check at the machine</h2>", items(_short(guesses))] if guesses else []),
        *(["<h2>Not checked</h2>", items(_short(result.unchecked))] if result.unchecked else []),
        "<h2>Inputs</h2>",
        definitions(dict(result.provenance.inputs)),
    ]
    html = (
        '<!doctype html>\n<html lang="en"><head><meta charset="utf-8">'
        f"<title>{escape(result.title)}: setup</title><style>{style()}{_PAGE}</style></head>\n"
        f"<body><main>\n{chr(10).join(body)}\n</main></body></html>\n"
    )
    return html.encode()


def setup_pdf(result: Result) -> bytes:
    """The sheet as one A4 page of PDF; of long lists it holds the first entries and states how many more there are."""
    title = f"{result.title[:200]}: setup"
    pages = [_blocks(result, limits, room) for limits, room in ((LIMITS, ROOM), *((n, n) for n in FEWER))]
    pages.append([SheetLine(result.verdict.value.upper(), True, 1.8), SheetLine(result.message[:2000])])
    for blocks in pages:
        page = one_page(title, blocks)
        if page is not None:
            return page
    raise InputError("setup.pdf: the verdict does not fit on one page: export setup.html (--sheet)")


def _blocks(result: Result, limits: int, room: int) -> list[Block]:
    """Return the contents of the page, the worst limits first."""
    tracks = _tracks(result)
    programs = [
        (t.name, ", ".join(t.programs), time_text(t.time_s, t.time_high_s, ".2f", 60.0), t.verdict.value)
        for t in tracks[:room]
    ]
    order = list(Verdict)
    checks = sorted(((t, c) for t in tracks for c in t.limits), key=lambda one: -order.index(one[1].state))
    head = ("limit", "state", "limit value", "worst", "line", "reason")
    listed = SheetTable((head, *(_limit(t, c, len(tracks) > 1) for t, c in checks[:limits])), (26, 10, 11, 11, 7, 35))
    out: list[Block] = [
        SheetLine(f"chipload: {result.title}", size=1.1),
        SheetLine(f"{result.verdict.value.upper()}", True, 1.8),
        *map(SheetLine, result.first_lines),
        SheetLine(f"Machine: {result.provenance.machine}"),
        SheetLine(f"Materials: {', '.join(result.provenance.materials) or 'none'}"),
        SheetLine("Programs", True, 1.2),
        SheetTable((("program", "files", "time [min]", "verdict"), *programs), (30, 40, 15, 15)),
    ]
    out += [SheetLine(f"Tools {numbers}; motions [mm]: {box}") for numbers, box in _travel(result)[:room]]
    out += [SheetLine("Limits", True, 1.2), listed if checks else SheetLine("No limit was checked.")]
    if len(checks) > limits:
        out.append(SheetLine(f"{len(checks) - limits} more limits in report.html; none has a worse state."))
    for title, texts in (
        ("Guesses to check at the machine", _guesses(result)),
        ("Not checked", result.unchecked),
    ):
        if texts:
            out += [SheetLine(title, True, 1.2), *(SheetLine(f"- {text}") for text in _short(texts, room))]
    out += [
        SheetLine("Inputs", True, 1.2),
        *(SheetLine(f"{k}: {v}") for k, v in list(result.provenance.inputs.items())[:room]),
    ]
    return out


def _limit(track: Track, check: LimitCheck, named: bool) -> tuple[str, ...]:
    """The row of a limit."""
    name = f"{track.name}: {check.column.title}" if named else check.column.title
    name += "" if check.coverage.whole else f", {check.coverage.name}"
    return (name, check.state.value, number_text(check.limit, 6), check.worst_text, str(check.line or ""), check.reason)


def _tracks(result: Result) -> list[Track]:
    return [t for t in result.tracks if t.in_use and t.kind is not TrackKind.MEASUREMENT]


def _guesses(result: Result) -> list[str]:
    return [f.text for f in result.findings if f.code == "job-guess"]


def _travel(result: Result) -> list[tuple[str, str]]:
    """The tools that each program names, and the box of its motions."""
    out = []
    for operation in result.operations:
        program = operation.get("program")
        if isinstance(program, dict):
            box = program.get("box_mm", {})
            low, high = box.get("low", ()), box.get("high", ())
            where = ", ".join(f"{x} {a:.5g} to {b:.5g}" for x, a, b in zip("XYZ", low, high, strict=False))
            out.append((", ".join(map(str, program.get("tools", ()))), where))
    return out


def _short(texts: Sequence[str], room: int = ROOM) -> list[str]:
    more = [f"{len(texts) - room} more in report.html"] if len(texts) > room else []
    return [*texts[:room], *more]
