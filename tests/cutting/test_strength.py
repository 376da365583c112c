"""Stress of cutters against stepped bars in closed form, finite elements, a sum over slices, and one cutter by hand."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from chipload.cutter.cutter import Cutter
from chipload.cutter.slices import slices
from chipload.cutter.strength import ToolMaterial, ToolStrength
from chipload.cutter.table import cutter_from_table
from chipload.cutting.force import forces_over_turn
from chipload.cutting.material import Material
from chipload.cutting.strength import (
    allowed_stress,
    cutter_stress,
    normal_stress,
    section_loads,
    sections_of,
    von_mises_stress,
)
from chipload.engagement.tooth_engagement import ToothEngagement, engagement_of_arcs
from chipload.errors import InputError

SOFT = Material("soft", 900.0, 400.0, 0.0, 12.0, 18.0, 0.0, source="made up for this test")
THREE = Material("three", 800.0, 300.0, 150.0, 20.0, 15.0, 4.0, source="made up for this test")
#: a straight tooth, so that one alone cuts ahead in a slot
MILL = Cutter(10.0, 2, 0.0, 12.0, 30.0, 5.8e5)
HELIX = Cutter(10.0, 3, 0.6, 18.0, 40.0, 5.8e5, shank_diameter=9.0)


def slot(cutter: Cutter, feed: float = 0.1, depth: float = 3.0) -> ToothEngagement:
    return engagement_of_arcs([0.0], [math.pi], feed, cutter, depth)


def test_a_stepped_bar_in_closed_form() -> None:
    # w N/mm up to 3 mm, at a mean height of 1.5 mm: moments at the end of the flutes (8 mm thick) and in the clamp
    kt, kr = 900.0 * 0.1 + 12.0, 400.0 * 0.1 + 18.0
    force, torque = 3.0 * math.hypot(kt, kr), 3.0 * kt * 5.0

    def stress(z: float, d: float) -> float:
        sigma, tau = 32.0 * force * (z - 1.5) / (math.pi * d**3), 16.0 * torque / (math.pi * d**3)
        return 0.5 * sigma + math.hypot(0.5 * sigma, tau)

    expected = max(stress(12.0, 8.0), stress(30.0, 10.0))
    assert cutter_stress(slot(MILL), MILL, SOFT) == pytest.approx([expected], rel=1e-9)
    thin = replace(MILL, shank_diameter=6.0)
    assert cutter_stress(slot(thin), thin, SOFT) == pytest.approx([stress(30.0, 6.0)], rel=1e-9)


def test_steel_by_von_mises_and_a_notch() -> None:
    steel = replace(MILL, modulus=2.1e5, strength=ToolStrength(concentration=1.4))
    kt, kr = 900.0 * 0.1 + 12.0, 400.0 * 0.1 + 18.0
    sigma = 32.0 * 3.0 * math.hypot(kt, kr) * 28.5 / (math.pi * 1000.0)
    tau = 16.0 * 3.0 * kt * 5.0 / (math.pi * 1000.0)
    thick = replace(steel, fluted_factor=1.0)
    assert cutter_stress(slot(thick), thick, SOFT) == pytest.approx(
        [1.4 * math.hypot(sigma, math.sqrt(3) * tau)], rel=1e-9
    )


@pytest.mark.parametrize("material", [SOFT, replace(SOFT, exponents=(0.2, 0.2, 0.2))])
@pytest.mark.parametrize("mill", [MILL, replace(HELIX, modulus=2.1e5)])
def test_a_notch_multiplies_the_stress(material: Material, mill: Cutter) -> None:
    """With and without a size effect, carbide and steel: the stress of the smooth cutter times the factor."""
    notched = replace(mill, strength=ToolStrength(concentration=1.7))
    smooth = replace(mill, strength=ToolStrength(concentration=1.0))
    expected = 1.7 * cutter_stress(slot(smooth), smooth, material)
    assert cutter_stress(slot(notched), notched, material) == pytest.approx(expected, rel=1e-12)


def test_loads_of_a_helix_are_those_of_its_slices() -> None:
    """A sum over 4000 thin pieces of the edge of each tooth, forces as the edge's definition has them."""
    engagement, z = slot(HELIX, 0.08, 6.0), np.array([4.0, 18.0, 40.0])
    theta = np.array([0.3, 1.1, 1.9])
    found = section_loads(engagement, HELIX, THREE, theta, z)[0]
    n, lag = 4000, math.tan(HELIX.helix) / HELIX.radius
    heights = (np.arange(n) + 0.5) * 6.0 / n
    dz = 6.0 / n
    for k, turn in enumerate(theta):
        loads = np.zeros((3, 4))
        for j in range(3):
            phi = (turn - math.tau * j / 3 - lag * heights) % math.tau
            cuts = phi <= math.pi
            h = 0.08 * np.sin(phi)
            ft, fr, fa = (np.where(cuts, c * h + e, 0.0) * dz for c, e in ((800.0, 20.0), (300.0, 15.0), (150.0, 4.0)))
            # along T and n: u = (sin, cos), t = (cos, -sin); the axial force pulls the cutter out of its holder
            force = np.column_stack([-ft * np.cos(phi) - fr * np.sin(phi), ft * np.sin(phi) - fr * np.cos(phi)])
            for e, top in enumerate(z):
                below = heights <= top
                lever = (top - heights[below])[:, None] * force[below]
                arm = 5.0 * -fa[below, None] * np.column_stack([np.sin(phi), np.cos(phi)])[below]
                loads[e, :2] += (lever + arm).sum(axis=0)
                loads[e, 2] += -fa[below].sum()
                loads[e, 3] += 5.0 * ft[below].sum()
        np.testing.assert_allclose(found[k], loads, rtol=2e-3, atol=0.5)


def test_above_the_cut_the_lever_grows_by_the_force() -> None:
    engagement, theta = slot(HELIX, 0.08, 6.0), np.linspace(0.0, 2.0, 7)
    low, high = section_loads(engagement, HELIX, THREE, theta, [10.0, 40.0])[0].transpose(1, 0, 2)
    force, torque = forces_over_turn(engagement, HELIX, THREE, theta)
    np.testing.assert_allclose((high - low)[:, :2], 30.0 * force[0, :, :2], atol=1e-6)
    np.testing.assert_allclose(high[:, 2], force[0, :, 2], atol=1e-9)
    np.testing.assert_allclose(high[:, 3], torque[0], rtol=1e-9)


def frame_stress(force: float, at: float, cutter: Cutter, elements: int = 200) -> float:
    """Greatest bending stress of the cutter by beam finite elements: nodal loads, a stepped bar, curvature E D / 2."""
    z = np.linspace(0.0, cutter.overhang, elements + 1)
    a = cutter.overhang / elements
    K, f = np.zeros((2 * elements + 2, 2 * elements + 2)), np.zeros(2 * elements + 2)
    d = np.where(0.5 * (z[1:] + z[:-1]) < cutter.flute_length, 0.8 * cutter.diameter, cutter.diameter)
    for k in range(elements):
        stiff = cutter.modulus * math.pi * d[k] ** 4 / 64.0 / a**3
        own = stiff * np.array(
            [[12, 6 * a, -12, 6 * a], [6 * a, 4 * a * a, -6 * a, 2 * a * a], [-12, -6 * a, 12, -6 * a],
             [6 * a, 2 * a * a, -6 * a, 4 * a * a]]
        )  # fmt: skip
        at_nodes = slice(2 * k, 2 * k + 4)
        K[at_nodes, at_nodes] += own
    f[2 * round(at / a)] = force
    u = np.zeros(len(f))
    u[:-2] = np.linalg.solve(K[:-2, :-2], f[:-2])
    worst = 0.0
    for k in range(elements):
        e = u[2 * k : 2 * k + 4]
        for x in (0.0, 1.0):
            bend = ((12 * x - 6) * e[0] / a + (6 * x - 4) * e[1] + (6 - 12 * x) * e[2] / a + (6 * x - 2) * e[3]) / a
            worst = max(worst, abs(bend) * cutter.modulus * d[k] / 2.0)
    return worst


@pytest.mark.parametrize("flutes", [12.0, 24.0])
def test_bending_against_finite_elements(flutes: float) -> None:
    cutter = replace(MILL, flute_length=flutes)
    depth = 0.6  # nearly a point load, at 0.3 mm
    only = Material("only", 900.0, 0.0, 0.0, 12.0, 0.0, 0.0, source="made up for this test")
    at = sections_of(cutter)
    loads = section_loads(slot(cutter, 0.1, depth), cutter, only, [math.pi / 2], at.height)
    loads[..., 3] = 0.0
    found = normal_stress(loads, at.diameter).max()
    assert found == pytest.approx(frame_stress(depth * 102.0, 0.3, cutter), rel=1e-6)


def test_equivalent_stresses_of_plain_loads() -> None:
    # pure torsion: the greatest normal stress is the shear stress; pure tension and bending add on the pulled side
    twist = np.array([[0.0, 0.0, 0.0, 1000.0]])
    tau = 16.0 * 1000.0 / (math.pi * 216.0)
    assert normal_stress(twist, [6.0]) == pytest.approx([tau])
    assert von_mises_stress(twist, [6.0]) == pytest.approx([math.sqrt(3.0) * tau])
    pulled = np.array([[0.0, 600.0, -500.0, 0.0]])
    sigma = 32.0 * 600.0 / (math.pi * 216.0) + 4.0 * 500.0 / (math.pi * 36.0)
    assert normal_stress(pulled, [6.0]) == pytest.approx([sigma])
    assert von_mises_stress(pulled, [6.0]) == pytest.approx([sigma])
    assert normal_stress(-pulled, [6.0])[0] < sigma
    assert von_mises_stress(-pulled, [6.0]) == pytest.approx([sigma])


def test_a_taper_breaks_where_the_cone_is_weakest() -> None:
    """A force F at the tip of a cone d0 + 2 z tan(beta): F z / d^3 is greatest at z = d0 / (4 tan(beta))."""
    cone = Cutter(4.0, 2, 0.0, 40.0, 50.0, 5.8e5, taper=math.radians(5.0), shank_diameter=12.0)
    z = 4.0 / (4.0 * math.tan(math.radians(5.0)))
    at = sections_of(cone)
    assert at.height.max() == 50.0
    assert len(at.height) == 10
    np.testing.assert_allclose(at.diameter[:-1], 0.8 * (4.0 + 2.0 * at.height[:-1] * math.tan(math.radians(5.0))))
    stress = normal_stress(np.column_stack([at.height * 100.0, np.zeros(10), np.zeros(10), np.zeros(10)]), at.diameter)
    exact = 32.0 * 100.0 * z / (math.pi * (0.8 * 6.0) ** 3)
    assert stress.max() == pytest.approx(exact, rel=0.01)


def test_stress_of_every_slice_form_is_finite_and_air_has_none() -> None:
    empty = ToothEngagement(np.array([0, 0]), np.zeros((0, 7)), np.zeros(0), np.zeros(0), slices(MILL).columns)
    assert cutter_stress(empty, MILL, SOFT).tolist() == [0.0]


def test_strengths_by_material_and_as_stated() -> None:
    assert allowed_stress(MILL) == 1500.0
    steel = replace(MILL, modulus=2.1e5)
    assert steel.strength.material_at(steel.modulus) is ToolMaterial.HSS
    assert allowed_stress(steel) == 1625.0
    table = {"number": 1, "diameter_mm": 10.0, "flutes": 2, "helix_deg": 0.0, "flute_length_mm": 12.0}
    table |= {"overhang_mm": 30.0, "modulus_gpa": 580.0}
    stated = {"tool_material": "carbide", "strength_mpa": 3600.0, "safety_factor": 1.5, "stress_concentration": 1.2}
    own = cutter_from_table({**table, **stated, "fluted_factor": 0.7})
    assert own.strength == ToolStrength(ToolMaterial.CARBIDE, 3600.0, 1.5, 1.2)
    assert allowed_stress(own) == pytest.approx(2400.0)
    assert own.fluted_factor == 0.7
    assert own.strength.source(own.modulus) == "as stated in the job"
    assert "10.1098/rsta.2017.0443" in MILL.strength.source(MILL.modulus)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"strength_mpa": 3.0}, "cutter.strength_mpa = 3: must be from 100 to 10000 (carbide 3000)"),
        ({"safety_factor": 0.9}, "cutter.safety_factor = 0.9: must be from 1 to 100"),
        ({"stress_concentration": 0.0}, "cutter.stress_concentration = 0: must be from 1 to 100"),
        (
            {"fluted_factor": 1.1},
            "cutter.fluted_factor = 1.1: must be above 0 and at most 1 (0.8 is usual for end mills)",
        ),
        ({"tool_material": "wood"}, "cutter.tool_material = 'wood': must be carbide or hss"),
        (
            {"tool_material": "hss"},
            'cutter.tool_material = "hss" with modulus_gpa = 580: it has about 210: state the other material or the '
            "right modulus",
        ),
    ],
)
def test_refused(change: dict[str, object], message: str) -> None:
    table = {"number": 1, "diameter_mm": 10.0, "flutes": 2, "helix_deg": 0.0, "flute_length_mm": 12.0}
    with pytest.raises(InputError) as err:
        cutter_from_table({**table, "overhang_mm": 30.0, "modulus_gpa": 580.0, **change})
    assert str(err.value) == message
