"""The result of a program with new feeds: the tracks before and after, their limits, the lines that rub."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from chipload.checking.outcome import SimulationResult
from chipload.checking.result import changed_name, changed_tracks, program_result
from chipload.checking.rows import step_rows
from chipload.errors import Finding, Severity
from chipload.jobs.feeds.numbers import feed_numbers
from chipload.jobs.feeds.outcome import FeedResult, FeedsProgram
from chipload.number_text import number_text
from chipload.result import Result
from chipload.result.limits import Columns


def result_of(program: FeedsProgram) -> Result:
    """Return the result of a program with new feeds."""
    simulation, own = program.simulated, program.feeds
    time_s, name = float(program.seconds.sum()), changed_name(program, "feeds")
    tracks = changed_tracks(
        program, simulation, own, name, "gouge_mm", "excess_mm",
        found=_rubbing_findings(own), blocks=lambda: _with_cause(simulation, own),
    )  # fmt: skip
    numbers = {"feeds": feed_numbers(own, simulation, tracks[0].limits, time_s, name)}
    note = f"The program takes {number_text(time_s)} s instead of {number_text(own.seconds_before)} s."
    return program_result("feeds", program, tracks, numbers, " ".join((note, *division_notes(own))))


def division_notes(feeds: FeedResult) -> tuple[str, ...]:
    """Return sentences on the lines that are divided, and on those that would be faster in segments."""
    out = []
    if feeds.segments:
        segments, lines = sum(len(x) for x in feeds.segments.values()), len(feeds.segments)
        out.append(f"Divided: {segments} segments in {lines} {'line' if lines == 1 else 'lines'}.")
    if feeds.not_divided:
        count = sum(feeds.not_divided.values())
        why = ", ".join(f"{reason} {n}" for reason, n in sorted(feeds.not_divided.items()))
        out.append(f"Not divided: {count} {'line that changes' if count == 1 else 'lines that change'} load ({why}).")
    return tuple(out)


def _rubbing_findings(feeds: FeedResult) -> tuple[Finding, ...]:
    """Return a finding for each line that cuts below the least feed per tooth."""
    least = feeds.tooth_feed_least
    return tuple(
        Finding("rubbing", line, f"feed per tooth {feed:.3g} mm is less than {least:g} mm", Severity.EXCEEDS)
        for line, feed in feeds.rubs
    )


def _with_cause(simulation: SimulationResult, feeds: FeedResult) -> Iterator[Columns]:
    """Yield the rows with the cause that limits the feed of each."""
    by = np.array([*feeds.by, ""], dtype=object)
    for block in step_rows(simulation):
        line, known = block["line"], np.zeros(len(block["line"]), dtype=np.bool_)
        at = np.zeros(len(line), dtype=np.int64)
        if len(feeds.line):
            at = np.searchsorted(feeds.line, line).clip(0, len(feeds.line) - 1)
            known = (feeds.line[at] == line) & ~block["rapid"]
        yield {**block, "feed_limited_by": by[np.where(known, at, len(feeds.by))]}
