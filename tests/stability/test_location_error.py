"""The surface location error: the exact periodic state, the static bar in the stiff limit, its change of sign."""

from __future__ import annotations

import math

import numpy as np
import pytest

from chipload.cutting.force import forces_over_turn
from chipload.cutting.material import Material
from chipload.engagement.tooth_engagement import engagement_of_arcs
from chipload.errors import InputError
from chipload.stability.modes import Modes
from chipload.stability.surface_error import location_error
from stability.stability_oracles import HALF, ONE, TAU, mill

METAL = Material("plain", 700.0, 210.0, 0.0, 10.0, 12.0, 0.0, source="made up for tests")


def error_um(rpm, arc, depth, modes=ONE, helix=0.0, metal=METAL):
    met, cutter = engagement_of_arcs([arc[0]], [arc[1]], 0.05, mill(helix=helix), depth), mill(helix=helix)
    error, made = location_error(met, cutter, metal, modes, rpm * TAU / 60.0, [[1.0, 0.0]], [[0.0, 1.0]])
    return 1e3 * error[0], bool(made[0])


@pytest.mark.parametrize(
    ("rpm", "too_much"), [(6000, -0.840342), (12000, 11.151670), (14000, -16.152017), (20000, -4.241082)]
)
def test_down_milling_with_one_mode(rpm, too_much):
    """By quadrature of the exact periodic state; the sign changes between 12000 and 14000, at the mode's 650 Hz."""
    assert error_um(rpm, HALF, 0.5) == (pytest.approx(-too_much, abs=2e-6), True)


def test_the_periodic_motion_is_that_of_the_force_model_in_small_steps():
    """Helix, two modes: the force of the product's force model, marched until it repeats."""
    modes = Modes([500.0, 900.0], [0.03, 0.04], [4000.0, 9000.0], [[0.3, 1.0], [1.0, 0.2]])
    helix, depth, rpm = 30.0, 4.0, 5000
    met, cutter = engagement_of_arcs([HALF[0]], [HALF[1]], 0.05, mill(helix=helix), depth), mill(helix=helix)
    count = 3000
    theta = np.arange(count) * (TAU / 3) / count
    force = forces_over_turn(met, cutter, METAL, theta)[0][0, :, :2]
    push = force @ (modes.direction.T / np.sqrt(modes.mass))
    w, z, dt = modes.omega, np.array(modes.damping), 60.0 / rpm / 3 / count
    wd, decay = w * np.sqrt(1 - z**2), np.exp(-z * w * dt)
    q, v = np.zeros(2), np.zeros(2)
    r = np.zeros(count)
    for period in range(60):
        for i in range(count):
            if period == 59:
                r[i] = q @ (modes.direction[:, 1] / np.sqrt(modes.mass))
            f = 0.5 * (push[i] + push[(i + 1) % count]) / w**2
            a, c, s = q - f, np.cos(wd * dt), np.sin(wd * dt)
            q, v = (
                f + decay * (a * (c + z * w / wd * s) + v * s / wd),
                decay * (v * (c - z * w / wd * s) - a * w**2 / wd * s),
            )
    lag = math.tan(math.radians(helix)) / 5.0
    at = (math.pi + lag * np.linspace(0.0, depth, 5)) % (TAU / 3)
    seen = np.interp(at, np.append(theta, TAU / 3), np.append(r, r[0]))
    found, _ = error_um(rpm, HALF, depth, modes, helix)
    assert found == pytest.approx(1e3 * seen[np.argmax(np.abs(seen))], rel=2e-3)


def test_a_stiff_mode_has_the_error_of_a_bar():
    """Far above the teeth's frequencies the motion is force over stiffness: -42.6727 um at z = 2 of 10 mm."""
    stiff = Modes([2e4], [0.05], [5000.0], [[0.0, 1.0]])
    found, _ = error_um(600, HALF, 10.0, stiff, 30.0)
    met, cutter = engagement_of_arcs([HALF[0]], [HALF[1]], 0.05, mill(helix=30.0), 10.0), mill(helix=30.0)
    at = math.pi + math.tan(math.radians(30.0)) / 5.0 * np.linspace(0.0, 10.0, 5)
    bar = forces_over_turn(met, cutter, METAL, at)[0][0, :, 1] / 5000.0
    assert found == pytest.approx(1e3 * bar[np.argmax(np.abs(bar))], rel=2e-2)


def test_up_milling_counts_the_other_wall_and_inner_arcs_none():
    up = tuple(math.pi - x for x in reversed(HALF))
    static = Modes([2e4], [0.05], [5000.0], [[0.0, 1.0]])
    assert error_um(600, up, 0.5, static)[1]
    assert error_um(600, (1.0, 2.0), 0.5) == (0.0, False)


def test_a_size_effect_is_refused():
    metal = Material("k", 700.0, 210.0, 0.0, 0.0, 0.0, 0.0, source="made up for tests", exponents=(0.2, 0.2, 0.2))
    with pytest.raises(InputError, match="has a size effect"):
        error_um(6000, HALF, 0.5, metal=metal)
