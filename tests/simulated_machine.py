"""A machine for the controller beside LinuxCNC: its path, its axes, its controller."""

from __future__ import annotations

import math

import numpy as np

from chipload.control.fuzzy import standard
from chipload.control.hal import HalJob
from chipload.control.linuxcnc.hal_client import PinValues
from chipload.control.linuxcnc.path import tool_path
from chipload.control.override import Override
from chipload.control.spindle_model import Spindle

SPINDLE = Spindle(628.0, 5.0, 300.0, (2.0, 0.004), 0.5, 5.0, 60.0, 0.01, 0.02, 0.05)
RULES = Override(
    kind="mamdani",
    torque_ref=1860.0,
    overload=4000.0,
    torque_most=18e3,
    light=80.0,
    floor=0.05,
    cap=1.0,
    start=0.3,
    air_override=0.4,
    lost_override=0.2,
    lost_s=1.0,
)
FEED, ACCELERATION, PERIOD = 20.0, 500.0, 0.01


def round_path(turns=1.0, radius=25.0, surprise=1.3):
    """A helix with steps of torque; what is true is heavier between 60 and 100 mm."""
    length = turns * math.tau * radius
    n = int(length / 0.25)
    a = np.linspace(0.0, turns * math.tau, n + 1)
    points = np.column_stack([radius * np.cos(a), radius * np.sin(a), -0.5 * a / math.tau])
    s = a * radius
    depth = np.interp(s, [0, 5, 10, 40, 42, 80, 82, 150, 152], [0, 0, 1900, 1900, 3900, 3900, 1400, 1400, 2600])
    heavier = 1.0 + (surprise - 1.0) * np.clip(np.minimum(s - 60.0, 110.0 - s) / 10.0, 0.0, 1.0)
    model = np.column_stack([0.15 * depth, 0.85 * depth])
    return tool_path(points, np.full(n + 1, FEED), model, model * np.column_stack([heavier, heavier]))


PATH = round_path()
JOB = HalJob(PATH, RULES, standard(), "plant", SPINDLE, ACCELERATION, PERIOD, 0.0, True, 5.0, 0.5)


class Simulated:
    """A machine with axes that accelerate, whose time is its own; a step of a period each exchange."""

    def __init__(self, path, gone_after=10**9, torque=math.nan):
        self.path, self.t, self.s, self.v, self.left, self.torque = path, 0.0, 0.0, 0.0, gone_after, torque
        self.sent, self.said = [], []

    def exchange(self, feed, beat, torque, status, s, limit):
        self.left -= 1
        if self.left < 0:
            return None
        for _ in range(10):
            goal, most = feed * FEED, ACCELERATION * 0.1 * PERIOD
            self.v = min(goal, self.v + most) if goal > self.v else max(goal, self.v - most)
            self.s = min(self.s + self.v * 0.1 * PERIOD, float(self.path.model.s[-1]))
        if self.s == self.path.model.s[-1]:
            self.v = 0.0
        self.t += PERIOD
        self.sent.append((feed, beat))
        self.said.append((torque, status, s))
        at = [float(np.interp(self.s, self.path.model.s, x)) for x in self.path.points.T]
        return PinValues(self.t, *at, self.v, self.torque, feed)
