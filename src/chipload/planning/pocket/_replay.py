"""Compiled loop that measures the engagement along the motions of a pocket, in a stock of its own."""

from __future__ import annotations

import math

from numba import njit

from chipload.engagement.moves._uncounted_arrays import borrow_arrays
from chipload.planning.pocket._fit import place
from chipload.stock._planar import remove_segment, uncut
from chipload.stock.planar import TOUCH

#: curvature x R above which the cutter meets what the same arc has just cut
TIGHT = 0.9
#: length / R behind the cutter whose cut is not removed before its rim is examined
BEHIND = 1e-4
#: engaged arcs that are kept
KEPT = 4


@njit(cache=True, nogil=True)
def replay(segments, motion, share, block, R, angle, most, count, phi, capsule, used, grid, head, chains, link, axis,
           arcs, seg):  # fmt: skip
    """Engagement at the end of the pieces ``block`` (rising), the greatest along each, and the arcs in immersion.

    A motion is taken from the stock when its last piece is measured; one that bends so much that it meets its own cut,
    piece by piece. Returns (capsules, chain entries).
    """
    segments, motion, share, block, seg = borrow_arrays((segments, motion, share, block, seg))
    angle, most, count, phi = borrow_arrays((angle, most, count, phi))
    grid, head, chains, link, axis, arcs = borrow_arrays((grid, head, chains, link, axis, arcs))
    r = R * (1.0 - TOUCH)
    for i in block:
        for c in range(7):
            seg[c] = segments[motion[i], c]
        w1 = share[i]
        w0 = share[i - 1] if motion[i - 1] == motion[i] else 0.0
        rho = math.sqrt((seg[0] - seg[4]) ** 2 + (seg[1] - seg[5]) ** 2)
        tight = seg[6] != 0.0 and TIGHT * rho < R
        done = w0
        for j in range(1 if tight else 0, 3):
            w = w0 + (w1 - w0) * (0.02 if j == 0 else 0.5 * j)
            if tight:
                until = max(done, w - BEHIND * R / (rho * abs(seg[6])))
                x0, y0, t = place(seg, done)
                x1, y1, t = place(seg, until)
                if until > done:
                    capsule, used = remove_segment(
                        x0, y0, x1, y1, seg[4], seg[5], (until - done) * seg[6], capsule, R, grid, head, chains, link,
                        used, axis,
                    )  # fmt: skip
                done = until
            x, y, t = place(seg, w)
            n = uncut(x, y, math.cos(t), math.sin(t), r, R, False, grid, head, link, axis, arcs)
            total = 0.0
            for v in range(n):
                total += arcs[v, 1] - arcs[v, 0]
            most[i] = max(most[i], total)
        angle[i], count[i] = total, n
        for v in range(min(n, KEPT)):  # the widest first
            widest = 0
            for q in range(n):
                if arcs[q, 1] - arcs[q, 0] > arcs[widest, 1] - arcs[widest, 0]:
                    widest = q
            phi[i, v, 0], phi[i, v, 1] = 0.5 * math.pi - arcs[widest, 1], 0.5 * math.pi - arcs[widest, 0]
            arcs[widest, 1] = arcs[widest, 0] - 1.0
        if tight:
            x0, y0, t = place(seg, done)
            x1, y1, t = place(seg, w1)
            capsule, used = remove_segment(
                x0, y0, x1, y1, seg[4], seg[5], (w1 - done) * seg[6], capsule, R, grid, head, chains, link, used, axis
            )
        elif w1 >= 1.0:
            capsule, used = remove_segment(
                seg[0], seg[1], seg[2], seg[3], seg[4], seg[5], seg[6], capsule, R, grid, head, chains, link, used, axis
            )
    return capsule, used
