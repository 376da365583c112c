"""Surfaces of the teeth: the radius of each at each height, their true paths, and the chips between these paths.

It is the only place that knows how the teeth of a cutter differ; forces, feeds, form error, fit and stability use it.

Notation as in :mod:`chipload.engagement.tooth_engagement`; phi is counted here from the feed, so that 0 and pi are the
ends of the front. R distance of the edge from the axis, f feed per tooth, c = N f / (2 pi) feed per radian, F_m feed
during the m pitches before tooth j; psi lag of the edge; (e, lambda) runout; r_j = e cos(lambda - a_j - psi) excess of
the radius of tooth j, which turns with the helix.

A tooth moves on a trochoid, and so did the m-th tooth before it. Between both is, of second order in F_m / R,

    h_m = F_m sin(phi) (1 - c cos(phi) / R) + F_m^2 cos(phi)^2 / (2 R) + r_j - r_(j-m),

and the chip is the least of h_1 .. h_N, where positive. It begins and ends up to N f / (2 R) beyond the front. At a
wall, where the edge leaves or enters the stock at phi_b, the tooth before has cut along the wall already: the chip runs
out along R (cos(phi) / cos(phi_b) - 1) + r_j, and a tooth that stands out by r_j meets the wall where cos(phi) =
R cos(phi_b) / (R + r_j). Both times sin(kappa) along the normal of the edge; a motion along the axis adds its offset.

Each curve is replaced by the sinusoid through three of its values in pieces of at most 97 degrees, so that a chip is
again a row of tooth engagement. With runout the edge is divided into parts whose lag is nearly the same.

Reference: [Kline1983] for runout.
Differs from source: paths are trochoids, and the phase of the runout lags with the helix.
A wall is taken to run along the feed. The motion along the axis has first order: see :func:`chip_error`.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipload.cutter.cutter import Cutter
from chipload.engagement.tooth_engagement import ToothEngagement
from chipload.lazy import LateModule

_tooth_chips = LateModule("chipload.engagement._tooth_chips")

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

#: share of the chip that may be missed where the edge is divided into parts of one radius
SHARE = 0.01
#: widest piece of immersion in which a chip of second order is a sinusoid through three of its values [rad]
WIDEST = 0.5 * math.pi + 0.1
#: the same for one steady cut, calculated or fitted: the widest pieces change the Ktc of a fit by 0.09 %, half a
#: standard deviation where noise is its only fault
STEADY = 0.5
#: parts of :func:`chip_error`: at any cut, with runout, of the square of feed over radius, of the runout over the
#: radial depth
LEAST, UNLIKE, SECOND, RUNOUT = 0.0025, 0.002, 0.75, 0.04
#: the same where the surface leans, as that of a ball nose or a cone: at any cut, of the feed over the radius and of
#: its square, which counts near a tip; of the runout over the greatest radial depth of the step and of its square: a
#: longer tooth also cuts on parts of the edge that no circle reaches
LEANS, NARROW, POINT, TIP, BEYOND = 0.002, 0.1, 10.0, 0.5, 4.0


def tooth_radii(cutter: Cutter, lag: ArrayLike = 0.0) -> Floats:
    """Return the excess (..., N) [mm] of the radius of each tooth where its edge lags by ``lag`` (...) [rad].

    >>> tooth_radii(Cutter(10.0, 2, 0.0, 20.0, 30.0, 6e5, runout=(0.01, 0.0))).round(6).tolist()
    [0.01, -0.01]
    >>> tooth_radii(Cutter(10.0, 2, 0.5, 20.0, 30.0, 6e5, runout=(0.01, 0.0)), [0.0, math.pi]).round(6).tolist()
    [[0.01, -0.01], [-0.01, 0.01]]
    """
    offset, direction = cutter.runout
    psi = np.asarray(lag, dtype=np.float64)[..., None]
    return np.asarray(offset * np.cos(direction - cutter.tooth_angles - psi))


def turns_before(cutter: Cutter) -> Floats:
    """Return (N, N) float: for tooth j and m = 1 .. N the angle of the m pitches before it over 2 pi / N."""
    N = cutter.flutes
    pitch = np.array(cutter.pitch) * N / math.tau if cutter.pitch else np.ones(N)
    return np.array([[pitch[(j - np.arange(m)) % N].sum() for m in range(1, N + 1)] for j in range(N)])


def chips_of_teeth(front: ToothEngagement, cutter: Cutter, widest: float = WIDEST) -> ToothEngagement:
    """Return the chips that the teeth cut, from the engaged front; rows of a single tooth stay as they are.

    Parameters
    ----------
    front : engagement ranges of every tooth, h = f sin(phi), with the radius of the cutter
    widest : widest piece of immersion in which a chip is a sinusoid through three of its values [rad]

    Examples
    --------
    Two teeth, their radii 0.012 mm apart, 0.01 mm a tooth: the shorter one does not touch.

    >>> from chipload.engagement.tooth_engagement import engagement_of_arcs
    >>> mill = Cutter(10.0, 2, 0.0, 20.0, 30.0, 6e5, runout=(0.006, 0.0))
    >>> each = chips_of_teeth(engagement_of_arcs([0.0], [math.pi], 0.01, mill, 1.0), mill)
    >>> each.tooth.tolist(), each.chip_max().round(4).tolist()
    ([0, 0], [0.02])

    A layer of 0.02 mm at 0.1 mm a tooth: the tooth before has cut along its wall, so that the chip is thinner.

    >>> mill = Cutter(10.0, 4, 0.5, 20.0, 30.0, 6e5)
    >>> thin = engagement_of_arcs([0.0], [math.acos(1.0 - 0.02 / 5.0)], 0.1, mill, 1.0)
    >>> thin.chip_max().round(5).tolist(), chips_of_teeth(thin, mill).chip_max().round(5).tolist()
    ([0.00894], [0.00788])
    """
    return chips_and_paths(front, cutter, widest)[0]


def chips_and_paths(
    front: ToothEngagement, cutter: Cutter, widest: float = WIDEST
) -> tuple[ToothEngagement, Ints, Ints]:
    """Return :func:`chips_of_teeth`, of each of its rows the row of ``front``, and how many teeth before the one that
    cuts is that whose path it meets, 0 for a wall.
    """
    alike, N = cutter.teeth_alike, cutter.flutes
    guess = max(4 * len(front.rows) * (1 if alike else 4 * N), 16)
    while True:
        room, out = np.empty(len(front) + 1, dtype=np.int64), np.empty((guess, 7))
        tooth, parent, before = (np.empty(guess, dtype=np.int64) for _ in range(3))
        room[0] = 0
        count = _tooth_chips.chips(
            front.start, front.rows, front.tooth, front.slice, front.slices, np.array(cutter.runout),
            cutter.tooth_angles, turns_before(cutter), alike, SHARE, widest, room, out, tooth, parent, before,
        )  # fmt: skip
        if count <= guess:
            break
        guess = count
    # without a copy: what is beyond was never in memory
    rows, tooth, parent, before = out[:count], tooth[:count], parent[:count], before[:count]
    own, slices = front.slice[parent], front.slices
    if cutter.pitch:
        late = cutter.tooth_angles - math.tau / N * np.arange(N)
        own, many = own + np.maximum(tooth, 0) * len(slices), len(slices)
        slices = np.tile(slices, (N, 1))
        slices[:, 5] += np.repeat(late - late.min(), many)
    if slices.shape[1] > 7:
        # what runs out along a wall runs with it
        walls = np.flatnonzero((before == 0) & (slices[own, 11] > 0.0))
        more = slices[own[walls]]
        more[:, 12] = 1.0
        own[walls] = len(slices) + np.arange(len(walls))
        slices = np.vstack([slices, more])
    return ToothEngagement(room, rows, tooth, own, slices, front.frame), parent, before


def thickest_of_teeth(plain: ArrayLike, cutter: Cutter, sine: ArrayLike = 1.0, lags: ArrayLike = (0.0,)) -> Floats:
    """Return the thickest chip [mm] of any tooth with runout, where each tooth cuts ``plain`` without runout.

    max over teeth and lags of min_m (m h + (r_j - r_(j-m)) sin(kappa)). It grows with h, is at least h, and O(N^2).

    Parameters
    ----------
    plain, sine : (...) h [mm] and sin(kappa), of shapes that fit one another
    lags : (k,) lags of the edge that may cut [rad]

    Examples
    --------
    Radii 0.01 mm apart: the longer tooth cuts 0.01 mm more, but never more than both would without runout.

    >>> cutter = Cutter(10.0, 2, 0.0, 20.0, 30.0, 6e5, runout=(0.005, 0.0))
    >>> thickest_of_teeth([0.05, 0.005], cutter).round(6).tolist()
    [0.06, 0.01]
    """
    h, s = np.broadcast_arrays(np.asarray(plain, dtype=np.float64), np.asarray(sine, dtype=np.float64))
    turns, N = turns_before(cutter), cutter.flutes
    behind = (np.arange(N)[:, None] - np.arange(1, N + 1)) % N
    out = np.zeros(h.shape)
    for radii in tooth_radii(cutter, lags):
        more = radii[:, None] - radii[behind]
        out = np.maximum(out, (turns * h[..., None, None] + more * s[..., None, None]).min(axis=-1).max(axis=-1))
    return np.asarray(out)


def chip_error(front: ToothEngagement, cutter: Cutter) -> Floats:
    """Return the greatest relative error (n,) of the loads of each step by what the chips of :func:`chips_of_teeth`
    leave out: 0.0025 + 0.75 (f / R)^2 / phi_w + 0.04 e / max(ae, e), phi_w the engaged arc, ae its radial depth.

    With runout 0.002 is added. Where a range moves along the axis and leans, its chip is of first order in that motion:
    f / R is added. A surface that leans has 0.002 + 0.1 f / R + 10 (f / R)^2 more, at most f / R; for
    0.75 (f / R)^2 / phi_w it has 0.75 (f / R / phi_w)^2, which counts in a thin contact. With runout it has
    0.5 x + 4 x^2, x = e / ae at most 1, ae the greatest radial depth of the step.
    Ranges count by their share of the chip. 0 where nothing is cut.

    The constants are those within which random cuts by all kinds of mills lie (benchmarks/truth.py).

    Examples
    --------
    >>> from chipload.engagement.tooth_engagement import engagement_of_arcs
    >>> mill = Cutter(10.0, 4, 0.5, 20.0, 30.0, 6e5)
    >>> chip_error(engagement_of_arcs([0.0, 0.0], [0.1, 1.2], 0.1, mill, 1.0), mill).round(5).tolist()
    [0.0055, 0.00275]
    """
    low, high, s0, s1, along, offset, across = front.rows.T
    step = np.repeat(np.arange(len(front)), np.diff(front.start))
    rho, sine, cosine = front.slices[front.slice][:, [1, 3, 4]].T
    swing = np.hypot(along, across)
    first = low + np.arctan2(across, along)
    depth = np.abs(rho * (np.cos(first) - np.cos(first + high - low)))
    turned = (sine > 0.0) & (swing > 0.0) & (rho > 0.0) & (high > low)
    feed = np.divide(swing, sine, out=np.zeros(len(low)), where=turned)
    share = np.minimum(np.divide(feed, rho, out=np.zeros(len(low)), where=turned), _tooth_chips.LARGE)
    e = cutter.runout[0] if cutter.flutes > 1 else 0.0
    leans = np.abs(cosine) > _tooth_chips.LEVEL
    arc = np.where(turned, high - low, 1.0)
    each = LEAST + np.where(leans, LEANS + np.minimum(NARROW * share + POINT * share**2, share), 0.0)
    each += SECOND * np.where(leans, np.minimum(share / arc, 1.0) ** 2, share**2 / arc)
    each += np.where(np.abs(offset) > _tooth_chips.LEVEL * swing, share, 0.0)
    if e > 0.0:
        each += UNLIKE + RUNOUT * e / np.maximum(depth, e)
        widest = np.zeros(len(front))
        np.maximum.at(widest, step, depth)
        x = e / np.maximum(widest[step], e)
        each += np.where(leans, TIP * x + BEYOND * x * x, 0.0)
    weight = (swing + np.abs(offset)) * np.maximum(high - low, 1e-12) * (s1 - s0)
    whole = np.bincount(step, weight, len(front))
    return np.divide(np.bincount(step, weight * each, len(front)), whole, out=np.zeros(len(front)), where=whole > 0.0)
