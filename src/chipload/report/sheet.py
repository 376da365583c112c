"""The layout of printed and self-contained pages: style, frame, tables, figures."""

from __future__ import annotations

import base64
import json
import re
import zlib
from collections.abc import Collection, Iterable, Mapping, Sequence
from functools import lru_cache
from html import escape
from typing import Any

import plotly.graph_objects as go
from plotly.offline import get_plotlyjs

from chipload.report.answer import STYLE as ANSWER_STYLE

_STYLE = (
    ANSWER_STYLE
    + """
:root { --ink: #1f2933; --soft: #5f6b7a; --line: #d9dde2; --good: #0b6b4f; --bad: #b3261e; --may: #8a5a00;
  --paper: #ffffff; }
* { box-sizing: border-box; }
body { margin: 0; background: #f4f5f7; color: var(--ink);
  font: 14px/1.5 system-ui, -apple-system, "Segoe UI", "DejaVu Sans", sans-serif; }
main { max-width: 1180px; margin: 0 auto; padding: 24px 32px 48px; background: var(--paper); }
h1 { font-size: 15px; font-weight: 600; color: var(--soft); margin: 0 0 12px; }
h2 { font-size: 18px; margin: 36px 0 8px; padding-top: 14px; border-top: 1px solid var(--line); }
h3 { font-size: 14px; margin: 22px 0 4px; }
details { border-top: 1px solid var(--line); margin-top: 14px; padding-top: 10px; }
summary { cursor: pointer; } summary h2 { display: inline; border: 0; margin: 0; padding: 0; }
p { margin: 4px 0 8px; max-width: 92ch; }
.verdict { border-left: 6px solid; padding: 12px 18px; font-size: 17px; line-height: 1.45; margin: 0 0 16px; }
.verdict b { display: block; font-size: 21px; }
.good { color: var(--good); border-color: var(--good); background: #eef7f3; }
.bad { color: var(--bad); border-color: var(--bad); background: #fcf1f0; }
.open { color: var(--may); border-color: #d19a1f; background: #fdf3dc; }
.verdict span { color: var(--ink); display: block; }
.verdict .more { font-size: 13px; color: var(--soft); }
.verdict .answer span { display: inline-block; } .verdict .answer { font-size: 15px; }
.note { color: var(--soft); font-size: 13px; }
td code { white-space: nowrap; }
table { border-collapse: collapse; width: 100%; margin: 6px 0 12px; font-variant-numeric: tabular-nums; }
th, td { text-align: left; padding: 5px 10px; border-bottom: 1px solid var(--line); vertical-align: top; }
thead th { font-weight: 600; color: var(--soft); font-size: 12.5px; border-bottom: 1.5px solid #aab2bb; }
td.n, th.n { text-align: right; white-space: nowrap; }
td:first-child, td .name { white-space: nowrap; }
tr.used td { background: #f1f7f6; }
tr.noted td { border-bottom: 0; padding-bottom: 0; }
tr.more td { color: var(--soft); font-size: 12.5px; padding-top: 1px; white-space: normal; }
.ok { color: var(--good); } .no { color: var(--bad); font-weight: 600; }
.may { color: var(--may); font-weight: 600; }
.dot { display: inline-block; width: 10px; height: 10px; border-radius: 5px; margin-right: 7px; }
ul { margin: 4px 0 10px; padding-left: 20px; } li { margin: 2px 0; }
dl { display: grid; grid-template-columns: max-content 1fr; gap: 2px 18px; margin: 6px 0; }
dt { color: var(--soft); } dd { margin: 0; overflow-wrap: anywhere; }
code { font: 12.5px ui-monospace, "DejaVu Sans Mono", monospace; }
.figure { width: 100%; margin: 4px 0 6px; }
@page { margin: 12mm; }
@media print { body { background: white; } main { max-width: none; padding: 0; } .figure, tr { break-inside: avoid; }
  tr.noted { break-after: avoid; } h2, h3, summary { break-after: avoid; }
  td:first-child, td .name { white-space: normal; } table { font-size: 11px; } th, td { padding: 4px 6px; }
  * { print-color-adjust: exact; -webkit-print-color-adjust: exact; } }
@media (max-width: 760px) { main { padding: 12px 10px 32px; } table { display: block; overflow-x: auto; }
  .figure { max-width: 100%; overflow: hidden; } dl { display: block; } dd { margin: 0 0 6px 12px; } }
"""
)
#: unpacks a script that the file holds compressed
_LIBRARIES = """
async function library(id) {
  const data = Uint8Array.from(atob(document.getElementById(id).textContent), c => c.charCodeAt(0));
  const stream = new Blob([data]).stream().pipeThrough(new DecompressionStream("deflate"));
  const script = document.createElement("script");
  script.textContent = await new Response(stream).text();
  document.head.append(script);
}
"""
#: runs in the page: each figure is drawn when it comes near the window; before printing all of them are, and every
#: folded section is opened
_DRAW = """
const figures = JSON.parse(document.getElementById("figures").textContent);
const config = {displaylogo: false, responsive: true, modeBarButtonsToRemove: ["select2d", "lasso2d", "autoScale2d"]};
const names = Object.keys(figures);
function draw(id) {
  const figure = figures[id];
  if (!figure) return;
  delete figures[id];
  Plotly.newPlot(id, figure.data, figure.layout, config);
}
const seen = new IntersectionObserver(list => list.forEach(e => { if (e.isIntersecting) draw(e.target.id); }),
  {rootMargin: "800px"});
Object.keys(figures).forEach(id => seen.observe(document.getElementById(id)));
addEventListener("beforeprint", () => {
  document.querySelectorAll("details").forEach(e => { e.open = true; });
  Object.keys(figures).forEach(draw);
  // as wide as a sheet of A4 between its margins
  names.forEach(id => Plotly.relayout(id, {width: 700}));
});
addEventListener("afterprint", () => names.forEach(id => Plotly.relayout(id, {width: null, autosize: true})));
"""


def style() -> str:
    """The style of every page."""
    return _STYLE


def frame_page(
    title: str,
    word: str,
    body: Sequence[str],
    figures: Mapping[str, go.Figure],
    view: tuple[str, str, str] | None = None,
) -> bytes:
    """The whole file: ``title: word`` in the window's bar, the body, the figures that are drawn when they are seen.

    Parameters
    ----------
    view : elements of the 3D view and of its document, and the script that shows it; None: there is none
    """
    # "<" cannot end the element when written as an escape of JSON
    data = json.dumps({k: json.loads(f.to_json()) for k, f in figures.items()}, separators=(",", ":"))
    data = data.replace("<", "\\u003c")
    wait = 'await library("plotly");' if figures else ""
    html = (
        '<!doctype html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{escape(title)}: {word}</title>"
        f"<style>{_STYLE}</style></head>\n<body><main>\n{chr(10).join(body)}\n</main>\n"
        f"<script>{_LIBRARIES}</script>\n{_shown_view(view)}{_library('plotly', get_plotlyjs()) if figures else ''}"
        f'<script id="figures" type="application/json">{data}</script>\n'
        f"<script>(async () => {{ {wait} {_DRAW} }})();</script>\n"
        "</body></html>\n"
    )
    return html.encode()


@lru_cache(maxsize=4)
def _library(name: str, script: str) -> str:
    """A script, compressed: a browser unpacks it itself."""
    data = base64.b64encode(zlib.compress(script.encode(), 9)).decode()
    return f'<script id="{name}" type="text/plain">{data}</script>\n'


def _shown_view(view: tuple[str, str, str] | None) -> str:
    if view is None:
        return ""
    place, data, script = view
    texts = f'[...document.querySelectorAll(".{data}")].map((e) => [e.dataset.name, e.textContent])'
    call = f'chiploadViewer.report("{place}", {texts})'
    return _library("viewer", script) + f'<script>library("viewer").then(() => {call});</script>\n'


def heading_lines(title: str, banner: str, word: str, lines: Sequence[str], answer: str = "") -> list[str]:
    """The first lines of a page: what it is about, and the verdict; ``banner`` is `good`, `open` or `bad`, ``answer``
    HTML between the verdict and its lines.
    """
    message, *more = lines
    texts = [f"<span>{escape(message)}</span>", *(f'<span class="more">{escape(line)}</span>' for line in more)]
    return [
        f"<h1>chipload &middot; {escape(title)}</h1>",
        f'<div class="verdict {banner}"><b>{word}</b>{answer}{"".join(texts)}</div>',
    ]


def figure(name: str, drawn: go.Figure, figures: dict[str, go.Figure]) -> str:
    """The place of a figure, which is put among ``figures``."""
    figures[name] = drawn
    return f'<div class="figure" id="{name}" style="height:{drawn.layout.height}px"></div>'


def fold_sections(body: Sequence[str], opened: Collection[str] = ()) -> list[str]:
    """Each section of a body, from its <h2> to the next, folded under its heading; those in ``opened`` are open.

    >>> fold_sections(["<h2>Limits</h2>", "<p>none</p>"])
    ['<details><summary><h2>Limits</h2></summary><p>none</p></details>']
    """
    before, *sections = re.split(r"<h2>(.*?)</h2>", "\n".join(body), flags=re.S)
    out = [before] if before.strip() else []
    for name, content in zip(sections[::2], sections[1::2], strict=True):
        state = " open" if name in opened else ""
        out.append(f"<details{state}><summary><h2>{name}</h2></summary>{content.strip()}</details>")
    return out


def table(
    head: Iterable[str],
    rows: Iterable[Iterable[str]],
    numbers: tuple[int, ...] = (),
    used: Iterable[bool] = (),
    notes: Iterable[str] = (),
) -> str:
    """A table of HTML cells; columns ``numbers`` stand at the right, rows ``used`` are tinted, ``notes`` stand below
    their rows in the width of the table, none where they are empty.
    """

    def cells(tag: str, row: Iterable[str]) -> str:
        return "".join(f"<{tag}{' class=n' if i in numbers else ''}>{x}</{tag}>" for i, x in enumerate(row))

    head, rows = list(head), list(rows)
    marks, texts = list(used) or [False] * len(rows), list(notes) or [""] * len(rows)
    lines = list[str]()
    for row, mark, note in zip(rows, marks, texts, strict=True):
        names = " ".join(name for name, on in (("used", mark), ("noted", bool(note))) if on)
        kind = f' class="{names}"' if names else ""
        lines.append(f"<tr{kind}>{cells('td', row)}</tr>")
        if note:
            tint = "more used" if mark else "more"
            lines.append(f'<tr class="{tint}"><td></td><td colspan="{len(head) - 1}">{note}</td></tr>')
    return f"<table><thead><tr>{cells('th', head)}</tr></thead><tbody>{''.join(lines)}</tbody></table>"


def items(texts: Iterable[str]) -> str:
    """A list of plain texts."""
    return f"<ul>{''.join(f'<li>{escape(t)}</li>' for t in texts)}</ul>"


def definitions(values: Mapping[str, Any], prefix: str = "") -> str:
    """Names and plain values, nested ones one after the other."""
    rows = "".join(f"<dt>{escape(k)}</dt><dd>{escape(v)}</dd>" for k, v in _flat(values, prefix))
    return f"<dl>{rows}</dl>"


def _flat(values: Mapping[str, Any], prefix: str) -> Iterable[tuple[str, str]]:
    for key, value in values.items():
        if isinstance(value, Mapping):
            yield from _flat(value, f"{prefix}{key} ")
        else:
            yield prefix + str(key), value_text(value)


def value_text(value: Any) -> str:
    """A value as text, a list with commas."""
    return ", ".join(str(v) for v in value) if isinstance(value, (list, tuple)) else str(value)
