"""Oracle of a flat mill on a helix into solid material: every slice of every tooth against the paths of all before it.

The frame moves with the axis of the cutter at the rotation t: x along the feed, y to the left, towards the axis of
the helix, which is at (0, A); the spindle turns clockwise. phi immersion from +y, as in ``tooth_paths.py``. The centre
moves on the circle of radius A by c [mm/rad] and falls by w [mm/rad].

A point of the circle of the cutter ahead of it was last left by the cutter when it had gone as far beyond the point,
round the axis of the helix, as it is short of it now. Since then the tip has fallen: the flank cuts from the tip to
there. The whole bottom cuts what the tip falls from tooth to tooth. No code of the package is used.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numba import njit

TAU = 2.0 * math.pi


@njit(cache=True)
def path_on_ray(phi, back, R, c, A):
    """Distance from the axis, along phi, of the path of the tooth that passed ``back`` [rad] before, by Newton."""
    s, k, late = math.sin(phi), math.cos(phi), 0.0
    x = y = 0.0
    for _ in range(50):
        g = c * (late - back) / A
        x = A * math.sin(g) + R * math.sin(phi + late)
        y = A * (1.0 - math.cos(g)) + R * math.cos(phi + late)
        aside = x * k - y * s
        rate = (c * math.cos(g) + R * math.cos(phi + late)) * k - (c * math.sin(g) - R * math.sin(phi + late)) * s
        late -= aside / rate
        if abs(aside) < 1e-13:
            break
    return x * s + y * k


@njit(cache=True)
def fill(R, N, lead, heights, c, w, A, K, turns, F, T):
    """Fill the force on the cutter F (m, 3) and the torque T (m,) at the rotations ``turns``."""
    pitch = TAU / N
    turn = TAU * A / c  # rotation in which the helix goes round once
    dz = w * turn / heights
    for i in range(len(turns)):
        for j in range(N):
            for q in range(heights):
                z = (q + 0.5) * dz
                phi = turns[i] - j * pitch - lead * z
                s, k = math.sin(phi), math.cos(phi)
                if s <= -0.2:
                    continue
                # how far the point is ahead round the axis of the helix
                ahead = abs(math.atan2(R * s, A - R * k))
                if z > w * turn * (1.0 - ahead / math.pi):
                    continue
                inner = 0.0
                for m in range(1, N + 1):
                    inner = max(inner, path_on_ray(phi, m * pitch, R, c, A))
                h = R - inner
                if h <= 0.0:
                    continue
                ft, fr, fa = (K[0] * h + K[3]) * dz, (K[1] * h + K[4]) * dz, (K[2] * h + K[5]) * dz
                F[i, 0] += -fr * s - ft * k
                F[i, 1] += -fr * k + ft * s
                F[i, 2] += -fa
                T[i] += R * ft
            phi = turns[i] - j * pitch
            s, k = math.sin(phi), math.cos(phi)
            h = w * pitch
            ft, fr, fa = (K[0] * h + K[3]) * R, (K[1] * h + K[4]) * R, (K[2] * h + K[5]) * R
            F[i, 0] += -fa * s - ft * k
            F[i, 1] += -fa * k + ft * s
            F[i, 2] += fr
            T[i] += 0.5 * R * ft


@dataclass(frozen=True)
class Helix:
    """A flat mill on a helix of radius A [mm] that falls by ``pitch`` [mm] in a turn; fz [mm] in the plane."""

    D: float
    N: int
    helix: float
    A: float
    pitch: float
    fz: float

    @property
    def fall(self):
        """Fall [mm] of the tip for each mm in the plane."""
        return self.pitch / (TAU * self.A)


def helix_loads(cut: Helix, K, rotations=360, heights=300):
    """Greatest force over all directions, greatest torque, mean torque."""
    F, T = np.zeros((rotations, 3)), np.zeros(rotations)
    c, lead = cut.N * cut.fz / TAU, math.tan(math.radians(cut.helix)) / (cut.D / 2.0)
    turns = TAU * np.arange(rotations) / rotations
    fill(cut.D / 2.0, cut.N, lead, heights, c, c * cut.fall, cut.A, np.array(K[:6], float), turns, F, T)
    return np.array([np.linalg.norm(F, axis=1).max(), T.max(), T.mean()])
