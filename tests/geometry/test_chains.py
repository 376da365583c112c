"""Loose segments joined to contours."""

from itertools import pairwise

import numpy as np
import pytest

from chipload.errors import InputError
from chipload.geometry.chains import chain_parts


def line(x0, y0, x1, y1):
    return np.array([[x0, y0, x1, y1, 0.0, 0.0, 0.0]], dtype=float)


def codes(findings):
    return [f.code for f in findings]


def test_a_shuffled_square_becomes_one_contour_in_the_sense_of_its_first_line():
    parts = [line(0, 0, 4, 0), line(0, 4, 4, 4), line(0, 0, 0, 4), line(4, 4, 4, 0)]
    (c,), findings = chain_parts(parts, 0.01)
    assert c.closed
    assert c.segments[:, :2].tolist() == [[0, 0], [4, 0], [4, 4], [0, 4]]
    assert findings == ()
    (c,), _ = chain_parts([line(4, 0, 0, 0), *parts[1:]], 0.01)
    assert c.area == -16.0
    assert c.start.tolist() == [4, 0]


def test_an_open_chain_runs_as_its_first_part_runs():
    (c,), _ = chain_parts([line(4, 0, 8, 0), line(8, 3, 8, 0), line(4, 0, 0, 0)], 0.01)
    assert c.segments[:, :4].tolist() == [[0, 0, 4, 0], [4, 0, 8, 0], [8, 0, 8, 3]]


def test_a_gap_is_closed_half_way_and_reported_with_its_place():
    (c,), (f,) = chain_parts([line(0, 0, 4, 0), line(4.006, 0.008, 4, 4)], 0.02, "layer 'A': ")
    assert f.code == "chain-joined"
    assert f.text == "layer 'A': gap of 0.01 mm closed at (4.003, 0.004)"
    assert c.segments[0, 2:4].tolist() == c.segments[1, 0:2].tolist()
    assert len(chain_parts([line(0, 0, 4, 0), line(4.006, 0.008, 4, 4)], 0.009)[0]) == 2


def test_an_arc_moved_to_a_joint_keeps_both_ends_on_its_circle():
    arc = np.array([[4.0, 0.0, 6.0, 2.0, 4.0, 2.0, np.pi / 2]])
    (c,), _ = chain_parts([line(0, 0.004, 4.002, 0.004), arc], 0.01)
    x0, y0, x1, y1, xc, yc, sweep = c.segments[1]
    assert np.hypot(x0 - xc, y0 - yc) == pytest.approx(np.hypot(x1 - xc, y1 - yc), abs=1e-12)
    turned = np.array([[np.cos(sweep), -np.sin(sweep)], [np.sin(sweep), np.cos(sweep)]]) @ [x0 - xc, y0 - yc]
    assert turned == pytest.approx([x1 - xc, y1 - yc], abs=1e-12)


def test_many_segments_shorter_than_the_gap_allowed_stay_in_order():
    theta = np.linspace(0, np.pi, 501)
    p = np.column_stack([np.cos(theta), np.sin(theta)])
    parts = [line(*a, *b) for a, b in pairwise(p)]
    order = np.random.default_rng(3).permutation(500)
    (c,), findings = chain_parts([parts[k] for k in order], 0.05)
    assert len(c.segments) == 500
    assert findings == ()


def test_a_branch_is_left_open_and_reported():
    contours, (f,) = chain_parts([line(0, 0, 4, 0), line(4, 0, 8, 0), line(4, 0, 4, 3)], 0.01)
    assert len(contours) == 3
    assert (f.code, f.text) == ("chain-branch", "3 ends meet at (4, 0): a branch, left open")


def test_doubles_and_empty_segments_are_dropped_and_reported():
    ring = np.array([[2.0, 0.0, 2.0, 0.0, 1.0, 0.0, 2 * np.pi]])
    parts = [line(0, 0, 4, 0), line(4, 0, 0, 0), line(1, 1, 1, 1), ring, ring, line(4, 0, 4, 2)]
    contours, findings = chain_parts(parts, 0.01)
    assert len(contours) == 2
    assert sorted(codes(findings)) == ["chain-double", "chain-double", "chain-empty"]
    assert findings[0].text == "a segment without length at (1, 1) dropped"


def test_two_arcs_between_the_same_ends_are_not_one_drawn_twice():
    upper = np.array([[1.0, 0.0, -1.0, 0.0, 0.0, 0.0, np.pi]])
    lower = np.array([[1.0, 0.0, -1.0, 0.0, 0.0, 0.0, -np.pi]])
    (c,), findings = chain_parts([upper, lower], 0.01)
    assert c.area == pytest.approx(np.pi)
    assert findings == ()


def test_twenty_thousand_segments():
    n = 20_000
    x = np.arange(n + 1.0)
    parts = [line(a, 0, b, 0) for a, b in pairwise(x)]
    (c,), _ = chain_parts(parts[::-1], 0.01)
    assert len(c.segments) == n


@pytest.mark.parametrize("gap", [-1.0, np.nan])
def test_a_join_that_is_no_length_is_refused(gap):
    with pytest.raises(InputError, match=rf"^part\.join_mm = {gap:g}: must be a finite number of at least 0$"):
        chain_parts([line(0, 0, 1, 0)], gap)
