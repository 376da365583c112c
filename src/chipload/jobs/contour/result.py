"""The result of contours and pockets: a track for each strategy, limits, findings."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chipload.checking.default_checks import (
    default_limits,
    ramp_findings,
    range_findings,
    stated_limits,
    unchecked_checks,
)
from chipload.errors import Finding, Severity
from chipload.jobs.contour.outcome import ContourResult, Operation, PlanVerification
from chipload.machine.machine import Machine
from chipload.planning.result import Event, StrategyResult
from chipload.program.time import time_high
from chipload.report.programs import ENDINGS, program_name
from chipload.result import (
    CoveredRows,
    LimitCheck,
    Result,
    Track,
    TrackKind,
    Verdict,
    in_memory,
)
from chipload.simulation.engagement_samples import EngagementSamples

#: limits that count only where the wall is made
ON_WALL = ("engagement_deg", "form_error_um")
SEVERITIES = {Verdict.HOLDS: Severity.NOTE, Verdict.UNPROVEN: Severity.UNPROVEN, Verdict.EXCEEDS: Severity.EXCEEDS}


def result_of(outcome: ContourResult) -> Result:
    """The result of planned operations; the tracks in use first."""
    tracks = [_track(outcome, k, op, name) for k, op in enumerate(outcome.operations) for name in op.result.strategies]
    tracks.sort(key=lambda track: (track.operation, not track.in_use))
    return Result(
        capability="contour",
        title=outcome.title,
        tracks=tuple(tracks),
        operations=tuple(_operation(k, op) for k, op in enumerate(outcome.operations)),
        findings=outcome.findings,
        unchecked=(
            *_unchecked_texts(outcome),
            *(f"limit {name}: not stated" for name in outcome.unchecked),
            *_not_compared(outcome),
        ),
        provenance=outcome.provenance,
        note="The simulation agrees with the plan.",
    )


def track_name(outcome: ContourResult, operation: int, strategy: str) -> str:
    """Name of the track: the strategy, behind the number of its operation if there are several."""
    return strategy if len(outcome.operations) == 1 else program_name(operation, strategy)


def history_of(op: Operation, strategy: StrategyResult) -> dict[str, NDArray[Any]]:
    """Columns (n,) of the history of a strategy, as the result keeps them."""
    columns = dict(strategy.history)
    t = np.asarray(columns["t_s"], dtype=np.float64)
    columns["duration_s"] = np.diff(t, prepend=0.0)
    columns["tool"] = np.full(len(t), op.cutter.number)
    cuts = np.asarray(columns["engagement_deg"]) > 0.0
    columns["axial_overrun_mm"] = np.where(cuts, max(op.depth - op.cutter.flute_length, 0.0), 0.0)
    return columns


def samples_of(outcome: ContourResult) -> dict[str, EngagementSamples]:
    """Tooth engagement of some steps of each strategy, by the name of its track."""
    return {
        track_name(outcome, k, name): simulated.samples
        for k, op in enumerate(outcome.operations)
        for name, simulated in op.simulations.items()
        if simulated.samples is not None
    }


def limits_of(machine: Machine, op: Operation, strategy: StrategyResult, track: str) -> tuple[LimitCheck, ...]:
    """Limit checks of a strategy: those of the job, then the default checks."""
    columns = history_of(op, strategy)
    simulated = op.simulations.get(strategy.name)
    errors = {} if simulated is None else simulated.resolution_error
    wall = _wall_rows(op, strategy)
    rows = {} if wall is None else dict.fromkeys(ON_WALL, wall)
    checks = op.checks
    if checks is not None and simulated is not None:
        checks = replace(checks, parts=simulated.load_parts)
    stated = stated_limits(checks, op.limits, columns, track, errors, rows)
    if checks is None:
        return stated
    return (*stated, *default_limits(checks, machine, columns, track, errors))


def _wall_rows(op: Operation, strategy: StrategyResult) -> CoveredRows | None:
    """Rows that make the wall; None: all."""
    mask = strategy.wall_rows
    if mask is None:
        return None
    names = list(dict.fromkeys(np.asarray(strategy.history["pass"]).astype(str)[mask].tolist()))
    reason = "where the wall is made" if op.result.kind == "contour" else "not in entries and links"
    return CoveredRows(mask, f"{' and '.join(names)} pass", reason)


def findings_of(op: Operation, name: str) -> tuple[Finding, ...]:
    """Findings of a strategy: events of the planner, the machine, the simulation."""
    strategy = op.result.strategies[name]
    out = [_event(e, op.top - op.depth) for e in strategy.events]
    simulated, check = op.simulations.get(name), op.verifications.get(name)
    if simulated is not None:
        out += simulated.findings
    if check is None or simulated is None:
        out.append(Finding("not-simulated", 0, "the program was not checked by the simulation", Severity.UNPROVEN))
    elif check.verdict is not Verdict.HOLDS:
        out.append(Finding("simulation", 0, f"simulation: {check.text}", SEVERITIES[check.verdict]))
    if op.checks is not None:
        out += (*ramp_findings(op.checks, strategy.history), *range_findings(op.checks, strategy.history))
    return tuple(out)


def _track(outcome: ContourResult, k: int, op: Operation, name: str) -> Track:
    strategy, track = op.result.strategies[name], track_name(outcome, k, name)
    stem = program_name(k, name)
    return Track(
        name=track,
        kind=TrackKind.STRATEGY,
        in_use=name == op.result.use,
        time_s=float(strategy.summary["time_s"]),
        time_high_s=time_high(strategy.program, outcome.machine, float(strategy.summary["time_s"])),
        limits=limits_of(outcome.machine, op, strategy, track),
        findings=findings_of(op, name),
        programs=(f"{stem}.{ENDINGS[outcome.machine.dialect]}", f"{stem}.apt", *_inserted_program(k, op, name)),
        operation=k,
        blocks=in_memory(history_of(op, strategy)),
    )


def _inserted_program(k: int, op: Operation, name: str) -> tuple[str, ...]:
    """The program that the finish path came from, with semi-finish passes; of the strategy in use."""
    return (f"{k}-semifinish-{op.inserted[0]}",) if op.inserted[1] and name == op.result.use else ()


def _operation(k: int, op: Operation) -> dict[str, Any]:
    return {
        "kind": op.result.kind,
        "in_use": op.result.use,
        "strategies": {
            name: {
                **strategy.summary,
                "verification": _verification(op.verifications.get(name)),
                "program": program_name(k, name),
            }
            for name, strategy in op.result.strategies.items()
        },
        "findings": list(op.result.findings),
        "settings": dict(op.settings),
    }


def _verification(check: PlanVerification | None) -> dict[str, Any] | None:
    return None if check is None else {"verdict": check.verdict, "message": check.text, **check.numbers}


def _event(e: Event, z: float) -> Finding:
    return Finding(e.code, 0, e.text, Severity.EXCEEDS if e.failure else Severity.NOTE, (e.x, e.y, z))


def _unchecked_texts(outcome: ContourResult) -> tuple[str, ...]:
    """Default checks that are not made, each once."""
    out: dict[str, None] = {}
    for op in outcome.operations:
        if op.checks is None:
            out["default checks: no coefficients"] = None
            continue
        out |= dict.fromkeys(unchecked_checks(op.checks))
        if op.cutter.gullet is not None and "chip_space" not in op.checks.off:
            out[f"chip space of tool {op.cutter.number}: not calculated for planned contours and pockets"] = None
    return tuple(out)


def _not_compared(outcome: ContourResult) -> tuple[str, ...]:
    return tuple(
        f"operation {k}, {name}: engagement of {check.numbers['rows_not_compared']} steps that rise or descend"
        for k, op in enumerate(outcome.operations)
        for name, check in op.verifications.items()
        if check.numbers.get("rows_not_compared")
    )
