"""report.html: one file that opens without a network and prints; the verdict first, then what does not hold and where.

Order of the page: verdict, what does not hold, and for each operation its strategies side by side, the pass along its
length, the plan, the view in space; then findings, what was not checked, where the numbers come from.
"""

from __future__ import annotations

from collections.abc import Mapping
from html import escape

import plotly.graph_objects as go

from chipload.planning.result import StrategyResult
from chipload.report.figures import COLOURS, along, plan, space
from chipload.report.outcome import REFUSED, WORDS, Operation, Outcome, failures, released, verdict
from chipload.report.sheet import definitions, figure, framed, heading, items, said, table
from chipload.report.summary import program_name


def page_bytes(outcome: Outcome) -> bytes:
    """report.html."""
    holds, says = verdict(outcome)
    figures: dict[str, go.Figure] = {}
    body = [
        *heading(outcome.title, holds, "Holds" if holds else "Does not hold", says.removeprefix(REFUSED)),
        *_failed(outcome),
    ]
    for k, op in enumerate(outcome.operations):
        body += _operation(k, op, figures)
    body += _rest(outcome)
    return framed(outcome.title, "holds" if holds else "does not hold", body, figures)


def _failed(outcome: Outcome) -> list[str]:
    rows = [
        [str(k), escape(f"{op.result.kind}, {op.result.use}"), escape(f.text), _place(f.at)]
        for k, op in enumerate(outcome.operations)
        for f in failures(op, op.result.use)
    ]
    head = ["operation", "strategy", "what does not hold", "place x, y [mm]"]
    return ["<h3>What does not hold</h3>", table(head, rows, numbers=(3,))] if rows else []


def _operation(k: int, op: Operation, figures: dict[str, go.Figure]) -> list[str]:
    result, c = op.result, op.cutter
    settings = ", ".join(f"{key} {said(value)}" for key, value in op.settings.items() if key not in ("kind", "use"))
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
        figure(f"along-{k}", along(op), figures),
        "<h3>From above</h3>",
        '<p class="note">The pass is coloured by engagement, dashed lines are passes before it, diamonds are events, '
        "crosses do not hold. Click a name to show or hide it.</p>",
        figure(f"plan-{k}", plan(op), figures),
        "<h3>In space</h3>",
        figure(f"space-{k}", space(op), figures),
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
            table(["strategy", "code", "what happened", "place x, y [mm]"], shown, numbers=(3,)),
        ]
        if len(events) > len(shown):
            out.append(f'<p class="note">{len(events) - len(shown)} more in summary.json.</p>')
    return out + (["<h3>Findings of the planner</h3>", items(result.findings)] if result.findings else [])


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
    return table(head, rows, numbers=(1, 2, 3, 4, 5), used=used)


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
    return table(["strategy", "limit", "at most", "worst", "place x, y [mm]", "status"], rows, numbers=(2, 3, 4))


def _rest(outcome: Outcome) -> list[str]:
    out = []
    if outcome.findings:
        out += ["<h2>Findings</h2>", items(outcome.findings)]
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
    out.append(items(unchecked) if unchecked else "<p>Every limit that chipload knows is stated and was checked.</p>")
    return [*out, "<h2>Where the numbers come from</h2>", definitions(outcome.provenance)]


# -- parts ------------------------------------------------------------------------------------------------------
def _word(limit: str) -> str:
    return WORDS[limit][0] if limit in WORDS else limit


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
