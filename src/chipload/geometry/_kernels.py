"""Compiled loops of the geometry room: distances to lines and arcs, and their mutual crossings.

Segments are rows ``[x0, y0, x1, y1, xc, yc, sweep]`` (see ``contour.py``), boxes rows ``[xmin, ymin, xmax, ymax]``;
lengths in mm, angles in rad. ``distance.py`` and ``offset.py`` are the users.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit


@njit(cache=True, nogil=True)
def point_segment(px: float, py: float, seg: Any) -> float:
    """Distance [mm] of a point to one segment (7,)."""
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
    """Least distance of each point (m, 2) to the segments (n, 7) into ``out`` (m,)."""
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
def nearer(segments: Any, boxes: Any, points: Any, limit: float, out: Any) -> None:
    """Whether any of the points (m, k, 2) of a row lies nearer than ``limit`` to a segment, into ``out`` (m,)."""
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
def _holds(seg: Any, px: float, py: float, tol: float) -> bool:
    """Whether a point of the whole line or circle of a segment lies within its ends, to ``tol`` [mm]."""
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
def _meet(a: Any, b: Any, tangent: float, hit: Any) -> int:
    """Common points of the whole lines or circles of two segments into ``hit`` (2, 2); how many there are.

    Curves that miss or pass each other by less than ``tangent`` [mm] touch in one point; coincident ones give none.
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
            other = math.hypot(ex, ey)
            cross = (dx * ey - dy * ex) / other
            if abs(cross) < 1e-11:
                return 0
            u = ((b[0] - a[0]) * ey - (b[1] - a[1]) * ex) / other / cross
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
    gap = math.hypot(dx, dy)
    if gap <= tangent:
        return 0
    dx /= gap
    dy /= gap
    u = 0.5 * (gap + (r - q) * (r + q) / gap)
    if abs(gap - r - q) <= tangent or abs(gap - abs(r - q)) <= tangent:
        s = r if u > 0.0 else -r
        hit[0, 0], hit[0, 1] = a[4] + s * dx, a[5] + s * dy
        return 1
    if gap > r + q or gap < abs(r - q):
        return 0
    # four times the area of the triangle of the two centres and a common point, by Heron's formula
    area = math.sqrt((r + q + gap) * (r + q - gap) * (gap + r - q) * (gap - r + q))
    w = 0.5 * area / gap
    hit[0, 0], hit[0, 1] = a[4] + u * dx - w * dy, a[5] + u * dy + w * dx
    hit[1, 0], hit[1, 1] = a[4] + u * dx + w * dy, a[5] + u * dy - w * dx
    return 2


@njit(cache=True, nogil=True)
def crossings(
    segments: Any, boxes: Any, order: Any, smooth: Any, tol: float, tangent: float, who: Any, where: Any
) -> int:
    """Where segments cross, touch, or carry an end of another: rows (segment, other) and points; how many.

    ``order`` (n,) sorts the boxes by xmin; ``smooth`` (n,) names the segment that follows tangentially (-1: none),
    such a pair is skipped. No more than ``len(who)`` rows are written: call again with more room if more are counted.
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
            for k in range(_meet(a, b, tangent, hit)):
                px, py = hit[k, 0], hit[k, 1]
                if _holds(a, px, py, tol) and _holds(b, px, py, tol):
                    if count + 1 < len(who):
                        who[count, 0], who[count, 1] = i, j
                        who[count + 1, 0], who[count + 1, 1] = j, i
                        where[count, 0], where[count, 1] = px, py
                        where[count + 1, 0], where[count + 1, 1] = px, py
                    count += 2
            for k in range(4):
                s = b if k < 2 else a
                o = a if k < 2 else b
                px, py = s[2 * (k % 2)], s[2 * (k % 2) + 1]
                if point_segment(px, py, o) <= tol:
                    if count < len(who):
                        who[count, 0] = i if k < 2 else j
                        who[count, 1] = j if k < 2 else i
                        where[count, 0], where[count, 1] = px, py
                    count += 1
    return count
