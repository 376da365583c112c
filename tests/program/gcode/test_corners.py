"""Roundings and chamfers of Fanuc, Haas and Sinumerik against closed forms and the same contour by G2 and G3."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from chipload.errors import Finding, Severity
from chipload.program.commands import ARC, LINE, Commands
from chipload.program.gcode.reader import read_gcode

HEAD = "G17 G90 G21 G94 G40\nT1 M6\nS5000 M3\nG54\nG0 X0. Y0. Z-1.\n"


def read(text: str, dialect: str, **options: Any) -> tuple[Commands, list[Finding]]:
    commands, findings = read_gcode(f"{HEAD}{text}\n", name="x.nc", dialect=dialect, lenient=True, **options)
    return commands, [f for f in findings if f.code == "nc-corner"]


def same(one: Commands, two: Commands) -> None:
    """The same motions to 1e-9 mm."""
    assert one.motion.tolist() == two.motion.tolist()
    assert one.turns.tolist() == two.turns.tolist()
    np.testing.assert_allclose(one.position, two.position, atol=1e-9)
    np.testing.assert_allclose(one.centre, two.centre, atol=1e-9)
    np.testing.assert_allclose(one.feed, two.feed, atol=1e-12)


H = 5.0 * (math.sqrt(2.0) - 1.0)  # leg of a rounding of 5 mm at a turn of 45 deg
S = math.sqrt(0.5)
#: contour with a corner, and the same by explicit arcs; ends of a rounding lie r tan(turn / 2) from the corner
PAIRS = [
    ("G1 X30. F500.{r5}\nG1 Y20.", "G1 X25. F500.\nG3 X30. Y5. R5.\nG1 Y20."),
    ("G1 X30. F500.{r5}\nG1 Y-20.", "G1 X25. F500.\nG2 X30. Y-5. R5.\nG1 Y-20."),
    (
        "G1 X30. F500.{r5}\nG1 X50. Y20.",
        f"G1 X{30 - H:.12f} F500.\nG3 X{30 + H * S:.12f} Y{H * S:.12f} R5.\nG1 X50. Y20.",
    ),
    ("G1 X30. F500.{c4}\nG1 Y20.", "G1 X26. F500.\nX30. Y4.\nG1 Y20."),
    (
        # two corners one after the other, the second with another feed behind it
        "G1 X30. F500.{r5}\nG1 Y20.{c4}\nG1 X0. F300.",
        "G1 X25. F500.\nG3 X30. Y5. R5.\nG1 Y16.\nX26. Y20.\nG1 X0. F300.",
    ),
]
WORDS = {
    "fanuc": {"r5": " ,R5.", "c4": ",C4."},
    "sinumerik": {"r5": " RND=5", "c4": " CHR=4"},
}


@pytest.mark.parametrize("dialect", ["fanuc", "sinumerik"])
@pytest.mark.parametrize(("text", "explicit"), PAIRS)
def test_a_corner_is_the_contour_with_an_explicit_arc(text: str, explicit: str, dialect: str) -> None:
    got, sharp = read(text.format(**WORDS[dialect]) + "\nM30", dialect)
    expected, _ = read(explicit.replace(" R5.", " CR=5.") + "\nM30" if dialect == "sinumerik" else explicit, dialect)
    assert sharp == []
    same(got, expected)


def test_a_chamfer_by_the_length_of_its_edge() -> None:
    """CHF=6 at a square corner begins 6 / sqrt(2) before it; at a turn of 60 deg 6 / sqrt(3)."""
    got, sharp = read("G1 X30. F500 CHF=6\nY20.\nM30", "sinumerik")
    assert sharp == []
    np.testing.assert_allclose(got.position[1:3, :2], [[30 - 6 * S, 0], [30, 6 * S]], atol=1e-9)
    got, _ = read(f"G1 X30. F500 CHF=6\nX40. Y={10 * math.sqrt(3.0)}\nM30", "sinumerik")
    leg = 6.0 / math.sqrt(3.0)
    np.testing.assert_allclose(got.position[1, :2], [30 - leg, 0], atol=1e-9)
    assert np.linalg.norm(np.diff(got.position[1:3, :2], axis=0)) == pytest.approx(6.0)


def test_a_rounding_of_all_corners_ends_with_zero_and_leaves_plunges() -> None:
    text = "RNDM=3\nG1 X30. F500\nY20.\nX10. RNDM=0\nY0.\nX0.\nM30"
    got, sharp = read(text, "sinumerik")
    expected, _ = read(
        "G1 X27. F500\nG3 X30. Y3. CR=3\nG1 Y17.\nG3 X27. Y20. CR=3\nG1 X10.\nY0.\nX0.\nM30", "sinumerik"
    )
    assert sharp == []
    same(got, expected)
    got, sharp = read("RNDM=3\nG1 X30. F500\nZ-2\nX40.\nX50.\nRNDM=0\nM30", "sinumerik")
    assert (sharp, got.motion[1:].tolist()) == ([], [LINE] * 4)


def test_a_rounding_between_a_line_and_an_arc_touches_both() -> None:
    got, sharp = read("G1 X30. F500. ,R2.\nG3 X50. Y0. I10. J0.\nM30", "fanuc")
    # the arc about (40, 0) of 10 mm leaves (30, 0) downwards: the rounding lies within it or beside it, below the line
    assert sharp == []
    assert got.motion[1:].tolist() == [LINE, ARC, ARC]
    centre = got.centre[2]
    assert abs(centre[1]) == pytest.approx(2.0)  # 2 mm from the line
    assert math.dist(centre, (40.0, 0.0)) == pytest.approx(12.0)  # and from the arc, on its outside
    np.testing.assert_allclose(got.position[1, :2], [centre[0], 0.0], atol=1e-9)
    foot = np.array([40.0, 0.0]) + 10.0 * (centre - [40.0, 0.0]) / 12.0
    np.testing.assert_allclose(got.position[2, :2], foot, atol=1e-9)


def test_compensation_is_beside_the_rounded_contour() -> None:
    """A cutter of 4 mm inside a rounding of 5 mm goes about its centre with a radius of 3 mm."""
    mill = {1: 4.0}
    got, _ = read("G41 D1\nG1 X10. F500.\nG1 X30. ,R5.\nG1 Y20.\nG40 X0.\nM30", "fanuc", diameters=mill)
    explicit = "G41 D1\nG1 X10. F500.\nG1 X25.\nG3 X30. Y5. R5.\nG1 Y20.\nG40 X0.\nM30"
    same(got, read(explicit, "fanuc", diameters=mill)[0])
    (row,) = np.flatnonzero(got.motion == ARC)
    np.testing.assert_allclose(got.centre[row], [25.0, 5.0], atol=1e-9)
    assert math.dist(got.position[row, :2], got.centre[row]) == pytest.approx(3.0)


@pytest.mark.parametrize(
    ("text", "rows"),
    [
        ("G1 X30. F500. ,R50.\nY20.\nM30", 3),  # there is no room
        ("G1 X30. F500. ,R5.\nG0 Z20.\nM30", 3),
        ("G1 X30. F500. ,R5.\nX50.\nM30", 3),  # no corner
        ("G1 X30. F500. ,R5.\nG4 P100\nY20.\nM30", 4),
        ("G93 G1 X30. F5. ,R5.\nG1 Y20. F5.\nM30", 3),
        ("G1 X30. F500. ,R5.\nM30", 2),
        ("G1 X30. F500. ,R5.", 2),
        ("G1 X30. F500. ,R5.\nX40. Z-3.\nM30", 3),  # it leaves the plane
    ],
)
def test_a_corner_that_cannot_be_made_stays_sharp_and_unproven(text: str, rows: int) -> None:
    got, sharp = read(text, "fanuc")
    assert [(f.severity, f.line) for f in sharp] == [(Severity.UNPROVEN, 6)]
    assert ",R5" in sharp[0].text
    assert len(got) == rows
    assert not (got.motion == ARC).any()


def test_inches_and_values_of_variables() -> None:
    got, sharp = read("#5=0.2\nG20\nG1 X1. F20. ,R#5\nG1 Y1.\nM30", "fanuc")
    assert sharp == []
    np.testing.assert_allclose(got.position[1:3, :2], [[20.32, 0.0], [25.4, 5.08]], atol=1e-9)
    commands, findings = read_gcode("G0 X0. Y0.\nG1 X1. F20. ,R-1.\nG1 Y1. F20.\nM30", dialect="fanuc", lenient=True)
    assert commands.line.tolist() == [1, 3]
    assert ["a corner must be from 0" in f.text for f in findings] == [True]
