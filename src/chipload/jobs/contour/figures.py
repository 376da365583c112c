"""The report of contours and pockets: sections, scene, programs."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from html import escape

import plotly.graph_objects as go

from chipload.jobs.contour.outcome import ContourResult, Operation
from chipload.jobs.contour.pass_figures import COLOURS, loads_along_pass, plan
from chipload.jobs.contour.programs import program_files
from chipload.jobs.contour.result import limits_of, samples_of
from chipload.jobs.contour.scene import blanks_of, scene_bytes
from chipload.machine.machine import Machine
from chipload.number_text import number_text
from chipload.planning.result import StrategyResult
from chipload.report.page import state_cell
from chipload.report.presentation import Presentation
from chipload.report.sheet import figure, items, table, value_text
from chipload.result import Verdict

#: what the independent check of a plan found
AGREES = {Verdict.HOLDS: "agrees", Verdict.UNPROVEN: "not compared", Verdict.EXCEEDS: '<span class="no">differs</span>'}


def presentation_of(outcome: ContourResult) -> Presentation:
    """The presentation of planned operations."""
    return Presentation(
        partial(_sections, outcome),
        partial(scene_bytes, outcome),
        partial(program_files, outcome),
        partial(blanks_of, outcome),
        partial(samples_of, outcome),
    )


def _sections(outcome: ContourResult, figures: dict[str, go.Figure]) -> list[str]:
    return [html for k, op in enumerate(outcome.operations) for html in _operation(outcome.machine, k, op, figures)]


def _operation(machine: Machine, k: int, op: Operation, figures: dict[str, go.Figure]) -> list[str]:
    result, c = op.result, op.cutter
    settings = ", ".join(
        f"{key} {value_text(value)}" for key, value in op.settings.items() if key not in ("kind", "use")
    )
    out = [
        f"<h2>Operation {k}: {escape(result.kind)}</h2>",
        f"<p>Released: <b>{escape(result.use)}</b>. Cutter {c.number}: D {c.diameter:g} mm, {c.flutes} flutes, "
        f"helix {_degrees(c.helix)} deg, overhang {c.overhang:g} mm.</p>",
        f'<p class="note">{escape(settings)}</p>',
        "<h3>Strategies</h3>",
        f'<p class="note">Engagement, force, torque and form error are those of the {_shown_name(op)}; the table of '
        "limits states what each limit covers.</p>",
        _strategies(machine, op),
        f"<h3>Along the {'pass' if result.kind != 'contour' else 'finish pass'}</h3>",
        figure(f"along-{k}", loads_along_pass(op), figures),
        "<h3>Plan view</h3>",
        '<p class="note">The pass is coloured by engagement, dashed lines are passes before it, diamonds are events, '
        "crosses exceed a limit. Click a name to show or hide it.</p>",
        figure(f"plan-{k}", plan(machine, op), figures),
    ]
    return out + (["<h3>Findings of the planner</h3>", items(result.findings)] if result.findings else [])


def _strategies(machine: Machine, op: Operation) -> str:
    """Strategies side by side in numbers."""
    head = [
        "strategy",
        "engagement [deg]",
        "force [N]",
        "torque [N m]",
        "form error [µm]",
        "time [s]",
        "limits",
        "plan against its check",
    ]
    rows = []
    for name, s in op.result.strategies.items():
        check = op.verifications.get(name)
        rows.append(
            [
                _name(name) + (" <b>in use</b>" if name == op.result.use else ""),
                _span(s, "engagement_deg"),
                _span(s, "force_xy_n"),
                _span(s, "torque_nm"),
                _most(s, "form_error_um"),
                _most(s, "time_s"),
                state_cell(Verdict.worst(c.state for c in limits_of(machine, op, s, name))),
                "not checked" if check is None else AGREES[check.verdict],
            ]
        )
    used = [name == op.result.use for name in op.result.strategies]
    return table(head, rows, numbers=(1, 2, 3, 4, 5), used=used)


def _shown_name(op: Operation) -> str:
    """Name of the rows that the table of strategies and the figures show."""
    return "finish pass" if op.result.kind == "contour" else "passes"


def _degrees(angle: float) -> str:
    return number_text(angle * 57.29577951308232)


def _name(strategy: str) -> str:
    return f'<span class="dot" style="background:{COLOURS[strategy]}"></span>{escape(strategy)}'


def _span(s: StrategyResult, key: str) -> str:
    """`min to max` of a summary value."""
    v = s.summary.get(key)
    return (
        f"{number_text(v['min'])} to {number_text(v['max'])}"
        if isinstance(v, Mapping) and "min" in v and "max" in v
        else _most(s, key)
    )


def _most(s: StrategyResult, key: str) -> str:
    v = s.summary.get(key)
    v = v.get("max") if isinstance(v, Mapping) else v
    return number_text(v) if isinstance(v, (int, float)) else "not known"
