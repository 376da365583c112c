"""Schema of the TOML file of a machine: its tables, their keys and the type of each value."""

from __future__ import annotations

import math
from typing import Any

from chipload.errors import InputError
from chipload.machine.axis import LETTERS, Axis, Vector
from chipload.machine.chain import Chain
from chipload.tables import nearest
from chipload.units import mm_s_from_mm_min

#: values of one table of the file
Row = dict[str, Any]

_NUMBER, _WHOLE, _TEXT, _FLAG, _VECTOR = "a number", "a whole number", "a text", "true or false", "three numbers"
_PAIRS = "pairs of numbers"
_MACHINE = {
    "name": _TEXT,
    "dialect": _TEXT,
    "decimals": _WHOLE,
    "rapid_mm_min": _NUMBER,
    "feed_max_mm_min": _NUMBER,
    "corner_tolerance_mm": _NUMBER,
    "chain?": _TEXT,
    "control?": _TEXT,
    "note?": _TEXT,
    "jerk_mm_s3?": _NUMBER,
    "jerk_low_mm_s3?": _NUMBER,
    "block_time_ms?": _NUMBER,
    "tcp_on?": _TEXT,
    "tcp_off?": _TEXT,
}
_SPINDLE = {
    "min_rpm": _NUMBER,
    "max_rpm": _NUMBER,
    "power_w?": _NUMBER,
    "torque_nm?": _NUMBER,
    "torque_curve?": _PAIRS,
    "direction?": _VECTOR,
    "nose_mm?": _VECTOR,
    "gauge_mm?": _NUMBER,
    "counter_clockwise?": _FLAG,
}
_PLANNER = {
    "cycle_ms": _NUMBER,
    "blend_arcs?": _FLAG,
    "lookahead?": _WHOLE,
    "gap_cycles?": _NUMBER,
    "ramp_frequency_hz?": _NUMBER,
    "kink_ratio?": _NUMBER,
    "override_max?": _NUMBER,
}
_TABLE = {"low_mm": _VECTOR, "high_mm": _VECTOR, "spacing_mm?": _NUMBER}
_WORK = {"zero_mm?": _VECTOR, "x_axis?": _VECTOR, "z_axis?": _VECTOR}
_LINEAR = {
    "min_mm": _NUMBER,
    "max_mm": _NUMBER,
    "acceleration_mm_s2": _NUMBER,
    "rate_mm_min?": _NUMBER,
    "direction?": _VECTOR,
    "side?": _TEXT,
    "indexed?": _FLAG,
    "step_mm?": _NUMBER,
}
_ROTARY = {
    "side": _TEXT,
    "direction": _VECTOR,
    "pivot_mm": _VECTOR,
    "rate_deg_min": _NUMBER,
    "acceleration_deg_s2": _NUMBER,
    "min_deg?": _NUMBER,
    "max_deg?": _NUMBER,
    "endless?": _FLAG,
    "indexed?": _FLAG,
    "step_deg?": _NUMBER,
}
#: keys of the tables other than those of axes
_KEYS = {"spindle": _SPINDLE, "work": _WORK, "table": _TABLE, "trajectory_planner": _PLANNER}
#: tables at the top level of the file; "?": optional
_TABLES = ("axis", "spindle", "work?", "table?", "trajectory_planner?")


def _is(kind: str, value: object) -> bool:
    if kind == _TEXT:
        return isinstance(value, str)
    if kind == _FLAG:
        return isinstance(value, bool)
    if kind == _VECTOR:
        return isinstance(value, list) and len(value) == 3 and all(_is(_NUMBER, v) for v in value)
    if kind == _PAIRS:
        if not isinstance(value, list) or not all(isinstance(row, list) and len(row) == 2 for row in value):
            return False
        return all(_is(_NUMBER, v) for row in value for v in row)
    if isinstance(value, bool):
        return False
    return isinstance(value, int) if kind == _WHOLE else isinstance(value, (int, float))


def check_table(label: str, data: Row, where: str, letters: str = "XYZ") -> Row:
    """The table ``where`` of the file, with its keys checked: all known, none missing, each of the right type.

    Raises
    ------
    InputError
        A key is unknown, missing or of the wrong type; the message begins with ``label`` and names the nearest known
        key.
    """
    tables: tuple[str, ...] = ()
    if where == "":
        keys, tables = _MACHINE, _TABLES
    elif where == "axis":
        keys, tables = {}, tuple(letters.lower())
    elif where in _KEYS:
        keys = _KEYS[where]
    else:
        keys = _ROTARY if where[-1] in "abc" else _LINEAR
    known = [key.rstrip("?") for key in (*keys, *tables)]
    prefix = f"{where}." if where else ""
    for key in data:
        if key not in known:
            near = nearest(key, known)
            raise InputError(f"{label}: unknown key {prefix}{key}: the nearest known one is {prefix}{near}")
    for key in (*keys, *tables):
        if not key.endswith("?") and key not in data:
            raise InputError(f"{label}: {prefix}{key} is missing: must be given, a machine's limits are never guessed")
    for key in (name.rstrip("?") for name in tables):
        if key in data and not isinstance(data[key], dict):
            raise InputError(f"{label}: {prefix}{key} = {data[key]!r}: must be a table, [{prefix}{key}]")
    for name, kind in keys.items():
        key = name.rstrip("?")
        if key in data and not _is(kind, data[key]):
            raise InputError(f"{label}: {prefix}{key} = {data[key]!r}: must be {kind}")
    return data


def vector(values: list[float]) -> Vector:
    """Three floats."""
    x, y, z = (float(v) for v in values)
    return x, y, z


def _axis(letter: str, row: Row, rapid: float) -> Axis:
    """An axis from its table; ``rapid`` [mm/s] is the rate of a linear axis that states none."""
    key = f"machine.axis.{letter.lower()}."
    rotary = letter in "ABC"
    unit = "deg" if rotary else "mm"
    side = row.get("side", "head")
    if side not in ("table", "head"):
        raise InputError(f"{key}side = {side!r}: must be table or head")
    endless = row.get("endless", False)
    for name in ("min_deg", "max_deg") if rotary else ():
        if (name in row) == endless:
            raise InputError(f"{key}{name}: give min_deg and max_deg, or endless = true, not both")
    for name in row:
        if isinstance(row[name], (int, float)) and not math.isfinite(row[name]):
            raise InputError(f"{key}{name} = {row[name]:g}: must be a finite number")
    factor = math.pi / 180.0 if rotary else 1.0
    own = {"X": (1.0, 0.0, 0.0), "Y": (0.0, 1.0, 0.0), "Z": (0.0, 0.0, 1.0)}
    own |= {"U": own["X"], "V": own["Y"], "W": own["Z"]}
    rate = row.get(f"rate_{unit}_min")
    step = row.get(f"step_{unit}")
    return Axis(
        letter=letter,
        head=side == "head",
        direction=vector(row["direction"]) if "direction" in row else own[letter],
        pivot=vector(row.get("pivot_mm", [0.0, 0.0, 0.0])),
        low=-math.inf if endless else row[f"min_{unit}"] * factor,
        high=math.inf if endless else row[f"max_{unit}"] * factor,
        rate=rapid if rate is None else mm_s_from_mm_min(rate) * factor,
        acceleration=row[f"acceleration_{unit}_s2"] * factor,
        indexed=row.get("indexed", False),
        step=None if step is None else step * factor,
    )


def chain_from_table(label: str, top: Row, spindle: Row, rapid: float) -> Chain:
    """The chain of a machine's file whose top and spindle have been checked; ``rapid`` in mm/s."""
    letters = top.get("chain", "XYZ")
    for letter in letters:
        if letter not in LETTERS:
            raise InputError(f"{label}: chain = {letters!r}: {letter}: must be letters of {LETTERS}")
    rows = check_table(label, top["axis"], "axis", letters)
    axes = []
    for letter in letters:
        row = check_table(label, rows[letter.lower()], f"axis.{letter.lower()}")
        axes.append(_axis(letter, row, rapid))
    direction = vector(spindle.get("direction", [0.0, 0.0, 1.0]))
    nose = vector(spindle.get("nose_mm", [0.0, 0.0, 0.0]))
    if "gauge_mm" in spindle:
        heads = [axis for axis in axes if axis.rotary and axis.head]
        gauge = float(spindle["gauge_mm"])
        if not heads or "nose_mm" in spindle:
            raise InputError("machine.spindle.gauge_mm: needs a rotary axis in the head, and no nose_mm")
        if not 0.0 <= gauge < 1e5:
            raise InputError(f"machine.spindle.gauge_mm = {gauge:g}: must be from 0 to 1e5")
        size = math.sqrt(sum(v * v for v in direction)) or 1.0
        nose = vector([c - gauge * s / size for c, s in zip(heads[-1].pivot, direction, strict=True)])
    work = check_table(label, top.get("work", {}), "work")
    return Chain(
        axes=tuple(axes),
        spindle=direction,
        nose=nose,
        work_zero=vector(work.get("zero_mm", [0.0, 0.0, 0.0])),
        work_x=vector(work.get("x_axis", [1.0, 0.0, 0.0])),
        work_z=vector(work.get("z_axis", [0.0, 0.0, 1.0])),
    )
