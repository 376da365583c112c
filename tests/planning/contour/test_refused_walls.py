"""Walls that a cutter cannot finish, passes that stop, and feeds within what a machine can do."""

from __future__ import annotations

import math

import numpy as np
import pytest

from chipload.errors import InputError
from chipload.geometry.contour import Contour
from chipload.planning.contour.forward import forward_pass
from chipload.planning.contour.offsets import centre_paths, walls_of
from chipload.planning.contour.schedule import within_machine

#: an inside corner with a fillet of 8 mm, another without; material on the right, the cutter on the left
ROUND = Contour.from_bulges([[0, 28], [0, 8], [8, 0], [28, 0]], [0, math.tan(math.pi / 8), 0, 0])
SHARP = Contour.polyline([[0.0, 28.0], [0.0, 0.0], [28.0, 0.0]])
SQUARE = Contour.polyline([[0.0, 0.0], [20.0, 0.0], [20.0, 20.0], [0.0, 20.0]], closed=True)


@pytest.mark.parametrize(
    ("wall", "remedy"),
    [
        (ROUND, "the largest that fits has diameter_mm = 16"),
        (SHARP, "no cutter fits a sharp inside corner: draw a fillet, or mill it with kind = pocket"),
    ],
)
def test_the_largest_cutter_that_fits(wall: Contour, remedy: str) -> None:
    """A radius of 10 mm leaves (sqrt(2) - 1) times what it is above the radius of the fillet, at the corner."""
    walls = walls_of([wall], "left", "down", 10.0)
    with pytest.raises(InputError) as err:
        centre_paths(walls, 10.0, 1e-4)
    left = (math.sqrt(2.0) - 1.0) * (10.0 - (8.0 if wall is ROUND else 0.0))
    assert str(err.value).startswith("cutter.diameter_mm = 20: does not reach the wall at (")
    assert float(str(err.value).split("leaves ")[1].split(" mm")[0]) == pytest.approx(left, abs=1e-3)
    assert str(err.value).endswith(remedy)


def test_a_cutter_of_the_fillet_fits() -> None:
    (path,) = centre_paths(walls_of([ROUND], "left", "down", 10.0), 7.999, 1e-4)
    assert path.length > 30.0


@pytest.mark.parametrize(
    ("contours", "side", "message"),
    [
        ([SQUARE], "left", "operation.side = left: the contour is closed: choose inside or outside"),
        (
            [SQUARE, ROUND],
            "inside",
            "part: open chain ends at (28, 0), gap 39.598 mm, among closed contours: close it ",
        ),
        (
            [Contour.polyline([[1.0, 2.0], [9.0, 2.0]])],
            "inside",
            "operation.side = inside: the chain from (1, 2) is straight and has no inside: choose left or right",
        ),
    ],
)
def test_a_side_that_walls_do_not_have(contours: list[Contour], side: str, message: str) -> None:
    with pytest.raises(InputError) as err:
        walls_of(contours, side, "down", 10.0)
    assert str(err.value).startswith(message)


def test_a_forward_pass_stops_at_a_sharp_convex_corner() -> None:
    """The new surface turns back where the old one turns by more than 90 deg less half of the engagement angle."""
    a = math.radians(20.0)
    codes = {}
    for turn in (60.0, 120.0):
        c, s = math.cos(math.radians(turn)), math.sin(math.radians(turn))
        old = Contour.polyline([[0.0, 0.0], [30.0, 0.0], [30.0 + 30.0 * c, -30.0 * s]])
        event = forward_pass(old, 5.0, a, 0.05).event
        codes[turn] = None if event is None else (event.code, event.failure)
    assert codes[60.0] is None
    assert codes[120.0] is not None
    assert codes[120.0][1]


@pytest.mark.parametrize(("low", "jerk"), [(20.0, 5e3), (5.0, 2e4), (5.0, 5e4)])
def test_feeds_keep_acceleration_and_jerk_of_the_machine(low: float, jerk: float) -> None:
    """Speeds over time, found anew by integration along the path. A mean of speeds, not of their squares, took up to
    1.23 times the acceleration.
    """
    s = np.linspace(0.0, 60.0, 2001)
    wanted = np.where((s > 20.0) & (s < 40.0), low, 50.0)
    v = within_machine(s, wanted, 500.0, jerk)
    assert (v <= wanted + 1e-9).all()
    assert v[1000] == pytest.approx(low, rel=0.02)
    assert v[0] > 40.0
    seconds = np.concatenate([[0.0], np.cumsum(2.0 * np.diff(s) / (v[1:] + v[:-1]))])
    # at even times, each long enough to hold several places
    even = np.arange(0.0, seconds[-1], 0.01)
    speed = np.interp(even, seconds, v)
    acceleration = np.diff(speed) / 0.01
    assert np.abs(acceleration).max() <= 500.0 * 1.01
    assert np.abs(np.diff(acceleration)).max() / 0.01 <= jerk * 1.1
    # without a limit of the jerk the change of acceleration is sudden
    free = within_machine(s, wanted, 500.0, None)
    assert free.sum() > v.sum()
