"""Compliance against beams, plates and the strip of Kirchhoff's theory; what is refused."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad

from chipload.errors import InputError
from chipload.structure.grid import from_map, plate
from chipload.structure.places import locate, normals_of, on_side
from chipload.structure.solid import SolidWorkpiece, compliance, displacement, factorise, full_compliance, loads

E, NU, RHO = 2e5, 0.3, 7.85e-9


def towards_the_clamp(n, power=2.0):
    """Rows that get narrow at the clamp, where the bending moment has its boundary layer."""
    return 100.0 * np.linspace(0.0, 1.0, n + 1) ** power


def thin(breaks, rows, t, symmetric=False):
    """Plate clamped at y = 0, free at y = 100; ``symmetric``: half of it, x = 0 being the plane of symmetry."""
    grid = from_map(breaks, rows, [0.0, t], lambda p: p)
    held = np.zeros((len(grid.nodes), 3), dtype=bool)
    held[grid.side("j-")] = True
    if symmetric:
        held[grid.side("i-"), 0] = True
    return factorise(SolidWorkpiece(grid, E, NU, RHO, held, rule=8))


def plate_stiffness(t):
    return E * t**3 / (12.0 * (1.0 - NU**2))


def kirchhoff_strip(x):
    """w D / (P a^2) of the strip clamped at y = 0, P at the free edge: Fourier along x, closed form across."""

    def transform(k):
        s, c = np.sinh(k), np.cosh(k)
        g1 = [s - k * c, -k * k * s, -k * k * (s + k * c), -(k**3) * (2.0 * c + k * s)]
        g2 = [k * s, k * (s + k * c), k * k * (2.0 * c + k * s), k**3 * (3.0 * s + k * c)]
        free = [[g[2] - NU * k * k * g[0], g[3] - (2.0 - NU) * k * k * g[1]] for g in (g1, g2)]
        return np.linalg.solve(np.array(free).T, [0.0, -1.0]) @ [g1[0], g2[0]]

    return quad(lambda k: transform(k) * np.cos(k * x), 1e-6, 60.0, limit=800, epsabs=1e-9)[0] / np.pi


def test_cantilever_beam():
    """Tip force at the middle of the section: a^3 / (3 E I), shear 0.02 % of it."""
    grid = plate(100.0, 2.0, 2.0, (20, 2, 2))
    f = factorise(SolidWorkpiece(grid, E, NU, RHO, grid.side("i-"), rule=8))
    tip = on_side(grid, "i+", 0.5, 0.5)
    C = full_compliance(f, tip)[0]
    bending = 100.0**3 / (3.0 * E * 2.0**4 / 12.0)
    assert C[1, 1] == pytest.approx(bending, rel=0.005)
    assert C[2, 2] == pytest.approx(bending, rel=0.005)
    assert compliance(f, tip, [[0.0, 0.6, 0.8]])[0] == pytest.approx(
        0.36 * C[1, 1] + 0.96 * C[1, 2] + 0.64 * C[2, 2], rel=1e-9
    )
    f = factorise(SolidWorkpiece(grid, E, NU, RHO, grid.side("i-")))
    force = np.zeros(grid.nodes.shape)
    face = loads(f, tip, np.array([[1.0, 0.0, 0.0]]))
    force.ravel()[f.free] = 50.0 * face.toarray()[:, 0]
    stretch = displacement(f, force)[:, 0]
    length = stretch[grid.lattice[30, 2, 2]] - stretch[grid.lattice[10, 2, 2]]
    assert length == pytest.approx(50.0 * 50.0 / (E * 4.0), rel=1e-4)


@pytest.mark.parametrize(("width", "middle", "corner"), [(1.0, 0.3615, 0.4911), (2.0, 0.2114, 0.4195)])
def test_cantilever_plate(width, middle, corner):
    """Middle and corner of the free edge; the corner bears about half."""
    t = 0.5
    f = thin(100.0 * width * np.linspace(0.0, 1.0, 21), towards_the_clamp(12), t)
    grid = f.solid.grid
    places = on_side(grid, "k+", [0.5, 0.0], [1.0, 1.0])
    value = compliance(f, places, normals_of(grid, places, "k+")) * plate_stiffness(t) / 100.0**2
    np.testing.assert_allclose(value, [middle, corner], rtol=0.005)


def test_long_strip():
    """At the force and 0.5, 1, 2 widths beside it; the spec's numbers are Kirchhoff's."""
    t, x = 0.5, np.array([0.0, 0.5, 1.0, 2.0])
    exact = [kirchhoff_strip(v) for v in x]
    np.testing.assert_allclose(exact, [0.16651, 0.12116, 0.06852, 0.01575], atol=6e-6)
    breaks = np.concatenate([np.arange(0.0, 300.0, 6.25), np.linspace(300.0, 600.0, 8)])
    f = thin(breaks, towards_the_clamp(12), t, symmetric=True)
    grid = f.solid.grid
    places = locate(grid, "k+", np.stack([100.0 * x, np.full(4, 100.0), np.full(4, t)], axis=1), 1e-6)
    F = loads(f, places, normals_of(grid, places, "k+"))
    w = 0.5 * (F.T @ f.solve(F[:, :1].toarray()))[:, 0] * plate_stiffness(t) / 100.0**2
    np.testing.assert_allclose(w, exact, rtol=0.005)


def test_map_of_a_wall():
    """Half height bears about 14 times what the corner threshold_of, mid-span."""
    f = thin(100.0 * np.linspace(0.0, 1.0, 17), towards_the_clamp(10), 1.0)
    places = locate(f.solid.grid, "k+", [[50.0, 50.0, 1.0], [0.0, 100.0, 1.0], [50.0, 100.0, 1.0]], 1e-6)
    half, corner, middle = compliance(f, places, normals_of(f.solid.grid, places, "k+"))
    assert 9.0 < corner / half < 15.0
    assert 1.3 < corner / middle < 2.0


def test_curved_wall_by_two_meshes():
    """A quarter of a tube, clamped below: what forces do elsewhere converges, and is the same seen from both ends."""

    def wall(n):
        def place(p):
            r, a = 40.0 + 2.0 * p[:, 2], 0.5 * np.pi * p[:, 0]
            return np.stack([r * np.sin(a), 30.0 * p[:, 1], r * np.cos(a)], axis=1)

        grid = from_map(np.linspace(0, 1, 2 * n + 1), np.linspace(0, 1, n + 1) ** 1.5, [0.0, 1.0], place)
        f = factorise(SolidWorkpiece(grid, E, NU, RHO, grid.side("j-"), rule=8))
        places = on_side(grid, "k-", [0.2, 0.5, 0.8], [0.9, 0.9, 0.9])
        F = loads(f, places, normals_of(grid, places, "k-")).toarray()
        return F.T @ f.solve(F)

    coarse, fine = wall(6), wall(10)
    away = ~np.eye(3, dtype=bool)
    np.testing.assert_allclose(coarse[away], fine[away], rtol=0.02)
    np.testing.assert_allclose(fine, fine[::-1, ::-1], rtol=1e-4)


def test_thinned_plate_is_the_thinner_mesh():
    counts, side = (6, 4, 1), "k-"
    thick, exact = plate(60.0, 40.0, 4.0, counts), plate(60.0, 40.0, 2.7, counts)
    places = on_side(exact, side, [0.1, 0.5, 0.93], [0.9, 1.0, 0.4])
    n = normals_of(exact, places, side)
    kept = np.tile([0.0, 0.675], (24, 1))
    cut = factorise(SolidWorkpiece(thick, E, NU, RHO, thick.side("j-"), kept=kept))
    other = factorise(SolidWorkpiece(exact, E, NU, RHO, exact.side("j-")))
    np.testing.assert_allclose(compliance(cut, places, n), compliance(other, places, n), rtol=1e-9)


def test_elements_that_are_gone():
    """Gone in the upper half: the shorter plate."""
    long, short = plate(60.0, 40.0, 2.0, (6, 4, 1)), plate(60.0, 20.0, 2.0, (6, 2, 1))
    kept = np.tile([0.0, 1.0], (24, 1))
    kept[long.element(*np.meshgrid(np.arange(6), [2, 3], [0])).ravel()] = 0.0
    a = factorise(SolidWorkpiece(long, E, NU, RHO, long.side("j-"), kept=kept))
    b = factorise(SolidWorkpiece(short, E, NU, RHO, short.side("j-")))
    at = [[13.0, 18.0, 2.0], [60.0, 20.0, 2.0]]
    values = []
    for f in (a, b):
        places = locate(f.solid.grid, "k+", at, 1e-9)
        values.append(compliance(f, places, normals_of(f.solid.grid, places, "k+")))
    np.testing.assert_allclose(*values, rtol=1e-9)


GRID = plate(10.0, 10.0, 1.0, (3, 2, 1))


@pytest.mark.parametrize(
    ("fixed", "motions"),
    [
        ([], "along x, along y, along z, about x, about y, about z: 6 rigid"),
        ([0], "about x, about y, about z: 3 rigid"),
        (GRID.lattice[0, :, 0], "about y: 1 rigid"),
    ],
)
def test_a_mechanism_is_named(fixed, motions):
    if len(fixed) == 1:
        fixed = [int(np.argmin(np.linalg.norm(GRID.nodes - GRID.nodes.mean(axis=0), axis=1)))]
    with pytest.raises(InputError) as err:
        factorise(SolidWorkpiece(GRID, E, NU, RHO, np.array(fixed, dtype=np.int64)))
    assert str(err.value).startswith("workpiece: not held against motion ")
    if len(fixed) != 1:
        assert motions in str(err.value)
    assert "3 rigid" in str(err.value) or len(fixed) != 1


def test_a_loose_piece_is_named():
    kept = np.tile([0.0, 1.0], (6, 1))
    kept[GRID.element(1, np.arange(2), 0)] = 0.0
    with pytest.raises(InputError, match="the piece of element 4: not held against motion along x, along y"):
        factorise(SolidWorkpiece(GRID, E, NU, RHO, GRID.side("i-"), kept=kept))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"modulus": 2.1e11}, r"workpiece.modulus = 2.1e\+11 MPa: must be from 100 to 2e\+06 MPa; is it in Pa\?"),
        ({"modulus": 69.0}, r"workpiece.modulus = 69 MPa: must be from 100 to 2e\+06 MPa; is it in GPa\?"),
        ({"density": 7850.0}, r"workpiece.density = 7850 tonne/mm\^3: must be from 1e-10 to 3e-08; is it in kg/m\^3"),
        ({"poisson": 0.5}, "workpiece.poisson = 0.5: must be at least 0 and below 0.5"),
        ({"modulus": float("nan")}, "workpiece.modulus = nan"),
        ({"fixed": np.array([400])}, r"workpiece.fixed: a node outside 0 .. \d+"),
        ({"fixed": np.zeros((3, 3), dtype=bool)}, r"workpiece.fixed of shape \(3, 3\)"),
        ({"kept": np.zeros((2, 2))}, r"workpiece.kept of shape \(2, 2\): must be \(6, 2\)"),
        ({"kept": np.tile([0.5, 0.2], (6, 1))}, r"workpiece.kept of element 0 = \[0.5, 0.2\]"),
    ],
)
def test_refused(change, message):
    given = {"modulus": E, "poisson": NU, "density": RHO, "fixed": GRID.side("j-"), **change}
    with pytest.raises(InputError, match=message):
        SolidWorkpiece(GRID, **given)


def test_refused_forces():
    f = factorise(SolidWorkpiece(GRID, E, NU, RHO, GRID.side("j-")))
    places = on_side(GRID, "k+", 0.5, 0.5)
    with pytest.raises(InputError, match=r"normals of shape \(1, 3\): must be unit vectors"):
        compliance(f, places, [[0.0, 0.0, 2.0]])
    with pytest.raises(InputError, match=r"force of shape \(3,\): must be finite"):
        displacement(f, [0.0, 0.0, 1.0])
