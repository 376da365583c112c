"""What a cutter covers by brute force: membership from the profile rho(w) alone, rays and dense sections.

Nothing here knows of grazing points, speeds or ellipses.
"""

from __future__ import annotations

import math

import numpy as np
import shapely

from chipload.cutter.cutter import Cutter
from chipload.engagement.chips.move import Move
from chipload.machine.machine import machine_named


def inside(cutter: Cutter, tip, axis, height, xy) -> np.ndarray:
    """Whether points (..., 2) on the layer are in the cutter at tip (..., 3), axis (..., 3)."""
    X = np.concatenate([xy, np.broadcast_to(height, (*xy.shape[:-1], 1))], axis=-1) - tip
    w = (X * axis).sum(-1)
    rho = np.linalg.norm(X - w[..., None] * axis, axis=-1)
    ok = (w > 0.0) & (w < cutter.flute_length)
    return ok & (rho < cutter.radius_at(np.where(ok, w, 0.0)))


def _outside(cutter: Cutter, tip, axis, height, xy) -> np.ndarray:
    """Above 0 outside, below inside: the greatest of the ways past bottom, top and profile."""
    X = np.concatenate([xy, np.broadcast_to(height, (*xy.shape[:-1], 1))], axis=-1) - tip
    w = (X * axis).sum(-1)
    rho = np.linalg.norm(X - w[..., None] * axis, axis=-1)
    H = cutter.flute_length
    return np.maximum(np.maximum(-w, w - H), rho - cutter.radius_at(np.clip(w, 0.0, H)))


def sections(cutter: Cutter, move: Move, height: float, times, rays: int) -> list[shapely.Polygon]:
    """Polygons of the sections at some times: each ray from an inner point halved 40 times."""
    tip, axis = move.at(times)
    e = axis[:, :2] / np.maximum(np.hypot(axis[:, 0], axis[:, 1]), 1e-300)[:, None]
    e[np.hypot(e[:, 0], e[:, 1]) < 0.5] = (1.0, 0.0)
    far = cutter.flute_length + cutter.diameter * 40.0
    middle, width = np.zeros(len(tip)), far
    for _ in range(7):  # where the line along the axis is deepest in the cutter: thin sections are found too
        u = middle[:, None] + np.linspace(-width, width, 121)
        outside = _outside(cutter, tip[:, None], axis[:, None], height, tip[:, None, :2] + u[..., None] * e[:, None])
        middle = u[np.arange(len(u)), outside.argmin(1)]
        width /= 30.0
    has = outside.min(1) < 0.0
    tip, axis, e = tip[has], axis[has], e[has]
    c = tip[:, :2] + middle[has, None] * e
    phi = np.arange(rays) * (math.tau / rays)
    d = np.stack([np.cos(phi), np.sin(phi)], axis=-1)
    lo, hi = np.zeros((len(c), rays)), np.full((len(c), rays), far)
    for _ in range(40):
        mid = 0.5 * (lo + hi)
        ok = inside(cutter, tip[:, None], axis[:, None], height, c[:, None] + mid[..., None] * d)
        lo, hi = np.where(ok, mid, lo), np.where(ok, hi, mid)
    return [shapely.Polygon(p) for p in c[:, None] + lo[..., None] * d]


CUTTERS = {
    "flat": Cutter(10.0, 4, 0.5, 14.0, 40.0, 6e5),
    "bull": Cutter(10.0, 4, 0.5, 14.0, 40.0, 6e5, corner_radius=2.0),
    "ball": Cutter(10.0, 4, 0.5, 14.0, 40.0, 6e5, corner_radius=5.0),
    "taper": Cutter(6.0, 4, 0.5, 14.0, 40.0, 6e5, corner_radius=1.0, taper=math.radians(8.0)),
    "drill": Cutter(8.0, 2, 0.5, 14.0, 40.0, 6e5, bottom=math.radians(30.0)),
}


def random_move(rng: np.random.Generator, way: str, long: float = 8.0) -> Move:
    """A move of some mm and up to half a radian of turn, tip about the origin."""
    if way == "machine":
        machine = machine_named("cradle-ac")
        q0 = np.zeros(9)
        q0[:3] = rng.uniform(-2.0, 2.0, 3)
        q0[3], q0[5] = rng.uniform(-0.9, 0.9), rng.uniform(-3.0, 3.0)
        q1 = q0.copy()
        q1[3] += rng.uniform(-0.08, 0.08)
        q1[5] += rng.uniform(-0.3, 0.3)
        q1[:3] += rng.uniform(-0.3, 0.3, 3) * long
        return Move.machine_linear(machine, q0, q1, work_zero=[0.0, 0.0, 0.0])
    p0 = rng.uniform(-2.0, 2.0, 3)
    p1 = p0 + rng.uniform(-1.0, 1.0, 3) * long * rng.choice([0.05, 0.3, 1.0])
    a0, a1 = (np.append(rng.uniform(-0.7, 0.7, 2), 1.0) for _ in range(2))
    a1 = a0 + (a1 - a0) * rng.choice([0.1, 0.5, 1.0])
    return Move.lerp(p0, a0, p1, a1) if way == "lerp" else Move.slerp(p0, a0, p1, a1)
