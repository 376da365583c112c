"""Teeth that are not evenly spaced: forces tooth by tooth, what a revolution removes, what is refused."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from chipload.cutter.cutter import Cutter
from chipload.cutter.table import cutter_from_table
from chipload.cutting.force import forces_over_turn, mean_forces
from chipload.cutting.material import Material
from chipload.cutting.wall_error import wall_error_along
from chipload.engagement.tooth_engagement import engagement_of_arcs
from chipload.errors import InputError

METAL = Material("m", 900.0, 300.0, 150.0, 12.0, 8.0, 3.0, source="made up for tests")
PITCH = (50.0, 120.0, 80.0, 110.0)
FEED, DEPTH, ARC = 0.06, 6.0, (0.6, 2.9)


def mill(helix: float = 30.0, pitch: tuple[float, ...] = PITCH, runout: tuple[float, float] = (0.0, 0.0)) -> Cutter:
    return Cutter(
        10.0, 4, math.radians(helix), 20.0, 30.0, 6e5, runout=runout, pitch=tuple(math.radians(p) for p in pitch)
    )


def by_tooth(theta: float, cutter: Cutter, discs: int = 3000) -> np.ndarray:
    """Force along T, n and A [N] from thin discs, each tooth where its pitches put it; it cuts what is left there."""
    angle = np.zeros(4)
    for j in range(1, 4):
        angle[j] = angle[j - 1] + cutter.pitch[j]
    e, towards = cutter.runout
    radius = e * np.cos(towards - angle)
    z = (np.arange(discs) + 0.5) * DEPTH / discs
    total = np.zeros(3)
    for j in range(4):
        phi = (theta - angle[j] - math.tan(cutter.helix) / cutter.radius * z) % math.tau
        left = np.full(discs, math.inf)
        for m in range(1, 5):
            turn = sum(cutter.pitch[(j - i) % 4] for i in range(m)) if m < 4 else math.tau
            left = np.minimum(left, FEED * 4 * turn / math.tau * np.sin(phi) + radius[j] - radius[(j - m) % 4])
        on = (phi > ARC[0]) & (phi < ARC[1]) & (left > 0.0)
        h, s, c = left[on], np.sin(phi[on]), np.cos(phi[on])
        t, r, a = 900.0 * h + 12.0, 300.0 * h + 8.0, 150.0 * h + 3.0
        total += np.array([-t * c - r * s, t * s - r * c, -a]).sum(axis=1) * DEPTH / discs
    return total


@pytest.mark.parametrize("runout", [(0.0, 0.0), (0.012, 0.7)])
@pytest.mark.parametrize("helix", [0.0, 30.0])
def test_forces_are_those_of_thin_discs(helix: float, runout: tuple[float, float]) -> None:
    """The phase of a turn is free: what is compared is the force over the turn, at the shift that fits."""
    cutter = mill(helix, runout=runout)
    cut = engagement_of_arcs([ARC[0]], [ARC[1]], FEED, cutter, DEPTH)
    late = cutter.tooth_angles - math.tau / 4 * np.arange(4)
    theta = np.linspace(0.0, math.tau, 41)[:-1] + 0.01
    found = forces_over_turn(cut, cutter, METAL, theta - late.min())[0][0]
    wanted = np.array([by_tooth(t, cutter) for t in theta])
    assert np.abs(found - wanted).max() < 2e-3 * np.abs(wanted).max()
    assert np.abs(found - found.mean(axis=0)).max() > 0.1 * np.abs(wanted).max()


def test_a_revolution_removes_and_costs_what_it_does_with_even_teeth() -> None:
    """The sum of all thicknesses is N f_z: without edge forces the mean torque is that of even teeth."""
    plain = replace(METAL, Kte=0.0, Kre=0.0, Kae=0.0)
    even, uneven = mill(pitch=()), mill()
    torque = []
    for cutter in (even, uneven):
        cut = engagement_of_arcs([ARC[0]], [ARC[1]], FEED, cutter, DEPTH)
        torque.append(float(mean_forces(cut, cutter, plain)[1][0]))
    assert torque[1] == pytest.approx(torque[0], rel=1e-12)
    chips = [engagement_of_arcs([ARC[0]], [ARC[1]], FEED, c, DEPTH).chip_max()[0] for c in (even, uneven)]
    assert chips[1] / chips[0] == pytest.approx(120.0 / 90.0)


def test_even_pitches_change_nothing() -> None:
    cut = [engagement_of_arcs([ARC[0]], [ARC[1]], FEED, mill(pitch=p), DEPTH) for p in ((), (90.0,) * 4)]
    theta = np.linspace(0.0, math.tau, 30)
    one, two = (
        forces_over_turn(c, mill(pitch=p), METAL, theta)[0] for c, p in zip(cut, ((), (90.0,) * 4), strict=True)
    )
    assert two == pytest.approx(one, rel=1e-12, abs=1e-9)


def test_the_job_states_it_in_degrees() -> None:
    table = {
        "number": 1, "diameter_mm": 10.0, "flutes": 4, "helix_deg": 30.0, "flute_length_mm": 22.0, "overhang_mm": 35.0,
        "modulus_gpa": 580.0,
    }  # fmt: skip
    cutter = cutter_from_table({**table, "pitch_deg": [88.0, 92.0, 88.0, 92.0]})
    assert np.degrees(cutter.tooth_angles) == pytest.approx([0.0, 92.0, 180.0, 272.0])
    with pytest.raises(InputError, match=r"cutter.pitch_deg = .*must be 4 angles .* add up to 350"):
        cutter_from_table({**table, "pitch_deg": [80.0, 90.0, 90.0, 90.0]})
    with pytest.raises(InputError, match="must be 4 angles"):
        cutter_from_table({**table, "pitch_deg": [180.0, 180.0]})


def test_the_error_of_a_planned_wall_is_refused() -> None:
    with pytest.raises(InputError, match="known for evenly spaced teeth"):
        wall_error_along([2.9], [math.pi], 0.05, mill(), METAL, 1.0, milling="down")
