"""Engagement, chip and forces of a steady cut against closed forms and the true paths of the teeth."""

from __future__ import annotations

import math

import numpy as np
import pytest

import chipload
from api.mechanics.steady_cuts import METAL, engagement, mill
from chipload.errors import InputError
from engagement.tooth_paths import path_on_ray

TAU = math.tau


# -- engagement -------------------------------------------------------------------------------------------------
@pytest.mark.parametrize(("ae", "arc"), [(10.0, 180.0), (5.0, 90.0), (2.5, 60.0)])
def test_the_arc_of_a_radial_depth(ae, arc):
    up, down = engagement("up", ae=ae), engagement("down", ae=ae)
    assert (up.entry_deg, up.exit_deg) == (0.0, pytest.approx(arc, abs=1e-9))
    assert (down.entry_deg, down.exit_deg) == (pytest.approx(180.0 - arc, abs=1e-9), 180.0)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"ae": 12.0, "milling": "up"}, "radial_depth_mm = 12: must be above 0 and at most cutter.diameter_mm = 10"),
        ({"ae": 0.0, "milling": "up"}, "radial_depth_mm = 0: must be above 0 and at most cutter.diameter_mm = 10"),
        ({"milling": "down"}, "radial_depth_mm: missing: state it for down milling"),
        ({"ae": 3.0}, "radial_depth_mm = 3: leave it out: a slot is as wide as the cutter"),
        ({"milling": "climb"}, "milling = 'climb': must be up, down or slot"),
        ({"ap": 30.0}, "axial_depth_mm = 30: must be at most cutter.flute_length_mm = 22"),
        ({"ap": 0.0}, "engagement.axial_depth_mm = 0: must be above 0"),
        ({"ap": math.nan}, "engagement.axial_depth_mm = nan: must be a finite number"),
    ],
)
def test_an_engagement_that_cannot_be_is_refused(values, message):
    with pytest.raises(InputError) as err:
        engagement(**values)
    assert str(err.value) == message


def test_an_arc_rises():
    with pytest.raises(InputError) as err:
        chipload.CutEngagement(entry_deg=90.0, exit_deg=60.0, axial_depth_mm=1.0)
    assert str(err.value) == "engagement.exit_deg = 60: must be above entry_deg = 90"


# -- chip -------------------------------------------------------------------------------------------------------
def test_at_a_small_feed_the_chip_is_the_feed_times_the_sine():
    phi = np.linspace(5.0, 175.0, 35)
    chip = chipload.undeformed_chip(mill(), engagement(), 1e-4, immersion_deg=phi)
    assert chip.thickness_mm == pytest.approx(np.tile(1e-4 * np.sin(np.radians(phi)), (4, 1)), rel=2e-4)
    assert chip.thickness_mm.dtype == np.float64
    assert not chip.thickness_mm.flags.writeable


@pytest.mark.parametrize("runout", [0.0, 0.02])
def test_the_chip_lies_between_the_trochoids_of_the_teeth(runout):
    """Oracle: Newton's method on the path of every earlier tooth; 0.3 % of the thickest chip."""
    fz, N, R, lam = 0.2, 3, 5.0, math.radians(40.0)
    phi = np.linspace(10.0, 170.0, 33)
    stated = {"runout_mm": runout, "runout_deg": 40.0} if runout else {}
    chip = chipload.undeformed_chip(mill(flutes=N, **stated), engagement(flutes=N), fz, immersion_deg=phi)
    for j in range(N):
        radius = [R + runout * math.cos(lam - TAU * k / N) for k in range(N)]
        for at, h in zip(np.radians(phi), chip.thickness_mm[j], strict=True):
            earlier = [
                path_on_ray(at, TAU * m / N, radius[(j - m) % N], N * fz / TAU) for m in range(1, N + 1)
            ]  # the places of all earlier teeth on the ray of this one
            assert h == pytest.approx(max(radius[j] - max(earlier), 0.0), abs=3e-3 * fz)


def test_the_chip_runs_from_entry_to_exit_where_no_immersion_is_stated():
    chip = chipload.undeformed_chip(mill(), engagement("down", ae=5.0), 0.05)
    assert chip.immersion_deg[0] == pytest.approx(90.0, abs=0.5)
    assert chip.immersion_deg[-1] == pytest.approx(180.0, abs=1.0)
    assert chip.thickest_mm == pytest.approx(float(chip.thickness_mm.max()), rel=1e-3)
    # the wall is cut twice near 180 deg, and a slot begins before 0
    assert chipload.undeformed_chip(mill(), engagement(), 0.05).immersion_deg[0] < 0.0


def test_the_height_of_a_chip_is_within_the_cut():
    with pytest.raises(InputError) as err:
        chipload.undeformed_chip(mill(), engagement(), 0.05, height_mm=3.0)
    assert str(err.value) == "height_mm = 3: must be from 0 to engagement.axial_depth_mm = 2"


# -- forces -----------------------------------------------------------------------------------------------------
def test_the_mean_forces_of_a_slot():
    """Closed form of [Altintas2012] 2.6: Fx = -N a (Krc c / 4 + Kre / pi), Fy = N a (Ktc c / 4 + Kte / pi), Fz, T."""
    N, a, c = 4, 2.0, 1e-3
    turn = chipload.tooth_forces(mill(), METAL, engagement(), c, 3000.0)
    along = -N * a * (300.0 * c / 4.0 + 5.0 / math.pi)
    across = N * a * (1000.0 * c / 4.0 + 10.0 / math.pi)
    axis = -N * a * (200.0 * c / math.pi + 2.0 / 2.0)
    torque = N * a * (1000.0 * c / math.pi + 10.0 / 2.0) * 5.0 / 1000.0
    assert turn.mean_force_n == pytest.approx([along, across, axis], rel=2e-4)
    assert turn.mean_torque_nm == pytest.approx(torque, rel=2e-4)
    assert turn.mean_power_w == pytest.approx(torque * 3000.0 * TAU / 60.0, rel=2e-4)


def test_the_forces_of_straight_teeth_over_a_turn():
    """Zero helix: each tooth in the stock adds its forces at its own immersion, h = f sin(phi) at a small feed."""
    c, a, cut = 1e-3, 2.0, engagement("up", ae=5.0)
    turn = chipload.tooth_forces(mill(), METAL, cut, c, 3000.0, rotations=72)
    for theta, force, torque in zip(np.radians(turn.rotation_deg), turn.force_n, turn.torque_nm, strict=True):
        want, moment = np.zeros(3), 0.0
        at = [(theta - TAU * j / 4) % TAU for j in range(4)]
        if min(abs(phi - end) for phi in at for end in (0.0, math.pi / 2, TAU)) < 1e-3:
            continue  # a jump
        for phi in at:
            if phi < math.pi / 2:
                h = c * math.sin(phi)
                ft, fr, fa = ((k * h + e) * a for k, e in ((1000.0, 10.0), (300.0, 5.0), (200.0, 2.0)))
                want += [-ft * math.cos(phi) - fr * math.sin(phi), ft * math.sin(phi) - fr * math.cos(phi), -fa]
                moment += ft * 5.0 / 1000.0
        assert force == pytest.approx(want, rel=1e-3, abs=1e-3)
        assert torque == pytest.approx(moment, rel=1e-3, abs=1e-6)


def test_a_helix_of_one_pitch_has_a_constant_force():
    """Where the axial depth is one pitch of the helix, some tooth is at each immersion: force and torque stay."""
    pitch = TAU * 5.0 / 4.0 / math.tan(math.radians(30.0))
    turn = chipload.tooth_forces(mill(helix_deg=30.0), METAL, engagement(ap=pitch), 0.05, 3000.0)
    assert np.ptp(turn.force_n, axis=0) == pytest.approx([0.0, 0.0, 0.0], abs=1e-6)
    assert turn.greatest_torque_nm == pytest.approx(turn.mean_torque_nm, rel=1e-9)


def test_the_greatest_force_is_not_below_any_sample():
    turn = chipload.tooth_forces(mill(helix_deg=30.0), METAL, engagement("down", ae=3.0), 0.08, 3000.0, rotations=3600)
    across = np.hypot(*turn.force_n[:, :2].T)
    assert across.max() <= turn.greatest_force_n <= across.max() * 1.001
    assert turn.torque_nm.max() <= turn.greatest_torque_nm * (1.0 + 1e-12)


def test_a_left_hand_cutter_has_the_mirrored_force():
    """The components are along the feed and to the side to which the teeth turn: they are those of the other hand."""
    right, left = (
        chipload.tooth_forces(mill(helix_deg=30.0, left_hand=hand), METAL, engagement("up", ae=3.0), 0.05, 3000.0)
        for hand in (False, True)
    )
    assert left.force_n == pytest.approx(right.force_n, abs=1e-12)


def test_a_chip_beyond_the_measured_range_is_noted():
    metal = chipload.Material("steel", 1800.0, 600.0, 200.0, 30.0, 40.0, 2.0, source="made up", chip=(0.01, 0.1))
    turn = chipload.tooth_forces(mill(), metal, engagement(), 0.15, 3000.0)
    assert [note[:36] for note in turn.notes] == ["material steel: a chip of 0.150027 m"]
    assert chipload.tooth_forces(mill(), metal, engagement(), 0.05, 3000.0).notes == ()


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"feed_per_tooth_mm": 0.0}, "feed_per_tooth_mm = 0: must be above 0"),
        ({"feed_per_tooth_mm": math.nan}, "feed_per_tooth_mm = nan: must be above 0"),
        ({"speed_rpm": -1.0}, "speed_rpm = -1: must be above 0"),
        ({"speed_rpm": [1.0, 2.0]}, "speed_rpm of shape (2,): must be one number"),
        ({"rotations": 4}, "rotations = 4: must be from 8 to 100000"),
        ({"engagement": 3.0}, "engagement: float: give a chipload.CutEngagement, as of engagement_of_cut"),
        ({"cutter": 3.0}, "cutter: float: give a chipload.Cutter"),
        (
            {"cutter": mill(corner_radius_mm=2.0)},
            "cutter.corner_radius_mm = 2: forces are known for a straight flank only; choose a flat end mill",
        ),
        (
            {"engagement": chipload.CutEngagement(entry_deg=0.0, exit_deg=180.0, axial_depth_mm=30.0)},
            "axial_depth_mm = 30: must be above 0 and at most cutter.flute_length_mm = 22",
        ),
    ],
)
def test_what_has_no_force_is_refused(values, message):
    stated = {"cutter": mill(), "engagement": engagement(), "feed_per_tooth_mm": 0.05, "speed_rpm": 3000.0}
    with pytest.raises(InputError) as err:
        chipload.tooth_forces(material=METAL, **{**stated, **values})
    assert str(err.value) == message


def test_a_material_without_directions_is_refused():
    metal = chipload.Material("t", 1000.0, 0.0, 0.0, 10.0, 0.0, 0.0, source="made up", tangential=True)
    with pytest.raises(InputError, match="only its tangential force is known, a force over a turn needs"):
        chipload.tooth_forces(mill(), metal, engagement(), 0.05, 3000.0)
