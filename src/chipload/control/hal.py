"""The controller of a LinuxCNC that runs: where the machine is, what the torque is, which override it is sent.

    pins (x, y, z, velocity, torque)  ->  s on the path, torque  ->  override.step  ->  pin `feed`, pin `beat`

The torque is that of a pin, or of a simulated spindle and cut that follow the machine's real place and velocity. The
pin `beat` changes with every step; HAL watches it and takes the feed away from a controller that does not beat
(examples/tube/linuxcnc). The time is that of the machine's pins, so a step that comes late is a long step, and one
longer than `gap_s` is a start: spindle and controller begin anew.

The torque of the model is predicted in every case, with feed-forward or without, and readings are held against it. A
controller that has stopped goes on sending 0, and beats, until it is asked to end: its end is the reason of the stop.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import MISSING, dataclass, fields
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from chipload.control.fuzzy import FuzzyTable, read_fuzzy, standard
from chipload.control.linuxcnc.hal_client import ControlledMachine, PinValues
from chipload.control.linuxcnc.path import ToolPath, locate, read_path
from chipload.control.linuxcnc.simulated_spindle import Load, SpindleState, advance, at_speed, measure
from chipload.control.override import STATUS, STOPS, Override, Reading, Status, allowed, begin, step, stopped
from chipload.control.plant import Ended, Spindle, TorqueProfile
from chipload.control.resolution import check_light
from chipload.errors import InputError
from chipload.tables import nearest, read_table
from chipload.units import rad_s_from_rpm

Floats = NDArray[np.float64]

SOURCES = ("plant", "pin")
#: longest substep of the simulated spindle [s]
SUBSTEP = 0.001
#: columns of a record
COLUMNS = (
    "t_s", "s_mm", "feed_mm_s", "override", "in_force", "torque_nmm", "measured_nmm", "status", "away_mm", "relief",
)  # fmt: skip
#: keys of the file whose unit is another than inside: name, factor
_SCALED = {
    "torque_ref_nm": ("torque_ref", 1e3), "overload_nm": ("overload", 1e3), "torque_most_nm": ("torque_most", 1e3),
    "light_nm": ("light", 1e3), "inertia_kg_m2": ("inertia", 1e3), "torque_constant_nm_a": ("torque_constant", 1e3),
    "speed_rpm": ("speed", rad_s_from_rpm(1.0)), "idle_a": ("idle", 1.0), "stiffness_a_s": ("stiffness", 1.0),
    "reset_a": ("reset", 1.0), "most_current_a": ("most_current", 1.0), "sensor_lag_s": ("sensor_lag", 1.0),
    "smoothing_s": ("smoothing", 1.0), "noise_a": ("noise", 1.0), "current_step_a": ("current_step", 1.0),
    "idle_error_share": ("idle_error", 1.0), "gain_up_per_s": ("gain_up", 1.0),
    "gain_down_per_s": ("gain_down", 1.0), "slew_up_per_s": ("slew_up", 1.0), "slew_down_per_s": ("slew_down", 1.0),
    "pi_rate_per_s": ("pi_rate", 1.0),
}  # fmt: skip


@dataclass(frozen=True, eq=False)
class HalJob:
    """A controller and the machine that it controls.

    Parameters
    ----------
    path : of the tip in the coordinates of the pins, with its torque
    override, table : the controller
    source : of the torque: ``plant``, the simulated one, or ``pin``
    spindle : that the torque is measured with; its lags hold for a pin too
    acceleration : of the axes [mm/s^2]
    period : between steps [s]
    latency : until an override acts [s], beside the period
    modelled : the model of the path is used (feed-forward)
    window : the machine is looked for so far from its last place [mm], on the whole path while it is off it
    away : farther from the path it is not on it [mm]
    """

    path: ToolPath
    override: Override
    table: FuzzyTable
    source: Literal["plant", "pin"]
    spindle: Spindle
    acceleration: float
    period: float
    latency: float
    modelled: bool
    window: float
    away: float

    def __post_init__(self) -> None:
        if self.source not in SOURCES:
            raise InputError(f"hal.source = {self.source!r}: must be one of {', '.join(SOURCES)}")
        for name in ("acceleration", "period", "window", "away"):
            if not 0.0 < getattr(self, name) < math.inf:
                raise InputError(f"hal.{name} = {getattr(self, name):g}: must be above 0")
        if not 0.0 <= self.latency <= 10.0:
            raise InputError(f"hal.latency = {self.latency:g} s: must be from 0 to 10")
        check_light(self.spindle, self.period, self.override.light)


@dataclass(frozen=True, eq=False)
class Record:
    """What happened.

    Parameters
    ----------
    rows : (n, 10) float, ``COLUMNS``, a row a step
    ended : ``path``: its end was reached; the reason of a stop; ``gone``: HAL has left; ``asked``: it was asked to end
    torque_max : greatest torque, between steps too [N mm]
    """

    rows: Floats
    ended: Ended
    torque_max: float

    def column(self, name: str) -> Floats:
        """(n,) float, one of ``COLUMNS``."""
        return np.asarray(self.rows[:, COLUMNS.index(name)])


def load_hal(file: str | Path) -> HalJob:
    """A job from TOML: ``path``, ``source``, ``period_s``, ..., tables ``override`` and ``spindle``.

    Raises
    ------
    InputError
        A file cannot be read, or a key is missing, unknown or out of range.
    """
    label, data = read_table("hal", file)
    own = ("path", "source", "acceleration_mm_s2", "period_s", "latency_s", "feed_forward", "window_mm", "away_mm")
    known = (*own, "fuzzy", "override", "spindle")
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
    for key in ("path", "source", *(("fuzzy",) if "fuzzy" in data else ())):
        if not isinstance(data[key], str):
            raise InputError(f"{label}: {key} = {data[key]!r}: must be a text")
    folder = Path(file).parent
    return HalJob(
        path=read_path(folder / data["path"]),
        override=_made(Override, f"{label}: override", data["override"]),
        table=read_fuzzy(folder / data["fuzzy"]) if "fuzzy" in data else standard(),
        source=data["source"],
        spindle=_made(Spindle, f"{label}: spindle", data["spindle"]),
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
        f"acceleration_mm_s2 = {float(job.acceleration)!r}",
        f"period_s = {float(job.period)!r}",
        f"latency_s = {float(job.latency)!r}",
        f"feed_forward = {str(job.modelled).lower()}",
        f"window_mm = {float(job.window)!r}",
        f"away_mm = {float(job.away)!r}",
    ]
    units = {name: (key, factor) for key, (name, factor) in _SCALED.items()}
    for title, part in (("override", job.override), ("spindle", job.spindle)):
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


@dataclass(eq=False)
class _Cut:
    """The simulated spindle, and where it was at the last step."""

    spindle: Spindle
    state: SpindleState
    greatest: float = 0.0
    last: tuple[float, Load, Load] | None = None

    def follow(self, at: float, true: Load, model: Load, noise: float, gap: float) -> float:
        """Go on to a time [s] with the loads there; returns the time since the last step, 0 for the first."""
        seconds = at - self.last[0] if self.last is not None else 0.0
        if seconds > gap:
            self.state = at_speed(self.spindle)
        elif self.last is not None and seconds > 0.0:
            loads = (self.last[1], true), (self.last[2], model)
            self.state, most = advance(self.spindle, self.state, *loads, seconds, SUBSTEP)
            self.greatest = max(self.greatest, most)
            self.state = measure(self.spindle, self.state, noise, seconds)
        self.last = (at, true, model)
        return seconds


def control(
    job: HalJob,
    machine: ControlledMachine,
    clock: Callable[[], float] = time.monotonic,
    sleep: Callable[[float], None] = time.sleep,
    stop: Callable[[], bool] = lambda: False,
    seed: int = 0,
    notice: Callable[[Status, float], None] = lambda status, s: None,
) -> Record:
    """Control a machine until its path ends, it is gone, or it is asked to stop.

    Parameters
    ----------
    job : what is controlled, and how
    machine : takes the override, reports where it is
    clock, sleep : of the period
    stop : whether to stop
    seed : of the noise of the simulated current
    notice : called once when the controller stops the machine, with the reason and the place on the path [mm]
    """
    path, config = job.path, job.override
    told = path.over_relief
    model = (told.s, told.feed, told.edge, told.cut)
    noise = np.random.default_rng(seed).normal(0.0, job.spindle.noise, 65_536)
    state, cut = begin(config, job.modelled), _Cut(job.spindle, at_speed(job.spindle))
    s, row, beat, on, due = float(path.model.s[0]), 0, False, False, clock()
    sent, status, ended = 0.0, Status.RUN, Ended.ASKED
    rows: list[tuple[float, ...]] = []
    while not stop():
        seen = machine.exchange(sent, beat, 1e-3 * cut.state.filtered, STATUS.index(status), s)
        beat = not beat
        if seen is None:
            ended = Ended.GONE
            break
        before = status
        if _wrong(seen, cut):
            state = stopped(state, Status.MACHINE_DATA) if status not in STOPS else state
            sent, status = 0.0, Status.MACHINE_DATA if status not in STOPS else status
            unknown = (math.nan, math.nan, float(STATUS.index(status)), math.nan, math.nan)
            rows.append((seen.time, s, seen.velocity, 0.0, seen.feed, *unknown))
        else:
            found, away = locate(path, (seen.x, seen.y, seen.z), s, job.window if on else math.inf)
            on = away <= job.away
            s = found if on else s
            row = row if model[0][row] <= s else 0
            actual = seen.velocity / float(np.interp(s, path.model.s, path.model.feed))
            true, believed = (_load(p, s, actual if on else 0.0) for p in (path.truth, path.model))
            seconds = cut.follow(seen.time, true, believed, float(noise[len(rows) % len(noise)]), config.gap_s)
            torque = cut.state.filtered if job.source == "plant" else 1e3 * seen.torque
            most_allowed = None
            if job.modelled:
                known = job.latency + job.period
                most_allowed, row = allowed(config, state, model, s, actual, known, job.acceleration, row)
            relief = float(np.interp(s, path.model.s, path.relief))
            reading = Reading(torque / relief, seconds, True, actual, cut.state.expected / relief, most_allowed, not on)
            sent, status, state = step(config, job.table, state, reading)
            rows.append((seen.time, s, seen.velocity, sent, seen.feed, true.edge + true.cut, torque,
                         STATUS.index(status), away, relief))  # fmt: skip
            if s >= path.model.s[-1] - 1e-3 and seen.velocity == 0.0 and status not in STOPS:
                ended = Ended.PATH
                break
        if status in STOPS and before not in STOPS:
            notice(status, s)
        due += job.period
        late = due - clock()
        if late > 0.0:
            sleep(late)
        else:
            due -= late
    return Record(
        np.array(rows).reshape(-1, len(COLUMNS)),
        Ended(status.value) if status in STOPS else ended,
        cut.greatest,
    )


def _wrong(seen: PinValues, cut: _Cut) -> bool:
    """Whether time, place or velocity is not a number, or the time runs backwards."""
    numbers = (seen.time, seen.x, seen.y, seen.z, seen.velocity)
    return not all(map(math.isfinite, numbers)) or (cut.last is not None and seen.time < cut.last[0])


def table_of(record: Record) -> str:
    """The record as CSV."""
    lines = [",".join(COLUMNS)]
    lines += [",".join(f"{x:.9g}" for x in row) for row in record.rows]
    return "\n".join(lines) + "\n"


def _load(profile: TorqueProfile, s: float, actual: float) -> Load:
    if actual <= 0.0:
        return Load(0.0, 0.0)
    edge, cut = (float(np.interp(s, profile.s, x)) for x in (profile.edge, profile.cut))
    return Load(edge, cut * actual)


def _made(kind: Any, label: str, table: Any) -> Any:
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
