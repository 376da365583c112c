"""A track: contact points and poses of the cutter along a line without interruption.

Notation: S contact point, N normal, T(B) cutter axis at the table angle alpha and the pallet angle B; n = N.T,
V = (N - n T) / sqrt(1 - n^2); R, r, rho = R - r of the cutter. Tip p = S + r N + rho V - r T.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import ArrayLike

from chipload.cutter.catalogue import CatalogueCutter
from chipload.planning.impeller.closed_form import axis_at
from chipload.planning.impeller.scene import Floats

#: the pallet is written in degrees with so many decimals: a pose is of a written angle
DECIMALS = 6


@dataclass(frozen=True, eq=False)
class ToolTrack:
    """Poses of the cutter along a line on a surface.

    Parameters
    ----------
    at : (n, 2) u and v
    contact, normal : S [mm], N (n, 3)
    pallet : (n,) B [rad], without jumps
    tip, axis : (n, 3) [mm], unit
    line : number of the line that it is of
    """

    at: Floats
    contact: Floats
    normal: Floats
    pallet: Floats
    tip: Floats
    axis: Floats
    line: int

    @property
    def length(self) -> float:
        """Length of the tip's path [mm]."""
        return float(np.linalg.norm(np.diff(self.tip, axis=0), axis=1).sum())

    def back(self) -> ToolTrack:
        """The same track from its end to its beginning."""
        columns = {f.name: getattr(self, f.name)[::-1] for f in fields(self) if f.name != "line"}
        return ToolTrack(**columns, line=self.line)


def written_angles(pallet: ArrayLike) -> Floats:
    """Pallet angles [rad] as they are written in the program.

    >>> float(np.degrees(written_angles(np.radians(12.3456789))).round(9))
    12.345679
    """
    out: Floats = np.radians(np.round(np.degrees(np.asarray(pallet, dtype=np.float64)), DECIMALS))
    return out


def pose_cutter(
    contact: Floats, normal: Floats, table: float, pallet: Floats, cutter: CatalogueCutter
) -> tuple[Floats, Floats]:
    """Tips (n, 3) [mm] and axes (n, 3) of the cutter at the contact points.

    >>> tip, axis = pose_cutter(np.zeros((1, 3)), np.array([[1.0, 0, 0]]), 0.0, np.zeros(1), CatalogueCutter(20.0, 2.0))
    >>> tip.tolist(), axis.tolist()
    ([[10.0, 0.0, -2.0]], [[0.0, 0.0, 1.0]])
    """
    T = axis_at(table, pallet)
    n = (normal * T).sum(axis=1)[:, None]
    V = (normal - n * T) / np.sqrt(1.0 - n * n)
    r = cutter.corner_radius
    return contact + r * normal + cutter.rho * V - r * T, T


def track_of(
    at: Floats, contact: Floats, normal: Floats, table: float, pallet: Floats, cutter: CatalogueCutter, line: int
) -> ToolTrack:
    """Track of a cutter through contact points at pallet angles, which are rounded as in the program."""
    B = written_angles(pallet)
    tip, axis = pose_cutter(contact, normal, table, B, cutter)
    return ToolTrack(at, contact, normal, B, tip, axis, line)


def pallet_of(table: float, axis: ArrayLike) -> float:
    """Pallet angle B [rad] of an axis at the table angle."""
    a = np.asarray(axis, dtype=np.float64)
    return math.atan2(a[1], a[0]) if math.sin(table) else 0.0
