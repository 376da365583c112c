"""Compiled loops: the least distance of points from a body of revolution in many places.

Notation: the body stands with its tip at T and its unit axis A; z [mm] height above the tip, rho [mm] distance from the
axis. Its meridian is ``lines`` (m, 4) ``[rho0, z0, rho1, z1]``, z0 <= z1, and ``arcs`` (k, 5) ``[e, f, r, a0, a1]``,
centre, radius and range of the angle from the direction -z towards +rho. A distance is below 0 inside.

A distance changes no faster than its point moves, but where a body ends: its flat ends are no surface. In a cell whose
corners are within r of its middle, and that reaches no height at which a line ends, no distance is below that of the
middle less r. A cell in which that lowers nothing is left out.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

#: allowance for rounding of a distance [mm]; fewest points of a cell whose middle is looked at first
ROUNDED, FEWEST = 1e-9, 4


@njit(cache=True, nogil=True)
def meridian(rho, z, lines, arcs, top):
    """Signed distance of (rho, z) from the meridian; the flat end at ``top`` is no surface, above it is outside."""
    best = 1e300
    inside = 0.0 <= z <= top
    reach = -1.0
    for i in range(len(arcs)):
        e, f, r = arcs[i, 0], arcs[i, 1], arcs[i, 2]
        x, y = rho - e, f - z
        size = math.hypot(x, y)
        if size == 0.0:
            best = min(best, r)
        elif arcs[i, 3] <= math.atan2(x, y) <= arcs[i, 4]:
            best = min(best, abs(size - r))
        if r * math.cos(arcs[i, 4]) <= y <= r * math.cos(arcs[i, 3]):
            reach = max(reach, e + math.sqrt(max(r * r - y * y, 0.0)))
    for i in range(len(lines)):
        x0, y0, x1, y1 = lines[i, 0], lines[i, 1], lines[i, 2], lines[i, 3]
        dx, dy = x1 - x0, y1 - y0
        size = dx * dx + dy * dy
        u = 0.0
        if size > 0.0:
            u = min(max(((rho - x0) * dx + (z - y0) * dy) / size, 0.0), 1.0)
        gap = math.hypot(rho - x0 - u * dx, z - y0 - u * dy)
        best = min(best, gap)
        if y0 < y1 and y0 <= z <= y1:
            reach = max(reach, x0 + (z - y0) / (y1 - y0) * dx)
    if inside and rho <= reach:
        return -best
    return best


@njit(cache=True, nogil=True)
def reaches_end(z, r, lines, top):
    """Whether a height at which a line of the meridian, or the body, begins or ends is within r of z."""
    found = abs(z) <= r or abs(z - top) <= r
    for i in range(len(lines)):
        found = found or abs(z - lines[i, 1]) <= r or abs(z - lines[i, 3]) <= r
    return found


@njit(cache=True, nogil=True)
def highest_of_cell(order, begin, end, out, first, most):
    """Write the greatest ``out`` and ``first`` of the points ``order[begin:end]`` of a cell to ``most`` (2,)."""
    most[0] = -math.inf
    most[1] = -math.inf
    for m in range(begin, end):
        p = order[m]
        most[0] = max(most[0], out[p])
        most[1] = max(most[1], float(first[p]))


@njit(cache=True, nogil=True)
def nearest(
    points, order, starts, low, cell, count, tips, axes, rows, lines, arcs, top, widest, far, depth, done, out, at,
    deep, first,
):  # fmt: skip
    """Lower ``out`` to the signed distance of each point from the body in any of its places; ``at`` its step.

    The step of a row is the row and those ``done`` before. ``deep`` is lowered to the least distance of any point in
    each row, ``first`` to the first step that has the point deeper inside than ``depth``. ``order`` holds the points
    cell by cell, ``starts`` where each cell begins; distances above ``far`` are left alone.
    """
    nx, ny, nz = count[0], count[1], count[2]
    reach = widest + far
    ball = 0.5 * math.sqrt(3.0) * cell + ROUNDED
    # of each cell the greatest distance so far, and the last of the first steps; nan: not known yet
    highest = np.full((len(starts) - 1, 2), np.nan)
    for k in range(len(tips)):
        tx, ty, tz = tips[k, 0], tips[k, 1], tips[k, 2]
        ax, ay, az = axes[k, 0], axes[k, 1], axes[k, 2]
        sx, sy = math.sqrt(max(1.0 - ax * ax, 0.0)), math.sqrt(max(1.0 - ay * ay, 0.0))
        sz = math.sqrt(max(1.0 - az * az, 0.0))
        x0 = tx + min(0.0, top * ax) - widest * sx - far
        x1 = tx + max(0.0, top * ax) + widest * sx + far
        y0 = ty + min(0.0, top * ay) - widest * sy - far
        y1 = ty + max(0.0, top * ay) + widest * sy + far
        z0 = tz + min(0.0, top * az) - widest * sz - far
        z1 = tz + max(0.0, top * az) + widest * sz + far
        i0, i1 = max(math.floor((x0 - low[0]) / cell), 0), min(math.floor((x1 - low[0]) / cell), nx - 1)
        j0, j1 = max(math.floor((y0 - low[1]) / cell), 0), min(math.floor((y1 - low[1]) / cell), ny - 1)
        l0, l1 = max(math.floor((z0 - low[2]) / cell), 0), min(math.floor((z1 - low[2]) / cell), nz - 1)
        for i in range(i0, i1 + 1):
            for j in range(j0, j1 + 1):
                for h in range(l0, l1 + 1):
                    c = (i * ny + j) * nz + h
                    begin, end = starts[c], starts[c + 1]
                    if end - begin >= FEWEST:
                        x, y = low[0] + (i + 0.5) * cell - tx, low[1] + (j + 0.5) * cell - ty
                        z = low[2] + (h + 0.5) * cell - tz
                        up = x * ax + y * ay + z * az
                        if up < -far - ball or up > top + far + ball:
                            continue
                        rho = math.sqrt(max(x * x + y * y + z * z - up * up, 0.0))
                        if rho > reach + ball:
                            continue
                        if not reaches_end(up, ball, lines, top):
                            least = meridian(rho, up, lines, arcs, top) - ball
                            if least > far:
                                continue
                            if deep[rows[k]] <= least:
                                if math.isnan(highest[c, 0]):
                                    highest_of_cell(order, begin, end, out, first, highest[c])
                                if highest[c, 0] <= least and (least >= -depth or highest[c, 1] <= done + rows[k]):
                                    continue
                    highest[c, 0] = math.nan
                    for m in range(begin, end):
                        p = order[m]
                        x, y, z = points[p, 0] - tx, points[p, 1] - ty, points[p, 2] - tz
                        up = x * ax + y * ay + z * az
                        if up < -far or up > top + far:
                            continue
                        square = x * x + y * y + z * z - up * up
                        if square > reach * reach:
                            continue
                        gap = meridian(math.sqrt(max(square, 0.0)), up, lines, arcs, top)
                        if gap > far:
                            continue
                        deep[rows[k]] = min(deep[rows[k]], gap)
                        if gap < -depth:
                            first[p] = min(first[p], done + rows[k])
                        if gap < out[p]:
                            out[p] = gap
                            at[p] = done + rows[k]
