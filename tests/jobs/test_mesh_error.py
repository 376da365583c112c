"""The error of a wall's finite elements: against a thin plate by Ritz' method, and against much finer elements."""

import numpy as np
import pytest
from numpy.polynomial import legendre

from chipload.examples import copy_example
from chipload.geometry.thin_wall import plate
from chipload.jobs import load_job
from chipload.jobs.thinwall.inputs import read_wall
from chipload.jobs.thinwall.mesh_error import ABOVE, error_at, finished_wall, spread_compliance
from chipload.jobs.thinwall.places import places_of
from chipload.jobs.thinwall.result import _growth
from chipload.structure.grid import plate as plate_grid
from chipload.structure.solid import SolidWorkpiece

MODULUS, POISSON = 113.8e3, 0.342


def thin_plate(u, v, side, thickness, terms=18):
    """Deflection [mm] under a unit force at (u, v) of a square plate clamped along v = 0: Kirchhoff's energy, least
    over products of Legendre's polynomials in u and v^2 times those in v."""
    D = MODULUS * thickness**3 / (12.0 * (1.0 - POISSON**2))
    nodes, weight = legendre.leggauss(60)
    x, weight = 0.5 * (nodes + 1.0), 0.5 * weight

    one = np.eye(terms)

    def along(x):
        return [np.array([legendre.legval(2 * x - 1, legendre.legder(c, d)) * 2.0**d for c in one]) for d in (0, 1, 2)]

    def up(y):
        p, p1, p2 = along(y)
        return [y**2 * p, 2 * y * p + y**2 * p1, 2 * p + 4 * y * p1 + y**2 * p2]

    X, Y = along(x), up(x)

    def product(i, j, k, m):
        a, b = (X[i] * weight) @ X[j].T, (Y[k] * weight) @ Y[m].T
        return np.einsum("ab,cd->acbd", a, b).reshape(terms**2, -1)

    K = product(2, 2, 0, 0) + product(0, 0, 2, 2) + 2 * (1 - POISSON) * product(1, 1, 1, 1)
    K += POISSON * (product(2, 0, 0, 2) + product(0, 2, 2, 0))
    f = np.outer(along(np.array([u]))[0][:, 0], up(np.array([v]))[0][:, 0]).ravel()
    scale = 1.0 / np.sqrt(np.diag(K))
    return side**2 / D * f @ (scale * np.linalg.lstsq(K * scale[:, None] * scale, scale * f, rcond=1e-13)[0])


@pytest.mark.parametrize(("u", "v"), [(1.0, 1.0), (0.5, 1.0), (0.0, 0.75)])
def test_a_force_through_the_thickness_of_a_thin_plate(u, v):
    """At a corner, in the middle of the free edge, at a side; 1.5 % are left for shear and the force's own place."""
    side, thickness, n = 20.0, 0.4, 16
    like = SolidWorkpiece(plate_grid(1.0, 1.0, 1.0, (1, 1, 1)), MODULUS, POISSON, 4.43e-9, [0])
    breaks = np.linspace(0.0, 1.0, n + 1)
    solid = finished_wall(plate(side, side, thickness), (0.0, 0.0), breaks, breaks, 0, 1, like)
    found = spread_compliance(solid, np.array([u * n]), np.array([v * n]), 1)[0]
    assert found == pytest.approx(thin_plate(u, v, side, thickness), rel=0.015)


def wall_of(tmp_path, name, elements):
    folder = copy_example(name, tmp_path / f"{name}-{elements[0]}")
    return places_of(read_wall(load_job(folder / "job.toml", (f"wall.elements=[{elements[0]},{elements[1]}]",)).job))


@pytest.mark.parametrize(("name", "elements"), [("plate", (4, 4)), ("blade", (7, 6))])
def test_the_error_covers_what_much_finer_elements_find(tmp_path, name, elements):
    """Three layers of elements of a quarter of the size; the error is no more than 0.05 greater than what they find."""
    places = wall_of(tmp_path, name, elements)
    inputs = places.inputs
    used = places.compliance([np.zeros(places.shape) for _ in inputs.body.side_numbers], 0)
    u, v = inputs.body.places
    i, j, _ = inputs.body.wall.solid.grid.counts
    up = np.concatenate([np.linspace(0.0, inputs.body.foot, inputs.body.wall.foot + 1)[:-1], v])
    rows = np.interp(np.linspace(0.0, j, 4 * j + 1), np.arange(j + 1), up)
    solid = finished_wall(
        inputs.body.shape,
        inputs.body.allowance,
        np.linspace(0.0, 1.0, 4 * i + 1),
        rows,
        4 * inputs.body.wall.foot,
        3,
        inputs.body.wall.solid,
    )
    upper = np.arange(len(v))[len(v) // 2 :]
    a, b = np.meshgrid(u * 4 * i, np.maximum(np.interp(v[upper], rows, np.arange(len(rows))), ABOVE), indexing="ij")
    fine = spread_compliance(solid, a.ravel(), b.ravel(), 0).reshape(len(u), -1)
    softer = fine / used[:, upper] - 1.0
    error = places.error(0)[:, upper]
    assert (error >= softer).all()
    assert (error <= np.maximum(softer, 0.0) + 0.05).all()
    assert error.max() > 0.02


def test_the_error_of_a_limit_is_that_of_the_place_where_the_value_may_be_greatest():
    assert _growth(np.array([10.0, 9.0]), np.array([0.0, 0.2])) == pytest.approx(0.08)
    assert _growth(np.array([10.0, 9.0]), np.array([0.03, 0.0])) == pytest.approx(0.03)
    assert _growth(np.zeros(2), np.ones(2)) == 0.0
    grid = np.array([0.0, 1.0]), np.array([0.25, 1.0])
    values = np.array([[0.1, 0.3], [0.1, 0.3]])
    assert error_at(grid, values, np.array([0.5, 2.0]), np.array([1.0, 0.0])).tolist() == [0.3, 0.1]
