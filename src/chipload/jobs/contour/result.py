"""The result of contours and pockets: a track for each strategy, limits, findings."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chipload.checking.default_checks import default_limits, ramp_findings, range_findings, unchecked_checks, with_peaks
from chipload.errors import Finding, Severity
from chipload.jobs.contour.outcome import PLANNED_ERRORS, ContourResult, Operation, PlanVerification
from chipload.machine.machine import Machine
from chipload.planning.result import Event, StrategyResult
from chipload.report.programs import ENDINGS, program_name
from chipload.result import (
    CoveredRows,
    LimitCheck,
    Result,
    Track,
    TrackKind,
    Verdict,
    check_limit,
    column_of,
    error_of,
    in_memory,
)
from chipload.result.coverage import ranges_of

#: error of the engagement where its check states no difference, the tolerance of that check [deg]
ENGAGEMENT_DEG = 0.05
#: limits that count only where the wall is made
ON_WALL = ("engagement_deg", "form_error_um")
#: columns of the planner that the result does not keep
DROPPED = ("arcs", "arc_from_rad", "arc_to_rad", "heading_x", "heading_y", "form_error_signed_um")
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
            *_unchecked(outcome),
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
    if "form_error_signed_um" in columns:
        columns["form_error_um"] = columns["form_error_signed_um"]
    t = np.asarray(columns["t_s"], dtype=np.float64)
    columns["duration_s"] = np.diff(t, prepend=0.0)
    columns["tool"] = np.full(len(t), op.cutter.number)
    cuts = np.asarray(columns["engagement_deg"]) > 0.0
    columns["axial_overrun_mm"] = np.where(cuts, max(op.depth - op.cutter.flute_length, 0.0), 0.0)
    return {name: values for name, values in columns.items() if name not in DROPPED}


def limits_of(machine: Machine, op: Operation, strategy: StrategyResult, track: str) -> tuple[LimitCheck, ...]:
    """Limit checks of a strategy: those of the job, then the default checks.

    The engagement counts with its greatest along each step.
    """
    columns = history_of(op, strategy)
    if "engagement_max_deg" in columns:
        columns["engagement_deg"] = columns["engagement_max_deg"]
    wall = _wall_rows(op, strategy)
    stated = tuple(
        check_limit(
            name, limit, columns, track=track, rows=wall if name in ON_WALL else None, **_error(op, strategy, name)
        )
        for name, limit in op.limits.items()
    )
    if op.checks is not None:
        stated = tuple(with_peaks(check, op.checks, columns) for check in stated)
    own = () if op.checks is None else default_limits(op.checks, machine, columns, track, PLANNED_ERRORS)
    kept = takes_time(columns)
    return tuple(_of_steps(check, kept) for check in (*stated, *own))


def _wall_rows(op: Operation, strategy: StrategyResult) -> CoveredRows | None:
    """Rows that make the wall; None: all."""
    mask = strategy.wall_rows
    if mask is None:
        return None
    names = list(dict.fromkeys(np.asarray(strategy.history["pass"]).astype(str)[mask].tolist()))
    reason = "where the wall is made" if op.result.kind == "contour" else "not in entries and links"
    return CoveredRows(mask, f"{' and '.join(names)} pass", reason)


def _error(op: Operation, strategy: StrategyResult, name: str) -> dict[str, float]:
    """Error of a planned column: of loads relative, of the engagement the difference that its check found."""
    if name != "engagement_deg":
        return {"error": error_of(column_of(name).name, PLANNED_ERRORS)}
    check = op.verifications.get(strategy.name)
    found = None if check is None else check.numbers.get("engagement_difference_deg")
    return {"error": 0.0, "absolute": ENGAGEMENT_DEG if found is None else float(found)}


def _of_steps(check: LimitCheck, kept: NDArray[np.bool_]) -> LimitCheck:
    """A check of samples as one of the steps of the history, see :func:`steps_of`."""
    row = None if check.row is None else int((np.cumsum(kept) - 1)[check.row])
    covered = check.coverage
    if covered.ranges is not None:
        covered = replace(covered, ranges=ranges_of(covered.mask(len(kept))[kept]))
    return replace(check, row=row, coverage=covered)


def steps_of(op: Operation, strategy: StrategyResult) -> dict[str, NDArray[Any]]:
    """The history of a strategy without the samples at which a pass begins where the one before ends."""
    columns = history_of(op, strategy)
    kept = takes_time(columns)
    return {name: values[kept] for name, values in columns.items()}


def takes_time(columns: Mapping[str, NDArray[Any]]) -> NDArray[np.bool_]:
    """Rows that take time, and the first."""
    kept = np.asarray(columns["duration_s"]) > 0.0
    kept[:1] = True
    return kept


def findings_of(op: Operation, name: str) -> tuple[Finding, ...]:
    """Findings of a strategy: events of the planner, the machine, the simulation."""
    strategy = op.result.strategies[name]
    out = [_event(e, op.top - op.depth) for e in strategy.events]
    out += op.machine_findings.get(name, ())
    check = op.verifications.get(name)
    if check is None:
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
        limits=limits_of(outcome.machine, op, strategy, track),
        findings=findings_of(op, name),
        programs=(f"{stem}.{ENDINGS[outcome.machine.dialect]}", f"{stem}.apt", *_inserted(k, op, name)),
        operation=k,
        blocks=in_memory(steps_of(op, strategy)),
    )


def _inserted(k: int, op: Operation, name: str) -> tuple[str, ...]:
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


def _unchecked(outcome: ContourResult) -> tuple[str, ...]:
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
