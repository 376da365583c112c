"""The element: polynomials, the patch test, rigid motions, a slice of the thickness."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from chipload.errors import InputError
from chipload.structure.grid import from_map, plate
from chipload.structure.hexa import NODES, gauss, mass, shape, shape_gradient, stiffness
from chipload.structure.solid import SolidWorkpiece, assemble

RNG = np.random.default_rng(5)
E, NU = 1.1e5, 0.31


def crooked(counts=(3, 2, 2)):
    """A box of 3 x 2 x 1 whose inner nodes are moved, the faces plane."""

    def place(p):
        x = p * [3.0, 2.0, 1.0]
        bump = 0.08 * np.prod(np.sin(np.pi * p), axis=1)
        return x + bump[:, None] * [1.0, -0.7, 0.5]

    return from_map(*(np.linspace(0.0, 1.0, c + 1) for c in counts), place)


@pytest.mark.parametrize("points", [8, 14, 27])
def test_rules_integrate_polynomials(points):
    places, weights = gauss(points)
    degree = 3 if points == 8 else 5
    for a, b, c in itertools.product(range(degree + 1), repeat=3):
        if a + b + c <= degree:
            exact = np.prod([2.0 / (k + 1) if k % 2 == 0 else 0.0 for k in (a, b, c)])
            assert weights @ np.prod(places ** [a, b, c], axis=1) == pytest.approx(exact, abs=1e-13)


def test_shape_functions():
    """One at their node, none at the others; they carry every quadratic; slopes by differences."""
    np.testing.assert_allclose(shape(NODES), np.eye(20), atol=1e-14)
    local = RNG.uniform(-1.0, 1.0, (50, 3))
    for a, b, c in itertools.product(range(3), repeat=3):
        if a + b + c <= 2:
            np.testing.assert_allclose(
                shape(local) @ np.prod(NODES ** [a, b, c], axis=1), np.prod(local ** [a, b, c], axis=1), atol=1e-13
            )
    h = 1e-6
    for c in range(3):
        slope = (shape(local + h * np.eye(3)[c]) - shape(local - h * np.eye(3)[c])) / (2.0 * h)
        np.testing.assert_allclose(shape_gradient(local)[:, :, c], slope, atol=1e-8)


def test_stiffness_by_the_strain_matrix():
    """The textbook's sum of B^T C B over the points, with Voigt's strains."""
    xyz = NODES * [1.5, 1.0, 0.4] + 0.05 * RNG.standard_normal((20, 3))
    c = np.zeros((6, 6))
    c[:3, :3] = E * NU / ((1 + NU) * (1 - 2 * NU))
    c[[0, 1, 2], [0, 1, 2]] += E / (1 + NU)
    c[[3, 4, 5], [3, 4, 5]] = E / (2 * (1 + NU))
    expected = np.zeros((60, 60))
    for place, weight in zip(*gauss(27), strict=True):
        local = shape_gradient(place[None])[0]
        J = local.T @ xyz
        g = local @ np.linalg.inv(J).T
        B = np.zeros((6, 60))
        for i in range(20):
            x, y, z = g[i]
            B[:, 3 * i : 3 * i + 3] = [[x, 0, 0], [0, y, 0], [0, 0, z], [y, x, 0], [0, z, y], [z, 0, x]]
        expected += weight * np.linalg.det(J) * B.T @ c @ B
    np.testing.assert_allclose(stiffness(xyz[None], E, NU)[0], expected, atol=1e-11 * abs(expected).max())


@pytest.mark.parametrize("rule", [14, 27])
def test_only_rigid_motions_are_free(rule):
    xyz = NODES * [1.5, 1.0, 0.4] + 0.05 * RNG.standard_normal((20, 3))
    values = np.linalg.eigvalsh(stiffness(xyz[None], E, NU, rule)[0])
    assert (abs(values[:6]) < 1e-9 * values[-1]).all()
    assert values[6] > 1e-5 * values[-1]


@pytest.mark.parametrize("rule", [8, 27])
def test_patch(rule):
    """Boundary moved by a linear field: inner nodes follow it, reactions are those of a constant stress."""
    grid = crooked((3, 3, 2))
    solid = SolidWorkpiece(grid, E, NU, 4.43e-9, np.zeros(0, dtype=np.int64), rule=rule)
    K = assemble(solid)
    strain = np.array([[1.0, 0.4, -0.2], [0.1, -0.6, 0.3], [0.5, -0.1, 0.8]]) * 1e-3
    u = (grid.nodes @ strain.T).ravel()
    outer = np.zeros(len(grid.nodes), dtype=bool)
    for name in ("i-", "i+", "j-", "j+", "k-", "k+"):
        outer[grid.side(name)] = True
    free = np.flatnonzero(~np.repeat(outer, 3))
    held = np.flatnonzero(np.repeat(outer, 3))
    assert len(free) >= 20
    inner = np.linalg.solve(K[free][:, free].toarray(), -K[free][:, held] @ u[held])
    np.testing.assert_allclose(inner, u[free], rtol=0.0, atol=1e-14)
    e = 0.5 * (strain + strain.T)
    stress = E / (1 + NU) * (e + NU / (1 - 2 * NU) * np.trace(e) * np.eye(3))
    reaction = (K @ u).reshape(-1, 3)[grid.side("i+")].sum(axis=0)
    np.testing.assert_allclose(reaction, 2.0 * 1.0 * stress[0], rtol=1e-10)


def test_volume_and_mass():
    grid = crooked()
    M = mass(grid.nodes[grid.elements], 4.43e-9)
    assert M.sum() == pytest.approx(6.0 * 4.43e-9, rel=1e-12)
    block = mass(NODES[None] * [1.0, 2.0, 3.0], 1e-9)[0]
    x = NODES[:, 0]
    assert x @ block @ x == pytest.approx(48.0e-9 / 3.0, rel=1e-12)


def test_a_slice_is_the_thinner_element():
    """A plate of 4, kept from 0.25 to 0.7, has the energy of the plate of 1.8 in any quadratic motion."""
    thick = NODES * [3.0, 2.0, 2.0] + [0.0, 0.0, 2.0]
    thin = NODES * [3.0, 2.0, 0.9] + [0.0, 0.0, 1.9]
    kept = np.array([[0.25, 0.7]])
    powers = [p for p in itertools.product(range(3), repeat=3) if sum(p) <= 2]
    factors = RNG.standard_normal((len(powers), 3))

    def motion(x):
        return sum(f * np.prod(x**p, axis=1)[:, None] for p, f in zip(powers, factors, strict=True)).ravel()

    a, b = motion(thick), motion(thin)
    cut = stiffness(thick[None], E, NU, kept=kept)[0]
    assert a @ cut @ a == pytest.approx(b @ stiffness(thin[None], E, NU)[0] @ b, rel=1e-11)
    assert mass(thick[None], 1e-9, kept=kept).sum() == pytest.approx(24.0 * 1.8e-9, rel=1e-12)


def test_refused():
    grid = plate(1.0, 1.0, 1.0, (2, 1, 1))
    xyz = grid.nodes[grid.elements].copy()
    xyz[1] = xyz[1] * [1.0, 1.0, -1.0]
    with pytest.raises(InputError, match=r"element 1: det\(dx/dxi\) = -0.0625 mm\^3: must be above 0 everywhere"):
        stiffness(xyz, E, NU)
    xyz[1, :, 2] = 0.0
    with pytest.raises(InputError, match=r"element 1: det\(dx/dxi\) = -?0 mm\^3"):
        stiffness(xyz, E, NU)
    with pytest.raises(InputError, match="gauss: points = 9: must be one of 8, 14, 27"):
        gauss(9)
