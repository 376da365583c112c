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
    noise_of_samples: np.ndarray


def short_program(rng: np.random.Generator, lines: int = 120) -> PredictedTorque:
    """Return cuts of 0.3 to 1.5 s in lines that begin and may end in the air, with lines of air between them; of one
    kind, as in a pattern of slots, with a width and depth that differ by a third.
    """
    speed = rng.choice([6000.0, 8000.0, 10000.0]) * 2.0 * np.pi / 60.0
    cutting, edge = 800.0 * rng.uniform(0.5, 2.0), 800.0 * rng.uniform(0.2, 0.8)
    rows, time = [(4.0, speed, 0.0, 0.0, 1, 1)], 4.0
    for k in range(lines):
        size = rng.uniform(0.8, 1.2)
        steps = [(rng.uniform(0.2, 1.5), 0.0)] if k % 2 else [
            (rng.uniform(0.05, 0.5), 0.0), *[(rng.uniform(0.06, 0.3), size)] * 5, (rng.choice([0.01, 0.2]), 0.0)
        ]  # fmt: skip
        for seconds, cuts in steps:
            time += seconds
            rows.append((time, speed, cuts * cutting, cuts * edge, k + 2, 1))
    t, w, c, e, line, tool = np.array(rows).T
    return PredictedTorque(t, w, c, e, line.astype(np.int64), tool.astype(np.int64))


def stream(seed: int, truth: Truth | None = None, *, short: bool = False) -> Stream:
    """The power of a cell that is drawn from the prior, with the clock of the machine; no wear; ``short``: of a program
    whose cuts are short.
    """
    rng = np.random.default_rng(seed)
    own = truth or draw_truth(rng)
    program = short_program(rng) if short else closed_form_program(rng)
    rate, lag = rng.uniform(0.95, 1.1), rng.uniform(2.0, 10.0)
    time = np.arange(0.0, lag + rate * program.time[-1], 0.1)
    row = np.searchsorted(program.time, (time - lag) / rate).clip(0, len(program.time) - 1)
    runs = time >= lag
    torque = np.where(runs, own.cutting * program.cutting[row] + own.edge * program.edge[row], 0.0)
    idle = rng.uniform(1e5, 4e5)
    power = idle + own.gain / EFFICIENCY * torque * program.speed[0]
    noise = rng.uniform(0.01, 0.05) * float(power.max())
    scatter = noise * rng.standard_normal(len(time))
    power = power + scatter
    # the log of a short program states its lines early or late
    late = rng.uniform(-0.1, 0.1) if short else 0.0
    stated = np.searchsorted(program.time, (time - lag - late) / rate).clip(0, len(program.time) - 1)
    line = np.where(runs, program.line[stated], 0)
    # before the program the first line is called up, and waits
    line[~runs] = 0
    return Stream(program, time, power, line, row, runs & (torque > 0.0), noise, idle, scatter)


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


def without_cuts(one: Stream, count: int | None) -> tuple[np.ndarray, float] | None:
    """Return the power where so many lines after the middle cut nothing (None: all the rest), and when that begins."""
    lines = np.unique(one.line[one.cuts & (one.time > 0.5 * one.time[-1])])[:count]
    if not len(lines):
        return None
    own = one.cuts & np.isin(one.line, lines)
    load = np.where(own, one.power - one.idle - one.noise_of_samples, 0.0)
    return one.power - load, float(one.time[own][0])
