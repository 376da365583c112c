"""Surfaces with parameters for patches: the sides, and the floor and the layers above it by fitting.

Notation: u along the hub from inlet to outlet, v across a channel from the plus side of a body to the next body round,
both 0..1, as the contact points of ``surfaces.py``. A layer lies at the share w of the way from the hub, less an
allowance, to the shroud; it may continue beyond the outlet, straight in its meridional plane.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from chipload.geometry.bspline import BSplinePatch, patch_through
from chipload.planning.impeller.impeller import Impeller
from chipload.planning.impeller.scene import Floats
from chipload.planning.impeller.surfaces import BODIES, hub_range

_ALONG, _ACROSS = 81, 17  # points that a floor or a layer is fitted through
_NEWTON, _MET = 8, 1e-3  # steps; [mm] a point of a side is met

Flags = NDArray[np.bool_]


def patch_of(impeller: Impeller, body: str, side: str, ahead: float = 0.0) -> BSplinePatch:
    """The surface of :func:`surface_of` as a patch with the same u and v.

    Parameters
    ----------
    ahead : length of the hub ahead of the blade's leading edge [mm]
    """
    index = BODIES.index(body)
    if side != "floor":
        if side.endswith(" fillet"):
            return impeller.foot(index, 1 if side.startswith("plus") else -1)
        blade = impeller.body(index)
        return blade.plus if side == "plus" else blade.minus
    low, high = hub_range(impeller, ahead)
    u, v = np.linspace(0.0, 1.0, _ALONG), np.linspace(0.0, 1.0, _ACROSS)
    s = low + u * (high - low)
    theta = impeller.across(index, s, v)
    return _fit_floor(impeller.hub.curve(s), theta, u, v)


def layer_of(
    impeller: Impeller, index: int, share: float, allowance: float, ahead: float = 0.0, beyond: float = 0.0
) -> BSplinePatch:
    """The layer of the channel on the plus side of a body at the ``share`` w.

    Parameters
    ----------
    allowance : between the hub and the layer w = 0 [mm]
    beyond : length of the layer beyond the outlet [mm]
    """
    low, high = hub_range(impeller, ahead)
    u, v = np.linspace(0.0, 1.0, _ALONG), np.linspace(0.0, 1.0, _ACROSS)
    s = low + u * (high - low)
    m = meridian(impeller, s, share, allowance, (low, high))
    theta = impeller.across(index, s, v)
    shift = [_shift(impeller, index + k, w, s, m) for k, w in ((0, 1), (1, -1))]
    theta = theta + shift[0][:, None] * (1.0 - v) + shift[1][:, None] * v
    if beyond > 0.0:
        out = m[-1] - m[-2]
        rows = max(4, _ALONG // 8)
        step = np.arange(1, rows + 1)[:, None] / rows * beyond
        m = np.vstack([m, m[-1] + step * out / np.linalg.norm(out)])
        theta = np.vstack([theta, np.repeat(theta[-1:], rows, axis=0)])
        length = np.concatenate([[0.0], np.linalg.norm(np.diff(m, axis=0), axis=1).cumsum()])
        u = length / length[-1]
    return _fit_floor(m, theta, u, v)


def meridian(impeller: Impeller, s: Floats, share: float, allowance: float, where: tuple[float, float]) -> Floats:
    """Points (k, 2), r and z, of a layer at places s of the hub between both ends of ``where``."""
    n = impeller.hub.normal(s, np.zeros(len(s)))
    low = impeller.hub.curve(s) + allowance * n[:, [0, 2]]
    tip = impeller.blade.plus.at([0.0, 1.0], 1.0)
    a, b = impeller.shroud.nearest(np.hypot(tip[:, 0], tip[:, 1]), tip[:, 2])
    high = impeller.shroud.curve(a + (s - where[0]) / (where[1] - where[0]) * (b - a))
    out: Floats = low + share * (high - low)
    return out


def _shift(impeller: Impeller, index: int, side: int, s: Floats, m: Floats) -> Floats:
    """How far round (k,) [rad] a side is from its foot at places (k, 2) of a layer above."""
    body = impeller.body(index)
    patch = body.plus if side > 0 else body.minus
    theta, found = _round_at(patch, m)
    foot = impeller.across(index if side > 0 else index - 1, s, np.array([0.0 if side > 0 else 1.0]))[:, 0]
    shift = np.angle(np.exp(1j * (theta - foot)))
    # ahead of a side and behind it as at its edge
    ok = np.flatnonzero(found)
    out: Floats = shift if not len(ok) else np.interp(np.arange(len(s)), ok, shift[ok])
    return out


def _round_at(patch: BSplinePatch, m: Floats) -> tuple[Floats, Flags]:
    """Theta (k,) of a side where it has r and z (k, 2), and whether it has them: by Newton from its nearest point."""
    u, v = (x.ravel() for x in np.meshgrid(np.linspace(0, 1, 61), np.linspace(0, 1, 21), indexing="ij"))
    p = patch.at(u, v)
    grid = np.stack([np.hypot(p[:, 0], p[:, 1]), p[:, 2]], axis=-1)
    first = ((m[:, None] - grid[None]) ** 2).sum(axis=2).argmin(axis=1)
    u, v = u[first], v[first]
    for _ in range(_NEWTON):
        p = patch.at(u, v)
        r = np.hypot(p[:, 0], p[:, 1])
        off = m - np.stack([r, p[:, 2]], axis=-1)
        d = [patch.at(u, v, *x) for x in ((1, 0), (0, 1))]
        J = np.stack([np.stack([(x[:, :2] * p[:, :2]).sum(axis=1) / r, x[:, 2]], axis=-1) for x in d], axis=-1)
        step = np.linalg.solve(J, off[..., None])[..., 0]
        u, v = np.clip(u + step[:, 0], 0.0, 1.0), np.clip(v + step[:, 1], 0.0, 1.0)
    p = patch.at(u, v)
    away = np.hypot(np.hypot(p[:, 0], p[:, 1]) - m[:, 0], p[:, 2] - m[:, 1])
    return np.arctan2(p[:, 1], p[:, 0]), away < _MET


def _fit_floor(m: Floats, theta: Floats, u: Floats, v: Floats) -> BSplinePatch:
    """Patch through the meridional curve m (k, 2) at theta (k, l), its normal away from the axis and up."""
    r = m[:, :1]
    grid = np.stack([r * np.cos(theta), r * np.sin(theta), np.repeat(m[:, 1:], theta.shape[1], axis=1)], axis=-1)
    patch = patch_through(grid, u, v)
    p, n = patch.at(0.5, 0.5)[0], patch.normal(0.5, 0.5)[0]
    out = n @ np.array([p[0], p[1], 0.0]) / np.hypot(p[0], p[1]) + n[2]
    return patch if out > 0.0 else patch_through(grid, u, v, side=-1)
