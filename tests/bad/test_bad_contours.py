"""Contours that a cutter, a side or a depth does not go with: each refused with its place and a remedy."""

import math
from dataclasses import replace

import pytest

from chipload.cutter.cutter import Cutter
from chipload.cutting.material import material_named
from chipload.errors import InputError
from chipload.geometry.contour import Contour
from chipload.machine.machine import machine_named
from chipload.planning.contour.plan import plan_contour
from finishing import FINISHING, QUARTER

BASE = replace(FINISHING, tolerance=0.001)
SQUARE = Contour.polyline([(0, 0), (40, 0), (40, 30), (0, 30)], closed=True)
CHAIN = Contour.polyline([(0, 0), (20, 0), (30, 10)])


def rounded(r):
    corners = [(r, 0), (40 - r, 0), (40, r), (40, 30 - r), (40 - r, 30), (r, 30), (0, 30 - r), (0, r)]
    return Contour.from_bulges(corners, [0, QUARTER] * 4, closed=True)


def refused(contours, diameter=10.0, **changes):
    cutter = Cutter(diameter, 4, math.radians(30), 22.0, 35.0, 580e3)
    with pytest.raises(InputError) as err:
        plan_contour(contours, replace(BASE, **changes), cutter, material_named("al7075-t6"), machine_named("vmc"), {})
    return str(err.value)


def test_sharp_inside_corner():
    assert refused([SQUARE]) == (
        "cutter.diameter_mm = 10: does not reach the wall at (0.0000, 0.0000), leaves 2.071 mm: "
        "no cutter fits a sharp inside corner: draw a fillet, or mill it with kind = pocket"
    )


def test_corner_smaller_than_the_cutter():
    text = refused([rounded(3.0)])
    assert text.startswith("cutter.diameter_mm = 10: does not reach the wall at (")
    assert "leaves 0.8284 mm" in text  # (5 - 3) (sqrt 2 - 1)
    fits = float(text.rsplit("= ", 1)[1])
    assert 2 * 2.99 <= fits <= 2 * 3.01


def test_passage_narrower_than_the_cutter():
    text = refused([rounded(12.0)], diameter=32.0)
    assert text.startswith("cutter.diameter_mm = 32: does not reach the wall at (")
    assert float(text.rsplit("= ", 1)[1]) == pytest.approx(24.0, abs=0.1)


@pytest.mark.parametrize("depth", [10.0, 25.0])
def test_radial_depth_of_a_diameter(depth):
    assert refused([rounded(8.0)], radial_depth=depth) == (
        f"operation.radial_depth_mm = {depth:g}: must be above 0 and below the cutter's diameter_mm = 10: "
        "take several passes"
    )


def test_open_chain_among_closed_contours():
    assert refused([rounded(8.0), CHAIN]) == (
        "part: open chain ends at (30, 10), gap 31.6228 mm, among closed contours: close it (part.join_mm), choose its "
        'layer alone (part.layers), or leave it out (part.open_chains = "dropped")'
    )


def test_left_of_a_closed_contour():
    assert refused([rounded(8.0)], side="left") == (
        "operation.side = left: the contour is closed: choose inside or outside"
    )


def test_inside_of_a_straight_chain():
    assert refused([Contour.polyline([(0, 0), (50, 0)])]) == (
        "operation.side = inside: the chain from (0, 0) is straight and has no inside: choose left or right"
    )


def test_semifinish_pass_without_room():
    text = refused([rounded(8.0)], diameter=14.5, radial_depth=8.5, semifinish_depth=0.5)
    assert "the passage is too narrow, take a smaller cutter, radial_depth_mm or fewer passes" in text
