"""Conversion of options into values for the functions of chipload, and lines that several commands show."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from chipload.errors import InputError
from chipload.terminal import show
from chipload.units import mm_s_from_mm_min

if TYPE_CHECKING:
    from chipload.machine.machine import Machine
    from chipload.program.setup import Setup
    from chipload.result import Result


def setup_of(
    parameters: Sequence[str],
    work_offsets: Sequence[str],
    control: str | None = None,
    unit: str | None = None,
    tools_unit: str | None = None,
    compensation: str | None = None,
) -> Setup:
    """The parameters and work offsets of the controller and its control, from the options."""
    from chipload.program.setup import Setup, StatedControl

    def pairs(option: str, texts: Sequence[str]) -> Iterator[tuple[str, list[float]]]:
        for text in texts:
            name, _, values = text.rpartition("=")
            try:
                yield name.strip(), [float(value) for value in values.split(",")]
            except ValueError:
                raise InputError(
                    f"--{option} {text}: must have the form NAME=NUMBER, with commas between numbers"
                ) from None

    given = dict(pairs("parameter", parameters))
    for name, values in given.items():
        if len(values) != 1:
            raise InputError(f"--parameter {name}: has {len(values)} numbers: must have one")
    single = {name: numbers[0] for name, numbers in given.items()}
    stated = StatedControl(control, unit, tools_unit, compensation)
    return Setup(single, dict(pairs("work-offset", work_offsets)), control=stated)


def machine_of(name: str | None, notice: Callable[[str], None] = show) -> Machine:
    """A shipped machine by name, or the machine of a file (.toml, or LinuxCNC's .ini, whose findings are shown)."""
    from chipload.machine.ini import read_ini
    from chipload.machine.machine import machine_named, machine_names, read_machine

    if name is None:
        raise InputError(f"--machine: missing: name a file (.toml, .ini) or one of {', '.join(machine_names())}")
    if name.lower().endswith(".ini"):
        machine, findings = read_ini(Path(name))
        for f in findings:
            notice(f"{name}: {f}")
        return machine
    return read_machine(name) if name.lower().endswith(".toml") else machine_named(name)


def feed_of(mm_min: float | None) -> float | None:
    """Convert a feed from mm/min to mm/s."""
    if mm_min is None:
        return None
    if not 0.0 < mm_min < 1e9:
        raise InputError(f"--feed-mm-min = {mm_min:g}: must be above 0")
    return mm_s_from_mm_min(mm_min)


def show_verdict(result: Result, *, worst: bool = False) -> None:
    """Show the first lines of a verdict: state and critical limit, then what is not covered and not checked.

    ``worst``: the worst value of each limit stands below the first line.
    """
    message, *more = result.first_lines
    show(message)
    if worst:
        show_limits(result)
    for line in more:
        show(line)
    for change in result.changes:
        show(f"change: {change.line_text}")
    show_time(result)


def show_time(result: Result) -> None:
    """Show the time of each program in use that is an interval; a time that is known stands in the result."""
    from chipload.result.times import JERK_NOTE, time_text

    tracks = [t for t in result.in_use if t.time_high_s is not None]
    texts = [f"{f'{t.name} ' if len(tracks) > 1 else ''}{time_text(t.time_s, t.time_high_s)} s" for t in tracks]
    if any(" to " in text for text in texts):
        show(f"time: {', '.join(texts)}. {JERK_NOTE}")


def show_limits(result: Result) -> None:
    """Show the worst value of each limit in one line; the message of an unproven result may omit it."""
    from chipload.number_text import number_text

    known = [c for c in result.limits if c.worst is not None]
    worst = ", ".join(
        f"{c.column.label} {c.worst_text} of {number_text(c.limit, 6)} {c.column.unit}".strip() for c in known
    )
    if worst:
        show(f"worst values: {worst}")
