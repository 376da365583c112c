"""Oracle of chips and forces: every slice of every tooth against the true paths of all earlier teeth.

The feed goes along +x, the spindle turns clockwise; phi immersion from +y, so that the tooth at phi lies in
(sin(phi), cos(phi)) and pi/2 is ahead. The time is the rotation, and c [mm/rad] the feed. A tooth of the radius r lies
at (c t + r sin(phi), r cos(phi)), phi = t - a - psi. On the ray from the axis through its tip the place of the path of
an earlier tooth is found by Newton's method; the chip is what lies between the farthest of them and the tip, in the
stock low < y < high. No code of the package is used but the coefficients of a force.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numba import njit

TAU = 2.0 * math.pi


@njit(cache=True)
def path_on_ray(phi, back, r, c):
    """Distance from the axis of the path of a tooth of radius r that passed ``back`` [rad] before, along phi."""
    s = math.sin(phi)
    k = math.cos(phi)
    late = 0.0
    for _ in range(50):
        x = c * (late - back) + r * math.sin(phi + late)
        y = r * math.cos(phi + late)
        aside = x * k - y * s
        rate = (c + r * math.cos(phi + late)) * k + r * math.sin(phi + late) * s
        late -= aside / rate
        if abs(aside) < 1e-13:
            break
    return (c * (late - back) + r * math.sin(phi + late)) * s + r * math.cos(phi + late) * k


@njit(cache=True)
def loads(slices, pitch, c, e, lam, low, high, K, turns, F, T, H):
    """Fill force x, y, z (m, 3) on the cutter, torque (m,) and thickest chip (m,) at the rotations ``turns`` (m,).

    slices (k, 5): rho, sin(kappa), cos(kappa), lag, length along the profile.
    """
    N = len(pitch)
    lag = np.zeros(N)
    for j in range(1, N):
        lag[j] = lag[j - 1] + pitch[j]
    for i in range(len(turns)):
        for j in range(N):
            for q in range(len(slices)):
                rho, sk, ck, psi, ds = slices[q]
                phi = turns[i] - lag[j] - psi
                u = math.sin(phi)
                v = math.cos(phi)
                tip = rho + e * math.cos(lam - lag[j] - psi)
                if not low < tip * v < high:
                    continue
                inner = 0.0
                if low > 0.0:
                    inner = low / v
                elif high < 0.0:
                    inner = high / v
                back = 0.0
                for m in range(1, N + 2):
                    back += pitch[(j - m + 1) % N]
                    r = rho + e * math.cos(lam - lag[(j - m) % N] - psi)
                    inner = max(inner, path_on_ray(phi, back, r, c))
                h = (tip - inner) * sk
                if h <= 0.0:
                    continue
                H[i] = max(H[i], h)
                ft = (K[0] * h + K[3]) * ds
                fr = (K[1] * h + K[4]) * ds
                fa = (K[2] * h + K[5]) * ds
                out = -(fr * sk + fa * ck)
                F[i, 0] += out * u - ft * v
                F[i, 1] += out * v + ft * u
                F[i, 2] += fr * ck - fa * sk
                T[i] += rho * ft


@dataclass(frozen=True)
class Cut:
    """A steady cut by a flat or a ball end mill, straight along the feed."""

    D: float
    N: int
    helix: float
    ap: float
    ae: float
    fz: float
    up: bool = True
    e: float = 0.0
    lam: float = 0.0
    pitch: tuple[float, ...] = ()
    ball: bool = False

    @property
    def pitches(self):
        return np.radians(self.pitch) if self.pitch else np.full(self.N, TAU / self.N)

    @property
    def arc(self):
        """Engaged arc of the whole radius [rad]."""
        w = math.acos(1.0 - 2.0 * self.ae / self.D)
        return (0.0, w) if self.up else (math.pi - w, math.pi)

    def slices(self, count):
        R, lead = self.D / 2.0, math.tan(math.radians(self.helix)) / (self.D / 2.0)
        if self.ball:
            top = math.acos(1.0 - self.ap / R)
            kappa = (np.arange(count) + 0.5) * top / count
            z = R * (1.0 - np.cos(kappa))
            return np.column_stack(
                [R * np.sin(kappa), np.sin(kappa), np.cos(kappa), lead * z, np.full(count, R * top / count)]
            )
        z = (np.arange(count) + 0.5) * self.ap / count
        return np.column_stack(
            [np.full(count, R), np.ones(count), np.zeros(count), lead * z, np.full(count, self.ap / count)]
        )


def true_loads(cut: Cut, K, rotations=360, slices=None):
    """Greatest force over all directions, greatest torque, mean torque, thickest chip."""
    R = cut.D / 2.0
    if slices is None:
        lag = math.tan(math.radians(cut.helix)) / R * cut.ap
        slices = int(min(max(400 * lag / math.acos(max(1.0 - cut.ae / R, -1.0)), 200), 6000))
    wall = R - cut.ae
    low, high = (wall, 10.0 * R) if cut.up else (-10.0 * R, -wall)
    F, T, H = np.zeros((rotations, 3)), np.zeros(rotations), np.zeros(rotations)
    turns = TAU * np.arange(rotations) / rotations
    c = cut.N * cut.fz / TAU
    loads(cut.slices(slices), cut.pitches, c, cut.e, cut.lam, low, high, np.array(K[:6], float), turns, F, T, H)
    return np.array([np.linalg.norm(F, axis=1).max(), T.max(), T.mean(), H.max()])


def greatest_wall_error(cut: Cut, K, overhang, modulus, heights=200, slices=400):
    """Greatest form error [mm] of the wall of a straight cut by a bar of ``overhang`` [mm] clamped at its upper end.

    Every height of the wall at the moment when its edge passes there, under what every slice of every tooth cuts then.
    The bar has 0.8 of the diameter up to 2 mm above the cut, and the whole diameter above it.
    """
    R, lead = cut.D / 2.0, math.tan(math.radians(cut.helix)) / (cut.D / 2.0)
    wall = R - cut.ae
    low, high = (wall, 10.0 * R) if cut.up else (-10.0 * R, -wall)
    table = cut.slices(slices)
    at = table[:, 3] / lead
    flutes = cut.ap + 2.0
    worst = 0.0
    for z in np.linspace(0.0, cut.ap, heights):
        # integral of the two levers over the bar, by the cubic between its ends
        top, d = np.maximum(at, z), np.abs(at - z)
        gives = np.zeros(slices)
        for a, b, width in ((top, flutes, 0.8 * cut.D), (np.full(slices, flutes), overhang, cut.D)):
            u, v = a - top, b - top
            gives += ((v**3 - u**3) / 3.0 + d * (v**2 - u**2) / 2.0) * 64.0 / (modulus * math.pi * width**4)
        bent = table.copy()
        bent[:, 4] *= gives
        inside = 1e-6 if cut.up else math.pi - 1e-6
        F, T, H = np.zeros((1, 3)), np.zeros(1), np.zeros(1)
        c = cut.N * cut.fz / TAU
        loads(bent, cut.pitches, c, 0.0, 0.0, low, high, np.array(K[:6], float), np.array([inside + lead * z]), F, T, H)
        away = -F[0, 1] if cut.up else F[0, 1]
        worst = away if abs(away) > abs(worst) else worst
    return worst
