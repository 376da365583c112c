"""Frequencies against waves in a box, a free plate, and the order of convergence."""

from __future__ import annotations

import numpy as np
import pytest

from chipload.errors import InputError
from chipload.structure.grid import from_map, plate
from chipload.structure.modes import modes
from chipload.structure.solid import SolidWorkpiece, factorise

E, NU, RHO = 1.1e5, 0.34, 4.43e-9
SIZE = np.array([30.0, 20.0, 10.0])


def box(n):
    """A box between smooth rigid walls: normal motion held, nothing else; inner nodes crooked."""

    def place(p):
        x = p * SIZE
        bump = np.prod(np.sin(np.pi * p), axis=1)
        return x + bump[:, None] * [1.5, -1.0, 0.5]

    t = np.linspace(0.0, 1.0, n + 1)
    grid = from_map(t, t, t, place)
    held = np.zeros((len(grid.nodes), 3), dtype=bool)
    for c, sides in enumerate((("i-", "i+"), ("j-", "j+"), ("k-", "k+"))):
        for side in sides:
            held[grid.side(side), c] = True
    return factorise(SolidWorkpiece(grid, E, NU, RHO, held))


def test_shear_wave_and_order_of_convergence():
    """The lowest wave runs along x and y with c_s; quadratic elements: frequencies of fourth order."""
    exact = 0.5 * np.sqrt(E / (2 * (1 + NU)) / RHO) * np.hypot(1 / 30.0, 1 / 20.0)
    errors = np.array([modes(box(n), 1)[0][0] / exact - 1.0 for n in (2, 3, 4, 6)])
    assert (errors > 0.0).all()
    assert errors[-1] < 4e-4
    orders = np.log(errors[:-1] / errors[1:]) / np.log([3 / 2, 4 / 3, 6 / 4])
    assert (orders[1:] > 3.6).all()


def test_free_plate_has_six_rigid_motions():
    grid = plate(100.0, 80.0, 3.0, (6, 5, 1))
    free = SolidWorkpiece(grid, E, NU, RHO, np.zeros(0, dtype=np.int64))
    f, shapes = modes(free, 8, shift=(2.0 * np.pi * 500.0) ** 2)
    assert (f[:6] < 1e-3 * f[6]).all()
    assert f[6] > 100.0
    x = grid.nodes - grid.nodes.mean(axis=0)
    rigid = [np.tile(a, (len(x), 1)) for a in np.eye(3)] + [np.cross(a, x) for a in np.eye(3)]
    basis = np.stack([r.ravel() for r in rigid], axis=1)
    flat = shapes[:6].reshape(6, -1).T
    rest = flat - basis @ np.linalg.lstsq(basis, flat, rcond=None)[0]
    assert abs(rest).max() < 1e-6 * abs(flat).max()


def test_a_heavier_wall_without_its_top():
    """Taking the top raises the first frequency by the square of the height."""
    grid = plate(20.0, 100.0, 2.0, (2, 10, 1))
    kept = np.tile([0.0, 1.0], (20, 1))
    kept[grid.element(*np.meshgrid(np.arange(2), np.arange(5, 10), [0])).ravel()] = 0.0
    full = modes(factorise(SolidWorkpiece(grid, E, 0.0, RHO, grid.side("j-"), rule=8)), 1)[0][0]
    half = modes(factorise(SolidWorkpiece(grid, E, 0.0, RHO, grid.side("j-"), kept=kept, rule=8)), 1)[0][0]
    beam = 1.8751**2 / (2 * np.pi * 100.0**2) * np.sqrt(E * 4.0 / 12.0 / RHO)
    assert full == pytest.approx(beam, rel=0.005)
    assert half / full == pytest.approx(4.0, rel=0.01)


def test_refused():
    grid = plate(10.0, 10.0, 1.0, (1, 1, 1))
    free = SolidWorkpiece(grid, E, NU, RHO, np.zeros(0, dtype=np.int64))
    with pytest.raises(InputError, match="modes: shift = 0 needs a factored part"):
        modes(free, 3)
    with pytest.raises(InputError, match="modes: count = 60: must be from 1 to 59"):
        modes(free, 60, shift=1.0)
    with pytest.raises(InputError, match="modes: shift = -1: must be at least 0"):
        modes(free, 3, shift=-1.0)
