"""Tubes and cones as solids of hexahedra against the shell; a ring and a beam in closed form against the solid."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from chipload.errors import InputError
from chipload.structure.shell import Shell, beam_compliance, compliance, ritz
from chipload.structure.wall_solid import normal_compliance, wall_solid

TUBE = Shell(20.0, 60.0, 1.0, 70e3, 0.33)


@pytest.mark.parametrize(
    ("thickness", "angle_deg", "apart"), [(1.0, 0.0, 0.012), (2.0, 0.0, 0.03), (1.0, 10.0, 0.015), (1.0, -10.0, 0.015)]
)
def test_against_the_shell(thickness, angle_deg, apart):
    """A force on 3 x 4 mm at the rim and inside: two theories of one wall; the solid has shear, so it is softer."""
    shell = replace(TUBE, thickness=thickness, cone_angle=math.radians(angle_deg))
    modes, wall = ritz(shell), wall_solid(shell, (24, 20, 1))
    for middle in (58.5, 40.0):
        thin = float(compliance(modes, middle, s_point=middle + 1.5, length=3.0, width=4.0)[2, 2])
        thick = normal_compliance(wall, middle, middle + 1.5, 3.0, 4.0)
        assert thick == pytest.approx(thin, rel=apart)


def test_a_long_narrow_tube_is_a_beam():
    """L / R = 20, t / R = 0.4: hardly anything ovalises, s^3 / 3EI + s / kGA; of a normal force that is spread over 2 a
    round, sin(a) / a pulls to one side."""
    shell = Shell(5.0, 100.0, 2.0, 70e3, 0.3)
    wall = wall_solid(shell, (10, 24, 1), growth=1.0)
    found = normal_compliance(wall, 97.5, 97.5, 5.0, 15.0)
    inertia = math.pi / 4.0 * (6.0**4 - 4.0**4)
    thin = 0.5 * (math.tau * 5.0 * 2.0) * 25.0
    bending = 97.5**3 / (3.0 * 70e3 * inertia)
    shear = beam_compliance(shell, 97.5) - 97.5**3 / (3.0 * 70e3 * thin)
    assert found == pytest.approx((bending + shear) * math.sin(1.5) / 1.5, rel=0.02)


def test_a_finer_mesh_agrees():
    coarse, fine = (normal_compliance(wall_solid(TUBE, n), 58.5, 60.0, 3.0, 4.0) for n in ((20, 14, 1), (30, 24, 1)))
    assert coarse == pytest.approx(fine, rel=0.012)


def test_refused():
    with pytest.raises(InputError, match="must be clamped"):
        wall_solid(replace(TUBE, ends="diaphragms"))
    with pytest.raises(InputError, match="must be at least 1"):
        wall_solid(TUBE, (0, 4, 1))
    with pytest.raises(InputError, match="must lie on the wall"):
        normal_compliance(wall_solid(TUBE, (6, 6, 1)), 59.9, 60.0, 3.0, 4.0)


def test_nothing_moves_at_the_clamp():
    wall = wall_solid(TUBE, (12, 10, 1))
    assert np.isclose(normal_compliance(wall, 58.5, 0.0, 3.0, 4.0), 0.0, atol=1e-15)
