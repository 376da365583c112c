"""Order and direction of passes with short times between them.

Notation: a pass has two ends, 0 its beginning and 1 its end. The time from one end to another is that of the quicker of
two links: straight at the feed of links where they are near, or over the part in rapid. A sequence starts at every pass
in turn (at most :data:`_STARTS` of them) and continues each time to the nearest end. Parts of it are then reversed
while that makes it shorter (2-opt). The shortest sequence is taken.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from chipload.planning.impeller.scene import Floats

_STARTS = 12
_ROUNDS = 30
#: ramps of a link over the part [s], and the rate of the pallet on it [rad/s]
_OVER, _RATE = 0.5, 2.0


def pass_order(
    ends: Floats,
    axes: Floats,
    top: float,
    near: float,
    feed: float,
    rapid: float,
    start: tuple[Floats, Floats] | None = None,
) -> list[tuple[int, bool]]:
    """Passes in their order, each with whether it is milled from its beginning.

    Parameters
    ----------
    ends, axes : (n, 2, 3) tips [mm] and axes at the beginning and the end of each pass
    top : safe height along the axis [mm]
    near : longest straight way [mm]
    feed, rapid : of straight ways and of those over the part [mm/s]
    start : tip and axis where the tour begins; None: above the part

    Examples
    --------
    Three passes side by side: there and back.

    >>> side = np.array([[[0.0, k, 0.0], [9.0, k, 0.0]] for k in (0.0, 2.0, 1.0)])
    >>> up = np.tile([0.0, 0.0, 1.0], (3, 2, 1))
    >>> pass_order(side, up, 50.0, 5.0, 20.0, 400.0)
    [(0, True), (2, False), (1, True)]
    """
    n = len(ends)
    cost = _times(ends, axes, top, near, feed, rapid)
    first = np.zeros(2 * n)
    if start is not None:
        both = (
            np.concatenate([ends.reshape(-1, 3), start[0][None]]),
            np.concatenate([axes.reshape(-1, 3), start[1][None]]),
        )
        first = _times_between(*both, top, near, feed, rapid)[-1, :-1]
    best: tuple[float, list[int]] = (math.inf, [])
    begins = np.argsort(first, kind="stable")
    for begin in begins[np.unique(np.linspace(0, len(begins) - 1, min(len(begins), _STARTS)).round().astype(int))]:
        order = _nearest(cost, int(begin), n)
        total, order = _reverse_parts(cost, first, order)
        if total < best[0] - 1e-9:
            best = total, order
    return [(k // 2, k % 2 == 0) for k in best[1]]


def _times(ends: Floats, axes: Floats, top: float, near: float, feed: float, rapid: float) -> Floats:
    return _times_between(ends.reshape(-1, 3), axes.reshape(-1, 3), top, near, feed, rapid)


def _times_between(tips: Floats, axes: Floats, top: float, near: float, feed: float, rapid: float) -> Floats:
    """(m, m) time [s] from end to end."""
    far = np.linalg.norm(tips[:, None] - tips[None], axis=2)
    rise = np.clip(top - (tips * axes).sum(axis=1), 0.0, None)
    turn = np.arccos(np.clip(axes @ axes.T, -1.0, 1.0))
    over = (rise[:, None] + rise[None] + far) / rapid + turn / _RATE + _OVER
    # straight: the pallet turns with it
    straight = np.where(far <= near, np.maximum(far / feed, turn / _RATE), math.inf)
    out: Floats = np.minimum(over, straight)
    return out


def _nearest(cost: Floats, begin: int, n: int) -> list[int]:
    """Sequence from one end on, always to the nearest next one; the ends at which passes begin."""
    order, open_ = [begin], np.ones(2 * n, dtype=np.bool_)
    open_[[begin, begin ^ 1]] = False
    while open_.any():
        here = np.where(open_, cost[order[-1] ^ 1], math.inf)
        order.append(int(here.argmin()))
        open_[[order[-1], order[-1] ^ 1]] = False
    return order


def _reverse_parts(cost: Floats, first: Floats, order: Sequence[int]) -> tuple[float, list[int]]:
    """The sequence with parts of it reversed while that saves time, and its time."""
    at = np.array(order)
    n = len(at)
    for _ in range(_ROUNDS):
        saved = False
        for i in range(n):
            # turned: i..j, each begun at its other end
            enter = first[at ^ 1] if i == 0 else cost[at[i - 1] ^ 1, at ^ 1]
            before = first[at[0]] if i == 0 else cost[at[i - 1] ^ 1, at[i]]
            after = np.zeros(n)
            after[:-1] = cost[at[i], at[1:]] - cost[at[:-1] ^ 1, at[1:]]
            gain = before - enter - after
            gain[:i] = -math.inf
            j = int(gain.argmax())
            if gain[j] > 1e-6:
                at[i : j + 1] = at[i : j + 1][::-1] ^ 1
                saved = True
        if not saved:
            break
    total = float(first[at[0]] + cost[at[:-1] ^ 1, at[1:]].sum())
    return total, at.tolist()
