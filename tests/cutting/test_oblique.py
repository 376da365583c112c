"""Oblique coefficients against vectors on the rake face and the shear plane, and the orthogonal closed form."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import chipload.examples
from chipload.cutting.material import read_material
from chipload.errors import InputError
from oblique import Orthogonal, oblique_coefficients, oblique_material

#: Ti6Al4V, rake in degrees, as [Budak1996] prints it
TITANIUM = Orthogonal(
    "ti6al4v",
    "Budak, Altintas, Armarego 1996",
    613.0,
    lambda rake, h: math.radians(19.1 + 0.29 * math.degrees(rake)),
    chip_ratio=lambda rake, h: (1.755 - 0.028 * math.degrees(rake)) * h ** (0.331 - 0.0082 * math.degrees(rake)),
    edge=(24.0, 43.0),
)


@settings(max_examples=200, deadline=None)
@given(st.floats(-0.2, 0.4), st.floats(0.0, 1.0), st.floats(0.2, 0.7), st.floats(0.2, 0.6))
def test_the_force_lies_on_the_rake_and_shears_with_tau(rake, inclination, friction, shear):
    """x in the normal plane in the cutting plane, y along the edge, z out of the work. The force on the chip, taken
    apart on the rake face: friction / normal = tan(beta_a), along eta; on the shear plane: tau x its area.
    """
    tau, h, width = 500.0, 0.1, 1.0
    tests = Orthogonal("made up", "made up", tau, friction, shear_angle=shear)
    Ktc, Krc, Kac = oblique_coefficients(tests, rake, inclination, h)
    c, s = math.cos(inclination), math.sin(inclination)
    velocity, across = np.array([c, s, 0.0]), np.array([s, -c, 0.0])
    force = h * width * (Ktc * velocity + Kac * across + Krc * np.array([0.0, 0.0, -1.0]))
    up_rake = np.array([-math.sin(rake), 0.0, math.cos(rake)])
    into_chip = np.array([math.cos(rake), 0.0, math.sin(rake)])
    edge = np.array([0.0, 1.0, 0.0])
    push = force @ into_chip
    drag = np.array([-(force @ up_rake), force @ edge])
    assert np.hypot(*drag) / push == pytest.approx(math.tan(friction), rel=1e-9)
    assert math.atan2(drag[1], drag[0]) == pytest.approx(inclination, abs=1e-9)
    on_shear = np.array([math.cos(shear), 0.0, math.sin(shear)])
    area = (width / c) * h / math.sin(shear)
    assert math.hypot(force @ on_shear, force @ edge) == pytest.approx(tau * area, rel=1e-9)


@pytest.mark.parametrize(("rake", "friction", "shear"), [(0.1, 0.5, 0.4), (-0.1, 0.6, 0.5)])
def test_without_inclination_it_is_merchant_s_circle(rake, friction, shear):
    tests = Orthogonal("made up", "made up", 450.0, friction, shear_angle=shear)
    base = 450.0 / (math.sin(shear) * math.cos(shear + friction - rake))
    expected = (base * math.cos(friction - rake), base * math.sin(friction - rake), 0.0)
    assert oblique_coefficients(tests, rake, 0.0, 0.1) == pytest.approx(expected, rel=1e-12)


def test_the_chip_ratio_gives_the_shear_angle():
    """tan(phi) = r cos(alpha) / (1 - r sin(alpha)): at rake 0 and r = 0.5 it is atan(0.5)."""
    by_ratio = Orthogonal("a", "made up", 450.0, 0.5, chip_ratio=0.5)
    by_angle = Orthogonal("a", "made up", 450.0, 0.5, shear_angle=math.atan(0.5))
    assert oblique_coefficients(by_ratio, 0.0, 0.4, 0.1) == pytest.approx(
        oblique_coefficients(by_angle, 0.0, 0.4, 0.1), rel=1e-12
    )


def test_of_titanium_by_hand():
    """Rake 0, h 0.1, no helix: r = 1.755 x 0.1^0.331, tan(phi) = r, beta 19.1 deg; a thinner chip asks for more."""
    r = 1.755 * 0.1**0.331
    phi, beta = math.atan(r), math.radians(19.1)
    ktc = 613.0 * math.cos(beta) / (math.sin(phi) * math.cos(phi + beta))
    titanium = oblique_material(TITANIUM, 0.0, 0.0, 0.1)
    assert titanium.Ktc == pytest.approx(ktc, rel=1e-12)
    assert titanium.coefficients[3:] == (24.0, 43.0, 0.0)
    assert titanium.source == "Budak, Altintas, Armarego 1996"
    assert titanium.cutter == "normal rake 0 deg, helix 0 deg"
    thin = oblique_material(TITANIUM, math.radians(12.0), math.radians(30.0), 0.02)
    thicker = oblique_material(TITANIUM, math.radians(12.0), math.radians(30.0), 0.1)
    assert thin.Ktc > thicker.Ktc
    assert thicker.Kac > 0.0


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"rake": 2.0}, "rake_deg = 114.592: must be between -90 and 90"),
        ({"inclination": -0.1}, "inclination_deg = -5.72958: must be from 0 to below 90"),
        ({"thickness": 0.0}, "chip thickness = 0 mm: must be above 0"),
        ({"shear_stress": -1.0}, "orthogonal tests of a: shear_stress = -1 MPa: must be above 0"),
        ({"friction": 2.0}, "orthogonal tests of a: friction = 114.592 deg: must be from 0 to below 90"),
        (
            {"shear_angle": 1.4},
            "orthogonal tests of a: shear angle 80.2141 deg at rake 0 deg, 0.1 mm: must be above 0 and below 61.3521",
        ),
        ({"chip_ratio": 0.5}, "orthogonal tests of a: give one of shear_angle and chip_ratio, not both"),
        ({"shear_angle": None}, "orthogonal tests of a: give one of shear_angle and chip_ratio, not both"),
        ({"shear_angle": None, "chip_ratio": -0.5}, "orthogonal tests of a: chip_ratio = -0.5: must be above 0"),
    ],
)
def test_refused(change, message):
    tests = {"name": "a", "source": "made up", "shear_stress": 450.0, "friction": 0.5, "shear_angle": 0.4}
    edge = {"rake": 0.0, "inclination": 0.0, "thickness": 0.1}
    with pytest.raises(InputError) as err:
        oblique_coefficients(
            Orthogonal(**{**tests, **{k: v for k, v in change.items() if k not in edge}}),
            **{**edge, **{k: v for k, v in change.items() if k in edge}},
        )
    assert str(err.value) == message


@pytest.mark.parametrize("example", ["plate", "blade"])
def test_the_titanium_of_the_examples(example):
    """Rake 0, helix 30 deg, chip 0.03 mm, as its file states; written to 0.1 MPa."""
    shipped = read_material(Path(chipload.examples.__file__).parent / example / "ti6al4v.toml")
    made = oblique_material(TITANIUM, 0.0, math.radians(30.0), 0.03)
    assert shipped.coefficients == pytest.approx(made.coefficients, abs=0.06)
