"""Arcs from the words of a block: centre and turns in the plane of the arc.

Notation: (a0, b0) start, (a1, b1) end, (ca, cb) centre [mm] in the first and second coordinate of the plane; r0, r1
distances of start and end from the centre; e = |r0 - r1|.

A centre is accepted where r0, r1 > 0.00127 mm (0.00005 inch for a text in inches) and e <= E, or e <= 100 E and
e <= 0.001 max(r0, r1), with E = 0.02 sqrt(2) mm (0.002 sqrt(2) inch). A radius may be shorter than half the chord by
0.00127 mm (0.00005 inch): the arc is then half a turn about the middle of the chord.

Reference: LinuxCNC 2.9, "G2, G3 Arc Move"; the numbers are those that its interpreter was observed to accept.
"""

from __future__ import annotations

import math

from chipload.errors import InputError

#: least radius, and how far a radius may fall short of half the chord [units of the text]
LEAST = {False: 0.00127, True: 0.00005}
#: E above [units of the text]
SKEW = {False: 0.02 * math.sqrt(2.0), True: 0.002 * math.sqrt(2.0)}
_SLACK = 1e-12


def check_centre(a0: float, b0: float, a1: float, b1: float, ca: float, cb: float, inch: bool) -> None:
    """Refuse an arc whose centre does not fit its ends."""
    scale = 25.4 if inch else 1.0
    r0, r1 = math.hypot(a0 - ca, b0 - cb), math.hypot(a1 - ca, b1 - cb)
    least = scale * LEAST[inch]
    if r0 < least or r1 < least:
        raise InputError(f"arc of radius {min(r0, r1):.6g} mm: must be {least:g} mm or more")
    error, skew = abs(r0 - r1), scale * SKEW[inch]
    if error > 100.0 * skew + _SLACK or (error > skew + _SLACK and error > 1e-3 * max(r0, r1) + _SLACK):
        raise InputError(
            f"arc that starts {r0:.6g} mm from its centre and ends {r1:.6g} mm from it: must agree within "
            f"{skew:.4g} mm or 0.1 %: correct its centre or its end"
        )


def centre_from_radius(
    a0: float, b0: float, a1: float, b1: float, radius: float, left: bool, inch: bool
) -> tuple[float, float]:
    """Centre of an arc of a radius [mm], negative for more than half a turn; ``left``: counter-clockwise.

    >>> centre_from_radius(0.0, 0.0, 2.0, 0.0, 1.0, True, False)
    (1.0, 0.0)
    """
    chord = math.hypot(a1 - a0, b1 - b0)
    if chord == 0.0:
        raise InputError("arc by radius that ends where it starts: give its centre by I, J, K")
    half, r = 0.5 * chord, abs(radius)
    slack = (25.4 if inch else 1.0) * LEAST[inch]
    if half > r + slack + _SLACK:
        raise InputError(f"arc of radius {r:.6g} mm over a chord of {chord:.6g} mm: must be {half:.6g} mm or more")
    height = math.sqrt(max(0.0, (r - half) * (r + half)))
    if left != (radius < 0.0):
        height = -height
    # the centre lies right of the chord (a0, b0) -> (a1, b1) for a positive height
    ua, ub = (a1 - a0) / chord, (b1 - b0) / chord
    return 0.5 * (a0 + a1) + height * ub + 0.0, 0.5 * (b0 + b1) - height * ua + 0.0


def length(a0: float, b0: float, a1: float, b1: float, ca: float, cb: float, turns: int, rise: float) -> float:
    """Length of a helix [mm]; the radius is that of its start.

    >>> round(length(1.0, 0.0, -1.0, 0.0, 0.0, 0.0, 1, 0.0), 6)
    3.141593
    """
    angle = math.atan2(b1 - cb, a1 - ca) - math.atan2(b0 - cb, a0 - ca)
    if turns < 0:
        angle = -angle
    if angle <= 1e-12:
        angle += math.tau
    angle += math.tau * (abs(turns) - 1)
    return math.hypot(angle * math.hypot(a0 - ca, b0 - cb), rise)
