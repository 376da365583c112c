"""Compiled loop that writes a pass as lines and arcs, and measures the engagement along them.

Notation: as in ``_pass_steps``; tau [mm] the greatest distance of the vertices of a pass from its lines and arcs.
"""

from __future__ import annotations

import math

from numba import njit

from chipload.planning.pocket._pass_steps import angle_at, in_centre_region, room
from chipload.stock._planar import remove_segment

#: radii of arcs / R, least and greatest
LEAST, GREATEST = 0.35, 2000.0
#: greatest sweep of an arc, and the greatest turn [rad] at the middle of one through three vertices
SWEEP, BEND = 2.6, 0.16
#: vertices in one segment at most
MOST = 256
#: greatest turn between two examined places [rad]; so near to the limit [rad] the greatest is searched
TURN, NEAR = 0.03, 0.02
#: where E changes by so much [rad] between two places, a narrow strip of stock may stand there: examined more closely
JUMP = 0.05
#: distance / R of the places at which a segment is held against the centre region
EVERY = 0.01
#: engagement above the limit that is none [rad]
ABOVE = 1e-5


@njit(cache=True, nogil=True)
def fits_element(p, i, j, tau, R, out):
    """Whether one line or arc from vertex i to vertex j passes every vertex between within tau; ``out`` (7,) is it.

    Rows of ``p``: x, y, heading, sweep of the step that ends there (0: straight).
    """
    x0, y0, x1, y1 = p[i, 0], p[i, 1], p[j, 0], p[j, 1]
    dx, dy = x1 - x0, y1 - y0
    chord = math.sqrt(dx * dx + dy * dy)
    out[0], out[1], out[2], out[3], out[4], out[5], out[6] = x0, y0, x1, y1, 0.0, 0.0, 0.0
    if j == i + 1:
        own = p[j, 3]
        if own != 0.0:
            c = 0.5 / math.tan(0.5 * own)
            out[4], out[5], out[6] = 0.5 * (x0 + x1) - c * dy, 0.5 * (y0 + y1) + c * dx, own
        return True
    if chord <= 1e-6 * R:
        return False
    dx, dy = dx / chord, dy / chord
    straight = True
    along = 0.0
    for k in range(i + 1, j):
        wx, wy = p[k, 0] - x0, p[k, 1] - y0
        t = wx * dx + wy * dy
        if abs(wy * dx - wx * dy) > tau or t < along or t > chord:
            straight = False
            break
        along = t
    if straight:
        return True
    m = (i + j) // 2
    wx, wy = p[m, 0] - x0, p[m, 1] - y0
    t, h = wx * dx + wy * dy, wy * dx - wx * dy
    if abs(h) < 1e-9 * R:
        return False
    # centre on the middle normal of the chord at height c: t (t - chord) + h (h - 2 c) = 0
    c = (t * (t - chord) + h * h) / (2.0 * h)
    rho = math.sqrt(0.25 * chord * chord + c * c)
    if not LEAST * R <= rho <= GREATEST * R:
        return False
    xc, yc = x0 + 0.5 * chord * dx - c * dy, y0 + 0.5 * chord * dy + c * dx
    sense = -1.0 if h > 0.0 else 1.0
    ux, uy = x0 - xc, y0 - yc
    total, before = 0.0, 0.0
    for k in range(i + 1, j + 1):
        vx, vy = p[k, 0] - xc, p[k, 1] - yc
        if k < j and abs(math.sqrt(vx * vx + vy * vy) - rho) > tau:
            return False
        part = sense * math.atan2(ux * vy - uy * vx, ux * vx + uy * vy)
        if part <= 0.0:
            return False
        total += part
        if total > SWEEP or (j == i + 2 and part > BEND):
            return False
        # an arc through few vertices must not bulge between them
        if k > i + 1 and part > 3.0 * before + BEND:
            return False
        before = part
        ux, uy = vx, vy
    out[4], out[5], out[6] = xc, yc, sense * total
    return True


@njit(cache=True, nogil=True)
def place(seg, w):
    """(x, y, heading) at the share w of a segment."""
    if seg[6] == 0.0:
        dx, dy = seg[2] - seg[0], seg[3] - seg[1]
        return seg[0] + w * dx, seg[1] + w * dy, math.atan2(dy, dx)
    ux, uy = seg[0] - seg[4], seg[1] - seg[5]
    c, s = math.cos(w * seg[6]), math.sin(w * seg[6])
    vx, vy = c * ux - s * uy, s * ux + c * uy
    t = math.atan2(vy, vx) + math.copysign(0.5 * math.pi, seg[6])
    return seg[4] + vx, seg[5] + vy, t


@njit(cache=True, nogil=True)
def position(seg, w):
    """(x, y) at the share w of a segment, as :func:`place`."""
    if seg[6] == 0.0:
        return seg[0] + w * (seg[2] - seg[0]), seg[1] + w * (seg[3] - seg[1])
    ux, uy = seg[0] - seg[4], seg[1] - seg[5]
    c, s = math.cos(w * seg[6]), math.sin(w * seg[6])
    return seg[4] + (c * ux - s * uy), seg[5] + (s * ux + c * uy)


@njit(cache=True, nogil=True)
def share_of(seg, x, y):
    """Share of a segment at the place nearest to a vertex on it."""
    if seg[6] == 0.0:
        dx, dy = seg[2] - seg[0], seg[3] - seg[1]
        w = ((x - seg[0]) * dx + (y - seg[1]) * dy) / (dx * dx + dy * dy)
    else:
        ux, uy = seg[0] - seg[4], seg[1] - seg[5]
        vx, vy = x - seg[4], y - seg[5]
        a = math.atan2(ux * vy - uy * vx, ux * vx + uy * vy) / seg[6]
        turn = 2.0 * math.pi / abs(seg[6])
        w = a if a >= -1e-6 else a + turn
    return min(1.0, max(0.0, w))


@njit(cache=True, nogil=True)
def segment_length(seg):
    """Length of a segment."""
    if seg[6] == 0.0:
        return math.sqrt((seg[2] - seg[0]) ** 2 + (seg[3] - seg[1]) ** 2)
    return abs(seg[6]) * math.sqrt((seg[0] - seg[4]) ** 2 + (seg[1] - seg[5]) ** 2)


@njit(cache=True, nogil=True)
def in_region(seg, R, slack, grid, flag, edges, rows, row_edges):
    """Whether a segment stays in the centre region, within ``slack`` to either side, checked every 0.01 R.

    Between two places a wall as tight as R and an arc as tight as 0.35 R come nearer by at most 5e-5 R.
    """
    length = segment_length(seg)
    n = max(2, math.ceil(length / (EVERY * R)))
    k = 0
    while k + 1 < n:
        k += 1
        x, y = position(seg, k / n)
        if in_centre_region(x, y, grid, flag, edges, rows, row_edges):
            k += int(room(x, y, grid, flag) * n / length)
            continue
        x, y, t = place(seg, k / n)
        nx, ny = -slack * math.sin(t), slack * math.cos(t)
        if not (
            in_centre_region(x + nx, y + ny, grid, flag, edges, rows, row_edges)
            or in_centre_region(x - nx, y - ny, grid, flag, edges, rows, row_edges)
        ):
            return False
    return True


@njit(cache=True, nogil=True)
def engagement_along(seg, spacing, limit, r, R, grid, head, link, axis, arcs):
    """Greatest E along a segment, or one above the limit: near its start, at its end, every half ``spacing``, and at
    three places between two of them where E jumps.
    """
    n = max(2, math.ceil(2.0 * segment_length(seg) / spacing), math.ceil(abs(seg[6]) / TURN))
    most, at, after = 0.0, 1.0, 0.0
    for k in range(n, -1, -1):
        w = k / n if k > 0 else 0.02 / n
        x, y, t = place(seg, w)
        e = angle_at(x, y, math.cos(t), math.sin(t), r, R, grid, head, link, axis, arcs)
        if e > most:
            most, at = e, w
        between = 3 if k < n and abs(e - after) > JUMP else 0
        for q in range(1, between + 1):
            x, y, t = place(seg, w + 0.25 * q / n)
            e_q = angle_at(x, y, math.cos(t), math.sin(t), r, R, grid, head, link, axis, arcs)
            if e_q > most:
                most, at = e_q, w + 0.25 * q / n
        if most > limit:
            return most
        after = e
    if most > limit - NEAR:  # between its neighbours the greatest may be greater
        d = 1.0 / n
        for _ in range(3):
            d *= 0.5
            middle = at
            for side in (-1.0, 1.0):
                w = min(1.0, max(0.0, middle + side * d))
                x, y, t = place(seg, w)
                e = angle_at(x, y, math.cos(t), math.sin(t), r, R, grid, head, link, axis, arcs)
                if e > most:
                    most, at = e, w
    return most


@njit(cache=True, nogil=True)
def farthest(p, i, last, guess, tau, slack, R, seg, grid, flag, edges, rows, row_edges):
    """The most vertices after i, up to ``last``, that one segment takes: doubled as long as they fit, then between."""
    good, bad = 1, min(MOST, last - i) + 1
    trial = min(max(2, guess), bad - 1)
    while good + 1 < bad:
        trial = min(bad - 1, max(good + 1, trial))
        if fits_element(p, i, i + trial, tau, R, seg) and in_region(seg, R, slack, grid, flag, edges, rows, row_edges):
            good = trial
            trial = 2 * good if bad > 2 * good else (good + bad) // 2
        else:
            bad = trial
            trial = (good + bad) // 2
    return good


@njit(cache=True, nogil=True)
def write_segments(p, i, last, whole, tau, limit, spacing, slack, R, touch, segments, done, places, capsule, used, grid,
                   head, count, link, axis, arcs, seg, flag, edges, rows, row_edges):  # fmt: skip
    """Lines and arcs through the vertices i to ``last`` of ``p`` (n, 4), each removed from the stock as it is written.

    A segment takes as many vertices as lie within tau of it, as stay in the centre region and as keep E at or below
    the limit along all of it; at the least the step itself from one vertex to the next. ``segments`` (m, 8) is filled
    from row ``done`` on, ``places`` (n, 3) with the place of each vertex on its segment and the heading there. What
    could still grow is left unless ``whole``. Where even a step alone would exceed the limit, writing ends before it.
    Returns (whether it did not, vertex reached, segments, capsules, chain entries).
    """
    r = R * (1.0 - touch)
    guess = 4
    while i < last:
        good = farthest(p, i, last, guess, tau, slack, R, seg, grid, flag, edges, rows, row_edges)
        if i + good == last and not whole:
            break
        e = 0.0
        while True:
            if fits_element(p, i, i + good, tau, R, seg):
                e = engagement_along(seg, spacing, limit, r, R, grid, head, link, axis, arcs)
                if e <= limit or good == 1:
                    break
            good = max(1, good // 2)
        if e > limit + ABOVE:
            return False, i, done, capsule, used
        for k in range(7):
            segments[done, k] = seg[k]
        segments[done, 7] = e
        done += 1
        if e > 0.0:
            capsule, used = remove_segment(
                seg[0], seg[1], seg[2], seg[3], seg[4], seg[5], seg[6], capsule, R, grid, head, count, link, used, axis
            )
        for k in range(i + 1, i + good + 1):
            w = 1.0 if k == i + good else share_of(seg, p[k, 0], p[k, 1])
            x, y, t = place(seg, w)
            places[k, 0], places[k, 1], places[k, 2] = x, y, t
        guess = good
        i += good
    return True, i, done, capsule, used
