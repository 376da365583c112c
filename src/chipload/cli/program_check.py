"""The part of `chipload check` that reads a program and lists its findings."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from chipload.cli.inputs import feed_of, machine_of
from chipload.errors import InputError, Severity, group_findings
from chipload.number_text import number_text
from chipload.terminal import EXCEEDED, bar, show

if TYPE_CHECKING:
    from chipload.program.read import ProgramReading
    from chipload.program.setup import Setup

#: [mm] default tolerance
TOLERANCE_MM = 0.001
#: default machines: the first that has the axes of the program is used
GENERIC = ("vmc", "vmc-a", "hmc-b", "xyzbc-trunnion", "xyzac-trunnion", "xyzbc-head-table")


def finding_lines(reading: ProgramReading) -> list[str]:
    """The findings of a program: first those that leave it unproven, then by line. Equal findings share one entry."""
    gaps = [f for f in reading.findings if f.severity >= Severity.UNPROVEN]
    violations = set(map(id, reading.violations))
    rest = sorted((*(f for f in reading.findings if f not in gaps), *reading.violations), key=lambda f: f.line)
    return [
        *(f"{text} [unproven]" for _, text in group_findings(gaps)),
        *(f"{text}{' [exceeds]' if id(f) in violations else ''}" for f, text in group_findings(rest)),
    ]


def check_program(
    path: Path,
    machine: str | None,
    tools: Path | None,
    dialect: str | None,
    feed_mm_min: float | None,
    tolerance_mm: float,
    setup: Setup,
) -> int:
    """Read a program, show its findings and a summary, and return the exit code."""
    from chipload.program.missing_axes import MISSING_AXIS
    from chipload.program.motions import bounds, lengths
    from chipload.program.read import line_times, read_program, read_tools
    from chipload.program.time import slow_machine
    from chipload.result.times import JERK_NOTE

    table, feed = read_tools(tools) if tools is not None else None, feed_of(feed_mm_min)
    refused: list[InputError] = []
    best: tuple[int, ProgramReading] | None = None
    for name in GENERIC if machine is None else (machine,):
        try:
            with bar() as progress:
                one = read_program(
                    path, machine_of(name), dialect=dialect, tools=table, feed=feed, tolerance=tolerance_mm,
                    setup=setup, progress=progress,
                )  # fmt: skip
        except InputError as err:
            refused.append(err)
            continue
        lacking = sum(f.code == MISSING_AXIS for f in one.findings)
        if best is None or lacking < best[0]:
            best = lacking, one
        if not lacking:
            break
    if best is None:
        raise refused[0]  # that of the simplest machine
    reading, on = best[1], best[1].machine
    if machine is None:
        show(f"no machine is stated: {on.name} is assumed; name yours with --machine, as its limits and times differ")
    if reading.recognition is not None:
        found = reading.recognition
        show(f"control: {found.control.title} ({'stated' if found.stated else 'a guess'})")
    for line in (*finding_lines(reading), *(f"not checked: {item}" for item in reading.unchecked)):
        show(line)
    gaps = [f for f in reading.findings if f.severity >= Severity.UNPROVEN]
    lows, highs = bounds(reading.program)
    low, high = lows.min(axis=0), highs.max(axis=0)
    box = ", ".join(f"{x} {a:g} to {b:g}" for x, a, b in zip("XYZ", low, high, strict=True))
    slow = slow_machine(on)
    minutes = [line_times(reading, one)[1].sum() / 60.0 for one in (on, *(() if slow is None else (slow,)))]
    time = " to ".join(dict.fromkeys(number_text(m) for m in sorted(minutes)))
    show(
        f"{path.name}: {len(reading.commands)} motions on machine {on.name}, {lengths(reading.program).sum():.6g} mm, "
        f"{time} min; {box} mm"
    )
    if " to " in time:
        show(f"time: {JERK_NOTE}")
    count = len(reading.violations)
    state = f"unproven: {gaps[0]}" if gaps else f"the program stays within the limits of machine {on.name}"
    show(f"{count} {'finding exceeds' if count == 1 else 'findings exceed'} the limits" if count else state)
    return EXCEEDED if reading.violations or gaps else 0
