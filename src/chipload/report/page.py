"""report.html: one layout for every capability.

The verdict and its message come first, then what exceeds or is not proven, and what was not checked. The rest is
folded: the limits (open where one does not hold), the tracks, the view in space (open), the sections of the capability,
notes, and where the numbers come from.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import asdict
from html import escape

import plotly.graph_objects as go

from chipload.errors import Finding, Severity
from chipload.number_text import number_text, percent_text
from chipload.report.answer import critical_html
from chipload.report.presentation import Presentation
from chipload.report.sheet import definitions, fold_sections, frame_page, heading_lines, items, table
from chipload.report.view import viewer_script
from chipload.report.view_section import DATA, VIEW
from chipload.result import LimitCheck, Result, Track, TrackKind, Verdict
from chipload.result.budget import SHOWN, level_text
from chipload.result.times import JERK_NOTE, time_text

#: findings and limits that the report lists
LISTED = 300
#: up to so many tracks have all their limits in the table
WHOLE = 4
#: classes of the banner and of a cell by state
BANNERS = {Verdict.HOLDS: "good", Verdict.UNPROVEN: "open", Verdict.EXCEEDS: "bad"}
CELLS = {Verdict.HOLDS: "ok", Verdict.UNPROVEN: "may", Verdict.EXCEEDS: "no"}
#: parts of the time of a program in the table of tracks
TIMES = ("in cut", "in air", "rapids", "dwell", "other")
#: headings of the table of tracks
HEADINGS = {
    TrackKind.STRATEGY: "Strategies",
    TrackKind.VARIANT: "Variants",
    TrackKind.CONTROLLER: "Controllers",
    TrackKind.PROGRAM: "Programs",
    TrackKind.MEASUREMENT: "Measurements",
}


def page_bytes(result: Result, presentation: Presentation, view: Sequence[str] = ()) -> bytes:
    """report.html; ``view``: HTML of the 3D view, empty: it has none."""
    figures: dict[str, go.Figure] = {}
    verdict, findings = result.verdict, _findings(result)
    unheld = any(c.state is not Verdict.HOLDS for track in result.tracks if track.in_use for c in track.limits)
    sections = [
        "<h2>Limits</h2>",
        *limits_table(result.tracks),
        *tracks_table(result.tracks),
        *view,
        *presentation.sections(figures),
        *findings_table("Notes", tuple(f for f in findings if f.severity is Severity.NOTE)),
        "<h2>Provenance</h2>",
        definitions(asdict(result.provenance)),
    ]
    body = [
        *heading_lines(result.title, BANNERS[verdict], verdict.value, result.first_lines, critical_html(result)),
        *changes_list(result),
        *findings_table("Findings", tuple(f for f in findings if f.severity is not Severity.NOTE)),
        "<h2>Not checked</h2>",
        items(result.unchecked) if result.unchecked else "<p>Every limit and check is stated.</p>",
        *fold_sections(sections, ["In space", *(["Limits"] if unheld else [])]),
    ]
    shown = (VIEW, DATA, viewer_script()) if view else None
    return frame_page(result.title, verdict.value, body, figures, shown)


def changes_list(result: Result) -> list[str]:
    """Changes that would settle what does not hold; nothing where there is none."""
    if not result.changes:
        return []
    note = '<p class="note">Each is a prediction: run the job with the change to prove it.</p>'
    return ["<h2>What to change</h2>", items([change.line_text for change in result.changes]), note]


def limits_table(tracks: Iterable[Track]) -> list[str]:
    """Every limit, those of tracks in use first, within a track the worst state first.

    Of more than :data:`WHOLE` tracks those not in use show the limits that do not hold, the rest in one row.
    Behind the worst value a column is left out where all its cells are empty. Reason, coverage and the parts of the
    value at a confidence stand below the row, in the width of the table.
    """
    all_tracks = list(tracks)
    whole = len(all_tracks) <= WHOLE
    order = list(Verdict)
    checks: list[tuple[Track, LimitCheck | None]] = []
    for track in sorted(all_tracks, key=lambda track: not track.in_use):
        shown = [check for check in track.limits if whole or track.in_use or check.state is not Verdict.HOLDS]
        shown.sort(key=lambda check: -order.index(check.state))
        checks += [(track, check) for check in shown]
        if len(shown) < len(track.limits):
            checks.append((track, None))
    if not checks:
        return ["<p>No limit was checked.</p>"]
    rows = [_limit_row(track, check) for track, check in checks[:LISTED]]
    head = ["track", "limit", "state", "limit value", "worst", "resolution", _level(checks), "line"]
    head += ["time [s]", "place [mm]"]
    kept = [k for k in range(len(head)) if k < 5 or any(row[k] for row in rows)]
    numbers = tuple(i for i, k in enumerate(kept) if k in (3, 4, 5, 6, 7, 8))
    cells = [[row[k] for k in kept] for row in rows]
    notes = [_limit_note(check) for _, check in checks[:LISTED]]
    partly = any(check is not None and not check.coverage.whole for _, check in checks)
    covers = "A limit covers every step of its track" + (
        ", where the line below it names no others." if partly else "."
    )
    return [
        f'<p class="note">{covers}</p>',
        table([head[k] for k in kept], cells, numbers, [t.in_use for t, _ in checks[:LISTED]], notes),
    ]


def _level(checks: Iterable[tuple[Track, LimitCheck | None]]) -> str:
    """Head of the column of values at a confidence: all limits of a job have one."""
    levels = {x.budget.shown_at for _, x in checks if x is not None and x.budget is not None}
    return f"at {level_text(max(levels, default=SHOWN))}"


def _limit_row(track: Track, check: LimitCheck | None) -> list[str]:
    """A limit of a track; None: those that hold, in one row."""
    name = escape(track.name) + (" <b>in use</b>" if track.in_use else "")
    if check is None:
        passing = [x.column.label for x in track.limits if x.state is Verdict.HOLDS]
        others = "all limits" if len(passing) == len(track.limits) else "the other limits"
        text = f'<span title="{escape(", ".join(passing))}">{others} ({len(passing)})</span>'
        return [name, text, state_cell(Verdict.HOLDS), *[""] * 7]
    return [
        name,
        f'<span class="name">{escape(check.column.title)}</span>',
        state_cell(check.state),
        number_text(check.limit, 6),
        check.worst_text,
        percent_text(check.error) if check.error else "",
        "" if check.value_at_confidence is None else number_text(check.value_at_confidence, 3),
        str(check.line or ""),
        "" if check.t_s is None else number_text(check.t_s),
        place_cell(check),
    ]


def _limit_note(check: LimitCheck | None) -> str:
    """What stands below the row of a limit: why its state is so, what it covers, the parts of its error."""
    if check is None:
        return ""
    parts = "" if check.budget is None or check.worst is None else check.budget.parts_text(check.worst)
    level = "" if check.budget is None else level_text(check.budget.shown_at)
    texts = (
        check.reason,
        "" if check.coverage.whole else f"covers: {check.coverage.name}",
        f"at {level}: {parts}" if parts else "",
    )
    return " \u00b7 ".join(escape(text) for text in texts if text)


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
            time_text(track.time_s, track.time_high_s),
            *_times_cells(track),
            ", ".join(f"<code>{escape(name)}</code>" for name in track.programs),
        ]
        for track in tracks
    ]
    kind = tracks[0].kind
    head = [kind.value, "parameters", "verdict", "time [s]", *TIMES, "programs"]
    used = [t.in_use for t in tracks]
    note = '<p class="note">Other: tool change, start-up and the approach to the first point. The parts add up.'
    if any(track.time_high_s is not None for track in tracks):
        note += f" {JERK_NOTE}"
    note += "</p>"
    return [f"<h2>{HEADINGS[kind]}</h2>", table(head, rows, numbers=tuple(range(3, 9)), used=used), note]


def _times_cells(track: Track) -> list[str]:
    """The parts of the time of a program."""
    own = track.times
    if own is None:
        return [""] * len(TIMES)
    return [number_text(x) for x in (own.cut, own.air, own.rapid, own.dwell, own.other)]


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
