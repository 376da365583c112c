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
    """A steady cut, straight along the feed, by a flat, ball, bull-nose, tapered or barrel mill.

    ``corner`` radius of the corner circle, which touches the bottom and the flank; ``taper`` [deg] of the flank, which
    has the diameter D at the height of the tip; ``barrel`` radius of an arc between corner and flank, which touches
    both; its corner circle has its centre ``hub`` from the axis. [mm]
    """

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
    corner: float = 0.0
    taper: float = 0.0
    barrel: float = 0.0
    hub: float = 0.0

    @property
    def arcs(self):
        """Arcs of the profile from the bottom up (centre, radius, angles from and to), and where the flank begins."""
        R, r, a = self.D / 2.0, self.D / 2.0 if self.ball else self.corner, math.radians(self.taper)
        last = math.pi / 2.0 - a
        if not self.barrel:
            e = R + r * math.tan(a) - r / math.cos(a)
            return [(e, r, r, 0.0, last)] if r else [], (e + r * math.cos(a), r - r * math.sin(a))
        # the centre (E, F): barrel from the flank, E = R + F tan(a) - barrel / cos(a), and barrel - r from the corner
        B, b, t = self.barrel, R - self.barrel / math.cos(a) - self.hub, math.tan(a)
        p, q, w = 1.0 + t * t, b * t - r, b * b + r * r - (B - r) ** 2
        F = (-q + math.sqrt(q * q - p * w)) / p
        E = R + F * t - B / math.cos(a)
        first = math.atan2(self.hub - E, F - r)
        return [(self.hub, r, r, 0.0, first), (E, F, B, first, last)], (E + B * math.cos(a), F - B * math.sin(a))

    def radius_at(self, z):
        """Radius [mm] of the profile at a height above the tip."""
        arcs, (rho, high) = self.arcs
        for e, f, r, _, last in arcs:
            if z <= f - r * math.cos(last):
                return e + math.sqrt(max(r * r - (f - z) ** 2, 0.0))
        return rho + (z - high) * math.tan(math.radians(self.taper))

    @property
    def pitches(self):
        return np.radians(self.pitch) if self.pitch else np.full(self.N, TAU / self.N)

    @property
    def arc(self):
        """Engaged arc of the whole radius [rad]."""
        w = math.acos(1.0 - 2.0 * self.ae / self.D)
        return (0.0, w) if self.up else (math.pi - w, math.pi)

    def slices(self, count):
        """Rows (k, 5) of :func:`loads`, about ``count`` of them."""
        lead, out = math.tan(math.radians(self.helix)) / (self.D / 2.0), []
        arcs, (rho, high) = self.arcs
        for e, f, r, first, last in arcs:
            top = min(last, math.acos(max(min((f - self.ap) / r, 1.0), -1.0)))
            if top > first:
                n = count if len(arcs) == 1 and self.ap <= high else max(count // 3, 1)
                k = first + (np.arange(n) + 0.5) * (top - first) / n
                width = np.full(n, r * (top - first) / n)
                out.append([e + r * np.sin(k), np.sin(k), np.cos(k), lead * (f - r * np.cos(k)), width])
        if self.ap > high:
            a = math.radians(self.taper)
            z = high + (np.arange(count) + 0.5) * (self.ap - high) / count
            ones = np.ones(count)
            width = ones * (self.ap - high) / count / math.cos(a)
            out.append([rho + (z - high) * math.tan(a), ones * math.cos(a), ones * math.sin(a), lead * z, width])
        return np.concatenate(out, axis=1).T.copy()


def true_loads(cut: Cut, K, rotations=360, slices=None):
    """Greatest force over all directions, greatest torque, mean torque, thickest chip."""
    R = cut.D / 2.0
    if slices is None:
        lag = math.tan(math.radians(cut.helix)) / R * cut.ap
        slices = int(min(max(400 * lag / math.acos(max(1.0 - cut.ae / R, -1.0)), 200), 6000))
    wall = R - cut.ae
    low, high = (wall, 10.0 * R) if cut.up else (-10.0 * R, -wall)
    table = cut.slices(slices)
    # a slice that does not reach the material has no load
    table = table[table[:, 0] + cut.e > wall]
    F, T, H = np.zeros((rotations, 3)), np.zeros(rotations), np.zeros(rotations)
    turns = TAU * np.arange(rotations) / rotations
    c = cut.N * cut.fz / TAU
    loads(table, cut.pitches, c, cut.e, cut.lam, low, high, np.array(K[:6], float), turns, F, T, H)
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
