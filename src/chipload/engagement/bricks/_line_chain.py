"""Compiled loop that joins steps of one line into one move; arrays and scalars only.

A line of a program is divided into steps; along it the tip moves straight and the axis turns evenly. The steps sweep
the same volume as one move from the first to the last, so that the lists of the index hold one number for all of them.
Notation: as in :mod:`chipload.engagement.bricks._sweep`.
Oracle: the same program without joining, in tests/engagement/bricks.
"""

from __future__ import annotations

import math

from numba import njit

from chipload.engagement.bricks._sweep import (
    A0,
    ALONG_W,
    ALONG_X,
    ALONG_Y,
    BEND,
    LENGTH,
    SINE,
    THETA,
    TURNED,
    B,
    N,
    turn,
)

#: greatest difference of the joined move from the end of a step [mm]
EXACT = 1e-10
#: greatest turn of a joined move [rad]; greatest deviation of a point from its chord, over the greatest radius
TURN, OFF = 0.1, 0.004


@njit(cache=True, nogil=True)
def continues_move(m, s, c):
    """Whether the step s (row) of a cutter c continues the move m (row), which is then extended to its end."""
    theta = m[THETA]
    fixed = theta == 0.0
    if fixed != (s[THETA] == 0.0) or s[LENGTH] + s[THETA] == 0.0 or m[LENGTH] + theta == 0.0:
        return False
    far = EXACT / (c.height + c.wide)
    cosine, sine = turn(m, 1.0)
    for d in range(3):
        if abs(m[d] + m[3 + d] - s[d]) > EXACT or abs(m[A0 + d] * cosine + m[B + d] * sine - s[A0 + d]) > far:
            return False
    # the axis at the end, across the one at the start
    cosine, sine = turn(s, 1.0)
    ax = s[A0] * cosine + s[B] * sine
    ay = s[A0 + 1] * cosine + s[B + 1] * sine
    az = s[A0 + 2] * cosine + s[B + 2] * sine
    dot = ax * m[A0] + ay * m[A0 + 1] + az * m[A0 + 2]
    bx = m[B]
    by = m[B + 1]
    bz = m[B + 2]
    if not fixed:
        bx = ax - dot * m[A0]
        by = ay - dot * m[A0 + 1]
        bz = az - dot * m[A0 + 2]
        size = math.sqrt(bx * bx + by * by + bz * bz)
        if size == 0.0:
            return False
        theta = math.atan2(size, dot)
        bx /= size
        by /= size
        bz /= size
        # twice, so that it stands across to rounding
        dot = bx * m[A0] + by * m[A0 + 1] + bz * m[A0 + 2]
        bx -= dot * m[A0]
        by -= dot * m[A0 + 1]
        bz -= dot * m[A0 + 2]
    ux = s[0] + s[3] - m[0]
    uy = s[1] + s[4] - m[1]
    uz = s[2] + s[5] - m[2]
    length = math.sqrt(ux * ux + uy * uy + uz * uz)
    bend = (theta + 2.0) * length
    if theta > TURN or 0.125 * theta * (theta * (c.height + c.wide) + bend) > OFF * c.wide:
        return False
    # the end of the one and the start of the other on the whole way
    way = m[LENGTH] + s[LENGTH]
    t = m[LENGTH] / way if way > 0.0 else m[THETA] / (m[THETA] + s[THETA])
    cosine = math.cos(t * theta)
    sine = math.sin(t * theta)
    if (
        abs(m[0] + t * ux - s[0]) > EXACT
        or abs(m[1] + t * uy - s[1]) > EXACT
        or abs(m[2] + t * uz - s[2]) > EXACT
        or abs(m[A0] * cosine + bx * sine - s[A0]) > far
        or abs(m[A0 + 1] * cosine + by * sine - s[A0 + 1]) > far
        or abs(m[A0 + 2] * cosine + bz * sine - s[A0 + 2]) > far
    ):
        return False
    m[3] = ux
    m[4] = uy
    m[5] = uz
    m[B] = bx
    m[B + 1] = by
    m[B + 2] = bz
    m[THETA] = theta
    m[LENGTH] = length
    m[N] = m[A0 + 1] * bz - m[A0 + 2] * by
    m[N + 1] = m[A0 + 2] * bx - m[A0] * bz
    m[N + 2] = m[A0] * by - m[A0 + 1] * bx
    cosine = math.cos(theta)
    sine = math.sin(theta)
    along = ux * m[A0] + uy * m[A0 + 1] + uz * m[A0 + 2]
    across = ux * bx + uy * by + uz * bz
    m[ALONG_X] = -(ux * m[N] + uy * m[N + 1] + uz * m[N + 2])
    m[ALONG_Y] = along * sine - across * cosine
    m[ALONG_W] = -along * cosine - across * sine
    m[TURNED] = -2.0 * math.sin(0.5 * theta) ** 2
    m[SINE] = sine
    m[BEND] = bend
    return True
