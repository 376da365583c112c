"""The file of an identified spindle, written by ``chipload spindle`` and read from ``[spindle] file``.

A spindle that is identified from its power has the keys ``efficiency``, ``idle_w`` (friction [W s], [W s^2]: times the
speed and its square), ``noise_w`` and ``power_step_w``; the others are those of a job's ``[spindle]``.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from chipload.control.identification import IdentifiedSpindle
from chipload.errors import InputError
from chipload.tables import nearest, read_table
from chipload.units import rad_s_from_rpm, rpm_from_rad_s

#: keys of a job that the file may give
IDENTIFIED = (
    "inertia_kg_m2", "torque_constant_nm_a", "idle_a", "sensor_lag_s", "smoothing_s", "noise_a", "current_step_a",
    "idle_error_share", "torque_constant_error_share",
)  # fmt: skip
#: of a file of power: the key, and the key of a job that it becomes
_POWER = {"efficiency": "torque_constant_nm_a", "idle_w": "idle_a", "noise_w": "noise_a",
          "power_step_w": "current_step_a"}  # fmt: skip
_OTHER = ("input", "range", "interval", "predictions", "logs")


@dataclass(frozen=True)
class SpindleData:
    """Data of a spindle file.

    Parameters
    ----------
    source : ``current`` or ``power``: what the controller reads
    values : keys of a job's ``[spindle]``; of power for the requested speed, the current in N m
    torque : (least, greatest) that the estimate holds for [N m]
    speed : (least, greatest) [rad/s]
    """

    source: str
    values: dict[str, Any]
    torque: tuple[float, float]
    speed: tuple[float, float]


def write_spindle(found: IdentifiedSpindle, logs: dict[str, str]) -> str:
    """Return the TOML of an identified spindle; ``logs``: name -> hash. Unknown values are left out, with a comment."""
    f = found.found
    power = found.source == "power"
    # power over speed in N mm
    unit = 1e3 if power else 1.0
    idle = [float(x) / unit for x in (*f.idle, 0.0)[:2]]
    noise, step = found.sensor.noise / unit * (found.cut_speed if power else 1.0), found.sensor.step / unit
    known = found.constant_known is not None
    lines = ["# identified by chipload spindle", f'input = "{found.source}"']
    if found.constant_known is None:
        lines.append("# the torque constant is not known: no cut of known torque was logged, and none was stated")
    else:
        constant = f.torque_constant if power else 1e-3 * f.torque_constant
        lines.append(f"{'efficiency' if power else 'torque_constant_nm_a'} = {constant:.6g}")
        lines.append(f"torque_constant_error_share = {found.constant_error:.3g}")
    lines.append(f"{'idle_w' if power else 'idle_a'} = [{idle[0]:.6g}, {idle[1]:.6g}]")
    if found.inertia_found and found.constant_known is not None:
        lines.append(f"inertia_kg_m2 = {1e-3 * f.inertia:.6g}")
    elif not found.inertia_found:
        lines.append("# the inertia is not known: the speed did not change in the logs")
    lines += [
        f"sensor_lag_s = {found.sensor.lag:.4g}",
        f"smoothing_s = {found.sensor.smoothing:.4g}        # a revolution",
        f"{'noise_w' if power else 'noise_a'} = {noise:.4g}",
        f"{'power_step_w' if power else 'current_step_a'} = {step * (found.cut_speed if power else 1.0):.4g}",
        f"idle_error_share = {found.idle.error:.3g}",
        "",
        "[range]                     # where the estimate is valid",
        *([f"torque_nm = [{', '.join(f'{1e-3 * x:.4g}' for x in found.torque if x < math.inf)}]"] if known else []),
        f"speed_rpm = [{f.speeds[0] * rpm_from_rad_s(1.0):.5g}, {f.speeds[1] * rpm_from_rad_s(1.0):.5g}]",
        f"bandwidth_hz = {found.sensor.bandwidth:.4g}",
        "",
        f"[interval]                  # half widths at {100.0 * f.level:g} %",
        f"torque_constant_share = {found.constant_error:.3g}",
        f"idle = [{', '.join(f'{float(x) / unit:.3g}' for x in f.half_width[2:])}]",
        f"sensor_lag_s = [{found.sensor.lag_interval[0]:.4g}, {found.sensor.lag_interval[1]:.4g}]",
        f"drift_per_min = [{60.0 * found.idle.rate / unit:.3g}, {60.0 * found.idle.half_width / unit:.3g}]",
    ]
    torque, per = ("nm", 1e-3) if known or power else ("a", 1.0)
    for k, answer in enumerate(found.predictions):
        numbers = {f"rms_{torque}": per * answer.rms, f"mean_{torque}": per * answer.mean,
                   f"greatest_{torque}": per * answer.greatest,
                   "covered_share": answer.covered, "apart_share": answer.apart}  # fmt: skip
        texts = [f"{key} = {value:.4g}" for key, value in numbers.items() if math.isfinite(value)]
        lines += ["", f"[predictions.{k}]", f"log = {_text(answer.name)}", *texts]
    lines += ["", "[logs]", *(f"{_text(name)} = {_text(digest)}" for name, digest in logs.items())]
    return "\n".join(lines) + "\n"


def read_spindle(path: str | Path, speed: float | None) -> SpindleData:
    """Read the spindle of a file for a speed [rad/s]; None: the middle of its range.

    Raises
    ------
    InputError
        It cannot be read, a key is unknown or no number, or the speed is none that was identified.
    """
    label, table = read_table("spindle.file", path)
    known = (*_OTHER, *IDENTIFIED, *_POWER)
    for key in table:
        if key not in known:
            raise InputError(f"{label}: unknown key {key}: the nearest known one is {nearest(key, list(known))}")
    source = table.get("input")
    if source not in ("current", "power"):
        raise InputError(f"{label}: input = {source!r}: must be current or power")
    ranges = table.get("range", {})
    torque, speeds = (_pair(label, ranges, name) for name in ("torque_nm", "speed_rpm"))
    low, high = (rad_s_from_rpm(x) for x in speeds)
    speed = 0.5 * (low + high) if speed is None else speed
    slack = 0.02 * high
    if not low - slack <= speed <= high + slack:
        raise InputError(
            f"{label}: identified from {speeds[0]:g} to {speeds[1]:g} rpm: the program turns at "
            f"{rpm_from_rad_s(speed):.5g}: log an air run at that speed, or state another file"
        )
    values: dict[str, Any] = {}
    for key in (*IDENTIFIED, *_POWER):
        if key not in table:
            continue
        if (key in _POWER or key in _POWER.values()) and (key in _POWER) != (source == "power"):
            raise InputError(f"{label}: {key}: not used by input = {source}: leave it out")
        value = table[key]
        numbers = value if isinstance(value, list) else [value]
        if not all(isinstance(x, int | float) and not isinstance(x, bool) and math.isfinite(x) for x in numbers):
            raise InputError(f"{label}: {key} = {value!r}: must be a number, or two")
        # a power over the speed is a torque, which takes the place of the current
        factor = 1.0 / speed if key in ("noise_w", "power_step_w") else 1.0
        values[_POWER.get(key, key)] = tuple(map(float, numbers)) if isinstance(value, list) else factor * float(value)
    return SpindleData(str(source), values, torque, (low, high))


def _pair(label: str, table: Any, name: str) -> tuple[float, float]:
    """Return least and greatest value; the greatest torque may be missing if no cut of known torque determined it."""
    value: Any = table.get(name) if isinstance(table, dict) else None
    numbers = [float(x) for x in value if isinstance(x, int | float)] if isinstance(value, list) else []
    finite = all(map(math.isfinite, numbers))
    if len(numbers) == 1 and name == "torque_nm":
        numbers.append(math.inf)
    if len(numbers) != 2 or not finite or not 0.0 <= numbers[0] <= numbers[1]:
        raise InputError(
            f"{label}: range.{name} = {value!r}: must be two numbers, least and greatest; without a torque constant a "
            "job cannot use the file: log cuts of known torque, or state --torque-constant-nm-a"
        )
    return numbers[0], numbers[1]


def _text(text: str) -> str:
    escaped = text.replace("\\", "\\\\").replace('"', '\\"')
    return f'"{escaped}"'
