"""The result of a torque job: a track for each controller and latency, limits, findings.

The verdict is that of the fuzzy controller with the model of the cut and the latency that the job states.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from chipload.checking.default_checks import default_limits, range_findings, stated_limits, unchecked_checks
from chipload.checking.result import holders_not_stated
from chipload.control.override import STATUS
from chipload.errors import Finding, Severity
from chipload.jobs.torque.files import feed_forward_file
from chipload.jobs.torque.numbers import operation_numbers
from chipload.jobs.torque.outcome import (
    HELD,
    MODEL_FULL,
    PLAIN,
    ClampedWorkpiece,
    ControllerCase,
    ControllerRun,
    ShellWall,
    TorqueResult,
)
from chipload.jobs.torque.step_checks import check_columns
from chipload.jobs.torque.written_program import override_file
from chipload.number_text import number_text
from chipload.program.motions import lengths
from chipload.result import (
    LimitCheck,
    Result,
    Track,
    TrackKind,
    Verdict,
    in_memory,
    state_of,
)
from chipload.result.limits import Columns
from chipload.units import mm_min_from_mm_s, rpm_from_rad_s

#: the limit on the excess of the torque over what is allowable
OVER = "torque_over_percent"
#: a step that goes so little beyond a motion ends with it [mm]
SAME_MM = 1e-9
#: columns whose error is that of the force, of the force and the compliance of the workpiece, of the mean torque
WITH_FORCE = ("force_n", "deflection_share", "cutter_stress_mpa")
WITH_PART = ("form_error_um", "stress_mpa", "strength_share", "deflection_um", "deflection_workpiece_um")
WITH_TORQUE = ("torque_nm", "torque_mean_nm", "power_w")


def result_of(outcome: TorqueResult) -> Result:
    """The result: the controller in use with its latency first, then the others, then all without latency."""
    tracks = [_track(outcome, case, name) for case in reversed(outcome.control.cases) for name in case.runs]
    tracks.sort(key=lambda track: not track.in_use)
    numbers = operation_numbers(outcome)
    verdicts = {track.name: track.verdict.value for track in tracks}
    for case, part in zip(outcome.control.cases, (numbers, numbers.get("with_latency", {})), strict=False):
        for name in case.runs:
            part["controllers"][name]["verdict"] = verdicts[track_name(case, name)]
    result = Result(
        capability="torque",
        title=outcome.job.title,
        tracks=tuple(tracks) or (_not_run(outcome),),
        operations=(numbers,),
        findings=_findings(outcome),
        unchecked=(
            *unchecked_checks(outcome.job.checks),
            *(f"limit {name}: not stated" for name in outcome.job.unchecked),
            *(() if outcome.control.cases else ("cutter strength, chips and spindle: no controller was run",)),
            *outcome.stock_check.unchecked,
            *holders_not_stated(outcome.job.checks.cutters),
            "chatter, and runout beyond that of the cutter: not calculated",
            "the wall is taken with its final thickness throughout"
            if isinstance(outcome.wall, ShellWall)
            else "holder and spindle: taken as rigid",
        ),
        provenance=outcome.job.provenance,
        note=_note(outcome),
    )
    return replace(result, operations=({**numbers, "verdict": result.verdict.value},))


def track_name(case: ControllerCase, controller: str) -> str:
    """Name of the track of a controller: with its latency, if the loop has one."""
    return f"{controller}, {1e3 * case.loop.latency:g} ms" if _is_machine_loop(case) else controller


def limits_of(outcome: TorqueResult, columns: Columns, track: str) -> tuple[LimitCheck, ...]:
    """Limit checks of a controller: those of the job, then the default checks.

    Their ``resolution_error`` is that of the simulation of the truth: of the mean torque for torques and powers, of the
    force for what the part and the cutter do, there with that of the compliance of a clamped workpiece.
    """
    compliance = outcome.wall.real.error if isinstance(outcome.wall, ClampedWorkpiece) else 0.0
    errors = errors_of(outcome.resolution_error, compliance)
    checks = outcome.job.checks
    found = (
        *stated_limits(checks, outcome.job.limits, columns, track, errors),
        *default_limits(checks, outcome.job.machine, columns, track, errors),
    )
    return tuple(over_allowable(x, columns, errors["torque_nm"]) if x.name == OVER else x for x in found)


def errors_of(simulated: Mapping[str, float], compliance: float = 0.0) -> dict[str, float]:
    """Relative errors of the columns of a controller, from those of the columns of the simulation and that of the
    compliance of the workpiece.

    >>> errors_of({"force_n": 0.02, "torque_mean_nm": 0.03})["stress_mpa"]
    0.02
    """
    force, torque = simulated["force_n"], simulated["torque_mean_nm"]
    both = (1.0 + force) * (1.0 + compliance) - 1.0 if compliance else force
    return dict.fromkeys(WITH_FORCE, force) | dict.fromkeys(WITH_PART, both) | dict.fromkeys(WITH_TORQUE, torque)


def over_allowable(check: LimitCheck, columns: Columns, error: float) -> LimitCheck:
    """The excess over the allowable torque: its error is that of the torque, also where there is no excess."""
    share = float(np.max(columns["torque_nm"] / columns["torque_allowable_nm"], initial=0.0))
    state, why = state_of(share, 1.0 + 1e-2 * check.limit, error)
    return replace(check, state=state, reason=why, resolution_error=error if math.isfinite(error) else 0.0)


def _is_machine_loop(case: ControllerCase) -> bool:
    """Whether the loop has latency or steps, as on a machine."""
    return bool(case.loop.latency or case.quantum)


def _track(outcome: TorqueResult, case: ControllerCase, name: str) -> Track:
    run, track = case.runs[name], track_name(case, name)
    last = case is outcome.control.cases[-1]
    columns = _columns(outcome, run, name == MODEL_FULL and last)
    used = name == HELD and last
    return Track(
        name=track,
        kind=TrackKind.CONTROLLER,
        in_use=used,
        time_s=outcome.time_of(run),
        limits=limits_of(outcome, columns, track),
        findings=(*_run_findings(outcome, case, run), *range_findings(outcome.job.checks, columns)),
        programs=_programs(outcome, case, name),
        parameters={"latency_s": case.loop.latency, "override_step": case.quantum},
        energy_balance=outcome.energy_balance["real"],
        blocks=in_memory(columns),
    )


def _not_run(outcome: TorqueResult) -> Track:
    """No torque is allowable: every limit stays unproven."""
    reason = "no torque is allowable, so no controller was run"
    limits = (
        LimitCheck(name, x, None, Verdict.UNPROVEN, HELD, reason=reason) for name, x in outcome.job.limits.items()
    )
    return Track(HELD, TrackKind.CONTROLLER, True, None, tuple(limits), programs=(override_file(outcome.job.machine),))


def _programs(outcome: TorqueResult, case: ControllerCase, name: str) -> tuple[str, ...]:
    """Files of a controller: the one in use takes the override, the schedule of the model has its feeds written."""
    files = {HELD: override_file, MODEL_FULL: feed_forward_file}
    return (files[name](outcome.job.machine),) if case is outcome.control.cases[-1] and name in files else ()


def _columns(outcome: TorqueResult, run: ControllerRun, feeds_written: bool) -> Columns:
    """(n,) columns of the whole program with a controller: rapids, a row for each step of the controller, rapids.

    ``feeds_written``: its feeds are written into a program of its own, whose lines are others, and are left open.
    """
    found, written, own = _controller_columns(outcome, run), outcome.job.written, outcome.job.written.controlled
    rows = list(range(own.start - 1)), list(range(own.stop, len(written.program) if run.outcome.finished else 0))
    before, after = (_rapids(outcome, found, r, end) for r, end in zip(rows, (0, -1), strict=True))
    out = {name: np.concatenate([before[name], values, after[name]]) for name, values in found.items()}
    far, seconds = np.cumsum(lengths(written.program)), np.cumsum(written.times)
    first = max(own.start - 1, 0)
    for name, values, sums in (("t_s", run.outcome.t, seconds), ("s_mm", run.outcome.s, far)):
        behind = sums[first] + values[-1] + sums[rows[1]] - sums[own.stop - 1]
        out[name] = np.concatenate([sums[rows[0]], sums[first] + values, behind])
    out |= {"duration_s": np.diff(out["t_s"], prepend=0.0)}
    # the row of the program in which each step ends; all but the schedule of feeds run the one that takes the override
    ends = np.cumsum(lengths(written.program)[own])
    steps = own.start + np.minimum(np.searchsorted(ends, run.outcome.s - SAME_MM), len(ends) - 1)
    lines = written.program.line[np.concatenate([rows[0], steps, rows[1]]).astype(np.int64)]
    known = written.whole is not None and not feeds_written
    return {"line": np.where(known, lines, 0), **out}


def _rapids(outcome: TorqueResult, found: Columns, rows: list[int], end: int) -> Columns:
    """Columns of rapids outside the feeds: they have no loads, and the allowable torque of the nearest feed."""
    program = outcome.job.written.program
    stated = {
        **{f"{x}_mm": program.p_work[rows, k] for k, x in enumerate("xyz")},
        "feed_mm_min": np.full(len(rows), mm_min_from_mm_s(outcome.job.machine.rapid)),
        "override": np.ones(len(rows)),
        "override_state": np.full(len(rows), "rapid", dtype=object),
        "spindle_rpm": np.abs(rpm_from_rad_s(1.0) * program.spindle[rows]),
        "tool": program.tool[rows],
        "torque_allowable_nm": np.full(len(rows), found["torque_allowable_nm"][end]),
    }
    return {name: stated.get(name, np.zeros(len(rows), dtype=values.dtype)) for name, values in found.items()}


def _controller_columns(outcome: TorqueResult, run: ControllerRun) -> Columns:
    """(n,) columns of a controller, one row for each step of it."""
    o, path = run.outcome, outcome.allowable.path
    relief = np.interp(o.s, path.model.s, path.relief)
    over = 100.0 * np.maximum(o.torque / (outcome.allowable.torque * relief) - 1.0, 0.0)
    return {
        "t_s": o.t,
        "duration_s": np.diff(o.t, prepend=0.0),
        "s_mm": o.s,
        **{f"{x}_mm": np.interp(o.s, path.model.s, path.points[:, k]) for k, x in enumerate("xyz")},
        "feed_mm_min": mm_min_from_mm_s(1.0) * o.feed,
        "override": o.override,
        "override_state": np.array([STATUS[k] for k in o.status], dtype=object),
        "torque_nm": 1e-3 * o.torque,
        "torque_measured_nm": 1e-3 * o.measured,
        "torque_planned_nm": 1e-3 * np.interp(o.s, path.model.s, path.model.torque(1.0)),
        "torque_allowable_nm": 1e-3 * outcome.allowable.torque * relief,
        "torque_over_percent": over,
        "form_error_um": 1e3 * run.error,
        "stress_mpa": run.stress,
        "strength_share": run.stress / outcome.wall.strength,
        "spindle_rpm": rpm_from_rad_s(1.0) * o.speed,
        **({} if run.workpiece is None else {"deflection_workpiece_um": 1e3 * run.workpiece}),
        **check_columns(
            outcome.step_checks, path.model.s, o, run.ratio, 1e3 * run.deflection, outcome.job.check_settings
        ),
    }


def _run_findings(outcome: TorqueResult, case: ControllerCase, run: ControllerRun) -> tuple[Finding, ...]:
    """Findings of a run in addition to its limits."""
    out, o, plain = [], run.outcome, case.runs[PLAIN]
    if not o.finished:
        text = f"the controller stopped at {o.s[-1]:.4g} mm of the path: {o.ended}"
        out.append(Finding("controller-stopped", 0, text, Severity.EXCEEDS))
    if float(o.override.max()) > run.config.cap:
        text = f"override {float(o.override.max()):.4g} exceeds {run.config.cap:.4g}"
        out.append(Finding("override-above-cap", 0, text, Severity.EXCEEDS))
    if o.finished and plain.outcome.finished and o.time > plain.outcome.time:
        times = [number_text(outcome.time_of(one)) for one in (run, plain)]
        text = f"takes {times[0]} s, longer than the {times[1]} s of the constant feed that keeps the limit everywhere"
        out.append(Finding("slower-than-constant", 0, text, Severity.EXCEEDS))
    return tuple(out)


def _findings(outcome: TorqueResult) -> tuple[Finding, ...]:
    """Findings on the whole result."""
    # a rapid that cuts has no severity of its own
    out = [replace(f, severity=f.severity or Severity.EXCEEDS) for f in outcome.findings]
    if not outcome.attainable:
        limit, what = outcome.allowable.limit, "wall" if isinstance(outcome.wall, ShellWall) else "workpiece"
        text = (
            f"no torque is allowable: at step {limit.step} the edge force alone exceeds the "
            f"{number_text(limit.force)} N that the {what} allows by its {limit.by}: {outcome.allowable.remedy}"
        )
        out.append(Finding("no-allowable-torque", 0, text, Severity.EXCEEDS))
    elif isinstance(outcome.wall, ClampedWorkpiece):
        out += outcome.wall.real.findings
    elif outcome.wall.surface is None:
        out.append(Finding("wall-not-finished", 0, "the program finishes no part of the wall", Severity.EXCEEDS))
    elif outcome.wall.surface[0] < -outcome.wall.tolerance:
        text = f"the program cuts {number_text(-1e3 * outcome.wall.surface[0])} µm into the wall"
        out.append(Finding("wall-gouged", 0, text, Severity.EXCEEDS))
    return tuple(out)


def _note(outcome: TorqueResult) -> str:
    if not outcome.control.cases:
        return ""
    case = outcome.control.cases[-1]
    by = outcome.compared(case)
    return (
        f"With {1e3 * case.loop.latency:g} ms latency {number_text(by['shorter_percent'], 3)} % shorter "
        "than the constant feed "
        "that keeps the limit everywhere."
    )
