"""Trochoids: the engagement of circles in a channel in closed form, the middle lines, and what is left."""

import math

import numpy as np
import pytest

from chipload.geometry.contour import Contour, Region
from chipload.planning.pocket.clearing import clear_region
from chipload.planning.pocket.clearing_path import CUT, LIFT, polyline
from chipload.planning.pocket.leftover import leftover
from chipload.planning.pocket.reach import centre_region
from chipload.planning.pocket.skeleton import skeleton_of

R = 4.0
WANTED = math.acos(0.8)


def slot(width, length=40.0):
    return Region.of([Contour.polyline([(0, 0), (length, 0), (length, width), (0, width)], closed=True)])


def greatest_engagement(before, rho_before, centre, rho):
    """Of a circle of the centre behind another: O = centre + rho (cos t, sin t), heading t + 90 deg.

    A place of the rim at the angle b from the line through the centre before and O is in stock where
    R^2 + d^2 + 2 R d cos b > (rho_before + R)^2, d the length of that line; the front half of the rim counts.
    """
    t = np.linspace(-math.pi, math.pi, 20001)
    x, y = centre[0] - before[0] + rho * np.cos(t), centre[1] - before[1] + rho * np.sin(t)
    d = np.hypot(x, y)
    b = np.arccos(np.clip(((rho_before + R) ** 2 - R**2 - d**2) / (2.0 * R * d), -1.0, 1.0))
    middle = (np.arctan2(y, x) - (t + 0.5 * math.pi) + math.pi) % math.tau - math.pi
    low, high = np.maximum(middle - b, -0.5 * math.pi), np.minimum(middle + b, 0.5 * math.pi)
    return float(np.maximum(high - low, 0.0).max())


@pytest.mark.parametrize("width", [8.6, 10.0, 12.0])
def test_engagement_of_equal_circles(width):
    """Circle after circle in the straight part of a slot, against the closed form; the advance uses what is allowed."""
    path = clear_region(slot(width), R, WANTED, trochoidal=True)
    cut = (path.kind == CUT) & (path.sweep != 0.0)
    number = path.pass_number[cut]
    first = np.flatnonzero(np.diff(number, prepend=-1))
    centre, start = path.centre[cut][first], path.segments[cut][first, 0:2]
    rho = np.hypot(*(start - centre).T)
    most = np.maximum.reduceat(path.engagement_max[cut], first)
    straight = (centre[:, 0] > 12.0) & (centre[:, 0] < 34.0) & (np.abs(centre[:, 1] - 0.5 * width) < 2e-3)
    pairs = [k for k in range(1, len(first)) if straight[k] and np.hypot(*(centre[k] - centre[k - 1])) < 1.0]
    assert len(pairs) >= 5
    found = np.array([greatest_engagement(centre[k - 1], rho[k - 1], centre[k], rho[k]) for k in pairs])
    assert most[pairs] == pytest.approx(found, abs=2e-3)
    assert most.max() <= WANTED
    assert np.median(found) > 0.9 * WANTED


def test_a_slot_hardly_wider_than_the_cutter():
    """0.2 mm of room: passes give it up, circles clear it to the wall."""
    region = slot(8.2, 24.0)
    path = clear_region(region, R, WANTED, trochoidal=True)
    assert path.cleared_share > 0.997
    assert path.engagement_max[path.kind == CUT].max() <= WANTED
    points, _ = polyline(path.segments[:, 2:4], path.segments[:, 4:6], path.segments[:, 6], path.kind == LIFT, 1e-4)
    assert points[:, 1].min() >= R - 4e-4
    assert points[:, 1].max() <= 8.2 - R + 4e-4
    reachable = centre_region(centre_region(region, R), -R)
    raised = path.kind == LIFT
    again, breaks = polyline(path.segments[:, 2:4], path.segments[:, 4:6], path.segments[:, 6], raised, 1e-4)
    assert leftover(reachable, again, breaks, R)[0] == pytest.approx(path.leftover_mm2, abs=0.02)


def test_up_milling_is_the_mirror_image():
    down = clear_region(slot(10.0), R, WANTED, trochoidal=True)
    up = clear_region(slot(10.0), R, WANTED, trochoidal=True, milling="up")
    turns = path_turn(down), path_turn(up)
    assert turns[0] > 0.0 > turns[1]
    assert up.cleared_share > 0.995


def path_turn(path):
    """Turn of the arcs that cut [rad]; counter-clockwise > 0."""
    return path.sweep[path.kind == CUT].sum()


def test_middle_lines_of_a_cross():
    """Four arms: all edges are run once, and the clearance is that of the arms, or of the diagonal in the middle."""
    cross = [(10, 0), (20, 0), (20, 10), (30, 10), (30, 20), (20, 20), (20, 30), (10, 30), (10, 20), (0, 20), (0, 10),
             (10, 10)]  # fmt: skip
    lines = skeleton_of(Region.of([Contour.polyline(cross, closed=True)]), 1.0, 0.2)
    assert lines.clearance.max() == pytest.approx(math.hypot(5.0, 5.0), abs=0.05)
    start = int(lines.clearance.argmax())
    branches = lines.branches(start)
    length = sum(np.hypot(*np.diff(line, axis=0).T).sum() for line in branches)
    each = np.hypot(*(lines.points[lines.edges[:, 0]] - lines.points[lines.edges[:, 1]]).T).sum()
    assert length == pytest.approx(each)
    ends = np.vstack(branches)
    for x, y in ((5, 15), (25, 15), (15, 5), (15, 25)):
        assert np.hypot(*(ends - (x, y)).T).min() < 0.2
