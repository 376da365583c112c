"""setup.html: one printed page for the machine: verdict, machine, cutters, programs, limits, guesses."""

from __future__ import annotations

from html import escape

from chipload.report.page import BANNERS, limits_table
from chipload.report.sheet import definitions, heading, items, style, table
from chipload.result import Result, TrackKind

#: guesses, things not checked and limits that a page has room for
ROOM = 12
_PAGE = "@page { size: A4; margin: 12mm; } main { max-width: 190mm; } td, th { padding: 3px 6px; }"


def setup_sheet(result: Result) -> bytes:
    """The sheet as HTML that prints on one A4 page; no script, no figures."""
    verdict = result.verdict
    tracks = [t for t in result.tracks if t.in_use and t.kind is not TrackKind.MEASUREMENT]
    rows = [
        [
            escape(t.name),
            ", ".join(f"<code>{escape(name)}</code>" for name in t.programs),
            "" if t.time_s is None else f"{t.time_s / 60.0:.2f}",
            t.verdict.value,
        ]
        for t in tracks
    ]
    guesses = [f.text for f in result.findings if f.code == "job-guess"]
    machine = definitions({"machine": result.provenance.machine, "materials": ", ".join(result.provenance.materials)})
    body = [
        *heading(result.title, BANNERS[verdict], verdict.value, result.message),
        machine,
        "<h2>Programs</h2>",
        table(["program", "files", "time [min]", "verdict"], rows, numbers=(2,)),
        *_tools(result),
        "<h2>Limits</h2>",
        *limits_table(tracks),
        *(["<h2>Guesses, to be checked at the machine</h2>", _short(guesses)] if guesses else []),
        *(["<h2>Not checked</h2>", _short(list(result.unchecked))] if result.unchecked else []),
        "<h2>Inputs</h2>",
        definitions(dict(result.provenance.inputs)),
    ]
    html = (
        '<!doctype html>\n<html lang="en"><head><meta charset="utf-8">'
        f"<title>{escape(result.title)}: setup</title><style>{style()}{_PAGE}</style></head>\n"
        f"<body><main>\n{chr(10).join(body)}\n</main></body></html>\n"
    )
    return html.encode()


def _tools(result: Result) -> list[str]:
    """The tools that the programs name, and the box of their motions."""
    out: list[str] = []
    for operation in result.operations:
        program = operation.get("program")
        if isinstance(program, dict):
            box = program.get("box_mm", {})
            low, high = box.get("low", ()), box.get("high", ())
            where = ", ".join(f"{x} {a:.5g} to {b:.5g}" for x, a, b in zip("XYZ", low, high, strict=False))
            out.append(definitions({"tools": ", ".join(map(str, program.get("tools", ()))), "motions [mm]": where}))
    return ["<h2>Tools and travel</h2>", *out] if out else []


def _short(texts: list[str]) -> str:
    more = [f"{len(texts) - ROOM} more in report.html"] if len(texts) > ROOM else []
    return items([*texts[:ROOM], *more])
