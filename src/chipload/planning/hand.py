"""Side of the material and sense of the spindle for the hand of a cutter.

Notation: immersion phi is counted in the sense of the spindle, see :mod:`chipload.engagement.tooth_engagement`. A
left-hand cutter turns counter-clockwise (M4): its cut is the mirror image of that of a right-hand cutter. In down
milling it has the material on its left.
"""

from __future__ import annotations

import math
from typing import Literal

from chipload.cutter.cutter import Cutter
from chipload.engagement.contact import Engagement
from chipload.errors import InputError
from chipload.machine.machine import Machine

Milling = Literal["up", "down"]


def clockwise_milling(milling: Milling, cutter: Cutter) -> Milling:
    """The milling that has the material on the same side of the path under a clockwise spindle.

    >>> clockwise_milling("down", Cutter(8.0, 3, 0.6, 20.0, 25.0, 5.8e5, left_hand=True))
    'up'
    """
    if not cutter.left_hand:
        return milling
    return "up" if milling == "down" else "down"


def signed_speed(speed: float, cutter: Cutter) -> float:
    """Spindle speed [rad/s] with the sign with which the cutter cuts: below 0 is counter-clockwise (M4)."""
    return -speed if cutter.left_hand else speed


def require_hand(machine: Machine, cutter: Cutter) -> None:
    """Refuse a left-hand cutter on a machine whose spindle does not turn counter-clockwise.

    Raises
    ------
    InputError
        As above.
    """
    if cutter.left_hand and not machine.counter_clockwise:
        raise InputError(
            f"cutter {cutter.number}: left_hand = true: cuts under M4, and machine {machine.name} states "
            "spindle.counter_clockwise = false: choose a right-hand cutter or another machine"
        )


def engagement_of_hand(met: Engagement, cutter: Cutter) -> Engagement:
    """The engagement with phi in the sense in which the cutter turns; ``met`` counts it clockwise."""
    if not cutter.left_hand:
        return met
    used = met.phi[:, :, 1] > met.phi[:, :, 0]
    phi = met.phi.copy()
    phi[used] = math.pi - met.phi[used][:, ::-1]
    return Engagement(met.angle, met.count, phi)
