"""Deflection of finished blades: a long plate by the closed form, a blade turned, rows on and off it."""

from __future__ import annotations

import math

import numpy as np
import pytest

from chipload.geometry.bspline import patch_through
from chipload.geometry.sections import Blade
from chipload.jobs.impeller.blade_deflection import ElasticBlades, blade_deflections
from chipload.jobs.impeller.elastic_blade import elastic_blade

#: a plate along x, clamped along z = 0 [mm], of aluminium [MPa]
LENGTH, HEIGHT, THICK, MODULUS, POISSON = 80.0, 10.0, 1.0, 70e3, 0.3
#: [Jaramillo1950]: a force at the free edge of a long cantilever plate, w = 0.168 F H^2 / D [mm/N]
EDGE = 0.168 * HEIGHT**2 / (MODULUS * THICK**3 / 12.0 / (1.0 - POISSON**2))


def side(y: float, low: float = 0.0, high: float = HEIGHT):
    grid = [[[x, y, z] for z in (low, high)] for x in (0.0, LENGTH)]
    return patch_through(grid, [0, 1], [0, 1])


@pytest.fixture(scope="module")
def plate():
    return elastic_blade(Blade(side(0.5 * THICK), side(-0.5 * THICK)), None, MODULUS, POISSON)


def at_the_edge(blade, x: float = 0.5 * LENGTH):
    return int(np.linalg.norm(blade.points - (x, 0.5 * THICK, HEIGHT), axis=1).argmin())


def test_a_long_plate_gives_as_the_closed_form_says(plate) -> None:
    gives = plate.gives[at_the_edge(plate)]
    assert gives[1] == pytest.approx(EDGE, rel=0.03)
    assert abs(gives[0]) < 1e-3 * EDGE
    assert 0.0 < plate.error < 0.05
    # a half plate's corner is softer than the middle of its edge, its foot does not give
    norm = np.linalg.norm(plate.gives, axis=1)
    assert norm[at_the_edge(plate, 0.0)] > 2.0 * EDGE
    assert norm[plate.points[:, 2] < 1e-9].max() < 1e-9


def test_a_fillet_without_width_is_a_higher_plate(plate) -> None:
    """What stands below the sides bends too: a plate of 8 mm on a straight fillet of 2 mm is one of 10 mm."""
    upper = Blade(side(0.5 * THICK, 2.0), side(-0.5 * THICK, 2.0))
    lower = Blade(side(0.5 * THICK, 0.0, 2.0), side(-0.5 * THICK, 0.0, 2.0))
    both = elastic_blade(upper, lower, MODULUS, POISSON)
    assert both.gives[at_the_edge(both)] == pytest.approx(plate.gives[at_the_edge(plate)], rel=0.02, abs=1e-6)


def row(force):
    """Loads of one step, in which the force on the cutter does not change."""
    columns = {f"force_{x}_{key}_n": np.array([f]) for x, f in zip("xyz", force, strict=True) for key in KEYS}
    return columns | {"force_n": np.array([float(np.linalg.norm(force))])}


KEYS = ("mean", "min", "max")


@pytest.mark.parametrize("angle", [0.0, 1.0])
def test_a_force_at_the_edge_bends_by_the_closed_form(plate, angle) -> None:
    """A contact line at the edge of the plate, pressed across it; also of the plate turned about z."""
    c, s = math.cos(angle), math.sin(angle)
    R = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    blades = ElasticBlades((plate.turned(angle),), 0.1)
    line = np.array([[0.5 * LENGTH, 0.5 * THICK, HEIGHT - 0.2], [0.5 * LENGTH, 0.5 * THICK, HEIGHT]])
    across = row(R @ (0.0, 100.0, 0.0))
    (most,), (least,) = blade_deflections(across, (line @ R.T)[None], 2.0, blades)
    # the bound is that of any of the points that are near
    assert 0.97 * 100.0 * EDGE < least <= most < 1.05 * 100.0 * EDGE
    # along the plate it does not bend; farther away than the cutter's radius nothing presses
    assert blade_deflections(row(R @ (100.0, 0.0, 0.0)), (line @ R.T)[None], 2.0, blades)[0][0] < 0.02 * most
    off = (line + np.array([0.0, 2.0 + 2.0 * plate.spacing, 0.0])) @ R.T
    assert blade_deflections(across, off[None], 2.0, blades)[0][0] == 0.0
    assert blade_deflections(across, np.full((1, 2, 3), np.nan), 2.0, blades)[0][0] == 0.0
    # a line from the foot to the edge is bounded by the edge, and at least nothing
    whole = np.array([[0.5 * LENGTH, 0.5 * THICK, 0.0], line[1]])
    (bound,), _ = blade_deflections(across, (whole @ R.T)[None], 2.0, blades)
    assert bound == pytest.approx(most, rel=1e-9)
    # a force between two values bends by the worse of them
    columns = row(R @ (0.0, 100.0, 0.0)) | {f"force_{x}_min_n": np.zeros(1) for x in "xyz"}
    assert blade_deflections(columns, (line @ R.T)[None], 2.0, blades)[0][0] >= 0.999 * most
