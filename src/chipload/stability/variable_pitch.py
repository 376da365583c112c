"""Teeth that are not evenly spaced: one delay a tooth, the map of a revolution.

Notation: pitch of tooth j, the angle by which it follows the tooth before it; its delay is pitch / Omega. The state is
(r, h r') at the nodes of the longest delay, then q, q'; where a delayed time lies between nodes, r is the cubic Hermite
there. The map is built column by column: for charts of one cutter, not for programs.

Each tooth is taken to cut the same engagement with the same nominal thickness. Straight ahead of the force model,
stability does not depend on that where the coefficients have no exponent.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from chipload.errors import InputError
from chipload.stability._kernels import free_motion
from chipload.stability.cuts import DynamicCuts
from chipload.stability.directional import _kernels as directional
from chipload.stability.pitches import _kernels

#: cells of the map in a wave of the fastest mode
PER_WAVE = 12.0
#: how near to a revolution the pitches must add up [rad]
SUM = 1e-9


def revolution_multiplier(cut: DynamicCuts, pitches: ArrayLike) -> complex:
    """Greatest multiplier of the map of one revolution.

    Parameters
    ----------
    cut : one; its time between two teeth is that of even pitches
    pitches : (N,) float [rad], of each tooth to the one before it; together a revolution

    Raises
    ------
    InputError
        There are more cuts than one, or the pitches do not make a revolution of the cutter's teeth.
    """
    pitch = np.asarray(pitches, dtype=np.float64)
    if len(cut) != 1:
        raise InputError(f"variable pitch: {len(cut)} cuts: must be one")
    teeth = round(math.tau / cut.pitch)
    if pitch.shape != (teeth,) or not (pitch > 0.0).all() or abs(pitch.sum() - math.tau) > SUM:
        raise InputError(
            f"variable pitch: {np.degrees(pitch).round(6).tolist()} deg: must be {teeth} angles above 0 that add up to "
            "360 deg"
        )
    if len(cut.damped):
        raise InputError("variable pitch: with process damping: leave one of them out")
    turn, omega = float(cut.period[0]) * teeth, cut.omega[0]
    cells = max(4 * teeth * 3, math.ceil(PER_WAVE * float(omega.max()) * turn / math.tau))
    h, count = turn / cells, len(omega)
    A = np.zeros((teeth, cells, 3, 4))
    behind = np.concatenate([[0.0], np.cumsum(pitch[1:])])
    for j in range(teeth):
        rows = cut.rows.copy()
        rows[:, 2:4] += behind[j]
        directional.matrices(rows, 0, len(rows), math.tau, cells, cut.exponents, A[j])
    free, push, end = np.empty((4, count)), np.empty((3, 2, count)), np.empty((3, 4, 2))
    free_motion(omega, np.array(cut.damping), cut.U[0], h, free, push, end)
    delay = pitch / math.tau * cells
    nodes = math.ceil(float(delay.max()) - 1e-9)
    n = 4 * nodes + 2 * count
    out = np.zeros((n, n))
    _kernels.revolution(A, delay, nodes, np.ascontiguousarray(cut.U[0]), free, push, end, h, out)
    found = np.linalg.eigvals(out)
    greatest = found[np.argmax(np.abs(found))]
    return complex(greatest.real, abs(greatest.imag))
