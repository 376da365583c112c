"""Programs with leaning and turning axes, and how they are turned in space."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from chipload.cutter.cutter import Cutter
from chipload.engagement.bricks.stock import BrickStock
from chipload.engagement.moves.stock import Engaged

Floats = NDArray[np.float64]
UP = np.array([0.0, 0.0, 1.0])


def unit(v: object) -> Floats:
    a = np.asarray(v, dtype=float)
    return np.asarray(a / np.linalg.norm(a, axis=-1, keepdims=True))


def turn(axis: object, angle: float) -> Floats:
    """Rotation by an angle about an axis."""
    x, y, z = unit(axis)
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(np.eye(3) + math.sin(angle) * cross + (1.0 - math.cos(angle)) * cross @ cross)


def take(
    stock: BrickStock, points: Floats, axes: Floats, pieces: int = 12, flank: float = 1.0, tool: int = 1
) -> Engaged:
    """Steps from point to point; one axis for all or one a point."""
    axes = np.broadcast_to(axes, points.shape)
    return stock.take(
        points[:-1], points[1:], axes[:-1], axes[1:], np.full(len(points) - 1, tool), corner_slices=pieces,
        flank_mm=dict.fromkeys(stock.table, flank),
    )  # fmt: skip


def volumes(found: Engaged, steps: int) -> Floats:
    """Volume of each step."""
    return np.bincount(found.step, found.volume / found.instants, steps)


def inside(cutter: Cutter, tip: Floats, axis: Floats, x: Floats) -> NDArray[np.bool_]:
    """Which points are in a cutter, from its radii at heights."""
    q = x - tip
    w = q @ axis
    rho = np.sqrt(np.clip((q * q).sum(axis=1) - w * w, 0.0, None))
    within = (w > 0.0) & (w < cutter.flute_length)
    out = np.zeros(len(x), dtype=bool)
    out[within] = rho[within] < cutter.radius_at(w[within])
    return out


def turned(a: Floats, b: Floats, t: float) -> Floats:
    """Axis on the way from one to another at an even rate."""
    angle = 2.0 * math.asin(min(0.5 * float(np.linalg.norm(b - a)), 1.0))
    if angle < 1e-9:
        return b
    return np.asarray((math.sin((1.0 - t) * angle) * a + math.sin(t * angle) * b) / math.sin(angle))
