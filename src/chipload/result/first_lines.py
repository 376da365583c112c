"""The first lines of a verdict: state, critical limit, what is not proven, what is not covered and not checked."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace

from chipload.errors import Finding
from chipload.number_text import number_text
from chipload.result.budget import level_text
from chipload.result.coverage import Coverage
from chipload.result.limits import LimitCheck
from chipload.result.track import Track
from chipload.result.verdict import Verdict

#: code of the finding that states a guess of a draft
GUESS = "job-guess"
#: begins the reason of a limit that holds with guessed values
HELD_BY_GUESS = "it holds with the guessed"
#: names of things that are not checked which the first lines list
LISTED = 8


def headline(verdict: Verdict, findings: Sequence[Finding], tracks: Sequence[Track]) -> str:
    """Return the first line: the state, the critical limit with its margin and its place, and what is not proven.

    What exceeds comes first, the most first; then what is unproven. The critical limit is the one with the least
    margin.

    Parameters
    ----------
    findings : of the whole result
    tracks : those in use
    """
    checks = [(_track_prefix(track, tracks), check) for track in tracks for check in track.limits]
    least = critical_check(check for _, check in checks)
    critical = next(((of, check) for of, check in checks if check is least), None)
    if verdict is Verdict.HOLDS:
        held = (
            critical[0] + critical_text(critical[1]) if critical else ", ".join(of + check.text for of, check in checks)
        )
        levels = {c.budget.confidence for _, c in checks if c.budget is not None and c.by_confidence}
        return f"Holds at {level_text(min(levels))}: {held}." if levels else f"Holds: {held}."
    found = list(dict.fromkeys(_texts(verdict, findings, tracks))) or ["no limit was checked"]
    line = f"{verdict.value.capitalize()}: {_found_text(found)}."
    if critical is not None and not found[0].startswith(critical[0] + critical[1].text):
        line += f" Critical limit: {critical[0]}{critical_text(critical[1])}."
    return line


def reason_line(verdict: Verdict, findings: Sequence[Finding], tracks: Sequence[Track]) -> str:
    """Return what exceeds or is not proven, the worst first and how many more there are; empty: everything holds."""
    if verdict is Verdict.HOLDS:
        return ""
    found = _found_text(list(dict.fromkeys(_texts(verdict, findings, tracks))) or ["no limit was checked"])
    return f"{found[0].upper()}{found[1:]}."


def critical_check(checks: Iterable[LimitCheck]) -> LimitCheck | None:
    """Return the check with the least margin; None: none has a margin.

    >>> checks = [LimitCheck("force_n", 500.0, f, Verdict.HOLDS, resolution_error=0.0) for f in (100.0, 400.0)]
    >>> critical_check(checks).text
    'force 400 of 500 N'
    """
    known = (check for check in checks if check.margin is not None)
    return min(known, key=lambda check: (check.margin or 0.0, check.name), default=None)


def coverage_line(tracks: Sequence[Track]) -> str:
    """Return what the limits of the tracks in use do not cover, where other cuts are beyond a limit; empty: nothing."""
    left: dict[tuple[str, Coverage], list[str]] = {}
    for track in tracks:
        for check in track.limits:
            covered, column = check.coverage, check.column
            worst = covered.excluded_worst
            if worst is not None and (worst < check.limit if column.least else worst > check.limit):
                key = (_track_prefix(track, tracks), replace(covered, excluded_worst=None))
                left.setdefault(key, []).append(covered.excluded_text(column.label, column.unit, check.limit))
    parts = [f"{of}{covered.outside}: {', '.join(texts)}" for (of, covered), texts in left.items()]
    return f"Not covered: {'; '.join(parts)}." if parts else ""


def confidence_line(tracks: Sequence[Track]) -> str:
    """Return the value at the confidence, with the parts of its error, of the limit that it uses most; empty: no limit
    has an error budget.
    """
    checks = [(_track_prefix(track, tracks), c) for track in tracks for c in track.limits if c.limit > 0.0]
    known = [(of, c, c.value_at_confidence / c.limit) for of, c in checks if c.value_at_confidence is not None]
    if not known:
        return ""
    of, check, _ = max(known, key=lambda each: each[2])
    text = check.confidence_text
    return f"{of}{text[0].upper()}{text[1:]}, the limit is {number_text(check.limit, 6)}."


def unchecked_line(unchecked: Iterable[str]) -> str:
    """Return what is not checked, in one line; empty: everything is.

    >>> unchecked_line(["limit power_w: not stated", "fixtures: none is stated", "limit torque_nm: not stated"])
    'Not checked: fixtures; limits power_w, torque_nm.'
    """
    names = list(dict.fromkeys(text.partition(": ")[0] for text in unchecked))
    limits = [name.removeprefix("limit ") for name in names if name.startswith("limit ")]
    shown = [name for name in names if not name.startswith("limit ")]
    if limits:
        shown.append(f"limit{'s' if len(limits) > 1 else ''} {', '.join(limits)}")
    if len(shown) > LISTED:
        shown = [*shown[:LISTED], f"{len(shown) - LISTED} more"]
    return f"Not checked: {'; '.join(shown)}." if shown else ""


def _texts(verdict: Verdict, findings: Sequence[Finding], tracks: Sequence[Track]) -> Iterator[str]:
    """Yield each finding and limit of a state: findings, limits with the least margin first, then the guesses.

    A limit that holds but for a guess stands for nothing of its own.
    """
    guesses = 0
    for f in findings:
        if Verdict.of_finding(f) is verdict:
            guesses += f.code == GUESS
            if f.code != GUESS:
                yield located_text(f)
    for track in tracks:
        of = _track_prefix(track, tracks)
        for f in track.findings:
            if Verdict.of_finding(f) is verdict:
                yield of + located_text(f)
        own = [c for c in track.limits if c.state is verdict and not (guesses and c.reason.startswith(HELD_BY_GUESS))]
        for check in sorted(own, key=lambda c: 0.0 if c.margin is None else c.margin):
            beyond = verdict is Verdict.EXCEEDS and check.margin_text
            yield f"{of}{check.text}, {check.margin_text}" if beyond else of + check.text
    if guesses:
        yield f"{guesses} values of the job are guesses" if guesses > 1 else "1 value of the job is a guess"


def critical_text(check: LimitCheck) -> str:
    """Return a limit with its margin, its line and its place.

    >>> critical_text(LimitCheck("force_n", 500.0, 400.0, Verdict.HOLDS, line=7, resolution_error=0.0))
    'force 400 of 500 N, margin 20 %, in line 7'
    """
    if check.state is Verdict.EXCEEDS:
        return f"{check.text}, {check.margin_text}"
    parts = [check.value_text, check.margin_text if (check.margin or 0.0) >= 0.0 else "", check.where]
    if check.state is Verdict.UNPROVEN:
        parts.append(f"unproven: {check.reason}")
    return ", ".join(filter(None, parts))


def located_text(finding: Finding) -> str:
    """Return the text of a finding with its line.

    >>> located_text(Finding("x", 18, "would be a rapid")), located_text(Finding("x", 2, "no feed"))
    ('line 18 would be a rapid', 'line 2: no feed')
    """
    if not finding.line:
        return finding.text
    return f"line {finding.line}{' ' if finding.text.startswith('would ') else ': '}{finding.text}"


def _found_text(found: Sequence[str]) -> str:
    """The first of several texts, and how many more there are."""
    return f"{found[0]}; and {len(found) - 1} more" if len(found) > 1 else found[0]


def _track_prefix(track: Track, tracks: Sequence[Track]) -> str:
    return f"{track.name}: " if len(tracks) > 1 else ""
