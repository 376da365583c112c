"""Time of programs beside LinuxCNC's own planner, in servo cycles: recorded ones of real programs, and live.

Live it takes some ten minutes in real time: with CHIPLOAD_LINUXCNC=1 only.
"""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from cycle_counts.clock import cycles_of, machine_of
from cycle_counts.cycles import hal_in_use, installed, servo_cycles
from cycle_counts.programs import REAL_FILES, digest, own_programs, real_programs, recorded

DATA = Path(os.environ.get("CHIPLOAD_DATA", Path(__file__).parents[3] / "shared" / "data"))
CLOSE = 0.03


@pytest.mark.parametrize("name", [p.name for p in REAL_FILES])
def test_recorded_cycles_of_real_programs(name):
    programs = real_programs(DATA)
    if name not in programs:
        pytest.skip(f"{name} is not in the data: set CHIPLOAD_DATA")
    letters, text = programs[name]
    known, cycles = recorded()[name]
    assert known == digest(text)
    assert cycles_of(text, machine_of(letters)) == pytest.approx(cycles, rel=CLOSE, abs=2.0)


@pytest.mark.skipif(not installed(), reason="linuxcnc is not installed: apt-get install linuxcnc-uspace")
@pytest.mark.skipif(
    os.environ.get("CHIPLOAD_LINUXCNC") != "1",
    reason="a controller in real time wants a machine to itself: set CHIPLOAD_LINUXCNC=1",
)
@pytest.mark.parametrize("letters", ["XYZ", "XYZAC"])
def test_live(letters):
    if hal_in_use():
        pytest.skip("a HAL is loaded on this machine, and there is room for one")
    programs = own_programs() | real_programs(DATA)
    some = [(name, text) for name, (axes, text) in programs.items() if axes == letters]
    for (name, text), cycles in zip(some, servo_cycles(some, letters), strict=True):
        assert cycles_of(text, machine_of(letters)) == pytest.approx(cycles, rel=CLOSE, abs=2.0), name
