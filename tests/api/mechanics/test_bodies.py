"""Compliance and modes against cantilevers and plates in closed form."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

import chipload
from api.mechanics.steady_cuts import METAL, engagement, mill
from chipload.errors import InputError

STRIP = chipload.Plate(
    length_mm=10.0, height_mm=100.0, thickness_mm=4.0, modulus_gpa=70.0, poisson=0.0, density_kg_m3=2700.0,
    elements=(2, 10, 1),
)  # fmt: skip
#: the same as a part of cells
PART = chipload.ClampedPart(
    chipload.Stock.block((0.0, 0.0, 0.0), (10.0, 100.0, 4.0)),
    chipload.Workpiece(
        modulus_gpa=70.0, poisson=0.0, clamps=(chipload.WorkpieceClamp(face="y-"),), density_kg_m3=2700.0, cell_mm=4.0,
        order=3,
    ),
)  # fmt: skip
INERTIA = 10.0 * 4.0**3 / 12.0


# -- beam -------------------------------------------------------------------------------------------------------
@pytest.mark.parametrize("at", [0.0, 5.0, 12.0])
def test_a_bar_is_a_cantilever(at):
    """(l - z)^3 / (3 E I) under the force itself, steel of 580 GPa, d 10."""
    bar = mill(fluted_factor=1.0)
    want = (35.0 - at) ** 3 / (3.0 * 580e3 * math.pi * 10.0**4 / 64.0) * 1000.0
    assert chipload.compliance(bar, at) == pytest.approx([want], rel=1e-12)


def test_a_bar_is_symmetric_between_places():
    a, b = chipload.compliance(mill(), [0.0, 20.0], [20.0, 0.0])
    assert a == pytest.approx(b, rel=1e-12)
    assert a < chipload.compliance(mill(), [0.0])[0]


# -- plate and part ---------------------------------------------------------------------------------------------
@pytest.mark.parametrize("y", [50.0, 75.0])
def test_a_strip_is_a_cantilever(y):
    """y^3 / (3 E I) with the shear y / (k G A) of a square section, k = 5/6; the tip takes y^2 (3 l - y) / (6 E I)."""
    shear = y / (5.0 / 6.0 * 35e3 * 40.0)
    own, tip = chipload.compliance(STRIP, [[5.0, y]] * 2, [[5.0, y], [5.0, 100.0]])
    assert own == pytest.approx(1000.0 * (y**3 / (3.0 * 70e3 * INERTIA) + shear), rel=5e-3)
    assert tip == pytest.approx(1000.0 * (y**2 * (300.0 - y) / (6.0 * 70e3 * INERTIA) + shear), rel=3e-3)


def test_a_part_of_cells_is_the_same_cantilever():
    """The force is spread over the width of the strip, so that it bends as a beam does."""
    line = [[[0.0, 75.0, 4.0], [10.0, 75.0, 4.0]]]
    found = chipload.compliance(PART, line, [[5.0, 100.0, 4.0]])
    want = 1000.0 * (75.0**2 * 225.0 / (6.0 * 70e3 * INERTIA) + 75.0 / (5.0 / 6.0 * 35e3 * 40.0))
    assert found.shape == (1, 3, 3)
    assert found[0, 2, 2] == pytest.approx(want, rel=1e-2)
    assert chipload.compliance(PART, line).shape == (1, 3, 3)


@pytest.mark.parametrize("body", [STRIP, PART], ids=["plate", "part"])
def test_the_first_mode_of_a_strip(body):
    """Euler-Bernoulli, 0.2 % of it shear and rotation; the modal mass at the tip is m / 4."""
    points = [[5.0, 100.0]] if body is STRIP else [[5.0, 100.0, 4.0]]
    found = chipload.modes(body, 1, points)
    want = 1.8751**2 / (2.0 * math.pi * 0.1**2) * math.sqrt(70e9 * 0.004**2 / (12.0 * 2700.0))
    assert found.frequency_hz[0] == pytest.approx(want, rel=5e-3)
    # the modal mass of a cantilever at its tip is a quarter of its own
    assert found.shape_per_root_kg[0, 0, 2] ** 2 == pytest.approx(4.0 / (2700.0 * 4e-6), rel=5e-3)
    assert chipload.modes(body, 2).shape_per_root_kg.shape == (2, 0, 3)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: replace(STRIP, thickness_mm=0.0), "plate.thickness_mm = 0: must be above 0"),
        (
            lambda: replace(STRIP, clamped=("north",)),
            "plate.clamped = 'north': must be one or more of left, right, bottom, top",
        ),
        (lambda: replace(STRIP, clamped=()), "plate.clamped = (): must be one or more of left, right, bottom, top"),
        (
            lambda: replace(STRIP, elements=(0, 1, 1)),
            "plate.elements = (0, 1, 1): must be three whole numbers of at least 1",
        ),
        (
            lambda: chipload.compliance(STRIP, [[5.0, 120.0]]),
            "point 0 (5, 120) mm: must lie on the plate, x from 0 to 10, y from 0 to 100",
        ),
        (lambda: chipload.compliance(STRIP, [5.0]), "points of shape (1,): must be (n, 2) finite numbers in mm"),
        (
            lambda: chipload.compliance(STRIP, [[5.0, 1.0]], [[5.0, 1.0]] * 2),
            "compliance: 1 forces and 2 points: must be as many",
        ),
        (
            lambda: chipload.compliance(PART, [[5.0, 1.0]]),
            "compliance: force_at_mm of shape (1, 2): must be (n, 2, 3), ends of contact lines",
        ),
        (
            lambda: chipload.compliance(mill(), [40.0]),
            "compliance: z_force = 40 mm: must be from 0 to cutter.overhang_mm = 35",
        ),
        (
            lambda: chipload.compliance(3.0, [0.0]),
            "compliance: float: give a chipload.Cutter, a chipload.Plate or a chipload.ClampedPart",
        ),
        (
            lambda: chipload.modes(replace(STRIP, density_kg_m3=None)),
            "plate.density_kg_m3: missing: natural modes need the mass of the plate",
        ),
        (
            lambda: chipload.modes(mill()),
            "modes: CutterTable: give a chipload.Plate or a chipload.ClampedPart; those of a cutter in its holder are "
            "measured: chipload tap",
        ),
        (
            lambda: replace(PART, workpiece=replace(PART.workpiece, cell_mm=None)),
            "part.workpiece.cell_mm: missing: state the side of the cells",
        ),
    ],
)
def test_what_has_no_compliance_is_refused(call, message):
    with pytest.raises(InputError) as err:
        call()
    assert str(err.value) == message


# -- the error of a wall ----------------------------------------------------------------------------------------
def test_a_shallow_cut_bends_the_cutter_by_its_edge_force():
    """Zero helix, up milling: at immersion 0 the tooth has h = 0, so that F_n = -Kre ap bends the tip."""
    cut = engagement("up", ap=0.02, ae=1.0)
    found = chipload.wall_form_error(mill(fluted_factor=1.0), METAL, cut, 0.02)
    per_n = 35.0**3 / (3.0 * 580e3 * math.pi * 10.0**4 / 64.0)
    assert found.error_um == pytest.approx(np.full(101, 5.0 * 0.02 * per_n * 1000.0), rel=2e-2)
    with_work = chipload.wall_form_error(mill(fluted_factor=1.0), METAL, cut, 0.02, work_um_n=1.0)
    assert with_work.error_um - found.error_um == pytest.approx(np.full(101, 5.0 * 0.02), rel=2e-2)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({}, "engagement: 0 to 180 deg: makes two walls: must begin at 0 or end at 180, not both"),
        (
            {"engagement": chipload.CutEngagement(entry_deg=30.0, exit_deg=60.0, axial_depth_mm=1.0)},
            "engagement: 30 to 60 deg: makes no wall: must begin at 0 or end at 180, not both",
        ),
        ({"work_um_n": -1.0}, "work_um_n = -1: must be at least 0 (0 is rigid)"),
        (
            {"engagement": engagement("up", ae=1.0), "height_mm": [50.0]},
            "z: must be heights from 0 to cutter.overhang_mm = 35",
        ),
    ],
)
def test_a_form_error_that_cannot_be_is_refused(values, message):
    stated = {"engagement": engagement(), "feed_per_tooth_mm": 0.05}
    with pytest.raises(InputError) as err:
        chipload.wall_form_error(mill(), METAL, **{**stated, **values})
    assert str(err.value) == message
