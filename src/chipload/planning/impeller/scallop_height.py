"""Height of the scallop between two lines, from the cutter's poses on both lines.

Notation: at each station i two lines lie at q and q'; points of the surface between them at shares of the distance; D
distance of a point from the cutting part, at the poses of both lines from station to station nearby. The least D over
the poses, between them by a parabola, is the excess there, along the normal by one step of the secant; the greatest of
a station's points is its scallop height.
"""

from __future__ import annotations

import math

import numpy as np

from chipload.cutter.catalogue import CatalogueCutter
from chipload.lazy import LateModule
from chipload.planning.impeller.profile import profile_numbers
from chipload.planning.impeller.scene import Floats

_profile = LateModule("chipload.planning.impeller._profile")
_scallop = LateModule("chipload.planning.impeller._scallop")

_SHARES = (np.arange(15) + 0.5) / 15
#: steps of the ternary search for the top of the scallop between two shares
_STEPS = 5
_NEAR = 4.0  # [mm] along the line: poses that are farther do not count
#: distance of poses between which a scallop is searched [mm]; of a small corner its share of the radius, and what is
#: small [mm]: with 1.5 mm a D 12 r 2 came out a third too high, with 0.5 mm a D 12 r 1 took 1.7 times as long
_FINE, _SHARE, _SMALL = 0.5, 0.15, 1.0


def scallop_heights(
    points: Floats, normals: Floats, tips: tuple[Floats, Floats], axes: tuple[Floats, Floats], rho: float, corner: float
) -> Floats:
    """Scallop height at each place, (n,) float [mm]; nan where either line has no pose.

    Parameters
    ----------
    points, normals : (n, k, 3) of the surface between the lines, k shares of the way
    tips, axes : of both lines, (n, 3) each; nan where there is no pose
    """
    wide = np.array([_reach_of(p) for p in tips])
    poses = np.ascontiguousarray(np.concatenate([np.stack(tips), np.stack(axes)], axis=2).transpose(0, 2, 1))
    none = np.isnan(poses[:, :1])
    poses = np.where(none, np.array([_scallop.NOWHERE] * 3 + [0.0, 0.0, 1.0])[:, None], poses)
    out = np.empty(len(points))
    _scallop.heights(np.ascontiguousarray(points), np.ascontiguousarray(normals), poses, wide, rho, corner, _STEPS, out)
    return out


def _reach_of(tips: Floats) -> int:
    """How many poses before and after a place lie within :data:`_NEAR` of it."""
    length = np.linalg.norm(np.diff(tips, axis=0), axis=1)
    usual = float(np.nanmedian(length)) if np.isfinite(length).any() else 1.0
    return max(2, math.ceil(_NEAR / max(usual, 1e-3)))


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


def pose_distance(corner: float) -> float:
    """Distance [mm] of poses along a line for the search of a scallop; a small corner needs a smaller one.

    >>> pose_distance(1.0), pose_distance(2.0)
    (0.15, 0.5)
    """
    return _SHARE * corner if 0.0 < corner <= _SMALL else _FINE


def shares() -> Floats:
    """Shares of the distance from line to line at which the surface is evaluated."""
    return _SHARES


def profile_scallops(
    points: Floats, normals: Floats, tips: tuple[Floats, Floats], axes: tuple[Floats, Floats], cutter: CatalogueCutter
) -> Floats:
    """As :func:`scallop_heights`, of a tapered or barrel cutter."""
    wide = np.array([_reach_of(p) for p in tips])
    out = np.empty(len(points))
    _profile.heights(
        *(np.ascontiguousarray(x) for x in (points, normals, np.stack(tips), np.stack(axes))),
        wide, profile_numbers(cutter), _STEPS, out,
    )  # fmt: skip
    return out
