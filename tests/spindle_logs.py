"""Logs of a simulated spindle, summed in steps that the identification knows nothing of."""

from __future__ import annotations

import csv
import math

import numpy as np

#: K_T [N m/A], J [kg m2], idle [A], [A s], lag of the sensor, noise [A], step [A]
KT, INERTIA, IDLE, LAG, NOISE, STEP = 0.335, 6e-4, (0.12, 2e-4), 0.02, 0.01, 0.005
DT, FINE = 0.01, 20
EFFICIENCY = 0.8


def spindle_log(path, seed, torques, drift=0.0, kind="current", speeds=(400.0, 628.0), names=None):
    """The log of a spindle that speeds up, cuts with several torques [N m], changes its speed and cuts again.

    Integrated in steps of DT / FINE, which the identification knows nothing of.
    """
    rng = np.random.default_rng(seed)
    seconds = 3.0 + 2.0 * len(torques)
    t = np.arange(0.0, 2.0 * seconds, DT / FINE)
    speed = np.interp(t, [0.0, 1.5, seconds, seconds + 1.0, 2.0 * seconds], [20.0, *np.repeat(speeds, 2)])
    inside = t % seconds
    which = np.clip(((inside - 2.5) // 2.0).astype(int), 0, len(torques) - 1)
    cutting = (inside > 2.5) & ((inside - 2.5) % 2.0 < 1.2) & (inside < 2.5 + 2.0 * len(torques))
    torque = np.where(cutting, np.asarray(torques)[which], 0.0)
    idle = IDLE[0] * (1.0 + drift * t / t[-1]) + IDLE[1] * speed
    current = idle + (torque + INERTIA * np.gradient(speed, t)) / KT
    if kind == "power":
        current = (KT * idle + torque + INERTIA * np.gradient(speed, t)) * speed / EFFICIENCY
    lagged = current.copy()
    for k in range(1, len(t)):
        lagged[k] = lagged[k - 1] + (current[k] - lagged[k - 1]) * (DT / FINE / LAG)
    keep = slice(None, None, FINE)
    scale = 60.0 if kind == "power" else 1.0
    read = lagged[keep] + rng.normal(0.0, NOISE * scale, len(t[keep]))
    if kind == "current":
        read = np.round(read / STEP) * STEP
    column = "power_w" if kind == "power" else "current_a"
    with path.open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(names or ["time_s", "speed_rpm", column, "torque_nm"])
        for row in zip(t[keep], speed[keep] * 60.0 / math.tau, read, torque[keep], strict=True):
            writer.writerow([f"{x:.6f}" for x in row])
    return path
