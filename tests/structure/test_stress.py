"""Stress at a clamp against beam theory."""

import numpy as np
import pytest

from chipload.structure.grid import plate
from chipload.structure.places import on_side, weights
from chipload.structure.solid import SolidWorkpiece, displacement, factorise
from chipload.structure.stress import greatest, mises, stresses


def test_cantilever():
    """Beam without Poisson's ratio, 2 x 40 x 1 mm, 10 N at its end: 6 F a / (b t^2) at a = the lowest points of
    integration, drawn out to the faces."""
    b, a, t, F = 2.0, 40.0, 1.0, 10.0
    grid = plate(b, a, t, (1, 20, 1))
    solid = SolidWorkpiece(grid, 2e5, 0.0, 7.8e-9, grid.side("j-"))
    places = on_side(grid, "k+", [0.5], [1.0])
    u = displacement(factorise(solid), weights(grid, places).T @ [[0.0, 0.0, F]])
    first = np.array([0])
    low = 0.5 * (a / 20) * (1.0 - np.sqrt(0.6))
    assert greatest(solid, u, first) == pytest.approx(6.0 * F * (a - low) / (b * t * t), rel=0.01)
    assert stresses(solid, u, first).shape == (1, 27, 3, 3)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_an_even_stretch_is_as_great_on_the_faces(axis):
    """u = 1e-3 x along one axis: E 1e-3 everywhere, drawn out to the faces too."""
    grid = plate(2.0, 40.0, 1.0, (1, 2, 1))
    solid = SolidWorkpiece(grid, 2e5, 0.0, 7.8e-9, grid.side("j-"))
    u = np.zeros_like(grid.nodes)
    u[:, axis] = 1e-3 * grid.nodes[:, axis]
    assert greatest(solid, u, np.array([0, 1])) == pytest.approx(200.0, rel=1e-9)


@pytest.mark.parametrize("b", [-1e-3, 1e-3])
def test_bending_and_pull_are_greatest_on_one_face(b):
    """u_y = y (a - b z), u_z = b y^2 / 2: no shear, sigma_y = E (a - b z), greatest on one face alone."""
    grid = plate(2.0, 40.0, 1.0, (1, 2, 1))
    solid = SolidWorkpiece(grid, 2e5, 0.0, 7.8e-9, grid.side("j-"))
    a, (y, z) = 2e-3, grid.nodes[:, 1:].T
    u = np.column_stack([0.0 * y, y * (a - b * z), 0.5 * b * y**2])
    exact = 2e5 * max(a - b * z.min(), a - b * z.max())
    assert greatest(solid, u, np.array([0, 1])) == pytest.approx(exact, rel=1e-9)


def test_equivalent_stress():
    """Shear alone: sqrt(3) tau; equal in all directions: none."""
    shear = np.zeros((3, 3))
    shear[0, 1] = shear[1, 0] = 100.0
    assert float(mises(shear)) == pytest.approx(173.2050807, rel=1e-9)
    assert float(mises(70.0 * np.eye(3))) == pytest.approx(0.0, abs=1e-9)
