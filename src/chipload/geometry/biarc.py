"""Approximation of smooth curves by chains of arcs and lines within a tolerance.

Notation: c(t) the curve, c'(t) its derivative, p and q the ends of a span, T0 and T1 the unit tangents there. A
**biarc** is two arcs that leave p along T0, reach q along T1 and share a tangent where they meet. Of the family
of biarcs, the one with equal tangent lengths l is used: with v = q - p and s = T0 + T1,
``l^2 (2 - 2 T0.T1) + 2 l v.s = v.v``. A span whose biarc deviates from the curve by more than the tolerance is halved.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from chipload.geometry.contour import JOIN_MM, Contour, Floats
from chipload.geometry.distance import distance

Curve = Callable[[float], tuple[Floats, Floats]]

#: greatest number of times that a span is halved
DEPTH = 14


def arcs_along(curve: Curve, spans: ArrayLike, tolerance_mm: float) -> Contour | None:
    """Arcs and lines that follow a curve to within ``tolerance_mm``, measured at seven places of each span.

    Parameters
    ----------
    curve : t -> point (2,) [mm] and derivative (2,)
    spans : (k,) increasing parameters; at these the curve may be less smooth (knots)
    tolerance_mm : greatest distance [mm] of the curve from its arcs

    Returns
    -------
    The contour, or None if the curve has no length.

    Examples
    --------
    >>> c = arcs_along(lambda t: (np.array([t, t * t]), np.array([1.0, 2.0 * t])), [0.0, 1.0], 1e-3)
    >>> float(c.length).__round__(3), len(c.segments)
    (1.479, 8)
    """
    t = np.asarray(spans, dtype=np.float64)
    rows: list[Floats] = []
    todo = [(float(a), float(b), 0) for a, b in pairwise(t)][::-1]
    while todo:
        a, b, depth = todo.pop()
        (p, dp), (q, dq) = curve(a), curve(b)
        if depth == 0 or np.hypot(*(q - p)) > JOIN_MM:
            inner = np.array([curve(a + w * (b - a))[0] for w in np.arange(1, 8) / 8.0])
            made = _biarc(p, q, dp, dq)
            fits = made is not None and distance(made, inner).max() <= tolerance_mm
            if not fits and depth < DEPTH and np.hypot(*(np.vstack([inner, q]) - p).T).max() > JOIN_MM:
                m = 0.5 * (a + b)
                todo += [(m, b, depth + 1), (a, m, depth + 1)]
                continue
            if made is not None and fits:
                rows.extend(made)
            elif np.hypot(*(q - p)) > JOIN_MM:
                rows.append(np.array([*p, *q, 0.0, 0.0, 0.0]))
    if not rows:
        return None
    seg = np.array(rows)
    seg[1:, 0:2] = seg[:-1, 2:4]
    return Contour(seg)


def _biarc(p: Floats, q: Floats, dp: Floats, dq: Floats) -> Floats | None:
    """(1 or 2, 7) segments from p along dp to q along dq, or None where there is no short biarc."""
    n0, n1 = np.hypot(*dp), np.hypot(*dq)
    v = q - p
    if n0 == 0.0 or n1 == 0.0 or np.hypot(*v) <= JOIN_MM:
        return None
    t0, t1 = dp / n0, dq / n1
    s = v @ (t0 + t1)
    a = 2.0 - 2.0 * (t0 @ t1)
    root = np.sqrt(s * s + a * (v @ v))
    if s + root <= 0.0:
        return None
    half = (v @ v) / (s + root)
    m = 0.5 * (p + q + half * (t0 - t1))
    parts = [_arc(p, m, t0), _arc(q, m, -t1)]
    if parts[0] is None or parts[1] is None:
        return None
    x0, y0, x1, y1, xc, yc, sweep = parts[1]
    return np.array([parts[0], [x1, y1, x0, y0, xc, yc, -sweep]])


def _arc(p: Floats, q: Floats, t: Floats) -> list[float] | None:
    """The arc (or line) from p to q that leaves along the unit tangent t; None beyond half a turn."""
    v = q - p
    along, across = float(v @ t), float(t[0] * v[1] - t[1] * v[0])
    if along <= 0.0:
        return None
    sweep = 2.0 * float(np.arctan2(across, along))
    if abs(sweep) < 1e-9:
        return [*p, *q, 0.0, 0.0, 0.0]
    r = float(v @ v) / (2.0 * across)
    return [*p, *q, p[0] - r * t[1], p[1] + r * t[0], sweep]
