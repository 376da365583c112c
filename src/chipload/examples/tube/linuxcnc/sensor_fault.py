"""A simulated spindle beside LinuxCNC, whose sensor fails at a place of the path.

It follows the machine's real place and velocity with the true cut of the job, and puts its current and speed on pins,
which `chipload hal --current-pin sensor.current --speed-pin sensor.speed` reads as those of a drive.
"""

from __future__ import annotations

import math
import subprocess
import threading
import time
from pathlib import Path

import numpy as np

from chipload.control.hal import HalJob
from chipload.control.linuxcnc.path import locate
from chipload.control.linuxcnc.simulated_spindle import Load, advance, at_speed, read_current

#: what the sensor reads from the fault on: 0; no number; its last value; more or less by :data:`DRIFT_A`, which grows
FAULTS = ("lost", "nan", "stuck", "drift-up", "drift-down")
#: pins for the controller
PINS = ("--current-pin", "sensor.current", "--speed-pin", "sensor.speed")
#: drift [A] and the time in which it grows [s]
DRIFT_A, DRIFT_S = 0.1, 2.0
PERIOD_S, SUBSTEP_S = 0.005, 0.001


class SensorWithFault:
    """The sensor, to be used in a ``with`` while LinuxCNC runs; ``at`` is the time of the fault [s], None before it."""

    def __init__(self, job: HalJob, fault: str, place: float, python: str = "/usr/bin/python3") -> None:
        self.job, self.fault, self.place = job, fault, place
        self.at: float | None = None
        script = Path(__file__).parent / "sensor.py"
        self._process = subprocess.Popen(
            [python, "-I", str(script)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, bufsize=1
        )
        self._ends = threading.Event()
        self._thread = threading.Thread(target=self._follow, daemon=True)
        self._idle = job.spindle.idle[0] + job.spindle.idle[1] * job.spindle.speed
        self._exchange(self._idle, job.spindle.speed)

    def __enter__(self) -> SensorWithFault:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._ends.set()
        self._thread.join(5.0)
        if self._process.stdin is not None:
            self._process.stdin.close()
        self._process.wait(5.0)

    def _exchange(self, current: float, speed: float) -> list[float]:
        if self._process.stdin is None or self._process.stdout is None:
            return []
        self._process.stdin.write(f"{current!r} {speed / math.tau!r} 0.0\n")
        return [float(x) for x in self._process.stdout.readline().split()]

    def _follow(self) -> None:
        """Spindle and sensor, step by step, until the end."""
        job, s, last = self.job, 0.0, None
        real, noise = job.deviation.applied(job.spindle), np.random.default_rng(1)
        state, read, none = at_speed(real), self._idle, Load(0.0, 0.0)
        before, on = none, False
        while not self._ends.is_set():
            row = self._exchange(read, state.speed)
            if len(row) != 6:
                return
            now, place, velocity = row[0], row[1:4], row[4]
            found, away = locate(job.path, tuple(place), s, job.window if on else math.inf)
            on = away <= job.away
            s = found if on else s
            load = self._load(s, velocity) if on and velocity > 0.0 else none
            if last is not None and now > last:
                state, _ = advance(real, state, (before, load), (none, none), now - last, SUBSTEP_S)
            last, before = now, load
            if self.at is None and s >= self.place:
                self.at = now
            sound = read_current(real, state, float(noise.normal(0.0, real.noise)))
            read = sound if self.at is None else self._failed(sound, read, now - self.at)
            time.sleep(PERIOD_S)

    def _failed(self, sound: float, last: float, since: float) -> float:
        """What the sensor reads after its fault."""
        drift = DRIFT_A * min(since / DRIFT_S, 1.0)
        return {
            "lost": 0.0, "nan": math.nan, "stuck": last, "drift-up": sound + drift, "drift-down": sound - drift
        }[self.fault]  # fmt: skip

    def _load(self, s: float, velocity: float) -> Load:
        truth, model = self.job.path.truth, self.job.path.model
        share = velocity / float(np.interp(s, model.s, model.feed))
        edge, cut = (float(np.interp(s, truth.s, x)) for x in (truth.edge, truth.cut))
        return Load(edge, cut * share)
