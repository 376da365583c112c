"""Compiled loop of the steps of one pass, in the stock and inside the inset region.

Notation: O centre of the cutter, th its heading [rad], phi the turn of the next step, positive to the left. Material
lies on the RIGHT. E engagement [rad], a* its limit, l step length, R radius. ``reach`` is the centre region: O may be
anywhere in it. It is a polygon: ``edges`` (n, 4), ``rows`` and ``row_edges`` the edges that meet each row of cells,
``flag`` 0 outside, 1 inside, 2 where an edge passes, on the cells of the stock's grid.
"""

from __future__ import annotations

import math

from numba import njit

from chipload.engagement.moves._uncounted_arrays import borrow_arrays
from chipload.stock._planar import uncut, uncut_between

#: turn to the left [rad] from which on a step is halved
SHARP = 0.2
#: tolerance of E below its limit at the end of an arc [rad]
CLOSE = 4e-4
#: least distance of the end of an arc from a wall, as a share of R
FILM = 1e-3
#: least distance, in cells, of an edge of the centre region from a place in a cell that is flagged as inside
AWAY = 0.7
#: length of an arc over that of a straight step; greatest turn of an arc to the left over that to the right
LONGER, SMOOTH = 2.0, 1.5


@njit(cache=True, nogil=True)
def in_centre_region(x, y, grid, flag, edges, rows, row_edges):
    """Whether O = (x, y) is in the centre region: cell flag, else the crossings of the ray to +x."""
    h = grid[2]
    nx, ny = int(grid[3]), int(grid[4])
    i, j = math.floor((x - grid[0]) / h), math.floor((y - grid[1]) / h)
    if i < 0 or j < 0 or i >= nx or j >= ny:
        return False
    f = flag[j * nx + i]
    if f != 2:
        return f == 1
    return crossings(x, y, j, edges, rows, row_edges)


@njit(cache=True, nogil=True)
def room(x, y, grid, flag):
    """Radius [mm] about (x, y) that is certainly within the centre region; 0 if an edge may be near.

    ``mark`` flags the 3 x 3 cells about places of an edge that are half a cell apart: no edge comes nearer to a cell
    flagged 1 than three quarters of one.
    """
    h = grid[2]
    nx, ny = int(grid[3]), int(grid[4])
    i, j = math.floor((x - grid[0]) / h), math.floor((y - grid[1]) / h)
    if i < 0 or j < 0 or i >= nx or j >= ny or flag[j * nx + i] != 1:
        return 0.0
    return AWAY * h


@njit(cache=True, nogil=True)
def crossings(x, y, j, edges, rows, row_edges):
    """Even-odd rule on the edges of row j."""
    inside = False
    for k in range(rows[j], rows[j + 1]):
        e = row_edges[k]
        y0, y1 = edges[e, 1], edges[e, 3]
        if (y0 > y) != (y1 > y):
            xc = edges[e, 0] + (y - y0) / (y1 - y0) * (edges[e, 2] - edges[e, 0])
            if xc > x:
                inside = not inside
    return inside


@njit(cache=True, nogil=True)
def mark(grid, edges, rows, row_edges, flag):
    """Fill ``flag``: 2 in cells an edge may touch, else whether the centre is inside."""
    x0, y0, h = grid[0], grid[1], grid[2]
    nx, ny = int(grid[3]), int(grid[4])
    for e in range(len(edges)):
        dx, dy = edges[e, 2] - edges[e, 0], edges[e, 3] - edges[e, 1]
        n = 1 + int(math.sqrt(dx * dx + dy * dy) / (0.5 * h))
        for k in range(n + 1):
            i = math.floor((edges[e, 0] + dx * k / n - x0) / h)
            j = math.floor((edges[e, 1] + dy * k / n - y0) / h)
            for b in range(max(0, j - 1), min(ny, j + 2)):
                for a in range(max(0, i - 1), min(nx, i + 2)):
                    flag[b * nx + a] = 2
    for j in range(ny):
        y = y0 + (j + 0.5) * h
        known = -1
        for i in range(nx):
            if flag[j * nx + i] == 2:
                known = -1
                continue
            if known < 0:
                known = 1 if crossings(x0 + (i + 0.5) * h, y, j, edges, rows, row_edges) else 0
            flag[j * nx + i] = known


@njit(cache=True, nogil=True)
def angle_at(x, y, tx, ty, r, R, grid, head, link, axis, arcs):
    """E at O with heading T."""
    n = uncut(x, y, tx, ty, r, R, False, grid, head, link, axis, arcs)
    total = 0.0
    for k in range(n):
        total += arcs[k, 1] - arcs[k, 0]
    return total


@njit(cache=True, nogil=True)
def worst_of_step(ox, oy, th, phi, l, full, r, R, grid, head, link, axis, arcs):
    """Greatest E of the step that turns by phi: its end and, turning to the right, l = R tan(phi / 2), where the
    wedge opened by the turn is wholly under the rim; ``full`` looks at more places between.
    """
    tx, ty = math.cos(th + phi), math.sin(th + phi)
    e = angle_at(ox + l * tx, oy + l * ty, tx, ty, r, R, grid, head, link, axis, arcs)
    if phi < 0.0:
        t = R * math.tan(-0.5 * phi)
        if t < l:
            e = max(e, angle_at(ox + t * tx, oy + t * ty, tx, ty, r, R, grid, head, link, axis, arcs))
    if full:
        for k in range(5):
            t = l * (0.02 if k == 0 else 0.2 * k)
            e = max(e, angle_at(ox + t * tx, oy + t * ty, tx, ty, r, R, grid, head, link, axis, arcs))
    return e


@njit(cache=True, nogil=True)
def step_allowed(ox, oy, th, phi, l, slack, grid, flag, edges, rows, row_edges):
    """Whether the step stays in the centre region: its end, and within ``slack`` all of it.

    Tested at every eighth: a wall that bends around the step is no tighter than R, so that between two of them it comes
    no nearer than (l / 8)^2 / (8 R), 7e-6 R.
    """
    tx, ty = math.cos(th + phi), math.sin(th + phi)
    if room(ox + 0.5 * l * tx, oy + 0.5 * l * ty, grid, flag) > 0.5 * l:
        return True
    if not in_centre_region(ox + l * tx, oy + l * ty, grid, flag, edges, rows, row_edges):
        return False
    for k in (4, 2, 6, 3, 5, 1, 7):
        t = 0.125 * k * l
        x, y = ox + t * tx, oy + t * ty
        if in_centre_region(x, y, grid, flag, edges, rows, row_edges):
            continue
        if not in_centre_region(x - slack * ty, y + slack * tx, grid, flag, edges, rows, row_edges):
            return False
    return True


@njit(cache=True, nogil=True)
def turn(ox, oy, th, guess, l, limit, right, left, full, slack, r, R, grid, head, link, axis, arcs, flag, edges, rows,
         row_edges):  # fmt: skip
    """(found, phi): the turn farthest to the right, in [-right, left], that is allowed and keeps E <= limit."""
    # the wall on the right
    lo = -right
    if not step_allowed(ox, oy, th, lo, l, slack, grid, flag, edges, rows, row_edges):
        bad = lo
        good = lo
        width = 0.04
        found = False
        while good < left:
            good = min(left, good + width)
            if step_allowed(ox, oy, th, good, l, slack, grid, flag, edges, rows, row_edges):
                found = True
                break
            bad = good
        if not found:
            return False, 0.0
        for _ in range(44):
            mid = 0.5 * (bad + good)
            if step_allowed(ox, oy, th, mid, l, slack, grid, flag, edges, rows, row_edges):
                good = mid
            else:
                bad = mid
        lo = good
    wall = lo > -right
    e_lo = worst_of_step(ox, oy, th, lo, l, full, r, R, grid, head, link, axis, arcs)
    if e_lo <= limit:
        if wall or e_lo <= 0.0:
            return True, lo
        # nothing holds the cutter: turn no farther to the right than brings more material
        best = lo
        most = e_lo
        up = max(guess, lo)
        for k in range(1, 6):
            phi = lo + (up + 0.05 - lo) * k / 5.0
            e = worst_of_step(ox, oy, th, phi, l, full, r, R, grid, head, link, axis, arcs)
            fits = most - 0.004 <= e <= limit
            if fits and step_allowed(ox, oy, th, phi, l, slack, grid, flag, edges, rows, row_edges):
                best = phi
                most = max(most, e)
        return True, best
    # walk to the left until the engagement is within the limit
    bad, f_bad = lo, e_lo - limit
    phi = max(guess, lo)
    width = 0.02
    f_good = 0.0
    good = lo
    found = False
    while True:
        e = worst_of_step(ox, oy, th, phi, l, full, r, R, grid, head, link, axis, arcs)
        if e <= limit and step_allowed(ox, oy, th, phi, l, slack, grid, flag, edges, rows, row_edges):
            good, f_good = phi, e - limit
            found = True
            break
        if e > limit:
            bad, f_bad = phi, e - limit
        if phi >= left:
            break
        phi = min(left, phi + width)
        width *= 1.6
    if not found:
        return False, 0.0
    # from the good side nearer to the bad one
    for k in range(14):
        if f_good > -2e-4 or good - bad < 2e-5:
            break
        if k % 3 == 2:
            mid = 0.5 * (good + bad)
        else:
            w = min(0.95, max(0.05, (f_good + 1e-4) / (f_good - f_bad)))
            mid = good + w * (bad - good)
        e = worst_of_step(ox, oy, th, mid, l, full, r, R, grid, head, link, axis, arcs)
        if e <= limit and step_allowed(ox, oy, th, mid, l, slack, grid, flag, edges, rows, row_edges):
            good, f_good = mid, e - limit
        else:
            bad, f_bad = mid, max(e - limit, 1e-6)
    return True, good


@njit(cache=True, nogil=True)
def arc_place(x, y, th, phi, l):
    """(x, y, heading) at the end of an arc of length l that leaves (x, y) along th and turns by phi."""
    c = l if abs(phi) < 1e-9 else l * math.sin(0.5 * phi) / (0.5 * phi)
    return x + c * math.cos(th + 0.5 * phi), y + c * math.sin(th + 0.5 * phi), th + phi


@njit(cache=True, nogil=True)
def arc_engagement(x, y, th, phi, l, r, R, grid, head, link, axis, arcs):
    """E at the end of an arc."""
    ex, ey, et = arc_place(x, y, th, phi, l)
    return angle_at(ex, ey, math.cos(et), math.sin(et), r, R, grid, head, link, axis, arcs)


@njit(cache=True, nogil=True)
def arc_allowed(x, y, th, phi, l, margin, grid, flag, edges, rows, row_edges):
    """Whether an arc stays in the centre region, by every 16th of it. An end within ``margin`` of a wall on the
    right is refused: a straight step reaches the wall itself, so that no film stays on it.
    """
    ex, ey, et = arc_place(x, y, th, 0.5 * phi, 0.5 * l)
    if room(ex, ey, grid, flag) > 0.5 * l + margin:
        return True
    ex, ey, et = arc_place(x, y, th, phi, l)
    if not in_centre_region(ex, ey, grid, flag, edges, rows, row_edges):
        return False
    if not in_centre_region(ex + margin * math.sin(et), ey - margin * math.cos(et), grid, flag, edges, rows, row_edges):
        return False
    for k in (8, 4, 12, 2, 6, 10, 14, 1, 3, 5, 7, 9, 11, 13, 15):
        ex, ey, _ = arc_place(x, y, th, 0.0625 * k * phi, 0.0625 * k * l)
        if not in_centre_region(ex, ey, grid, flag, edges, rows, row_edges):
            return False
    return True


@njit(cache=True, nogil=True)
def arc_turn(x, y, th, guess, l, limit, right, r, R, grid, head, link, axis, arcs, flag, edges, rows, row_edges):
    """(found, phi): the turn of an arc at whose end E is the limit, from the law's own rate.

    Turning by d phi moves the end by l d phi / 2 away from the material and turns the rim by d phi:
    dE/dphi = -(1 + l / (2 R sin E)) beside a straight edge; from the second try on the rate is what was found.
    """
    phi = max(guess, -right)
    e = arc_engagement(x, y, th, phi, l, r, R, grid, head, link, axis, arcs)
    if e < 0.02:
        return False, 0.0
    rate = -(1.0 + 0.5 * l / (R * math.sin(limit)))
    before, e_before = phi, e
    for k in range(6):
        if limit - CLOSE <= e <= limit:
            return arc_allowed(x, y, th, phi, l, FILM * R, grid, flag, edges, rows, row_edges), phi
        if k > 0 and abs(phi - before) > 1e-12:
            found = (e - e_before) / (phi - before)
            if found < 0.3 * rate:
                rate = max(found, 6.0 * rate)
        before, e_before = phi, e
        phi = phi + min(0.3, max(-0.3, (limit - 0.4 * CLOSE - e) / rate))
        if phi > SMOOTH * right:
            return False, 0.0
        if phi < -right:
            e = arc_engagement(x, y, th, -right, l, r, R, grid, head, link, axis, arcs)
            if e_before - 0.004 <= e <= limit:
                return arc_allowed(x, y, th, -right, l, FILM * R, grid, flag, edges, rows, row_edges), -right
            return False, 0.0
        e = arc_engagement(x, y, th, phi, l, r, R, grid, head, link, axis, arcs)
    return False, 0.0


@njit(cache=True, nogil=True)
def wall_heading(chord, last, phi):
    """Direction of a smooth wall at the end of a chord, from the chord before it; the chord's own at a corner."""
    turn = chord - last
    turn -= 2.0 * math.pi * round(turn / (2.0 * math.pi))
    return chord + 0.5 * turn if abs(turn) <= SHARP and abs(phi) <= SHARP else chord


@njit(cache=True, nogil=True)
def chord_step(x, y, th, guess, step, limit, right, left, slack, r, R, grid, head, link, axis, arcs, flag, edges, rows,
               row_edges):  # fmt: skip
    """(found, phi, l): a straight step, turned at its beginning: along a wall, through a corner, without material."""
    l = step
    for _ in range(5):
        share = l / step
        ok, phi = turn(x, y, th, guess * share, l, limit, right * share, left, False, slack, r, R, grid, head, link,
                       axis, arcs, flag, edges, rows, row_edges)  # fmt: skip
        if ok:
            tx, ty = math.cos(th + phi), math.sin(th + phi)
            e = 0.0
            for k in range(3):
                t = l * (0.02 + 0.3 * k)
                e = max(e, angle_at(x + t * tx, y + t * ty, tx, ty, r, R, grid, head, link, axis, arcs))
            if e > limit + 1e-5:
                ok, phi = turn(x, y, th, phi, l, limit, right * share, left, True, slack, r, R, grid, head, link, axis,
                               arcs, flag, edges, rows, row_edges)  # fmt: skip
        if ok:
            # a shorter step may reach into the corner that a whole one has to cut
            while phi > SHARP and l > step / 32.0:
                share = 0.5 * l / step
                ok, less = turn(x, y, th, 0.0, 0.5 * l, limit, right * share, left, True, slack, r, R, grid, head,
                                link, axis, arcs, flag, edges, rows, row_edges)  # fmt: skip
                if not ok or less > phi - SHARP:
                    break
                l *= 0.5
                phi = less
            return True, phi, l
        l *= 0.5
    return False, 0.0, 0.0


@njit(cache=True, nogil=True)
def line_clear(x0, y0, x1, y1, step, R, touch, grid, head, link, axis, arcs, flag, edges, rows, row_edges):
    """Whether a straight link between two freed centres meets no material, nor leaves the centre region.

    Discs are tested a spacing d apart, each larger by d^2 / (8 R), so that together they cover the capsule; d is fine
    near the ends, where the cutter may touch the material that it has just cut. The centre is tested every 0.01 R.
    """
    grid, head, link, axis, arcs = borrow_arrays((grid, head, link, axis, arcs))
    flag, edges, rows, row_edges = borrow_arrays((flag, edges, rows, row_edges))
    dx, dy = x1 - x0, y1 - y0
    length = math.sqrt(dx * dx + dy * dy)
    if length <= 1e-9:
        return True
    tx, ty = dx / length, dy / length
    n = math.ceil(length / (0.01 * R))
    k = 1
    while k < n:
        x, y = x0 + k * dx / n, y0 + k * dy / n
        if not in_centre_region(x, y, grid, flag, edges, rows, row_edges):
            return False
        k += 1 + int(room(x, y, grid, flag) * n / length)
    t = 0.0
    while t < length:
        near = min(t, length - t)
        d = max(step / 64.0, min(step, 0.25 * near))
        t += d
        if t >= length:
            break
        x, y = x0 + t * tx, y0 + t * ty
        if not in_centre_region(x, y, grid, flag, edges, rows, row_edges):
            return False
        r = R * (1.0 - touch) + d * d / (8.0 * R)
        if uncut(x, y, tx, ty, r, R, False, grid, head, link, axis, arcs) > 0:
            return False
    return True


@njit(cache=True, nogil=True)
def open_sides(points, normals, which, eps, least, R, touch, grid, head, link, axis, arcs, flag, edges, rows, row_edges,
               out):  # fmt: skip
    """Whether material can be cut next to each point (n, 2): O moved by eps [mm] along its normal may be there."""
    grid, head, link, axis, arcs = borrow_arrays((grid, head, link, axis, arcs))
    flag, edges, rows, row_edges = borrow_arrays((flag, edges, rows, row_edges))
    r = R * (1.0 - touch)
    m = round(math.pi / grid[6])
    for v in range(len(which)):
        k = which[v]
        nx, ny = normals[k, 0], normals[k, 1]
        x, y = points[k, 0] + eps * nx, points[k, 1] + eps * ny
        out[v] = False
        if in_centre_region(x, y, grid, flag, edges, rows, row_edges):
            total = 0.0
            for q in range(uncut_between(x, y, nx, ny, r, R, m // 3, m - m // 3, grid, head, link, axis, arcs)):
                total += arcs[q, 1] - arcs[q, 0]
            # the middle third of the front is often enough
            out[v] = total > least or angle_at(x, y, nx, ny, r, R, grid, head, link, axis, arcs) > least
