"""Compiled loops of plane geometry: distances of points from lines and arcs, and the crossings of segments.

Segments are rows ``[x0, y0, x1, y1, xc, yc, sweep]`` (see ``contour.py``), boxes rows ``[xmin, ymin, xmax, ymax]``;
lengths in mm, angles in rad. ``distance.py``, ``split.py`` and ``offset.py`` call them.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit


@njit(cache=True, nogil=True)
def point_segment(px: float, py: float, seg: Any) -> float:
    """Distance [mm] of a point from one segment (7,)."""
    sweep = seg[6]
    if sweep == 0.0:
        dx, dy = seg[2] - seg[0], seg[3] - seg[1]
        u = ((px - seg[0]) * dx + (py - seg[1]) * dy) / (dx * dx + dy * dy)
        u = min(max(u, 0.0), 1.0)
        return math.hypot(px - seg[0] - u * dx, py - seg[1] - u * dy)
    sense = 1.0 if sweep > 0.0 else -1.0
    ax, ay = seg[0] - seg[4], seg[1] - seg[5]
    bx, by = seg[2] - seg[4], seg[3] - seg[5]
    qx, qy = px - seg[4], py - seg[5]
    if abs(sweep) <= math.pi:
        inside = sense * (ax * qy - ay * qx) >= 0.0 and sense * (qx * by - qy * bx) >= 0.0
    elif abs(sweep) >= 2.0 * math.pi - 1e-12:
        inside = True
    else:
        inside = not (sense * (bx * qy - by * qx) > 0.0 and sense * (qx * ay - qy * ax) > 0.0)
    if inside:
        return abs(math.hypot(qx, qy) - math.hypot(ax, ay))
    return min(math.hypot(px - seg[0], py - seg[1]), math.hypot(px - seg[2], py - seg[3]))


@njit(cache=True, nogil=True)
def distance(segments: Any, boxes: Any, points: Any, out: Any) -> None:
    """Write the least distance [mm] of each point (m, 2) from the segments (n, 7) to ``out`` (m,)."""
    for k in range(len(points)):
        px, py = points[k, 0], points[k, 1]
        best = np.inf
        for i in range(len(segments)):
            dx = max(boxes[i, 0] - px, px - boxes[i, 2], 0.0)
            dy = max(boxes[i, 1] - py, py - boxes[i, 3], 0.0)
            if dx * dx + dy * dy < best * best:
                best = min(best, point_segment(px, py, segments[i]))
        out[k] = best


@njit(cache=True, nogil=True)
def within_distance(segments: Any, boxes: Any, points: Any, limit: float, out: Any) -> None:
    """Write to ``out`` (m,) whether any of the points (m, k, 2) of a row is within ``limit`` [mm] of a segment."""
    last = 0
    for m in range(len(points)):
        out[m] = False
        for k in range(points.shape[1]):
            px, py = points[m, k, 0], points[m, k, 1]
            if point_segment(px, py, segments[last]) < limit:
                out[m] = True
                break
            for i in range(len(segments)):
                if (
                    boxes[i, 0] - px < limit
                    and px - boxes[i, 2] < limit
                    and boxes[i, 1] - py < limit
                    and py - boxes[i, 3] < limit
                    and point_segment(px, py, segments[i]) < limit
                ):
                    out[m] = True
                    last = i
                    break
            if out[m]:
                break


@njit(cache=True, nogil=True)
def _within_ends(seg: Any, px: float, py: float, tol: float) -> bool:
    """Whether a point of the infinite line, or full circle, of a segment lies on the segment, to ``tol`` [mm]."""
    if seg[6] == 0.0:
        dx, dy = seg[2] - seg[0], seg[3] - seg[1]
        length = math.hypot(dx, dy)
        u = ((px - seg[0]) * dx + (py - seg[1]) * dy) / length
        return bool(-tol <= u <= length + tol)
    sense = 1.0 if seg[6] > 0.0 else -1.0
    ax, ay = seg[0] - seg[4], seg[1] - seg[5]
    qx, qy = px - seg[4], py - seg[5]
    turn = sense * math.atan2(ax * qy - ay * qx, ax * qx + ay * qy)
    if turn < 0.0:
        turn += 2.0 * math.pi
    slack = tol / math.hypot(ax, ay)
    return bool(turn <= abs(seg[6]) + slack or turn >= 2.0 * math.pi - slack)


@njit(cache=True, nogil=True)
def _intersections(a: Any, b: Any, tangent: float, hit: Any) -> int:
    """Write the common points of the infinite lines, or full circles, of two segments to ``hit`` (2, 2); their number.

    Curves that miss or overlap each other by less than ``tangent`` [mm] touch in one point; coincident ones have none.
    """
    if a[6] != 0.0 and b[6] == 0.0:
        a, b = b, a
    if a[6] == 0.0:
        dx, dy = a[2] - a[0], a[3] - a[1]
        length = math.hypot(dx, dy)
        dx /= length
        dy /= length
        if b[6] == 0.0:
            ex, ey = b[2] - b[0], b[3] - b[1]
            length_b = math.hypot(ex, ey)
            cross = (dx * ey - dy * ex) / length_b
            if abs(cross) < 1e-11:
                return 0
            u = ((b[0] - a[0]) * ey - (b[1] - a[1]) * ex) / length_b / cross
            hit[0, 0], hit[0, 1] = a[0] + u * dx, a[1] + u * dy
            return 1
        r = math.hypot(b[0] - b[4], b[1] - b[5])
        u = (b[4] - a[0]) * dx + (b[5] - a[1]) * dy
        h = (b[4] - a[0]) * dy - (b[5] - a[1]) * dx
        fx, fy = a[0] + u * dx, a[1] + u * dy
        if abs(abs(h) - r) <= tangent:
            hit[0, 0], hit[0, 1] = fx, fy
            return 1
        if abs(h) > r:
            return 0
        w = math.sqrt((r - abs(h)) * (r + abs(h)))
        hit[0, 0], hit[0, 1] = fx - w * dx, fy - w * dy
        hit[1, 0], hit[1, 1] = fx + w * dx, fy + w * dy
        return 2
    r = math.hypot(a[0] - a[4], a[1] - a[5])
    q = math.hypot(b[0] - b[4], b[1] - b[5])
    dx, dy = b[4] - a[4], b[5] - a[5]
    spacing = math.hypot(dx, dy)
    if spacing <= tangent:
        return 0
    dx /= spacing
    dy /= spacing
    u = 0.5 * (spacing + (r - q) * (r + q) / spacing)
    if abs(spacing - r - q) <= tangent or abs(spacing - abs(r - q)) <= tangent:
        s = r if u > 0.0 else -r
        hit[0, 0], hit[0, 1] = a[4] + s * dx, a[5] + s * dy
        return 1
    if spacing > r + q or spacing < abs(r - q):
        return 0
    # four times the area of the triangle of the two centres and a common point, by Heron's formula
    area = math.sqrt((r + q + spacing) * (r + q - spacing) * (spacing + r - q) * (spacing - r + q))
    w = 0.5 * area / spacing
    hit[0, 0], hit[0, 1] = a[4] + u * dx - w * dy, a[5] + u * dy + w * dx
    hit[1, 0], hit[1, 1] = a[4] + u * dx + w * dy, a[5] + u * dy - w * dx
    return 2


@njit(cache=True, nogil=True)
def crossings(
    segments: Any, boxes: Any, order: Any, smooth: Any, tol: float, tangent: float, pairs: Any, places: Any
) -> int:
    """Points in which segments cross or touch, or in which one has an end on the other; their number.

    ``pairs`` (k, 2) receives the segment and the other one, ``places`` (k, 2) [mm] the point. ``order`` (n,) sorts the
    boxes by xmin; ``smooth`` (n,) is the number of the segment that follows tangentially (-1: none), and such a pair is
    skipped. At most k rows are written: if more are counted, call again with larger arrays.
    """
    count = 0
    hit = np.empty((2, 2))
    for m in range(len(order)):
        i = order[m]
        for n in range(m + 1, len(order)):
            j = order[n]
            if boxes[j, 0] > boxes[i, 2] + tol:
                break
            if boxes[j, 1] > boxes[i, 3] + tol or boxes[i, 1] > boxes[j, 3] + tol:
                continue
            if smooth[i] == j or smooth[j] == i:
                continue
            a, b = segments[i], segments[j]
            for k in range(_intersections(a, b, tangent, hit)):
                px, py = hit[k, 0], hit[k, 1]
                if _within_ends(a, px, py, tol) and _within_ends(b, px, py, tol):
                    if count + 1 < len(pairs):
                        pairs[count, 0], pairs[count, 1] = i, j
                        pairs[count + 1, 0], pairs[count + 1, 1] = j, i
                        places[count, 0], places[count, 1] = px, py
                        places[count + 1, 0], places[count + 1, 1] = px, py
                    count += 2
            for k in range(4):
                s = b if k < 2 else a
                o = a if k < 2 else b
                px, py = s[2 * (k % 2)], s[2 * (k % 2) + 1]
                if point_segment(px, py, o) <= tol:
                    if count < len(pairs):
                        pairs[count, 0] = i if k < 2 else j
                        pairs[count, 1] = j if k < 2 else i
                        places[count, 0], places[count, 1] = px, py
                    count += 1
    return count
