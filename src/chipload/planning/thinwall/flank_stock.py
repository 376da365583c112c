"""Tooth engagement of the flank of an end mill or bull-nose cutter in plane stock, below the row that was cut before.

Notation: the surface that the row leaves is the plane z = 0 with its normal N = +z; d [mm] depth of the stock above it,
which is the radial depth of cut; x the direction of the feed; the axis A = (0, +-1, 0) lies along the plane, so that
the flank touches it along a line; b [mm] axial depth, from row to row along A; R radius of the cutter, r its corner
radius, rho(h) its radius at the height h above the tip; kappa, phi, s, u, T, n as in
:mod:`chipload.engagement.tooth_engagement`.

All circles about the axis have their middles at z = R. The row before lies b higher along A and has left z < R -
rho(h - b) at the height h, nothing above h = b + r. A tooth cuts at the height h where

    R + rho(h) u . N < d(h) = min(d, R - rho(h - b))      and      h_chip = f_z sin(kappa) sin(phi) > 0,

which is a range of phi from the wall: 0 .. psi in up milling and pi - psi .. pi in down milling, with cos(psi) = (R -
d(h)) / rho(h). Along the flank d(h) = d: the radial depth of [Altintas2012] ch. 2.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipload.cutter.cutter import Cutter
from chipload.cutter.slices import edge_lag, slices
from chipload.engagement.tooth_engagement import ToothEngagement, tool_frame
from chipload.errors import InputError
from chipload.planning.thinwall.depth_range import depths_in_range
from chipload.planning.thinwall.end_stock import EndPose
from chipload.planning.thinwall.plane_stock import CutterPose

Floats = NDArray[np.float64]

#: shortest range of engagement that is kept [rad]
SHORT = 1e-9


@dataclass(frozen=True)
class FlankPose:
    """Position of a cutter whose flank lies along the surface, and the row before.

    Parameters
    ----------
    cutter : end mill or bull nose: straight flank, flat bottom
    feed_per_tooth : f_z > 0 [mm]
    step : axial depth b [mm]; the row before lies on the right of the feed (b > 0) or on its left, and A points there
    clockwise : sense of the spindle (M3)

    Raises
    ------
    InputError
        A number is out of range, or the cutter has no straight flank of that length.

    Examples
    --------
    With a clockwise spindle a row before on the right is down milling.

    >>> mill = Cutter(10.0, 4, 0.5, 20.0, 30.0, 6e5)
    >>> FlankPose(mill, 0.05, 2.0).down, FlankPose(mill, 0.05, -2.0).down
    (True, False)
    """

    cutter: Cutter
    feed_per_tooth: float
    step: float
    clockwise: bool = True

    def __post_init__(self) -> None:
        cutter = self.cutter
        if cutter.barrel_radius is not None:
            raise InputError(
                f"cutter.barrel_radius_mm = {cutter.barrel_radius:g}: its flank touches a wall in a point, not along a "
                "line: state contact = corner with a lean_deg at which its arc touches"
            )
        for key, value in (("taper", cutter.taper), ("bottom", cutter.bottom)):
            if value != 0.0:
                raise InputError(
                    f"cutter.{key}_deg = {math.degrees(value):g}: must be 0: its flank does not touch a wall along a "
                    "line: choose an end mill or bull nose"
                )
        if cutter.body:
            raise InputError("cutter.body: has no straight flank: choose an end mill or bull nose")
        if not 0.0 < self.feed_per_tooth < math.inf:
            raise InputError(f"feed_per_tooth_mm = {self.feed_per_tooth:g}: must be above 0")
        longest = cutter.flute_length - 2.0 * cutter.corner_radius
        if not 0.0 < abs(self.step) <= longest:
            raise InputError(
                f"axial_depth_mm = {abs(self.step):g}: must be from above 0 to {longest:g}, the flutes less twice the "
                "corner radius"
            )

    @property
    def axis(self) -> Floats:
        """A, (3,) float, in the frame of feed, left and normal."""
        return np.array([0.0, -math.copysign(1.0, self.step), 0.0])

    @property
    def beta(self) -> float:
        """Angle of the axis with the normal [rad]."""
        return 0.5 * math.pi

    @property
    def frame(self) -> Floats:
        """Rows T, n, A, (3, 3) float."""
        return tool_frame(self.axis, [1.0, 0.0, 0.0], self.clockwise)

    @property
    def down(self) -> bool:
        """Whether the teeth leave the stock at the wall: down milling."""
        return bool(self.frame[1, 2] > 0.0)

    @property
    def deepest(self) -> float:
        """Radius R [mm]: at greater depths the teeth enter behind the axis."""
        return self.cutter.radius

    @property
    def below(self) -> float:
        """How far [mm] the cutter reaches below the contact line, towards the tip: its corner."""
        return self.cutter.corner_radius

    @property
    def deepest_is(self) -> str:
        """Text for messages: the meaning of ``deepest``."""
        return "the radius of the cutter"

    @property
    def meets(self) -> float:
        """Radius [mm] of the circle with which the cutter meets the stock, in the plane of feed and normal."""
        return self.cutter.radius

    @property
    def centre(self) -> Floats:
        """Middle of the circle of the corner's centres, (3,) float [mm], from the lower end of the contact line."""
        return np.array([0.0, 0.0, self.cutter.radius])

    def tooth_line(self, depth: float) -> float:
        """Length [mm] of the contact line along which one tooth cuts at one instant, at most the axial depth.

        R psi / tan(helix), cos(psi) = 1 - d / R: so much of its helix lies within the stock of depth d.

        >>> round(FlankPose(Cutter(10.0, 4, math.radians(45.0), 20.0, 30.0, 6e5), 0.05, 4.0).tooth_line(0.5), 6)
        2.255134
        """
        psi = math.acos(max(1.0 - depth / self.cutter.radius, -1.0))
        lag = edge_lag(self.cutter)
        return abs(self.step) if lag == 0.0 else min(abs(self.step), psi / lag)

    def engagement(self, depths: ArrayLike, nodes: int = 8) -> ToothEngagement:
        """Tooth engagement in stock of given depths, one step for each depth.

        Parameters
        ----------
        depths : (n,) float [mm], above 0, at most R
        nodes : slices of the corner, and of what the corner of the row before has left

        Raises
        ------
        InputError
            A depth is out of its range.

        Examples
        --------
        Down milling with a radial depth of half the radius: the last 60 degrees before the wall.

        >>> rows = FlankPose(Cutter(10.0, 4, 0.5, 20.0, 30.0, 6e5), 0.05, 2.0).engagement([2.5]).rows
        >>> np.degrees(rows[0, :2]).round(6).tolist(), rows[0, 2:5].round(6).tolist()
        ([120.0, 180.0], [0.0, 2.0, 0.05])
        """
        d = depths_in_range(self, depths)
        piece, s_from, s_to, rho, sine, left, table = self._profile(nodes)
        inner = np.minimum(d[:, None], left)
        cosine = (self.cutter.radius - inner) / rho
        psi = np.where(inner > 0.0, np.arccos(np.clip(cosine, 0.0, 1.0)), 0.0)
        step, k = np.nonzero(psi > SHORT)
        low = np.where(self.down, math.pi - psi[step, k], 0.0)
        rows = np.column_stack(
            [low, low + psi[step, k], s_from[k], s_to[k], sine[k] * self.feed_per_tooth, 0.0 * low, 0.0 * low]
        )
        start = np.concatenate([[0], np.cumsum(np.bincount(step, minlength=len(d)))])
        return ToothEngagement(start, rows, np.full(len(rows), -1), piece[k], table)

    def _profile(self, nodes: int) -> tuple[NDArray[np.int64], Floats, Floats, Floats, Floats, Floats, Floats]:
        """Pieces of the profile that may cut: slice, s from, s to, rho and sin(kappa) (k,), what the row before has
        left in front of each (k,) [mm], and the table of slices.
        """
        cutter, b, r = self.cutter, abs(self.step), self.cutter.corner_radius
        own = slices(cutter, bottom_slices=1, corner_slices=nodes)
        side = np.flatnonzero((own.sin_kappa > 0.0) & (own.z < b + r))
        # the corner of the row before ends at these heights; the flank is cut there
        heights = b + r * (1.0 - np.cos(np.linspace(0.0, 0.5 * math.pi, nodes + 1))) if r > 0.0 else np.array([b])
        parts: list[tuple[int, float, float, float]] = []
        for k in side.tolist():
            if own.radius[k] > 0.0:
                parts.append((k, float(own.s_from[k]), float(own.s_to[k]), float(own.z_middle[k])))
                continue
            low = float(own.z[k])
            cut = np.concatenate([[low], heights[heights > low + 1e-12]])
            along = float(own.s_from[k]) + cut - low
            parts += [
                (k, float(a), float(c), float(m))
                for a, c, m in zip(along[:-1], along[1:], 0.5 * (cut[1:] + cut[:-1]), strict=True)
            ]
        piece = np.array([p[0] for p in parts], dtype=np.int64)
        s_from, s_to, z = (np.array([p[i] for p in parts]) for i in (1, 2, 3))
        before = z - b
        left = np.where(before > 0.0, cutter.radius - cutter.radius_at(np.maximum(before, 0.0)), math.inf)
        return piece, s_from, s_to, own.rho[piece], own.sin_kappa[piece], left, own.columns


#: how a cutter touches the surface: at a point of its corner, along its flank or with its end
Pose = CutterPose | FlankPose | EndPose
