"""A machine: how far, how fast and how hard its axes go, what its spindle gives, how its controller reads.

Read from TOML with the unit in every key; a number that is missing is named, never invented.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from chipload.errors import InputError
from chipload.tables import nearest, read_table, shipped_names, shipped_table
from chipload.units import mm_s_from_mm_min, rad_s_from_rpm

AXES = ("x", "y", "z")
DIALECTS = ("linuxcnc", "fanuc")


@dataclass(frozen=True)
class Machine:
    """A three-axis mill.

    Parameters
    ----------
    name : as the job calls it
    limits : ((low, high) [mm],) for X, Y, Z, of the cutter tip in the work frame
    rapid : greatest speed along the path in G0 [mm/s], > 0
    feed_max : greatest speed along the path in G1, G2, G3 [mm/s], > 0
    acceleration : of X, Y, Z [mm/s^2], > 0
    spindle_min, spindle_max : [rad/s], 0 <= spindle_min <= spindle_max, spindle_max > 0
    corner_tolerance : how far the path may be rounded off at a corner [mm], >= 0; 0 stops at every corner
    dialect : `linuxcnc` or `fanuc`
    decimals : of a written position [mm], 3 to 6
    power_w : power of the spindle [W]; None: not known
    torque : torque of the spindle [N mm]; None: not known

    Raises
    ------
    InputError
        A number is out of range; the message names it, its value and its limit.
    """

    name: str
    limits: tuple[tuple[float, float], tuple[float, float], tuple[float, float]]
    rapid: float
    feed_max: float
    acceleration: tuple[float, float, float]
    spindle_min: float
    spindle_max: float
    corner_tolerance: float
    dialect: str
    decimals: int
    power_w: float | None = None
    torque: float | None = None

    def __post_init__(self) -> None:
        def need(ok: bool, key: str, value: object, limit: str) -> None:
            if not ok:
                shown = f"{value:g}" if isinstance(value, float) else repr(value)
                raise InputError(f"machine.{key} = {shown}: {limit}")

        if len(self.limits) != 3 or len(self.acceleration) != 3:
            raise InputError("machine: limits and acceleration must have three rows: X, Y, Z")
        for axis, (low, high), acceleration in zip(AXES, self.limits, self.acceleration, strict=True):
            need(math.isfinite(low), f"axis.{axis}.min_mm", low, "must be a finite number")
            need(low < high < math.inf, f"axis.{axis}.max_mm", high, f"must be above min_mm = {low:g}")
            limit = "must be above 0"
            need(0.0 < acceleration < math.inf, f"axis.{axis}.acceleration_mm_s2", acceleration, limit)
        need(0.0 < self.rapid < math.inf, "rapid_mm_min", self.rapid * 60.0, "must be above 0")
        need(0.0 < self.feed_max < math.inf, "feed_max_mm_min", self.feed_max * 60.0, "must be above 0")
        per_rpm = 60.0 / math.tau
        need(0.0 < self.spindle_max < math.inf, "spindle.max_rpm", self.spindle_max * per_rpm, "must be above 0")
        need(
            0.0 <= self.spindle_min <= self.spindle_max,
            "spindle.min_rpm",
            self.spindle_min * per_rpm,
            f"must be from 0 to max_rpm = {self.spindle_max * per_rpm:g}",
        )
        need(
            0.0 <= self.corner_tolerance <= 1.0, "corner_tolerance_mm", self.corner_tolerance, "must be from 0 to 1 mm"
        )
        need(self.dialect in DIALECTS, "dialect", self.dialect, "must be linuxcnc or fanuc")
        need(3 <= self.decimals <= 6, "decimals", self.decimals, "must be from 3 to 6")
        for key, value, factor in (("power_w", self.power_w, 1.0), ("torque_nm", self.torque, 1e-3)):
            need(value is None or 0.0 < value < math.inf, f"spindle.{key}", (value or 0.0) * factor, "must be above 0")

    @property
    def acceleration_xy(self) -> float:
        """Acceleration that every direction in the XY plane can have [mm/s^2]: the lesser of X and Y."""
        return min(self.acceleration[0], self.acceleration[1])


#: table in the file -> its keys; a key with "?" may be left out
_KEYS = {
    "": ("name", "dialect", "decimals", "rapid_mm_min", "feed_max_mm_min", "corner_tolerance_mm"),
    **{f"axis.{a}": ("min_mm", "max_mm", "acceleration_mm_s2") for a in AXES},
    "spindle": ("min_rpm", "max_rpm", "power_w?", "torque_nm?"),
}
_TABLES = {"": ("axis", "spindle"), "axis": AXES}


def _table(label: str, data: dict[str, Any], where: str) -> dict[str, Any]:
    """The keys of one table of the file, all known, none missing; tables in it are left out."""
    keys = _KEYS.get(where, ())
    known = (*(key.rstrip("?") for key in keys), *_TABLES.get(where, ()))
    prefix = f"{where}." if where else ""
    for key in data:
        if key not in known:
            near = nearest(key, list(known))
            raise InputError(f"{label}: unknown key {prefix}{key}: the nearest known one is {prefix}{near}")
    for key in (*keys, *_TABLES.get(where, ())):
        if not key.endswith("?") and key not in data:
            raise InputError(f"{label}: {prefix}{key} is missing: must be given, a machine's limits are never guessed")
    for key in _TABLES.get(where, ()):
        if not isinstance(data[key], dict):
            raise InputError(f"{label}: {prefix}{key} = {data[key]!r}: must be a table, [{prefix}{key}]")
    for key in keys:
        key = key.rstrip("?")
        if key in ("name", "dialect"):
            if not isinstance(data[key], str):
                raise InputError(f"{label}: {prefix}{key} = {data[key]!r}: must be a text")
        elif key in data:
            kind: type | tuple[type, ...] = int if key == "decimals" else (int, float)
            if isinstance(data[key], bool) or not isinstance(data[key], kind):
                what = "a whole number" if key == "decimals" else "a number"
                raise InputError(f"{label}: {prefix}{key} = {data[key]!r}: must be {what}")
    return data


def _from_table(label: str, table: dict[str, Any]) -> Machine:
    """A machine from the values of its file; ``label`` names it in messages."""
    top = _table(label, table, "")
    axes = _table(label, top["axis"], "axis")
    rows = [_table(label, axes[a], f"axis.{a}") for a in AXES]
    spindle = _table(label, top["spindle"], "spindle")
    x, y, z = ((float(row["min_mm"]), float(row["max_mm"])) for row in rows)
    ax, ay, az = (float(row["acceleration_mm_s2"]) for row in rows)
    try:
        return Machine(
            name=top["name"],
            limits=(x, y, z),
            rapid=mm_s_from_mm_min(top["rapid_mm_min"]),
            feed_max=mm_s_from_mm_min(top["feed_max_mm_min"]),
            acceleration=(ax, ay, az),
            spindle_min=rad_s_from_rpm(spindle["min_rpm"]),
            spindle_max=rad_s_from_rpm(spindle["max_rpm"]),
            corner_tolerance=float(top["corner_tolerance_mm"]),
            dialect=top["dialect"],
            decimals=top["decimals"],
            power_w=float(spindle["power_w"]) if "power_w" in spindle else None,
            torque=float(spindle["torque_nm"]) * 1e3 if "torque_nm" in spindle else None,
        )
    except InputError as err:
        raise InputError(f"{label}: {err}") from None


def read_machine(path: str | Path) -> Machine:
    """Read a machine from a TOML file.

    Keys: ``name``, ``dialect``, ``decimals``, ``rapid_mm_min``, ``feed_max_mm_min``, ``corner_tolerance_mm``; in
    ``[axis.x]``, ``[axis.y]``, ``[axis.z]``: ``min_mm``, ``max_mm``, ``acceleration_mm_s2``; in ``[spindle]``:
    ``min_rpm``, ``max_rpm``, optional ``power_w`` and ``torque_nm``.

    Raises
    ------
    InputError
        The file cannot be read, a key is unknown or missing, a value is out of range.
    """
    return _from_table(*read_table("machine", path))


def machine_names() -> tuple[str, ...]:
    """Names of the machines that come with chipload, sorted.

    >>> machine_names()
    ('vmc', 'vmc-fanuc')
    """
    return shipped_names("machine")


def machine_named(name: str) -> Machine:
    """The shipped machine of that name.

    Raises
    ------
    InputError
        There is none; the message names the nearest.

    Examples
    --------
    >>> machine_named("vmc").acceleration_xy
    3000.0
    """
    return _from_table(*shipped_table("machine", name))
