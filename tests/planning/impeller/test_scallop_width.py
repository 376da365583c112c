"""Reach of a pass and crest between two lines, against rays through the moving cutter (the dexels' own)."""

import math

import numpy as np
import pytest

from chipload.geometry.bspline import patch_through
from chipload.planning.impeller import _scallop
from chipload.planning.impeller.scallop_height import distance, scallop_heights, shares
from chipload.planning.impeller.scallop_width import reaches
from chipload.stock._dexels import pierce

R, r = 6.0, 2.0
SHAPE = np.array([r, R - r, r, 0.0, 0.0, r, R, 0.0, 60.0, R, 0.0, R - r, r, r])


def left_at(points, normals, tips, axes):
    """Least s on the rays from the points along the normals that any pose takes: brute force."""
    out = np.full(len(points), np.inf)
    for i, (p, n) in enumerate(zip(points, normals, strict=True)):
        a = np.cross(n, np.eye(3)[np.abs(n).argmin()])
        a /= np.linalg.norm(a)
        frame = np.stack([a, np.cross(n, a), n])
        for tip, axis in zip(tips, axes, strict=True):
            lo, hi = pierce(2, 0.0, 0.0, frame @ (tip - p), frame @ axis, SHAPE)
            if lo <= hi:
                out[i] = min(out[i], lo)
    return out


def tips_of(S, N, T):
    n = (N * T).sum(axis=1)[:, None]
    V = (N - n * T) / np.sqrt(1.0 - n * n)
    return S + r * N + (R - r) * V - r * T


@pytest.mark.parametrize("lean", [0.01, 0.05, 0.3, 0.7])
@pytest.mark.parametrize("way", [0.0, 0.6, 1.2, 2.4])
def test_pass_on_a_plane_is_as_high_as_said_at_its_reach(lean, way):
    h = 0.05
    N = np.array([0.0, 0.0, 1.0])
    T = np.array([math.cos(lean), 0.0, math.sin(lean)])
    d = np.array([math.cos(way), math.sin(way), 0.0])
    ahead, behind = reaches(N[None], T[None], d[None], np.zeros((1, 3, 3)), R - r, r, h)
    e = np.cross(N, d)
    s = np.arange(-20.0, 20.0, 0.05)[:, None]
    tips = tips_of(s * d, np.tile(N, (len(s), 1)), np.tile(T, (len(s), 1)))
    for side, far in ((1.0, ahead[0]), (-1.0, behind[0])):
        got = left_at([side * far * e], [N], tips, np.tile(T, (len(s), 1)))[0]
        if far < R:
            assert got == pytest.approx(h, rel=0.02)
        else:
            assert got <= h


def test_second_order_where_the_corner_alone_counts():
    # corner r along the step: w = 2 sqrt(2 r h - h^2)
    N, T, d = np.array([[0.0, 0, 1]]), np.array([[math.cos(0.8), 0, math.sin(0.8)]]), np.array([[0.0, 1, 0]])
    a, b = reaches(N, T, d, np.zeros((1, 3, 3)), R - r, r, 0.02)
    assert a[0] + b[0] == pytest.approx(2.0 * math.sqrt(2.0 * r * 0.02 - 0.02**2), rel=2e-3)


@pytest.mark.parametrize("bend", [-0.01, 0.0, 0.01])
def test_crest_between_two_lines_of_a_bent_surface(bend):
    x, y = np.linspace(-6.0, 6.0, 13), np.linspace(-2.0, 2.0, 5)
    X, Y = np.meshgrid(x, y, indexing="ij")
    patch = patch_through(np.stack([X, Y, 0.5 * bend * X**2], axis=-1), (x + 6) / 12, (y + 2) / 4)
    u = np.linspace(0.2, 0.8, 41)
    q = (0.4, 0.4 + 0.9 / 4.0)
    poses = []
    for v, lean in zip(q, (0.25, 0.4), strict=True):
        S, N = patch.at(u, v), patch.normal(u, v)
        T = np.tile([0.0, math.cos(lean), math.sin(lean)], (len(u), 1))
        poses.append((tips_of(S, N, T), T))
    share = np.linspace(0.02, 0.98, 49)
    at = (np.repeat(u, len(share)), (q[0] + share * (q[1] - q[0]))[None].repeat(len(u), axis=0).ravel())
    P, M = (f(*at).reshape(len(u), len(share), 3) for f in (patch.at, patch.normal))
    got = scallop_heights(P, M, (poses[0][0], poses[1][0]), (poses[0][1], poses[1][1]), R - r, r)
    k = 20
    fine = np.linspace(0.0, 1.0, 7)[:-1]
    tips, axes = (
        np.vstack([np.vstack([x[a] * (1 - f) + x[a + 1] * f for f in fine]) for x in z for a in range(10, 30)])
        for z in ((poses[0][0], poses[1][0]), (poses[0][1], poses[1][1]))
    )
    true = left_at(P[k], M[k], tips, axes).max()
    assert 0.01 < true < 0.2
    assert got[k] == pytest.approx(true, rel=0.02, abs=2e-4)


def test_distance_of_points_from_the_cutting_part():
    rng = np.random.default_rng(3)
    T = np.array([0.0, 0.0, 1.0])
    p = rng.uniform(-12.0, 12.0, (400, 3))
    # the body is the disc of R - r at height r, drawn upwards, and all within r of it
    d, z = np.hypot(p[:, 0], p[:, 1]), p[:, 2] - r
    core = np.hypot(np.maximum(d - (R - r), 0.0), np.minimum(z, 0.0))
    got = distance(p, np.zeros(3), T, R - r, r)
    out = core > r
    assert out.sum() > 100
    assert np.abs(got[out] - (core[out] - r)).max() < 1e-12
    assert (got[~out] <= 1e-12).all()


def test_keys_of_many_poses_are_those_of_their_distances():
    """The loop of vector instructions against NumPy: beside the corner, above, below, inside, and one pose nowhere."""
    rng = np.random.default_rng(3)
    tips, axes = rng.uniform(-8.0, 8.0, (40, 3)), rng.normal(size=(40, 3))
    axes /= np.linalg.norm(axes, axis=1)[:, None]
    tips[7], axes[7] = _scallop.NOWHERE, (0.0, 0.0, 1.0)
    poses = np.stack([np.hstack([tips, axes]).T] * 2)
    got = np.empty(40)
    for point in rng.uniform(-8.0, 8.0, (50, 3)):
        _scallop.distance_keys(*point, poses, 1, 0, 40, R - r, r, got)
        want = distance(point, tips, axes, R - r, r)
        assert _scallop.key_distance(got[7], r) > 1e6
        there = [_scallop.key_distance(key, r) for key in np.delete(got, 7)]
        assert there == pytest.approx(np.delete(want, 7), abs=1e-12)


def heights_of_all(points, normals, tips, axes, wide, rho, corner, steps):
    """Scallop heights by NumPy: every pose, every share, then thirds."""

    def left(point, normal, i):
        best = math.inf, None
        for p, a, reach in zip(tips, axes, wide, strict=True):
            own = np.arange(max(i - reach, 0), min(i + reach, len(p) - 1) + 1)
            own = own[np.isfinite(p[own, 0])]
            D = distance(point, p[own], a[own], rho, corner)
            k = int(D.argmin())
            low = D[k]
            if 0 < k < len(D) - 1 and own[k + 1] - own[k - 1] == 2:
                bend = D[k - 1] - 2.0 * D[k] + D[k + 1]
                low -= (D[k + 1] - D[k - 1]) ** 2 / (8.0 * bend) if bend > 0.0 else 0.0
            if low < best[0]:
                best = low, own[k], p, a
        low, k, p, a = best
        D0 = float(distance(point, p[k], a[k], rho, corner))
        D1 = float(distance(point + D0 * normal, p[k], a[k], rho, corner))
        return low * D0 / (D0 - D1) if D0 > 0.0 and D0 - D1 > 0.2 * D0 else low

    def between(x, at):
        k = min(int(at), len(x) - 2)
        return (1.0 - at + k) * x[k] + (at - k) * x[k + 1]

    out = np.full(len(points), np.nan)
    for i in np.flatnonzero(np.isfinite(tips[0][:, 0]) & np.isfinite(tips[1][:, 0])):
        all_of = [left(*one, i) for one in zip(points[i], normals[i], strict=True)]
        top = int(np.argmax(all_of))
        found, low, high = all_of[top], max(top - 1, 0), min(top + 1, len(all_of) - 1)
        for _ in range(steps):
            third = (high - low) / 3.0
            a, b = (left(between(points[i], x), between(normals[i], x), i) for x in (low + third, high - third))
            found = max(found, a, b)
            low, high = (low + third, high) if a < b else (low, high - third)
        out[i] = found
    return out


@pytest.mark.parametrize(("rho", "corner"), [(4.0, 2.0), (0.0, 1.0), (1.0, 1.0), (5.0, 0.0)])
@pytest.mark.parametrize("step", [0.5, 2.5])
def test_heights_are_those_of_a_search_through_all_poses(rho, corner, step):
    """On a bent surface, two lines whose axes turn, one askew and without a pose at one place, 0.08 mm from pose to
    pose; poses are left out only where they cannot be the nearest.
    """
    x, y = np.linspace(-6.0, 6.0, 13), np.linspace(-4.0, 4.0, 7)
    X, Y = np.meshgrid(x, y, indexing="ij")
    patch = patch_through(np.stack([X, Y, 0.01 * X**2 - 0.02 * Y**2], axis=-1), (x + 6) / 12, (y + 4) / 8)
    u = np.linspace(0.1, 0.9, 121)
    q = (np.full(len(u), 0.3), 0.3 + step * (1.0 + 0.4 * np.sin(2.0 * np.pi * u)) / 8.0)
    tips, axes = [], []
    for v, first in zip(q, (0.2, 0.5), strict=True):
        S, N = patch.facing(u, v)
        lean, way = first + 0.6 * u, 3.0 * u
        T = np.stack([np.sin(lean) * np.cos(way), np.sin(lean) * np.sin(way), np.cos(lean)], axis=1)
        n = (N * T).sum(axis=1)[:, None]
        V = (N - n * T) / np.sqrt(1.0 - n * n)
        tips.append(S + corner * N + rho * V - corner * T)
        axes.append(T)
    tips[1][70] = axes[1][70] = np.nan
    share = shares()
    at = np.repeat(u, len(share)), (q[0][:, None] + share * (q[1] - q[0])[:, None]).ravel()
    P, M = (a.reshape(len(u), len(share), 3) for a in patch.facing(*at))
    got = scallop_heights(P, M, tuple(tips), tuple(axes), rho, corner)
    apart = [float(np.nanmedian(np.linalg.norm(np.diff(p, axis=0), axis=1))) for p in tips]
    want = heights_of_all(P, M, tips, axes, [max(2, math.ceil(4.0 / a)) for a in apart], rho, corner, 5)
    assert np.isnan(got[70])
    assert np.isfinite(np.delete(got, 70)).all()
    assert np.delete(got, 70) == pytest.approx(np.delete(want, 70), abs=1e-12)
