"""Synthetic logs of a milling cell: programs in closed form; coefficients, wear, clock and noise are drawn."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from chipload.control.learning import TORQUE_ERROR, WEAR_SCALE_S, Signal, SignalKind
from chipload.control.log_alignment import PredictedTorque, align_log
from chipload.control.log_blocks import LogBlocks, blocks_of
from chipload.control.logs import SpindleLog
from chipload.cutting.material import material_named

PRIOR = material_named("al7075-t6")
RADIUS, TEETH, EFFICIENCY, GAIN_ERROR = 5.0, 4, 0.85, 0.05
#: power of a spindle whose efficiency is known to GAIN_ERROR
SIGNAL = Signal(SignalKind.POWER, 1.0 / EFFICIENCY, GAIN_ERROR)


@dataclass(frozen=True)
class Truth:
    """What a cell is: coefficients over the prior ones, gain over the stated one, wear a second of cutting."""

    cutting: float
    edge: float
    gain: float
    wear: float


def closed_form_program(rng: np.random.Generator, lines: int = 60) -> PredictedTorque:
    """Return straight cuts and air of an end mill: mean torque Ktc ae ap f_z N / (2 pi) + Kte N ap R phi / (2 pi)."""
    speed = rng.choice([6000.0, 8000.0, 10000.0]) * 2.0 * np.pi / 60.0
    rows, time = [], 0.0
    for k in range(lines):
        seconds, air = rng.uniform(1.0, 5.0), rng.random() < 0.35
        ae, ap, fz = rng.uniform(0.5, 10.0), rng.uniform(1.0, 6.0), rng.uniform(0.02, 0.12)
        phi = np.arccos(1.0 - ae / RADIUS)
        cutting = 0.0 if air else PRIOR.Ktc * ae * ap * fz * TEETH / (2.0 * np.pi)
        edge = 0.0 if air else PRIOR.Kte * TEETH * ap * RADIUS * phi / (2.0 * np.pi)
        for _ in range(10):
            time += seconds / 10.0
            rows.append((time, speed, cutting, edge, k + 1, 1))
    t, w, c, e, line, tool = np.array(rows).T
    return PredictedTorque(t, w, c, e, line.astype(np.int64), tool.astype(np.int64))


def draw_truth(rng: np.random.Generator) -> Truth:
    """Return a cell from the prior; coefficients below a tenth of the prior ones are drawn again."""
    while True:
        k = rng.multivariate_normal(PRIOR.coefficients, PRIOR.variances)
        if k[0] > 0.1 * PRIOR.Ktc and k[3] > 0.1 * PRIOR.Kte:
            wear = rng.standard_normal() / WEAR_SCALE_S
            return Truth(k[0] / PRIOR.Ktc, k[3] / PRIOR.Kte, 1.0 + GAIN_ERROR * rng.standard_normal(), wear)


def power_log(
    rng: np.random.Generator, truth: Truth, program: PredictedTorque, before: float, idle: tuple[float, float]
) -> SpindleLog:
    """Return a log of the power [N mm/s] every 0.1 s, with its own clock, an idle power of the day, a sensor that
    filters it by up to 0.3 s, and noise.
    """
    error = TORQUE_ERROR * rng.standard_normal()
    lag, rate = rng.uniform(2.0, 20.0), rng.uniform(0.95, 1.2)
    kept = math.exp(-0.1 / rng.uniform(0.01, 0.3))
    t = np.arange(0.0, program.time[-1] * rate + lag + 5.0, 0.1)
    place = (t - lag) / rate
    row = np.minimum(np.searchsorted(program.time, place), len(program.time) - 1)
    running = (place >= 0.0) & (place < program.time[-1])
    cut = before + np.cumsum(np.where(program.cutting > 0.0, np.diff(program.time, prepend=0.0), 0.0))
    torque = truth.cutting * program.cutting + truth.edge * (1.0 + truth.wear * cut) * program.edge
    gain = truth.gain * (1.0 + error) / EFFICIENCY
    power = idle[0] * (1.0 + 0.02 * rng.standard_normal()) + idle[1] * program.speed[0]
    cut = np.where(running, gain * program.speed[row] * torque[row], 0.0)
    for k in range(1, len(cut)):
        cut[k] += kept * (cut[k - 1] - cut[k])
    power = power + cut
    return SpindleLog(t, power=power + rng.standard_normal(len(t)) * rng.uniform(0.01, 0.05) * power.max())


def cell(seed: int, logs: int = 3) -> tuple[list[LogBlocks], Signal, Truth]:
    """Return the blocks of the logs of a cell, what they measure, and the truth."""
    rng = np.random.default_rng(seed)
    truth = draw_truth(rng)
    idle = (rng.uniform(1e5, 4e5), rng.uniform(0.0, 400.0))
    out, before = [], 0.0
    for k in range(logs):
        program = closed_form_program(rng)
        log = power_log(rng, truth, program, before, idle)
        assert log.power is not None
        out.append(blocks_of(align_log(f"log {k}", log, log.power, program), program, {1: before}))
        before += program.cut_seconds[1]
    return out, SIGNAL, truth
