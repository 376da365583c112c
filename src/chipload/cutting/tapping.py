"""Torque of a tap that cuts a thread.

Notation: D [mm] nominal diameter, D0 that of the drilled hole, theta = 30 deg half of the thread angle, kc [MPa] the
specific cutting force of tapping, K a factor of the kind of tap:

    T [N m] = tan(theta) kc K (D - D0)^2 (D + 2 D0) / 24000

Reference: [Yamawa2016] p. 781, tables 1 and 2. A job states the tap by its core, the hole: D = D0 + 1.0825 P, P [mm]
the pitch. The kind of tap is not stated: K is between 0.95 (spiral point) and 1.43 (bottoming) for steel.
"""

from __future__ import annotations

import math

from chipload.cutter.bodies import MINOR

#: middle of K for spiral flutes in steel, and the standard deviation that its range and kc leave
FACTOR, SPREAD = 1.15, 0.25


def tap_torque(hole: float, pitch: float, kc: float) -> float:
    """Return the torque [N m] of a tap with the thread in full cut.

    Parameters
    ----------
    hole : diameter [mm]
    pitch : of the thread [mm]
    kc : specific cutting force of tapping [MPa]

    Examples
    --------
    M10 x 1.5 in C45, 3900 MPa:

    >>> round(tap_torque(10.0 - 1.5 * MINOR, 1.5, 3900.0), 2)
    7.61
    """
    depth = MINOR * pitch
    return math.tan(math.radians(30.0)) * kc * FACTOR * depth**2 * (3.0 * hole + depth) / 24000.0
