"""Synthetic streams of a spindle while a program runs, without a fault or with a known one."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from chipload.control.load_watch import LoadWatch
from chipload.control.log_alignment import PredictedTorque
from chipload.errors import Finding
from synthetic_cell import EFFICIENCY, PRIOR, SIGNAL, Truth, closed_form_program, draw_truth

#: alarm that each fault has to raise
FAULTS = ("watch-air", "watch-metal", "watch-more", "watch-tool")


@dataclass(frozen=True, eq=False)
class Stream:
    """Samples every 0.1 s of a cell: power, line, row of the program, and whether it cuts."""

    program: PredictedTorque
    time: np.ndarray
    power: np.ndarray
    line: np.ndarray
    row: np.ndarray
    cuts: np.ndarray
    noise: float
    idle: float


def stream(seed: int, truth: Truth | None = None) -> Stream:
    """The power of a cell that is drawn from the prior, with the clock of the machine; no wear."""
    rng = np.random.default_rng(seed)
    own = truth or draw_truth(rng)
    program = closed_form_program(rng)
    rate, lag = rng.uniform(0.95, 1.1), rng.uniform(2.0, 10.0)
    time = np.arange(0.0, lag + rate * program.time[-1], 0.1)
    row = np.searchsorted(program.time, (time - lag) / rate).clip(0, len(program.time) - 1)
    runs = time >= lag
    torque = np.where(runs, own.cutting * program.cutting[row] + own.edge * program.edge[row], 0.0)
    idle = rng.uniform(1e5, 4e5)
    power = idle + own.gain / EFFICIENCY * torque * program.speed[0]
    noise = rng.uniform(0.01, 0.05) * float(power.max())
    power = power + noise * rng.standard_normal(len(time))
    line = np.where(runs, program.line[row], 0)
    # before the program the first line is called up, and waits
    line[~runs] = 0
    return Stream(program, time, power, line, row, runs & (torque > 0.0), noise, idle)


def alarms_of(one: Stream, power: np.ndarray | None = None) -> tuple[list[Finding], LoadWatch]:
    """Return the alarms of a stream, and its watch."""
    watch = LoadWatch(one.program, SIGNAL, PRIOR)
    found: list[Finding] = []
    for t, p, line in zip(one.time, one.power if power is None else power, one.line, strict=True):
        found += watch.add(float(t), float(p), int(line))
    return [*found, *watch.end()], watch


def long_lines(one: Stream, cuts: bool) -> np.ndarray:
    """Lines of at least 3 s after the middle of the program that cut well, or are air."""
    out = []
    for k in np.unique(one.line[len(one.line) // 2 :]):
        own = one.line == k
        load = (one.power[own] - one.idle).mean()
        if own.sum() > 30 and (load > 0.3 * (one.power.max() - one.idle) if cuts else not one.cuts[own].any()):
            out.append(k)
    return np.array(out)


def with_fault(one: Stream, fault: str) -> tuple[np.ndarray, np.ndarray | None] | None:
    """Return the power with a fault, and the samples that have it (None: all).

    No stock in a line, a cut in a line of air, a load that doubles over the program, a tool of four times the load;
    None: the program has no line that is long enough.
    """
    cut = np.where(one.cuts, one.power - one.idle, 0.0)
    if fault == "watch-more":
        return one.power + cut * one.time / one.time[-1], None
    if fault == "watch-tool":
        return one.power + 3.0 * cut, None
    lines = long_lines(one, fault == "watch-air")
    if not len(lines):
        return None
    own = one.line == lines[0]
    more = -cut if fault == "watch-air" else 0.6 * float(np.quantile(cut, 0.95))
    return one.power + np.where(own, more, 0.0), own
