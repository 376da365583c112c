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
from chipload.engagement.tooth_surfaces import chips_of_teeth
from chipload.errors import InputError
from engagement.tooth_paths import loads

COEFFICIENTS = (900.0, 300.0, 150.0, 12.0, 8.0, 3.0)
METAL = Material("m", *COEFFICIENTS, source="made up for tests")
PITCH = (50.0, 120.0, 80.0, 110.0)
FEED, DEPTH, ARC = 0.06, 6.0, (0.6, 2.9)


def mill(helix: float = 30.0, pitch: tuple[float, ...] = PITCH, runout: tuple[float, float] = (0.0, 0.0)) -> Cutter:
    return Cutter(
        10.0, 4, math.radians(helix), 20.0, 30.0, 6e5, runout=runout, pitch=tuple(math.radians(p) for p in pitch)
    )


def by_tooth(theta: np.ndarray, cutter: Cutter, discs: int = 2000) -> np.ndarray:
    """Force along T, n and A [N] of thin discs, each tooth on its true path where its pitches put it."""
    z, R = (np.arange(discs) + 0.5) * DEPTH / discs, cutter.radius
    edge = np.column_stack([0 * z + R, 0 * z + 1.0, 0 * z, math.tan(cutter.helix) / R * z, 0 * z + DEPTH / discs])
    force, rest = np.zeros((len(theta), 3)), (np.zeros(len(theta)), np.zeros(len(theta)))
    low, high = R * math.cos(ARC[1]), R * math.cos(ARC[0])
    loads(
        edge,
        np.array(cutter.pitch),
        4 * FEED / math.tau,
        *cutter.runout,
        low,
        high,
        np.array(COEFFICIENTS),
        theta,
        force,
        *rest,
    )
    return force


@pytest.mark.parametrize("runout", [(0.0, 0.0), (0.012, 0.7)])
@pytest.mark.parametrize("helix", [0.0, 30.0])
def test_forces_are_those_of_thin_discs(helix: float, runout: tuple[float, float]) -> None:
    """The phase of a turn is free: what is compared is the force over the turn, at the shift that fits."""
    cutter = mill(helix, runout=runout)
    cut = chips_of_teeth(engagement_of_arcs([ARC[0]], [ARC[1]], FEED, cutter, DEPTH), cutter)
    late = cutter.tooth_angles - math.tau / 4 * np.arange(4)
    theta = np.linspace(0.0, math.tau, 41)[:-1] + 0.01
    found = forces_over_turn(cut, cutter, METAL, theta - late.min())[0][0]
    wanted = by_tooth(theta, cutter)
    assert np.abs(found - wanted).max() < 8e-3 * np.abs(wanted).max()
    assert np.abs(found - found.mean(axis=0)).max() > 0.1 * np.abs(wanted).max()


def test_a_revolution_removes_and_costs_what_it_does_with_even_teeth() -> None:
    """The sum of all thicknesses is N f_z but for the second order: without edge forces the mean torque is that of even
    teeth.
    """
    plain = replace(METAL, Kte=0.0, Kre=0.0, Kae=0.0)
    even, uneven = mill(pitch=()), mill()
    torque = []
    for cutter in (even, uneven):
        cut = chips_of_teeth(engagement_of_arcs([ARC[0]], [ARC[1]], FEED, cutter, DEPTH), cutter)
        torque.append(float(mean_forces(cut, cutter, plain)[1][0]))
    assert torque[1] == pytest.approx(torque[0], rel=2e-3)
    front = engagement_of_arcs([ARC[0]], [ARC[1]], FEED, even, DEPTH)
    chips = [chips_of_teeth(front, c).chip_max()[0] for c in (even, uneven)]
    assert chips[1] / chips[0] == pytest.approx(120.0 / 90.0, rel=1e-3)


def test_even_pitches_change_nothing() -> None:
    front = engagement_of_arcs([ARC[0]], [ARC[1]], FEED, mill(), DEPTH)
    cut = [chips_of_teeth(front, mill(pitch=p)) for p in ((), (90.0,) * 4)]
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
