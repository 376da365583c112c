"""The limit checks of a simulated program: those of the job, and the default checks."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from chipload.checking.default_checks import DIRECTED, default_limits, load_error, upper_loads, with_peaks
from chipload.checking.outcome import SimulationResult
from chipload.checking.stability import STABILITY_LIMITS, StabilityResult, stability_limits
from chipload.machine.machine import Machine
from chipload.result import LimitCheck, Verdict, check_limit, column_of, state_of
from chipload.result.limits import Columns
from chipload.simulation.surface import Difference

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
    upper = upper_loads(columns, simulation.checks.sigma)
    loads = {name: limit for name, limit in simulation.limits.items() if name not in STABILITY_LIMITS}
    direction = simulation.checks.unknown_direction
    own = stability or simulation.stability
    return (
        *(_stated(simulation, upper, track, name, limit) for name, limit in loads.items()),
        *stability_limits(
            own, simulation.limits, columns, track, simulation.errors, direction, simulation.checks.sigma
        ),
        *_yield_limit(simulation, upper, track),
        *default_limits(simulation.checks, simulation.machine, columns, track, simulation.errors),
    )


def _yield_limit(simulation: SimulationResult, columns: Columns, track: str) -> tuple[LimitCheck, ...]:
    """Return the check of the stress of the workpiece against its yield stress, if that is stated."""
    own = None if simulation.workpiece is None else simulation.workpiece.strained
    if simulation.workpiece is None or own is None:
        return ()
    force = simulation.errors.get("force_n", 0.0)
    # a stress converges more slowly than a displacement
    error = 2.0 * simulation.workpiece.error + (force if math.isfinite(force) else 0.0)
    k, stress, place = own.worst(np.asarray(columns["force_n"], dtype=np.float64))
    state, why = state_of(stress, own.strength, error)
    line, t = int(columns["line"][k]), float(columns["t_s"][k])
    check = LimitCheck("stress_mpa", own.strength, stress, state, track, k, line, place, t, error, why)
    return (with_peaks(check, simulation.checks, columns),)


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
    value = np.where(counts, sign * left.distance, -np.inf)
    k = int(np.argmax(value))
    if not value[k] > 0.0:
        return 0.0, 0, None
    x, y, z = (float(v) for v in left.points[k])
    return float(value[k]), int(left.step[k]), (x, y, z)


def _stated(simulation: SimulationResult, columns: Columns, track: str, name: str, limit: float) -> LimitCheck:
    reason = simulation.checks.unknown_direction if name in DIRECTED else ""
    if not reason and name in BY_STIFFNESS and simulation.rigid:
        reason = f"{', '.join(simulation.rigid)} {'is' if len(simulation.rigid) == 1 else 'are'} not stated"
    if name in ("gouge_mm", "excess_mm"):
        return _difference(simulation, columns, track, name, limit)
    if name == "form_error_um" and "form_points" in columns and not np.asarray(columns["form_points"]).any():
        reason = "no point of the part is finished"
    error = load_error(simulation.errors, column_of(name).name)
    check = check_limit(name, limit, columns, track=track, error=error, reason=reason)
    return with_peaks(check, simulation.checks, columns)


def _difference(simulation: SimulationResult, columns: Columns, track: str, name: str, limit: float) -> LimitCheck:
    """Return the check of the cutter's path against points of the part; its row is the step of the worst point."""
    if simulation.left is None:
        return LimitCheck(name, limit, None, Verdict.UNPROVEN, track, reason="no [part] is stated")
    worst, k, place = greatest_difference(simulation.left, name)
    if place is None:
        return LimitCheck(name, limit, worst, Verdict.HOLDS, track)
    line, t = int(columns["line"][k]), float(columns["t_s"][k])
    state, why = state_of(worst, limit)
    return LimitCheck(name, limit, worst, state, track, k, line, place, t, 0.0, why)
