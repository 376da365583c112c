"""Compiled loops of the covered area: the section of a cutter with a layer at an instant.

Notation: tip p(t), unit axis A = (a, A_z), layer z = h; w height above the tip along the axis, rho distance from the
axis, e_r direction from it to a point. Surface normal N = sin(g) e_r - cos(g) A, g = 0 on the bottom face, pi on the
top; normal speed of the cutter's surface N . v = sin(g) e_r . p' - cos(g) A . p' + (w sin(g) + rho cos(g)) e_r . A'.
V is that over |N_xy|, the speed of the section's edge in the layer. A point of the edge is x(theta) = c + l M (cos
theta, sin theta), c halfway between the ends of the section along a, M = I + a a' / (A_z (1 + A_z)).

Arrays: ``cp``, ``ca`` (n, 3) Chebyshev coefficients of the tip and of the axis, its length aside, on t in 0 .. 1.
``K`` cutter: e, r, f, sin, cos, tan of alpha, sin, cos, tan of beta, flank radius at w = 0, H, rho(H) 0-11, of the
flank arc of a barrel E, R (0: none), F 12-14, sin, cos of kappa where the corner ends 15-16.
``S`` instant: p, A, p', A' (0-11), h 12, c 13-14, w at c 15, from the axis to c 16-18, its square 19, corners 20, t 21;
where the section is a whole ellipse, 22 is R (else 0) and N . v = g . c + (R a . c / A_z)(m . c), c = (cos theta, sin
theta), g 23-24, m = M a' 25-26; where it is a whole circle of a ball about b, 22 is -rho and V = b' . u + rho', u
outward unit, b' 23-24, rho' 25.
``C`` (8, 5) corners of the section: theta, x, y, code of the piece before, after (counter-clockwise).
Rows of edges and vertices: x, y, theta, t, n_x, n_y (outward, across the curve), code.
"""

from __future__ import annotations

import math

from numba import njit, types

TAU = 2.0 * math.pi
BOTTOM, CONE, TORUS, FLANK, TOP, BOW = 0, 1, 2, 3, 4, 6  # 5: a corner of the section


#: types are stated: a constant among the arguments would else be compiled as a type of its own
_R1 = types.Array(types.float64, 1, "C", readonly=True)
_R2 = types.Array(types.float64, 2, "C", readonly=True)
_F1, _F2 = types.float64[::1], types.float64[:, ::1]


@njit(types.void(_R2, _R2, types.float64, _F1), cache=True, nogil=True)
def state(cp, ca, t, S):
    """Tip, axis and their derivatives into ``S[:12]``."""
    u = 2.0 * t - 1.0
    for k in range(3):
        for c in range(2):
            co = cp if c == 0 else ca
            b1 = b2 = d1 = d2 = 0.0
            for j in range(co.shape[0] - 1, 0, -1):
                b = co[j, k] + 2.0 * u * b1 - b2
                d = 2.0 * b1 + 2.0 * u * d1 - d2
                b2 = b1
                b1 = b
                d2 = d1
                d1 = d
            S[3 * c + k] = co[0, k] + u * b1 - b2
            S[6 + 3 * c + k] = 2.0 * (b1 + u * d1 - d2)
    length = math.sqrt(S[3] ** 2 + S[4] ** 2 + S[5] ** 2)
    for k in range(3):
        S[3 + k] /= length
        S[9 + k] /= length
    along = S[3] * S[9] + S[4] * S[10] + S[5] * S[11]
    for k in range(3):
        S[9 + k] -= along * S[3 + k]
    S[21] = t


@njit(cache=True, nogil=True)
def extent(S, K):
    """Lowest and highest point above the tip: (z, u) of both, u along a."""
    Az = S[5]
    s = math.hypot(S[3], S[4])
    H, top = K[10], K[11]
    zh = H * Az + top * s
    uh = H * s - top * Az
    e, r, f = K[0], K[1], K[2]
    if s > K[15] and K[13] > 0.0:
        e, r, f = K[12], K[13], K[14]
    w = f - r * Az
    if s < K[3]:
        return 0.0, 0.0, zh, uh
    if s <= K[7] and w <= H:
        rho = e + r * s
        return w * Az - rho * s, w * s + rho * Az, zh, uh
    return H * Az - top * s, H * s + top * Az, zh, uh


@njit(types.float64(_R2, _R2, _R1, types.float64, types.float64, _F1), cache=True, nogil=True)
def reach(cp, ca, K, h, t, S):
    """Above 0 where the layer cuts the open cutter [mm]; fills ``S[:12]``."""
    state(cp, ca, t, S)
    zl, _, zh, _ = extent(S, K)
    return min(h - S[2] - zl, S[2] + zh - h)


@njit(cache=True, nogil=True)
def _exit(A2, B, C):
    """Least positive root of A2 l^2 + 2 B l + C, C < 0; inf if there is none."""
    disc = B * B - A2 * C
    if disc < 0.0:
        return math.inf
    root = math.sqrt(disc)
    if A2 > 0.0 and B < 0.0:
        return (root - B) / A2
    den = B + root
    return -C / den if den > 0.0 else math.inf


@njit(cache=True, nogil=True)
def _nearest_arc(K, rho, w):
    """The arc that the nearest point of the surface is on: TORUS or BOW (FLANK: neither), centre's rho, radius, w."""
    if K[13] > 0.0:
        x, y = rho - K[12], K[14] - w
        if x * K[16] >= y * K[15]:
            return (BOW if x * K[6] < y * K[7] else FLANK), K[12], K[13], K[14]
    x, y = rho - K[0], K[2] - w
    below = x * K[16] < y * K[15] or K[13] > 0.0
    return (TORUS if x * K[4] > y * K[3] and below else FLANK), K[0], K[1], K[2]


@njit(cache=True, nogil=True)
def ray(S, K, ct, st):
    """Where the ray from c leaves the section: l, code."""
    Az = S[5]
    ac = S[3] * ct + S[4] * st
    dw = ac / Az
    k = ac / (Az * (1.0 + Az))
    q1 = S[16] * (ct + S[3] * k) + S[17] * (st + S[4] * k)
    w0, q0 = S[15], S[19]
    flank = K[9] + w0 * K[8]
    lam = _exit(1.0 - (K[8] * dw) ** 2, q1 - K[8] * dw * flank, q0 - flank * flank)
    code = FLANK
    if K[5] == 0.0:
        if dw < 0.0 and -w0 / dw < lam:
            lam = -w0 / dw
            code = BOTTOM
    else:
        T = K[5] * K[5]
        other = _exit(T - dw * dw, T * q1 - w0 * dw, T * q0 - w0 * w0)
        if other < lam:
            lam = other
            code = CONE
    if dw > 0.0 and (K[10] - w0) / dw < lam:
        lam = (K[10] - w0) / dw
        code = TOP
    if K[1] > 0.0 or K[13] > 0.0:
        w = w0 + lam * dw
        rho = math.sqrt(max(q0 + lam * (2.0 * q1 + lam), 0.0))
        on, e, r, f = _nearest_arc(K, rho, w)
        y, x = f - w, rho - e
        if on != FLANK and x * x + y * y > r * r:
            code = on
            if e == 0.0 and K[13] == 0.0:
                y0 = w0 - f
                lam = _exit(1.0 + dw * dw, q1 + dw * y0, q0 + y0 * y0 - r * r)
            else:
                for _ in range(40):
                    x = max(rho - e, 0.0)
                    y = w0 + lam * dw - f
                    dist = math.hypot(x, y)
                    slope = (x * (q1 + lam) / rho if x > 0.0 else 0.0) + y * dw
                    if slope <= 0.0:
                        break
                    step = (dist - r) * dist / slope
                    lam -= step
                    if step <= 4e-16 * lam:
                        break
                    rho = math.sqrt(max(q0 + lam * (2.0 * q1 + lam), 0.0))
                    if K[13] > 0.0:
                        next_, e, r, f = _nearest_arc(K, rho, w0 + lam * dw)
                        code = code if next_ == FLANK else next_
            if K[1] == 0.0:
                code = BOW  # the sharp corner is its end
    return lam, code


@njit(cache=True, nogil=True)
def speed(S, K, x, y, code):
    """V [mm per t] and the outward normal (n_x, n_y) of the section's edge at a point of piece ``code``."""
    X, Y, Z = x - S[0], y - S[1], S[12] - S[2]
    w = X * S[3] + Y * S[4] + Z * S[5]
    X -= w * S[3]
    Y -= w * S[4]
    Z -= w * S[5]
    rho = math.sqrt(X * X + Y * Y + Z * Z)
    if rho > 0.0:
        X /= rho
        Y /= rho
        Z /= rho
    if code == FLANK:
        sg, cg = K[7], K[6]
    elif code == BOTTOM:
        sg, cg = 0.0, 1.0
    elif code == TOP:
        sg, cg = 0.0, -1.0
    elif code == CONE:
        sg, cg = K[3], K[4]
    else:
        sg = max(rho - (K[12] if code == BOW else K[0]), 0.0)
        cg = (K[14] if code == BOW else K[2]) - w
        d = math.hypot(sg, cg)
        sg /= d
        cg /= d
    v = sg * (X * S[6] + Y * S[7] + Z * S[8]) - cg * (S[3] * S[6] + S[4] * S[7] + S[5] * S[8])
    v += (w * sg + rho * cg) * (X * S[9] + Y * S[10] + Z * S[11])
    nx = sg * X - cg * S[3]
    ny = sg * Y - cg * S[4]
    n = math.hypot(nx, ny)
    if n == 0.0:
        return math.inf, 1.0, 0.0
    return v / n, nx / n, ny / n


@njit(cache=True, nogil=True)
def point(S, K, theta, row):
    """The edge at theta into ``row`` (x, y, theta, t, n_x, n_y, code); returns V."""
    return point_at(S, K, theta, math.cos(theta), math.sin(theta), row)


@njit(cache=True, nogil=True)
def point_at(S, K, theta, ct, st, row):
    """As ``point``, cosine and sine of theta given."""
    ac = S[3] * ct + S[4] * st
    k = ac / (S[5] * (1.0 + S[5]))
    if S[22] > 0.0:
        row[0] = S[13] + S[22] * (ct + S[3] * k)
        row[1] = S[14] + S[22] * (st + S[4] * k)
        row[2] = theta
        row[3] = S[21]
        k = ac / (1.0 + S[5])
        nx = ct - k * S[3]
        ny = st - k * S[4]
        n = math.sqrt(nx * nx + ny * ny)
        row[4] = nx / n
        row[5] = ny / n
        row[6] = FLANK
        return (S[23] * ct + S[24] * st + S[22] * ac / S[5] * (S[25] * ct + S[26] * st)) / n
    if S[22] < 0.0:
        ux, uy = ct + S[3] * k, st + S[4] * k
        n = math.sqrt(ux * ux + uy * uy)
        return on_circle(S, ux / n, uy / n, theta, row)
    lam, code = ray(S, K, ct, st)
    row[0] = S[13] + lam * (ct + S[3] * k)
    row[1] = S[14] + lam * (st + S[4] * k)
    row[2] = theta
    row[3] = S[21]
    v, row[4], row[5] = speed(S, K, row[0], row[1], code)
    row[6] = code
    return v


@njit(cache=True, nogil=True)
def on_circle(S, ux, uy, theta, row):
    """The point of a ball's circle in the direction (ux, uy) into ``row``; returns V."""
    row[0] = S[13] - S[22] * ux
    row[1] = S[14] - S[22] * uy
    row[2] = theta
    row[3] = S[21]
    row[4] = ux
    row[5] = uy
    row[6] = TORUS
    return S[23] * ux + S[24] * uy + S[25]


@njit(cache=True, nogil=True)
def _centre(S, x, y):
    """Put the inner point at (x, y)."""
    S[13] = x
    S[14] = y
    X, Y, Z = x - S[0], y - S[1], S[12] - S[2]
    w = X * S[3] + Y * S[4] + Z * S[5]
    S[15] = w
    S[16] = X - w * S[3]
    S[17] = Y - w * S[4]
    S[18] = Z - w * S[5]
    S[19] = S[16] ** 2 + S[17] ** 2 + S[18] ** 2


@njit(cache=True, nogil=True)
def _ellipse(S, R):
    """Coefficients of N . v on a cylinder that the layer cuts through."""
    ax, ay, Az = S[3], S[4], S[5]
    S[22] = R
    k = (ax * S[9] + ay * S[10]) / (Az * (1.0 + Az))
    S[25] = S[9] + k * ax
    S[26] = S[10] + k * ay
    k = (ax * S[6] + ay * S[7]) / (Az * (1.0 + Az)) - (ax * S[6] + ay * S[7] + Az * S[8]) / Az
    S[23] = S[6] + k * ax + S[15] * S[25]
    S[24] = S[7] + k * ay + S[15] * S[26]


@njit(cache=True, nogil=True)
def _circle(S, K):
    """Coefficients of V on a ball that the layer cuts through."""
    f = K[2]
    dz = S[12] - S[2] - f * S[5]
    rho = math.sqrt(max((K[1] - dz) * (K[1] + dz), 0.0))
    if rho == 0.0:
        return
    _centre(S, S[0] + f * S[3], S[1] + f * S[4])
    S[22] = -rho
    S[23] = S[6] + f * S[9]
    S[24] = S[7] + f * S[10]
    S[25] = dz * (S[8] + f * S[11]) / rho


@njit(types.boolean(_R2, _R2, _R1, types.float64, types.float64, _F1, _F2), cache=True, nogil=True)
def instant(cp, ca, K, h, t, S, C):
    """Fill ``S`` and the corners ``C``; False where the layer doesn't cut the open cutter."""
    state(cp, ca, t, S)
    S[12] = h
    S[20] = 0.0
    S[22] = 0.0
    zl, ul, zh, uh = extent(S, K)
    z = h - S[2]
    if not zl < z < zh:
        return False
    s = math.hypot(S[3], S[4])
    ex, ey = (S[3] / s, S[4] / s) if s > 0.0 else (1.0, 0.0)
    u = ul + (uh - ul) * ((z - zl) / (zh - zl))
    _centre(S, S[0] + u * ex, S[1] + u * ey)
    Az = S[5]
    up, high = ray(S, K, ex, ey)
    down, low = ray(S, K, -ex, -ey)
    if not up + down > 0.0:
        return False
    u += 0.5 * (up - down) / Az
    _centre(S, S[0] + u * ex, S[1] + u * ey)
    if high == FLANK and low == FLANK:
        if K[8] == 0.0:
            _ellipse(S, K[9])
        return True
    if high == TORUS and low == TORUS and K[0] == 0.0:
        _circle(S, K)
        return True
    n = 0
    for which in range(2):
        rho, w = (K[0], K[2]) if which == 0 else (K[11], K[10])
        if (which == 0 and K[1] > 0.0) or s == 0.0:
            continue
        low = FLANK if which == 1 else (BOTTOM if K[5] == 0.0 else CONE)
        if which == 1 and K[13] > 0.0 and K[10] < K[14] - K[13] * K[6]:
            low = BOW
        elif which == 1 and K[1] > 0.0 and K[10] < K[2] - K[1] * K[16]:
            low = TORUS
        high = TOP if which == 1 else (BOW if K[13] > 0.0 else FLANK)
        cphi = (z - w * Az) / (rho * s)
        if not -1.0 < cphi < 1.0:
            continue
        across = rho * math.sqrt((1.0 - cphi) * (1.0 + cphi))
        along = w * s - rho * cphi * Az
        for side in range(2):
            v = across if side == 0 else -across
            C[n, 1] = S[0] + along * ex - v * ey
            C[n, 2] = S[1] + along * ey + v * ex
            C[n, 0] = math.atan2(v, (along - u) * Az)
            C[n, 0] = (C[n, 0] + math.atan2(ey, ex)) % TAU
            C[n, 3] = high if side == 0 else low
            C[n, 4] = low if side == 0 else high
            n += 1
    for i in range(1, n):
        j = i
        while j > 0 and C[j, 0] < C[j - 1, 0]:
            for k in range(5):
                C[j, k], C[j - 1, k] = C[j - 1, k], C[j, k]
            j -= 1
    S[20] = n
    return True
