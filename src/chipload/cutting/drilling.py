"""Thrust and torque of a drill that goes down its axis.

Notation: D [mm] diameter, N lips, kappa half of the point angle, f [mm] feed per revolution, w [mm] web thickness at
the point. A lip cuts chips h = f / N sin(kappa); per mm of radius all lips have the tangential force

    k = N (Ktc h^(1-m) + Kte) / sin(kappa)

Lips that cut from the radius r1 to r2 have the torque M = k (r2^2 - r1^2) / 2 and, as the handbook's thrust is
2000 M [N m] / D without a chisel edge, the thrust k (r2 - r1) / 2. Where material lies under the axis the chisel edge
adds (A - 1) M0 to the torque, and to the thrust (B - 1) k D / 4 for its cutting and 0.007 Kd D^2 J for its indentation,
M0 = k D^2 / 8 the torque of full lips, Kd = 5 kc (f D)^0.2 the handbook's material factor with kc = 8 M0 / (D^2 f). A,
B and J depend on w / D.

A reamer cuts by its lead, a lip of the angle kappa from the wall of the hole outwards: k and the thrust of a rim are
those of a drill. It has no chisel edge.

Reference: [Machinery2020] p. 1152, tables 7 to 9: M = 0.000025 Kd Ff FM A, T = 0.05 Kd Ff FT B + 0.007 Kd D^2 J with
Ff = f^0.8, FM = D^1.8, FT = D^0.8. Differs from source: the torque of the lips is that of the coefficients of the
material, for which the handbook has a table of Kd; its wear factor is 1, a sharp drill.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipload.cutter.cutter import Cutter
from chipload.cutting.material import Material

Floats = NDArray[np.float64]

#: web thickness over diameter; factors A of torque, B and J of thrust. Reference: [Machinery2020] table 7
WEB = np.array([0.025, 0.045, 0.07, 0.085, 0.11, 0.13, 0.155, 0.175, 0.22, 0.26, 0.30, 0.35])
FACTORS = np.array([
    [1.0, 1.005, 1.015, 1.02, 1.04, 1.08, 1.085, 1.105, 1.155, 1.235, 1.31, 1.395],
    [1.1, 1.14, 1.2, 1.235, 1.27, 1.31, 1.355, 1.38, 1.445, 1.5, 1.575, 1.62],
    [0.001, 0.003, 0.006, 0.01, 0.017, 0.022, 0.03, 0.04, 0.065, 0.09, 0.12, 0.16],
])  # fmt: skip
#: w / D of a drill of standard design; of one with a split point 0.025. Reference: [Machinery2020] table 7
STANDARD_WEB = 0.155
#: standard deviation of thrust and torque of a drill besides that of the coefficients: three published formulas and
#: values are 0.64 to 1.7 of these, docs/design/drilling.md
MODEL_SPREAD = 0.2
#: a tool with a flatter point is no drill [rad]
LEAST_POINT = math.radians(5.0)
#: angles of the lips of drills [rad]: points of 142 and 108 deg
DRILL_POINTS = math.radians(19.0), math.radians(36.0)


@dataclass(frozen=True)
class DrillLoads:
    """Loads of a drill in each of n steps.

    Parameters
    ----------
    thrust : (n,) float [N], along the axis, from the tip to the shank
    chisel_torque : (n,) float [N mm], what the chisel edge adds to the torque of the lips
    """

    thrust: Floats
    chisel_torque: Floats


def is_pointed(cutter: Cutter) -> bool:
    """Return whether a cutter has the point of a drill: straight lips that rise from the axis.

    >>> drill = Cutter(10.0, 2, 0.5, 60.0, 80.0, 6e5, bottom=math.radians(31.0))
    >>> is_pointed(drill), is_pointed(Cutter(10.0, 2, 0.5, 20.0, 30.0, 6e5))
    (True, False)
    """
    return (
        cutter.bottom >= LEAST_POINT
        and cutter.corner_radius == 0.0
        and cutter.taper == 0.0
        and cutter.barrel_radius is None
        and not cutter.body
    )


def is_reamer(cutter: Cutter) -> bool:
    """Return whether a cutter is a reamer: a flat end, a lead, an upright flank.

    >>> from chipload.cutter.shapes import reamer
    >>> own = reamer(10.0, 0.5, math.radians(45.0), 30.0)
    >>> is_reamer(Cutter(10.0, 6, 0.0, 30.0, 60.0, 6e5, shape=own)), is_reamer(Cutter(10.0, 6, 0.0, 30.0, 60.0, 6e5))
    (True, False)
    """
    lines = [segment.kappa[0] for segment in cutter.shape if segment.straight]
    upright = len(lines) == 3 and abs(lines[2] - 0.5 * math.pi) < 1e-9
    return upright and lines[0] == 0.0 < lines[1] < 0.5 * math.pi


def is_drill(cutter: Cutter) -> bool:
    """Return whether a cutter is a drill and no mill with a point.

    It is one if its web or its hole depth is stated; by its shape, if it has two or three lips with a point of 108 to
    142 deg and states no ramp angle. Spot drills and chamfer mills have sharper points, high-feed mills flatter ones.

    >>> is_drill(Cutter(10.0, 2, 0.5, 60.0, 80.0, 6e5, bottom=math.radians(31.0)))
    True
    >>> is_drill(Cutter(10.0, 2, 0.5, 60.0, 80.0, 6e5, bottom=math.radians(31.0), ramp_angle=math.radians(3.0)))
    False
    """
    if not is_pointed(cutter) or cutter.ramp_angle is not None:
        return False
    if cutter.web is not None or cutter.hole_depth is not None:
        return True
    return cutter.flutes <= 3 and DRILL_POINTS[0] <= cutter.bottom <= DRILL_POINTS[1]


def has_lips(cutter: Cutter) -> bool:
    """Return whether the loads along its axis are those of a drill: of a point, or of the lead of a reamer."""
    return is_pointed(cutter) or is_reamer(cutter)


def lip_angle(cutter: Cutter) -> float:
    """Return the angle of the lips with the plane normal to the axis [rad]: of the point, or of the lead."""
    return cutter.shape[2].kappa[0] if is_reamer(cutter) else cutter.bottom


def chisel_factors(cutter: Cutter) -> tuple[float, float, float]:
    """Return A, B, J of a drill; of standard design where its web thickness is not stated.

    >>> chisel_factors(Cutter(10.0, 2, 0.5, 60.0, 80.0, 6e5, bottom=math.radians(31.0)))
    (1.085, 1.355, 0.03)
    """
    ratio = STANDARD_WEB if cutter.web is None else cutter.web / cutter.diameter
    a, b, j = (float(np.interp(ratio, WEB, row)) for row in FACTORS)
    return a, b, j


def point_length(cutter: Cutter) -> float:
    """Return the length of the point [mm], from the tip to the full diameter.

    >>> round(point_length(Cutter(10.0, 2, 0.5, 60.0, 80.0, 6e5, bottom=math.radians(31.0))), 4)
    3.0043
    """
    return 0.5 * cutter.diameter * math.tan(cutter.bottom)


def force_per_radius(cutter: Cutter, material: Material, feed: ArrayLike) -> Floats:
    """Return k (n,) [N/mm]: tangential force of all lips per mm of radius, at feeds per revolution (n,) [mm]."""
    sin = math.cos(lip_angle(cutter))
    h = np.asarray(feed, dtype=np.float64) / cutter.flutes * sin
    return np.asarray(cutter.flutes * (material.Ktc * h ** (1.0 - material.exponents[0]) + material.Kte) / sin)


def drill_loads(
    cutter: Cutter, material: Material, feed: ArrayLike, torque: ArrayLike, under_axis: ArrayLike
) -> DrillLoads:
    """Return thrust and chisel torque from the torque of the lips.

    Parameters
    ----------
    cutter : with a point, see :func:`is_pointed`, or a reamer
    feed : (n,) float [mm] per revolution, above 0
    torque : (n,) float [N mm], of the lips alone; it states how much of them cuts: from the axis outwards where
        material is under it, else from the rim inwards
    under_axis : (n,) bool, whether material is under the axis

    Examples
    --------
    A drill of 10 mm with full lips of 1000 N has a torque of 2500 N mm; in a hole of 6 mm its outer 40 % cut.

    >>> drill = Cutter(10.0, 2, 0.5, 60.0, 80.0, 6e5, bottom=math.radians(30.0), web=0.25)
    >>> plain = Material("plain", 1000.0, 0.0, 0.0, 0.0, 0.0, 0.0, source="made up for this example")
    >>> own = drill_loads(drill, plain, [0.2, 0.2], [2500.0, 1600.0], [True, False])
    >>> own.thrust.round(1).tolist(), own.chisel_torque.round(6).tolist()
    ([554.0, 200.0], [0.0, 0.0])
    """
    f, lips = np.asarray(feed, dtype=np.float64), np.asarray(torque, dtype=np.float64)
    under, diameter = np.asarray(under_axis, dtype=np.bool_) & is_pointed(cutter), cutter.diameter
    k, (a, b, j) = force_per_radius(cutter, material, f), chisel_factors(cutter)
    radius, full = 0.5 * diameter, k * diameter**2 / 8.0
    within = np.sqrt(np.clip(2.0 * lips / k, 0.0, radius**2))
    inner = np.sqrt(np.clip(radius**2 - 2.0 * lips / k, 0.0, None))
    width = np.where(under, within, radius - inner)
    kd = 5.0 * (8.0 * full / (diameter**2 * f)) * (f * diameter) ** 0.2
    chisel = (b - 1.0) * 0.25 * k * diameter + 0.007 * kd * diameter**2 * j
    return DrillLoads(0.5 * k * width + np.where(under, chisel, 0.0), np.where(under, (a - 1.0) * full, 0.0))
