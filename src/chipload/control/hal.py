"""The controller of a running LinuxCNC: read the position and the torque, and send the feed override.

    pins (x, y, z, velocity, current, speed)  ->  s on the path, torque  ->  override.step  ->  pin `feed`, pin `beat`

The torque is estimated from the spindle's current and speed: those of pins, or of a simulated spindle and cut that
follow the machine's real place and velocity; or it is that of a pin. The
pin `beat` changes with every step; HAL watches it and takes the feed away from a controller that does not beat
(examples/tube/linuxcnc). The time is that of the machine's pins, so a step that comes late is a long step, and one
longer than `timeout_s` is a start: spindle and controller restart.

The torque of the model is always predicted, with feed-forward or without, and readings are compared with it. A
controller that has stopped continues to send 0 and to beat until it is stopped; it then returns the reason of the
stop.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from chipload.control.fuzzy import FuzzyTable
from chipload.control.linuxcnc.hal_client import ControlledMachine, PinValues
from chipload.control.linuxcnc.path import ToolPath, locate
from chipload.control.linuxcnc.simulated_spindle import (
    Load,
    SpindleState,
    advance,
    at_speed,
    estimate_state,
    read_current,
)
from chipload.control.override import (
    STATUS,
    STOPS,
    Override,
    Reading,
    Status,
    allowed_override,
    begin,
    step,
    stop_state,
)
from chipload.control.plant import Ended, TorqueProfile
from chipload.control.resolution import check_light
from chipload.control.spindle_model import AS_STATED, Spindle, SpindleDeviation
from chipload.errors import InputError

Floats = NDArray[np.float64]

SOURCES = ("plant", "current", "power", "pin")
#: sources that the torque is estimated from, with the speed
MEASURED = ("current", "power")
#: share of its speed by which the spindle may differ from it where its torque is trusted
SPEED_SHARE = 0.1
#: longest substep of the simulated spindle [s]
SUBSTEP = 0.001
#: columns of a record
COLUMNS = (
    "t_s", "s_mm", "feed_mm_s", "override", "in_force", "torque_nmm", "measured_nmm", "status", "away_mm", "relief",
    "current_a", "speed_rad_s",
)  # fmt: skip


@dataclass(frozen=True, eq=False)
class HalJob:
    """A controller, and the machine that it controls.

    Parameters
    ----------
    path : of the tip in the coordinates of the pins, with its torque
    override, table : the controller
    source : of the torque: ``plant``, the simulated spindle; ``current`` or ``power``, pins of it and of the speed;
        ``pin``, a torque
    spindle : what the estimator takes the spindle for; its lags hold for a torque of a pin too
    acceleration : of the axes [mm/s^2]
    period : between steps [s]
    latency : until an override acts [s], in addition to the period
    modelled : the model of the path is used (feed-forward)
    window : the machine is searched so far from its last place [mm], on the whole path while it is off it
    away : farther from the path it is not on it [mm]
    deviation : of the simulated spindle from ``spindle``
    identified_from : ``current`` or ``power``, what ``spindle`` was identified from; of power its currents
        are P / w [N m]
    """

    path: ToolPath
    override: Override
    table: FuzzyTable
    source: Literal["plant", "current", "power", "pin"]
    spindle: Spindle
    acceleration: float
    period: float
    latency: float
    modelled: bool
    window: float
    away: float
    deviation: SpindleDeviation = AS_STATED
    identified_from: Literal["current", "power"] = "current"

    def __post_init__(self) -> None:
        if self.source not in SOURCES:
            raise InputError(f"hal.source = {self.source!r}: must be one of {', '.join(SOURCES)}")
        for name in ("acceleration", "period", "window", "away"):
            if not 0.0 < getattr(self, name) < math.inf:
                raise InputError(f"hal.{name} = {getattr(self, name):g}: must be above 0")
        if not 0.0 <= self.latency <= 10.0:
            raise InputError(f"hal.latency = {self.latency:g} s: must be from 0 to 10")
        if self.identified_from not in MEASURED:
            raise InputError(f"hal.identified_from = {self.identified_from!r}: must be one of {', '.join(MEASURED)}")
        if self.source in MEASURED and self.source != self.identified_from:
            raise InputError(
                f"hal.source = {self.source!r}: the spindle was identified from its {self.identified_from}: name the "
                f"pin of that, --{self.identified_from}-pin, or identify it from logs of its {self.source}"
            )
        check_light(self.spindle, self.period, self.override.light)


@dataclass(frozen=True, eq=False)
class Record:
    """Record of a run of the controller.

    Parameters
    ----------
    rows : (n, 12) float, ``COLUMNS``, one row for each step
    ended : ``path``: its end was reached; the reason of a stop; ``gone``: HAL has left; ``asked``: stopped on request
    torque_max : greatest torque: of a simulated cut the true one, between steps too, else the measured one [N mm]
    """

    rows: Floats
    ended: Ended
    torque_max: float

    def column(self, name: str) -> Floats:
        """Return a column (n,), one of ``COLUMNS``."""
        return np.asarray(self.rows[:, COLUMNS.index(name)])


@dataclass(eq=False)
class _Cut:
    """The simulated spindle, its estimate, and its position at the last step.

    Parameters
    ----------
    believed : what the estimator takes the spindle for
    real, drift : the simulated one, and what its idle current gains [A/s]
    source : of the torque
    """

    believed: Spindle
    real: Spindle
    drift: float
    source: str
    state: SpindleState
    greatest: float = 0.0
    started: float | None = None
    current: float = math.nan
    last: tuple[float, Load, Load] | None = None
    #: the last reading and the time since when it has been the same [s]
    repeated: tuple[float, float] = (math.nan, 0.0)

    def stuck(self, seen: PinValues, light: float, lost_s: float) -> bool:
        """Whether a current or power with noise has been the same for half of ``lost_s`` where a cut is expected."""
        if self.source not in MEASURED:
            return False
        if seen.current != self.repeated[0]:
            self.repeated = (seen.current, seen.time)
        noisy = self.believed.noise > 0.5 * self.believed.current_step
        return noisy and self.state.expected >= light and seen.time - self.repeated[1] >= 0.5 * lost_s

    def follow(self, seen: PinValues, true: Load, model: Load, noise: float, gap: float) -> float:
        """Go on to the time of the pins with the loads there; returns the time since the last step, 0 for the first."""
        seconds = seen.time - self.last[0] if self.last is not None else 0.0
        self.started = seen.time if self.started is None else self.started
        if seconds > gap:
            self.state = at_speed(self.real)
        elif self.last is not None and seconds > 0.0:
            loads = (self.last[1], true), (self.last[2], model)
            warm = self.real.idle[0] + self.drift * (seen.time - self.started)
            real = replace(self.real, idle=(warm, self.real.idle[1])) if self.drift else self.real
            lag = self.believed.sensor_lag
            self.state, most = advance(real, self.state, *loads, seconds, SUBSTEP, lag)
            self.greatest = max(self.greatest, most)
            self._measure(seen, real, noise, seconds)
        self.last = (seen.time, true, model)
        return seconds

    def _measure(self, seen: PinValues, real: Spindle, noise: float, seconds: float) -> None:
        """Update current and estimate by a measurement of current and speed, from pins or simulated."""
        if self.source in MEASURED:
            speed = math.tau * abs(seen.speed)
            # a power over the speed is a torque [N m]
            self.current = seen.current if self.source == "current" else seen.current / speed if speed else math.nan
            if not (math.isfinite(self.current) and math.isfinite(speed)):
                return
            simulated = self.state
            turning = replace(simulated, speed=speed)
            self.state = replace(estimate_state(self.believed, turning, self.current, seconds), speed=simulated.speed)
        else:
            self.current = read_current(real, self.state, noise)
            self.state = estimate_state(self.believed, self.state, self.current, seconds)

    def torque(self, seen: PinValues) -> float:
        """Return the torque for the controller [N mm]; NaN if there is none."""
        if self.source == "pin":
            return 1e3 * seen.torque
        unread = self.source in MEASURED and not (math.isfinite(seen.current) and math.isfinite(seen.speed))
        return math.nan if unread else self.state.filtered

    def speed(self, seen: PinValues) -> float:
        """Of the spindle [rad/s]."""
        return math.tau * abs(seen.speed) if self.source in MEASURED else self.state.speed


def control(
    job: HalJob,
    machine: ControlledMachine,
    clock: Callable[[], float] = time.monotonic,
    sleep: Callable[[float], None] = time.sleep,
    stop: Callable[[], bool] = lambda: False,
    seed: int = 0,
    notice: Callable[[Status, float], None] = lambda status, s: None,
) -> Record:
    """Control a machine until its path ends, the connection is lost, or a stop is requested.

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
    model_profile = path.over_relief
    model = (model_profile.s, model_profile.feed, model_profile.edge, model_profile.cut)
    noise = np.random.default_rng(seed).normal(0.0, job.spindle.noise, 65_536)
    real = job.deviation.applied(job.spindle)
    state = begin(config, job.modelled)
    cut = _Cut(job.spindle, real, job.deviation.drift(job.spindle), job.source, at_speed(real))
    s, row, beat, on, due = float(path.model.s[0]), 0, False, False, clock()
    sent, status, ended = 0.0, Status.RUN, Ended.ASKED
    shown_torque, limit = 0.0, 1e-3 * config.torque_ref * float(path.relief[0])
    rows: list[tuple[float, ...]] = []
    while not stop():
        seen = machine.exchange(sent, beat, shown_torque, STATUS.index(status), s, limit)
        beat = not beat
        if seen is None:
            ended = Ended.GONE
            break
        before = status
        if _implausible(seen, cut):
            state = stop_state(state, Status.MACHINE_DATA) if status not in STOPS else state
            sent, status = 0.0, Status.MACHINE_DATA if status not in STOPS else status
            unknown = (math.nan, math.nan, float(STATUS.index(status)), math.nan, math.nan, math.nan, math.nan)
            rows.append((seen.time, s, seen.velocity, 0.0, seen.feed, *unknown))
        else:
            found, away = locate(path, (seen.x, seen.y, seen.z), s, job.window if on else math.inf)
            on = away <= job.away
            s = found if on else s
            row = row if model[0][row] <= s else 0
            actual = seen.velocity / float(np.interp(s, path.model.s, path.model.feed))
            true, believed = (_load(p, s, actual if on else 0.0) for p in (path.truth, path.model))
            seconds = cut.follow(seen, true, believed, float(noise[len(rows) % len(noise)]), config.timeout_s)
            torque, speed = cut.torque(seen), cut.speed(seen)
            if cut.stuck(seen, config.light, config.lost_s):
                torque = math.nan
            trusted = job.source == "pin" or abs(speed / job.spindle.speed - 1.0) <= SPEED_SHARE
            most_allowed = None
            if job.modelled:
                known = job.latency + job.period
                most_allowed, row = allowed_override(config, state, model, s, actual, known, job.acceleration, row)
            relief = float(np.interp(s, path.model.s, path.relief))
            expected = cut.state.expected / relief
            reading = Reading(torque / relief, seconds, trusted, actual, expected, most_allowed, not on)
            sent, status, state = step(config, job.table, state, reading)
            shown_torque, limit = 1e-3 * torque if math.isfinite(torque) else 0.0, 1e-3 * config.torque_ref * relief
            rows.append((seen.time, s, seen.velocity, sent, seen.feed, true.edge + true.cut, torque,
                         STATUS.index(status), away, relief, cut.current, speed))  # fmt: skip
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
        cut.greatest if job.source == "plant" else max((r[6] for r in rows if math.isfinite(r[6])), default=0.0),
    )


def _implausible(seen: PinValues, cut: _Cut) -> bool:
    """Return whether time, place or velocity is not a number, or the time runs backwards."""
    numbers = (seen.time, seen.x, seen.y, seen.z, seen.velocity)
    return not all(map(math.isfinite, numbers)) or (cut.last is not None and seen.time < cut.last[0])


def table_of(record: Record) -> str:
    """Return the record as CSV."""
    lines = [",".join(COLUMNS)]
    lines += [",".join(f"{x:.9g}" for x in row) for row in record.rows]
    return "\n".join(lines) + "\n"


def _load(profile: TorqueProfile, s: float, actual: float) -> Load:
    if actual <= 0.0:
        return Load(0.0, 0.0)
    edge, cut = (float(np.interp(s, profile.s, x)) for x in (profile.edge, profile.cut))
    return Load(edge, cut * actual)
