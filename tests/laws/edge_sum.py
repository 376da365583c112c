"""Loads of a cutter by a double sum over its edge and its rotation: the oracle of tests, for any shape and axis.

A point of the edge cuts where its own motion has a part along the outward normal and a predicate says that it is in
material; nothing of the engagement of the library is used.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chipload.cutter.cutter import Cutter
from chipload.cutting.material import Material

Floats = NDArray[np.float64]
#: which of some points (..., 3) [mm] are in material
Solid = Callable[[Floats], NDArray[np.bool_]]
ANGLES = 360


@dataclass(frozen=True)
class Sum:
    """Mean and greatest torque [N m], greatest force [N], thickest chip [mm]."""

    torque_mean_nm: float
    torque_nm: float
    force_n: float
    chip_max_mm: float


def profile(cutter: Cutter, number: int = 2400) -> Floats:
    """(m, 5) rho, z, kappa, ds, lag of the edge; narrow pieces near the bottom."""
    _, r, e, f, alpha, beta, height = cutter.apt
    parts = []
    if e > 1e-9 and alpha == 0.0:
        u = (np.arange(200) + 0.5) / 200
        parts.append([u * e, 0.0 * u, 0.0 * u, 0.0 * u + e / 200])
    top = 0.5 * math.pi - beta
    if r > 0.0:
        nodes = top * np.linspace(0.0, 1.0, number + 1) ** 2
        k = 0.5 * (nodes[1:] + nodes[:-1])
        parts.append([e + r * np.sin(k), f - r * np.cos(k), k, r * np.diff(nodes)])
    low = f - r * math.sin(beta) if r > 0.0 else 0.0
    nodes = low + (height - low) * np.linspace(0.0, 1.0, number + 1) ** 2
    z = 0.5 * (nodes[1:] + nodes[:-1])
    foot = e + r * math.cos(beta)
    parts.append([foot + (z - low) * math.tan(beta), z, 0.0 * z + top, np.diff(nodes) / math.cos(beta)])
    out = np.hstack([np.array(p) for p in parts]).T
    return np.column_stack([out, out[:, 1] * math.tan(cutter.helix) / cutter.radius])


def edge_sum(cutter: Cutter, tip: Any, axis: Any, way: Any, solid: Solid, material: Material) -> Sum:
    """Loads at a place; ``way`` (3,) [mm] is what the tip moves while the spindle turns by one tooth."""
    p, A, V = (np.asarray(v, dtype=np.float64) for v in (tip, axis, way))
    T = V - (V @ A) * A
    if np.linalg.norm(T) < 1e-12 * np.linalg.norm(V):
        T = np.cross([0.0, 1.0, 0.0], A)
    T /= np.linalg.norm(T)
    n = np.cross(A, T)
    phi = (np.arange(ANGLES) + 0.5) * math.tau / ANGLES
    u = np.cos(phi)[:, None] * n + np.sin(phi)[:, None] * T
    t = np.cos(phi)[:, None] * T - np.sin(phi)[:, None] * n
    force, torque, thickest = np.zeros((ANGLES, 3)), np.zeros(ANGLES), 0.0
    for rho, z, k, ds, lag in profile(cutter):
        nu, e = math.sin(k) * u - math.cos(k) * A, math.cos(k) * u + math.sin(k) * A
        h = nu @ V
        cuts = (h > 1e-12) & solid(p + z * A + rho * u)
        if not cuts.any():
            continue
        thickest = max(thickest, float(h[cuts].max()))
        ft, fr, fa = (
            ((K * h + E) * cuts * ds)[:, None]
            for K, E in ((material.Ktc, material.Kte), (material.Krc, material.Kre), (material.Kac, material.Kae))
        )
        shift = round(lag / math.tau * ANGLES)
        force -= np.roll(ft * t + fr * nu + fa * e, shift, axis=0)
        torque += np.roll(rho * ft[:, 0], shift)
    pitch = ANGLES // cutter.flutes
    force, torque = (sum(np.roll(v, j * pitch, axis=0) for j in range(cutter.flutes)) for v in (force, torque))
    return Sum(
        float(torque.mean()) / 1e3, float(torque.max()) / 1e3, float(np.linalg.norm(force, axis=1).max()), thickest
    )
