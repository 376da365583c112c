"""Forces of the teeth of a steady cut over one turn of the spindle."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from chipload.api.mechanics.cut import (
    CutEngagement,
    Floats,
    chips_of_cut,
    material_with_directions,
    read_only,
    speeds_rad_s,
    straight_cutter,
)
from chipload.api.values import AnyCutter
from chipload.cutting.force import forces_over_turn, greatest_forces, mean_forces
from chipload.cutting.material import Material, texts_beyond_range
from chipload.errors import InputError

#: fewest and most rotations of a turn
ROTATIONS = (8, 100_000)


@dataclass(frozen=True, eq=False)
class TurnForces:
    """Forces on the cutter and torque of a steady cut over one turn.

    Parameters
    ----------
    rotation_deg : (m,) float, of tooth 0 at the tip, counted as the immersion
    force_n : (m, 3) float, on the cutter along the feed, across it and along the axis. Across is to the left of the
        feed for a cutter that turns clockwise (M3), to the right for a left-hand cutter
    torque_nm : (m,) float
    mean_force_n : (3,) float, exact mean over the turn
    mean_torque_nm : exact mean over the turn
    greatest_force_n, greatest_torque_nm : greatest force across the axis and torque, exact between the rotations
    mean_power_w : mean torque times the speed
    notes : ranges of the material's coefficients that the cut leaves
    """

    rotation_deg: Floats
    force_n: Floats
    torque_nm: Floats
    mean_force_n: Floats
    mean_torque_nm: float
    greatest_force_n: float
    greatest_torque_nm: float
    mean_power_w: float
    notes: tuple[str, ...]


def tooth_forces(
    cutter: AnyCutter,
    material: Material | str | Path,
    engagement: CutEngagement,
    feed_per_tooth_mm: float,
    speed_rpm: float,
    *,
    rotations: int = 360,
) -> TurnForces:
    """Return the forces on the cutter over one turn.

    Each tooth has Ft = (Ktc h + Kte) ds, Fr = (Krc h + Kre) ds and Fa = (Kac h + Kae) ds along its edge, h the
    thickness of the undeformed chip, see :func:`chipload.undeformed_chip`. The integral along a helical edge has a
    closed form; with a size effect of the material it is a quadrature with an error of 1e-7.

    Parameters
    ----------
    cutter : straight flank, 1 to 200 teeth
    material : a value, the name of a shipped material, or a file
    engagement : of the cut
    feed_per_tooth_mm : f_z, above 0
    speed_rpm : spindle speed, above 0; for the power and the range of the coefficients, forces do not depend on it
    rotations : m, samples over the turn, 8 to 100,000

    Returns
    -------
    TurnForces

    Raises
    ------
    InputError
        A number is out of range, the cutter has no straight flank, or only the tangential force of the material is
        known.

    References
    ----------
    [Altintas2012] ch. 2; [Engin2001] for the sign of the axial force; [Kienzle1952] for the size effect.

    Examples
    --------
    One straight tooth in a slot, straight ahead: Ft = (1000 N/mm^2 * 0.1 mm + 10 N/mm) * 2 mm = 220 N across the feed,
    Fr = (300 * 0.1 + 5) * 2 = 70 N against the feed, torque 220 N * 5 mm.

    >>> import chipload
    >>> mill = chipload.Cutter(diameter_mm=10, flutes=1, helix_deg=0, flute_length_mm=20, overhang_mm=30,
    ...                        modulus_gpa=600)
    >>> metal = chipload.Material("plain", 1000.0, 300.0, 0.0, 10.0, 5.0, 0.0, source="made up for this example")
    >>> slot = chipload.engagement_of_cut(mill, axial_depth_mm=2, milling="slot")
    >>> turn = tooth_forces(mill, metal, slot, feed_per_tooth_mm=0.1, speed_rpm=3000)
    >>> turn.force_n[90].round(6).tolist(), round(float(turn.torque_nm[90]), 6)
    ([-70.0, 220.0, 0.0], 1.1)
    """
    mill, metal = straight_cutter(cutter), material_with_directions(material, "a force over a turn")
    omega = speeds_rad_s(speed_rpm)
    if len(omega) != 1:
        raise InputError(f"speed_rpm of shape {omega.shape}: must be one number")
    if isinstance(rotations, bool) or not ROTATIONS[0] <= rotations <= ROTATIONS[1]:
        raise InputError(f"rotations = {rotations}: must be from {ROTATIONS[0]} to {ROTATIONS[1]}")
    chips = chips_of_cut(mill, engagement, feed_per_tooth_mm)
    theta = np.arange(rotations) * (math.tau / rotations)
    force, torque = forces_over_turn(chips, mill, metal, theta)
    mean, mean_torque = mean_forces(chips, mill, metal)
    greatest = greatest_forces(chips, mill, metal)
    return TurnForces(
        rotation_deg=read_only(np.degrees(theta)),
        force_n=read_only(force[0]),
        torque_nm=read_only(torque[0] / 1000.0),
        mean_force_n=read_only(mean[0]),
        mean_torque_nm=float(mean_torque[0]) / 1000.0,
        greatest_force_n=float(np.hypot(greatest["force_t"], greatest["force_n"])[0]),
        greatest_torque_nm=float(greatest["torque"][0]) / 1000.0,
        mean_power_w=float(mean_torque[0] * omega[0]) / 1000.0,
        notes=texts_beyond_range(metal, float(chips.chip_max()[0]), float(omega[0]) * mill.radius),
    )
