"""The metal that two blades of an impeller share, such as a splitter that crosses its blade.

Notation: z axis of rotation, r radius, theta angle about z. On the circle of one r and z a blade takes the arc from its
`minus` to its `plus` side, for a side is met once on it (``sides.py``). Blades stand a pitch apart.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import LinearNDInterpolator

from chipload.errors import InputError
from chipload.geometry.bspline import BSplinePatch
from chipload.geometry.sections import Blade

Floats = NDArray[np.float64]

#: places of a side between which its theta is linear, along and up
_ALONG, _UP = 101, 33
#: how far a side is continued below its foot and above its tip, of the distance of two places
_BEYOND = 0.5


@dataclass(frozen=True, eq=False)
class Overlap:
    """What a blade has in common with another one at some places.

    Parameters
    ----------
    length : (n,) on the circle through each place, in the metal of both [mm]; 0: they are apart, or one ends before it
    turn : by which the blade stands in the middle between two others [rad], the mean of all places
    """

    length: Floats
    turn: float


def overlap_of(blade: Blade, other: Blade, pitch: float, places: Floats) -> Overlap:
    """What a blade has in common with another one and its repetitions.

    Parameters
    ----------
    pitch : angle from one `other` to the next [rad]
    places : (n, 3) points of the blade [mm], of which r and z count
    """
    where = np.stack([np.hypot(places[:, 0], places[:, 1]), places[:, 2]], axis=-1)
    low, width = _arc(blade, where)
    first, thick = _arc(other, where)
    ahead = np.mod(low - first, pitch)
    # with the arc behind, with the next one
    common = np.maximum(np.minimum(thick - ahead, width), np.minimum(ahead + width - pitch, thick))
    length = np.where(common > 0.0, where[:, 0] * common, 0.0)
    off = 0.5 * (pitch + thick) - (ahead + 0.5 * width)
    off = off[np.isfinite(off)]
    turn = float(np.angle(np.exp(2j * np.pi * off / pitch).sum())) * pitch / (2.0 * np.pi) if len(off) else 0.0
    return Overlap(length, turn)


def splitter_apart(splitter: Blade, blade: Blade, pitch: float, sections: Sequence[Floats] = ()) -> None:
    """Refuse a splitter that has metal in common with a blade.

    Parameters
    ----------
    sections : (n, 3) each [mm], of which it was made; none: the heights at which it does are named

    Raises
    ------
    InputError
        It has, in whichever channel.
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
    """Theta at which the arcs of a blade begin and how long they are (n,) [rad]; not a number: it is not there."""
    low, high = (_theta(side, where) for side in (blade.minus, blade.plus))
    return low, np.maximum(np.angle(np.exp(1j * (high - low))), 0.0)


def _theta(side: BSplinePatch, where: Floats) -> Floats:
    """Theta (n,) [rad] of a side at r and z, not a number where it is not met."""
    u, v = np.linspace(0.0, 1.0, _ALONG), np.linspace(0.0, 1.0, _UP)
    U, V = np.meshgrid(u, v, indexing="ij")
    p = side.at(U.ravel(), V.ravel()).reshape(_ALONG, _UP, 3)
    # straight on a little below the foot and above the tip, on which first and last section lie
    foot, tip = (p[:, k] + _BEYOND * (p[:, k] - p[:, j]) for k, j in ((0, 1), (-1, -2)))
    p = np.concatenate([foot[:, None], p, tip[:, None]], axis=1)
    theta = np.unwrap(np.unwrap(np.arctan2(p[..., 1], p[..., 0]), axis=1), axis=0)
    rz = np.stack([np.hypot(p[..., 0], p[..., 1]), p[..., 2]], axis=-1)
    out: Floats = LinearNDInterpolator(rz.reshape(-1, 2), theta.ravel())(where)
    return out
