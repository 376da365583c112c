"""report.html: one skeleton for every capability.

The verdict and its message come first, then the limits, the tracks, the sections of the capability, findings, what was
not checked, and where the numbers come from.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict
from html import escape

import plotly.graph_objects as go

from chipload.errors import Finding, Severity
from chipload.report.presentation import Presentation
from chipload.report.sheet import definitions, framed, heading, items, table
from chipload.result import LimitCheck, Result, Track, TrackKind, Verdict

#: findings and limits that the report lists
LISTED = 300
#: classes of the banner and of a cell by state
BANNERS = {Verdict.HOLDS: "good", Verdict.UNPROVEN: "open", Verdict.EXCEEDS: "bad"}
CELLS = {Verdict.HOLDS: "ok", Verdict.UNPROVEN: "may", Verdict.EXCEEDS: "no"}
#: headings of the table of tracks
HEADINGS = {
    TrackKind.STRATEGY: "Strategies",
    TrackKind.VARIANT: "Variants",
    TrackKind.CONTROLLER: "Controllers",
    TrackKind.PROGRAM: "Programs",
    TrackKind.MEASUREMENT: "Measurements",
}


def page_bytes(result: Result, presentation: Presentation) -> bytes:
    """report.html."""
    figures: dict[str, go.Figure] = {}
    verdict = result.verdict
    body = [
        *heading(result.title, BANNERS[verdict], verdict.value, result.message),
        "<h2>Limits</h2>",
        *limits_table(result.tracks),
        *tracks_table(result.tracks),
        *presentation.sections(figures),
        *findings_table("Findings", _findings(result)),
        "<h2>Not checked</h2>",
        items(result.unchecked) if result.unchecked else "<p>Every limit and check is stated.</p>",
        "<h2>Provenance</h2>",
        definitions(asdict(result.provenance)),
    ]
    return framed(result.title, verdict.value, body, figures)


def limits_table(tracks: Iterable[Track]) -> list[str]:
    """Every limit of every track; those of tracks in use first, within them the worst state first."""
    checks = [(track, check) for track in tracks for check in track.limits]
    order = list(Verdict)
    checks.sort(key=lambda x: (not x[0].in_use, -order.index(x[1].state)))
    if not checks:
        return ["<p>No limit was checked.</p>"]
    rows = [
        [
            escape(track.name) + (" <b>in use</b>" if track.in_use else ""),
            escape(check.column.title),
            state_cell(check.state),
            f"{check.limit:g}",
            "not known" if check.worst is None else f"{check.worst:.4g}",
            f"{100.0 * check.resolution_error:.2g} %" if check.resolution_error else "",
            str(check.line or ""),
            "" if check.t_s is None else f"{check.t_s:.4g}",
            place_cell(check),
            escape(check.reason),
        ]
        for track, check in checks[:LISTED]
    ]
    head = ["track", "limit", "state", "limit value", "worst", "resolution", "line", "time [s]", "place [mm]", "reason"]
    return [table(head, rows, numbers=(3, 4, 5, 6, 7), used=[t.in_use for t, _ in checks[:LISTED]])]


def tracks_table(tracks: tuple[Track, ...]) -> list[str]:
    """Tracks side by side; nothing where there is one without a program."""
    if len(tracks) < 2 and not any(track.programs for track in tracks):
        return []
    rows = [
        [
            escape(track.name) + (" <b>in use</b>" if track.in_use else ""),
            escape(
                ", ".join(f"{k} {v:g}" if isinstance(v, float) else f"{k} {v}" for k, v in track.parameters.items())
            ),
            state_cell(track.verdict),
            "" if track.time_s is None else f"{track.time_s:.5g}",
            ", ".join(f"<code>{escape(name)}</code>" for name in track.programs),
        ]
        for track in tracks
    ]
    kind = tracks[0].kind
    head = [kind.value, "parameters", "verdict", "time [s]", "programs"]
    return [f"<h2>{HEADINGS[kind]}</h2>", table(head, rows, numbers=(3,), used=[t.in_use for t in tracks])]


def findings_table(title: str, findings: tuple[Finding, ...]) -> list[str]:
    """Findings, the worst first; nothing where there is none."""
    if not findings:
        return []
    ordered = sorted(findings, key=lambda f: -f.severity)
    rows = [
        [state_cell(Verdict.of_finding(f)) if f.severity else "note", str(f.line or ""), escape(f.text), escape(f.code)]
        for f in ordered[:LISTED]
    ]
    more = [f'<p class="note">{len(ordered) - LISTED} more in summary.json.</p>'] if len(ordered) > LISTED else []
    return [f"<h2>{title}</h2>", table(["state", "line", "finding", "code"], rows, numbers=(1,)), *more]


def state_cell(state: Verdict) -> str:
    """A state in its colour."""
    return f'<span class="{CELLS[state]}">{state.value}</span>'


def place_cell(check: LimitCheck) -> str:
    """Place of a check; empty where it is not known."""
    return check.place_text.replace(", ", ",&nbsp;")


def _findings(result: Result) -> tuple[Finding, ...]:
    """Findings of the result and of its tracks; those of a track that is not in use do not count as more than notes."""
    own = [
        f if track.in_use else Finding(f.code, f.line, f"{track.name}: {f.text}", Severity.NOTE, f.place, f.row)
        for track in result.tracks
        for f in track.findings
    ]
    return tuple(dict.fromkeys((*result.findings, *own)))
