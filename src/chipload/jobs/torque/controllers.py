"""The controllers that are compared on one path: constant, model, PI, fuzzy, fuzzy with the model.

All of them run in the same real process: the real cut, and the real spindle, which differ from the plan by what the job
states. `constant` and `model` are as fast as they can be with hindsight: the greatest constant override, and the
schedule of the model with the greatest torque, at which the real process keeps the limit. A rule tunes the PI
controller.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from chipload.control import plant
from chipload.control.fuzzy import FuzzyTable
from chipload.control.ideal import ideal_time, pi_tuning
from chipload.control.linuxcnc.path import ToolPath
from chipload.control.override import Override
from chipload.control.plant import Loop, comparison
from chipload.control.spindle_model import Spindle, SpindleDeviation
from chipload.control.wall import WallPath, wall_error
from chipload.jobs.torque.job import TorqueJob
from chipload.jobs.torque.outcome import MODEL, MODEL_FULL, PLAIN, ControllerCase, ControllerRun
from chipload.jobs.torque.spindle import deviation_of, wrong_side
from chipload.jobs.torque.step_checks import feed_ratio
from chipload.progress import Progress

#: a schedule or a constant feed is lowered so often until the spindle's droop is in it
DROOPS = 8
#: the torque that the derated schedule is planned with is at most so many limits, and is halved in so often
DERATED_MOST, HALVINGS = 2.0, 12

Play = Callable[[Override, bool], ControllerRun]


def controller_of(job: TorqueJob, torque: float) -> Override:
    """Controller of the job for a torque limit [N mm]; its PI gains are 0 where a rule is to find them."""
    t: dict[str, Any] = job.table.torque_control.override.model_dump()
    hold = t.pop("hold")
    overload = 1e3 * t["overload_nm"]
    if overload < hold * torque:
        raise wrong_side("overload_nm", overload, hold * torque)
    newton_mm = {k: 1e3 * t.pop(f"{k}_nm") for k in ("overload", "torque_most", "light")}
    plain: dict[str, Any] = {k.removesuffix("_per_s"): 0.0 if v is None else v for k, v in t.items()}
    return Override(kind="mamdani", torque_ref=hold * torque, quantum=0.0, **newton_mm, **plain)


def tune_controller(job: TorqueJob, config: Override, path: ToolPath, spindle: Spindle, loop: Loop) -> Override:
    """The controller with PI gains by the rule, for the heaviest cut of the model, unless the job states them."""
    override_table = job.table.torque_control.override
    gain = float(path.over_relief.cut.max()) / config.torque_ref
    lag = max(spindle.sensor_lag + spindle.smoothing, loop.period)
    found = pi_tuning(gain, lag, loop.latency + loop.period) if gain > 0.0 else (config.pi_gain, config.pi_rate)
    return replace(
        config,
        pi_gain=found[0] if override_table.pi_gain is None else override_table.pi_gain,
        pi_rate=found[1] if override_table.pi_rate_per_s is None else override_table.pi_rate_per_s,
    )


def cases_of(
    job: TorqueJob, path: ToolPath, controller: Override, table: FuzzyTable, spindle: Spindle, torque: float,
    walls: tuple[WallPath, ...], acceleration: float, progress: Progress,
) -> tuple[ControllerCase, ...]:  # fmt: skip
    """Every controller, first without latency and then with the latency that the job states."""
    loop_table = job.table.loop
    period = 1e-3 * loop_table.period_ms
    out = []
    for k, (latency, quantum) in enumerate(((0.0, 0.0), (1e-3 * loop_table.latency_ms, loop_table.override_step))):
        loop = Loop(acceleration, period, latency, min(1e-3, period), seed=loop_table.seed)
        config = tune_controller(job, replace(controller, quantum=quantum), path, spindle, loop)
        runs = compare_controllers(
            path, config, player(path, table, spindle, deviation_of(job), loop, torque, walls), torque
        )
        out.append(ControllerCase(loop, quantum, runs))
        progress(0.75 + 0.05 * k, "controllers")
    return tuple(out)


def player(
    path: ToolPath, table: FuzzyTable, spindle: Spindle, deviation: SpindleDeviation, loop: Loop, torque: float,
    walls: tuple[WallPath, ...],
) -> Play:  # fmt: skip
    """Function that runs one controller in the real process, with or without the model."""

    def play(override: Override, modelled: bool) -> ControllerRun:
        model = path.model if modelled else None
        found = plant.run(
            path.truth, model, override, table, spindle, loop, torque, relief=path.relief, monitor=path.model,
            deviation=deviation,
        )  # fmt: skip
        error, stress, bent, *workpiece = (wall_error(w, path.model, found, spindle.speed) for w in walls)
        return ControllerRun(
            override, modelled, found, error, stress, bent, feed_ratio(path.model, found, spindle.speed), *workpiece
        )

    return play


def compare_controllers(path: ToolPath, config: Override, play: Play, torque: float) -> dict[str, ControllerRun]:
    """Runs of every controller by its name."""
    runs: dict[str, ControllerRun] = {}
    for name, (override, modelled) in comparison(_constant(path, config, torque, play), config).items():
        runs[name] = play(override, modelled)
        if name == PLAIN:
            # their override follows the model, nothing is measured
            runs[MODEL] = _derate_schedule(config, torque, play)
            runs[MODEL_FULL] = play(replace(config, kind="fixed"), True)
    return runs


def shortest(path: ToolPath, config: Override, torque: float, acceleration: float) -> float:
    """Time with the feed at the limit at every instant [s]; inf where the limit cannot be kept."""
    return ideal_time(path.truth, torque, path.relief, config.cap, acceleration)


def _constant(path: ToolPath, config: Override, torque: float, play: Play) -> float:
    """The greatest constant override that respects the limit everywhere, the droop of the spindle and all."""
    t, cuts = path.truth, path.truth.cut > 0.0
    most = (torque * path.relief - t.edge)[cuts] / t.cut[cuts]
    value = min(float(most.min(initial=np.inf)), config.cap)
    if value <= 0.0:
        return config.floor
    for _ in range(DROOPS):
        found = play(comparison(value, config)[PLAIN][0], False).outcome.load_max
        if found <= torque:
            break
        value *= torque / found
    return value


def _derate_schedule(config: Override, torque: float, play: Play) -> ControllerRun:
    """The feed schedule of the model, planned with the greatest torque at which it respects the limit in truth."""
    low, high = config.light, DERATED_MOST * torque
    best = None
    for _ in range(HALVINGS):
        planned = 0.5 * (low + high)
        rules = replace(
            config, kind="fixed", torque_ref=planned, overload=max(config.overload, 1.5 * planned),
            torque_most=max(config.torque_most, 2.0 * planned),
        )  # fmt: skip
        run = play(rules, True)
        if run.outcome.load_max <= torque:
            low, best = planned, run
        else:
            high, best = planned, best or run
    return best or play(replace(config, kind="fixed"), True)
