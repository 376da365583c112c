"""Simulation of torque, feed and spindle along a program under an override, to test controllers.

Notation: s [mm] along the path; F(s) programmed feed [mm/s], o the override, v the feed that the axes reach on the way
to o F; torque averaged over a revolution T(s) = edge(s) + cut(s) v / F (w_0 / w), so cut is the part that goes with the
feed per tooth [N mm at the programmed feed]; w spindle speed [rad/s], w_0 the programmed one; J inertia [N mm s^2],
K_T [N mm/A], I current [A].

    J dw/dt = K_T (I - I_idle(w)) - T,   I_idle = i_0 + i_1 w,
    I = K_P (w_0 - w) + K_I integral of (w_0 - w), within the drive's current,
    I_read = lag of I + noise, in whole steps,   T_measured: chipload.control._estimator, from I_read and w.

The plant simulates the real spindle (:class:`SpindleDeviation`); the estimator uses the data of the spindle. K_T,
I_idle, J and the lag of the two may differ, and the real I_idle may drift.

Where the wall allows more than the held torque, the controller receives the torque over its relief (T and T_model
alike): it holds the same share of the allowable torque everywhere.

The model of the controller and the true torque (its columns with surprises) are two sets of columns. The axes
accelerate within their limit; the override acts after its latency. The tooth frequency is above the bandwidth and is
not simulated.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipload.control import _plant
from chipload.control._estimator import Belief
from chipload.control.fuzzy import FuzzyTable
from chipload.control.override import STATUS, Override, begin, sets_of
from chipload.control.spindle_model import AS_STATED, Spindle, SpindleDeviation
from chipload.errors import InputError

Floats = NDArray[np.float64]

FAULTS = ("none", "nan", "stuck", "value", "scaled")
#: share of its speed below which the spindle counts as stalled
STALL = 0.5


class Ended(StrEnum):
    """End of a run: at the end of the path, or the reason why not."""

    PATH = "path"
    GONE = "gone"
    ASKED = "asked"
    TIME = "time"
    STALLED = "stalled"
    OVERLOAD = "overload"
    NO_READING = "no-reading"
    LOW_READING = "low-reading"
    OFF_PATH = "off-path"
    MACHINE_DATA = "machine-data"


@dataclass(frozen=True, eq=False)
class TorqueProfile:
    """Torque along a path at the programmed feed.

    Parameters
    ----------
    s : (n,) float [mm], not falling
    feed : (n,) float [mm/s], programmed
    edge : (n,) float [N mm], part that does not know the feed
    cut : (n,) float [N mm], part that goes with the feed per tooth

    Raises
    ------
    InputError
        Columns differ in length, s falls, a value is negative or no number, a feed is 0.
    """

    s: Floats
    feed: Floats
    edge: Floats
    cut: Floats

    def __post_init__(self) -> None:
        for name in ("s", "feed", "edge", "cut"):
            column = np.array(getattr(self, name), dtype=np.float64)
            if column.ndim != 1 or len(column) < 2 or column.shape != np.shape(self.s):
                raise InputError(f"profile.{name}: must be a column of the length of s, at least 2 rows")
            bad = ~(np.isfinite(column) & (column >= 0.0 if name != "feed" else column > 0.0))
            if bad.any() and name != "s":
                row = int(np.flatnonzero(bad)[0])
                least = "above 0" if name == "feed" else "at least 0"
                raise InputError(f"profile.{name}[{row}] = {column[row]:g}: must be a number, {least}")
            column.setflags(write=False)
            object.__setattr__(self, name, column)
        if not (np.diff(self.s) > 0.0).all():
            row = int(np.flatnonzero(~(np.diff(self.s) > 0.0))[0]) + 1
            raise InputError(f"profile.s[{row}] = {self.s[row]:g}: must be above {self.s[row - 1]:g} before it")

    def torque(self, override: ArrayLike) -> Floats:
        """Return the torque [N mm] in each row at an override (a number or (n,))."""
        return np.asarray(self.edge + self.cut * np.asarray(override, dtype=np.float64))

    def constant_override(self, torque: float) -> float:
        """Return the greatest constant override at which no row exceeds ``torque`` [N mm]; 0 if there is none."""
        cutting = self.cut > 0.0
        if (self.edge > torque).any():
            return 0.0
        return float(((torque - self.edge[cutting]) / self.cut[cutting]).min()) if cutting.any() else math.inf


@dataclass(frozen=True)
class Surprise:
    """A true change of the torque that the model does not know, from ``begin`` to ``end`` [mm] along the path.

    Parameters
    ----------
    begin, end : [mm]
    cut, edge : factors of the two parts of the torque (1.3, 1: stock 30 % thicker; 1.2, 2: a worn cutter)
    ramp : the factor grows and falls over so much path at both ends [mm]; a round cutter enters over about its radius
    """

    begin: float
    end: float
    cut: float
    edge: float = 1.0
    ramp: float = 0.0

    def __post_init__(self) -> None:
        if not self.begin < self.end:
            raise InputError(f"surprise.end = {self.end:g} mm: must be above begin = {self.begin:g}")
        for name in ("cut", "edge"):
            if not 0.0 <= getattr(self, name) <= 100.0:
                raise InputError(f"surprise.{name} = {getattr(self, name):g}: must be a factor from 0 to 100")
        if not 0.0 <= self.ramp < math.inf:
            raise InputError(f"surprise.ramp = {self.ramp:g} mm: must be at least 0")


def with_surprises(
    profile: TorqueProfile, surprises: tuple[Surprise, ...], spacing: float | None = None
) -> TorqueProfile:
    """Return the true columns: the profile with surprises, sampled every ``spacing`` [mm] (None: the present rows)."""
    s = profile.s
    if spacing is not None:
        if not spacing > 0.0:
            raise InputError(f"plant.spacing = {spacing:g} mm: must be above 0")
        s = np.unique(np.concatenate([s, np.arange(s[0], s[-1], spacing)]))
    edge, cut, feed = (np.interp(s, profile.s, x) for x in (profile.edge, profile.cut, profile.feed))
    for x in surprises:
        inside = np.minimum(s - x.begin, x.end - s)
        share = (inside >= 0.0).astype(np.float64) if x.ramp == 0.0 else np.clip(inside / x.ramp, 0.0, 1.0)
        cut = cut * (1.0 + (x.cut - 1.0) * share)
        edge = edge * (1.0 + (x.edge - 1.0) * share)
    return TorqueProfile(s, feed, edge, cut)


@dataclass(frozen=True)
class Loop:
    """Times of the control loop and the limit of the axes.

    Parameters
    ----------
    acceleration : of the feed [mm/s^2]
    period : between two steps of the controller [s]
    latency : until an override acts [s], rounded to periods
    substep : of the simulation [s], at most the period
    longest_s : give up after [s]
    seed : of the noise
    """

    acceleration: float
    period: float = 0.01
    latency: float = 0.0
    substep: float = 0.001
    longest_s: float = 3600.0
    seed: int = 0

    def __post_init__(self) -> None:
        for name in ("acceleration", "period", "substep", "longest_s"):
            if not 0.0 < getattr(self, name) < math.inf:
                raise InputError(f"loop.{name} = {getattr(self, name):g}: must be above 0")
        if not 0.0 <= self.latency <= 10.0:
            raise InputError(f"loop.latency = {self.latency:g} s: must be from 0 to 10")
        if self.substep > self.period:
            raise InputError(f"loop.substep = {self.substep:g} s: must be at most the period {self.period:g}")


@dataclass(frozen=True)
class Fault:
    """A fault of the sensor from ``begin`` to ``end`` [s].

    ``nan``; ``stuck``: its last reading; ``value``: always ``value`` [N mm]; ``scaled``: ``value`` times what it was.
    """

    kind: Literal["none", "nan", "stuck", "value", "scaled"] = "none"
    begin: float = 0.0
    end: float = 0.0
    value: float = 0.0

    def __post_init__(self) -> None:
        if self.kind not in FAULTS:
            raise InputError(f"fault.kind = {self.kind!r}: must be one of {', '.join(FAULTS)}")


@dataclass(frozen=True, eq=False)
class Outcome:
    """Result of a run.

    Parameters
    ----------
    finished : the end of the path was reached
    ended : ``path``; ``time``: longest_s; ``stalled``: the spindle; else the reason for which the controller stopped
    time : [s]
    torque_max : greatest true torque [N mm]
    load_max : greatest true torque over its relief [N mm]
    time_over : with the true torque, over its relief, above the limit [s]
    t, s, feed, torque, measured, override, speed : (k,) float, a row each step of the controller and the last
        [s, mm, mm/s, N mm, N mm, -, rad/s]
    status : (k,) int, of ``STATUS``
    """

    finished: bool
    ended: Ended
    time: float
    torque_max: float
    load_max: float
    time_over: float
    t: Floats
    s: Floats
    feed: Floats
    torque: Floats
    measured: Floats
    override: Floats
    speed: Floats
    status: NDArray[np.int64]


def run(
    truth: TorqueProfile,
    model: TorqueProfile | None,
    controller: Override,
    table: FuzzyTable,
    spindle: Spindle,
    loop: Loop,
    limit: float,
    fault: Fault | None = None,
    every_row: int = 1,
    relief: Floats | None = None,
    monitor: TorqueProfile | None = None,
    deviation: SpindleDeviation = AS_STATED,
) -> Outcome:
    """Simulate a controller along a path.

    Parameters
    ----------
    truth : what the cutter meets
    model : what the controller believes, at the same programmed feeds; None: it has no feed-forward
    controller, table : see :mod:`chipload.control.override`
    spindle, loop : the machine; what the estimator believes of the spindle
    limit : torque for ``time_over`` [N mm]
    fault : of the sensor
    every_row : keep every so many steps of the controller
    relief : (n,) float, above 0, at the rows of ``truth``: what is allowed there over what is held; the
        controller receives the torque over it; None: 1 everywhere
    monitor : model that readings are held against where there is no feed-forward; None: ``model``
    deviation : of the real spindle

    Raises
    ------
    InputError
        The model covers another path than the truth, or the relief is not one number above 0 a row.
    """
    rows_s, expected = truth.s, model if model is not None else monitor
    share = np.ones(len(rows_s)) if relief is None else np.asarray(relief, dtype=np.float64)
    if share.shape != rows_s.shape or not ((share > 0.0) & np.isfinite(share)).all():
        raise InputError(f"plant.relief: must be {len(rows_s)} numbers above 0, one for each row of the truth")
    believed = truth
    if expected is not None:
        if (expected.s[0], expected.s[-1]) != (truth.s[0], truth.s[-1]):
            raise InputError(
                f"plant.model: from s = {expected.s[0]:g} to {expected.s[-1]:g} mm: must cover the path, "
                f"{truth.s[0]:g} to {truth.s[-1]:g}"
            )
        believed = _on_rows(expected, truth.s)
        truth = _on_rows(truth, believed.s)
    share = np.interp(truth.s, rows_s, share)
    every, delay = max(round(loop.period / loop.substep), 1), round(loop.latency / loop.period)
    rows = math.ceil(loop.longest_s / loop.period / every_row) + 3
    out = np.empty((min(rows, 2_000_000), 8))
    fault = fault or Fault()
    filled, ended, time, greatest, load, over = _plant.run(
        _plant.Columns(truth.s, truth.feed, truth.edge, truth.cut, believed.edge / share, believed.cut / share, share),
        model is not None,
        expected is not None,
        controller.numbers,
        sets_of(table),
        begin(controller, model is not None),
        _plant.Axes(loop.period / every, every, delay, delay * loop.period, loop.acceleration, loop.longest_s, STALL),
        _drive(deviation.applied(spindle), deviation.drift(spindle)),
        belief_of(spindle),
        _plant.SensorFault(FAULTS.index(fault.kind), float(fault.begin), float(fault.end), float(fault.value)),
        np.random.default_rng(loop.seed).normal(0.0, spindle.noise, 65_536),
        limit,
        every_row,
        out,
    )
    t, s, feed, torque, measured, sent, status, speed = np.ascontiguousarray(out[:filled].T)
    ends = {_plant.FINISHED: Ended.PATH, _plant.TIMED_OUT: Ended.TIME, _plant.STALLED: Ended.STALLED}
    return Outcome(
        finished=ended == _plant.FINISHED,
        ended=Ended(STATUS[int(status[-1])]) if ended == _plant.STOPPED else ends[ended],
        time=time,
        torque_max=greatest,
        load_max=load,
        time_over=over,
        t=t,
        s=s,
        feed=feed,
        torque=torque,
        measured=measured,
        override=sent,
        speed=speed,
        status=status.astype(np.int64),
    )


def belief_of(spindle: Spindle) -> Belief:
    """Return the data of a spindle that the estimator uses."""
    return Belief(
        torque_constant=float(spindle.torque_constant),
        idle_constant=float(spindle.idle[0]),
        idle_slope=float(spindle.idle[1]),
        inertia=float(spindle.inertia),
        sensor_lag=float(spindle.sensor_lag),
        smoothing=float(spindle.smoothing),
    )


def _drive(real: Spindle, drift: float) -> _plant.SpindleDrive:
    return _plant.SpindleDrive(
        speed=float(real.speed),
        inertia=float(real.inertia),
        torque_constant=float(real.torque_constant),
        idle_constant=float(real.idle[0]),
        idle_slope=float(real.idle[1]),
        idle_drift=float(drift),
        stiffness=float(real.stiffness),
        reset=float(real.reset),
        most_current=float(real.most_current),
        current_step=float(real.current_step),
        sensor_lag=float(real.sensor_lag),
    )


def comparison(constant: float, controller: Override) -> dict[str, tuple[Override, bool]]:
    """Return the compared controllers, and whether each has the model: constant, pi, fuzzy, fuzzy_feedforward.

    ``constant``: override of the constant one. The others are ``controller`` with another kind.
    """
    fixed = replace(controller, kind="fixed", start=constant, floor=min(controller.floor, constant), quantum=0.0)
    return {
        "constant": (fixed, False),
        "pi": (replace(controller, kind="pi"), False),
        "fuzzy": (replace(controller, kind="mamdani"), False),
        "fuzzy_feedforward": (replace(controller, kind="mamdani"), True),
    }


def _on_rows(profile: TorqueProfile, s: Floats) -> TorqueProfile:
    """Return the profile with additional rows at ``s``."""
    rows = np.union1d(profile.s, s)
    return TorqueProfile(rows, *(np.interp(rows, profile.s, x) for x in (profile.feed, profile.edge, profile.cut)))
