"""The stock before a program as one closed mesh: rays through it find the volume of the closed form."""

import math

import numpy as np
import pytest

from chipload.stock.blank_mesh import PRISMS, blank_mesh
from chipload.stock.dexel import TriDexel
from chipload.stock.rings import Boss, ring_stock


def dexel_volume(mesh) -> float:
    """By rays along each axis."""
    return float(np.mean([rays.volume() for rays in TriDexel.of_mesh(mesh, 0.4).rays]))


def test_rays_through_a_tube_with_a_boss() -> None:
    heights = np.linspace(0.0, 10.0, 41)
    stock = ring_stock(
        heights, lambda z: 0 * z + 8.0, lambda z: 0 * z + 11.0, (0.3, 0.0), (Boss(0.0, math.pi / 2.0, 1.0),)
    )
    mesh = blank_mesh(stock)
    # all layers are alike: one prism, and the boss about the centre of the wall, not that of the outer edge
    assert len(mesh.faces) < 5000
    assert mesh.volume == pytest.approx(stock.volume(), rel=1e-9)
    ring = math.pi * (11.0**2 - 8.0**2)
    assert dexel_volume(mesh) == pytest.approx(stock.volume(), rel=0.01)
    assert stock.volume() > 10.0 * ring


def test_rays_through_a_cone_of_many_layers() -> None:
    heights = np.linspace(0.0, 20.0, 201)
    stock = ring_stock(heights, lambda z: 8.0 + 0.2 * z, lambda z: 10.0 + 0.2 * z)
    mesh = blank_mesh(stock)
    assert mesh.body_count <= PRISMS
    # two frustums: the integral of pi ((10 + z / 5)^2 - (8 + z / 5)^2) from 0 to 20
    closed = math.pi * (20.0 * 36.0 + 0.4 * 2.0 * 200.0)
    assert dexel_volume(mesh) == pytest.approx(closed, rel=0.015)
