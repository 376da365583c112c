"""Compiled loop of one pass: steps into the stock, which are written as lines and arcs at once.

Notation: as in ``_pass_steps``.
"""

from __future__ import annotations

import math

from numba import njit

from chipload.engagement.moves._uncounted_arrays import borrow_arrays
from chipload.planning.pocket._fit import write_segments
from chipload.planning.pocket._pass_steps import (
    LONGER,
    SHARP,
    arc_place,
    arc_turn,
    chord_step,
    wall_heading,
)
from chipload.stock._planar import uncut

RUNNING, LOST, BLOCKED = 0, 1, 2
#: steps are written at the latest when they are so long / R, or turn by so much [rad]
HELD, TURNED = 2.5, 1.0
#: a turn that differs so much [rad] from that of the last step is examined more closely
CHANGE = 0.012
#: capsules that there must be room for before a step: those of all steps that are not written
ROOM = 400
#: curvature x R of a right turn in which the cutter meets what it has just cut itself
TIGHT = -0.9


@njit(cache=True, nogil=True)
def open_step(x, y, th, bend, longer, step, limit, most, right, r, R, grid, head, link, axis, arcs, flag, edges, rows,
              row_edges):  # fmt: skip
    """An arc that continues the last step: (found, turn, length, mm^2 a mm in its middle, longer).

    ``bend`` is the curvature of the last step; ``longer`` how many steps the arc may be long, halved where it does not
    keep E between its ends.
    """
    length = longer * step
    e, area = 0.0, 0.0
    while length > 0.4 * step:
        found, phi = arc_turn(x, y, th, bend * length, length, limit, right * length / step, r, R, grid, head, link,
                              axis, arcs, flag, edges, rows, row_edges)  # fmt: skip
        if not found:
            break
        if abs(phi) <= SHARP or length < 0.9 * step:
            hx, hy, mt = arc_place(x, y, th, 0.5 * phi, 0.5 * length)
            e, area = mean_cut(hx, hy, mt, r, R, grid, head, link, axis, arcs)
            if abs(phi - bend * length) > CHANGE or abs(phi) > 0.5 * SHARP:  # look at more places
                for k in range(1, 8, 2):
                    hx, hy, mt = arc_place(x, y, th, 0.125 * k * phi, 0.125 * k * length)
                    e = max(e, mean_cut(hx, hy, mt, r, R, grid, head, link, axis, arcs)[0])
            if e <= 0.5 * (limit + most):
                return True, phi, length, area, min(LONGER, 1.4 * longer)
        length *= 0.5
        longer = max(0.5, 0.5 * longer)
    return False, 0.0, 0.0, area, longer


@njit(cache=True, nogil=True)
def not_written(steps, written, n):
    """Length [mm] and turn [rad] of the steps that are not written."""
    held, turned = 0.0, 0.0
    for k in range(written + 1, n + 1):
        held += math.hypot(steps[k, 0] - steps[k - 1, 0], steps[k, 1] - steps[k - 1, 1])
        turned += abs(steps[k, 2] - steps[k - 1, 2])
    return held, turned


@njit(cache=True, nogil=True)
def run_pass(state, step, limit, most, right, left, lost, tau, slack, R, touch, steps, segments, places, numbers, grid,
             head, count, link, axis, arcs, seg, flag, edges, rows, row_edges):  # fmt: skip
    """One pass, until it ends or ``steps`` is full.

    Parameters
    ----------
    state : x, y, heading, last turn / length, length on which less than a hundredth of R (1 - cos a*) was cut,
        direction of the last chord (1e9 after an arc)
    limit, most : E that steps keep, and that what is written keeps
    right, left : greatest turn of a whole step; ``lost``: length without material that ends the pass
    steps : (n, 5) x, y, heading, sweep of each vertex and mm^2 taken up to it, row 0 the start
    segments, places : as of :func:`write_segments`
    arcs, seg : (RIM, 2) and (7,), room to work in
    numbers : capsules and chain entries used; vertices written; segments; mm^2 that they take; steps made

    In the open a step is an arc that continues the last one; along a wall and in corners it is straight. Steps without
    material at the end are not written.
    """
    state, steps, segments, places, numbers, seg = borrow_arrays((state, steps, segments, places, numbers, seg))
    grid, head, count, link, axis, arcs = borrow_arrays((grid, head, count, link, axis, arcs))
    flag, edges, rows, row_edges = borrow_arrays((flag, edges, rows, row_edges))
    r = R * (1.0 - touch)
    capsule, used = int(numbers[0]), int(numbers[1])
    x, y, th, bend, idle, last = state[0], state[1], state[2], state[3], state[4], state[5]
    steps[0, 0], steps[0, 1], steps[0, 2], steps[0, 3], steps[0, 4] = x, y, th, 0.0, 0.0
    n, written, done, cut, ok, reason = 0, 0, 0, 0, True, RUNNING
    taken, held, turned, longer = 0.0, 0.0, 0.0, LONGER
    while n + 1 < len(steps) and capsule + ROOM < len(axis) and used + ROOM * grid[7] < len(link):
        found, phi, length, area, longer = open_step(x, y, th, bend, longer, step, limit, most, right, r, R, grid,
                                                     head, link, axis, arcs, flag, edges, rows, row_edges)  # fmt: skip
        if found:
            nx, ny, nt = arc_place(x, y, th, phi, length)
            bend, last = phi / length, 1e9
            if abs(phi) * R < 1e-3 * length:
                phi = 0.0
            turn = phi
        else:
            found, turn, length = chord_step(x, y, th, bend * step, step, limit, right, left, slack, r, R, grid, head,
                                             link, axis, arcs, flag, edges, rows, row_edges)  # fmt: skip
            if not found:
                reason = BLOCKED
                break
            chord = th + turn
            nx, ny = x + length * math.cos(chord), y + length * math.sin(chord)
            nt = chord if last > 1e8 else wall_heading(chord, last, turn)
            bend = min(right, max(-right, turn)) / step
            last, phi = chord, 0.0
            _, area = mean_cut(0.5 * (x + nx), 0.5 * (y + ny), chord, r, R, grid, head, link, axis, arcs)
        area *= length
        x, y, th = nx, ny, nt
        n += 1
        taken += area
        steps[n, 0], steps[n, 1], steps[n, 2], steps[n, 3], steps[n, 4] = x, y, th, phi, taken
        held += length
        turned += abs(turn)
        if area > 1e-4 * R * step:
            cut = n
        if area > 0.01 * R * (1.0 - math.cos(limit)) * length:
            idle = 0.0
        else:
            idle += length
            if idle > lost:
                reason = LOST
                break
        tight = turn * R < TIGHT * length
        if cut == n and (tight or held > HELD * R or turned > TURNED):
            whole = tight or held > 2.0 * HELD * R or turned > 2.0 * TURNED
            ok, written, done, capsule, used = write_segments(
                steps, written, n, whole, tau, most, step, slack, R, touch, segments, done, places, capsule, used, grid,
                head, count, link, axis, arcs, seg, flag, edges, rows, row_edges,
            )  # fmt: skip
            if not ok:
                reason = BLOCKED
                break
            held, turned = not_written(steps, written, n)
    end = cut if reason != RUNNING else n
    if ok and end > written and (taken >= 1e-5 * R * R or written > 0):
        ok, written, done, capsule, used = write_segments(
            steps, written, end, True, tau, most, step, slack, R, touch, segments, done, places, capsule, used, grid,
            head, count, link, axis, arcs, seg, flag, edges, rows, row_edges,
        )  # fmt: skip
        if not ok:
            reason = BLOCKED
    state[0], state[1], state[2], state[3], state[4], state[5] = x, y, th, bend, idle, last
    numbers[0], numbers[1], numbers[2] = capsule, used, written
    numbers[3], numbers[4], numbers[5] = done, steps[written, 4], n
    return reason


@njit(cache=True, nogil=True)
def mean_cut(x, y, th, r, R, grid, head, link, axis, arcs):
    """E at O, and the area [mm^2] that is cut there in a millimetre of path."""
    k = uncut(x, y, math.cos(th), math.sin(th), r, R, False, grid, head, link, axis, arcs)
    area, e = 0.0, 0.0
    for v in range(k):
        area += R * (math.sin(arcs[v, 1]) - math.sin(arcs[v, 0]))
        e += arcs[v, 1] - arcs[v, 0]
    return e, area
