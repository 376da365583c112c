"""The fillet of constant radius between the side of a blade and the hub: the envelope of a rolling ball.

Notation: side S(u, v) with its normal N out of the metal, v = 0 at the hub; hub of revolution with its normal M into
the channel; a [mm] radius of the ball. The centre C(u) = S(u, v*) + a N of the ball is at distance a from the hub. The
ball touches the side at S(u, v*) and the hub at C - a M. The fillet is the arc about C from -M to -N. Both directions
are perpendicular to the path of the centre, so the fillet is the canal surface of the ball. Beyond its ends the hub is
extrapolated by its spline.

The parameters of the fillet are u and w; w runs from 0 at the hub to 1 at the side. The side above the fillet is S over
u and v', with v = v* + v' (1 - v*).

Reference: [Rossignac1984].
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from chipload.errors import InputError
from chipload.geometry.bspline import BSplinePatch, patch_through
from chipload.geometry.revolve import Revolved

Floats = NDArray[np.float64]

#: greatest deviation of the patches from the exact surfaces [mm]
FIT = 1e-3
#: share of its length by which the hub is extended at each end
BEYOND = 0.2
_COARSE, _NEWTON, _STEPS = 101, 8, 60
_MET = 1e-11  # [mm] tolerance of the contact of ball and hub
_ARC = 13  # points along an arc of the fillet
_ROUNDS = 9  # most refinements along u
_UP = (17, 33, 65, 129)  # numbers of points along v above the fillet that the fit tries
_SCAN = np.linspace(0.0, 1.0, 65)


@dataclass(frozen=True, eq=False)
class Filleted:
    """A side with its fillet.

    Attributes
    ----------
    side : the side above the fillet
    fillet : u as on the side, v from the hub to the side; the normal points out of the metal
    height : greatest length of the side that the fillet covers [mm]
    off : greatest measured deviation of the patches from the exact surfaces [mm]
    """

    side: BSplinePatch
    fillet: BSplinePatch
    height: float
    off: float


def add_fillet(side: BSplinePatch, hub: Revolved, radius: float) -> Filleted:
    """A side with a fillet at the hub.

    Parameters
    ----------
    side : normal out of the metal, v = 0 at the hub
    hub : normal into the channel
    radius : of the fillet [mm]

    Raises
    ------
    InputError
        No ball of that radius touches both side and hub, or the patches deviate by more than ``FIT``.
    """
    ends = np.unique(side.knots_u)
    u, off = np.sort(np.concatenate([ends, 0.5 * (ends[1:] + ends[:-1])])), np.inf
    for _ in range(_ROUNDS):
        made, away = _make_patches(side, hub, radius, u)
        off = made.off
        if off <= FIT:
            return made
        u = np.sort(np.concatenate([u, (0.5 * (u[1:] + u[:-1]))[away > 0.2 * FIT]]))
    raise InputError(
        f"the patches of the fillet of {radius:g} mm deviate from it by {off:.4g} mm: must be at most {FIT:g} mm"
    )


def _make_patches(side: BSplinePatch, hub: Revolved, radius: float, u: Floats) -> tuple[Filleted, Floats]:
    """The patches through exact points at u (n,), and their deviation midway between these places (n - 1,) [mm]."""
    middle = 0.5 * (u[1:] + u[:-1])
    v, between = (_touch_heights(side, hub, radius, x) for x in (u, middle))
    w = np.linspace(0.0, 1.0, _ARC)
    made = patch_through(_arcs(side, hub, radius, u, v, w), u, w, (3, 5))
    k = len(u) // 2
    towards = _centre(side, radius, u[k : k + 1], v[k : k + 1])[0] - made.at(u[k], 0.5)[0]
    if made.normal(u[k], 0.5)[0] @ towards < 0.0:
        made = replace(made, side=-1)
    x = 0.5 * (w[1:] + w[:-1])
    exact = _arcs(side, hub, radius, middle, between, x)
    away = np.linalg.norm(_grid(made, middle, x) - exact, axis=2).max(axis=1)
    above = _side_above(side, u, v)
    share = np.linspace(0.0, 1.0, 33)
    error = _grid(above, middle, share) - _points_between(side, middle, between + share[:, None] * (1.0 - between))
    away = np.maximum(away, np.linalg.norm(error, axis=2).max(axis=1))
    covered = _points_between(side, u, share[:, None] * v)
    height = float(np.linalg.norm(np.diff(covered, axis=1), axis=2).sum(axis=1).max())
    return Filleted(above, made, height, float(away.max())), away


def _grid(patch: BSplinePatch, u: Floats, v: Floats) -> Floats:
    """Points (n, m, 3) [mm] of a patch at u (n,) and v (m,)."""
    return _points_between(patch, u, np.repeat(v[:, None], len(u), axis=1))


def _points_between(patch: BSplinePatch, u: Floats, v: Floats) -> Floats:
    """Points (n, m, 3) [mm] of a patch at u (n,), each with its own v (m, n)."""
    return patch.at(np.repeat(u, len(v)), v.T.ravel()).reshape(len(u), len(v), 3)


def from_hub(hub: Revolved, points: Floats) -> tuple[Floats, Floats]:
    """Distance (n,) [mm] of points (n, 3) from a hub, positive on the side of its normal, and that normal (n, 3)."""
    r, z = np.hypot(points[:, 0], points[:, 1]), points[:, 2]
    p, s = np.stack([r, z], axis=-1), hub.nearest(r, z, _COARSE)
    for _ in range(_NEWTON):
        c, d, e = (hub.curve(s, k) for k in range(3))
        slope = (d * d).sum(axis=1) - ((p - c) * e).sum(axis=1)
        step = ((p - c) * d).sum(axis=1) / np.where(slope > 0.0, slope, (d * d).sum(axis=1))
        s = np.clip(s + step, -BEYOND, 1.0 + BEYOND)
        if np.abs(step).max() < 1e-14:
            break
    d = hub.curve(s, 1)
    n = hub.side * np.stack([-d[:, 1], d[:, 0]], axis=-1) / np.linalg.norm(d, axis=1)[:, None]
    normal = np.stack([n[:, 0] * points[:, 0] / r, n[:, 0] * points[:, 1] / r, n[:, 1]], axis=-1)
    return ((p - hub.curve(s)) * n).sum(axis=1), normal


def _centre(side: BSplinePatch, radius: float, u: Floats, v: Floats) -> Floats:
    out: Floats = side.at(u, v) + radius * side.normal(u, v)
    return out


def _touch_heights(side: BSplinePatch, hub: Revolved, radius: float, u: Floats | list[float]) -> Floats:
    """v* (n,): the least v at which a ball that touches the side touches the hub too."""
    at = np.asarray(u, dtype=np.float64)

    def clearance(v: Floats) -> Floats:
        return from_hub(hub, _centre(side, radius, at, v))[0] - radius

    low, high = np.zeros(len(at)), np.full(len(at), np.nan)
    below, above = clearance(low), np.full(len(at), np.nan)
    if (below >= 0.0).any():
        raise InputError(
            f"no fillet of {radius:g} mm fits between side and hub at u = {at[below.argmax()]:.3g}: they must "
            "meet in a corner"
        )
    for v in _SCAN[1:]:
        now, found = clearance(np.full(len(at), v)), np.isfinite(high)
        met = ~found & (now >= 0.0)
        high, above = np.where(met, v, high), np.where(met, now, above)
        low, below = np.where(found | met, low, v), np.where(found | met, below, now)
        if np.isfinite(high).all():
            break
    else:
        where = at[np.isnan(high).argmax()]
        raise InputError(f"a fillet of {radius:g} mm reaches above the side at u = {where:.3g}")
    # false position; the value at the end that stays is halved (Illinois)
    out: Floats = high
    for _ in range(_STEPS):
        out = low - below * (high - low) / (above - below)
        now = clearance(out)
        if np.abs(now).max() < _MET:
            break
        up = now >= 0.0
        below, above = np.where(up, 0.5 * below, now), np.where(up, now, 0.5 * above)
        low, high = np.where(up, low, out), np.where(up, out, high)
    return out


def _arcs(side: BSplinePatch, hub: Revolved, radius: float, u: Floats, v: Floats, w: Floats) -> Floats:
    """Points (n, m, 3) [mm] of the fillet at u (n,) with v* (n,), and w (m,)."""
    C, N = _centre(side, radius, u, v), side.normal(u, v)
    _, M = from_hub(hub, C)
    angle = np.arctan2(np.linalg.norm(np.cross(N, M), axis=1), (N * M).sum(axis=1))[:, None]
    a, b = (np.sin(x * angle) / np.sin(angle) for x in (1.0 - w, w))
    out: Floats = C[:, None] - radius * (a[..., None] * M[:, None] + b[..., None] * N[:, None])
    return out


def _side_above(side: BSplinePatch, u: Floats, v: Floats) -> BSplinePatch:
    """The side above v* at u, with the fewest points along v that keep the deviation within ``0.1 FIT``."""
    made = side
    for count in _UP:
        x = np.linspace(0.0, 1.0, count)
        made = patch_through(_points_between(side, u, v + x[:, None] * (1.0 - v)), u, x, side=side.side)
        x = 0.5 * (x[1:] + x[:-1])
        if np.abs(_grid(made, u, x) - _points_between(side, u, v + x[:, None] * (1.0 - v))).max() <= 0.1 * FIT:
            break
    return made
