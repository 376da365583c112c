"""The limit checks of a simulated program: those of the job, and the default checks."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from chipload.checking.default_checks import DIRECTED, default_limits, with_budget
from chipload.checking.outcome import SimulationResult
from chipload.checking.stability import STABILITY_LIMITS, StabilityResult, stability_limits
from chipload.machine.machine import Machine
from chipload.number_text import number_text
from chipload.result import LimitCheck, Verdict, check_limit, column_of, error_of, state_of
from chipload.result.limits import Columns
from chipload.simulation.accuracy import AXIAL
from chipload.simulation.surface import Difference

#: greatest gouge [mm] of a part whose job states no limit on it: the least medium deviation, ISO 2768-1 m
GOUGE = 0.1
#: columns that deflection falsifies where a stiffness is not stated
BY_STIFFNESS = ("deflection_um", "form_error_um")


def program_limits(
    simulation: SimulationResult, columns: Columns, track: str, stability: StabilityResult | None = None
) -> tuple[LimitCheck, ...]:
    """Return every limit check of the job, then the default checks.

    Parameters
    ----------
    columns : of the track, one row for each step
    track : its name
    stability : of the track; None: that of the simulation
    """
    loads = {name: limit for name, limit in simulation.limits.items() if name not in STABILITY_LIMITS}
    direction = simulation.checks.unknown_direction
    own = stability or simulation.stability
    return (
        *(_check_stated_limit(simulation, columns, track, name, limit) for name, limit in loads.items()),
        *_default_gouge(simulation, columns, track),
        *stability_limits(
            own, simulation.limits, columns, track, simulation.errors, direction, simulation.checks.confidence
        ),
        *_yield_limit(simulation, columns, track),
        *default_limits(simulation.checks, simulation.machine, columns, track, simulation.errors),
    )


def _yield_limit(simulation: SimulationResult, columns: Columns, track: str) -> tuple[LimitCheck, ...]:
    """Return the check of the stress of the workpiece against its yield stress, if that is stated."""
    own = None if simulation.workpiece is None else simulation.workpiece.strained
    if simulation.workpiece is None or own is None:
        return ()
    force = error_of("force_n", simulation.errors)
    # a stress converges more slowly than a displacement
    error = 2.0 * simulation.workpiece.error + force
    k, stress, place = own.worst(np.asarray(columns["force_n"], dtype=np.float64))
    state, why = state_of(stress, own.strength, error)
    line, t = int(columns["line"][k]), float(columns["t_s"][k])
    known = error if math.isfinite(error) else 0.0
    check = LimitCheck("stress_mpa", own.strength, stress, state, track, k, line, place, t, known, why)
    return (with_budget(check, simulation.checks, columns),)


def spindle_limits(machine: Machine, speeds: ArrayLike = ()) -> dict[str, float]:
    """Return limits of torque and power that the spindle of a machine gives at each of some speeds [rad/s], by name.

    A limit that the file of the machine does not state is left out.
    """
    torque = float(machine.torque_at(speeds).min(initial=math.inf if machine.torque is None else machine.torque))
    stated = {"spindle_torque_nm": torque / 1000.0, "spindle_power_w": machine.power_w}
    return {name: limit for name, limit in stated.items() if limit is not None and limit < math.inf}


def greatest_difference(left: Difference, name: str) -> tuple[float, int, tuple[float, float, float] | None]:
    """Return the deepest gouge (``gouge_mm``) or highest excess (``excess_mm``) [mm], its step and its place."""
    sign = -1.0 if name == "gouge_mm" else 1.0
    counts = np.isfinite(left.distance) & (left.over | (left.distance < 0.0))
    value, points, step = np.where(counts, sign * left.distance, -np.inf), left.points, left.step
    if name == "gouge_mm":
        places, distance, own = left.between
        value, points, step = np.append(value, -distance), np.vstack([points, places]), np.append(step, own)
    k = int(np.argmax(value))
    if not value[k] > 0.0:
        return 0.0, 0, None
    x, y, z = (float(v) for v in points[k])
    return float(value[k]), int(step[k]), (x, y, z)


def _check_stated_limit(
    simulation: SimulationResult, columns: Columns, track: str, name: str, limit: float
) -> LimitCheck:
    reason = simulation.checks.unknown_direction if name in DIRECTED else ""
    if not reason and name in BY_STIFFNESS and simulation.rigid:
        reason = f"{', '.join(simulation.rigid)} {'is' if len(simulation.rigid) == 1 else 'are'} not stated"
    if name == AXIAL and not _upright(columns):
        reason = "the axis of the tool leans: the force along it is not calculated"
    if name in ("gouge_mm", "excess_mm"):
        return _difference(simulation, columns, track, name, limit)
    if name == "form_error_um" and "form_points" in columns and not np.asarray(columns["form_points"]).any():
        reason = "no point of the part is finished"
    error = error_of(column_of(name).name, simulation.errors)
    check = check_limit(name, limit, columns, track=track, error=error, reason=reason)
    return with_budget(check, simulation.checks, columns)


def _upright(columns: Columns) -> bool:
    """Return whether the axis of the tool is upright wherever it cuts."""
    cuts = np.asarray(columns["force_n"], dtype=np.float64) > 0.0
    return bool((np.asarray(columns["axis_z"], dtype=np.float64)[cuts] > 1.0 - 1e-9).all())


def _default_gouge(simulation: SimulationResult, columns: Columns, track: str) -> tuple[LimitCheck, ...]:
    """Return the check of the gouge where a part is stated without a limit on it."""
    if simulation.left is None or simulation.limits.get("gouge_mm") is not None or "gouge" in simulation.checks.off:
        return ()
    return (_difference(simulation, columns, track, "gouge_mm", GOUGE),)


def _difference(simulation: SimulationResult, columns: Columns, track: str, name: str, limit: float) -> LimitCheck:
    """Return the check of the cutter's path against points of the part; its row is the step of the worst point."""
    if simulation.left is None:
        return LimitCheck(name, limit, None, Verdict.UNPROVEN, track, reason="no [part] is stated")
    left = simulation.left
    worst, k, place = greatest_difference(left, name)
    hidden = left.hidden if name == "gouge_mm" else 0.0
    state, why = state_of(worst, limit, 0.0)
    if state is Verdict.HOLDS and worst + hidden > limit:
        text = f"{number_text(hidden, 2)} mm" if math.isfinite(hidden) else "an unknown depth"
        state = Verdict.UNPROVEN
        why = f"between the points of the part it may be deeper by {text}: state a smaller part.spacing_mm"
    known = hidden if math.isfinite(hidden) else 0.0
    check = LimitCheck(name, limit, worst, state, track, resolution_error=0.0, reason=why, absolute_error=known)
    if place is None:
        return check
    return replace(check, row=k, line=int(columns["line"][k]), place=place, t_s=float(columns["t_s"][k]))
