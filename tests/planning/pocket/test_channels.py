"""Channels: two rooms that a neck joins, checked by the path of the centre alone."""

import math

import numpy as np
import pytest

from chipload.geometry.contour import Contour, Region
from chipload.planning.pocket.channels import channels_of
from chipload.planning.pocket.clearing import clear_region
from chipload.planning.pocket.clearing_path import CUT, LIFT
from chipload.planning.pocket.reach import centre_region
from chipload.planning.pocket.skeleton import skeleton_of
from chipload.simulation.centre_path import CentrePath, rim_engagement

R, WANTED = 4.0, math.acos(0.8)
#: two rooms of 18 x 18 mm, and a neck of 10 x 8.4 mm between them
NECK = [
    (0.0, 0.0), (18.0, 0.0), (18.0, 4.8), (28.0, 4.8), (28.0, 0.0), (46.0, 0.0), (46.0, 18.0), (28.0, 18.0),
    (28.0, 13.2), (18.0, 13.2), (18.0, 18.0), (0.0, 18.0),
]  # fmt: skip


@pytest.fixture(scope="module")
def region():
    return Region.of([Contour.polyline(NECK, closed=True)])


def test_wide_part_and_channel_make_the_centre_region(region):
    """The neck, 0.2 mm of room, is cut off where the room is 0.27 R: both rooms stay, with their corners."""
    centres = centre_region(region, R)
    found = channels_of(region, centres, R, 0.0, 1e-5 * R)
    assert len(found.wide.contours) == 2
    assert len(found.lines) == 1
    # the room is 0.27 R where the corners of the neck are 1.27 R away
    ahead = math.sqrt((1.27 * R) ** 2 - 4.2**2)
    bounds = np.array([c.bounds for c in found.wide.contours])
    assert sorted(bounds[:, 2]) == pytest.approx([18.0 - ahead, 42.0], abs=0.45 * R)
    middle = found.lines[0].points
    assert middle[:, 0].min() < 18.0 - ahead
    assert middle[:, 0].max() > 28.0 + ahead
    assert channels_of(Region.of([Contour.circle((0.0, 0.0), 20.0)]), centre_region(
        Region.of([Contour.circle((0.0, 0.0), 20.0)]), R), R, 0.0, 1e-5 * R) is None  # fmt: skip


def test_middle_line_goes_on_between_two_corners(region):
    """Off the neck the two corners are nearest: the clearance is the distance from them."""
    lines = skeleton_of(region, 1.0, 0.1)
    before = (np.abs(lines.points[:, 1] - 9.0) < 1e-6) & (lines.points[:, 0] > 14.5) & (lines.points[:, 0] < 18.0)
    assert before.sum() > 10
    far = np.hypot(lines.points[before, 0] - 18.0, 4.2)
    assert lines.clearance[before] == pytest.approx(far, abs=1e-9)


@pytest.mark.parametrize("milling", ["down", "up"])
def test_both_rooms_from_one_entry(region, milling):
    """The second room is entered through the neck; the engagement holds, by the path of the centre point by point."""
    path = clear_region(region, R, WANTED, milling=milling)
    assert [e.code for e in path.events].count("pocket-entry") == 1
    assert "pocket-narrow" not in [e.code for e in path.events]
    assert path.cleared_share > 0.997
    if milling == "down":
        trail = CentrePath(path.segments, R, None, path.kind < LIFT)
        cut = np.flatnonzero((path.kind == CUT) & (path.lengths > 1e-9))
        at = np.repeat(cut, 2)
        angle = rim_engagement(trail, at, np.tile([0.5, 1.0], len(cut))).angle
        assert np.degrees(angle).max() < math.degrees(WANTED) + 0.01
        assert np.degrees(angle).max() > 0.9 * math.degrees(WANTED)
