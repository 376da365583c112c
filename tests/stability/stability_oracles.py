"""Other ways to the same multipliers: collocation, semi-discretisation, many frequencies, a simulation in time.

Straight teeth, evenly spaced, one engaged arc st .. ex; T, n as everywhere; K the tangential and radial coefficients.
"""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
from numba import njit

from chipload.cutter.cutter import Cutter
from chipload.cutting.material import Material
from chipload.engagement.tooth_engagement import engagement_of_arcs
from chipload.stability.cuts import dynamic_cuts
from chipload.stability.modes import Modes

TAU = 2.0 * math.pi
KT, KR = 700.0, 210.0
METAL = Material("plain", KT, KR, 0.0, 0.0, 0.0, 0.0, source="made up for tests")
ONE = Modes([650.0], [0.02], [5000.0], [[0.0, 1.0]])
TWO = Modes([650.0, 720.0], [0.02, 0.025], [5000.0, 7000.0], [[1.0, 0.0], [0.0, 1.0]])


def down(ae_share):
    """Engaged arc of down milling with a share of the diameter."""
    return math.pi - math.acos(1.0 - 2.0 * ae_share), math.pi


def mill(teeth=3, helix=0.0, length=60.0):
    return Cutter(10.0, teeth, math.radians(helix), length, length + 20.0, 6e5)


def cut_of(modes, rpm, depth, arc, *, teeth=3, helix=0.0, metal=METAL, T=(1.0, 0.0), n=(0.0, 1.0), feed=0.05,
           process=None):  # fmt: skip
    cutter = mill(teeth, helix)
    met = engagement_of_arcs([arc[0]], [arc[1]], feed, cutter, depth)
    return dynamic_cuts(met, cutter, metal, modes, rpm * TAU / 60.0, [T], [n], process)


def with_pitches(cut, pitches):
    """The cut by teeth that are not evenly spaced."""
    return replace(cut, pitches=tuple(pitches))


def shapes(modes):
    """w, z, U (2, M) with T = x and n = y."""
    w = modes.omega
    return w, np.array(modes.damping), modes.direction.T * w / np.sqrt(modes.stiffness)


def matrix(theta, teeth, arc, depth, kt=KT, kr=KR):
    out = np.zeros((2, 2))
    for j in range(teeth):
        phi = (theta + j * TAU / teeth) % TAU
        if arc[0] < phi < arc[1]:
            s, c = math.sin(phi), math.cos(phi)
            out -= depth * np.outer([kt * c + kr * s, kr * c - kt * s], [s, c])
    return out


def collocation(modes, rpm, depth, arc, teeth=3, n=24, rubbing=0.0, friction=0.0):
    """Multiplier by Chebyshev collocation on the smooth pieces of a tooth period; ``rubbing`` C_p [N s/mm^2]."""
    w, z, U = shapes(modes)
    period, pitch, M = 60.0 / (teeth * rpm), TAU / teeth, len(w)
    L = np.block([[np.zeros((M, M)), np.eye(M)], [-np.diag(w**2), -np.diag(2 * z * w)]])
    ends = sorted({0.0, pitch, *(e % pitch for e in arc if 1e-9 < e % pitch < pitch - 1e-9)})
    k = np.arange(n + 1)
    x = -np.cos(np.pi * k / n)
    c = np.where((k == 0) | (k == n), 2.0, 1.0) * (-1.0) ** k
    D = np.outer(c, 1 / c) / (x[:, None] - x[None, :] + np.eye(n + 1))
    D -= np.diag(D.sum(1))
    S, size = 2 * M, (len(ends) - 1) * (n + 1) * 2 * M
    left, right = np.zeros((size, size)), np.zeros((size, size))
    for g, (a, b) in enumerate(pairwise(ends)):
        at, dt = g * (n + 1) * S, (b - a) / pitch * period
        left[at : at + S, at : at + S] = np.eye(S)
        if g == 0:
            right[at : at + S, size - S :] = np.eye(S)
        else:
            left[at : at + S, at - S : at] = -np.eye(S)
        for i in range(1, n + 1):
            r = slice(at + i * S, at + (i + 1) * S)
            theta = a + (b - a) * (0.5 * (x[i] + 1) if i < n else 1.0 - 1e-12)
            B = np.zeros((S, S))
            B[M:, :M] = U.T @ matrix(theta, teeth, arc, depth) @ U
            V = np.zeros((S, S))
            V[M:, M:] = U.T @ matrix(theta, teeth, arc, depth, friction * rubbing, rubbing) @ U
            for j in range(n + 1):
                left[r, at + j * S : at + (j + 1) * S] += D[i, j] * 2 / dt * np.eye(S)
            left[r, r] -= L + B + V
            right[r, r] -= B
    return np.abs(np.linalg.eigvals(np.linalg.solve(left, right))).max()


def semi_discretisation(modes, rpm, depth, arc, teeth=3, m=200):
    """Multiplier by semi-discretisation of first order [Insperger2004]: the delayed term is the mean of two nodes."""
    from scipy.linalg import expm

    w, z, U = shapes(modes)
    period, M = 60.0 / (teeth * rpm), len(w)
    h = period / m
    size = 2 * M + M * m
    P = np.eye(size)
    for i in range(m):
        fine = [matrix(TAU / teeth * (i + s) / m, teeth, arc, depth) for s in (np.arange(8) + 0.5) / 8]
        B = U.T @ np.mean(fine, axis=0) @ U
        L = np.block([[np.zeros((M, M)), np.eye(M)], [-np.diag(w**2) + B, -np.diag(2 * z * w)]])
        step = expm(h * np.block([[L, np.vstack([np.zeros((M, M)), -B])], [np.zeros((M, 3 * M))]]))
        G = np.zeros((size, size))
        G[: 2 * M, : 2 * M] = step[: 2 * M, : 2 * M]
        G[: 2 * M, size - 2 * M : size - M] += 0.5 * step[: 2 * M, 2 * M :]
        G[: 2 * M, size - M :] += 0.5 * step[: 2 * M, 2 * M :]
        G[2 * M : 3 * M, :M] = np.eye(M)
        G[3 * M :, 2 * M : size - M] = np.eye(size - 3 * M)
        P = G @ P
    return np.abs(np.linalg.eigvals(P)).max()


def many_frequencies(modes, rpm, depth, arc, gain, teeth=3, H=16):
    """det(I - gain (1 - e^(-i w tau)) A G) at w = half the tooth frequency [Budak1998]: 0 where a flip begins."""
    w, z, U = shapes(modes)
    base = TAU * teeth * rpm / 60.0
    k = np.arange(-H, H + 1)

    def fourier(n):
        phi, weight = np.polynomial.legendre.leggauss(400)
        phi = arc[0] + (arc[1] - arc[0]) * (phi + 1) / 2
        weight = weight * (arc[1] - arc[0]) / 2
        s, c = np.sin(phi), np.cos(phi)
        A = -depth * np.array(
            [[(KT * c + KR * s) * s, (KT * c + KR * s) * c], [(KR * c - KT * s) * s, (KR * c - KT * s) * c]]
        )
        return teeth / TAU * (A * weight * np.exp(-1j * n * teeth * phi)).sum(axis=2)

    A = {n: fourier(n) for n in range(-2 * H, 2 * H + 1)}
    omega = 0.5 * base + k * base
    share = 1.0 / (w**2 - omega[:, None] ** 2 + 2j * z * w * omega[:, None])
    G = np.einsum("ak,wk,bk->wab", U, share, U)
    full = np.block([[A[a - b] @ G[b + H] for b in k] for a in k])
    return np.linalg.det(np.eye(len(full)) - gain * 2.0 * full)


@njit(cache=True)
def in_time(periods, steps, teeth, st, ex, depth, kt, kr, w, z, U, rpm):
    """Growth per tooth period of a free motion: the chip from where the teeth are now and were a period ago, the force
    constant over a step; the mean over the second half of the periods.
    """
    M = len(w)
    dt = 60.0 / (rpm * teeth) / steps
    q = np.ones(M) * 1e-3
    v = np.zeros(M)
    for k in range(M):
        v[k] = (k + 1.0) * w[k] * 1e-3
    old = np.zeros((2, steps))
    now = np.zeros((2, steps))
    size = np.zeros(periods)
    scale = 0.0
    for p in range(periods):
        energy = 0.0
        for i in range(steps):
            x = 0.0
            y = 0.0
            for k in range(M):
                x += U[0, k] * q[k]
                y += U[1, k] * q[k]
            now[0, i] = x
            now[1, i] = y
            ft = 0.0
            fn = 0.0
            for j in range(teeth):
                phi = ((i + 0.5) / steps + j) * TAU / teeth
                if st < phi < ex:
                    s = math.sin(phi)
                    c = math.cos(phi)
                    h = s * (x - old[0, i]) + c * (y - old[1, i])
                    ft -= depth * h * (kt * c + kr * s)
                    fn -= depth * h * (kr * c - kt * s)
            for k in range(M):
                f = (U[0, k] * ft + U[1, k] * fn) / w[k] ** 2
                wd = w[k] * math.sqrt(1 - z[k] ** 2)
                e = math.exp(-z[k] * w[k] * dt)
                c = math.cos(wd * dt)
                s = math.sin(wd * dt)
                a = q[k] - f
                q[k] = f + e * (a * (c + z[k] * w[k] / wd * s) + v[k] * s / wd)
                v[k] = e * (v[k] * (c - z[k] * w[k] / wd * s) - a * w[k] ** 2 / wd * s)
                energy += q[k] ** 2 * w[k] ** 2 + v[k] ** 2
        old[:] = now
        size[p] = 0.5 * math.log(energy) + scale
        # kept near 1, so that nothing overflows
        shrink = 1.0 / math.sqrt(energy)
        scale -= math.log(shrink)
        q *= shrink
        v *= shrink
        old *= shrink
    half = periods // 2
    # the slope of the line through the second half
    t = np.arange(periods - half) - 0.5 * (periods - half - 1)
    return (t * size[half:]).sum() / (t * t).sum()


@njit(cache=True)
def with_loss_of_contact(periods, steps, teeth, st, ex, depth, feed, kt, kr, w, z, U, rpm):
    """Greatest displacement (periods,) [mm] in each tooth period of a cut whose teeth leave the material where the chip
    would be below 0, and the share of engaged moments without contact. Each tooth meets the surface that the last one
    to cut there left.
    """
    M = len(w)
    dt = 60.0 / (rpm * teeth) / steps
    q = np.zeros(M)
    v = np.zeros(M)
    surface = np.zeros((teeth, steps))
    size = np.zeros(periods)
    off = 0
    engaged = 0
    for p in range(periods):
        for i in range(steps):
            x = 0.0
            y = 0.0
            for k in range(M):
                x += U[0, k] * q[k]
                y += U[1, k] * q[k]
            size[p] = max(size[p], math.hypot(x, y))
            ft = 0.0
            fn = 0.0
            for j in range(teeth):
                phi = ((i + 0.5) / steps + j) * TAU / teeth
                if st < phi < ex:
                    s = math.sin(phi)
                    c = math.cos(phi)
                    h = feed * s + s * x + c * y - surface[j, i]
                    engaged += 1
                    if h > 0.0:
                        ft -= depth * h * (kt * c + kr * s)
                        fn -= depth * h * (kr * c - kt * s)
                        surface[j, i] = s * x + c * y
                    else:
                        off += 1
                        surface[j, i] -= feed * s
            for k in range(M):
                f = (U[0, k] * ft + U[1, k] * fn) / w[k] ** 2
                wd = w[k] * math.sqrt(1 - z[k] ** 2)
                e = math.exp(-z[k] * w[k] * dt)
                c = math.cos(wd * dt)
                s = math.sin(wd * dt)
                a = q[k] - f
                q[k] = f + e * (a * (c + z[k] * w[k] / wd * s) + v[k] * s / wd)
                v[k] = e * (v[k] * (c - z[k] * w[k] / wd * s) - a * w[k] ** 2 / wd * s)
    return size, off / engaged


#: engaged arcs of down milling: a slot, half, a twentieth of the diameter
SLOT, HALF, THIN = down(1.0), down(0.5), down(0.05)


@njit(cache=True)
def in_time_by_teeth(turns, steps, radii, st, ex, lag, sine, cosine, length, feed, kt, kr, ka, w, z, U, rpm):
    """Growth per revolution of a free motion in three directions, by discs of the edge and teeth with runout.

    A disc has the outward normal sine u - cosine A, lags behind the tip and cuts from ``st`` to ``ex``. At each step
    and tooth the surface below is that of the tooth that left least: the nominal chip of m feeds and radii decides
    which, the motion of both how it changes.
    """
    N, M, K = len(radii), len(w), len(sine)
    dt = 60.0 / (rpm * N) / steps
    ring = N * steps
    past = np.zeros((3, ring))
    q = np.ones(M) * 1e-3
    v = w * 1e-3
    size = np.zeros(turns)
    scale = 0.0
    r = np.zeros(3)
    f = np.zeros(3)
    for p in range(turns):
        for i in range(ring):
            for a in range(3):
                r[a] = (U[a] * q).sum()
            f[:] = 0.0
            for j in range(N):
                for k in range(K):
                    phi = (((i + 0.5) / steps - j) * TAU / N - lag[k] - st[k]) % TAU + st[k]
                    if phi >= ex[k]:
                        continue
                    s = math.sin(phi)
                    c = math.cos(phi)
                    least = 1e300
                    m = 0
                    for before in range(1, N + 1):
                        h = sine[k] * (before * feed * s + radii[j] - radii[(j - before) % N])
                        if h < least:
                            least = h
                            m = before
                    if least <= 0.0:
                        continue
                    at = (i - m * steps) % ring
                    u = s * (r[0] - past[0, at]) + c * (r[1] - past[1, at])
                    chip = sine[k] * u - cosine[k] * (r[2] - past[2, at])
                    across = kr * sine[k] + ka * cosine[k]
                    f[0] -= length[k] * chip * (kt * c + across * s)
                    f[1] -= length[k] * chip * (across * c - kt * s)
                    f[2] += length[k] * chip * (kr * cosine[k] - ka * sine[k])
            past[:, i] = r
            for k in range(M):
                g = (U[:, k] * f).sum() / w[k] ** 2
                wd = w[k] * math.sqrt(1 - z[k] ** 2)
                e = math.exp(-z[k] * w[k] * dt)
                c = math.cos(wd * dt)
                s = math.sin(wd * dt)
                a = q[k] - g
                q[k] = g + e * (a * (c + z[k] * w[k] / wd * s) + v[k] * s / wd)
                v[k] = e * (v[k] * (c - z[k] * w[k] / wd * s) - a * w[k] ** 2 / wd * s)
        energy = (q**2 * w**2 + v**2).sum()
        size[p] = 0.5 * math.log(energy) + scale
        shrink = 1.0 / math.sqrt(energy)
        scale -= math.log(shrink)
        q *= shrink
        v *= shrink
        past *= shrink
    half = turns // 2
    t = np.arange(turns - half) - 0.5 * (turns - half - 1)
    return (t * size[half:]).sum() / (t * t).sum()
