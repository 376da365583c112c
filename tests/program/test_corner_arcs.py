"""Blend arcs beside lines and arcs; the oracle is a search for the circle that touches both sides."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.optimize import brentq

from chipload.program.corner_arcs import CornerSide, corner_arcs

LINE = CornerSide(*(np.array([v]) for v in (False, False, 0j, np.inf, 0.0, 50.0)))


def arc(centre: complex, inner: bool, most: float = math.pi) -> CornerSide:
    return CornerSide(*(np.array([v]) for v in (True, inner, centre, abs(centre), most, 50.0)))


def one(before: CornerSide, after: CornerSide, phi: float, radius: float, tolerance: float = 50.0):
    values = (np.array([v]) for v in (np.exp(1j * phi), radius, tolerance, 1e-6))
    return corner_arcs(before, after, *values)


@pytest.mark.parametrize("inner", [False, True])
@pytest.mark.parametrize("phi", [0.4, 1.2, 2.2])
def test_the_circle_touches_the_line_and_the_arc(inner: bool, phi: float):
    """Along the line at the height R, the distance to the arc's centre is r + R or r - R."""
    r, radius = 6.0, 0.4
    centre = r * np.exp(1j * (phi + (0.5 if inner else -0.5) * math.pi))
    found = one(LINE, arc(complex(centre), inner), phi, radius)
    goal = r - radius if inner else r + radius
    d = brentq(lambda d: abs(-d + 1j * radius - centre) - goal, 0.0, 1.5, xtol=1e-14)
    z = -d + 1j * radius
    assert found.possible.all()
    assert found.trim1[0] == pytest.approx(d, abs=1e-9)
    assert found.trim2[0] == pytest.approx(r * abs(np.angle((z - centre) / -centre)), abs=1e-9)
    # the path is as long as before where the arc between both ends replaces them: it turns by what the sides do not
    turned = phi + (-1.0 if not inner else 1.0) * found.trim2[0] / r
    assert found.length[0] == pytest.approx(radius * turned, abs=1e-9)


def test_a_line_after_an_arc_is_the_mirror_of_a_line_before_it():
    phi, centre = 1.0, 3.0 * np.exp(1j * (1.0 - 0.5 * math.pi))
    forward = one(LINE, arc(complex(centre), False), phi, 0.3)
    mirrored = complex(-np.conj(centre / np.exp(1j * phi)))
    back = one(arc(mirrored, False), LINE, phi, 0.3)
    assert back.trim1[0] == pytest.approx(forward.trim2[0], abs=1e-12)
    assert back.trim2[0] == pytest.approx(forward.trim1[0], abs=1e-12)
    assert back.length[0] == pytest.approx(forward.length[0], abs=1e-12)


def test_between_two_arcs_and_refused():
    before, after = arc(-4j, False), arc(complex(4.0 * np.exp(0.5j)), False)
    found = one(before, after, 0.5 + 0.5 * math.pi, 0.5)
    assert found.possible.all()
    # too tight a tolerance, too small a share of the arc, and a circle that fits nowhere inside a smaller one
    assert not one(before, after, 0.5 + 0.5 * math.pi, 0.5, tolerance=1e-3).possible.any()
    assert not one(LINE, arc(4.0 + 0j, False, 0.01), 0.5 * math.pi, 0.5).possible.any()
    assert not one(LINE, arc(complex(np.exp(2.8j) * 1j), True), 2.8, 3.0).possible.any()
