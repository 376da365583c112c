"""Passes, leads and programs of a planned contour; the check by the simulation, which knows no planner."""

import math
from dataclasses import replace

import numpy as np
import pytest

from chipload.cutter.cutter import Cutter
from chipload.cutting.material import material_named
from chipload.geometry.contour import Contour, Region
from chipload.jobs.contour.outcome import Operation
from chipload.jobs.contour.result import limits_of
from chipload.machine.machine import machine_named
from chipload.planning.contour.plan import plan_contour
from chipload.planning.result import OperationResult
from chipload.program.gcode.writer import write_gcode
from chipload.program.release import Release
from chipload.result import Verdict
from chipload.simulation.verify import verify_contour
from finishing import CORNER, FINISHING, POCKET
from rs274 import MISSING, assert_same_motions, rs274_installed, run_rs274

ISLAND = Contour.circle((24, 19), 4.0)
MACHINE = machine_named("vmc")
MILL = Cutter(10.0, 4, math.radians(30), 22.0, 35.0, 580e3)
BASE = replace(FINISHING, strategies=("plain", "backward", "feed"))


def plan(contours, cutter=MILL, limits=None, **changes):
    return plan_contour(
        contours, replace(BASE, **changes), cutter, material_named("al7075-t6"), MACHINE, limits or {}
    ).strategies


def proof(result, radius, slack=1e-4):
    return verify_contour(
        result.program,
        radius,
        result.history,
        stock=Region(tuple(result.drawn["stock before"])),
        stock_top_mm=0.0,
        wall=result.drawn["wall"],
        material="right",
        engagement_tolerance_deg=0.01,
        gouge_tolerance_mm=slack,
        excess_tolerance_mm=slack,
    )


CASES = {
    "corner": ([CORNER], MILL, {}),
    "corner, up": ([CORNER], MILL, {"milling": "up"}),
    "corner from its right": ([CORNER.reversed()], MILL, {"side": "right"}),
    "pocket": ([POCKET], MILL, {}),
    "pocket, up, eased": ([POCKET], MILL, {"milling": "up", "joint": "clothoid"}),
    "boss": ([POCKET], MILL, {"side": "outside", "semifinish_depth": 1.0}),
    "pocket with an island, two passes": (
        [POCKET, ISLAND],
        replace(MILL, diameter=6.0),
        {"passes": 2, "semifinish_depth": 1.2},
    ),
}


@pytest.mark.parametrize("case", CASES)
def test_the_simulation_agrees(case):
    contours, cutter, changes = CASES[case]
    slack = BASE.tolerance if changes.get("joint") == "clothoid" else 1e-4
    for name, result in plan(contours, cutter, **changes).items():
        told = proof(result, cutter.radius, slack)
        assert told.verdict == "proved", (name, told.reasons)
        assert told.compared == len(result.history["s_mm"])


@pytest.mark.parametrize("case", CASES)
@pytest.mark.skipif(not rs274_installed(), reason=MISSING)
def test_rs274_reads_the_same_path(case):
    contours, cutter, changes = CASES[case]
    for name, result in plan(contours, cutter, **changes).items():
        assert_same_motions(
            run_rs274(write_gcode(result.program, MACHINE, title=name, release=Release(""))), result.program
        )


def test_right_of_the_reversed_chain_is_left_of_the_chain():
    one = plan([CORNER], side="left", strategies=("plain",))["plain"]
    two = plan([CORNER.reversed()], side="right", strategies=("plain",))["plain"]
    np.testing.assert_allclose(one.history["x_mm"], two.history["x_mm"], atol=1e-9)


def test_closing_piece_meets_what_the_lead_in_left():
    """The last R sin(a) of a closed pass loses its engagement; it is told apart, and ends at nothing."""
    history = plan([POCKET], strategies=("plain",))["plain"].history
    closing = history["pass"] == "closing"
    a = history["engagement_deg"]
    assert a[closing].min() == pytest.approx(0.0, abs=0.01)
    assert a[history["pass"] == "finish"].min() == pytest.approx(11.478341, abs=1e-4)


def test_limits_and_their_places():
    results = plan([CORNER])
    asked = {"engagement_deg": 13.0, "force_xy_n": 1.0}
    operation = Operation(OperationResult("contour", "backward", results), {}, MILL, 0.0, 5.0, {}, limits=asked)
    checks = {name: {x.name: x for x in limits_of(MACHINE, operation, one, name)} for name, one in results.items()}
    plain = checks["plain"]
    assert plain["engagement_deg"].state is Verdict.EXCEEDS
    assert plain["engagement_deg"].worst == pytest.approx(18.7375, abs=1e-3)
    x, y, _ = plain["engagement_deg"].place
    assert 20.0 <= x <= 23.0
    assert 5.0 <= y <= 8.0
    states = {name: check.state for name, check in checks["backward"].items()}
    # within its limit, but nothing was simulated: its error is not known
    assert states == {"engagement_deg": Verdict.UNPROVEN, "force_xy_n": Verdict.EXCEEDS}
    assert checks["backward"]["engagement_deg"].worst < 13.0
    assert checks["backward"]["engagement_deg"].reason == "the resolution error of engagement is not known"


def test_same_input_same_history():
    one, two = (plan([POCKET], strategies=("backward",))["backward"].history for _ in range(2))
    for name in one:
        assert (one[name] == two[name]).all(), name


def test_no_entry_in_material():
    """Every plunge goes down where nothing is left to cut: the engagement of the row that begins a pass is 0."""
    for contours in ([CORNER], [POCKET]):
        for result in plan(contours).values():
            begins = np.flatnonzero(np.diff(result.history["s_mm"], prepend=-1.0) != 0.0)
            starts = [k for k in begins if k == 0 or result.history["feed_mm_min"][k] == 0.0]
            assert result.history["engagement_deg"][starts].max() == 0.0


def test_what_a_cutter_leaves_in_a_corner_is_not_cleared():
    """A square corner keeps (1 - pi/4) R^2; a round one that the cutter fits keeps nothing."""
    mill, depth = replace(MILL, diameter=2.0), FINISHING.passes * FINISHING.radial_depth + FINISHING.semifinish_depth
    square = Contour.polyline([[0, 28], [0, 0], [28, 0]])
    left = (1.0 - math.pi / 4.0) * mill.radius**2
    asked = depth * 2.0 * 28.0 - depth**2
    for strategies in (("plain",), ("backward",)):
        (found,) = plan([square], mill, strategies=strategies, use=strategies[0], tolerance=0.5).values()
        assert found.summary["cleared_percent"] == pytest.approx(100.0 * (1.0 - left / asked), abs=0.05)
    (fits,) = plan([CORNER], strategies=("plain",), use="plain").values()
    assert fits.summary["cleared_percent"] == pytest.approx(100.0, abs=0.01)
