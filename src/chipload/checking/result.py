"""The result of a simulated program: its track, limits and findings, and the tracks before and after a change."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from chipload.checking.default_checks import ramp_findings, range_findings, unchecked_checks
from chipload.checking.left_out import rest_on_left_out
from chipload.checking.limits import program_limits
from chipload.checking.numbers import operation_numbers, program_numbers
from chipload.checking.outcome import ChangedText, ProgramResult, SimulationResult
from chipload.checking.rows import motion_rows, step_rows
from chipload.checking.stability import StabilityResult
from chipload.checking.workpiece import stock_box
from chipload.cutter.cutter import Cutter
from chipload.cutting.material import knowledge_text
from chipload.errors import Finding, Severity
from chipload.program.block_delete import with_block_delete
from chipload.program.check import SPINDLE_OFF
from chipload.result import LimitCheck, Result, SurfaceMap, Track, TrackKind, Verdict, in_memory
from chipload.result.limits import Columns
from chipload.simulation.placement import nothing_cut, stock_placement
from chipload.simulation.surface import Collision

#: names of the tracks of a program as it was, and with another text
ORIGINAL, OPTIMISED = "original", "optimised"
#: name of the track of a program that stays as it is
PROGRAM = "program"
#: CL data of every program
APT = "0-program.apt"


def program_result(
    capability: str, program: ProgramResult, tracks: tuple[Track, ...], numbers: Mapping[str, Any], note: str = ""
) -> Result:
    """Return the result of a program.

    Parameters
    ----------
    tracks : the one in use first
    numbers : of the operation, in addition to those of the simulation and the program
    note : text of the report below the message
    """
    simulation = program.simulated
    own = {"kind": "read"} if simulation is None else operation_numbers(simulation, float(program.seconds.sum()))
    return Result(
        capability=capability,
        title=program.title,
        tracks=tuple(rest_on_left_out(track, program.reading.findings) for track in tracks),
        operations=({**own, **numbers, "program": program_numbers(program)},),
        findings=program.reading.findings,
        unchecked=unchecked_texts(program),
        provenance=program.provenance,
        maps=maps_of(simulation),
        note=note,
    )


def checked_result(program: ProgramResult) -> Result:
    """Return the result of a program that stays as it is."""
    return program_result("program", program, (_unchanged_track(program),), {})


def _time_high(program: ProgramResult) -> float | None:
    """Return the time of the program at the least jerk that its machine may have [s]; None: its time is known."""
    reading = program.reading
    high = (reading if reading.machine is program.machine else replace(reading, machine=program.machine)).seconds_high
    return None if high is None else max(high, float(program.seconds.sum()))


def _unchanged_track(program: ProgramResult) -> Track:
    """Return the track of the unchanged program."""
    time_s, simulation = float(program.seconds.sum()), program.simulated
    if simulation is None:
        unproven = Finding("not-simulated", 0, "the program was not simulated in its stock", Severity.UNPROVEN)
        findings = (*(as_exceeding(f) for f in program.reading.violations), unproven)
        blocks = in_memory(motion_rows(program))
        return Track(
            PROGRAM, TrackKind.PROGRAM, True, time_s, (), findings, (APT,),
            blocks=blocks, time_high_s=_time_high(program),
        )  # fmt: skip
    limits = program_limits(simulation, simulation.removal.columns, PROGRAM)
    found = (*find_misplaced_stock(simulation, limits), *findings_of(program, simulation))
    return Track(
        PROGRAM, TrackKind.PROGRAM, True, time_s, limits, found, (APT,),
        energy_balance=simulation.removal.energy_balance, blocks=lambda: step_rows(simulation),
        time_high_s=_time_high(program),
    )  # fmt: skip


def changed_tracks(
    program: ProgramResult,
    simulation: SimulationResult,
    changed: ChangedText,
    name: str,
    *not_compared: str,
    found: tuple[Finding, ...] = (),
    stability: StabilityResult | None = None,
    blocks: Callable[[], Iterator[Columns]] | None = None,
) -> tuple[Track, Track]:
    """Return the tracks of the changed program and of the unchanged program.

    Parameters
    ----------
    name : of the file with the new text
    not_compared : limits that are checked only after the change
    found : findings in addition to those of the simulation
    stability : of the program as it was; None: that of the simulation
    blocks : rows of the history after the change; None: those of the simulation
    """
    after = Track(
        OPTIMISED, TrackKind.PROGRAM, True, float(program.seconds.sum()),
        program_limits(simulation, simulation.removal.columns, OPTIMISED), (*findings_of(program, simulation), *found),
        (name, APT), energy_balance=simulation.removal.energy_balance,
        blocks=blocks or (lambda: step_rows(simulation)), time_high_s=_time_high(program),
    )  # fmt: skip
    limits = program_limits(simulation, changed.before.columns, ORIGINAL, stability)
    before = Track(
        ORIGINAL, TrackKind.PROGRAM, False, changed.seconds_before, as_posted(limits, *not_compared),
        energy_balance=changed.before.energy_balance, blocks=lambda: step_rows(simulation, changed.before),
    )  # fmt: skip
    return (after, before)


def changed_name(program: ProgramResult, what: str) -> str:
    """Return the file name of the program with its new ``what``."""
    return f"0-{what}{Path(program.name).suffix}"


def unchecked_texts(program: ProgramResult) -> tuple[str, ...]:
    """Return what was not checked: limits that are not stated, and bodies that were not compared."""
    simulation = program.simulated
    if simulation is None:
        read = "removal, engagement, forces and collisions: the program was only read, not simulated"
        return (read, *program.reading.unchecked)
    # where modes are stated a margin of 1 is checked
    always: tuple[str, ...] = () if simulation.stability is None else ("stability_margin",)
    if simulation.left is not None and "gouge" not in simulation.checks.off:
        always += ("gouge_mm",)
    always += tuple(name for name in ("thrust_n", "force_axial_n") if name not in simulation.removal.columns)
    missing = [name for name in simulation.stated_limits.unstated if name not in always]
    out = [*unchecked_checks(simulation.checks), *(f"limit {name}: not stated" for name in missing)]
    out += program.reading.unchecked
    if simulation.left is None:
        out.append("gouge and excess: no [part] is stated")
    else:
        narrow = 2.0 * simulation.left.spacing / math.sqrt(3.0)
        if math.isfinite(narrow):
            out.append(f"gouges narrower than {narrow:.2g} mm, by the corner or the point of a cutter alone")
        if "excess_mm" in simulation.limits:
            out.append("excess between the points of the part: part.spacing_mm")
    out += simulation.collisions.stock.unchecked
    if not any(name.startswith("fixture") for name in simulation.collisions.compared_with):
        out.append("fixtures: none is stated")
    else:
        out.append("fixtures: what is thinner than their spacing_mm, and a contact less deep, may be missed")
    out += holders_not_stated(simulation.checks.cutters)
    if simulation.rigid:
        out.append(f"stiffness not stated, taken as rigid: {', '.join(simulation.rigid)}")
    return tuple(out)


def findings_of(program: ProgramResult, simulation: SimulationResult) -> tuple[Finding, ...]:
    """Return the findings: nothing is cut, motions beyond the limits of the machine, then those of the simulation."""
    empty = nothing_cut(simulation.removal.columns, stock_box(simulation.stock), simulation.checks.cutters)
    return (
        *([] if empty is None else [empty]),
        *(as_exceeding(f) for f in program.reading.violations),
        # cuts with the spindle at rest are violations of the reading
        *(f for f in simulation_findings(simulation) if f.code != SPINDLE_OFF),
    )


def simulation_findings(simulation: SimulationResult) -> tuple[Finding, ...]:
    """Return findings of the simulation: rapids and a spindle at rest in material, collisions, chips out of range."""
    of_motion = ("rapid-cuts", SPINDLE_OFF)
    out = [as_exceeding(f) if f.code in of_motion else f for f in simulation.removal.findings]
    out += collision_findings(simulation.collisions.found)
    known = {(f.code, f.line) for f in out}
    out += [f for f in simulation.collisions.stock.findings if f.code != "rapid-cuts" or (f.code, f.line) not in known]
    if simulation.workpiece is not None:
        out += simulation.workpiece.findings
    out += _bodies(simulation)
    columns = simulation.removal.columns
    out += [*ramp_findings(simulation.checks, columns), *range_findings(simulation.checks, columns)]
    if knowledge := knowledge_text(simulation.checks.material):
        out.append(Finding("learned-material", 0, f"{simulation.checks.material.name}: {knowledge}", Severity.NOTE))
    if simulation.skipped is not None:
        out += _skipped_findings(simulation.skipped, out)
    return tuple(out)


def collision_findings(touched: Iterable[Collision]) -> list[Finding]:
    """Return a finding for each collision."""
    return [
        Finding(
            "collision", c.line, f"{c.what} goes {c.depth_mm:.3g} mm into {c.into}", Severity.EXCEEDS,
            (float(c.at[0]), float(c.at[1]), float(c.at[2])), int(c.step),
        )
        for c in touched
    ]  # fmt: skip


def holders_not_stated(cutters: Mapping[int, Cutter]) -> list[str]:
    """Return a sentence on the tools whose holder is not stated; none where all are."""
    missing = [str(number) for number, cutter in sorted(cutters.items()) if not cutter.holder]
    return [f"holders of tools {', '.join(missing)}: not stated"] if missing else []


def _skipped_findings(skipped: SimulationResult, known: list[Finding]) -> list[Finding]:
    """Return what is found, and each limit that does not hold, with block delete on and not without it."""
    without = {(f.code, f.line) for f in known}
    out = [with_block_delete(f) for f in simulation_findings(skipped) if (f.code, f.line) not in without]
    severity = {Verdict.EXCEEDS: Severity.EXCEEDS, Verdict.UNPROVEN: Severity.UNPROVEN}
    for check in program_limits(skipped, skipped.removal.columns, "program"):
        if check.state in severity:
            finding = Finding("block-delete", check.line or 0, check.text, severity[check.state], check.place)
            out.append(with_block_delete(finding))
    return out


def _bodies(simulation: SimulationResult) -> list[Finding]:
    """Return a finding for each tool that is a body without chips, at its first motion at a feed."""
    columns, out = simulation.removal.columns, []
    for number, cutter in sorted(simulation.checks.cutters.items()):
        rows = np.flatnonzero((columns["tool"] == number) & ~columns["rapid"]) if cutter.body else np.zeros(0)
        if len(rows):
            row = int(rows[0])
            text = (
                f"tool {number}{f' ({cutter.name})' if cutter.name else ''} is a body: it is held against part, stock "
                "and fixtures; its chips, forces and torque, and what it removes, are not simulated"
            )
            out.append(Finding("tool-body", int(columns["line"][row]), text, Severity.UNPROVEN, None, row))
    return out


def find_misplaced_stock(simulation: SimulationResult, limits: tuple[LimitCheck, ...]) -> tuple[Finding, ...]:
    """Return the finding that the stock is probably misplaced, if a limit is exceeded."""
    if all(check.state is not Verdict.EXCEEDS for check in limits):
        return ()
    box = stock_box(simulation.stock)
    found = stock_placement(simulation.removal.columns, box, simulation.checks.cutters)
    return () if found is None else (as_exceeding(found),)


def as_posted(limits: tuple[LimitCheck, ...], *of_part: str) -> tuple[LimitCheck, ...]:
    """Return the limit checks of the unchanged program; those ``of_part`` are unproven, its surface is not compared."""
    return tuple(
        LimitCheck(c.name, c.limit, None, Verdict.UNPROVEN, c.track, reason="the part is compared with the new program")
        if c.name in of_part else c
        for c in limits
    )  # fmt: skip


def as_exceeding(f: Finding) -> Finding:
    """Return a finding with the severity of an exceeded limit."""
    return Finding(f.code, f.line, f.text, Severity.EXCEEDS, f.place, f.row)


def maps_of(simulation: SimulationResult | None) -> tuple[SurfaceMap, ...]:
    """Return the surface maps: gouge (below 0) and excess (above 0) on the part, and the deformed workpiece."""
    if simulation is None:
        return ()
    maps, left = _bent_workpiece_map(simulation), simulation.left
    if left is None:
        return maps
    known = np.isfinite(left.distance) & (left.over | (left.distance < 0.0))
    values = np.where(known, left.distance, np.nan)
    return (SurfaceMap("part", "excess_mm", left.points, values, np.asarray(left.faces, dtype=np.int64)), *maps)


def _bent_workpiece_map(simulation: SimulationResult) -> tuple[SurfaceMap, ...]:
    """Return the map of the displacement of the workpiece in its worst step."""
    bent = None if simulation.workpiece is None else simulation.workpiece.bent
    if bent is None:
        return ()
    um = 1e3 * np.linalg.norm(bent.moved, axis=1)
    return (SurfaceMap("workpiece", "deflection_workpiece_um", bent.points, um, bent.faces, displacement=bent.moved),)
