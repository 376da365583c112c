"""Separate areas that a leaning cutter engages, counted in spans laid out by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest

from chipload.engagement.bricks._contact import areas_of

TAU = 2.0 * math.pi
#: slices 1 mm long, one after the other along a profile at 5 mm from the axis
ALONG = [(0.0, 1.0), (1.0, 2.0), (2.0, 3.0)]


def areas(slices: list[tuple[float, float]], spans: list[tuple[int, float, float]]) -> int:
    """Of spans (slice, from, to) on slices (from, to)."""
    table = np.zeros((len(slices), 9))
    table[:, :2], table[:, 2] = slices, 5.0
    rows = np.array([s[1:] for s in spans])
    room = np.empty(len(rows), dtype=np.int64), np.empty(len(rows))
    return int(areas_of.py_func(rows, np.array([s[0] for s in spans]), table, 0, len(rows), *room))


@pytest.mark.parametrize(
    ("slices", "spans", "known"),
    [
        (ALONG, [(0, 0.0, 1.0), (1, 0.5, 1.5), (2, 1.4, 2.0)], 1),
        (ALONG, [(0, 0.0, 1.0), (1, 1.1, 1.5)], 2),
        # a whole turn apart is the same place
        (ALONG, [(0, -1.0, 0.5), (1, TAU - 0.8, TAU - 0.2)], 1),
        (ALONG, [(0, 2.0 * TAU + 0.1, 2.0 * TAU + 0.6), (1, 0.5, 1.0)], 1),
        # two spans of a slice are joined by one beside them, and stay apart without it
        (ALONG, [(0, 0.0, 0.5), (0, 1.0, 1.5), (1, 0.4, 1.1)], 1),
        (ALONG, [(0, 0.0, 0.5), (0, 1.0, 1.5), (1, 0.4, 0.9)], 2),
        # slices with a gap between them do not touch
        ([(0.0, 1.0), (1.1, 2.0)], [(0, 0.0, 1.0), (1, 0.0, 1.0)], 2),
        # 1 rad of 2 um beside 1 rad of 1 mm along the profile is no film, 0.2 rad of 1 um is one
        ([(0.0, 0.002), (0.1, 1.1)], [(0, 0.0, 1.0), (1, 2.0, 3.0)], 2),
        ([(0.0, 0.001), (0.1, 1.1)], [(0, 0.0, 0.2), (1, 2.0, 3.0)], 1),
    ],
)
def test_areas(slices: list[tuple[float, float]], spans: list[tuple[int, float, float]], known: int) -> None:
    assert areas(slices, spans) == known
