"""Clearance of the whole cutter, and moves proved to be clear, against every point and many instants."""

import numpy as np

from chipload.cutter.catalogue import CatalogueCutter
from chipload.planning.impeller.clearance import clearance, interpolated_axes, moves_clear
from chipload.planning.impeller.scene import Scene

CUTTER = CatalogueCutter(10.0, 2.0, 12.0, neck_diameter=8.0, neck_length=20.0, reach=30.0, holder_diameter=24.0)


def scene_of(points):
    return Scene(points[:1], [[0.0, 0, 1]], np.zeros((1, 3, 3)), [0], points, np.zeros(len(points), int), 0.0)


def gap(points, tip, axis, above):
    """Distance of every point from the cutter, part after part; exact outside."""
    x = points - tip
    h = x @ axis
    d = np.sqrt(np.clip((x**2).sum(axis=1) - h**2, 0.0, None))

    def part(low, high, R):
        return np.hypot(np.maximum(d - R, 0.0), np.maximum(np.maximum(low - h, h - high), 0.0))

    corner = np.hypot(np.maximum(d - 3.0, 0.0), np.maximum(np.maximum(2.0 - h, h - 12.0), 0.0)) - 2.0
    corner = np.where(h > 2.0, np.inf, corner)
    parts = [part(2.0, 12.0, 5.0), part(12.0, 20.0, 4.0 + above), part(20.0, 30.0, 5.0 + above)]
    return np.min([corner, *parts, part(30.0, np.inf, 12.0 + above)], axis=0)


def test_clearance_is_that_of_every_point():
    rng = np.random.default_rng(0)
    points = rng.uniform(-40.0, 40.0, (40, 3))
    scene = scene_of(points)
    axes = rng.normal(size=(200, 3))
    axes /= np.linalg.norm(axes, axis=1)[:, None]
    tips = rng.uniform(-40.0, 40.0, (200, 3))
    got, which = clearance(scene, CUTTER, tips, axes, 5.0, above=0.5)
    outside = 0
    for k in range(200):
        every = gap(points, tips[k], axes[k], 0.5)
        if every.min() > 1e-9:
            outside += 1
            assert abs(got[k] - min(every.min(), 5.0)) < 1e-9
            if every.min() < 5.0:
                assert every[which[k]] == every.min()
        else:
            assert got[k] <= 1e-9
    assert 20 < outside < 180


def test_moves_proved_clear_are_clear_at_every_instant():
    rng = np.random.default_rng(1)
    points = rng.uniform(-40.0, 40.0, (8, 3))
    scene = scene_of(points)
    n = 120
    tips = rng.uniform(-30.0, 30.0, (n, 3))
    axes = np.array([0.0, 0.0, 1.0]) + rng.normal(scale=0.3, size=(n, 3))
    axes /= np.linalg.norm(axes, axis=1)[:, None]
    said = moves_clear(scene, CUTTER, tips, axes, 0.3)
    share = np.linspace(0.0, 1.0, 201)
    for k in range(n - 1):
        at = tips[k] + share[:, None] * (tips[k + 1] - tips[k])
        turned = interpolated_axes(np.tile(axes[k], (201, 1)), np.tile(axes[k + 1], (201, 1)), share)
        least = min(gap(points, p, a, 0.0).min() for p, a in zip(at, turned, strict=True))
        if said[k]:
            assert least >= 0.3 - 1e-9
        else:
            # not proved: nearer than the margin somewhere, or by so little above it that 2^14 parts do not tell
            assert least < 0.35
    assert 10 < said.sum() < n - 10


def test_rows_of_contact_points_hold_tangents_and_the_curvature_in_them():
    rng = np.random.default_rng(6)
    N = rng.normal(size=(40, 3))
    N /= np.linalg.norm(N, axis=1)[:, None]
    N[0], N[1] = (0.0, 0.0, 1.0), (-1.0, 0.0, 0.0)
    K = rng.normal(size=(40, 3, 3))
    K = K + K.transpose(0, 2, 1)
    S, points = rng.normal(size=(40, 3)), np.zeros((1, 3))
    rows = Scene(S, N, K, np.full(40, 7), points, np.zeros(1, int), 0.0).rows
    frames = rows[:, 3:12].reshape(-1, 3, 3)
    np.testing.assert_array_equal(rows[:, :6], np.hstack([S, N]))
    np.testing.assert_allclose(frames @ frames.transpose(0, 2, 1), np.tile(np.eye(3), (40, 1, 1)), atol=1e-12)
    np.testing.assert_allclose(np.linalg.det(frames), 1.0)
    inside = frames @ K @ frames.transpose(0, 2, 1)
    np.testing.assert_allclose(rows[:, 12:15], inside[:, [1, 1, 2], [1, 2, 2]], atol=1e-12)
    assert (rows[:, 15] == 7).all()
