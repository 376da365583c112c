"""The planner's exact engagement, the checker's trail and a polygon oracle agree, on contours nobody chose.

Old surface: a closed ring of tangent lines and arcs, convex and concave. The first pass leaves it, the second runs
parallel to it, s deeper. Engagement is taken three ways: by circle against line and arc (engagement.contact), by the
trail of both passes (simulation.trail), and by polygons (shapely): the stock flattened with chords of 1e-7 mm, the rim
sampled and halved by `contains`.
"""

import numpy as np
import pytest
import shapely

from chipload.engagement.contact import StockBoundary, engagement
from chipload.geometry.contour import Contour
from chipload.simulation.centre_path import CentrePath, rim_engagement

R = 5.0


def ring(rng) -> Contour:
    """A star-shaped polygon, counter-clockwise, each corner rounded by an arc tangent to both sides.

    Radii of corners that turn left and right are above 2 R, so that parallels on either side stay regular; corners
    where a side is too short for that are drawn again.
    """
    while True:
        n = int(rng.integers(6, 11))
        angle = 2 * np.pi * (np.arange(n) + rng.uniform(-0.25, 0.25, n)) / n
        p = rng.uniform(60, 140, n)[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
        d = np.roll(p, -1, axis=0) - p
        length = np.hypot(*d.T)
        t = d / length[:, None]
        before = np.roll(t, 1, axis=0)
        turn = np.arctan2(before[:, 0] * t[:, 1] - before[:, 1] * t[:, 0], (before * t).sum(1))
        radius = rng.uniform(2.2 * R, 4 * R, n)
        cut = radius * np.tan(np.abs(turn) / 2)
        if (cut + np.roll(cut, -1) < length - 1.0).all() and (turn < -0.2).any():
            break
    vertices = np.stack([p - cut[:, None] * before, p + cut[:, None] * t], axis=1).reshape(-1, 2)
    bulges = np.column_stack([np.tan(turn / 4), np.zeros(n)]).ravel()
    return Contour.from_bulges(vertices, bulges, closed=True)


def parallel(contour: Contour, left: float) -> Contour:
    """The parallel ``left`` mm to the left of a tangent contour whose arcs on that side are wider than that."""
    seg = contour.segments
    _, start, _ = contour.at(contour.knots[:-1])
    end = np.empty_like(start)
    for k, sweep in enumerate(seg[:, 6]):
        c, s = np.cos(sweep), np.sin(sweep)
        end[k] = (c * start[k, 0] - s * start[k, 1], s * start[k, 0] + c * start[k, 1])
    out = seg.copy()
    out[:, 0:2] += left * np.column_stack([-start[:, 1], start[:, 0]])
    out[:, 2:4] += left * np.column_stack([-end[:, 1], end[:, 0]])
    return Contour(out)


def polygon_engagement(old: Contour, outside: bool, centre, heading) -> float:
    """Engagement [deg] against the polygon of the stock, flattened with chords of 1e-7 mm near the cutter."""
    rings = []
    for row in old.segments:
        near = shapely.distance(shapely.Point(centre), shapely.LineString(Contour(row[None]).flatten(0.01)))
        rings.append(Contour(row[None]).flatten(1e-7 if near < 1.1 * R else 1e-2)[:-1])
    inside = shapely.polygons(np.vstack(rings))
    if not outside:
        inside = shapely.difference(shapely.box(-400, -400, 400, 400), inside)
    solid = shapely.clip_by_rect(inside, *(centre - 1.2 * R), *(centre + 1.2 * R))
    shapely.prepare(solid)
    left = np.array([-heading[1], heading[0]])

    def full(phi):
        rim = centre + R * (np.sin(phi)[:, None] * heading + np.cos(phi)[:, None] * left)
        return shapely.contains_xy(solid, rim[:, 0], rim[:, 1])

    phi = np.linspace(0.0, np.pi, 1441)
    has = full(phi)
    change = np.flatnonzero(has[1:] != has[:-1])
    lo, hi = phi[change].copy(), phi[change + 1].copy()
    for _ in range(30):
        middle = 0.5 * (lo + hi)
        same = full(middle) == has[change]
        lo, hi = np.where(same, middle, lo), np.where(same, hi, middle)
    ends = np.concatenate([[0.0], 0.5 * (lo + hi), [np.pi]])
    return float(np.degrees((np.diff(ends) * np.concatenate([has[change], has[-1:]])).sum()))


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("outside", [False, True], ids=["inside", "outside"])
@pytest.mark.parametrize("sense", [1, -1], ids=["ccw", "cw"])
def test_three_ways_agree(seed, outside, sense):
    rng = np.random.default_rng(seed)
    old = ring(rng)
    s = float(rng.choice([0.02, 0.1, 0.5, 2.0]))
    side = -1.0 if outside else 1.0  # where the cutter runs, seen along the counter-clockwise ring
    paths = [parallel(old, side * R), parallel(old, side * (R - s))]
    material = old if outside else old.reversed()
    if sense < 0:
        paths = [c.reversed() for c in paths]
    trail = CentrePath(np.vstack([c.segments for c in paths]), R)
    # the last turn's beginning is in its own trail: look at the first 80 per cent of it
    n = len(old.segments)
    where = np.sort(rng.uniform(3 * R, 0.8 * paths[1].length, 200))
    # and close about every joint, where the leading point crosses from line to arc
    joints = paths[1].knots[(paths[1].knots > 4 * R) & (paths[1].knots < 0.8 * paths[1].length)]
    where = np.concatenate([where, joints - 1e-3, joints + 1e-3, joints - 0.3 * R])
    o, t, _ = paths[1].at(where)
    exact = engagement(StockBoundary(material.segments), o, t, R)
    assert (exact.count == 1).all()
    found = np.degrees(exact.angle)

    k = np.clip(np.searchsorted(paths[1].knots, where, side="right") - 1, 0, n - 1)
    rim = rim_engagement(trail, n + k, (where - paths[1].knots[k]) / paths[1].lengths[k])
    assert np.degrees(rim.angle) == pytest.approx(found, abs=1e-4)
    assert (rim.count == 1).all()
    assert rim.phi[:, 0] == pytest.approx(exact.phi[:, 0], abs=2e-5)

    for j in rng.choice(len(where), 3, replace=False):
        assert polygon_engagement(old, outside, o[j], t[j]) == pytest.approx(found[j], abs=0.01)
