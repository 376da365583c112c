"""Section, speed and grazing points against the quartic, finite differences and membership."""

from __future__ import annotations

import math

import numpy as np
import pytest

from chipload.cutter.cutter import Cutter
from chipload.engagement.chips.move import Move
from chipload.engagement.chips.section import depth, section
from engagement.chips.brute import CUTTERS, inside, random_move
from engagement.chips.grazing import ellipse_grazing, grazing

LONG = Cutter(10.0, 4, 0.5, 400.0, 500.0, 6e5)
ANGLES = np.linspace(0.0, 2.0 * math.pi, 37)[:-1] + 0.01


def test_quartic_and_sampled_signs_agree_on_ellipses():
    rng = np.random.default_rng(3)
    counts = {2: 0, 4: 0}
    for _ in range(300):
        (a0, a1), t = (np.append(rng.uniform(-0.7, 0.7, 2), 1.0) for _ in range(2)), rng.uniform()
        a0, a1 = a0 / np.linalg.norm(a0), a1 / np.linalg.norm(a1)
        q = rng.uniform(-1.0, 1.0, 3) * rng.choice([0.2, 3.0])  # the axis turns about a point near the layer
        move, height = Move.slerp(-150.0 * a0, a0, q - 150.0 * a1, a1), rng.uniform(-1.0, 1.0)
        (p, a), (dp, da) = move.at([t]), move.rates([t])
        theta, sign = ellipse_grazing(5.0, height, p[0], a[0], dp[0], da[0], 1e-7)
        g = grazing(move, LONG, height, t, 1e-12)
        assert len(theta) == len(g.theta)
        np.testing.assert_allclose(g.theta, theta, atol=1e-7)
        assert g.sign.tolist() == sign.tolist()
        counts[len(theta)] += 1
    assert min(counts.values()) > 20


@pytest.mark.parametrize("name", list(CUTTERS))
def test_edge_is_where_membership_ends(name):
    rng = np.random.default_rng(4)
    cutter = CUTTERS[name]
    pieces = set()
    for _ in range(60):
        move, t = random_move(rng, "lerp"), rng.uniform()
        (p,), (a,) = move.at([t])
        height = p[2] + rng.uniform(-2.0, 14.0)
        s = section(move, cutter, height, t, ANGLES)
        if s is None:
            continue
        step = 1e-7 * s.normal
        assert inside(cutter, p, a, height, s.points - step).all()
        assert not inside(cutter, p, a, height, s.points + step).any()
        np.testing.assert_allclose(depth(move, cutter, height, t, s.points), 0.0, atol=1e-11)
        pieces |= set(s.piece.tolist())
    assert {3, 4} < pieces


@pytest.mark.parametrize("name", list(CUTTERS))
def test_speed_is_that_of_the_edge_along_its_normal(name):
    """V against where the edge is along the normal 1e-5 before and after, halved by the distance F."""
    rng = np.random.default_rng(6)
    cutter, dt = CUTTERS[name], 1e-5
    looked = 0
    for _ in range(40):
        move, t = random_move(rng, "slerp"), rng.uniform(0.01, 0.99)
        height = move.at([t])[0][0, 2] + rng.uniform(-1.0, 13.0)
        s = section(move, cutter, height, t, ANGLES)
        if s is None:
            continue
        at = []
        for when in (t - dt, t + dt):
            lo, hi = np.full(len(ANGLES), -2e-3), np.full(len(ANGLES), 2e-3)
            for _ in range(50):
                mid = 0.5 * (lo + hi)
                out = depth(move, cutter, height, when, s.points + mid[:, None] * s.normal) > 0.0
                lo, hi = np.where(out, lo, mid), np.where(out, mid, hi)
            at.append(lo)
        V = (at[1] - at[0]) / (2.0 * dt)
        smooth = np.abs(at[0] + at[1]) < 1e-2 * dt * (1.0 + np.abs(s.V))  # not at a corner
        np.testing.assert_allclose(s.V[smooth], V[smooth], atol=2e-4 * (1.0 + np.abs(s.V).max()))
        looked += int(smooth.sum())
    assert looked > 500
