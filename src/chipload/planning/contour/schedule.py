"""Feed schedule of the strategy `feed`: the feed at which the force equals that on a straight wall.

Notation: f0 programmed feed, F0 the greatest force over a revolution at f0 on a straight wall (engagement a*), F(a, f)
that of the force model at an engagement. The schedule is the greatest f <= f0 with F(a, f) <= F0; by the force model,
not by the chip thickness alone: the arc grows with a, and the edge force does not know the feed.

A machine cannot follow a jump of this feed. So the schedule slows down early enough to keep the acceleration of the
machine and, where its file states one, its jerk; it nowhere exceeds the feed with F(a, f) <= F0. The jerk is limited by
the least of the schedule within a window of +-h, and then its mean over +-h: the mean at a place is nowhere above the
schedule there, and a change of acceleration takes at least 2 h.

Reference: [Uddin2007], strategy 3.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from chipload.cutting.force import forces_along
from chipload.engagement.contact import PIECES, Engagement
from chipload.lazy import scipy
from chipload.machine.feed import limited_speed
from chipload.planning.cost import CutConditions
from chipload.planning.feeds import greatest_factor

Floats = NDArray[np.float64]

#: the schedule is written in steps of this share of f0, and is at least the second share: below it edges rub
FEED_SHARE, LEAST_SHARE = 0.01, 0.2
#: engagements are rounded up to a multiple of this [rad] before the force model is evaluated
ROUNDED = 5e-4
#: places in which the smoothing works, and by how much its window grows where the jerk is not kept yet
PLACES, GROWTH = 4000, 1.25


def straight_force(cut: CutConditions, wanted: float, feed: float) -> float:
    """F0 [N]: greatest force in the plane over a revolution at the engagement a* [rad] and ``feed`` [mm/s]."""
    a = np.array([wanted])
    down = cut.milling == "down"
    arcs = (math.pi - a, np.full(1, math.pi)) if down else (np.zeros(1), a)
    return float(_forces(cut, arcs[0][:, None], arcs[1][:, None], np.ones(1, dtype=np.int64), np.array([feed]))[0])


def constant_force(cut: CutConditions, met: Engagement, feed: float, wanted: float) -> Floats:
    """Greatest feed [mm/s], (n,), at most ``feed``, at which the force is at most that on a straight wall.

    Where it is above that even at ``LEAST_SHARE`` of f0, mostly by the edge force, the feed is that.
    """
    limit = straight_force(cut, wanted, feed)
    phi_in, phi_out = met.phi[:, :, 0].copy(), met.phi[:, :, 1].copy()
    count = np.clip(met.count, 0, PIECES).astype(np.int64)
    one = count == 1
    wide = np.ceil((phi_out[one, 0] - phi_in[one, 0]) / ROUNDED - 1e-9) * ROUNDED
    if cut.milling == "down":
        phi_in[one, 0] = np.maximum(phi_out[one, 0] - wide, 0.0)
    else:
        phi_out[one, 0] = np.minimum(phi_in[one, 0] + wide, math.pi)
    key = np.column_stack([count, phi_in.round(9), phi_out.round(9)])
    _, first, of = np.unique(key, axis=0, return_index=True, return_inverse=True)
    arcs = phi_in[first], phi_out[first], count[first]

    def ratio(share: Floats) -> Floats:
        return _forces(cut, *arcs, feed * share) / limit

    n = len(first)
    share = greatest_factor(ratio, np.full(n, LEAST_SHARE), np.ones(n))
    # what a straight wall is engaged by needs no lower feed; the rounding up would require one
    share = np.where(_straight(*arcs, wanted), 1.0, np.where(np.isnan(share), LEAST_SHARE, share))
    return np.asarray(feed * share[of.reshape(-1)])


def within_machine(s: Floats, wanted: Floats, acceleration: float, jerk: float | None) -> Floats:
    """Feeds (n,) at ``s`` [mm], nowhere above ``wanted``, that keep acceleration [mm/s^2] and jerk [mm/s^3].

    >>> s = np.linspace(0.0, 20.0, 401)
    >>> v = within_machine(s, np.where(s < 10.0, 20.0, 10.0), 100.0, None)
    >>> bool(abs(np.interp(9.0, s, v) - math.sqrt(10.0**2 + 2.0 * 100.0 * 1.0)) < 0.1)
    True
    """
    fastest = float(wanted.max())
    v, _ = limited_speed(s, wanted, acceleration, fastest, fastest)
    if jerk is None or np.ptp(v) == 0.0:
        return v
    even = np.linspace(0.0, float(s[-1]), PLACES)
    ds = even[1]
    # squares of the speed are averaged: their slope is twice the acceleration, and a mean is nowhere steeper
    least = np.interp(even, s, v) ** 2
    half = fastest * acceleration / jerk
    while True:
        width = 2 * max(1, round(half / ds)) + 1
        smooth = np.sqrt(
            scipy.ndimage.uniform_filter1d(
                scipy.ndimage.minimum_filter1d(least, width, mode="nearest"), width, mode="nearest"
            )
        )
        if width >= PLACES or _jerk(smooth, ds) <= jerk:
            return np.asarray(np.minimum(np.interp(s, even, smooth), wanted))
        half *= GROWTH


def _jerk(v: Floats, ds: float) -> float:
    """Greatest |d^2 v / dt^2| [mm/s^3] of speeds at even places."""
    accelerated = 0.5 * np.gradient(v * v, ds)
    return float(np.abs(v * np.gradient(accelerated, ds)).max())


def step_feeds(feeds: Floats, feed: float) -> Floats:
    """Feeds as they are written: rounded down to a multiple of ``FEED_SHARE`` of f0, at least ``LEAST_SHARE``."""
    share = np.floor(feeds / feed / FEED_SHARE + 1e-9) * FEED_SHARE
    return np.asarray(feed * np.maximum(share, LEAST_SHARE))


def _straight(phi_in: Floats, phi_out: Floats, count: NDArray[np.int64], wanted: float) -> NDArray[np.bool_]:
    """Arcs no wider than that of a straight wall."""
    used = np.arange(phi_in.shape[1]) < count[:, None]
    return np.asarray(np.where(used, phi_out - phi_in, 0.0).sum(axis=1) <= wanted + ROUNDED + 1e-9)


def _forces(cut: CutConditions, phi_in: Floats, phi_out: Floats, count: NDArray[np.int64], feed: Floats) -> Floats:
    """(n,) greatest force in the plane over a revolution [N]."""
    ahead = np.tile([1.0, 0.0], (len(count), 1))
    loads = forces_along(
        phi_in, phi_out, cut.feed_per_tooth(feed), ahead, cut.cutter, cut.material, cut.axial_depth,
        spindle_speed=cut.spindle_speed, count=count,
    )  # fmt: skip
    return np.asarray(loads["force_xy_n"], dtype=np.float64)
