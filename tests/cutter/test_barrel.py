"""Barrel cutters: limits of their numbers, lengths and areas of their slices, the APT statement."""

from __future__ import annotations

import math

import numpy as np
import pytest

from chipload.cutter.cutter import Cutter
from chipload.cutter.slices import slices
from chipload.cutter.table import cutter_from_table
from chipload.cutting.strength import sections_of
from chipload.engagement.chips.section import distance
from chipload.errors import InputError

OVAL = Cutter(12.0, 3, 0.5, 28.0, 50.0, 6e5, corner_radius=2.0, barrel_radius=85.0)
CONE = Cutter(8.0, 4, 0.4, 20.0, 50.0, 6e5, corner_radius=1.5, barrel_radius=250.0, taper=math.radians(12.0))
MILL = {"number": 1, "diameter_mm": 12.0, "flutes": 3, "helix_deg": 30.0, "flute_length_mm": 28.0, "overhang_mm": 50.0,
        "modulus_gpa": 580.0, "corner_radius_mm": 2.0, "barrel_radius_mm": 85.0}  # fmt: skip


@pytest.mark.parametrize("cutter", [OVAL, CONE], ids=["tangential", "conical"])
def test_slices_have_the_length_and_the_lateral_area_of_the_profile(cutter: Cutter) -> None:
    z = np.linspace(0.0, cutter.flute_length, 2_000_001)
    rho = cutter.radius_at(z)
    ds = np.hypot(np.diff(z), np.diff(rho))
    own = slices(cutter, corner_slices=60, flank_mm=0.2)
    assert own.s_to[-1] - own.s_from[0] == pytest.approx(ds.sum(), rel=1e-5)
    assert own.s_from[1:] == pytest.approx(own.s_to[:-1], abs=1e-12)
    area = (own.rho * (own.s_to - own.s_from)).sum()
    assert area == pytest.approx((0.5 * (rho[1:] + rho[:-1]) * ds).sum(), rel=1e-4)
    k = np.arange(5, len(own), 7)
    slope = (cutter.radius_at(own.z_middle[k] + 1e-6) - cutter.radius_at(own.z_middle[k] - 1e-6)) / 2e-6
    assert own.cos_kappa[k] / own.sin_kappa[k] == pytest.approx(slope, abs=1e-4)


def test_a_profile_by_chords_lies_within_its_chord() -> None:
    points = OVAL.profile(1e-3)
    middle = 0.5 * (points[1:] + points[:-1])
    inside = -distance(OVAL, middle[:, 0], middle[:, 1])
    assert inside.min() > -1e-9
    assert 5e-4 < inside.max() < 1e-3
    assert OVAL.radius_at(points[1:, 1]) == pytest.approx(points[1:, 0], abs=1e-9)


def test_the_thinner_part_bears_the_moment_too() -> None:
    found = sections_of(OVAL)
    assert found.diameter[:-1] == pytest.approx(1.6 * OVAL.radius_at(found.height[:-1]))
    assert found.height[0] < 3.0


def test_a_job_states_a_barrel() -> None:
    assert cutter_from_table(MILL).flank_arc == OVAL.flank_arc


@pytest.mark.parametrize(
    ("key", "value", "says"),
    [
        ("barrel_radius_mm", 5.0, "cutter.barrel_radius_mm = 5: must be above 6, the distance of the corner's centre"),
        ("corner_radius_mm", 6.0, "cutter.corner_radius_mm = 6: must be below 6, the distance of the corner's centre"),
        ("corner_e_mm", 6.0, "cutter.corner_e_mm = 6: must be from 0, a round tip, to below diameter_mm / 2 = 6"),
        ("flute_length_mm", 1.0, "cutter.flute_length_mm = 1: must be above 1.38"),
        ("bottom_deg", 80.0, "cutter.barrel_radius_mm = 85: its arc leaves the corner at"),
        (
            "body_mm",
            [[6.0, 0.0], [6.0, 28.0]],
            "cutter.barrel_radius_mm = 85: with body_mm nothing cuts: leave one out",
        ),
        (
            "profile_radius_mm",
            85.0,
            "cutter.profile_radius_mm: the radius of the flank arc of a barrel cutter is barrel",
        ),
    ],
)
def test_what_makes_no_barrel_is_refused(key: str, value: object, says: str) -> None:
    with pytest.raises(InputError) as told:
        cutter_from_table({**MILL, key: value})
    assert str(told.value).startswith(says)
