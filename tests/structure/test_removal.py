"""Low-rank corrections against assembling, factoring and solving anew."""

from __future__ import annotations

import numpy as np
import pytest

from chipload.errors import InputError
from chipload.structure.grid import from_map, plate
from chipload.structure.places import MeshPlaces, normals_of, on_cut, on_side
from chipload.structure.removal import cut, prepare, start
from chipload.structure.solid import SolidWorkpiece, factorise
from chipload.structure.solid import compliance as solved
from chipload.structure.solid import full_compliance as solved_full
from chipload.structure.unit_loads import alive, compliance, cut_compliance, watch

E, NU, RHO = 1.14e5, 0.34, 4.43e-9


def wall(layers=2):
    grid = plate(60.0, 40.0, 4.0, (6, 5, layers))
    return SolidWorkpiece(grid, E, NU, RHO, grid.side("j-"))


def blade():
    """Twisted, tapered: nothing is flat or alike."""

    def place(p):
        t = (4.0 - 2.0 * p[:, 1]) * (0.4 + 2.4 * p[:, 0] * (1.0 - p[:, 0]))
        x, z = 40.0 * (p[:, 0] - 0.5), (p[:, 2] - 0.5) * t
        a = 0.5 * p[:, 1]
        return np.stack([x * np.cos(a) - z * np.sin(a), 50.0 * p[:, 1], -x * np.sin(a) - z * np.cos(a)], axis=1) * [
            1.0,
            1.0,
            -1.0,
        ]

    grid = from_map(np.linspace(0, 1, 6), np.linspace(0, 1, 6), np.linspace(0, 1, 4), place)
    return SolidWorkpiece(grid, E, NU, RHO, grid.side("j-"))


def seen(solid, side="k-", n=7):
    grid = solid.grid
    places = on_side(grid, side, np.linspace(0.03, 0.97, n), np.linspace(0.99, 0.35, n))
    return places, normals_of(grid, places, side)


def row(grid, j, k, some=slice(None)):
    i = np.arange(grid.counts[0])[some]
    return grid.element(i, np.full(len(i), j), np.full(len(i), k))


@pytest.mark.parametrize("x", [0.3, 0.9, 0.999])
def test_thinned_and_gone(x):
    """A row gone, half of the next thinned by x: normal and full compliance to 1e-9 of a new solution."""
    solid = wall()
    state = start(solid, limit=10**6)
    places, n = seen(solid)
    normal, full = watch(state, places, n), watch(state, places)
    state = cut(cut(state, row(solid.grid, 4, 1)), row(solid.grid, 3, 1, slice(4)), (0.0, 1.0 - x))
    anew = factorise(state.solid)
    assert state.factorisations == 1
    assert 0 < state.rank < 400
    np.testing.assert_allclose(compliance(state, normal), solved(anew, places, n), rtol=1e-9)
    exact = solved_full(anew, places)
    np.testing.assert_allclose(compliance(state, full), exact, rtol=0.0, atol=1e-9 * abs(exact).max())


def test_cut_beside_the_clamp():
    """Elements that the clamp holds, thinned and gone: to 1e-9 of a new solution."""
    solid = wall()
    state = start(solid, limit=10**6)
    places, n = seen(solid)
    normal = watch(state, places, n)
    state = cut(cut(state, row(solid.grid, 0, 1, slice(2))), row(solid.grid, 0, 1, slice(2, 5)), (0.0, 0.4))
    np.testing.assert_allclose(compliance(state, normal), solved(factorise(state.solid), places, n), rtol=1e-9)


@pytest.mark.parametrize(("make", "limit"), [(wall, 350), (blade, 250)])
def test_any_order_of_cuts(make, limit):
    """Random thinning, many times: each state to 1e-9; the rank alone says when it is factored again."""
    solid = make()
    rng = np.random.default_rng(8)
    state = start(solid, limit=limit)
    places, n = seen(solid)
    watched = watch(state, places, n)
    checked, outer = 0, solid.grid.counts[2] - 1
    for _ in range(7):
        elements = rng.choice(row(solid.grid, int(rng.integers(1, 5)), outer), 3, replace=False)
        kept = state.solid.kept[elements] * [1.0, rng.uniform(0.5, 0.95)]
        before = state.factorisations
        state = cut(state, elements, kept)
        if state.factorisations > before:
            assert state.rank == 0
            watched = watch(state, places, n)
        assert state.rank <= limit
        np.testing.assert_allclose(compliance(state, watched), solved(factorise(state.solid), places, n), rtol=1e-9)
        checked += state.rank > 0
    assert checked >= 3
    assert state.factorisations >= 2


def test_on_the_cut_faces():
    """Forces on faces that the cut left, and on the far face of a cut wall of one layer: without a solution."""
    solid = wall(layers=1)
    elements = row(solid.grid, 4, 0)
    state = cut(start(solid, limit=10**6), elements, (0.0, 0.4))
    outer, n = seen(solid, "k+", 5)
    outer = MeshPlaces(np.sort(elements)[:5], outer.local)
    cutted = on_cut(outer, state.solid.kept, "k+")
    anew = factorise(state.solid)
    np.testing.assert_allclose(cut_compliance(state, cutted, n), solved(anew, cutted, n), rtol=1e-9)
    exact = solved_full(anew, cutted)
    np.testing.assert_allclose(cut_compliance(state, cutted), exact, rtol=0.0, atol=1e-9 * abs(exact).max())
    assert len(state.columns.known) == state.rank
    places, normals = seen(solid, "k-")
    watched = watch(state, places, normals)
    np.testing.assert_allclose(compliance(state, watched), solved(anew, places, normals), rtol=1e-9)
    with pytest.raises(InputError, match="element 0 was not cut since the last factorisation: watch the place instead"):
        cut_compliance(state, MeshPlaces(np.array([0]), np.zeros((1, 3))), [[0.0, 0.0, 1.0]])


def test_prepared_columns_serve_every_cut():
    """Nothing more is solved after ``prepare``; the region bounds what is kept."""
    solid = wall()
    region = np.concatenate([row(solid.grid, j, 1) for j in (2, 3, 4)])
    ready = prepare(start(solid, region, limit=10**6))
    known = len(ready.columns.known)
    assert known == len(ready.columns.rows) < 3 * len(solid.grid.nodes)
    places, n = seen(solid)
    watched = watch(ready, places, n)
    state = ready
    for j in (4, 3):
        state = cut(state, row(solid.grid, j, 1))
        assert len(state.columns.known) == known
        np.testing.assert_allclose(compliance(state, watched), solved(factorise(state.solid), places, n), rtol=1e-9)
    np.testing.assert_allclose(compliance(ready, watched), solved(factorise(solid), places, n), rtol=1e-12)


def test_a_wall_yields_more_the_less_is_left():
    solid = wall()
    state = start(solid, limit=10**6)
    places, n = seen(solid)
    watched = watch(state, places, n)
    values = [compliance(state, watched)]
    for j in (4, 3, 2):
        state = cut(state, row(solid.grid, j, 1), (0.0, 0.5))
        values.append(compliance(state, watched))
    assert (np.diff(values, axis=0) > 0.0).all()


def test_forces_on_what_is_gone():
    solid = wall()
    state = start(solid, limit=10**6)
    places, n = seen(solid, "k+")
    watched = watch(state, places, n)
    state = cut(state, row(solid.grid, 4, 1))
    living = alive(state, watched)
    np.testing.assert_array_equal(living, np.linspace(0.99, 0.35, 7) <= 0.8)
    with pytest.raises(InputError, match="compliance: place 0 is on material that is gone: leave it out"):
        compliance(state, watched)
    kept = MeshPlaces(places.element[living], places.local[living])
    np.testing.assert_allclose(
        compliance(state, watch(state, kept, n[living])), solved(factorise(state.solid), kept, n[living]), rtol=1e-9
    )


def test_refused():
    solid = wall()
    state = start(solid, row(solid.grid, 4, 1), limit=10**6)
    places, n = seen(solid)
    with pytest.raises(InputError, match="cut: element 0 is not in the region of this removal"):
        cut(state, 0)
    thin = cut(state, row(solid.grid, 4, 1), (0.0, 0.5))
    e = int(row(solid.grid, 4, 1)[0])
    with pytest.raises(InputError, match=rf"cut: element {e} keeps \[0.0, 0.6\] of its thickness, had \[0.0, 0.5\]"):
        cut(thin, e, (0.0, 0.6))
    with pytest.raises(InputError, match=r"removal.region: an element outside 0 .. 59"):
        start(solid, [60])
    free = start(solid, limit=10**6)
    through = np.concatenate([row(solid.grid, 2, 0), row(solid.grid, 2, 1)])
    with pytest.raises(InputError, match="the piece of element 6: not held against motion along x, along y, along z"):
        cut(free, through)
    hinge = [*row(solid.grid, 3, 0, slice(5)), *row(solid.grid, 3, 1, slice(5))]
    hinge += [*row(solid.grid, 4, 0, slice(5, 6)), *row(solid.grid, 4, 1, slice(5, 6))]
    with pytest.raises(InputError, match="a piece of the workpiece would hang on a hinge of nodes"):
        cut(free, hinge)
    with pytest.raises(InputError, match="a piece of the workpiece hangs on a hinge of nodes"):
        cut(start(solid, limit=0), hinge)
    other = start(solid)
    with pytest.raises(InputError, match="watch the places again"):
        compliance(other, watch(state, places, n))
