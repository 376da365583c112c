"""Profiles of tools that are checked as bodies against part, stock and fixtures; their chips are not simulated.

Notation: a profile is ``((rho, z), ...)`` [mm], distance from the axis and height above the tip, from z = 0 upwards.
APT: (d, r, e, f, alpha, beta, h) as in :mod:`chipload.cutter.cutter`.
"""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np

from chipload.errors import InputError

Profile = tuple[tuple[float, float], ...]

#: chords of an arc
CHORDS = 32
#: minor diameter of an ISO metric thread: D - 2 * 5/8 * H, H = sqrt(3) / 2 of the pitch (ISO 68-1)
MINOR = 1.25 * math.sqrt(3.0) / 2.0


def cylinder(diameter: float, height: float) -> Profile:
    """Return the profile of a flat-ended cylinder, such as a reamer.

    >>> cylinder(6.0, 20.0)
    ((3.0, 0.0), (3.0, 20.0))
    """
    return ((0.5 * diameter, 0.0), (0.5 * diameter, height))


def tap_core(diameter: float, pitch: float, height: float) -> Profile:
    """Return the core of a tap: the cylinder of the minor diameter D - 1.0825 P, that of the hole.

    >>> round(2.0 * tap_core(6.0, 1.0, 20.0)[0][0], 3)
    4.917
    """
    return cylinder(diameter - MINOR * pitch, height)


def one_thread(diameter: float, neck: float, crest: float, angle: float, height: float) -> Profile:
    """Return a thread mill with one row of teeth, and its neck up to ``height``.

    Parameters
    ----------
    crest : height of the flat end of a tooth [mm]
    angle : of the thread [rad]

    >>> [(r, round(z, 3)) for r, z in one_thread(10.0, 6.0, 0.5, math.radians(90.0), 20.0)]
    [(3.0, 0.0), (5.0, 2.0), (5.0, 2.5), (3.0, 4.5), (3.0, 20.0)]
    """
    flank = 0.5 * (diameter - neck) * math.tan(0.5 * angle)
    r, n = 0.5 * diameter, 0.5 * neck
    top = 2.0 * flank + crest
    return ((n, 0.0), (r, flank), (r, flank + crest), (n, top), (n, max(height, top)))


def dovetail(diameter: float, neck: float, cone: float, angle: float, height: float) -> Profile:
    """Return a dovetail mill: widest at its tip, narrower up to the height ``cone``, its neck up to ``height``.

    Some sources state ``angle`` [rad] of the flank with the axis, others with the bottom: the wider body is used.

    >>> [(round(r, 3), z) for r, z in dovetail(20.0, 6.0, 5.0, math.radians(60.0), 15.0)]
    [(10.0, 0.0), (7.113, 5.0), (3.0, 5.0), (3.0, 15.0)]
    """
    less = cone * min(math.tan(angle), 1.0 / math.tan(angle))
    n = 0.5 * neck
    return ((0.5 * diameter, 0.0), (max(0.5 * diameter - less, n), cone), (n, cone), (n, max(height, cone)))


def saw(diameter: float, blade: float, cap: tuple[float, float]) -> Profile:
    """Return a slitting saw on its screw; ``cap`` is diameter and height of the screw's head below the blade.

    >>> saw(60.0, 2.0, (8.0, 3.0))
    ((4.0, 0.0), (4.0, 3.0), (30.0, 3.0), (30.0, 5.0))
    """
    wide, high = cap
    head = ((0.5 * wide, 0.0), (0.5 * wide, high)) if high > 0.0 else ()
    return (*head, (0.5 * diameter, high), (0.5 * diameter, high + blade))


def apt_body(shape: tuple[float, float, float, float, float, float, float]) -> Profile | None:
    """The body of seven APT numbers whose corner does not touch bottom and flank, such as a barrel or a lens.

    Bottom line, then the arc up to the height f - r sin(beta), above it the flank from the arc's end to h.
    None: the seven numbers describe no such body.

    >>> barrel = apt_body((10.0, 20.0, -15.0, 10.0, 0.0, 0.0, 16.0))
    >>> [tuple(round(x, 3) for x in barrel[k]) for k in (0, -2, -1)]  # rho = -15 + sqrt(400 - 100) at its tip
    [(2.321, 0.0), (5.0, 10.0), (5.0, 16.0)]
    """
    _, r, e, f, alpha, beta, h = shape
    high = min(f - r * math.sin(beta), h)
    if not (h > 0.0 and r > 0.0 and high > 0.0 and e + r * math.cos(beta) > 0.0):
        return None
    first, last = (math.acos(min(max((f - end) / r, -1.0), 1.0)) for end in (0.0, high))
    z = f - r * np.cos(np.linspace(first, last, CHORDS + 1))
    z[0], z[-1] = 0.0, high
    under = r * r - (z - f) ** 2
    arc = e + np.sqrt(np.maximum(under, 0.0))
    line = z / math.tan(alpha) if alpha > 0.0 else np.full(len(z), np.inf)
    # below the point where the slope of the arc is that of the bottom, the bottom bounds the body
    lower = (z < f - r * math.cos(alpha)) if alpha > 0.0 else under < 0.0
    rho = np.maximum(np.where(lower, line if alpha > 0.0 else 0.0, np.minimum(arc, line)), 0.0)
    top = float(rho[-1]) + (h - high) * math.tan(beta)
    points = [(float(a), float(b)) for a, b in zip(rho, z, strict=True)]
    return (*points, (top, h)) if h > high and top > 0.0 else tuple(points)


def check_body(points: Profile, height: float) -> float:
    """Check a profile and return its greatest radius [mm].

    Raises
    ------
    InputError
        The profile does not begin at the tip, goes down, has no radius, or does not end at ``height``.
    """
    heights = [z for _, z in points]
    wide = max((r for r, _ in points), default=0.0)
    if len(points) < 2 or not all(math.isfinite(x) for point in points for x in point):
        raise InputError(f"cutter.body_mm: {len(points)} points: must be at least 2 of finite radius and height")
    if heights[0] != 0.0 or any(b < a for a, b in pairwise(heights)) or heights[-1] <= 0.0:
        raise InputError(f"cutter.body_mm: heights {heights[:4]}: must begin with 0, the tip, and not go down")
    if min(r for r, _ in points) < 0.0 or wide <= 0.0:
        raise InputError("cutter.body_mm: radii: must be at least 0, one of them above 0")
    if abs(heights[-1] - height) > 1e-6:
        raise InputError(
            f"cutter.flute_length_mm = {height:g}: must be {heights[-1]:g}, where body_mm ends; leave it out"
        )
    return wide
