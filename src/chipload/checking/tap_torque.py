"""Torque of taps against the torque of the spindle."""

from __future__ import annotations

import math
from collections.abc import Mapping
from statistics import NormalDist

import numpy as np

from chipload.cutter.cutter import Cutter
from chipload.cutting.material import Material
from chipload.cutting.tapping import SPREAD, tap_torque
from chipload.errors import Finding, Severity
from chipload.machine.machine import Machine
from chipload.number_text import number_text
from chipload.program.program import Program
from chipload.program.tapping import tapping_motions

#: one-sided, at which the torque of a tap is compared
CONFIDENCE = 0.95


def tap_torques(
    program: Program, cutters: Mapping[int, Cutter], material: Material, machine: Machine
) -> tuple[Finding, ...]:
    """Return a finding ``tap-torque`` for each tap: a note where the spindle has its torque at 95 %, else unproven, or
    exceeds where it has not even the nominal one.

    Taps whose pitch, material or spindle torque is not known have none.
    """
    found, out = tapping_motions(program), dict[int, Finding]()
    for row in found.rows.tolist():
        number = int(program.tool[row])
        cutter = cutters.get(number)
        if number in out or cutter is None or cutter.thread_pitch is None or cutter.shape or material.tap_kc is None:
            continue
        available = float(machine.torque_at(np.array([program.spindle[row]]))[0]) / 1e3
        if not math.isfinite(available):
            continue
        nominal = tap_torque(cutter.diameter, cutter.thread_pitch, material.tap_kc)
        most = nominal * math.exp(NormalDist().inv_cdf(CONFIDENCE) * SPREAD)
        severity = Severity.NOTE
        if most > available:
            severity = Severity.EXCEEDS if nominal > available else Severity.UNPROVEN
        text = (
            f"tool {number} taps with about {number_text(nominal, 2)} N m, at 95 % {number_text(most, 2)} N m, by its "
            f"pitch and {material.name}; the spindle has {number_text(available, 3)} N m at this speed"
        )
        x, y, z = (float(v) for v in program.p_work[row])
        out[number] = Finding("tap-torque", int(program.line[row]), text, severity, (x, y, z))
    return tuple(out.values())
