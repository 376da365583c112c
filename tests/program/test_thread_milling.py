"""Thread mills: the rise of their helix against their pitch. Oracle: rise over turns, by hand."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from chipload.cutter.cutter import Cutter
from chipload.cutter.shapes import thread_mill
from chipload.machine.machine import machine_named
from chipload.program.read import read_program
from chipload.program.thread_milling import thread_milling_findings

MILL = Cutter(
    8.0, 3, 0.2, 1.5, 40.0, 6e5, shape=thread_mill(8.0, 1.5, math.radians(30.0), 0.1875, 5.0), shank_diameter=5.0,
    thread_pitch=1.5, number=3,
)  # fmt: skip
HEAD = "G21 G90 G94 G17 G54\nT3 M6\nS4000 M3\nG0 X0. Y0.\nG43 H3 Z5.\nG0 Z-10.\n"
#: a lead-in of a quarter with a rise of its own, the thread, the end
FULL = "G3 X2. Y0. Z-9.9 I1. J0. F200.\nG3 X2. Y0. Z{top} I-2. J0.\nG3 X0. Y0. Z-7. I-1. J0.\nG0 Z5.\nM30\n"
#: the same in quarters
QUARTERS = (
    "G1 X2. F200.\nG3 X0. Y2. Z-9.525 I-2. J0.\nX-2. Y0. Z-9.15 I0. J-2.\nX0. Y-2. Z-8.775 I2. J0.\n"
    "X2. Y0. Z{top} I0. J2.\nG0 X0. Y0.\nG0 Z5.\nM30\n"
)


@pytest.mark.parametrize(
    ("body", "pitch"),
    [
        (FULL.format(top="-8.4"), None),
        (FULL.format(top="-8.65"), 1.25),
        (QUARTERS.format(top="-8.5"), None),
        (QUARTERS.format(top="-8.4"), 1.6),
    ],
)
def test_a_helix_rises_by_the_pitch_of_the_thread_mill(tmp_path: Path, body: str, pitch: float | None) -> None:
    (tmp_path / "a.nc").write_text(HEAD + body)
    program = read_program(tmp_path / "a.nc", machine_named("vmc")).program
    found = thread_milling_findings(program, {3: MILL})
    if pitch is None:
        assert found == ()
    else:
        assert [f.code for f in found] == ["thread-pitch"]
        assert f"a pitch of {pitch:g} mm" in found[0].text
        assert "is 1.5 mm" in found[0].text


def test_other_cutters_may_rise_as_they_like(tmp_path: Path) -> None:
    (tmp_path / "a.nc").write_text(HEAD + FULL.format(top="-8.65"))
    program = read_program(tmp_path / "a.nc", machine_named("vmc")).program
    assert thread_milling_findings(program, {3: Cutter(8.0, 3, 0.5, 20.0, 40.0, 6e5, number=3)}) == ()
