"""New feeds of a drilled hole keep limits on the force and the torque that the chisel edge has its share of."""

from __future__ import annotations

from pathlib import Path

import pytest

import chipload

PROGRAM = """G21 G90 G17 G94
G54
T1 M6
G43 H1
S1000 M3
G0 X10 Y10 Z10
G0 Z2
G1 Z-8 F200
G0 Z10
M5
M2
"""
DRILL = {
    "number": 1, "diameter_mm": 6.0, "flutes": 2, "helix_deg": 30.0, "flute_length_mm": 40.0, "overhang_mm": 60.0,
    "modulus_gpa": 580.0, "bottom_deg": 31.0,
}  # fmt: skip


@pytest.mark.parametrize(("name", "limit"), [("force_n", 700.0), ("torque_nm", 1.5)])
def test_a_drill_goes_as_fast_as_its_limit_allows(tmp_path: Path, name: str, limit: float) -> None:
    """At 200 mm/min it has about 1,150 N and 2.5 N m: both are lowered to the limit, neither beyond nor far below."""
    (tmp_path / "p.ngc").write_text(PROGRAM)
    stock = {"low_mm": (0.0, 0.0, -10.0), "high_mm": (20.0, 20.0, 0.0), "layer_mm": 1.0}
    feeds = {"slowest_percent": 10.0, "fastest_percent": 100.0, "divide": False}
    operation = {"kind": "simulate", "step_mm": 2.0, "resolution_error": False, "feeds": feeds}
    done = chipload.optimise_feeds(
        program={"file": "p.ngc"}, stock=stock, machine="vmc", material="steel-1045-from-group-2", cutter=[DRILL],
        operation=operation, limits={name: limit}, checks={"confidence": 0.5, "chip_range": False}, folder=tmp_path,
    )  # fmt: skip
    check = next(c for c in done.result.limits if c.name == name)
    assert 0.95 * limit < check.worst <= limit
