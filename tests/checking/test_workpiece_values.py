"""[workpiece] from plain Python values, and the stress of a workpiece against its yield stress."""

from __future__ import annotations

import pytest

import chipload
from chipload.errors import InputError
from chipload.program.build import plunge, rapid
from chipload.program.program import Program
from chipload.result import Verdict

MILL = chipload.Cutter(
    number=1, diameter_mm=10, flutes=4, helix_deg=30, flute_length_mm=22, overhang_mm=30, modulus_gpa=580
)
WORKPIECE = {"modulus_gpa": 70.0, "poisson": 0.33, "states": 3, "clamps": (chipload.WorkpieceClamp(face="z-"),)}


def run(workpiece, **limits):
    """A wall of 3 mm, 16 mm high and 30 mm long, made 2.5 mm thin from one side."""
    path = [rapid([-8, -5, -8], 300.0, 1, "link"), plunge([38, -5, -8], 10.0, 600.0, 1, "cut")]
    block = chipload.Stock.block((0, -0.5, -18), (30, 2.5, 0), layer_mm=2.0)
    elastic = None if workpiece is None else chipload.Workpiece(**workpiece)
    return chipload.simulate(
        Program.join(path), block, MILL, "al7075-t6", "vmc", chipload.Limits(**limits), workpiece=elastic, step_mm=4.0
    )


def test_plain_values_give_the_deflection_and_the_stress_of_a_workpiece():
    done = run({**WORKPIECE, "yield_mpa": 500.0, "density_kg_m3": 2700.0}, deflection_workpiece_um=2000.0)
    um = done["deflection_workpiece_um"]
    assert um.max() > 0.0
    assert done.numbers["deflection_workpiece_um"]["max"] == um.max()
    # a strip as wide as the wall is long: six times its moment over its section is the least at its foot
    force = done["force_normal_n"].max()
    strip = 6.0 * force * 10.0 / (30.0 * 3.0**2)
    assert 0.8 * strip < done.numbers["stress_mpa_max"] < 8.0 * strip
    assert done.numbers["natural_frequencies"]["start_hz"][0] > 0.0
    check = next(c for c in done.limits if c.name == "stress_mpa")
    assert check.state is Verdict.HOLDS
    assert check.worst == done.numbers["stress_mpa_max"]
    assert check.resolution_error > 0.0
    tight = run({**WORKPIECE, "yield_mpa": 10.0}, deflection_workpiece_um=2000.0)
    assert next(c for c in tight.limits if c.name == "stress_mpa").state is Verdict.EXCEEDS


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"modulus_gpa": 0.0}, "workpiece.modulus_gpa = 0: must be above 0"),
        ({"clamps": ()}, "workpiece.clamps: missing"),
        (
            {"clamps": (chipload.WorkpieceClamp(face="z-", directions="z"),)},
            "motion along x, motion along y, rotation about z are free",
        ),
        (
            {"clamps": (chipload.WorkpieceClamp(point_mm=(90.0, 1.0, -17.0), diameter_mm=4.0),)},
            "workpiece.clamp.0: holds nothing",
        ),
        ({"clamps": (chipload.WorkpieceClamp(point_mm=(9.0, 1.0, -17.0)),)}, "both point_mm and diameter_mm"),
        ({"damping_ratio": 0.02}, "workpiece.damping_ratio: needs density_kg_m3"),
        ({"yield_mpa": 1.0}, "workpiece.yield_mpa"),
    ],
)
def test_bad_values_of_a_workpiece_are_refused(change, message):
    values = {**WORKPIECE, **change}
    with pytest.raises(InputError, match=message):
        run(values, deflection_workpiece_um=10.0)


def test_a_limit_of_the_deflection_needs_a_workpiece():
    with pytest.raises(InputError, match=r"limits.deflection_workpiece_um: needs the workpiece and its clamps"):
        run(None, deflection_workpiece_um=10.0)
