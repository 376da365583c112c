"""The result of a program: tracks, limits, findings, programs."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from chipload.errors import Finding, Severity
from chipload.jobs.checks import chip_findings, unchecked_checks
from chipload.jobs.program.limits import program_limits
from chipload.jobs.program.numbers import feed_numbers, operation_numbers, program_numbers, speed_numbers
from chipload.jobs.program.outcome import FeedResult, ProgramResult, SimulationResult, SpeedResult
from chipload.jobs.program.rows import motion_rows, step_rows
from chipload.result import LimitCheck, Result, SurfaceMap, Track, TrackKind, Verdict, in_memory
from chipload.result.limits import Columns
from chipload.simulation.placement import stock_placement

#: names of the tracks: the program as it is, and with new feeds
PROGRAM, ORIGINAL, OPTIMISED = "program", "original", "optimised"
#: stem of the program with new feeds, with new speeds, and the CL data of every program
FEEDS, SPEEDS, APT = "0-feeds", "0-speeds", "0-program.apt"


def result_of(program: ProgramResult) -> Result:
    """The result of a program that was read, simulated, or given new feeds."""
    tracks = _tracks(program)
    simulation = program.simulated
    operations: list[dict[str, Any]] = []
    if simulation is not None:
        operation = operation_numbers(simulation, float(program.seconds.sum()))
        if program.feeds is not None:
            time_s, name = float(program.seconds.sum()), feeds_name(program)
            operation["feeds"] = feed_numbers(program.feeds, simulation, tracks[0].limits, time_s, name)
        if program.speeds is not None and simulation.stability is not None:
            operation["speeds"] = speed_numbers(
                program.speeds, simulation.stability, simulation, float(program.seconds.sum()), speeds_name(program)
            )
        operations.append(operation)
    else:
        operations.append({"kind": "read"})
    operations[0]["program"] = program_numbers(program)
    return Result(
        capability="program",
        title=program.title,
        tracks=tracks,
        operations=tuple(operations),
        findings=program.reading.findings,
        unchecked=unchecked(program),
        provenance=program.provenance,
        maps=_maps(simulation),
        note=_note(program),
    )


def feeds_name(program: ProgramResult) -> str:
    """File of the program with new feeds."""
    return f"{FEEDS}{Path(program.name).suffix}"


def speeds_name(program: ProgramResult) -> str:
    """File of the program with new speeds."""
    return f"{SPEEDS}{Path(program.name).suffix}"


def unchecked(program: ProgramResult) -> tuple[str, ...]:
    """What was not checked: limits that are not stated, and bodies that nothing was compared with."""
    simulation = program.simulated
    if simulation is None:
        return ("removal, engagement, forces and collisions: the program was read, not simulated",)
    # where modes are stated a margin of 1 is checked
    always = () if simulation.stability is None else ("stability_margin",)
    missing = [name for name in simulation.unchecked if name not in always]
    out = [*unchecked_checks(simulation.checks), *(f"limit {name}: not stated" for name in missing)]
    if simulation.left is None:
        out.append("gouge and excess: no [part] is stated")
    if "stock" not in simulation.compared_with:
        out.append("shank and holder against the stock: stock_points_mm is not stated")
    if not any(name.startswith("fixture") for name in simulation.compared_with):
        out.append("fixtures: none is stated")
    if simulation.no_holder:
        out.append(f"holders of tools {', '.join(map(str, simulation.no_holder))}: not stated")
    if simulation.rigid:
        out.append(f"compliance that is not stated counts as rigid: {', '.join(simulation.rigid)}")
    return tuple(out)


def _misplaced(simulation: SimulationResult, limits: tuple[LimitCheck, ...]) -> tuple[Finding, ...]:
    """The likely cause, if a limit is exceeded because the stock does not lie where the program cuts."""
    if all(check.state is not Verdict.EXCEEDS for check in limits):
        return ()
    stock = simulation.stock
    low, high = (np.array([stock.xs[k], stock.ys[k], stock.bounds[k]], dtype=np.float64) for k in (0, -1))
    found = stock_placement(simulation.removal.columns, (low, high), simulation.checks.cutters)
    return () if found is None else (_exceeding(found),)


def _tracks(program: ProgramResult) -> tuple[Track, ...]:
    """The track in use first; before it with new feeds the program as it was, after it."""
    broken = tuple(_exceeding(f) for f in program.reading.violations)
    time_s, simulation = float(program.seconds.sum()), program.simulated
    if simulation is None:
        unproven = Finding("not-simulated", 0, "what the cutter meets was not simulated", Severity.UNPROVEN)
        blocks = in_memory(motion_rows(program))
        findings = (*broken, unproven)
        return (Track(PROGRAM, TrackKind.PROGRAM, True, time_s, (), findings, (APT,), blocks=blocks),)
    found = (*broken, *_found(simulation))
    columns = simulation.removal.columns
    if program.speeds is not None:
        return _tracks_of_speeds(program, simulation, program.speeds, found)
    if program.feeds is None:
        limits = program_limits(simulation, columns, PROGRAM)
        found = (*_misplaced(simulation, limits), *found)
        blocks = lambda: step_rows(simulation)  # noqa: E731
        return (Track(PROGRAM, TrackKind.PROGRAM, True, time_s, limits, found, (APT,), blocks=blocks),)
    own = program.feeds
    after = Track(
        OPTIMISED, TrackKind.PROGRAM, True, time_s, program_limits(simulation, columns, OPTIMISED),
        (*found, *_rubbing(own)), (feeds_name(program), APT), blocks=lambda: _with_cause(simulation, own),
    )  # fmt: skip
    first = own.before.columns
    limits = _as_posted(program_limits(simulation, first, ORIGINAL), "gouge_mm", "excess_mm")
    before = Track(
        ORIGINAL, TrackKind.PROGRAM, False, own.seconds_before, limits, blocks=lambda: step_rows(simulation, own.before)
    )  # fmt: skip
    return (after, before)


def _tracks_of_speeds(
    program: ProgramResult, simulation: SimulationResult, speeds: SpeedResult, found: tuple[Finding, ...]
) -> tuple[Track, ...]:
    """The program with new speeds, then as it was."""
    after = Track(
        OPTIMISED, TrackKind.PROGRAM, True, float(program.seconds.sum()),
        program_limits(simulation, simulation.removal.columns, OPTIMISED), found, (speeds_name(program), APT),
        blocks=lambda: step_rows(simulation),
    )  # fmt: skip
    limits = program_limits(simulation, speeds.before.columns, ORIGINAL, speeds.stability)
    before = Track(
        ORIGINAL, TrackKind.PROGRAM, False, speeds.seconds_before,
        _as_posted(limits, "gouge_mm", "excess_mm", "form_error_um"),
        blocks=lambda: step_rows(simulation, speeds.before),
    )  # fmt: skip
    return (after, before)


def _as_posted(limits: tuple[LimitCheck, ...], *of_part: str) -> tuple[LimitCheck, ...]:
    """Limits of the program as it was, of which those ``of_part`` are not checked: its surface is not compared."""
    return tuple(
        LimitCheck(c.name, c.limit, None, Verdict.UNPROVEN, c.track, reason="the part is compared with the new program")
        if c.name in of_part else c
        for c in limits
    )  # fmt: skip


def _found(simulation: SimulationResult) -> tuple[Finding, ...]:
    """What the simulation found beside limits: rapids in material, collisions, chips beyond the coefficients."""
    out = [_exceeding(f) if f.code == "rapid-cuts" else f for f in simulation.removal.findings]
    for c in simulation.collisions:
        place = (float(c.at[0]), float(c.at[1]), float(c.at[2]))
        text = f"{c.what} goes {c.depth_mm:.3g} mm into {c.into}"
        out.append(Finding("collision", c.line, text, Severity.EXCEEDS, place, int(c.step)))
    if simulation.workpiece is not None:
        out += simulation.workpiece.findings
    return (*out, *chip_findings(simulation.checks, simulation.removal.columns))


def _rubbing(feeds: FeedResult) -> tuple[Finding, ...]:
    """Lines that cut below the least feed per tooth."""
    least = feeds.tooth_feed_least
    return tuple(
        Finding("rubbing", line, f"feed per tooth {feed:.3g} mm is less than {least:g} mm", Severity.EXCEEDS)
        for line, feed in feeds.rubs
    )


def _exceeding(f: Finding) -> Finding:
    return Finding(f.code, f.line, f.text, Severity.EXCEEDS, f.place, f.row)


def _with_cause(simulation: SimulationResult, feeds: FeedResult) -> Iterator[Columns]:
    """The rows with what limits the feed of each."""
    by = np.array([*feeds.by, ""], dtype=object)
    for block in step_rows(simulation):
        line, known = block["line"], np.zeros(len(block["line"]), dtype=np.bool_)
        at = np.zeros(len(line), dtype=np.int64)
        if len(feeds.line):
            at = np.searchsorted(feeds.line, line).clip(0, len(feeds.line) - 1)
            known = (feeds.line[at] == line) & ~block["rapid"]
        yield {**block, "feed_limited_by": by[np.where(known, at, len(feeds.by))]}


def _note(program: ProgramResult) -> str:
    if program.speeds is not None:
        tools = "; ".join(f"tool {t.tool} {t.rpm:g} rpm" for t in program.speeds.tools)
        return (
            f"The program takes {program.seconds.sum():.4g} s, before {program.speeds.seconds_before:.4g} s; {tools}."
        )
    if program.feeds is None:
        return ""
    before, after = program.feeds.seconds_before, float(program.seconds.sum())
    return f"The program takes {after:.4g} s, before {before:.4g} s."


def _maps(simulation: SimulationResult | None) -> tuple[SurfaceMap, ...]:
    """Gouge below 0 and excess above on the part."""
    if simulation is None:
        return ()
    maps, left = _bent(simulation), simulation.left
    if left is None:
        return maps
    known = np.isfinite(left.distance) & (left.over | (left.distance < 0.0))
    values = np.where(known, left.distance, np.nan)
    return (SurfaceMap("part", "excess_mm", left.points, values, np.asarray(left.faces, dtype=np.int64)), *maps)


def _bent(simulation: SimulationResult) -> tuple[SurfaceMap, ...]:
    """Displacement of the workpiece in its worst step."""
    bent = None if simulation.workpiece is None else simulation.workpiece.bent
    if bent is None:
        return ()
    um = 1e3 * np.linalg.norm(bent.moved, axis=1)
    return (SurfaceMap("workpiece", "deflection_workpiece_um", bent.points, um, bent.faces),)
