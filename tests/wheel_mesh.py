"""Wheels with blades in closed form, as closed triangle meshes: an oracle for what is read out of a mesh.

Notation: s along the meridian, 0 at the inlet, 1 at the outlet; v from the hub, 0, to the tips, 1. A blade has the
angle ``wrap(s, v)`` about the axis and the thickness ``thick(s)``, which vanishes at its edges as that of an ellipse.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import trimesh
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Wheel:
    """A wheel by formula: ``hub`` and ``shroud`` give (n, 2) r and z at s (n,), ``wrap`` the angle at s and v [rad]."""

    hub: Callable[[Floats], Floats]
    shroud: Callable[[Floats], Floats]
    wrap: Callable[[Floats, Floats], Floats]
    blades: int
    thickness: float = 3.0
    first: float = 0.0
    offset: float = 0.0
    foot: float = 0.0

    def thick(self, s: Floats) -> Floats:
        """Thickness round the axis [mm]."""
        x = np.clip((s - self.first) / (1.0 - self.first), 0.0, 1.0)
        return self.thickness * np.sqrt(np.clip(1.0 - (2.0 * x - 1.0) ** 6, 0.0, 1.0))

    def meridian(self, s: Floats, v: Floats) -> Floats:
        """(n, 2) r and z of places."""
        return self.hub(s) + v[:, None] * (self.shroud(s) - self.hub(s))

    def width(self, s: Floats, v: Floats) -> Floats:
        """Thickness [mm]; below a tenth of the height both sides spread by ``foot``, as quarters of an ellipse."""
        x = np.clip(1.0 - 10.0 * v, 0.0, 1.0)
        return self.thick(s) * (1.0 + 2.0 * self.foot * (1.0 - np.sqrt(1.0 - x**2)) / self.thickness)

    def side(self, s: Floats, v: Floats, sign: int) -> Floats:
        """Points (n, 3) of a side of the first blade."""
        m = self.meridian(s, v)
        a = self.offset + self.wrap(s, v) + sign * 0.5 * self.width(s, v) / m[:, 0]
        return np.stack([m[:, 0] * np.cos(a), m[:, 0] * np.sin(a), m[:, 1]], axis=-1)

    def off(self, p: Floats, sign: int) -> Floats:
        """Distances (n,) [mm] round the axis of points (n, 3) from a side of the nearest blade, by Newton in (s, v)."""
        goal = np.stack([np.hypot(p[:, 0], p[:, 1]), p[:, 2]], axis=-1)
        grid = [x.ravel() for x in np.meshgrid(np.linspace(0.0, 1.0, 201), np.linspace(-0.05, 1.05, 45), indexing="ij")]
        near = self.meridian(*grid)
        k = ((goal[:, None] - near[None]) ** 2).sum(axis=2).argmin(axis=1)
        s, v = grid[0][k], grid[1][k]
        h = 1e-6
        for _ in range(12):
            m = self.meridian(s, v)
            J = np.stack([(self.meridian(s + h, v) - m) / h, (self.meridian(s, v + h) - m) / h], axis=-1)
            step = np.linalg.solve(J, (goal - m)[..., None])[..., 0]
            s, v = s + step[:, 0], v + step[:, 1]
        angle = self.offset + self.wrap(s, v) + sign * 0.5 * self.width(s, v) / goal[:, 0]
        pitch = 2.0 * np.pi / self.blades
        apart = (np.arctan2(p[:, 1], p[:, 0]) - angle + 0.5 * pitch) % pitch - 0.5 * pitch
        return np.abs(goal[:, 0] * apart)


def radial(blades: int = 7) -> Wheel:
    """A compressor wheel of 80 mm: the inlet along the axis, the outlet outwards."""

    def hub(s: Floats) -> Floats:
        phi = 0.5 * np.pi * s
        return np.stack([40.0 - 30.0 * np.cos(phi), 30.0 * (1.0 - np.sin(phi))], axis=-1)

    def shroud(s: Floats) -> Floats:
        phi = 0.5 * np.pi * s
        return np.stack([40.0 - 12.0 * np.cos(phi), 30.0 - 22.0 * np.sin(phi)], axis=-1)

    return Wheel(hub, shroud, lambda s, v: -0.9 * s**2 + 0.1 * v, blades, 2.0)


def axial(blades: int = 9) -> Wheel:
    """A rotor of 120 mm whose flow goes along the axis over a hub that widens a little."""

    def hub(s: Floats) -> Floats:
        return np.stack([38.0 + 3.0 * s, 30.0 * (1.0 - s)], axis=-1)

    def shroud(s: Floats) -> Floats:
        return np.stack([60.0 - 1.0 * s, 30.0 * (1.0 - s)], axis=-1)

    return Wheel(hub, shroud, lambda s, v: (0.5 + 0.4 * v) * s, blades, 3.0)


def with_splitter(wheel: Wheel) -> tuple[Wheel, Wheel]:
    """The wheel, and the splitters between its blades, which begin at half of their length."""
    return wheel, replace(wheel, first=0.5, offset=np.pi / wheel.blades)


def wheel_mesh(wheels: tuple[Wheel, ...], along: int = 81, up: int = 17, round_axis: int = 180) -> trimesh.Trimesh:
    """A closed mesh: the hub to a bore of 4 mm, and the blades of all wheels, whose feet go into it."""
    s = np.linspace(0.0, 1.0, 61)
    rz = wheels[0].hub(s)
    low = rz[:, 1].min() - 6.0
    ring = np.concatenate([rz, [[rz[-1, 0], low], [4.0, low], [4.0, rz[0, 1]]]])
    theta = 2.0 * np.pi * np.arange(round_axis) / round_axis
    p = np.stack([
        ring[:, None, 0] * np.cos(theta), ring[:, None, 0] * np.sin(theta), ring[:, None, 1] + 0.0 * theta
    ], axis=-1)  # fmt: skip
    parts = [trimesh.Trimesh(*_grid(p, True, True), process=False)]
    for wheel in wheels:
        u = wheel.first + (1.0 - wheel.first) * (0.5 - 0.5 * np.cos(np.linspace(0.0, np.pi, along)))
        v = np.concatenate([[-0.08], np.linspace(0.0, 1.0, up)])
        U, V = (x.ravel() for x in np.meshgrid(u, v, indexing="ij"))
        sides = [wheel.side(U, V, sign).reshape(along, len(v), 3) for sign in (1, -1)]
        around = np.concatenate([sides[0], sides[1][-2:0:-1]])
        vertices, faces = _grid(around, True, False)
        n, m = len(around), len(v)
        caps = []
        for k in range(along - 1):
            for row, flip in ((0, True), (m - 1, False)):
                a, b, c, d = (i % n * m + row for i in (k, k + 1, -k - 1, -k))
                caps += [[a, b, c], [a, c, d]] if not flip else [[a, c, b], [a, d, c]]
        whole = np.concatenate([faces, [c for c in caps if len(set(c)) == 3]])
        blade = trimesh.Trimesh(vertices, whole, process=False)
        for k in range(wheel.blades):
            one = blade.copy()
            one.apply_transform(trimesh.transformations.rotation_matrix(2.0 * np.pi * k / wheel.blades, [0, 0, 1]))
            parts.append(one)
    for one in parts:
        if one.volume < 0.0:
            one.invert()
    return trimesh.util.concatenate(parts)


def _grid(p: Floats, closed_first: bool, closed_second: bool) -> tuple[Floats, NDArray[np.int64]]:
    """Vertices and triangles of a grid (n, m, 3), closed along its first and second axis or not."""
    n, m = p.shape[:2]
    i, j = np.meshgrid(np.arange(n if closed_first else n - 1), np.arange(m if closed_second else m - 1), indexing="ij")
    a, b = i * m + j, (i + 1) % n * m + j
    c, d = (i + 1) % n * m + (j + 1) % m, i * m + (j + 1) % m
    return p.reshape(-1, 3), np.concatenate([np.stack(x, -1).reshape(-1, 3) for x in ((a, b, c), (a, c, d))])
