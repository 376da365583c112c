"""Limits of a simulated program, stated ones and those of the machine, each against its worst step.

Notation: a limit holds, does not hold, or is unproven: nothing that is known exceeds it, but what was left out of the
number could. The spindle's torque and power are means over a turn, which is what its motor has to give.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipload.machine.machine import Machine
from chipload.report import surface
from chipload.simulation.surface import Difference

Columns = Mapping[str, NDArray[Any]]

#: limit, the column that it holds, and its unit
LIMITS: Mapping[str, tuple[str, str]] = {
    "force_n": ("force_n", "N"),
    "torque_nm": ("torque_nm", "N m"),
    "power_w": ("power_w", "W"),
    "chip_mm": ("chip_max_mm", "mm"),
    "deflection_um": ("deflection_um", "um"),
    "form_error_um": ("form_error_um", "um"),
    "gouge_mm": ("gouge_mm", "mm"),
    "excess_mm": ("", "mm"),
    "spindle_torque_nm": ("torque_mean_nm", "N m"),
    "spindle_power_w": ("power_w", "W"),
    "flute_fill_share": ("flute_fill", ""),
}


@dataclass(frozen=True)
class Held:
    """A limit against the worst step: where (x, y, z) [mm], at which line of the source and which time.

    ``unknown`` says what was left out of the number, so that it may be greater; empty: nothing.
    """

    name: str
    limit: float
    worst: float
    line: int
    at: tuple[float, float, float]
    unknown: str = ""
    t_s: float | None = None

    @property
    def holds(self) -> bool | None:
        """Whether the limit is kept; None: that is unproven."""
        if self.worst > self.limit:
            return False
        return None if self.unknown else True

    @property
    def says(self) -> str:
        """`force 812 N exceeds 500 N in line 12`."""
        unit = f" {LIMITS[self.name][1]}".rstrip()
        word = " ".join(self.name.split("_")[:-1])
        if self.worst > self.limit:
            place = f"in line {self.line}" if self.line else f"at ({', '.join(f'{x:.4g}' for x in self.at)})"
            return f"{word} {self.worst:.4g}{unit} exceeds {self.limit:g}{unit} {place}"
        if self.unknown:
            return f"{word} is at least {self.worst:.4g} of {self.limit:g}{unit}, but {self.unknown}"
        return f"{word} {self.worst:.4g} of {self.limit:g}{unit}"


def held_limits(
    limits: Mapping[str, float],
    machine: Machine,
    columns: Columns,
    left: Difference | None,
    unknown: tuple[str, ...],
) -> tuple[Held, ...]:
    """Every stated limit, then those of the spindle at the speed of each step, and the room for chips.

    Parameters
    ----------
    limits : by name, keys of :data:`LIMITS`
    columns : of the removal
    left : what is left on the part, where it is stated
    unknown : stiffness that is not stated
    """
    out, rigid = [], ""
    if unknown:
        rigid = f"{', '.join(unknown)} {'is' if len(unknown) == 1 else 'are'} not stated"
    for name, limit in limits.items():
        if name in ("gouge_mm", "excess_mm"):
            assert left is not None
            found = surface.worst(left, columns, name.removesuffix("_mm"))
            at = tuple(found["at_mm"] or (0.0, 0.0, 0.0))
            out.append(Held(name, limit, found["max"], found["line"], at, "", found["t_s"]))
        elif name == "form_error_um":
            some = "" if columns["form_points"].any() else "no point of the part is finished"
            k = int(np.argmax(np.abs(columns[name])))
            out.append(_at(name, limit, columns, k, some or rigid))
        else:
            out.append(_worst(name, limit, columns, rigid if name == "deflection_um" else ""))
    torque, power = columns["torque_mean_nm"], columns["power_w"]
    speed = np.divide(power, torque, out=np.zeros(len(power)), where=torque > 0.0)
    given = machine.torque_at(speed) / 1000.0
    k = int(np.argmax(torque / given))
    if np.isfinite(given[k]):
        out.append(_at("spindle_torque_nm", float(given[k]), columns, k))
    if machine.power_w is not None:
        out.append(_worst("spindle_power_w", machine.power_w, columns))
    if "flute_fill" in columns:
        out.append(_worst("flute_fill_share", 1.0, columns))
    return tuple(out)


def spindle_limits(machine: Machine, speeds: ArrayLike = ()) -> dict[str, float]:
    """What the spindle of a machine gives at every one of some speeds [rad/s], by name of the limit; empty where its
    file does not say it.
    """
    torque = float(machine.torque_at(speeds).min(initial=math.inf if machine.torque is None else machine.torque))
    stated = {"spindle_torque_nm": torque / 1000.0, "spindle_power_w": machine.power_w}
    return {name: limit for name, limit in stated.items() if limit is not None and limit < math.inf}


def _worst(name: str, limit: float, columns: Columns, unknown: str = "") -> Held:
    """A limit of a column, at its greatest value."""
    return _at(name, limit, columns, int(np.argmax(columns[LIMITS[name][0]])), unknown)


def _at(name: str, limit: float, columns: Columns, k: int, unknown: str = "") -> Held:
    """A limit of the size of a column at one step."""
    at = (float(columns["x_mm"][k]), float(columns["y_mm"][k]), float(columns["z_mm"][k]))
    value, t = abs(float(columns[LIMITS[name][0]][k])), float(columns["t_s"][k])
    return Held(name, limit, value, int(columns["line"][k]), at, unknown, t)
