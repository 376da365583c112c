"""Checks that nobody has to ask for: strength, flute length, rigid model, tangential materials, bands, confidence."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

import chipload
from chipload.checking.default_checks import DefaultChecks
from chipload.checking.history import History
from chipload.cutter.cutter import Cutter
from chipload.cutter.strength import ToolStrength
from chipload.cutting.force import forces_over_turn
from chipload.cutting.material import material_named
from chipload.cutting.strength import cutter_stress
from chipload.engagement.tooth_engagement import engagement_of_arcs
from chipload.engagement.tooth_surfaces import chips_of_teeth
from chipload.jobs.tables import ChecksTable
from chipload.program.build import plunge, rapid
from chipload.program.program import Program
from chipload.result import LimitCheck, Verdict

MILL = Cutter(10.0, 2, math.radians(30.0), 20.0, 30.0, 5.8e5)
AL = material_named("al7075-t6")
#: spindle [rad/s], feed per tooth [mm] at 8 mm/s
SPEED, FEED = 300.0, math.tau * 8.0 / (2 * 300.0)


def slot(cutter: Cutter = MILL, depth: float = 1.0, material: object = "al7075-t6", feed: float = 8.0, **more: object):
    path = [
        rapid([-6.0 - cutter.diameter, 0.0, -depth], SPEED, 1, "link"),
        plunge([more.pop("end_mm", 30.0), 0.0, -depth], feed, SPEED, 1, "cut"),
    ]
    block = chipload.Stock.block((0.0, -9.0, -20.0), (20.0, 9.0, 0.0), layer_mm=0.5)
    limits = more.pop("limits", chipload.Limits(force_n=5000.0))
    settings, checks = chipload.SimulationSettings(4.0), chipload.CheckSettings(confidence=more.pop("confidence", 0.5))
    more.setdefault("checks", checks)
    return chipload.simulate(Program.join(path), block, cutter, material, "vmc", limits, settings=settings, **more)


def held(history: History, name: str) -> LimitCheck:
    return next(x for x in history.limits if x.name == name)


def codes(history: History) -> set[str]:
    """Codes of what was found in the track in use."""
    return {f.code for f in history.in_use[0].findings}


def test_a_thin_cutter_breaks_and_the_report_says_where() -> None:
    thin = replace(MILL, diameter=4.0)
    done = slot(thin, 3.0)
    assert done.verdict == "exceeds"
    assert "cutter stress" in done.message
    assert "exceeds 1500 MPa" in done.message
    found = held(done, "cutter_stress_mpa")
    engagement = chips_of_teeth(engagement_of_arcs([0.0], [math.pi], FEED, thin, 3.0), thin)
    assert found.worst == pytest.approx(cutter_stress(engagement, thin, AL)[0], rel=1e-3)
    allowed = done.numbers["cutter_stress_mpa"]["allowed"]["1"]
    assert (allowed["mpa"], allowed["tool_material"], allowed["safety_factor"]) == (1500.0, "carbide", 2.0)
    # a stronger grade carries it; then the rigid model is not valid
    strong = slot(replace(thin, strength=ToolStrength(mpa=4000.0, safety_factor=1.5)), 3.0)
    assert strong.verdict == "unproven"
    assert "rigid model" in strong.message


def test_the_range_of_the_rigid_model_has_the_error_of_the_deflection() -> None:
    """The deflection goes with the force; a share that may be above 1 by this error is unproven."""
    done = slot()
    share, force = held(done, "deflection_share"), held(done, "force_n")
    assert share.resolution_error == force.resolution_error > 0.0
    # a range so small that the share is within its error below 1
    room = share.worst * (1.0 + 0.5 * share.resolution_error)
    below = slot(checks=chipload.CheckSettings(deflection_of_feed=2.0 * room, deflection_of_depth=0.25 * room))
    close = held(below, "deflection_share")
    assert close.worst < 1.0 < close.worst * (1.0 + close.resolution_error)
    assert (close.state, below.verdict) == (Verdict.UNPROVEN, "unproven")


def test_what_is_switched_off_is_listed() -> None:
    thin = replace(MILL, diameter=4.0)
    done = slot(thin, 3.0, checks=chipload.CheckSettings(cutter_strength=False, rigid_model=False))
    assert done.verdict == "holds"
    assert done.numbers["checks_off"] == ["cutter_strength", "rigid_model"]
    off = {f"check {name}: switched off by the job" for name in ("cutter_strength", "rigid_model")}
    assert off <= set(done.unchecked)
    assert not {"cutter_stress_mpa", "deflection_share"} & {x.name for x in done.limits}
    spindle = slot(checks=chipload.CheckSettings(spindle=False))
    assert not {"spindle_torque_nm", "spindle_power_w"} & {x.name for x in spindle.limits}


@pytest.mark.parametrize(("flutes", "overrun"), [(8.0, 0.0), (6.0, 0.0), (5.0, 1.0), (3.0, 3.0)])
def test_flutes_shorter_than_the_cut_let_the_shank_rub(flutes: float, overrun: float) -> None:
    done = slot(replace(MILL, flute_length=flutes), 6.0, feed=2.0)
    assert held(done, "axial_overrun_mm").worst == pytest.approx(overrun, abs=1e-7)
    assert (done.verdict == "exceeds") == (overrun > 0.0)
    if overrun > 0.0:
        assert held(done, "axial_overrun_mm").state is Verdict.EXCEEDS
        assert done.message.startswith(f"Exceeds: shank goes {overrun:g} mm into stock; and 1 more.")
        # the shank against the stock is a check of its own
        off = chipload.CheckSettings(flute_length=False)
        shank = slot(replace(MILL, flute_length=flutes), 6.0, feed=2.0, checks=off)
        assert shank.message.startswith(f"Exceeds: shank goes {overrun:g} mm into stock.")
        off = chipload.CheckSettings(flute_length=False, shank_in_stock=False)
        assert slot(replace(MILL, flute_length=flutes), 6.0, feed=2.0, checks=off).verdict == "holds"


def test_a_shank_over_an_open_side_does_not_rub() -> None:
    # the stock ends at the height of the flutes: nothing stands above them
    assert held(slot(replace(MILL, flute_length=6.0), 6.0, feed=2.0), "axial_overrun_mm").state is Verdict.HOLDS


def test_a_tangential_material_proves_torque_and_power_only() -> None:
    done = slot(
        material="group-2-steel", feed=30.0, limits=chipload.Limits(torque_nm=50.0, force_n=5000.0, deflection_um=90.0)
    )
    assert done.verdict == "unproven"
    of = {x.name: x.state for x in done.limits}
    assert of["torque_nm"] is of["spindle_torque_nm"] is of["spindle_power_w"] is Verdict.HOLDS
    assert {of[x] for x in ("force_n", "deflection_um", "cutter_stress_mpa", "deflection_share")} == {Verdict.UNPROVEN}
    assert "group-2-steel states the tangential force only" in done.message


def test_chips_thinner_than_the_coefficients_hold_for_are_unproven() -> None:
    thin = slot(material="group-2-steel", feed=2.0)
    assert "chip-below-coefficients" in codes(thin)
    assert thin.verdict == "unproven"
    off = slot(material="group-2-steel", feed=2.0, checks=chipload.CheckSettings(chip_range=False))
    assert "chip-below-coefficients" not in codes(off)


def test_a_cutting_speed_outside_that_of_the_coefficients_is_unproven() -> None:
    # 300 rad/s at a radius of 5 mm: 1.5 m/s, 90 m/min
    for (low, high), code in (((60.0, 89.9), "above"), ((90.1, 200.0), "below"), ((60.0, 120.0), "")):
        own = replace(AL, speed=(1000.0 * low / 60.0, 1000.0 * high / 60.0))
        done = slot(material=own)
        assert {c for c in codes(done) if c.startswith("speed-")} == ({f"speed-{code}-coefficients"} if code else set())
        assert done.verdict == ("unproven" if code else "holds")
        if code:
            assert f"the cutting speed is 90 m/min: the coefficients of {AL.name} hold from {low:g} to" in done.message
    assert (
        slot(material=replace(AL, speed=(2000.0, 3000.0)), checks=chipload.CheckSettings(chip_range=False)).verdict
        == "holds"
    )


def test_a_band_on_every_limit_of_the_force_and_the_verdict_at_its_upper_end() -> None:
    done = slot()
    theta = np.radians(np.arange(180.0))
    engagement = engagement_of_arcs([0.0], [math.pi], FEED, MILL, 1.0)
    force = np.linalg.norm(forces_over_turn(engagement, MILL, AL, theta)[0][0], axis=1)
    # each coefficient by itself, by a central difference of the greatest force
    gradient = []
    for k, name in enumerate(("Ktc", "Krc", "Kac", "Kte", "Kre", "Kae")):
        step = 1e-4 * AL.coefficients[k]
        ends = [replace(AL, **{name: AL.coefficients[k] + s}) for s in (step, -step)]
        f, g = (np.linalg.norm(forces_over_turn(engagement, MILL, m, theta)[0][0], axis=1).max() for m in ends)
        gradient.append((f - g) / (2.0 * step) * 0.25 * AL.coefficients[k])
    # the errors of two coefficients have the correlation 0.5
    relative = math.sqrt(0.5 * sum(g * g for g in gradient) + 0.5 * sum(gradient) ** 2) / force.max()
    band = done.program.simulated.removal.band_error
    assert band["force_n"] == pytest.approx(relative, rel=2e-3)
    assert set(band) >= {"force_n", "torque_nm", "torque_mean_nm", "power_w", "deflection_um", "cutter_stress_mpa"}
    assert done["force_sd_n"].max() == pytest.approx(relative * force.max(), rel=3e-3)
    # a limit between the mean and its upper band
    limit = chipload.Limits(force_n=1.1 * force.max())
    # the cutter stays in the block: a step that leaves it is known to some ten per cent only, too coarse for this limit
    assert slot(limits=limit, end_mm=10.0).verdict == "holds"
    sure = slot(limits=limit, end_mm=10.0, confidence=0.95)
    assert sure.verdict == "unproven"
    found = held(sure, "force_n")
    assert found.worst == pytest.approx(force.max(), rel=1e-3)
    part = next(p for p in found.budget.parts if p.name == "coefficients")
    assert part.deviation == pytest.approx(relative, rel=3e-3)
    # without a spread that of published values is taken, and said
    own = held(slot(material=replace(AL, name="own", spread=None), confidence=0.9), "force_n")
    assert any(
        p.name == "coefficients, whose spread is not stated" and p.deviation == part.deviation for p in own.budget.parts
    )


def test_every_cutter_has_its_own_allowed_stress() -> None:
    checks = DefaultChecks({1: MILL, 2: replace(MILL, modulus=2.1e5, number=2)}, AL)
    assert checks.allowed_stress([2, 1, 0]).tolist() == [1625.0, 1500.0, math.inf]
    assert ChecksTable().off == ()
    assert ChecksTable(spindle=False).off == ("spindle",)
