"""A pilot drill and a drill behind it in a plate: thrust, torque, power and what their point means for the hole."""

from __future__ import annotations

import math

import numpy as np
import pytest

import chipload
from chipload.cutter.cutter import Cutter
from chipload.cutting.material import material_named
from chipload.program.build import plunge, rapid
from chipload.program.program import Program
from chipload.result import Verdict

STEEL = material_named("group-2-steel")
SPEED = 100.0
#: of 6 and 10 mm, points of 118 deg
DRILLS = [
    Cutter(d, 2, math.radians(30.0), 60.0, 80.0, 5.8e5, bottom=math.radians(31.0), number=n)
    for n, d in ((1, 6.0), (2, 10.0))
]
#: mm per revolution
FEED = 0.2


@pytest.fixture(scope="module")
def done() -> chipload.History:
    path = []
    for number, z in ((1, -14.0), (2, -8.0)):
        path += [
            rapid([0.0, 0.0, 2.0], SPEED, number, "link"),
            plunge([0.0, 0.0, z], FEED * SPEED / math.tau, SPEED, number, "drill"),
            rapid([0.0, 0.0, 2.0], SPEED, number, "link"),
        ]
    block = chipload.Stock.block((-8.0, -8.0, -10.0), (8.0, 8.0, 0.0), layer_mm=1.0)
    limits = chipload.Limits(thrust_n=3000.0, torque_nm=20.0)
    settings = chipload.SimulationSettings(1.0)
    return chipload.simulate(Program.join(path), block, DRILLS, STEEL, "vmc", limits, settings=settings)


def lips(cutter: Cutter) -> float:
    """Tangential force of both lips per mm of radius by hand: kc1.1 1500 MPa, mc 0.22."""
    sin = math.sin(math.radians(59.0))
    return 2.0 * 1500.0 * (0.5 * FEED * sin) ** 0.78 / sin


def test_the_loads_of_full_lips_by_hand(done: chipload.History) -> None:
    k, d = lips(DRILLS[0]), 6.0
    full = k * d**2 / 8.0
    kd = 5.0 * 8.0 * full / (d**2 * FEED) * (FEED * d) ** 0.2
    thrust = 0.25 * k * d * 1.355 + 0.007 * kd * d**2 * 0.03
    own = done["tool"] == 1
    assert done["thrust_n"][own].max() == pytest.approx(thrust, rel=2e-3)
    assert done["torque_mean_nm"][own].max() == pytest.approx(1.085e-3 * full, rel=2e-3)
    assert done["power_w"][own].max() == pytest.approx(1.085e-3 * full * SPEED, rel=2e-3)
    row = int(np.argmax(np.where(own, done["thrust_n"], 0.0)))
    for name in ("force_z_mean_n", "force_z_max_n", "force_n"):
        assert done[name][row] == pytest.approx(done["thrust_n"][row])


def test_the_second_drill_has_the_rim_of_its_lips(done: chipload.History) -> None:
    k = lips(DRILLS[1])
    own = done["tool"] == 2
    # where the whole point is in the hole: the rim from 3 to 5 mm
    assert done["torque_mean_nm"][own].max() == pytest.approx(1e-3 * k * 8.0, rel=5e-3)
    assert done["thrust_n"][own].max() == pytest.approx(k, rel=5e-3)


def test_limits_of_thrust_and_torque_hold_with_a_material_of_one_direction(done: chipload.History) -> None:
    of = {check.name: check for check in done.limits}
    assert of["thrust_n"].state is of["torque_nm"].state is of["spindle_torque_nm"].state is Verdict.HOLDS
    assert of["thrust_n"].worst == done["thrust_n"].max()
    parts = {part.name: part.deviation for part in of["thrust_n"].budget.parts}
    assert parts["drill model"] == 0.2
    assert parts["coefficients"] == pytest.approx(0.3)
    # 95 % of both in squares: 1.645 * 0.36
    by_hand = (1.0 + of["thrust_n"].resolution_error) * math.exp(1.64485 * math.hypot(0.2, 0.3))
    assert of["thrust_n"].budget.value(1.0, 0.95) == pytest.approx(by_hand, rel=1e-4)


def test_notes_of_the_points(done: chipload.History) -> None:
    """A point of 1.803 mm goes through; the second drill has no material under its axis."""
    found = {f.code: f for f in done.in_use[0].findings if f.code.startswith("drill-")}
    assert set(found) == {"drill-breakthrough"}
    assert (
        "tool 1 drills to z = -14 with its tip and to z = -12.2 with its full diameter"
        in found["drill-breakthrough"].text
    )
    assert found["drill-breakthrough"].severity == 0
