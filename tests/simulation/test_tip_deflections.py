"""How far the tip gives way in a straight slot, against the cantilever in closed form.

A straight tooth ahead (phi = 90 deg) of a slot carries w = hypot(Kt, Kr) on every mm of the depth b, Kt = Ktc f + Kte
and Kr = Krc f + Kre; nothing else cuts. The tip of a clamped bar of E I under w from 0 to b goes

    w [b^4 / 8 + b (L^3 - b^3) / 3 - b^2 (L^2 - b^2) / 4] / (E I).
"""

from __future__ import annotations

import math
from dataclasses import fields, replace

import numpy as np
import pytest

from chipload.checking.stiffness import MachineStiffness, deflection_watch, stiffness_of
from chipload.cutter.cutter import Cutter
from chipload.cutting.material import Material
from chipload.errors import InputError
from chipload.program.build import plunge, rapid
from chipload.program.program import Program
from chipload.simulation.chips import remove
from chipload.simulation.removal import Resolution
from chipload.stock.layers import LayeredStock
from chipload.structure.cells.states import StepCompliances

SOFT = Material("soft", 900.0, 400.0, 0.0, 12.0, 18.0, 0.0, source="made up for this test")
MILL = Cutter(10.0, 2, 0.0, 12.0, 30.0, 6e5, holder=((40.0, 30.0), (20.0, 50.0)))
# a feed of 0.02 mm a tooth: the true paths of the teeth differ from circles by (f / R)^2 = 1.8e-5
DEPTH, FEED, SPEED = 3.0, 2.0, 300.0
CIRCLES = 2e-5
LOAD = math.hypot(900.0 * math.tau * FEED / (2 * SPEED) + 12.0, 400.0 * math.tau * FEED / (2 * SPEED) + 18.0)


def slot(cutter: Cutter = MILL, workpiece: StepCompliances | None = None, **stiffness: float):
    gives = stiffness_of(MachineStiffness(**stiffness), {cutter.number: cutter}, workpiece)
    program = Program.join(
        [
            rapid([-10.0, 0.0, -DEPTH], SPEED, 1, "link"),
            plunge([20.0, 0.0, -DEPTH], FEED, SPEED, 1, "cut"),
        ]
    )
    stock = LayeredStock.block((0.0, -15.0, -5.0), (40.0, 15.0, 0.0), 1.0, 40.0)
    fine = Resolution(2.0, 1e-4, 1, 0.5)
    columns = remove(
        program,
        stock,
        {1: cutter},
        SOFT,
        fine,
        watch=deflection_watch(gives, SOFT),
    ).columns
    k = int(np.flatnonzero(columns["x_mm"] == 20.0)[0])
    return {name: float(v[k]) for name, v in columns.items() if name.startswith("deflection")}, columns, gives


def moment(low: float, high: float) -> float:
    """Integral over z of z times the integral of (z - a) over the load, from low to high above the depth of cut."""
    return DEPTH * (high**3 - low**3) / 3.0 - DEPTH**2 * (high**2 - low**2) / 4.0


def inertia(diameter: float) -> float:
    return math.pi * diameter**4 / 64.0


def bar() -> float:
    """[mm] of the cutter alone, clamped at 30 mm: 8 mm thick up to 12 mm, 10 mm above."""
    fluted = (DEPTH**4 / 8.0 + moment(DEPTH, 12.0)) / (6e5 * inertia(8.0))
    return LOAD * (fluted + moment(12.0, 30.0) / (6e5 * inertia(10.0)))


def test_a_cutter_alone_is_a_cantilever_and_all_else_is_named() -> None:
    found, columns, gives = slot()
    assert found["deflection_cutter_um"] == pytest.approx(1e3 * bar(), rel=CIRCLES)
    assert found["deflection_um"] == found["deflection_cutter_um"]
    assert "deflection_workpiece_um" not in found
    assert columns["force_n"].max() == pytest.approx(LOAD * DEPTH, rel=CIRCLES)
    chip = math.tau * FEED / (2 * SPEED)
    assert columns["torque_nm"].max() == pytest.approx(5.0 * DEPTH * (900.0 * chip + 12.0) / 1000.0, rel=CIRCLES)
    assert columns["chip_max_mm"].max() == pytest.approx(chip, rel=CIRCLES)
    assert columns["deflection_um"].max() == pytest.approx(1e3 * bar(), rel=CIRCLES)
    assert not columns["deflection_um"][columns["chip_volume_mm3"] == 0.0].any()
    names = ("grip_n_um", "grip_nm_rad", "spindle_n_um", "spindle_nm_rad", "work_n_um", "holder_gpa")
    assert gives.unknown == tuple(f"stiffness.{n}" for n in names)


def test_holder_joints_and_work_add_what_they_give() -> None:
    said = {
        "grip_n_um": 80.0, "grip_nm_rad": 2e4, "spindle_n_um": 40.0, "spindle_nm_rad": 1e5, "work_n_um": 25.0,
        "holder_gpa": 210.0,
    }  # fmt: skip
    found, _, gives = slot(**said)
    assert gives.unknown == ()
    force = LOAD * DEPTH

    def joint(across: float, tilt: float, z: float) -> float:
        return force * (1.0 / (1e3 * across) + z * (z - 0.5 * DEPTH) / (1e3 * tilt))

    holder = LOAD * (moment(30.0, 70.0) / inertia(30.0) + moment(70.0, 90.0) / inertia(50.0)) / 210e3
    cutter = bar() + holder + joint(80.0, 2e4, 30.0) + joint(40.0, 1e5, 90.0)
    work = force / 25e3
    assert found["deflection_cutter_um"] == pytest.approx(1e3 * cutter, rel=CIRCLES)
    assert found["deflection_workpiece_um"] == pytest.approx(1e3 * work, rel=CIRCLES)
    # one straight tooth cuts, so that cutter and work part along one line
    assert found["deflection_um"] == pytest.approx(1e3 * (cutter + work), rel=CIRCLES)


def everywhere(compliance: np.ndarray) -> StepCompliances:
    """A workpiece whose compliance is the same in every step and at every station but the last, which is stiffer."""
    none = np.zeros(0, dtype=np.int64)
    C = np.stack([compliance, compliance, 0.5 * compliance])[None]
    return StepCompliances(np.zeros(1, np.int64), np.zeros((1, 2, 3)), C, np.zeros(1), none, none, C[:0], (0,), 0.0)


def test_a_workpiece_gives_way_in_the_frame_of_the_program() -> None:
    found, columns, gives = slot(workpiece=everywhere(np.eye(3) / 25e3))
    assert "stiffness.work_n_um" not in gives.unknown
    assert found["deflection_workpiece_um"] == pytest.approx(1e3 * LOAD * DEPTH / 25e3, rel=CIRCLES)
    for axis, name in enumerate("xyz"):
        C = np.zeros((3, 3))
        C[axis, axis] = 1.0 / 25e3
        um = slot(workpiece=everywhere(C))[1]["deflection_workpiece_um"]
        most = np.maximum(columns[f"force_{name}_max_n"], -columns[f"force_{name}_min_n"])
        np.testing.assert_allclose(um, 1e3 * most / 25e3, rtol=2e-3, atol=1e-9)


def test_a_measured_tip_stands_for_grip_holder_and_spindle() -> None:
    own = (12.0**3 / inertia(8.0) + (30.0**3 - 12.0**3) / inertia(10.0)) / (3.0 * 6e5)
    found, _, gives = slot(replace(MILL, tip_stiffness=8e3), work_n_um=math.inf)
    assert gives.unknown == ()
    assert found["deflection_cutter_um"] == pytest.approx(1e3 * (bar() + LOAD * DEPTH * (1.0 / 8e3 - own)), rel=CIRCLES)
    with pytest.raises(InputError, match=r"^tip: measured compliance .* must be at least that of cutter and holder"):
        slot(replace(MILL, tip_stiffness=1e6))


def test_what_is_stated_as_rigid_adds_nothing_and_leaves_nothing_open() -> None:
    rigid = dict.fromkeys((f.name for f in fields(MachineStiffness)), math.inf)
    found, _, gives = slot(replace(MILL, holder=()), **rigid)
    assert gives.unknown == ()
    assert found["deflection_cutter_um"] == pytest.approx(1e3 * bar(), rel=CIRCLES)
    assert found["deflection_workpiece_um"] == 0.0
    assert found["deflection_um"] == found["deflection_cutter_um"]


def test_a_rigid_holder_of_unknown_length_is_named_where_the_spindle_tilts() -> None:
    bare = replace(MILL, holder=())
    rigid = dict.fromkeys((f.name for f in fields(MachineStiffness)), math.inf)
    assert slot(bare, **{**rigid, "spindle_nm_rad": 1e5})[2].unknown == ("holder_mm of cutter 1",)
    assert slot(bare, **{**rigid, "holder_gpa": 210.0})[2].unknown == ("holder_mm of cutter 1",)


def test_a_modulus_that_no_holder_has() -> None:
    with pytest.raises(InputError, match=r"stiffness\.holder_gpa = 2\.1e\+11: must be from 50 to 1000, or inf"):
        slot(holder_gpa=2.1e11)
