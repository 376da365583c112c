"""Unit conversions at the interfaces: inside chipload a length is in mm, a time in s, a force in N, an angle in rad."""

from __future__ import annotations

import math

#: millimetres in one unit of a drawing
MM_PER = {"um": 1e-3, "mm": 1.0, "cm": 10.0, "m": 1000.0, "inch": 25.4, "foot": 304.8}


def mm_s_from_mm_min(feed_mm_min: float) -> float:
    """Feed in mm/s from mm/min.

    >>> mm_s_from_mm_min(600.0)
    10.0
    """
    return feed_mm_min / 60.0


def mm_min_from_mm_s(feed_mm_s: float) -> float:
    """Feed in mm/min from mm/s."""
    return feed_mm_s * 60.0


def rad_s_from_rpm(speed_rpm: float) -> float:
    """Angular speed in rad/s from revolutions per minute."""
    return speed_rpm * math.tau / 60.0


def rpm_from_rad_s(speed_rad_s: float) -> float:
    """Revolutions per minute from rad/s."""
    return speed_rad_s * 60.0 / math.tau
