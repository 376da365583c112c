"""Comparison of the strategies of a contour at equal greatest force, and at equal time of the finish pass.

A strategy with a lower force at one feed can be faster at the first force. So each is calculated for the same path at
the feed f0 at which its greatest force is that of a reference, and at the f0 at which its finish pass takes as long as
that of the reference. Force and time come from the force model and from the speed that the machine reaches, as in the
plan.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from chipload.cutting.force import forces_along
from chipload.engagement.contact import PIECES
from chipload.machine.machine import Machine
from chipload.planning.contour.moves import Speeds, speeds
from chipload.planning.contour.sampled import SampledPass
from chipload.planning.contour.schedule import constant_force, step_feeds, within_machine
from chipload.planning.cost import CutConditions
from chipload.units import mm_min_from_mm_s

Floats = NDArray[np.float64]

#: f0 is searched between these multiples of the feed of the job, to this share of it
LOW, HIGH, CLOSE = 0.02, 10.0, 1e-3
#: steps of a finish pass at which a comparison calculates the force
ASKED = 300


@dataclass(frozen=True, eq=False)
class FinishPasses:
    """The sampled finish passes of a strategy; ``wanted`` a* [rad] where a feed schedule goes with it."""

    passes: Sequence[SampledPass]
    wanted: float | None


def programmed_feeds(
    steps: SampledPass, cut: CutConditions, feed: float, machine: Machine, wanted: float | None
) -> Floats:
    """Programmed feed of the steps of a pass [mm/s], (n,): f0, or its schedule where ``wanted`` is stated."""
    if wanted is None:
        return np.full(len(steps.s), feed)
    ideal = constant_force(cut, steps.engagement, feed, wanted)
    return step_feeds(within_machine(steps.s, ideal, machine.acceleration_xy, machine.jerk), feed)


def compare_strategies(
    finish: Mapping[str, FinishPasses], use: str, cut: CutConditions, feed: float, machine: Machine
) -> dict[str, dict[str, object]]:
    """Values `at_equal_force` and `at_equal_time` of each strategy, relative to the strategy ``use`` at ``feed``
    [mm/s].

    None where no feed from ``LOW`` to ``HIGH`` times that of the job does so: the edge force does not depend on the
    feed.
    """
    force, time = _force(finish[use], cut, machine, feed), _time(finish[use], cut, machine, feed)
    out: dict[str, dict[str, object]] = {}
    for name, run in finish.items():
        force_at, time_at = partial(_force, run, cut, machine), partial(_time, run, cut, machine)
        as_strong = _greatest(force_at, -force * (1.0 + 1e-9), -1.0, feed)
        as_long = feed if name == use else _greatest(time_at, time * (1.0 - 1e-9), 1.0, feed)
        out[name] = {
            "at_equal_force": None if as_strong is None else _row(as_strong, force_at(as_strong), time_at(as_strong)),
            "at_equal_time": None if as_long is None else _row(as_long, force_at(as_long), time_at(as_long)),
        }
    return out


def _speeds(run: FinishPasses, cut: CutConditions, feed: float, machine: Machine) -> list[Speeds]:
    """The speeds of each finish pass at f0 [mm/s]."""
    return [
        speeds(steps, programmed_feeds(steps, cut, feed, machine, run.wanted), machine) for steps in run.passes
    ]  # fmt: skip


def _time(run: FinishPasses, cut: CutConditions, machine: Machine, feed: float) -> float:
    """Time of the finish passes [s] at f0 [mm/s]."""
    return sum(
        float(np.diff(speed.time, prepend=0.0)[np.isin(steps.zone, ["finish", "closing"])].sum())
        for steps, speed in zip(run.passes, _speeds(run, cut, feed, machine), strict=True)
    )


def _force(run: FinishPasses, cut: CutConditions, machine: Machine, feed: float) -> float:
    """Greatest force in the plane [N] where the wall is made, at f0 [mm/s]."""
    force = 0.0
    for steps, speed in zip(run.passes, _speeds(run, cut, feed, machine), strict=True):
        k = np.flatnonzero(steps.zone == "finish")
        if not len(k):
            continue
        load = steps.engagement.angle[k] * speed.reached[k]
        spread = np.linspace(0, len(k) - 1, min(ASKED, len(k))).astype(np.int64)
        k = np.unique(np.concatenate([k[spread], k[[int(load.argmax()), int(steps.engagement.angle[k].argmax())]]]))
        met = steps.engagement
        loads = forces_along(
            met.phi[k, :, 0], met.phi[k, :, 1], cut.feed_per_tooth(speed.reached[k]), steps.heading[k], cut.cutter,
            cut.material, cut.axial_depth, spindle_speed=cut.spindle_speed, count=np.clip(met.count[k], 0, PIECES),
        )  # fmt: skip
        force = max(force, float(loads["force_xy_n"].max()))
    return force


def _greatest(value: Callable[[float], float], least: float, sign: float, feed: float) -> float | None:
    """The greatest f0 at which ``sign`` times a value is at least ``least``, as it is below it; None where it is so
    nowhere or everywhere.
    """
    low, high = LOW * feed, HIGH * feed
    if sign * value(low) < least or sign * value(high) >= least:
        return None
    if sign * value(feed) >= least:
        low = feed
    else:
        high = feed
    while high - low > CLOSE * feed:
        middle = 0.5 * (low + high)
        if sign * value(middle) >= least:
            low = middle
        else:
            high = middle
    return low


def _row(feed: float, force: float, time: float) -> dict[str, float]:
    return {"feed_mm_min": mm_min_from_mm_s(1.0) * feed, "force_xy_n": force, "finish_time_s": time}
