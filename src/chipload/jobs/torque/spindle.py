"""The spindle of a job: the controller's model from the job and its file, and its resolution."""

from __future__ import annotations

import math
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from chipload.control.resolution import check_limit
from chipload.control.spindle_file import IDENTIFIED, read_spindle
from chipload.control.spindle_model import Spindle, SpindleDeviation
from chipload.errors import InputError
from chipload.jobs.messages import Errors
from chipload.jobs.torque.job import TorqueJob
from chipload.number_text import number_text

Floats = NDArray[np.float64]


def spindle_of(job: TorqueJob, speeds: Floats) -> Spindle:
    """The controller's model of the spindle; ``speeds`` those of the program [rad/s].

    Raises
    ------
    InputError
        A value stands neither in the job nor in its file, or the file was not identified at the speed.
    """
    t, speed = job.table.spindle, float(np.abs(speeds).max())
    values = read_spindle(job.spindle_file, speed).values if job.spindle_file is not None else {}
    values |= {key: getattr(t, key) for key in IDENTIFIED if getattr(t, key) is not None}
    errors = Errors()
    for key in IDENTIFIED:
        if key not in values:
            errors.add(f"spindle.{key}: missing: it is not in spindle.file = {t.file}: state it in the job")
    errors.refuse()
    return Spindle(
        speed=speed, inertia=1e3 * values["inertia_kg_m2"], torque_constant=1e3 * values["torque_constant_nm_a"],
        idle=values["idle_a"], stiffness=t.stiffness_a_s, reset=t.reset_a, most_current=t.most_current_a,
        sensor_lag=values["sensor_lag_s"], smoothing=values["smoothing_s"], noise=values["noise_a"],
        current_step=values["current_step_a"], idle_error=values["idle_error_share"],
        torque_constant_error=values["torque_constant_error_share"],
    )  # fmt: skip


def identified_from(job: TorqueJob, spindle: Spindle) -> Literal["current", "power"]:
    """Whether the spindle was identified from its current or from its power."""
    power = job.spindle_file is not None and read_spindle(job.spindle_file, spindle.speed).source == "power"
    return "power" if power else "current"


def deviation_of(job: TorqueJob) -> SpindleDeviation:
    """Deviation of the real spindle from its model."""
    return SpindleDeviation(**job.table.spindle.deviation.model_dump())


def estimate_range(job: TorqueJob, spindle: Spindle) -> tuple[float, float]:
    """Least and greatest torque for which the estimate holds [N mm], of the file.

    Else what counts as no longer light, and what the drive's greatest current gives.
    """
    if job.spindle_file is not None:
        least, most = read_spindle(job.spindle_file, spindle.speed).torque
        if most < math.inf:
            return 1e3 * least, 1e3 * most
    idle = spindle.idle[0] + spindle.idle[1] * spindle.speed
    light = 1e3 * job.table.torque_control.override.light_nm
    return light, spindle.torque_constant * (spindle.most_current - idle)


def require_resolved(job: TorqueJob, spindle: Spindle, torque: float) -> None:
    """Refuse a torque limit [N mm] that the spindle cannot hold, that counts as light, or for which it was not
    identified.
    """
    override = job.table.torque_control.override
    excess = 1e-2 * job.table.limits.torque_over_percent
    check_limit(spindle, 1e-3 * job.table.loop.period_ms, torque, override.hold, excess)
    light, (least, most) = 1e3 * override.light_nm, estimate_range(job, spindle)
    if light >= override.hold * torque:
        raise wrong_side("light_nm", light, override.hold * torque)
    if override.hold * torque < least:
        raise InputError(
            f"spindle: the estimate is valid from {number_text(1e-3 * least)} N m up, the torque that is held is "
            f"{number_text(1e-3 * override.hold * torque)} N m: log lighter cuts of known torque, each "
            "over several seconds"
        )
    if override.hold * torque > most:
        raise InputError(
            f"spindle: the estimate is valid up to {number_text(1e-3 * most)} N m, the torque that is held is "
            f"{number_text(1e-3 * override.hold * torque)} N m: "
            + (
                "log heavier cuts of known torque"
                if job.spindle_file is not None
                else "state a spindle whose drive gives it (most_current_a)"
            )
        )


def wrong_side(key: str, value: float, set_point: float) -> InputError:
    """Error for a torque of the override [N mm] on the wrong side of the torque limit."""
    side = "below" if key == "light_nm" else "above"
    return InputError(
        f"torque_control.override.{key} = {1e-3 * value:g}: must be {side} the torque that is held, "
        f"{number_text(1e-3 * set_point)} N m"
    )
