"""Stability of a steady cut over speed and depth, and the error of the wall that its vibration leaves.

Notation: growth = log |mu|, mu the greatest multiplier of the map of one tooth period; above 0 the cut chatters. margin
the factor on the cutting coefficients at which |mu| = 1; below 1 the cut chatters.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipload.api.mechanics.cut import (
    CutEngagement,
    Floats,
    engaged_ranges,
    material_with_directions,
    read_only,
    speeds_rad_s,
    straight_cutter,
)
from chipload.api.values import AnyCutter
from chipload.checking.dynamics import Mode, modal_stiffness, modes_with_stiffness
from chipload.cutter.cutter import Cutter
from chipload.cutting.material import Material
from chipload.errors import InputError
from chipload.stability import chart as chart_of_cut
from chipload.stability.cuts import DynamicCuts, dynamic_cuts
from chipload.stability.margin import stability_margins
from chipload.stability.modes import Modes
from chipload.stability.surface_error import RESOLVED, force_rows, wall_errors


@dataclass(frozen=True, eq=False)
class StabilityLobes:
    """Stability chart over spindle speed and axial depth.

    Parameters
    ----------
    speed_rpm : (s,) float
    axial_depth_mm : (d,) float
    growth : (s, d) float, log |mu|; above 0 the cut chatters
    limit_depth_mm : (s,) float, least depth at which the cut chatters; the greatest depth of the chart where none does
    """

    speed_rpm: Floats
    axial_depth_mm: Floats
    growth: Floats
    limit_depth_mm: Floats


@dataclass(frozen=True, eq=False)
class SpeedMargins:
    """Stability margins of a cut at several spindle speeds.

    Parameters
    ----------
    speed_rpm : (s,) float
    margin : (s,) float, factor on the force at which the cut begins to chatter, above 0, at most 3: a greater margin is
        shown as 3
    growth : (s,) float, log |mu| of the cut as it is; above 0 it chatters
    chatter_hz : (s,) float, frequency of chatter at the margin; 0 where the margin is 3
    mode : (s,) int, number of the mode that chatters, from 0; -1 where the margin is 3
    """

    speed_rpm: Floats
    margin: Floats
    growth: Floats
    chatter_hz: Floats
    mode: NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class LocationErrors:
    """Surface location errors of a cut at several spindle speeds.

    Parameters
    ----------
    speed_rpm : (s,) float
    error_um : (s,) float, error of greatest size over the height of the wall; positive where material is left, negative
        where it is cut away; NaN where the cut chatters, since its motion is then not periodic
    margin : (s,) float, stability margin
    """

    speed_rpm: Floats
    error_um: Floats
    margin: Floats


def stability_chart(
    cutter: AnyCutter,
    material: Material | str | Path,
    engagement: CutEngagement,
    feed_per_tooth_mm: float,
    speed_rpm: ArrayLike,
    modes: Iterable[Mode],
    *,
    axial_depth_mm: ArrayLike,
    feed_direction_deg: float = 0.0,
) -> StabilityLobes:
    """Return the stability chart of a cut over spindle speed and axial depth.

    The greatest multiplier of the map of one tooth period is found by collocation; it is evaluated where the limit may
    pass and interpolated elsewhere. Runout, uneven pitch, helix and modes along the axis are included.

    Parameters
    ----------
    cutter : straight flank
    material : a value, the name of a shipped material, or a file
    engagement : of the cut; its own axial depth does not count
    feed_per_tooth_mm : f_z, above 0; it counts where the material has a size effect or the cutter has runout
    speed_rpm : (s,) float, two or more that rise from above 0
    modes : of the tip of the cutter, and of the workpiece; a direction without a mode is rigid
    axial_depth_mm : (d,) float, two or more that rise from above 0, at most the flute length
    feed_direction_deg : direction of the feed in the plane of the modes, counted from x towards y

    Returns
    -------
    StabilityLobes

    Raises
    ------
    InputError
        A number is out of range, a grid does not rise, a mode has no damping or stiffness, or only the tangential force
        of the material is known.

    References
    ----------
    [Altintas1995]; [Insperger2004] for the multipliers.

    Examples
    --------
    Four straight teeth in a slot have a constant directional matrix. One mode along or across the feed then acts as in
    turning with N Krc / 4 per mm of depth: least limit 2 k z (1 + z) / (N Krc / 4) = 2 * 5000 * 0.02 * 1.02 / 300.

    >>> import chipload
    >>> mill = chipload.Cutter(diameter_mm=10, flutes=4, helix_deg=0, flute_length_mm=22, overhang_mm=35,
    ...                        modulus_gpa=580)
    >>> metal = chipload.Material("plain", 1000.0, 300.0, 0.0, 0.0, 0.0, 0.0, source="made up for this example")
    >>> slot = chipload.engagement_of_cut(mill, axial_depth_mm=1, milling="slot")
    >>> mode = chipload.Mode(frequency_hz=650, direction="y", damping_ratio=0.02, stiffness_n_um=5)
    >>> chart = stability_chart(mill, metal, slot, 0.05, range(5640, 5720, 10), [mode], axial_depth_mm=[0.6, 0.65, 0.7])
    >>> round(float(chart.limit_depth_mm.min()), 2), 2 * 5000 * 0.02 * 1.02 / 300
    (0.68, 0.68)
    """
    mill, metal = straight_cutter(cutter), material_with_directions(material, "stability")
    speeds = speeds_rad_s(speed_rpm)
    depths = np.asarray(axial_depth_mm, dtype=np.float64)
    if depths.size and depths.max() > mill.flute_length:
        raise InputError(
            f"axial_depth_mm = {depths.max():g}: must be at most cutter.flute_length_mm = {mill.flute_length:g}"
        )
    if mill.flutes > 1 and mill.runout[0] > 0.0:
        raise InputError(
            f"cutter.runout_mm = {mill.runout[0]:g}: the teeth then differ, so that the cut has no single depth: leave "
            "it out, or use stability_margin"
        )
    found = modes_at_tip(modes, mill)
    one = _cuts(mill, metal, engagement, feed_per_tooth_mm, speeds[:1], found, feed_direction_deg)
    chart = chart_of_cut.stability_chart(one, speeds, depths)
    return StabilityLobes(read_only(speed_rpm), read_only(chart.depth), read_only(chart.growth), read_only(chart.limit))


def stability_margin(
    cutter: AnyCutter,
    material: Material | str | Path,
    engagement: CutEngagement,
    feed_per_tooth_mm: float,
    speed_rpm: ArrayLike,
    modes: Iterable[Mode],
    *,
    feed_direction_deg: float = 0.0,
) -> SpeedMargins:
    """Return the stability margin of a cut at spindle speeds.

    The margin is the factor on all cutting coefficients, and for straight teeth on the axial depth, at which the
    greatest multiplier of the map of one tooth period has the modulus 1. Runout, uneven pitch, helix and modes along
    the axis are included. It is closed in to 0.2 %.

    Parameters
    ----------
    cutter : straight flank
    material : a value, the name of a shipped material, or a file
    engagement : of the cut
    feed_per_tooth_mm : f_z, above 0; it counts where the material has a size effect or the cutter has runout
    speed_rpm : () or (s,) float, above 0
    modes : of the tip of the cutter, and of the workpiece; a direction without a mode is rigid
    feed_direction_deg : direction of the feed in the plane of the modes, counted from x towards y

    Returns
    -------
    SpeedMargins

    Raises
    ------
    InputError
        A number is out of range, a mode has no damping or stiffness, or only the tangential force of the material is
        known.

    References
    ----------
    [Altintas1995]; [Insperger2004] for the multipliers.

    Examples
    --------
    The cut of :func:`chipload.stability_chart` at its worst speed, at a depth of 0.34 mm, half of its limit.

    >>> import chipload
    >>> mill = chipload.Cutter(diameter_mm=10, flutes=4, helix_deg=0, flute_length_mm=22, overhang_mm=35,
    ...                        modulus_gpa=580)
    >>> metal = chipload.Material("plain", 1000.0, 300.0, 0.0, 0.0, 0.0, 0.0, source="made up for this example")
    >>> slot = chipload.engagement_of_cut(mill, axial_depth_mm=0.34, milling="slot")
    >>> mode = chipload.Mode(frequency_hz=650, direction="y", damping_ratio=0.02, stiffness_n_um=5)
    >>> round(float(stability_margin(mill, metal, slot, 0.05, 5680, [mode]).margin[0]), 1)
    2.0
    """
    mill, metal = straight_cutter(cutter), material_with_directions(material, "stability")
    speeds, found = speeds_rad_s(speed_rpm), modes_at_tip(modes, mill)
    margins = stability_margins(_cuts(mill, metal, engagement, feed_per_tooth_mm, speeds, found, feed_direction_deg))
    number = np.array(margins.mode)
    number.setflags(write=False)
    return SpeedMargins(
        read_only(np.atleast_1d(speed_rpm)), read_only(margins.margin), read_only(margins.growth),
        read_only(margins.frequency), number,
    )  # fmt: skip


def surface_location_error(
    cutter: AnyCutter,
    material: Material | str | Path,
    engagement: CutEngagement,
    feed_per_tooth_mm: float,
    speed_rpm: ArrayLike,
    modes: Iterable[Mode],
    *,
    feed_direction_deg: float = 0.0,
) -> LocationErrors:
    """Return the error that the forced vibration of a stable cut leaves on the wall, at spindle speeds.

    A stable motion has the period of a tooth, tau: r_k = G(i k 2 pi / tau) F_k for each harmonic k of the force of the
    rigid model, up to k = 400. The wall at a height is made when an edge passes there at an immersion of 0 (up milling)
    or 180 deg (down milling); in a slot the greater error of both walls counts.

    Parameters
    ----------
    cutter : straight flank, teeth that are alike
    material : a value, the name of a shipped material, or a file; without a size effect
    engagement : of the cut; its arc begins at 0 or ends at 180 deg
    feed_per_tooth_mm : f_z, above 0
    speed_rpm : () or (s,) float, above 0
    modes : of the tip of the cutter, and of the workpiece, across the axis; a direction without a mode is rigid
    feed_direction_deg : direction of the feed in the plane of the modes, counted from x towards y

    Returns
    -------
    LocationErrors

    Raises
    ------
    InputError
        A number is out of range, no wall is made, teeth differ, a mode moves along the axis, a mode has no damping or
        stiffness, or the material has a size effect or is known by its tangential force alone.

    References
    ----------
    [Schmitz2009] ch. 5.

    Examples
    --------
    Far below the natural frequency the cutter follows the force. In down milling without helix the tooth that makes the
    wall cuts nothing there, so that the edge force alone moves it: Kre ap / k = 10 N/mm * 2 mm / 5 N/um. The
    engaged sixth of the turn lasts long enough for the mode to come to rest.

    >>> import chipload
    >>> mill = chipload.Cutter(diameter_mm=10, flutes=1, helix_deg=0, flute_length_mm=22, overhang_mm=35,
    ...                        modulus_gpa=580)
    >>> metal = chipload.Material("plain", 10.0, 0.0, 0.0, 0.0, 10.0, 0.0, source="made up for this example")
    >>> cut = chipload.engagement_of_cut(mill, axial_depth_mm=2, radial_depth_mm=2.5, milling="down")
    >>> mode = chipload.Mode(frequency_hz=5000, direction="y", damping_ratio=0.2, stiffness_n_um=5)
    >>> surface_location_error(mill, metal, cut, 0.01, 6000, [mode]).error_um.round(1).tolist()
    [4.0]
    """
    mill, metal = straight_cutter(cutter), material_with_directions(material, "the error of a wall")
    if engagement.entry_deg > 0.0 and engagement.exit_deg < 180.0:
        raise InputError(
            f"engagement: {engagement.entry_deg:g} to {engagement.exit_deg:g} deg: makes no wall: must begin at 0 or "
            "end at 180"
        )
    speeds, found = speeds_rad_s(speed_rpm), modes_at_tip(modes, mill)
    if found.axial:
        raise InputError("modes: one moves along the axis: the error of a wall is known for modes across it")
    if not mill.teeth_alike:
        raise InputError("cutter: its teeth differ by runout or pitch: the error of a wall is known for equal teeth")
    from chipload.stability._surface_location import HARMONICS  # compiled when it is imported

    slowest = RESOLVED * float(found.frequency.max()) * 60.0 / (HARMONICS * mill.flutes)
    lowest = float(np.min(speed_rpm))
    if lowest < slowest:
        raise InputError(
            f"speed_rpm = {lowest:g}: must be at least {slowest:.4g}: below it {HARMONICS} harmonics of the teeth "
            f"do not reach {RESOLVED:g} times the mode of {found.frequency.max():g} Hz"
        )
    cuts = _cuts(mill, metal, engagement, feed_per_tooth_mm, speeds, found, feed_direction_deg)
    ranges = engaged_ranges(mill, engagement, feed_per_tooth_mm, len(speeds))
    error, _ = wall_errors(cuts, force_rows(ranges, metal))
    margins = stability_margins(cuts)
    stable = margins.growth < 0.0
    return LocationErrors(
        read_only(np.atleast_1d(speed_rpm)), read_only(np.where(stable, 1000.0 * error, math.nan)),
        read_only(margins.margin),
    )  # fmt: skip


def modes_at_tip(modes: Iterable[Mode], cutter: Cutter) -> Modes:
    """Return the modes of the tip and of the workpiece in the form that the calculation takes.

    Raises
    ------
    InputError
        There is none, or one has no damping, no stiffness, or is that of another tool.
    """
    listed = [modes] if isinstance(modes, Mode) else list(modes)
    if not listed:
        raise InputError("modes: missing: state at least one chipload.Mode")
    known = []
    for k, mode in enumerate(listed):
        where = f"modes[{k}]"
        if not isinstance(mode, Mode):
            raise InputError(f"{where}: {type(mode).__name__}: give a chipload.Mode")
        if mode.tool is not None and mode.tool != cutter.number:
            raise InputError(f"{where}.tool = {mode.tool}: the cutter has the number {cutter.number}: leave it out")
        stiffness = modal_stiffness(mode, where)
        if math.isnan(stiffness):
            raise InputError(f"{where}: stiffness_n_um: missing: state it, or mass_kg")
        if mode.damping_ratio is None:
            raise InputError(f"{where}: damping_ratio: missing: stability is not known without it")
        known.append((k, mode, stiffness))
    return modes_with_stiffness(known)


def _cuts(
    cutter: Cutter,
    material: Material,
    engagement: CutEngagement,
    feed_per_tooth_mm: float,
    speeds: Floats,
    modes: Modes,
    feed_direction_deg: float,
) -> DynamicCuts:
    """Return the cut at speeds (s,) [rad/s], in the directions of the modes."""
    if not math.isfinite(feed_direction_deg):
        raise InputError(f"feed_direction_deg = {feed_direction_deg:g}: must be a finite number")
    ranges = engaged_ranges(cutter, engagement, feed_per_tooth_mm, len(speeds))
    angle, side = math.radians(feed_direction_deg), -1.0 if cutter.left_hand else 1.0
    T = np.tile([math.cos(angle), math.sin(angle)], (len(speeds), 1))
    n = side * np.column_stack([-T[:, 1], T[:, 0]])
    return dynamic_cuts(ranges, cutter, material, modes, speeds, T, n)
