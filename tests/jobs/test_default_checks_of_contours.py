"""What is checked in planned contours without being asked for: cutter stress, flutes, spindle, the rigid model."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from chipload.checking.default_checks import DefaultChecks, _could_be_greatest
from chipload.cutter.cutter import Cutter
from chipload.cutting.material import Material, material_named
from chipload.engagement.contact import Engagement
from chipload.jobs import load_job, run_job
from chipload.planning.cost import CutConditions, cost
from chipload.result import Verdict

COARSE = ("operation.0.step_mm=0.4", 'operation.0.strategies=["plain"]', "operation.0.use=plain")
MILL = Cutter(10.0, 1, 0.0, 20.0, 40.0, 5.8e5)
CHECKS = DefaultChecks({}, material_named("al7075-t6"))
ROOMY = ("limits.engagement_deg=60", "limits.force_xy_n=5000", "limits.torque_nm=50", "limits.form_error_um=100000")


def test_a_thin_cutter_breaks(job_dir: Path) -> None:
    """3 mm across, 35 mm long: every stated limit holds, and the shank would break."""
    done = run_job(load_job(job_dir / "job.toml", (*COARSE, *ROOMY, "cutter.0.diameter_mm=3")))
    checks = {check.name: check for check in done.result.limits}
    assert all(checks[name].state is Verdict.HOLDS for name in ("engagement_deg", "force_xy_n", "torque_nm"))
    assert checks["cutter_stress_mpa"].state is Verdict.EXCEEDS
    assert checks["cutter_stress_mpa"].limit == 1500.0
    assert done.result.verdict is Verdict.EXCEEDS
    assert done.result.verdict.exit_code == 3
    assert "cutter stress" in done.result.message
    columns = done.result.track("plain").columns
    assert columns["cutter_stress_mpa"].max() == checks["cutter_stress_mpa"].worst
    # bending by the greatest force across the axis, from the middle of the edge to the clamp, is most of it
    bending = 32.0 * columns["force_xy_n"] * (35.0 - 2.5) / (math.pi * 3.0**3)
    assert checks["cutter_stress_mpa"].worst == pytest.approx(bending.max(), rel=0.25)


def test_what_is_switched_off_is_listed(job_dir: Path) -> None:
    off = ("checks.cutter_strength=false", "checks.spindle=false", "checks.flute_length=false")
    done = run_job(load_job(job_dir / "job.toml", (*COARSE, *off)))
    names = {check.name for check in done.result.limits}
    assert not names & {"cutter_stress_mpa", "axial_overrun_mm", "spindle_torque_nm", "spindle_power_w"}
    assert "deflection_share" in names
    for name in ("cutter_strength", "spindle", "flute_length"):
        assert f"check {name}: switched off by the job" in done.result.unchecked
    assert "chip space of tools 1: gullet_mm2 is not stated" in done.result.unchecked


def test_stress_of_a_straight_tooth_by_hand() -> None:
    """No helix, one tooth, tangential force alone: M = F (L - ap / 2), T = F R, greatest normal stress."""
    plain = Material("plain", 1000.0, 0.0, 0.0, 0.0, 0.0, 0.0, source="made up for this test")
    mill = Cutter(10.0, 1, 0.0, 20.0, 40.0, 5.8e5)
    met = Engagement(np.array([math.pi]), np.array([1]), np.tile([0.0, math.pi], (1, 4, 1)))
    cut = CutConditions(mill, plain, 2.0, 100.0, "down")
    speed = np.array([0.1 * 100.0 / math.tau])
    one = np.array([0.0])
    columns = cost(
        cut, np.array(["finish"], dtype=object), one, one, np.zeros((1, 2)), np.array([[1.0, 0.0]]), -2.0, met, speed,
        np.array([False]),
    )  # fmt: skip
    force = 1000.0 * 0.1 * 2.0
    stress = []
    for height, diameter in ((20.0, 8.0), (40.0, 10.0)):
        sigma = 32.0 * force * (height - 1.0) / (math.pi * diameter**3)
        tau = 16.0 * force * 5.0 / (math.pi * diameter**3)
        stress.append(0.5 * sigma + math.hypot(0.5 * sigma, tau))
    expected = mill.strength.concentration * max(stress)
    assert columns["cutter_stress_mpa"][0] == pytest.approx(expected, rel=1e-3)
    # radial depth 10 mm, feed per tooth 0.1 mm: the deflection may be 0.2 mm
    assert columns["deflection_share"][0] == pytest.approx(columns["deflection_cutter_um"][0] / 200.0)


def test_a_film_is_not_judged_by_its_deflection() -> None:
    """Of two tools: the greatest load each, what could be as great by its deflection, a film, a touch."""
    columns = {
        "tool": np.array([1, 1, 1, 1, 2]),
        "force_n": np.array([100.0, 40.0, 40.0, 9.0, 20.0]),
        "deflection_share": np.array([0.1, 0.6, 0.7, 1e4, 0.2]),
    }
    # 40 N (1 + 2 share) (1 + share / 4) is 101.2 N with a share of 0.6, 112.8 N with 0.7
    assert _could_be_greatest(columns, CHECKS).mask.tolist() == [True, True, True, False, True]
    assert _could_be_greatest({**columns, "deflection_share": np.full(5, 0.5)}, CHECKS).mask.tolist() == [
        True,
        False,
        False,
        False,
        True,
    ]


def test_a_film_is_judged_by_its_feed_and_its_depth_apart() -> None:
    """f_z = 0.1 mm of a mill with 2 teeth at 100 rad/s: 20 um are a fifth of it, and the share is that of the depth."""
    n = 3
    columns = {
        "force_n": np.array([100.0, 30.0, 50.0]),
        "deflection_share": np.array([0.1, 3.0, 3.0]),
        "deflection_um": np.array([60.0, 20.0, 20.0]),
        "feed_mm_min": np.full(n, 0.1 * 2 * 100.0 / math.tau * 60.0),
        "torque_mean_nm": np.array([3.0, 1.0, 1.0]),
        "power_w": np.array([300.0, 100.0, 100.0]),
    }
    checks = DefaultChecks({0: replace(MILL, flutes=2)}, material_named("al7075-t6"))
    # (1 + 0.2) (1 + 0.25 x 3) = 2.1: 63 N and 105 N; by one share for both 12.25 times as much
    assert _could_be_greatest(columns, checks).mask.tolist() == [True, False, True]
    turned = {"axis_x": np.array([0.0, 0.1, 0.1]), "axis_y": np.zeros(n), "axis_z": np.array([1.0, 0.995, 0.995])}
    assert _could_be_greatest({**columns, **turned}, checks).mask.tolist() == [True, True, True]
    strict = replace(checks, of_feed=0.01, of_depth=0.01)
    assert _could_be_greatest(columns, strict).mask.tolist() == [True, False, False]


def test_a_light_step_at_a_weak_place_is_judged() -> None:
    """A third of the load, and most of the deflection: the rigid model must hold there too."""
    columns = {
        "force_n": np.array([100.0, 33.0, 33.0]),
        "deflection_share": np.array([0.1, 0.5, 0.5]),
        "deflection_workpiece_um": np.array([5.0, 20.0, 2.0]),
    }
    assert _could_be_greatest(columns, CHECKS).mask.tolist() == [True, True, False]


def test_a_step_that_slows_down_is_held_against_the_feed_before_it() -> None:
    """The deflection of the last step, at a tenth of the feed, over that which the feed of its neighbour allows."""
    mill = Cutter(10.0, 1, 0.0, 20.0, 40.0, 5.8e5)
    met = Engagement(np.full(2, math.pi), np.full(2, 1), np.tile([0.0, math.pi], (2, 4, 1)))
    cut = CutConditions(mill, material_named("al7075-t6"), 2.0, 100.0, "down")
    speed, zone = np.array([1.0, 0.1]) * 0.1 * 100.0 / math.tau, np.array(["finish", "finish"], dtype=object)
    two, heading = np.arange(2.0), np.tile([1.0, 0.0], (2, 1))
    columns = cost(cut, zone, two, two, np.zeros((2, 2)), heading, -2.0, met, speed, np.zeros(2, dtype=np.bool_))
    assert columns["deflection_share"] == pytest.approx(columns["deflection_cutter_um"] / 200.0)
