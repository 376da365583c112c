"""Oracles of the moves: swept heights by closed forms in a fine field, and by many times of a move."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from chipload.cutter.cutter import Cutter

Floats = NDArray[np.float64]

RAKE = math.radians(30.0)
BALL = Cutter(8.0, 2, RAKE, 30.0, 40.0, 6e5, corner_radius=4.0)
FLAT = Cutter(8.0, 3, RAKE, 30.0, 40.0, 6e5)
BULL = Cutter(8.0, 2, RAKE, 30.0, 40.0, 6e5, corner_radius=1.5)
TAPER = Cutter(4.0, 2, RAKE, 20.0, 40.0, 6e5, corner_radius=1.0, taper=math.radians(10.0))
DRILL = Cutter(8.0, 2, RAKE, 30.0, 40.0, 6e5, corner_radius=0.5, bottom=math.radians(20.0))
CUTTERS = {"ball": BALL, "flat": FLAT, "bull": BULL, "taper": TAPER, "drill": DRILL}


def height_of(cutter: Cutter, rho: Floats) -> Floats:
    """Height of the cutter's surface above its tip, from its radii at many heights; infinite beyond the flutes."""
    _, r, e, f, alpha, beta, h = cutter.apt
    rho = np.asarray(rho)
    end, out = e + r * math.sin(alpha), e + r * math.cos(beta) if beta > 0.0 else cutter.radius
    z = np.where(rho <= end, rho * math.tan(alpha), f - np.sqrt(np.clip(r * r - (rho - e) ** 2, 0.0, None)))
    if beta > 0.0:
        z = np.where(rho > out, f - r * math.sin(beta) + (rho - out) / math.tan(beta), z)
        out = float(cutter.radius_at([h])[0])
    return np.where(rho > out, math.inf, z)


def least_height(cutter: Cutter, a: Floats, b: Floats, x: Floats, y: Floats, parts: int = 400) -> Floats:
    """Height that a move leaves over points of the plan, the least over many times."""
    out = np.full(np.shape(x), math.inf)
    for t in np.linspace(0.0, 1.0, parts + 1):
        p = a + t * (b - a)
        out = np.minimum(out, p[2] + height_of(cutter, np.hypot(x - p[0], y - p[1])))
    return out


class Field:
    """Heights at the middles of squares."""

    def __init__(self, low: Floats, high: Floats, pitch: float) -> None:
        n = np.round((high[:2] - low[:2]) / pitch).astype(int)
        self.x = low[0] + (np.arange(n[0]) + 0.5) * pitch
        self.y = low[1] + (np.arange(n[1]) + 0.5) * pitch
        self.pitch, self.low = pitch, low
        self.z = np.full(n, high[2])

    def cut(self, cutter: Cutter, a: Floats, b: Floats) -> float:
        """Lower the field by a move; the volume that it takes."""
        wide = float(cutter.radius_at([cutter.flute_length])[0])
        i = np.searchsorted(self.x, [min(a[0], b[0]) - wide, max(a[0], b[0]) + wide])
        j = np.searchsorted(self.y, [min(a[1], b[1]) - wide, max(a[1], b[1]) + wide])
        here = self.z[i[0] : i[1], j[0] : j[1]]
        x, y = np.meshgrid(self.x[i[0] : i[1]], self.y[j[0] : j[1]], indexing="ij")
        length = float(np.linalg.norm(b - a))
        new = np.maximum(least_height(cutter, a, b, x, y, max(4, math.ceil(length / self.pitch))), self.low[2])
        taken = np.clip(here - new, 0.0, None).sum() * self.pitch**2
        self.z[i[0] : i[1], j[0] : j[1]] = np.minimum(here, new)
        return float(taken)
