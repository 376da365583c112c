"""Form error of a wall that the deflection of the cutter causes.

Notation: phi immersion, theta rotation, engagement ranges as in :mod:`chipload.engagement.tooth_engagement`; z [mm]
height above the tip;
C(z', z) [mm/N] the beam's compliance; e(z) [mm] error of the wall, positive where material is left on it (the cutter
was pushed away), negative where it is cut away.

A tooth makes the wall at height z at the moment when its edge passes there at phi = 0 (up milling) or pi (down
milling), that is at theta = phi_wall + z tan(helix) / R. The load of all teeth at that moment bends the cutter:

    e(z) = integral over z' of f_n(z') [C(z', z) + c_w] dz',

f_n(z') the force on the cutter for each mm of depth, along the normal of the wall and away from it, each slice with its
own height; c_w a compliance of the work normal to the wall. With zero helix and down milling h = 0 where the wall is
made to first order, so that hardly more than the edge force shows. With runout each tooth takes what it stands out by
at z away, e(z) lessened by it, and the wall is what the tooth leaves that cuts deepest.

The load is that of the rigid model: bending does not thin the chip. Only a straight flank is accepted: an engagement
range elsewhere is refused.

Reference: [Uddin2007]; [Altintas2012] ch. 2.
"""

from __future__ import annotations

import math
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipload.cutter.cutter import Cutter
from chipload.cutter.slices import edge_lag
from chipload.cutting.force import Spindle
from chipload.cutting.material import Material
from chipload.engagement.tooth_engagement import ToothEngagement, engagement_of_arcs
from chipload.engagement.tooth_surfaces import chips_of_teeth
from chipload.errors import InputError
from chipload.lazy import LateModule
from chipload.structure.beam import flexibilities

_wall_error = LateModule("chipload.cutting._wall_error")

Floats = NDArray[np.float64]
Milling = Literal["up", "down"]

#: how near to 0 or pi an engaged arc must come to make the wall [rad]
REACH = 1e-3


def _wall_immersion(milling: Milling) -> float:
    """Return the immersion [rad] at which the wall is made, in the sense of the spindle."""
    if milling not in ("up", "down"):
        raise InputError(f"milling = {milling!r}: must be up or down")
    return 0.0 if milling == "up" else math.pi


def _makes_wall(engagement: ToothEngagement, phi_wall: float, reach: float) -> NDArray[np.bool_]:
    """Return for each step whether an engagement range holds the wall or comes within ``reach`` of it, (n,) bool."""
    made = np.zeros(len(engagement), dtype=np.bool_)
    low, high = engagement.rows[:, 0] - reach, engagement.rows[:, 1] + reach
    near = low + (phi_wall - low) % math.tau <= high
    np.logical_or.at(made, np.repeat(np.arange(len(engagement)), np.diff(engagement.start)), near)
    return made


def _straight(engagement: ToothEngagement, cutter: Cutter) -> Floats:
    """Return rows (b, 7) with heights in place of lengths along the profile; refuse all but a straight flank."""
    own = engagement.slices[engagement.slice]
    bad = np.flatnonzero(~((np.abs(own[:, 3] - 1.0) <= 1e-12) & (np.abs(own[:, 1] - cutter.radius) <= 1e-9)))
    if len(bad):
        raise InputError(
            f"tooth engagement: row {bad[0]}: rho = {own[bad[0], 1]:g} mm, sin(kappa) = {own[bad[0], 3]:g}: the wall's "
            f"error is known for a straight flank only, rho = {cutter.radius:g} mm and sin(kappa) = 1"
        )
    rows = engagement.rows.copy()
    rows[:, 2:4] += (own[:, 2] - own[:, 0])[:, None]
    return rows


def _beam(cutter: Cutter, fluted_factor: float | None) -> Floats:
    """Return overhang, flute length and the two flexibilities for the kernels."""
    return np.array([cutter.overhang, cutter.flute_length, *flexibilities(cutter, fluted_factor)])


def _check_teeth(cutter: Cutter) -> None:
    if cutter.pitch:
        raise InputError("cutter.pitch_deg: the error of a planned wall is known for evenly spaced teeth: leave it out")


def _check_work(work_compliance: float) -> None:
    if not 0.0 <= work_compliance < math.inf:
        raise InputError(f"work_compliance = {work_compliance:g} mm/N: must be at least 0 (0 is rigid)")


def wall_profile(
    engagement: ToothEngagement,
    cutter: Cutter,
    material: Material,
    z: ArrayLike,
    *,
    milling: Milling,
    work_compliance: float = 0.0,
    fluted_factor: float | None = None,
    reach: float = REACH,
) -> Floats:
    """Return the form error of the wall over its height for every step.

    Parameters
    ----------
    engagement : of n steps
    cutter, material : as for the force
    z : (p,) float [mm], heights above the tip, 0 .. overhang
    milling : ``up`` or ``down``: which wall
    work_compliance : c_w [mm/N], of the work normal to the wall, the same at every height; 0: rigid
    fluted_factor : see :func:`chipload.structure.beam.compliance`
    reach : [rad], how near to the wall the engaged arc must come

    Returns
    -------
    (n, p) float [mm], positive where material is left; 0 for a step that makes no wall.
    """
    heights = np.ascontiguousarray(z, dtype=np.float64)
    if heights.ndim != 1 or not ((heights >= 0.0) & (heights <= cutter.overhang)).all():
        raise InputError(f"z: must be heights from 0 to cutter.overhang_mm = {cutter.overhang:g}")
    _check_work(work_compliance)
    _check_teeth(cutter)
    phi_wall = _wall_immersion(milling)
    out = np.zeros((len(engagement), len(heights)))
    _wall_error.wall_profiles(
        engagement.start,
        _straight(engagement, cutter),
        engagement.tooth,
        phi_wall,
        edge_lag(cutter),
        cutter.flutes,
        np.array(cutter.runout),
        np.array(material.law),
        heights,
        _beam(cutter, fluted_factor),
        work_compliance,
        _makes_wall(engagement, phi_wall, reach),
        out,
    )
    return out


def wall_error_along(
    phi_in: ArrayLike,
    phi_out: ArrayLike,
    feed_per_tooth: ArrayLike,
    cutter: Cutter,
    material: Material,
    axial_depth: float,
    *,
    milling: Milling,
    spindle: Spindle = "cw",
    count: ArrayLike | None = None,
    heights: int = 17,
    work_compliance: float = 0.0,
    fluted_factor: float | None = None,
    reach: float = REACH,
) -> dict[str, NDArray[Any]]:
    """Return the form error of greatest size over the depth for every step of a pass.

    Parameters
    ----------
    phi_in, phi_out, feed_per_tooth, cutter, material, axial_depth, spindle, count
        as :func:`chipload.cutting.force.forces_along`
    milling : ``up`` or ``down``: which wall
    heights : samples over the depth, besides those where a tooth enters or leaves; the greatest is refined between
    work_compliance, fluted_factor, reach : as :func:`wall_profile`

    Returns
    -------
    columns, (n,) each
        ``form_error_um`` float, the greatest |e(z)|; ``form_error_signed_um`` float, that value with its sign
        (positive: material is left); ``error_z_mm`` float, its height; ``wall_made`` bool, False where no tooth
        reaches the wall and the others are 0.

    Examples
    --------
    No helix, down milling: the edge force alone, Kre * depth = 10 * 0.01 N near the tip of a bar with l^3/(3 E I).

    >>> bar = Cutter(10.0, 2, 0.0, 30.0, 30.0, 6e5)
    >>> plain = Material("plain", 1000.0, 300.0, 0.0, 0.0, 10.0, 0.0, source="made up for this example")
    >>> wall = wall_error_along([2.9], [math.pi], 0.05, bar, plain, 0.01, milling="down", fluted_factor=1.0)
    >>> float(wall["form_error_um"][0].round(4)), round(0.1 * 30.5577e-3, 4)
    (0.0031, 0.0031)
    """
    if spindle not in ("cw", "ccw"):
        raise InputError(f"spindle = {spindle!r}: must be cw or ccw")
    front = engagement_of_arcs(
        phi_in, phi_out, feed_per_tooth, cutter, axial_depth, count=count, clockwise=spindle == "cw"
    )
    engagement = chips_of_teeth(front, cutter)
    return greatest_wall_error(
        engagement, cutter, material, axial_depth, milling=milling, heights=heights, work_compliance=work_compliance,
        fluted_factor=fluted_factor, reach=reach,
    )  # fmt: skip


def greatest_wall_error(
    engagement: ToothEngagement,
    cutter: Cutter,
    material: Material,
    axial_depth: float,
    *,
    milling: Milling,
    heights: int = 17,
    work_compliance: float = 0.0,
    fluted_factor: float | None = None,
    reach: float = REACH,
) -> dict[str, NDArray[Any]]:
    """Return the form error of greatest size over the depth for every step of a tooth engagement.

    Parameters
    ----------
    axial_depth : [mm], height above the tip up to which the error counts
    engagement, cutter, material, milling, heights, work_compliance, fluted_factor, reach
        as :func:`wall_profile` and :func:`wall_error_along`

    Returns
    -------
    columns, (n,) each, as :func:`wall_error_along`
    """
    if heights < 3:
        raise InputError(f"heights = {heights}: must be at least 3")
    _check_work(work_compliance)
    _check_teeth(cutter)
    phi_wall = _wall_immersion(milling)
    made = _makes_wall(engagement, phi_wall, reach)
    by_height = engagement.slices.copy()
    by_height[:, 0] = by_height[:, 2]
    out = np.zeros((len(engagement), 2))
    _wall_error.wall_worst(
        engagement.start,
        _straight(engagement, cutter),
        engagement.tooth,
        engagement.slice,
        by_height,
        phi_wall,
        edge_lag(cutter),
        cutter.flutes,
        np.array(cutter.runout),
        np.array(material.law),
        heights,
        axial_depth,
        _beam(cutter, fluted_factor),
        work_compliance,
        made,
        out,
    )
    return {
        "form_error_um": 1000.0 * np.abs(out[:, 0]),
        "form_error_signed_um": 1000.0 * out[:, 0],
        "error_z_mm": out[:, 1],
        "wall_made": made,
    }
