"""Tooth engagement of an upright end mill or bull nose in stock over a level floor, beside the row that was cut before.

Notation: the floor is the plane z = 0 with its normal N = +z, the axis A = N; d [mm] depth of the stock, which is the
axial depth of cut; x the direction of the feed; R radius of the cutter, r its corner radius, rho(h) its radius at the
height h above the tip; kappa, phi, s, u, T, n as in :mod:`chipload.engagement.tooth_engagement`.

The row before lies at y = -b and has left |y + b| > rho(h). A tooth cuts at the height h < d where

    rho(h) cos(phi) sign(b) n_y > rho(h) - |b|      and      h_chip = f_z sin(kappa) sin(phi) > 0,

a range of phi that begins or ends at 0 or pi: psi = arccos(1 - |b| / rho(h)), pi in a slot. The flat bottom takes no
chip. On the flank it is the radial depth b of [Altintas2012] ch. 2.
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
from chipload.planning.thinwall.depth_range import depths_in_range

Floats = NDArray[np.float64]

#: shortest piece of the profile that is kept [mm]
SHORT = 1e-9
#: slices of the corner are narrow near the bottom, where shallow cuts lie
GRADING = 2.0


@dataclass(frozen=True)
class EndPose:
    """Position of an upright cutter on a floor, and the row before.

    Parameters
    ----------
    cutter : end mill or bull nose: flat bottom, no taper
    feed_per_tooth : f_z > 0 [mm]
    step : step-over b [mm]; the row before lies on the right of the feed (b > 0) or on its left; at most the flat of
        the bottom, so that no scallops stay
    clockwise : sense of the spindle (M3)

    Raises
    ------
    InputError
        A number is out of range, or the bottom is not flat.

    Examples
    --------
    >>> EndPose(Cutter(10.0, 4, 0.5, 20.0, 30.0, 6e5), 0.05, -4.0).down
    True
    """

    cutter: Cutter
    feed_per_tooth: float
    step: float
    clockwise: bool = True

    def __post_init__(self) -> None:
        cutter = self.cutter
        for key, value in (("taper", cutter.taper), ("bottom", cutter.bottom)):
            if value != 0.0:
                raise InputError(
                    f"cutter.{key}_deg = {math.degrees(value):g}: must be 0 on a floor: choose an end mill or bull nose"
                )
        if cutter.barrel_radius is not None:
            raise InputError(
                f"cutter.barrel_radius_mm = {cutter.barrel_radius:g}: the flank of a barrel makes no floor: choose an "
                "end mill or bull nose"
            )
        if cutter.body:
            raise InputError("cutter.body: chips of a body are not simulated: choose an end mill or bull nose")
        flat = cutter.diameter - 2.0 * cutter.corner_radius
        if not flat > 0.0:
            raise InputError(
                f"cutter.corner_radius_mm = {cutter.corner_radius:g}: must be below {0.5 * cutter.diameter:g} on a "
                "floor: choose an end mill or bull nose, whose bottom is flat"
            )
        if not 0.0 < self.feed_per_tooth < math.inf:
            raise InputError(f"feed_per_tooth_mm = {self.feed_per_tooth:g}: must be above 0")
        if not 0.0 < abs(self.step) <= flat:
            raise InputError(
                f"step_over_mm = {abs(self.step):g}: must be from above 0 to {flat:g}, the flat of the bottom: "
                "scallops would stay on the floor"
            )

    @property
    def below(self) -> float:
        """How far the cutter reaches below the floor that it makes [mm]."""
        return 0.0

    @property
    def axis(self) -> Floats:
        """A, (3,) float, in the frame of feed, left and normal."""
        return np.array([0.0, 0.0, 1.0])

    @property
    def beta(self) -> float:
        """Angle of the axis with the normal [rad]."""
        return 0.0

    @property
    def frame(self) -> Floats:
        """Rows T, n, A, (3, 3) float."""
        return tool_frame(self.axis, [1.0, 0.0, 0.0], self.clockwise)

    @property
    def down(self) -> bool:
        """Whether the teeth leave the stock at the wall of the row: down milling."""
        return bool(self.frame[1, 1] * self.step < 0.0)

    @property
    def deepest(self) -> float:
        """Length of the flutes [mm]: at greater depths the shank would rub."""
        return self.cutter.flute_length

    @property
    def deepest_is(self) -> str:
        """Text for messages: the meaning of ``deepest``."""
        return "the length of the flutes"

    @property
    def meets(self) -> float:
        """Radius [mm] about the axis within which the cutter meets the stock."""
        return self.cutter.radius

    @property
    def centre(self) -> Floats:
        """Middle of the circle of the corner's centres, (3,) float [mm], from the tip."""
        return np.array([0.0, 0.0, self.cutter.corner_radius])

    def engagement(self, depths: ArrayLike, nodes: int = 8) -> ToothEngagement:
        """Tooth engagement in stock of given depths, one step for each depth.

        Parameters
        ----------
        depths : (n,) float [mm], above 0, at most the flutes
        nodes : slices of the corner

        Raises
        ------
        InputError
            A depth is out of its range.

        Examples
        --------
        Down milling with a step-over of half the radius: the last 60 degrees of the arc.

        >>> rows = EndPose(Cutter(10.0, 4, 0.5, 20.0, 30.0, 6e5), 0.05, -2.5).engagement([1.5]).rows
        >>> np.degrees(rows[0, :2]).round(6).tolist(), rows[0, 2:5].round(6).tolist()
        ([120.0, 180.0], [0.0, 1.5, 0.05])
        """
        d = depths_in_range(self, depths)
        own = slices(self.cutter, bottom_slices=1, corner_slices=nodes, grading=GRADING)
        r = self.cutter.corner_radius
        # length of the profile from the end of the flat up to the depth
        reach = np.maximum(d - r, 0.0) + (r * np.arccos(np.clip(1.0 - d / r, 0.0, 1.0)) if r > 0.0 else 0.0)
        length = np.where(own.sin_kappa > 0.0, np.minimum(own.s_to, reach[:, None]) - own.s_from, 0.0)
        psi = np.arccos(np.clip(1.0 - abs(self.step) / own.rho, -1.0, 1.0))
        step, k = np.nonzero(length > SHORT)
        low = np.where(self.down, math.pi - psi[k], 0.0)
        chip = own.sin_kappa[k] * self.feed_per_tooth
        s_to = own.s_from[k] + length[step, k]
        rows = np.column_stack([low, low + psi[k], own.s_from[k], s_to, chip, 0.0 * low, 0.0 * low])
        start = np.concatenate([[0], np.cumsum(np.bincount(step, minlength=len(d)))])
        return ToothEngagement(start, rows, np.full(len(rows), -1), k, own.columns)
