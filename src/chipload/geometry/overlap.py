"""The metal that two blades of an impeller share, such as a splitter that crosses its blade.

Notation: z axis of rotation, r radius, theta angle about z. On a circle of constant r and z a blade occupies the arc
from its `minus` to its `plus` side; the circle meets a side once. Blades are one pitch apart.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chipload.errors import InputError
from chipload.geometry.bspline import BSplinePatch
from chipload.geometry.sections import Blade
from chipload.lazy import scipy

Floats = NDArray[np.float64]

#: numbers of places along u and v of a side; theta is interpolated linearly between them
_ALONG, _UP = 101, 33
#: extension of a side below its foot and above its tip, as a share of the distance of two places
_BEYOND = 0.5


@dataclass(frozen=True, eq=False)
class Overlap:
    """The overlap of a blade with another one at some places.

    Parameters
    ----------
    length : (n,) arc [mm] of the circle through each place that is in the metal of both; 0 if there is none
    turn : rotation [rad] that puts the blade in the middle between two others, as the mean of all places
    """

    length: Floats
    turn: float


def overlap_of(blade: Blade, other: Blade, pitch: float, places: Floats) -> Overlap:
    """The overlap of a blade with another one and its repetitions.

    Parameters
    ----------
    pitch : angle between repetitions of `other` [rad]
    places : (n, 3) points of the blade [mm]; only their r and z are used
    """
    where = np.stack([np.hypot(places[:, 0], places[:, 1]), places[:, 2]], axis=-1)
    low, width = _arc(blade, where)
    first, thick = _arc(other, where)
    ahead = np.mod(low - first, pitch)
    # overlap with the arc that begins before, and with the next one
    common = np.maximum(np.minimum(thick - ahead, width), np.minimum(ahead + width - pitch, thick))
    length = np.where(common > 0.0, where[:, 0] * common, 0.0)
    off = 0.5 * (pitch + thick) - (ahead + 0.5 * width)
    off = off[np.isfinite(off)]
    turn = float(np.angle(np.exp(2j * np.pi * off / pitch).sum())) * pitch / (2.0 * np.pi) if len(off) else 0.0
    return Overlap(length, turn)


def splitter_apart(splitter: Blade, blade: Blade, pitch: float, sections: Sequence[Floats] = ()) -> None:
    """Refuse a splitter that overlaps a blade.

    Parameters
    ----------
    pitch : angle between blades [rad]
    sections : (n, 3) [mm] each, of the splitter; without them the message states heights instead of section numbers

    Raises
    ------
    InputError
        They overlap.
    """
    u, v = np.linspace(0.0, 1.0, _ALONG), np.linspace(0.0, 1.0, _UP)
    U, V = (x.ravel() for x in np.meshgrid(u, v, indexing="ij"))
    sides = np.concatenate([splitter.plus.at(U, V), splitter.minus.at(U, V)])
    found = overlap_of(splitter, blade, pitch, np.concatenate([sides, *sections]))
    if not found.length.any():
        return
    most = found.length.max()
    if sections:
        last = np.cumsum([len(sides), *map(len, sections)])
        inside = [k for k, (a, b) in enumerate(itertools.pairwise(last), 1) if found.length[a:b].any()]
        where = f"sections {inside[0]} to {inside[-1]}" if inside else "what lies between its sections"
    else:
        high = 100.0 * np.tile(V, 2)[found.length[: len(sides)] > 0.0]
        where = f"{high.min():.0f} to {high.max():.0f} % of its height"
    raise InputError(
        f"overlaps the blade: {where}: up to {most:.3g} mm round the axis: must not overlap: turn it "
        f"about the axis by {abs(math.degrees(found.turn)):.3g} deg, to the middle of the channel, or leave it out"
    )


def _arc(blade: Blade, where: Floats) -> tuple[Floats, Floats]:
    """Start theta (n,) and length (n,) [rad] of the arcs of a blade; NaN where the blade is absent."""
    low, high = (_theta(side, where) for side in (blade.minus, blade.plus))
    return low, np.maximum(np.angle(np.exp(1j * (high - low))), 0.0)


def _theta(side: BSplinePatch, where: Floats) -> Floats:
    """Theta (n,) [rad] of a side at (r, z) (n, 2); NaN where the side is absent."""
    u, v = np.linspace(0.0, 1.0, _ALONG), np.linspace(0.0, 1.0, _UP)
    U, V = np.meshgrid(u, v, indexing="ij")
    p = side.at(U.ravel(), V.ravel()).reshape(_ALONG, _UP, 3)
    # extend the side a little below the foot and above the tip, on which the first and last sections lie
    foot, tip = (p[:, k] + _BEYOND * (p[:, k] - p[:, j]) for k, j in ((0, 1), (-1, -2)))
    p = np.concatenate([foot[:, None], p, tip[:, None]], axis=1)
    theta = np.unwrap(np.unwrap(np.arctan2(p[..., 1], p[..., 0]), axis=1), axis=0)
    rz = np.stack([np.hypot(p[..., 0], p[..., 1]), p[..., 2]], axis=-1)
    out: Floats = scipy.interpolate.LinearNDInterpolator(rz.reshape(-1, 2), theta.ravel())(where)
    return out
