"""The estimate of a simulation holds for the programs of docs/real_programs.md, whose times were measured."""

from __future__ import annotations

import re

import pytest

from chipload.cutter.table import cutter_from_table
from chipload.simulation.estimate import UPRIGHT, estimate, slowest_step

SHANK = {
    "number": 1,
    "flutes": 2,
    "helix_deg": 30.0,
    "flute_length_mm": 12.0,
    "overhang_mm": 30.0,
    "modulus_gpa": 580.0,
}
FLAT = {"diameter_mm": 6.35}
BALL = {"diameter_mm": 2.0, "corner_radius_mm": 1.0}
DRILL = {"diameter_mm": 12.0, "bottom_deg": 31.0}
ENGRAVER = {"diameter_mm": 0.01, "taper_deg": 45.0, "shank_diameter_mm": 6.35, "flute_length_mm": 3.175}
#: steps, processor time [s], cutter: of whole runs by moves on an upright axis
MEASURED = {
    "text": (1457, 6, FLAT),
    "compass": (5671, 9, FLAT),
    "heart": (3022, 9, FLAT),
    "botomata": (36421, 80, FLAT),
    "wave": (6912, 19, BALL),
    "cat": (8404, 21, BALL),
    "bear": (18220, 98, BALL),
    "Guincho_Lbar": (1554, 10, DRILL),
    "buildbotics": (5207, 76, ENGRAVER),
}


@pytest.mark.parametrize("name", MEASURED)
def test_measured_times_are_in_the_range_that_is_stated(name: str) -> None:
    steps, taken, shape = MEASURED[name]
    line = estimate(steps, 0, UPRIGHT, slowest_step(cutter_from_table(SHANK | shape)))
    found = re.search(r"memory, ([0-9]+) to ([0-9]+) (s|min)", line)
    assert found is not None
    unit = 60.0 if found[3] == "min" else 1.0
    assert float(found[1]) * unit <= taken <= float(found[2]) * unit
