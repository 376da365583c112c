"""Our time of a program on the machine of the counted servo cycles."""

from __future__ import annotations

import tempfile
from pathlib import Path

from chipload.machine.ini import read_ini
from chipload.machine.machine import Machine
from chipload.program.program import DWELL
from chipload.program.read import read_program, times_of
from cycle_counts.cycles import ini_text


def machine_of(letters: str) -> Machine:
    """The machine of :func:`cycle_counts.cycles.ini_text`."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "headless.ini"
        path.write_text(ini_text(letters))
        (Path(folder) / "headless.hal").write_text("")
        return read_ini(path)[0]


def cycles_of(text: str, machine: Machine) -> float:
    """Servo cycles of 1 ms in which the axes move, dwells not counted."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "program.ngc"
        path.write_text(text)
        reading = read_program(path, machine)
    seconds = times_of(reading, machine)
    return float(1e3 * seconds[reading.program.motion != DWELL].sum())
