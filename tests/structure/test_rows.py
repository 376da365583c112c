"""A pass row by row, every state against a workpiece that is assembled and factored for it alone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from chipload.errors import InputError
from chipload.structure.grid import from_map
from chipload.structure.places import MeshPlaces, normals_of, on_cut, on_side
from chipload.structure.solid import SolidWorkpiece, compliance, factorise, full_compliance
from row_elimination import row_compliances


def twisted(layers: int) -> SolidWorkpiece:
    """A crooked plate, clamped below: 5 columns, 4 rows."""

    def place(p: np.ndarray) -> np.ndarray:
        x, y, z = p.T
        return np.column_stack([x + 0.1 * y, y + 0.02 * x * x / 10.0, z * (1.0 + 0.02 * y) + 0.01 * x * y])

    breaks = [0.0, 2.0, 3.0] if layers == 2 else [0.0, 3.0]
    grid = from_map(np.linspace(0.0, 20.0, 6).tolist(), [0.0, 2.0, 5.0, 8.0, 12.0], breaks, place)
    return SolidWorkpiece(grid, 1.14e5, 0.34, 4.43e-9, grid.side("j-"))


def rows_of(solid: SolidWorkpiece, axis: int) -> np.ndarray:
    """Elements (rows, .) along an axis."""
    numbers = np.arange(len(solid.grid.elements)).reshape(solid.grid.counts)
    return np.moveaxis(numbers, axis, 0).reshape(solid.grid.counts[axis], -1)


def state(solid: SolidWorkpiece, after: np.ndarray, axis: int, end: int, cut: int) -> SolidWorkpiece:
    rows = rows_of(solid, axis)
    rows = rows[::-1] if end else rows
    kept = solid.kept.copy()
    some = rows[:cut].ravel()
    kept[some] = after[some]
    return replace(solid, kept=kept)


@pytest.mark.parametrize("side", ["j+", "j-", "i+", "i-"])
def test_layer_gone_row_by_row_equals_factoring_every_state(side: str) -> None:
    solid = twisted(2)
    after = np.tile([0.0, 1.0], (len(solid.grid.elements), 1))
    after[solid.grid.element(*np.indices((5, 4)).reshape(2, -1), 1)] = 0.0
    places = on_side(solid.grid, "k-", [0.0, 0.3, 0.5, 0.9, 1.0], [1.0, 0.5, 0.75, 0.3, 0.6])
    n = normals_of(solid.grid, places, "k-")
    axis, end = "ij".index(side[0]), side[1] == "+"
    found = row_compliances(solid, after, places, n, side=side)
    expected = [compliance(factorise(state(solid, after, axis, end, c)), places, n) for c in range(len(found))]
    np.testing.assert_allclose(found, expected, rtol=1e-9)
    assert (np.diff(found, axis=0) > 0.0).any()


def test_thinned_rows_and_places_on_the_face_that_is_cut() -> None:
    """Whole compliance; a state asked for alone is the same one."""
    solid = twisted(1)
    rng = np.random.default_rng(7)
    after = np.column_stack([np.zeros(20), rng.uniform(0.4, 0.8, 20)])
    places = on_side(solid.grid, "k+", [0.0, 0.3, 0.5, 1.0], [1.0, 0.4, 0.8, 0.55])
    later = on_cut(places, after, "k+")
    found = row_compliances(solid, after, places, side="j+", places_after=later)
    row = places.element % 4
    for c in range(5):
        now = state(solid, after, 1, 1, c)
        local = np.where((row >= 4 - c)[:, None], later.local, places.local)
        np.testing.assert_allclose(
            found[c], full_compliance(factorise(now), MeshPlaces(places.element, local)), rtol=1e-9, atol=1e-15
        )
    some = row_compliances(solid, after, places, side="j+", places_after=later, cut=[1, 3])
    np.testing.assert_allclose(some, found[[1, 3]], rtol=1e-12)


def test_what_can_not_be_is_refused() -> None:
    solid = twisted(2)
    whole = np.tile([0.0, 1.0], (40, 1))
    places = on_side(solid.grid, "k+", [0.5], [0.9])
    n = normals_of(solid.grid, places, "k+")
    gone = whole.copy()
    gone[solid.grid.element(*np.indices((5, 4)).reshape(2, -1), 1)] = 0.0
    with pytest.raises(InputError, match="row_compliances: place 0 is on material that is gone: leave it out"):
        row_compliances(solid, gone, places, n, side="j+")
    with pytest.raises(InputError, match=r"element 0 keeps \[0.0, 1.0\] of its thickness, had \[0.0, 0.5\]"):
        row_compliances(replace(solid, kept=0.5 * whole), whole, places, n, side="j+")
    with pytest.raises(InputError, match=r"cut must rise within 0 .. 4, the rows along j"):
        row_compliances(solid, gone, places, n, side="j+", cut=[5])
    through = whole.copy()
    through[rows_of(solid, 1)[1]] = 0.0
    with pytest.raises(InputError, match="not held against motion along x, along y, along z"):
        row_compliances(solid, through, places, n, side="j+")
