"""Shapes of cutters beside those of APT and barrels: each is one function that states the segments of its profile.

Notation: as in :mod:`chipload.cutter.profile`; the diameter is that of the widest place.
"""

from __future__ import annotations

import math

from chipload.cutter.profile import ProfileSegment, arc, join_segments, line
from chipload.errors import InputError


def lens(diameter: float, tip_radius: float, corner_radius: float, height: float) -> tuple[ProfileSegment, ...]:
    """Return a lens-shaped cutter: an arc of large radius about a point of the axis, a corner, an upright flank.

    The corner circle touches the arc from inside and the flank: its centre is at rho = d/2 - r, and R - r from that of
    the arc.

    >>> [(round(p.rho[1], 3), round(p.z[1], 3)) for p in lens(12.0, 40.0, 1.0, 10.0)]
    [(5.128, 0.33), (6.0, 1.322), (6.0, 10.0)]
    """
    e = 0.5 * diameter - corner_radius
    if not 0.0 <= corner_radius < 0.5 * diameter:
        raise InputError(
            f"cutter.corner_radius_mm = {corner_radius:g}: must be from 0 to below diameter_mm / 2 = {0.5 * diameter:g}"
        )
    if not tip_radius > 0.5 * diameter:
        raise InputError(
            f"cutter.tip_radius_mm = {tip_radius:g}: must be above diameter_mm / 2 = {0.5 * diameter:g}; state a ball "
            "nose by corner_radius_mm"
        )
    f = tip_radius - math.sqrt((tip_radius - corner_radius) ** 2 - e * e)
    if not height > f:
        raise InputError(f"cutter.flute_length_mm = {height:g}: must be above {f:.6g}, where the flank begins")
    end = math.atan2(e, tip_radius - f)
    segments = [arc((0.0, tip_radius), tip_radius, 0.0, end)]
    if corner_radius > 0.0:
        segments.append(arc((e, f), corner_radius, end, 0.5 * math.pi))
    return join_segments(
        [*segments, line((0.5 * diameter, f), (0.5 * diameter, height), 0.5 * math.pi)], 1e-9 * diameter
    )


def lollipop(diameter: float, neck: float) -> tuple[ProfileSegment, ...]:
    """Return a ball that cuts all round, up to its neck.

    >>> [(round(p.rho[1], 9), round(p.z[1], 9)) for p in lollipop(10.0, 6.0)]
    [(3.0, 9.0)]
    """
    if not 0.0 < neck < diameter:
        raise InputError(f"cutter.shank_diameter_mm = {neck:g}: must be below diameter_mm = {diameter:g}: its neck")
    r = 0.5 * diameter
    return (arc((0.0, r), r, 0.0, math.pi - math.asin(neck / diameter)),)


def dovetail(diameter: float, angle: float, corner_radius: float, height: float) -> tuple[ProfileSegment, ...]:
    """Return a dovetail cutter: a flat bottom, a corner, a flank that leans inwards.

    Parameters
    ----------
    angle : of the flank with the bottom [rad], from 10 to below 90 deg

    >>> [(round(p.rho[1], 3), round(p.z[1], 3)) for p in dovetail(20.0, math.radians(60.0), 0.0, 6.0)]
    [(10.0, 0.0), (10.0, 0.0), (6.536, 6.0)]
    """
    if not math.radians(10.0) <= angle < 0.5 * math.pi - 1e-9:
        raise InputError(f"cutter.flank_deg = {math.degrees(angle):g}: must be from 10 to below 90, with the bottom")
    e, last = 0.5 * diameter - corner_radius, math.pi - angle
    if not (corner_radius >= 0.0 and e > 0.0):
        raise InputError(
            f"cutter.corner_radius_mm = {corner_radius:g}: must be from 0 to below diameter_mm / 2 = {0.5 * diameter:g}"
        )
    foot = (e + corner_radius * math.sin(last), corner_radius - corner_radius * math.cos(last))
    top = foot[0] - (height - foot[1]) / math.tan(angle)
    if not (height > foot[1] and top > 0.0):
        most = foot[1] + foot[0] * math.tan(angle)
        raise InputError(
            f"cutter.flute_length_mm = {height:g}: must be above {foot[1]:.6g}, where the flank begins, and below "
            f"{most:.6g}, where it reaches the axis"
        )
    corner = [arc((e, corner_radius), corner_radius, 0.0, last)] if corner_radius > 0.0 else []
    flank = line(foot, (top, height), last)
    return join_segments([line((0.0, 0.0), (e, 0.0), 0.0), *corner, flank], 1e-9 * diameter)


def thread_mill(diameter: float, pitch: float, flank: float, width: float, neck: float) -> tuple[ProfileSegment, ...]:
    """Return a thread mill with one row of teeth: a tooth of trapezoidal profile, as wide at its root as a pitch.

    Parameters
    ----------
    flank : angle of each flank with the plane normal to the axis [rad]: half the angle of the thread
    width : width of the tooth at the diameter [mm]
    neck : diameter above the tooth [mm]

    >>> [(round(p.rho[1], 3), round(p.z[1], 4)) for p in thread_mill(10.0, 1.5, math.radians(30.0), 0.1875, 6.0)[::2]]
    [(3.863, 0.0), (5.0, 0.6562), (5.0, 0.8438), (3.863, 1.5)]
    """
    if not math.radians(5.0) <= flank <= math.radians(60.0):
        raise InputError(
            f"cutter.flank_deg = {math.degrees(flank):g}: must be from 5 to 60, half the angle of the thread"
        )
    if not pitch > 0.0:
        raise InputError(f"cutter.thread_pitch_mm = {pitch:g}: must be above 0")
    if not 0.0 <= width < pitch:
        raise InputError(f"cutter.tooth_width_mm = {width:g}: must be from 0 to below thread_pitch_mm = {pitch:g}")
    low = 0.5 * (pitch - width)
    wide, root = 0.5 * diameter, 0.5 * diameter - low / math.tan(flank)
    if not 0.0 < neck <= 2.0 * root:
        raise InputError(
            f"cutter.shank_diameter_mm = {neck:g}: must be above 0 and at most {2.0 * root:.6g}, the root of its "
            "tooth: diameter_mm - (thread_pitch_mm - tooth_width_mm) / tan(flank_deg)"
        )
    tooth = [
        line((0.0, 0.0), (root, 0.0), 0.0),
        line((root, 0.0), (wide, low), flank),
        line((wide, low), (wide, low + width), 0.5 * math.pi),
        line((wide, low + width), (root, pitch), math.pi - flank),
    ]
    return join_segments(tooth, 1e-9 * diameter)


def reamer(diameter: float, lead: float, angle: float, height: float) -> tuple[ProfileSegment, ...]:
    """Return a reamer: a flat end, a lead that cuts, an upright flank.

    Parameters
    ----------
    lead : length of the lead along the axis [mm]
    angle : of the lead with the axis [rad]

    >>> [(round(p.rho[1], 3), round(p.z[1], 3)) for p in reamer(10.0, 1.0, math.radians(45.0), 30.0)[::2]]
    [(4.0, 0.0), (5.0, 1.0), (5.0, 30.0)]
    """
    if not math.radians(1.0) <= angle <= math.radians(80.0):
        raise InputError(f"cutter.lead_deg = {math.degrees(angle):g}: must be from 1 to 80, with the axis")
    root = 0.5 * diameter - lead * math.tan(angle)
    if not (lead > 0.0 and root > 0.0):
        most = 0.5 * diameter / math.tan(angle)
        raise InputError(f"cutter.lead_mm = {lead:g}: must be above 0 and below {most:.6g}, where it reaches the axis")
    if not height > lead:
        raise InputError(f"cutter.flute_length_mm = {height:g}: must be above lead_mm = {lead:g}")
    wide = 0.5 * diameter
    return join_segments(
        [
            line((0.0, 0.0), (root, 0.0), 0.0),
            line((root, 0.0), (wide, lead), 0.5 * math.pi - angle),
            line((wide, lead), (wide, height), 0.5 * math.pi),
        ],
        1e-9 * diameter,
    )
