"""Lower Lipschitz envelope of depths over places: nowhere steeper than L, nowhere above the given depths.

Notation: p, q places [mm]; d(q) [mm] allowable depth of cut there; L greatest slope; n places.

    d~(p) = min over q of d(q) + L |p - q|

is the greatest function at or below d whose slope is at most L in any direction. An average would lie above d where d
is least, and exceed the threshold there. |p - q| is the straight distance, which is at most that along the surface, so
that d~ is on the safe side.

Places are gathered in boxes of about sqrt(n); for those of one box the others are taken in the order of min d +
L (distance of the boxes), until that passes the greatest d~ left in it. Exact; O(n^1.5) where d needs little lowering.

Reference: [Yan2018] for the offset function; the envelope is the infimal convolution with a cone.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipload.errors import InputError

Floats = NDArray[np.float64]


def lower_envelope(points: ArrayLike, depth: ArrayLike, slope: float) -> Floats:
    """Envelope d~ at the places, the shape of ``depth``.

    Parameters
    ----------
    points : (..., 3) or (..., 2) float [mm]
    depth : (...) float [mm]
    slope : L, at least 0; at 0 the least depth everywhere

    Raises
    ------
    InputError
        Shapes disagree, a number is not finite, or the slope is below 0.

    Examples
    --------
    >>> lower_envelope([[0.0, 0.0], [1.0, 0.0], [5.0, 0.0]], [1.0, 0.0, 1.0], 0.25).tolist()
    [0.25, 0.0, 1.0]
    """
    d = np.asarray(depth, dtype=np.float64)
    p = np.asarray(points, dtype=np.float64)
    if p.shape[:-1] != d.shape or not np.isfinite(p).all() or not np.isfinite(d).all():
        raise InputError(f"envelope: points {p.shape} and depth {d.shape}: must be finite, a depth a point")
    if not 0.0 <= slope < math.inf:
        raise InputError(f"envelope: slope = {slope:g}: must be finite and at least 0")
    if not d.size:
        return d.copy()
    x, value = p.reshape(-1, p.shape[-1]), d.ravel()
    boxes = _boxes(x, max(16, math.isqrt(len(x))))
    low = np.stack([x[b].min(axis=0) for b in boxes])
    high = np.stack([x[b].max(axis=0) for b in boxes])
    least = np.array([value[b].min() for b in boxes])
    out = value.copy()
    for k, mine in enumerate(boxes):
        gap = np.maximum(np.maximum(low - high[k], low[k] - high), 0.0)
        bound = least + slope * np.linalg.norm(gap, axis=1)
        best = out[mine]
        for j in np.argsort(bound, kind="stable"):
            if bound[j] >= best.max():
                break
            other = boxes[j]
            apart = np.linalg.norm(x[mine][:, None] - x[other][None], axis=2)
            best = np.minimum(best, (value[other] + slope * apart).min(axis=1))
        out[mine] = best
    return out.reshape(d.shape)


def _boxes(x: Floats, size: int) -> list[NDArray[np.int64]]:
    """Numbers of the places in boxes of at most ``size``, halved along their longest side."""
    done, left = [], [np.arange(len(x))]
    while left:
        some = left.pop()
        if len(some) <= size:
            done.append(some)
            continue
        extent = np.ptp(x[some], axis=0)
        half = len(some) // 2
        order = some[np.argpartition(x[some, int(extent.argmax())], half)]
        left += [order[:half], order[half:]]
    return done
