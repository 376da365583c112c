"""The undeformed chip of a steady cut: its thickness over the immersion, for each tooth."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from chipload.api.mechanics.cut import CutEngagement, Floats, chips_of_cut, read_only, straight_cutter
from chipload.api.values import AnyCutter
from chipload.errors import InputError

#: places of the immersion where none are stated
PLACES = 721


@dataclass(frozen=True, eq=False)
class UndeformedChip:
    """Thickness of the undeformed chip of each tooth over the immersion.

    Parameters
    ----------
    immersion_deg : (m,) float
    thickness_mm : (flutes, m) float; 0 where the tooth does not cut
    thickest_mm : greatest thickness of any tooth at any height, exact between the places
    """

    immersion_deg: Floats
    thickness_mm: Floats
    thickest_mm: float


def undeformed_chip(
    cutter: AnyCutter,
    engagement: CutEngagement,
    feed_per_tooth_mm: float,
    *,
    immersion_deg: ArrayLike | None = None,
    height_mm: float = 0.0,
) -> UndeformedChip:
    """Return the thickness of the undeformed chip over the immersion.

    To first order h = f_z sin(phi). The chip lies between the true paths of the teeth, which are trochoids; to second
    order in the feed, with c = N f_z / (2 pi) and teeth that are alike,

        h = f_z sin(phi) (1 - c cos(phi) / R) + f_z^2 cos(phi)^2 / (2 R),

    less where the tooth before has cut along the wall, with runout and uneven pitch as they are. Each curve is replaced
    by sinusoids, within 0.3 % of the thickest chip for a feed up to a tenth of the radius.

    Parameters
    ----------
    cutter : straight flank; its teeth, runout and pitch are used
    engagement : of the cut
    feed_per_tooth_mm : f_z, above 0
    immersion_deg : (m,) float, where the thickness is calculated; None: evenly from where a tooth enters to where it
        leaves the stock
    height_mm : above the tip, within the depth of cut; runout turns with the helix

    Returns
    -------
    UndeformedChip

    Raises
    ------
    InputError
        A number is out of range, or the cutter has no straight flank.

    References
    ----------
    [Altintas2012] ch. 2; [Kline1983] for runout.

    Examples
    --------
    A slot at 0.1 mm a tooth: straight ahead the chip is as thick as the feed.

    >>> import chipload
    >>> mill = chipload.Cutter(diameter_mm=10, flutes=4, helix_deg=0, flute_length_mm=22, overhang_mm=35,
    ...                        modulus_gpa=580)
    >>> slot = chipload.engagement_of_cut(mill, axial_depth_mm=5, milling="slot")
    >>> chip = undeformed_chip(mill, slot, 0.1, immersion_deg=[30.0, 90.0])
    >>> chip.thickness_mm[0].round(3).tolist()
    [0.05, 0.1]
    """
    mill = straight_cutter(cutter)
    chips = chips_of_cut(mill, engagement, feed_per_tooth_mm)
    if not 0.0 <= height_mm <= engagement.axial_depth_mm:
        raise InputError(
            f"height_mm = {height_mm:g}: must be from 0 to engagement.axial_depth_mm = {engagement.axial_depth_mm:g}"
        )
    low, high, s_from, s_to, along, offset, across = chips.rows.T
    if immersion_deg is None:
        # a chip that begins before 0 has its beginning in the last quarter of the turn
        first = np.where(low > 1.5 * math.pi, low - math.tau, low)
        phi = np.linspace(first.min(), (first + high - low).max(), PLACES) if len(low) else np.linspace(0.0, math.pi, 2)
    else:
        phi = np.radians(np.asarray(immersion_deg, dtype=np.float64))
        if phi.ndim != 1 or not np.isfinite(phi).all():
            raise InputError(f"immersion_deg of shape {phi.shape}: must be (m,) finite numbers")
    thickness = np.zeros((mill.flutes, len(phi)))
    rows = np.flatnonzero((s_from <= height_mm) & (height_mm <= s_to))
    for k in rows.tolist():
        inside = (phi - low[k]) % math.tau <= high[k] - low[k]
        h = np.where(inside, along[k] * np.sin(phi) + across[k] * np.cos(phi) + offset[k], 0.0)
        teeth = slice(None) if chips.tooth[k] < 0 else slice(int(chips.tooth[k]), int(chips.tooth[k]) + 1)
        thickness[teeth] = np.maximum(thickness[teeth], h)
    return UndeformedChip(read_only(np.degrees(phi)), read_only(thickness), float(chips.chip_max()[0]))
