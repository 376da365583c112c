"""Deflections that only a feed per tooth that is too small brings beyond the rigid model: the edge rubs."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from chipload.cutter.cutter import Cutter
from chipload.cutting.material import Material
from chipload.result import LimitCheck
from chipload.result.limits import Columns
from chipload.simulation.loads import Floats, Ints

#: an axis that changes by less from step to step does not turn
UPRIGHT = 1e-9
#: a feed that would have to be raised by more is not the cause of a deflection
MOST_FEED = 1e4


def spindle_speed(columns: Columns) -> Floats:
    """Speed of the spindle [rad/s] of the steps that cut, their power over their torque; 0: the step does not cut."""
    power, torque = np.asarray(columns["power_w"]), np.asarray(columns["torque_mean_nm"])
    speed: Floats = np.divide(power, torque, out=np.zeros(len(torque)), where=torque > 0.0)
    return speed


def over_feed(columns: Columns, tool: Ints, cutters: Mapping[int, Cutter]) -> Floats:
    """The deflection over the feed per tooth; inf where that is not known, or the axis turns.

    The share of the model's range is the greater of this and of the deflection over the radial depth: of a film, whose
    depth is nearly zero, it says nothing about the feed.
    """
    out = np.full(len(tool), math.inf)
    bent = next((c for c in ("deflection_um", "deflection_cutter_um") if c in columns), "")
    if not bent or not {"feed_mm_min", "power_w", "torque_mean_nm"} <= set(columns):
        return out
    speed = spindle_speed(columns)
    numbers, of = np.unique(tool, return_inverse=True)
    teeth = np.array([cutters[n].flutes if n in cutters else 0 for n in numbers.tolist()])[of]
    delta = np.asarray(columns[bent]) / 1000.0
    # feed per tooth [mm]: mm/min over 60 s, over the teeth that pass in a second
    passing = 60.0 / math.tau * speed * teeth
    feed = np.divide(columns["feed_mm_min"], passing, out=np.zeros(len(tool)), where=passing > 0.0)
    np.divide(delta, feed, out=out, where=feed > 0.0)
    for name in ("axis_x", "axis_y", "axis_z"):
        if name in columns:
            axis = np.asarray(columns[name])
            out[np.abs(np.diff(axis, prepend=axis[:1])) > UPRIGHT] = math.inf
    return out


def rubbing_text(
    check: LimitCheck, material: Material, of_feed: float, cutters: Mapping[int, Cutter], columns: Columns
) -> str | None:
    """Why the deflection is above the range of the model where the feed per tooth is too small for the force of the
    edge, and the feed with which it is not; None: a greater feed does not help.

    The deflection follows the force of the greatest chip h, F(h) = |Kc h^(1 - m) + Ke|; at x times the feed the share
    is that of now times F(x h) / (x F(h)), which falls with x to that of a force without an edge; twice the resolution
    error is added.
    """
    k, share = check.row, check.worst
    if k is None or share is None or "chip_max_mm" not in columns or "tool" not in columns:
        return None
    thick, number = float(columns["chip_max_mm"][k]), int(columns["tool"][k])
    over = float(over_feed(columns, np.asarray(columns["tool"]), cutters)[k]) / of_feed
    if thick <= 0.0 or number not in cutters or abs(over - share) > 0.01 * share:
        return None
    kc, ke = (np.array([getattr(material, f"K{x}{what}") for x in "tra"]) for what in "ce")

    def share_at(x: float) -> float:
        force, now = (
            float(np.linalg.norm(kc * h ** (1.0 - np.array(material.exponents)) + ke)) for h in (x * thick, thick)
        )
        return (1.0 + 2.0 * check.error) * share * force / (x * now)

    low, high = 1.0, MOST_FEED
    if share_at(high) > 1.0:
        return None
    while high - low > 1e-3 * low:
        middle = math.sqrt(low * high)
        low, high = (middle, high) if share_at(middle) > 1.0 else (low, middle)
    feed = float(columns["feed_mm_min"][k])
    rpm = 60.0 / math.tau * float(columns["power_w"][k]) / float(columns["torque_mean_nm"][k])
    tooth = feed / (rpm * cutters[number].flutes)
    least, most = _two_digits(high * feed, True), _two_digits(rpm / high, False)
    return (
        f"the edge rubs at a feed per tooth of {tooth:.2g} mm: its force bends the cutter by more than {of_feed:g} "
        f"times that, so the loads are not known: raise the feed from {feed:.4g} to at least {least:g} "
        f"mm/min, or lower the spindle speed from {rpm:.5g} to at most {most:g} 1/min"
    )


def _two_digits(value: float, up: bool) -> float:
    """Two digits of a value, rounded up or down.

    >>> _two_digits(231.2, True), _two_digits(0.0911, True), _two_digits(231.2, False), _two_digits(0.0911, False)
    (240.0, 0.092, 230.0, 0.091)
    """
    unit = 10.0 ** (math.floor(math.log10(value)) - 1)
    count = math.ceil(value / unit * (1.0 - 1e-9)) if up else math.floor(value / unit * (1.0 + 1e-9))
    return float(f"{count * unit:.2g}")
