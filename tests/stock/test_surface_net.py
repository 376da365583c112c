"""The compiled surface net gives the quads of its NumPy version, bit for bit."""

from __future__ import annotations

import math

import numpy as np
import pytest

from chipload.stock.dexel import TriDexel
from chipload.stock.surface_net import SurfaceNet
from surface_net_numpy import PlainNet

BALL = (6.0, 3.0, 0.0, 3.0, 0.0, 0.0, 20.0)
FLAT = (5.0, 0.0, 2.5, 0.0, 0.0, 0.0, 12.0)


@pytest.mark.parametrize("seed", range(4))
def test_random_cuts_leave_the_same_quads_in_the_same_frames(seed: int) -> None:
    rng = np.random.default_rng(seed)
    stock = TriDexel.block((0.0, 0.0, 0.0), (21.0, 17.0, 9.0), rng.uniform(0.7, 1.6))
    compiled, plain = SurfaceNet(stock), PlainNet(stock)
    for frame in range(1, 40):
        tips = rng.uniform([-4.0, -4.0, -2.0], [25.0, 21.0, 9.0], (2, 3))
        axes = rng.normal([0.0, 0.0, 1.0], 0.4, (2, 3))
        axes /= np.linalg.norm(axes, axis=1)[:, None]
        stock.remove_poses(np.linspace(*tips, 4), np.linspace(*axes, 4), (BALL, FLAT)[frame % 2], tol=0.02)
        ends = np.concatenate([tips, tips + 20.0 * axes])
        for net in (compiled, plain):
            net.update(ends.min(axis=0) - 4.0, ends.max(axis=0) + 4.0, frame)
        # and a window at a corner of the lattice
        corner = rng.uniform(-6.0, 20.0, 3)
        size = rng.uniform(0.0, 3.0)
        for net in (compiled, plain):
            net.update(corner, corner + size, frame)
    assert compiled.size == plain.size > 1000
    assert compiled.corners.tobytes() == plain.corners.tobytes()
    assert compiled.seen.tobytes() == plain.seen.tobytes()
    assert math.isclose(compiled.volume(39), plain.volume(39))
