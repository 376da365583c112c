"""Lobes, margins and the error of a wall against closed forms of one mode and the exact periodic motion."""

from __future__ import annotations

import math

import numpy as np
import pytest

import chipload
from api.mechanics.steady_cuts import METAL, engagement, mill
from chipload.errors import InputError

TAU = math.tau
HZ, DAMPING, K = 650.0, 0.02, 5000.0
MODE = chipload.Mode(frequency_hz=HZ, direction="y", damping_ratio=DAMPING, stiffness_n_um=K / 1000.0)
#: force of a mm of depth for each mm of vibration, of four straight teeth in a slot: N Krc / 4
PER_DEPTH = 300.0


def lobes(speed_rpm):
    """Limit (mm) at speeds: b = -1 / (2 K Re G), w tau = angle + 2 pi j; [Altintas1995] for a constant matrix."""
    w = TAU * np.linspace(HZ * 1.0001, 3.0 * HZ, 400_000)
    G = 1.0 / K / (1.0 - (w / (TAU * HZ)) ** 2 + 2j * DAMPING * w / (TAU * HZ))
    depth = -1.0 / (2.0 * PER_DEPTH * G.real)
    angle = -np.angle(1.0 + 1.0 / (PER_DEPTH * depth * G)) % TAU
    best = np.full(len(speed_rpm), np.inf)
    for j in range(60):
        speed = 60.0 * w / (angle + TAU * j) / 4.0
        rising = np.argsort(speed)
        best = np.minimum(best, np.interp(speed_rpm, speed[rising], depth[rising], left=np.inf, right=np.inf))
    return best


def test_the_lobes_of_a_slot_with_four_straight_teeth():
    """The zero-order formula is exact there; the grid of depths is fine beside the limit, 1 % is asked."""
    speed, depth = np.linspace(4000.0, 9000.0, 41), np.linspace(0.1, 4.0, 157)
    chart = chipload.stability_chart(mill(), METAL, engagement(), 0.05, speed, [MODE], axial_depth_mm=depth)
    want = np.minimum(lobes(speed), 4.0)
    assert chart.limit_depth_mm == pytest.approx(want, rel=1e-2)
    assert chart.growth.shape == (41, 157)
    assert want.min() == pytest.approx(2.0 * K * DAMPING * (1.0 + DAMPING) / PER_DEPTH, rel=1e-2)


@pytest.mark.parametrize("direction", [0.0, 90.0, 37.0])
def test_the_margin_times_the_depth_is_the_limit(direction):
    """A constant matrix is the same in every direction of the feed."""
    speed = np.array([4200.0, 5680.0, 7000.0])
    found = chipload.stability_margin(
        mill(), METAL, engagement(ap=0.5), 0.05, speed, [MODE], feed_direction_deg=direction
    )
    limit = lobes(speed)
    assert found.margin[limit < 1.4] * 0.5 == pytest.approx(limit[limit < 1.4], rel=1e-2)
    assert (found.growth < 0.0).tolist() == (limit > 0.5).tolist()
    assert found.mode[limit < 1.4].tolist() == [0] * int((limit < 1.4).sum())


def test_chatter_is_above_the_natural_frequency():
    found = chipload.stability_margin(mill(), METAL, engagement(ap=0.5), 0.05, 5682.0, MODE)
    assert found.chatter_hz[0] == pytest.approx(HZ * math.sqrt(1.0 + 2.0 * DAMPING), rel=5e-3)


def test_a_mass_stands_for_a_stiffness():
    heavy = chipload.Mode(frequency_hz=HZ, direction="y", damping_ratio=DAMPING, mass_kg=1e3 * K / (TAU * HZ) ** 2)
    two = [chipload.stability_margin(mill(), METAL, engagement(), 0.05, 5000.0, [m]).margin[0] for m in (MODE, heavy)]
    assert two[0] == pytest.approx(two[1], rel=1e-6)


# -- the error of the wall --------------------------------------------------------------------------------------
def periodic_error_um(rpm, ap, fz, ae, mode_hz, damping, stiffness, teeth):
    """Half a million samples of a turn: the force of straight teeth in down milling, by its Fourier series."""
    count, a = 2**19, math.acos(1.0 - ae / 5.0)
    theta = (np.arange(count) + 0.5) * TAU / count
    force = np.zeros(count)
    for j in range(teeth):
        phi = (theta - TAU * j / teeth) % TAU
        in_cut = (phi > math.pi - a) & (phi < math.pi)
        h = fz * np.sin(phi)
        force += ap * np.where(in_cut, (1000.0 * h + 10.0) * np.sin(phi) - (300.0 * h + 5.0) * np.cos(phi), 0.0)
    series = np.fft.rfft(force)
    w = TAU * np.arange(len(series)) * rpm / 60.0
    w0 = TAU * mode_hz
    motion = np.fft.irfft(series * w0**2 / stiffness / (w0**2 - w**2 + 2j * damping * w0 * w), count)
    # the last sample in the stock, where the wall is made; above 0 the cutter went away from the wall on the right
    return 1000.0 * motion[int(count / 2) - 1]


@pytest.mark.parametrize("rpm", [4000.0, 9000.0, 12000.0, 14000.0])
def test_the_error_of_a_wall_is_that_of_the_periodic_motion(rpm):
    cut = engagement("down", ap=0.5, ae=1.0, flutes=3)
    found = chipload.surface_location_error(mill(flutes=3), METAL, cut, 0.05, rpm, [MODE])
    want = periodic_error_um(rpm, 0.5, 0.05, 1.0, HZ, DAMPING, K, 3)
    assert found.error_um[0] == pytest.approx(want, rel=1e-2, abs=2e-3)


def test_a_cut_that_chatters_has_no_error():
    cut = engagement("down", ap=8.0, ae=5.0)
    found = chipload.surface_location_error(mill(), METAL, cut, 0.05, [5682.0], [MODE])
    assert found.margin[0] < 1.0
    assert math.isnan(found.error_um[0])


# -- what is refused --------------------------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"modes": []}, "modes: missing: state at least one chipload.Mode"),
        ({"modes": [3.0]}, "modes[0]: float: give a chipload.Mode"),
        (
            {"modes": [chipload.Mode(frequency_hz=HZ, direction="y", stiffness_n_um=5.0)]},
            "modes[0]: damping_ratio: missing: stability is not known without it",
        ),
        (
            {"modes": [chipload.Mode(frequency_hz=HZ, direction="y", damping_ratio=0.02)]},
            "modes[0]: stiffness_n_um: missing: state it, or mass_kg",
        ),
        (
            {"modes": [chipload.Mode(frequency_hz=HZ, direction="y", damping_ratio=0.02, stiffness_n_um=5.0, tool=3)]},
            "modes[0].tool = 3: the cutter has the number 0: leave it out",
        ),
        ({"speed_rpm": [0.0]}, "speed_rpm = 0: must be above 0"),
        ({"feed_direction_deg": math.inf}, "feed_direction_deg = inf: must be a finite number"),
    ],
)
def test_a_margin_that_cannot_be_is_refused(values, message):
    stated = {"engagement": engagement(), "feed_per_tooth_mm": 0.05, "speed_rpm": 5000.0, "modes": [MODE]}
    with pytest.raises(InputError) as err:
        chipload.stability_margin(mill(), METAL, **{**stated, **values})
    assert str(err.value) == message


@pytest.mark.parametrize(
    ("cutter", "depth", "message"),
    [
        ({}, [1.0, 30.0], "axial_depth_mm = 30: must be at most cutter.flute_length_mm = 22"),
        ({}, [2.0, 1.0], "stability chart: depths: must be two or more numbers that rise from above 0"),
        (
            {"runout_mm": 0.01, "runout_deg": 0.0},
            [1.0, 2.0],
            "cutter.runout_mm = 0.01: the teeth then differ, so that the cut has no single depth: leave it out, or use "
            "stability_margin",
        ),
    ],
)
def test_a_chart_that_cannot_be_is_refused(cutter, depth, message):
    with pytest.raises(InputError) as err:
        chipload.stability_chart(
            mill(**cutter), METAL, engagement(), 0.05, [5000.0, 6000.0], [MODE], axial_depth_mm=depth
        )
    assert str(err.value) == message


@pytest.mark.parametrize(
    ("cutter", "cut", "rpm", "mode", "message"),
    [
        (
            {},
            chipload.CutEngagement(entry_deg=30.0, exit_deg=90.0, axial_depth_mm=1.0),
            9000.0,
            MODE,
            "engagement: 30 to 90 deg: makes no wall: must begin at 0 or end at 180",
        ),
        (
            {"runout_mm": 0.01, "runout_deg": 0.0},
            engagement(),
            9000.0,
            MODE,
            "cutter: its teeth differ by runout or pitch: the error of a wall is known for equal teeth",
        ),
        (
            {},
            engagement(),
            9000.0,
            chipload.Mode(frequency_hz=HZ, direction="z", damping_ratio=0.02, stiffness_n_um=5.0),
            "modes: one moves along the axis: the error of a wall is known for modes across it",
        ),
        (
            {},
            engagement(),
            60.0,
            MODE,
            "speed_rpm = 60: must be at least 97.5: below it 400 harmonics of the teeth do not reach 4 times the mode "
            "of 650 Hz",
        ),
    ],
)
def test_an_error_of_a_wall_that_cannot_be_is_refused(cutter, cut, rpm, mode, message):
    with pytest.raises(InputError) as err:
        chipload.surface_location_error(mill(**cutter), METAL, cut, 0.05, rpm, [mode])
    assert str(err.value) == message
