"""How high the scallop between two lines stands: from the cutter's poses on both, not to second order.

Notation: at each station i two lines lie at q and q'; points of the surface between them at shares of the way; D
distance of a point from the cutting part, at the poses of both lines from station to station nearby. The least D over
the poses, between them by a parabola, is what is left there, along the normal by one step of the secant; the greatest
of a station's points is its crest.
"""

from __future__ import annotations

import math

import numpy as np

from chipload.planning.impeller.scene import Floats

_SHARES = (np.arange(15) + 0.5) / 15
_NEAR = 4.0  # [mm] along the line: poses that are farther do not count


def scallop_heights(
    points: Floats, normals: Floats, tips: tuple[Floats, Floats], axes: tuple[Floats, Floats], rho: float, corner: float
) -> Floats:
    """(n,) float [mm] crest at each place; nan where either line has no pose.

    Parameters
    ----------
    points, normals : (n, k, 3) of the surface between the lines, k shares of the way
    tips, axes : of both lines, (n, 3) each; nan where there is no pose
    """
    n, k, _ = points.shape
    away = np.full((n, k), np.inf)
    best_tip, best_axis = np.zeros((n, k, 3)), np.zeros((n, k, 3))
    for p, a in zip(tips, axes, strict=True):
        length = np.linalg.norm(np.diff(p, axis=0), axis=1)
        usual = float(np.nanmedian(length)) if np.isfinite(length).any() else 1.0
        wide = max(2, math.ceil(_NEAR / max(usual, 1e-3)))
        j = np.arange(n)[:, None] + np.arange(-wide, wide + 1)
        ok = (j >= 0) & (j < n)
        j = np.clip(j, 0, n - 1)
        D = distance(points[:, :, None], p[j][:, None], a[j][:, None], rho, corner)
        D = np.where(ok[:, None] & np.isfinite(D), D, 1e9)
        at = D.argmin(axis=2)
        rows, cols = np.indices(at.shape)
        inner = np.clip(at, 1, D.shape[2] - 2)
        d0, d1, d2 = (D[rows, cols, inner + x] for x in (-1, 0, 1))
        low = D[rows, cols, at]
        bend = d0 - 2.0 * d1 + d2
        good = (inner == at) & (bend > 0.0) & (np.maximum(d0, d2) < 1e8)
        low = np.where(good, d1 - (d2 - d0) ** 2 / (8.0 * np.where(bend > 0.0, bend, 1.0)), low)
        nearer = low < np.minimum(away, 1e8)
        away = np.where(nearer, low, away)
        which = j[rows, at]
        best_tip[nearer], best_axis[nearer] = p[which][nearer], a[which][nearer]
    # along the normal
    known = np.isfinite(away)
    D0 = np.where(known, distance(points, best_tip, best_axis, rho, corner), 1.0)
    up = points + np.where(known, D0, 0.0)[..., None] * normals
    D1 = distance(up, best_tip, best_axis, rho, corner)
    drop = np.where(0.2 * np.abs(D0) < D0 - D1, D0 / np.where(D0 == D1, 1.0, D0 - D1), 1.0)
    out = np.where(known, away * np.where(known & (D0 > 0.0), drop, 1.0), np.nan)
    there = np.isfinite(tips[0]).all(axis=1) & np.isfinite(tips[1]).all(axis=1)
    crest: Floats = np.where(there, out.max(axis=1), np.nan)
    return crest


def distance(points: Floats, tips: Floats, axes: Floats, rho: float, corner: float) -> Floats:
    """Distance [mm] of points from the cutting part, taken without end; below 0 inside.

    >>> distance(np.array([5.0, 0.0, 3.0]), np.zeros(3), np.array([0.0, 0.0, 1.0]), 2.0, 1.0).tolist()
    2.0
    """
    x = points - tips
    h = (x * axes).sum(axis=-1) - corner
    d = np.sqrt(np.clip((x * x).sum(axis=-1) - (h + corner) ** 2, 0.0, None))
    low = np.where(d > rho, np.hypot(np.maximum(d - rho, 0.0), h), -h) - corner
    out: Floats = np.where(h <= 0.0, low, d - rho - corner)
    return out


def shares() -> Floats:
    """Shares of the way from line to line at which the surface is looked at."""
    return _SHARES
