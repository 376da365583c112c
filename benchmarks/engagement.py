"""Exact engagement queries a second on two threads, and the polygon method's in the same run.

    python benchmarks/engagement.py [queries]

A pass round 8 mm corners: the stock is the parallel left by the pass before, R 5, s 0.1, centres spread evenly. The
polygon method flattens the stock once to 1e-6 mm chords; each query clips it to the box of the cutter and intersects
the front half of the rim, a polyline of 0.05 deg, with it.
"""

import sys
import time

import numpy as np
import shapely

from chipload.engagement.contact import StockBoundary, engagement
from chipload.geometry.contour import Contour

R, S, RC, HALF = 5.0, 0.1, 8.0, 40.0


def rounded(radius: float) -> Contour:
    """A square of half width HALF - RC + radius with corners of ``radius``, counter-clockwise."""
    h, c = HALF - RC + radius, HALF - RC
    b = np.tan(np.pi / 8)
    corners = [(-c, -h), (c, -h), (h, -c), (h, c), (c, h), (-c, h), (-h, c), (-h, -c)]
    return Contour.from_bulges(corners, [0, b] * 4, closed=True)


def main() -> None:
    m = int(sys.argv[1]) if len(sys.argv) > 1 else 2_000_000
    path, old = rounded(RC - R), rounded(RC - S)
    stock = StockBoundary(old.reversed().segments)
    o, t, _ = path.at(np.linspace(0.0, path.length, m, endpoint=False))
    engagement(stock, o[:10], t[:10], R)
    begun = time.perf_counter()
    exact = np.degrees(engagement(stock, o, t, R, workers=2).angle)
    fast = m / (time.perf_counter() - begun)
    print(f"exact    {fast:12.0f} queries/s  two threads, {m} queries, {exact.min():.3f}..{exact.max():.3f} deg")

    some = np.linspace(0, m - 1, 400).astype(int)
    outer = shapely.box(-3 * HALF, -3 * HALF, 3 * HALF, 3 * HALF)
    solid = shapely.difference(outer, shapely.polygons(old.flatten(1e-6)))
    phi = np.linspace(0.0, np.pi, 3601)
    u = np.stack([np.sin(phi), np.cos(phi)], axis=1)
    begun = time.perf_counter()
    found = np.empty(len(some))
    for j, k in enumerate(some):
        n = np.array([-t[k, 1], t[k, 0]])
        front = shapely.linestrings(o[k] + R * (u[:, :1] * t[k] + u[:, 1:] * n))
        near = shapely.clip_by_rect(solid, *(o[k] - 1.1 * R), *(o[k] + 1.1 * R))
        found[j] = np.degrees(shapely.length(shapely.intersection(front, near)) / R)
    slow = len(some) / (time.perf_counter() - begun)
    print(f"polygon  {slow:12.0f} queries/s  one thread, {len(some)} queries, "
          f"differs by at most {np.abs(found - exact[some]).max():.4f} deg")  # fmt: skip
    print(f"ratio    {fast / slow:12.0f}")


if __name__ == "__main__":
    main()
