"""The client of HAL: a process of the system's Python that owns the pins and exchanges lines of text.

LinuxCNC's modules are built for one Python, which is seldom the one that chipload runs in. So nothing of them is
imported here: :mod:`chipload.control.linuxcnc.pins` is run by that Python, and numbers go through its pipes.
"""

from __future__ import annotations

import json
import math
import select
import subprocess
from collections.abc import Mapping
from importlib import resources
from types import TracebackType
from typing import NamedTuple, Protocol

from chipload.control.override import STATUS
from chipload.errors import InputError

#: name, type, direction of the pins; lengths in machine units, which must be mm, torque in N m, velocity in mm/s;
#: `load` is the torque in percent of the limit that is held, one pin `why-...` is on; `spindle-override` is 1, or that
#: of the pin that `spindle-override-in` is read from; each has a signal `<component>-<pin>`
PINS: tuple[tuple[str, str, str], ...] = (
    ("feed", "float", "out"),
    ("beat", "bit", "out"),
    ("torque", "float", "out"),
    ("status", "s32", "out"),
    ("s", "float", "out"),
    ("limit", "float", "out"),
    ("load", "float", "out"),
    ("spindle-override", "float", "out"),
    *((f"why-{status}", "bit", "out") for status in STATUS),
    ("x", "float", "in"),
    ("y", "float", "in"),
    ("z", "float", "in"),
    ("velocity", "float", "in"),
    ("torque-in", "float", "in"),
    ("feed-in", "float", "in"),
    ("current-in", "float", "in"),
    ("speed-in", "float", "in"),
    ("spindle-override-in", "float", "in"),
    ("line-in", "s32", "in"),
)


class PinValues(NamedTuple):
    """What the in pins read: time [s], position [mm], velocity on the path [mm/s], torque [N m], override in effect,
    current of the spindle [A] and its speed [rev/s], as LinuxCNC's `spindle.0.speed-in`, spindle override in effect,
    line of the program that runs.
    """

    time: float
    x: float
    y: float
    z: float
    velocity: float
    torque: float
    feed: float
    current: float = math.nan
    speed: float = math.nan
    spindle_override: float = 1.0
    line: float = 0.0


class ControlledMachine(Protocol):
    """A machine that accepts a feed override and reports its position."""

    def exchange(self, feed: float, beat: bool, torque: float, status: int, s: float, limit: float) -> PinValues | None:
        """Set the out pins, read the in pins; None: the machine is gone.

        ``torque`` is what the controller receives, 0 without a reading, ``limit`` what it holds at this place [N m].
        """


class HalPins:
    """The component in HAL, to be used in a ``with``.

    Parameters
    ----------
    name : of the component
    python : interpreter that has the module `hal`
    answer_s : longest wait for an answer [s]
    sources : for an in pin the pin or signal in HAL whose value is taken instead, connected or not

    Raises
    ------
    InputError
        There is no such interpreter, it has no `hal`, or HAL does not take the component.
    """

    def __init__(
        self,
        name: str,
        python: str = "/usr/bin/python3",
        answer_s: float = 5.0,
        sources: Mapping[str, str] | None = None,
    ) -> None:
        script = resources.files("chipload.control.linuxcnc") / "pins.py"
        self._answer_s = answer_s
        self._follows_override = "spindle-override-in" in (sources or {})
        self._spindle_override = 1.0
        try:
            self._process = subprocess.Popen(
                [python, "-I", str(script)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                text=True, bufsize=1, start_new_session=True,
            )  # fmt: skip
        except OSError as err:
            raise InputError(f"--python = {python}: cannot be run: {err.strerror}") from None
        signals = {pin: f"{name}-{pin}" for pin, _, _ in PINS}
        answer = self._line(
            json.dumps({"name": name, "pins": PINS, "signals": signals, "sources": dict(sources or {})})
        )
        if answer != "ready":
            self._process.kill()
            why = (self._process.communicate()[1].strip().splitlines() or ["no answer"])[-1]
            raise InputError(f"hal component {name}: not taken: {why}: start LinuxCNC first, with its own Python")

    def exchange(self, feed: float, beat: bool, torque: float, status: int, s: float, limit: float) -> PinValues | None:
        """Set the out pins, read the in pins; None: the component is gone."""
        load = 100.0 * torque / limit if limit > 0.0 else 0.0
        why = " ".join(str(int(k == status)) for k in range(len(STATUS)))
        spindle = self._spindle_override
        answer = self._line(f"{feed!r} {int(beat)} {torque!r} {status} {s!r} {limit!r} {load!r} {spindle!r} {why}")
        words = answer.split() if answer is not None else []
        if len(words) != len(PinValues._fields):
            return None
        seen = PinValues(*map(float, words))
        if self._follows_override and math.isfinite(seen.spindle_override):
            self._spindle_override = seen.spindle_override
        return seen

    def _line(self, text: str) -> str | None:
        stdin, stdout = self._process.stdin, self._process.stdout
        if stdin is None or stdout is None:
            return None
        try:
            stdin.write(text + "\n")
            stdin.flush()
        except OSError:
            return None
        if not select.select([stdout], [], [], self._answer_s)[0]:
            return None
        return stdout.readline().rstrip("\n") or None

    def __enter__(self) -> HalPins:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        process = self._process
        try:
            if process.stdin is not None:
                process.stdin.close()
        except OSError:
            pass
        try:
            process.wait(5.0)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        for stream in (process.stdout, process.stderr):
            if stream is not None:
                stream.close()
