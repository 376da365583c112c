"""The engagement of a steady cut: its engaged arc and its axial depth.

Notation: phi immersion, counted in the sense of the spindle from the direction n across the feed; pi/2 is straight
ahead. ae radial depth of cut, R radius of the cutter. Up milling cuts from 0 to a, down milling from 180 deg - a to
180 deg, with cos(a) = 1 - ae / R.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipload.api.values import AnyCutter, cutter_of, material_of
from chipload.cutter.cutter import Cutter
from chipload.cutter.table import CutterTable
from chipload.cutting.material import Material, need_directions
from chipload.engagement.tooth_engagement import ToothEngagement, engagement_of_arcs
from chipload.engagement.tooth_surfaces import STEADY, chips_of_teeth
from chipload.errors import InputError
from chipload.ranges import number_field, require_ranges
from chipload.units import rad_s_from_rpm

Floats = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class CutEngagement:
    """Engaged arc and axial depth of a steady cut with a straight flank.

    Parameters
    ----------
    entry_deg, exit_deg : immersion where a tooth enters and leaves the stock, 0 to 180, entry below exit
    axial_depth_mm : axial depth of cut, above 0

    Raises
    ------
    InputError
        A number is out of range, or the arc does not rise.

    Examples
    --------
    >>> CutEngagement(entry_deg=90.0, exit_deg=180.0, axial_depth_mm=5.0).exit_deg
    180.0
    """

    entry_deg: float = number_field(least=0.0, below=180.0)
    exit_deg: float = number_field(above=0.0, most=180.0)
    axial_depth_mm: float = number_field(above=0.0)

    def __post_init__(self) -> None:
        """Refuse numbers out of range, and an arc that does not rise."""
        require_ranges(self, "engagement.")
        if not self.entry_deg < self.exit_deg:
            raise InputError(f"engagement.exit_deg = {self.exit_deg:g}: must be above entry_deg = {self.entry_deg:g}")


def engagement_of_cut(
    cutter: AnyCutter,
    *,
    axial_depth_mm: float,
    milling: Literal["up", "down", "slot"],
    radial_depth_mm: float | None = None,
) -> CutEngagement:
    """Return the engagement of a straight cut along a wall, or of a slot.

    The engaged arc is a = arccos(1 - ae / R): from 0 to a in up milling, from 180 deg - a to 180 deg in down milling,
    from 0 to 180 deg in a slot.

    Parameters
    ----------
    cutter : its diameter is used
    axial_depth_mm : axial depth of cut ap, above 0, at most the flute length
    milling : ``up``, ``down`` or ``slot``
    radial_depth_mm : radial depth of cut ae, above 0, at most the diameter; not stated for a slot

    Returns
    -------
    CutEngagement

    Raises
    ------
    InputError
        A depth is out of range or missing, ``milling`` is unknown.

    References
    ----------
    [Altintas2012] ch. 2.

    Examples
    --------
    Half of the diameter is a quarter of a turn.

    >>> import chipload
    >>> mill = chipload.Cutter(diameter_mm=10, flutes=4, helix_deg=30, flute_length_mm=22, overhang_mm=35,
    ...                        modulus_gpa=580)
    >>> cut = engagement_of_cut(mill, axial_depth_mm=5, radial_depth_mm=5, milling="down")
    >>> round(cut.entry_deg, 9), cut.exit_deg
    (90.0, 180.0)
    """
    diameter = straight_cutter(cutter).diameter
    if milling not in ("up", "down", "slot"):
        raise InputError(f"milling = {milling!r}: must be up, down or slot")
    if milling == "slot":
        if radial_depth_mm is not None:
            raise InputError(f"radial_depth_mm = {radial_depth_mm:g}: leave it out: a slot is as wide as the cutter")
        return _within_flutes(CutEngagement(entry_deg=0.0, exit_deg=180.0, axial_depth_mm=axial_depth_mm), cutter)
    if radial_depth_mm is None:
        raise InputError(f"radial_depth_mm: missing: state it for {milling} milling")
    if not 0.0 < radial_depth_mm <= diameter:
        raise InputError(
            f"radial_depth_mm = {radial_depth_mm:g}: must be above 0 and at most cutter.diameter_mm = {diameter:g}"
        )
    arc = math.degrees(math.acos(1.0 - 2.0 * radial_depth_mm / diameter))
    entry, exit_ = (0.0, arc) if milling == "up" else (180.0 - arc, 180.0)
    return _within_flutes(CutEngagement(entry_deg=entry, exit_deg=exit_, axial_depth_mm=axial_depth_mm), cutter)


def _within_flutes(cut: CutEngagement, cutter: AnyCutter) -> CutEngagement:
    """Return the engagement; refuse one that is deeper than the flutes are long."""
    length = straight_cutter(cutter).flute_length
    if cut.axial_depth_mm > length:
        raise InputError(
            f"axial_depth_mm = {cut.axial_depth_mm:g}: must be at most cutter.flute_length_mm = {length:g}"
        )
    return cut


def straight_cutter(cutter: AnyCutter) -> Cutter:
    """Return the cutter of a steady cut; its tool number does not count and need not be stated."""
    if isinstance(cutter, CutterTable) and cutter.number is None:
        cutter = cutter.model_copy(update={"number": 0}).cutter(Path())
    return cutter_of(cutter)


def material_with_directions(material: Material | str | Path, what: str) -> Material:
    """Return the material; refuse one whose tangential force alone is known."""
    metal = material_of(material)
    need_directions(metal, what)
    return metal


def engaged_ranges(
    cutter: Cutter, engagement: CutEngagement, feed_per_tooth_mm: float, count: int = 1
) -> ToothEngagement:
    """Return the engaged part of the cutter, h = f_z sin(phi), of ``count`` equal steps.

    Raises
    ------
    InputError
        The feed is not above 0, the cutter has no straight flank, or the cut is deeper than its flutes.
    """
    if not isinstance(engagement, CutEngagement):
        raise InputError(
            f"engagement: {type(engagement).__name__}: give a chipload.CutEngagement, as of engagement_of_cut"
        )
    if not 0.0 < feed_per_tooth_mm < math.inf:
        raise InputError(f"feed_per_tooth_mm = {feed_per_tooth_mm:g}: must be above 0")
    entry, exit_ = math.radians(engagement.entry_deg), math.radians(engagement.exit_deg)
    return engagement_of_arcs(
        np.full(count, entry), np.full(count, exit_), feed_per_tooth_mm, cutter, engagement.axial_depth_mm
    )


def chips_of_cut(cutter: Cutter, engagement: CutEngagement, feed_per_tooth_mm: float) -> ToothEngagement:
    """Return the chips that the teeth cut in one steady cut, in the pieces in which a fit takes them.

    Raises
    ------
    InputError
        As :func:`engaged_ranges`.
    """
    return chips_of_teeth(engaged_ranges(cutter, engagement, feed_per_tooth_mm), cutter, STEADY)


def speeds_rad_s(speed_rpm: ArrayLike) -> Floats:
    """Return spindle speeds (s,) [rad/s].

    Raises
    ------
    InputError
        One is not above 0.
    """
    speeds = np.atleast_1d(np.asarray(speed_rpm, dtype=np.float64))
    bad = speeds[~((speeds > 0.0) & np.isfinite(speeds))]
    if speeds.ndim != 1 or not speeds.size:
        raise InputError(f"speed_rpm of shape {speeds.shape}: must be one number or (s,) numbers")
    if bad.size:
        raise InputError(f"speed_rpm = {bad[0]:g}: must be above 0")
    return np.asarray(speeds * rad_s_from_rpm(1.0))


def read_only(values: ArrayLike) -> Floats:
    """Return values as an array of float64 that cannot be written."""
    out = np.array(values, dtype=np.float64)
    out.setflags(write=False)
    return out
