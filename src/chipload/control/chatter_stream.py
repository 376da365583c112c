"""Samples of torque and speed as lines of text, and what is answered: sentences, or commands for LinuxCNC's halcmd.

LinuxCNC changes the speed of its spindle by ``halui.spindle.0.override``: with ``direct-value`` on, ``counts`` times
``scale`` is the override. A stop is ``halui.program.pause``.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

import numpy as np

from chipload.control.chatter import ChatterAnswer, ChatterGuard, ListeningRules, SpeedAnswer
from chipload.errors import InputError
from chipload.files import read_regular

#: largest summary [bytes]
LARGEST = 50_000_000
#: pins of LinuxCNC, and how many counts are an override of 1
OVERRIDE, PAUSE, COUNTS = "halui.spindle.0.override", "halui.program.pause", 1000


def quiet_speeds_of(path: Path, rpm: float | None = None) -> tuple[float, tuple[tuple[float, float], ...]]:
    """Programmed speed and quiet windows [rev/s] of a simulated program.

    Parameters
    ----------
    path : summary.json
    rpm : programmed speed [1/min]; None: that of the step nearest to chatter

    Raises
    ------
    InputError
        It is no summary, or no windows are in it.
    """
    try:
        found = json.loads(read_regular(path, path.name, LARGEST))
    except (json.JSONDecodeError, UnicodeDecodeError) as err:
        raise InputError(f"{path.name}: no JSON: {err}") from None
    operations = found.get("operations") if isinstance(found, dict) else None
    for operation in operations or ():
        stability = operation.get("stability") if isinstance(operation, dict) else None
        if stability and stability.get("windows") is not None and (rpm or stability.get("speed_rpm")):
            windows = tuple((w["low_rpm"] / 60.0, w["high_rpm"] / 60.0) for w in stability["windows"])
            return float(rpm or stability["speed_rpm"]) / 60.0, windows
    raise InputError(f"{path.name}: has no stability.windows: simulate the program with [dynamics] first")


def answers(
    lines: Iterable[str],
    rules: ListeningRules,
    programmed: float,
    windows: Sequence[tuple[float, float]],
    halui: bool = False,
) -> Iterator[tuple[ChatterAnswer, str]]:
    """Yield the answers to a stream of lines ``signal speed``, each with a line of output. Windows overlap by half;
    empty lines, and others than two numbers, as halsampler writes where samples were lost, start a new window.

    Parameters
    ----------
    halui : commands for halcmd, else sentences
    """
    guard = ChatterGuard(rules, programmed, windows)
    count, pending = rules.samples, []  # type: int, list[tuple[float, float]]
    if halui:
        begin = (f"scale {1.0 / COUNTS:g}", "direct-value 1", f"counts {COUNTS}", "count-enable 1")
        yield from ((ChatterAnswer.KEEP, f"setp {OVERRIDE}.{pin}") for pin in begin)
    for line in lines:
        sample = _sample(line)
        if sample is None:
            pending = []
            continue
        pending.append(sample)
        if len(pending) < count:
            continue
        signal, speed = np.array(pending).T
        answer = guard.answer(signal, np.abs(speed))
        pending = pending[count // 2 :] if answer.kind is ChatterAnswer.KEEP else []
        if answer.kind is not ChatterAnswer.KEEP:
            yield answer.kind, _line_of(answer, halui)
        if answer.kind is ChatterAnswer.STOP:
            return


def _sample(line: str) -> tuple[float, float] | None:
    """Signal and speed of a line; None: there are none."""
    words = line.split()
    try:
        values = [float(word) for word in words[-2:]]
    except ValueError:
        return None
    return (values[0], values[1]) if len(values) == 2 and all(map(math.isfinite, values)) else None


def _line_of(answer: SpeedAnswer, halui: bool) -> str:
    """Sentence, or command for halcmd, of a change of the speed or a stop."""
    if not halui:
        return answer.text
    if answer.kind is ChatterAnswer.SPEED:
        return f"setp {OVERRIDE}.counts {math.floor(COUNTS * answer.override)}"
    return f"setp {PAUSE} 1"
