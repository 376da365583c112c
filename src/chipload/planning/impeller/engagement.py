"""Tooth engagement of a cutter at places of a finishing pass, from the earlier poses of the cutter.

Notation: S contact point, N normal, K curvature tensor of the surface; p tip, A axis, d direction of the feed; a
allowance that stands on the surface; slices, rho, kappa, phi, T, n as in :mod:`chipload.engagement.tooth_engagement`.

A point of the cutter's envelope cuts where it moves outwards (its chip is thicker than 0), lies less than a above the
surface, which near S is y.N - y.K y / 2 high, and lies in no pose of an earlier pass. The points are those of the
slices, :data:`ANGLE` apart in phi; a range of phi ends half-way between two of them.

Differs from the exact chip: the allowance is of constant height everywhere, also where an earlier cutter at another
table angle has milled deeper and beyond the edges of the surface, so that loads come out rather too great; poses of
earlier passes stand at most :data:`SPACING` apart.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipload.cutter.cutter import Cutter
from chipload.cutter.slices import slices
from chipload.engagement.tooth_engagement import ToothEngagement, tool_frame
from chipload.errors import InputError
from chipload.lazy import LateModule, scipy
from chipload.planning.impeller.scene import Floats

_engagement = LateModule("chipload.planning.impeller._engagement")

#: distance of the points of a slice [rad]
ANGLE = math.radians(1.0)
#: greatest distance of poses of an earlier pass [mm]
SPACING = 0.4
#: slices of bottom and corner, length of those of the flank [mm]
_BOTTOM, _CORNER, _FLANK = 4, 16, 0.5


@dataclass(frozen=True, eq=False)
class EarlierPoses:
    """Poses of earlier passes: tips, axes (m, 3), rho and corner radius (m, 2) [mm] of their cutters.

    >>> EarlierPoses.of(np.array([[0, 0, 0], [0, 0, 1.0]]), np.eye(3)[[0, 0]], 4.0, 1.0).tip[:, 2].round(3).tolist()
    [0.0, 0.333, 0.667, 1.0]
    """

    tip: Floats
    axis: Floats
    shape: Floats

    @staticmethod
    def none() -> EarlierPoses:
        """No earlier poses."""
        return EarlierPoses(np.zeros((0, 3)), np.zeros((0, 3)), np.zeros((0, 2)))

    @staticmethod
    def of(tip: Floats, axis: Floats, rho: float, corner: float) -> EarlierPoses:
        """Poses of one pass, with more of them inserted so that they stand at most :data:`SPACING` apart."""
        length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(tip, axis=0), axis=1))])
        at = np.linspace(0.0, length[-1], max(math.ceil(length[-1] / SPACING), 1) + 1)
        tips, axes = (np.column_stack([np.interp(at, length, x[:, j]) for j in range(3)]) for x in (tip, axis))
        axes = axes / np.linalg.norm(axes, axis=1)[:, None]
        return EarlierPoses(tips, axes, np.tile([rho, corner], (len(at), 1)))


@dataclass(frozen=True, eq=False)
class PassPlaces:
    """Places of passes at which the chip is calculated.

    Parameters
    ----------
    contact, normal : S, N (n, 3) [mm]
    curvature : K (n, 3, 3) [1/mm]
    tip, axis, feed : p, A, d (n, 3)
    """

    contact: Floats
    normal: Floats
    curvature: Floats
    tip: Floats
    axis: Floats
    feed: Floats

    def __len__(self) -> int:
        return len(self.contact)


def engagement_at(
    places: PassPlaces, cutter: Cutter, feed_per_tooth: float, allowance: float, earlier: EarlierPoses,
    first: ArrayLike | None = None,
) -> ToothEngagement:  # fmt: skip
    """Tooth engagement of a cutter at places of its passes, one step for each place; all teeth are alike.

    Parameters
    ----------
    cutter : flat, bull nose or ball, no taper
    feed_per_tooth, allowance : [mm], above 0
    earlier : poses of all passes
    first : (n,) how many of them were milled before each place; None: all

    Raises
    ------
    InputError
        A number is not above 0.

    Examples
    --------
    The flank of a cutter of D 20 along a wall with 0.5 mm on it: engaged over acos(1 - 0.5 / 10) = 18.2 deg.

    >>> wall = PassPlaces(*(np.array([x]) for x in ([0, 0, 0.0], [0, 1.0, 0], np.zeros((3, 3)), [0, 10.0, -5.0],
    ...     [0, 0, 1.0], [1.0, 0, 0])))
    >>> mill = Cutter(20.0, 2, 0.0, 10.0, 40.0, 6e5)
    >>> rows = engagement_at(wall, mill, 0.1, 0.5, EarlierPoses.none()).rows
    >>> bool(abs(np.degrees(rows[:, 1] - rows[:, 0]).max() - 18.2) <= 1.0)
    True
    """
    if not (feed_per_tooth > 0.0 and allowance > 0.0):
        raise InputError(f"feed_per_tooth_mm = {feed_per_tooth:g}, allowance_mm = {allowance:g}: must be above 0")
    profile = slices(cutter, bottom_slices=_BOTTOM, corner_slices=_CORNER, flank_mm=_FLANK)
    angles = np.arange(0.0, math.tau, ANGLE) + 0.5 * ANGLE
    middle = profile.z_middle
    known = np.full(len(places), len(earlier.tip)) if first is None else np.asarray(first, dtype=np.int64)
    mask = np.empty((len(profile.rho), len(angles)), dtype=np.bool_)
    start, rows, owner, frames = [0], [], [], []
    tree = scipy.spatial.cKDTree(earlier.tip) if len(earlier.tip) else None
    widest = float(earlier.shape.sum(axis=1).max(initial=0.0))
    for k in range(len(places)):
        frame = tool_frame(places.axis[k], places.feed[k])
        feed = feed_per_tooth * places.feed[k]
        reach = math.hypot(cutter.diameter, cutter.flute_length) + widest
        near = np.zeros(0, dtype=np.int64)
        if tree is not None:
            near = np.array(tree.query_ball_point(places.tip[k], reach), dtype=np.int64)
            near = near[near < known[k]]
            near = near[np.argsort(((earlier.tip[near] - places.tip[k]) ** 2).sum(axis=1), kind="stable")]
        _engagement.in_material(
            *(np.ascontiguousarray(x, dtype=np.float64) for x in (places.tip[k], frame, feed, places.contact[k])),
            np.ascontiguousarray(places.normal[k]), np.ascontiguousarray(places.curvature[k]), allowance,
            profile.rho, middle, profile.sin_kappa, profile.cos_kappa, angles, earlier.tip, earlier.axis,
            earlier.shape, near, mask,
        )  # fmt: skip
        which, low, high = _ranges(mask)
        along, offset = profile.sin_kappa * float(feed @ frame[0]), -profile.cos_kappa * float(feed @ frame[2])
        rows.append(
            np.column_stack(
                [low, high, profile.s_from[which], profile.s_to[which], along[which], offset[which], 0.0 * low]
            )
        )
        owner.append(which)
        frames.append(frame)
        start.append(start[-1] + len(low))
    piece = np.concatenate(owner) if owner else np.zeros(0, dtype=np.int64)
    engagement = np.concatenate(rows) if rows else np.zeros((0, 7))
    return ToothEngagement(
        np.array(start),
        engagement,
        np.full(len(engagement), -1),
        piece,
        profile.columns,
        np.array(frames).reshape(-1, 3, 3),
    )


def _ranges(mask: NDArray[np.bool_]) -> tuple[NDArray[np.int64], Floats, Floats]:
    """Slice, begin and end [rad] of every run of True of a circle (k, p); begins lie within 0 to 2 pi."""
    n = mask.shape[1]
    whole = np.flatnonzero(mask.all(axis=1))
    begins = np.argwhere(mask & ~np.roll(mask, 1, axis=1))
    ends = np.argwhere(mask & ~np.roll(mask, -1, axis=1))
    # ends of a row in the order of its begins: where the last run continues over 2 pi the first end belongs to it
    over = mask[:, 0] & mask[:, -1] & ~mask.all(axis=1)
    order = np.lexsort((np.where(over[ends[:, 0]] & _first_of_row(ends), ends[:, 1] + n, ends[:, 1]), ends[:, 0]))
    stop = np.where(over[ends[:, 0]] & _first_of_row(ends), ends[:, 1] + n, ends[:, 1])[order]
    which = np.concatenate([begins[:, 0], whole])
    low = np.concatenate([begins[:, 1] * ANGLE, np.zeros(len(whole))])
    high = np.concatenate([(stop + 1) * ANGLE, np.full(len(whole), math.tau)])
    return which, low, high


def _first_of_row(cells: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Which cells (m, 2), sorted by row, are the first of their row."""
    return np.concatenate([[True], cells[1:, 0] != cells[:-1, 0]]) if len(cells) else np.zeros(0, dtype=np.bool_)
