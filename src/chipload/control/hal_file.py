"""The file of a controller for a LinuxCNC that runs: ``path``, ``source``, ``period_s``, ..., tables ``override``,
``spindle`` and, of a simulated spindle, its ``deviation``.
"""

from __future__ import annotations

from dataclasses import MISSING, fields
from pathlib import Path
from typing import Any

from chipload.control.fuzzy import read_fuzzy, standard
from chipload.control.hal import HalJob
from chipload.control.linuxcnc.path import read_path
from chipload.control.override import Override
from chipload.control.spindle_model import AS_STATED, Spindle, SpindleDeviation
from chipload.errors import InputError
from chipload.tables import nearest, read_table
from chipload.units import rad_s_from_rpm

#: keys of the file whose unit is another than inside: name, factor
_SCALED = {
    "torque_ref_nm": ("torque_ref", 1e3), "overload_nm": ("overload", 1e3), "torque_most_nm": ("torque_most", 1e3),
    "light_nm": ("light", 1e3), "inertia_kg_m2": ("inertia", 1e3), "torque_constant_nm_a": ("torque_constant", 1e3),
    "speed_rpm": ("speed", rad_s_from_rpm(1.0)), "idle_a": ("idle", 1.0), "stiffness_a_s": ("stiffness", 1.0),
    "reset_a": ("reset", 1.0), "most_current_a": ("most_current", 1.0), "sensor_lag_s": ("sensor_lag", 1.0),
    "smoothing_s": ("smoothing", 1.0), "noise_a": ("noise", 1.0), "current_step_a": ("current_step", 1.0),
    "idle_error_share": ("idle_error", 1.0), "torque_constant_error_share": ("torque_constant_error", 1.0),
    "gain_up_per_s": ("gain_up", 1.0),
    "gain_down_per_s": ("gain_down", 1.0), "slew_up_per_s": ("slew_up", 1.0), "slew_down_per_s": ("slew_down", 1.0),
    "pi_rate_per_s": ("pi_rate", 1.0),
}  # fmt: skip


def load_hal(file: str | Path) -> HalJob:
    """A job from TOML: ``path``, ``source``, ``period_s``, ..., tables ``override`` and ``spindle``.

    Raises
    ------
    InputError
        A file cannot be read, or a key is missing, unknown or out of range.
    """
    label, data = read_table("hal", file)
    own = ("path", "source", "acceleration_mm_s2", "period_s", "latency_s", "feed_forward", "window_mm", "away_mm")
    known = (*own, "fuzzy", "identified_from", "override", "spindle", "deviation")
    for key in data:
        if key not in known:
            raise InputError(f"{label}: unknown key {key}: the nearest known one is {nearest(key, list(known))}")
    for key in (*own, "override", "spindle"):
        if key not in data:
            raise InputError(f"{label}: {key} is missing: must be given")
    if not isinstance(data["feed_forward"], bool):
        raise InputError(f"{label}: feed_forward = {data['feed_forward']!r}: must be true or false")
    numbers = {}
    for key in own[2:5] + own[6:]:
        if isinstance(data[key], bool) or not isinstance(data[key], int | float):
            raise InputError(f"{label}: {key} = {data[key]!r}: must be a number")
        numbers[key] = float(data[key])
    for key in ("path", "source", *(key for key in ("fuzzy", "identified_from") if key in data)):
        if not isinstance(data[key], str):
            raise InputError(f"{label}: {key} = {data[key]!r}: must be a text")
    folder = Path(file).parent
    return HalJob(
        path=read_path(folder / data["path"]),
        override=_from_table(Override, f"{label}: override", data["override"]),
        table=read_fuzzy(folder / data["fuzzy"]) if "fuzzy" in data else standard(),
        source=data["source"],
        spindle=_from_table(Spindle, f"{label}: spindle", data["spindle"]),
        identified_from=data.get("identified_from", "current"),
        deviation=_from_table(SpindleDeviation, f"{label}: deviation", data.get("deviation", {})),
        acceleration=numbers["acceleration_mm_s2"],
        period=numbers["period_s"],
        latency=numbers["latency_s"],
        modelled=data["feed_forward"],
        window=numbers["window_mm"],
        away=numbers["away_mm"],
    )


def write_hal(job: HalJob, path: str, fuzzy: str | None = None) -> str:
    """The TOML of a job whose path lies in the file ``path`` and its table in ``fuzzy``; :func:`load_hal` reads it."""
    lines = [
        f'path = "{path}"',
        *([f'fuzzy = "{fuzzy}"'] if fuzzy is not None else []),
        f'source = "{job.source}"',
        f'identified_from = "{job.identified_from}"',
        f"acceleration_mm_s2 = {float(job.acceleration)!r}",
        f"period_s = {float(job.period)!r}",
        f"latency_s = {float(job.latency)!r}",
        f"feed_forward = {str(job.modelled).lower()}",
        f"window_mm = {float(job.window)!r}",
        f"away_mm = {float(job.away)!r}",
    ]
    units = {name: (key, factor) for key, (name, factor) in _SCALED.items()}
    parts: list[tuple[str, Any]] = [("override", job.override), ("spindle", job.spindle)]
    for title, part in parts + ([("deviation", job.deviation)] if job.deviation != AS_STATED else []):
        lines += ["", f"[{title}]"]
        for field in fields(part):
            key, factor = units.get(field.name, (field.name, 1.0))
            value = getattr(part, field.name)
            lines.append(f"{key} = {_toml(value, factor)}")
    return "\n".join(lines) + "\n"


def _toml(value: Any, factor: float) -> str:
    if isinstance(value, bool | str):
        return str(value).lower() if isinstance(value, bool) else f'"{value}"'
    if isinstance(value, tuple):
        return f"[{', '.join(repr(float(x)) for x in value)}]"
    return repr(value) if isinstance(value, int) else repr(float(value) / factor)


def _from_table(kind: Any, label: str, table: Any) -> Any:
    """A dataclass from a TOML table, with the units of its keys."""
    if not isinstance(table, dict):
        raise InputError(f"{label}: must be a table")
    names = {f.name: (f.name, 1.0) for f in fields(kind)}
    for key, (name, factor) in _SCALED.items():
        if name in names:
            names = {k: v for k, v in names.items() if k != name} | {key: (name, factor)}
    values: dict[str, Any] = {}
    for key, value in table.items():
        if key not in names:
            raise InputError(f"{label}: unknown key {key}: the nearest known one is {nearest(key, list(names))}")
        name, factor = names[key]
        if name == "idle":
            pair = isinstance(value, list) and len(value) == 2 and all(_number(x) for x in value)
            if not pair:
                raise InputError(f"{label}: {key} = {value!r}: must be two numbers, [A] and [A s]")
            values[name] = (float(value[0]), float(value[1]))
        elif name in ("kind", "above_programmed") or name.endswith("_steps"):
            wanted = {"kind": str, "above_programmed": bool}.get(name, int)
            if type(value) is not wanted:
                what = {str: "a text", bool: "true or false", int: "a whole number"}[wanted]
                raise InputError(f"{label}: {key} = {value!r}: must be {what}")
            values[name] = value
        elif _number(value):
            values[name] = float(value) * factor
        else:
            raise InputError(f"{label}: {key} = {value!r}: must be a number")
    needed = {f.name for f in fields(kind) if f.default is MISSING}
    for key, (name, _) in names.items():
        if name in needed and name not in values:
            raise InputError(f"{label}: {key} is missing: must be given")
    return kind(**values)


def _number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)
