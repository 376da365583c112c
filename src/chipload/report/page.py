"""report.html: one file that opens without a network and prints; the verdict first, then what does not hold and where.

Order of the page: verdict, what does not hold, and for each operation its strategies side by side, the pass along its
length, the plan, the view in space; then findings, what was not checked, where the numbers come from.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from html import escape
from typing import Any

import plotly.graph_objects as go
from plotly.offline import get_plotlyjs

from chipload.planning.result import StrategyResult
from chipload.report.figures import COLOURS, along, plan, space
from chipload.report.outcome import REFUSED, WORDS, Operation, Outcome, failures, released, verdict
from chipload.report.summary import program_name

_STYLE = """
:root { --ink: #1f2933; --soft: #5f6b7a; --line: #d9dde2; --good: #0b6b4f; --bad: #b3261e; --paper: #ffffff; }
* { box-sizing: border-box; }
body { margin: 0; background: #f4f5f7; color: var(--ink);
  font: 14px/1.5 system-ui, -apple-system, "Segoe UI", "DejaVu Sans", sans-serif; }
main { max-width: 1180px; margin: 0 auto; padding: 24px 32px 48px; background: var(--paper); }
h1 { font-size: 15px; font-weight: 600; color: var(--soft); margin: 0 0 12px; }
h2 { font-size: 18px; margin: 36px 0 8px; padding-top: 14px; border-top: 1px solid var(--line); }
h3 { font-size: 14px; margin: 22px 0 4px; }
p { margin: 4px 0 8px; max-width: 92ch; }
.verdict { border-left: 6px solid; padding: 12px 18px; font-size: 17px; line-height: 1.45; margin: 0 0 16px; }
.verdict b { display: block; font-size: 21px; }
.good { color: var(--good); border-color: var(--good); background: #eef7f3; }
.bad { color: var(--bad); border-color: var(--bad); background: #fcf1f0; }
.verdict span { color: var(--ink); }
.note { color: var(--soft); font-size: 13px; }
td code { white-space: nowrap; }
table { border-collapse: collapse; width: 100%; margin: 6px 0 12px; font-variant-numeric: tabular-nums; }
th, td { text-align: left; padding: 5px 10px; border-bottom: 1px solid var(--line); vertical-align: top; }
thead th { font-weight: 600; color: var(--soft); font-size: 12.5px; border-bottom: 1.5px solid #aab2bb; }
td.n, th.n { text-align: right; white-space: nowrap; }
td:first-child { white-space: nowrap; }
tr.used td { background: #f1f7f6; }
.ok { color: var(--good); } .no { color: var(--bad); font-weight: 600; }
.dot { display: inline-block; width: 10px; height: 10px; border-radius: 5px; margin-right: 7px; }
ul { margin: 4px 0 10px; padding-left: 20px; } li { margin: 2px 0; }
dl { display: grid; grid-template-columns: max-content 1fr; gap: 2px 18px; margin: 6px 0; }
dt { color: var(--soft); } dd { margin: 0; overflow-wrap: anywhere; }
code { font: 12.5px ui-monospace, "DejaVu Sans Mono", monospace; }
.figure { width: 100%; margin: 4px 0 6px; }
@media print { body { background: white; } main { max-width: none; padding: 0; } .figure, table { break-inside: avoid; }
  h2, h3 { break-after: avoid; } }
"""
#: runs in the page: each figure is drawn when it comes near the window, and all of them before printing
_DRAW = """
const figures = JSON.parse(document.getElementById("figures").textContent);
const config = {displaylogo: false, responsive: true, modeBarButtonsToRemove: ["select2d", "lasso2d", "autoScale2d"]};
function draw(id) {
  const figure = figures[id];
  if (!figure) return;
  delete figures[id];
  Plotly.newPlot(id, figure.data, figure.layout, config);
}
const seen = new IntersectionObserver(list => list.forEach(e => { if (e.isIntersecting) draw(e.target.id); }),
  {rootMargin: "800px"});
Object.keys(figures).forEach(id => seen.observe(document.getElementById(id)));
addEventListener("beforeprint", () => Object.keys(figures).forEach(draw));
"""


def page_bytes(outcome: Outcome) -> bytes:
    """report.html."""
    holds, says = verdict(outcome)
    figures: dict[str, go.Figure] = {}
    body = [
        f"<h1>chipload &middot; {escape(outcome.title)}</h1>",
        f'<div class="verdict {"good" if holds else "bad"}"><b>{"Holds" if holds else "Does not hold"}</b>'
        f"<span>{escape(says.removeprefix(REFUSED))}</span></div>",
        *_failed(outcome),
    ]
    for k, op in enumerate(outcome.operations):
        body += _operation(k, op, figures)
    body += _rest(outcome)
    # "<" cannot end the element when written as an escape of JSON
    data = json.dumps({k: json.loads(f.to_json()) for k, f in figures.items()}, separators=(",", ":"))
    data = data.replace("<", "\\u003c")
    html = (
        '<!doctype html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{escape(outcome.title)}: {'holds' if holds else 'does not hold'}</title>"
        f"<style>{_STYLE}</style></head>\n<body><main>\n{chr(10).join(body)}\n</main>\n"
        f"<script>{get_plotlyjs()}</script>\n"
        f'<script id="figures" type="application/json">{data}</script>\n<script>{_DRAW}</script>\n</body></html>\n'
    )
    return html.encode()


def _failed(outcome: Outcome) -> list[str]:
    rows = [
        [str(k), escape(f"{op.result.kind}, {op.result.use}"), escape(f.text), _place(f.at)]
        for k, op in enumerate(outcome.operations)
        for f in failures(op, op.result.use)
    ]
    head = ["operation", "strategy", "what does not hold", "place x, y [mm]"]
    return ["<h3>What does not hold</h3>", _table(head, rows, numbers=(3,))] if rows else []


def _operation(k: int, op: Operation, figures: dict[str, go.Figure]) -> list[str]:
    result, c = op.result, op.cutter
    settings = ", ".join(f"{key} {_said(value)}" for key, value in op.settings.items() if key not in ("kind", "use"))
    out = [
        f"<h2>Operation {k}: {escape(result.kind)}</h2>",
        f"<p>Released: <b>{escape(result.use)}</b>. Cutter {c.number}: D {c.diameter:g} mm, {c.flutes} flutes, "
        f"helix {_degrees(c.helix)} deg, overhang {c.overhang:g} mm.</p>",
        f'<p class="note">{escape(settings)}</p>',
        "<h3>Strategies side by side</h3>",
        _strategies(k, op),
        "<h3>Limits</h3>",
        _limits(op),
        f"<h3>Along the {'pass' if result.kind != 'contour' else 'finish pass'}</h3>",
        _figure(f"along-{k}", along(op), figures),
        "<h3>From above</h3>",
        '<p class="note">The pass is coloured by engagement, dashed lines are passes before it, diamonds are events, '
        "crosses do not hold. Click a name to show or hide it.</p>",
        _figure(f"plan-{k}", plan(op), figures),
        "<h3>In space</h3>",
        _figure(f"space-{k}", space(op), figures),
    ]
    events = [
        [_name(n), escape(e.code), escape(e.text), _place((e.x, e.y))]
        for n, s in result.strategies.items()
        for e in s.events
    ]
    if events:
        shown = events[:200]
        out += [
            "<h3>Events</h3>",
            _table(["strategy", "code", "what happened", "place x, y [mm]"], shown, numbers=(3,)),
        ]
        if len(events) > len(shown):
            out.append(f'<p class="note">{len(events) - len(shown)} more in summary.json.</p>')
    return out + (["<h3>Findings of the planner</h3>", _items(result.findings)] if result.findings else [])


def _strategies(k: int, op: Operation) -> str:
    head = ["strategy", "engagement [deg]", "force in the plane [N]", "torque [N m]", "wall error [um]", "time [s]"]
    head += ["limits", "simulation", "program"]
    rows = []
    for name, s in op.result.strategies.items():
        bad = [_word(c.name) for c in s.limits if not c.holds] + [e.code for e in s.events if e.failure]
        proof = op.proofs.get(name)
        status = "not checked" if proof is None else proof.status
        good = status == "proved"
        rows.append(
            [
                _name(name) + (" <b>in use</b>" if name == op.result.use else ""),
                _span(s, "engagement_deg"),
                _span(s, "force_xy_n"),
                _span(s, "torque_nm"),
                _most(s, "error_um"),
                _most(s, "time_s"),
                f'<span class="no">{escape(", ".join(dict.fromkeys(bad)))}</span>'
                if bad
                else '<span class="ok">hold</span>',
                f'<span class="{"ok" if good else "no"}" title="{escape(proof.says if proof else "")}">{status}</span>',
                f"<code>{program_name(k, name)}</code>" + (" verified" if released(op, name) else ""),
            ]
        )
    used = [name == op.result.use for name in op.result.strategies]
    return _table(head, rows, numbers=(1, 2, 3, 4, 5), used=used)


def _limits(op: Operation) -> str:
    """Every limit and strategy; those that do not hold first."""
    checks = [(not c.holds, name, c) for name, s in op.result.strategies.items() for c in s.limits]
    checks.sort(key=lambda x: not x[0])
    rows = [
        [
            _name(name),
            escape(" ".join(WORDS[c.name]) if c.name in WORDS else c.name),
            f"{c.limit:g}",
            f"{c.worst:.4g}",
            _place(c.at),
            '<span class="no">does not hold</span>' if bad else '<span class="ok">holds</span>',
        ]
        for bad, name, c in checks
    ]
    return _table(["strategy", "limit", "at most", "worst", "place x, y [mm]", "status"], rows, numbers=(2, 3, 4))


def _rest(outcome: Outcome) -> list[str]:
    out = []
    if outcome.findings:
        out += ["<h2>Findings</h2>", _items(outcome.findings)]
    out.append("<h2>What was not checked</h2>")
    unchecked = [f"{_word(name)}: the job states no limit" for name in outcome.unchecked]
    unchecked += [
        f"operation {k}, {name}: {proof.says}"
        for k, op in enumerate(outcome.operations)
        for name, proof in op.proofs.items()
        if proof.status == "unproven"
    ]
    unchecked += [
        f"operation {k}, {name}: engagement of {proof.numbers['rows_not_compared']} steps down into the stock"
        for k, op in enumerate(outcome.operations)
        for name, proof in op.proofs.items()
        if proof.numbers.get("rows_not_compared")
    ]
    out.append(_items(unchecked) if unchecked else "<p>Every limit that chipload knows is stated and was checked.</p>")
    return [*out, "<h2>Where the numbers come from</h2>", _definitions(outcome.provenance)]


# -- parts ------------------------------------------------------------------------------------------------------
def _figure(name: str, figure: go.Figure, figures: dict[str, go.Figure]) -> str:
    figures[name] = figure
    return f'<div class="figure" id="{name}" style="height:{figure.layout.height}px"></div>'


def _table(
    head: Iterable[str], rows: Iterable[Iterable[str]], numbers: tuple[int, ...] = (), used: Iterable[bool] = ()
) -> str:
    def cells(tag: str, row: Iterable[str]) -> str:
        return "".join(f"<{tag}{' class=n' if i in numbers else ''}>{x}</{tag}>" for i, x in enumerate(row))

    rows = list(rows)
    marks = list(used) or [False] * len(rows)
    lines = [f"<tr{' class=used' if m else ''}>{cells('td', r)}</tr>" for r, m in zip(rows, marks, strict=True)]
    return f"<table><thead><tr>{cells('th', head)}</tr></thead><tbody>{''.join(lines)}</tbody></table>"


def _items(texts: Iterable[str]) -> str:
    return f"<ul>{''.join(f'<li>{escape(t)}</li>' for t in texts)}</ul>"


def _definitions(values: Mapping[str, Any], prefix: str = "") -> str:
    rows = "".join(f"<dt>{escape(k)}</dt><dd>{escape(v)}</dd>" for k, v in _flat(values, prefix))
    return f"<dl>{rows}</dl>"


def _flat(values: Mapping[str, Any], prefix: str) -> Iterable[tuple[str, str]]:
    for key, value in values.items():
        if isinstance(value, Mapping):
            yield from _flat(value, f"{prefix}{key} ")
        else:
            yield prefix + str(key), _said(value)


def _word(limit: str) -> str:
    return WORDS[limit][0] if limit in WORDS else limit


def _said(value: Any) -> str:
    return ", ".join(str(v) for v in value) if isinstance(value, (list, tuple)) else str(value)


def _degrees(angle: float) -> str:
    return f"{angle * 57.29577951308232:.4g}"


def _name(strategy: str) -> str:
    return f'<span class="dot" style="background:{COLOURS[strategy]}"></span>{escape(strategy)}'


def _place(at: tuple[float, float] | None) -> str:
    return "" if at is None else f"{at[0]:.3f}, {at[1]:.3f}"


def _span(s: StrategyResult, key: str) -> str:
    """`min to max` of a summary value."""
    v = s.summary.get(key)
    return (
        f"{v['min']:.4g} to {v['max']:.4g}" if isinstance(v, Mapping) and "min" in v and "max" in v else _most(s, key)
    )


def _most(s: StrategyResult, key: str) -> str:
    v = s.summary.get(key)
    v = v.get("max") if isinstance(v, Mapping) else v
    return f"{v:.4g}" if isinstance(v, (int, float)) else "not known"
