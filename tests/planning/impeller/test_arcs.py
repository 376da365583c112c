"""Forbidden arcs of single check points, against the closed form at many pallet angles; random clouds of points."""

import math

import numpy as np
import pytest

from chipload.cutter.catalogue import CatalogueCutter
from chipload.planning.impeller import _largest_cutter
from chipload.planning.impeller.closed_form import axis_at, contact_limit, rho_limits
from chipload.planning.impeller.pallet_ranges import valid_ranges
from chipload.planning.impeller.scene import Scene
from chipload.planning.impeller.search import limits

LEAST = 1e-9
PLAIN = np.array([[0.0, 0.0]])


def one(rng, check, bend=0.0):
    """A contact point with a random normal and check points of another surface."""
    N = rng.normal(size=3)
    N /= np.linalg.norm(N)
    P = np.eye(3) - np.outer(N, N)
    A = rng.normal(size=(3, 3)) * bend
    K = P @ (A + A.T) @ P
    none = np.zeros(1, int)
    return Scene(np.zeros((1, 3)), N[None], K[None], none, check, np.ones(len(check), int), 0.0)


def arcs_of(s, point, table, rho, r):
    out = np.empty((64, 2))
    cone = np.array([math.sin(table), math.cos(table)])
    count = _largest_cutter.point_arcs(
        s.check, point, s.rows[0], cone, rho, r, PLAIN, 0.0, 2.0 * math.pi, LEAST, out, 0
    )
    return out[:count]


def inside(arcs, B):
    hit = np.zeros(len(B), dtype=bool)
    for lo, hi in arcs:
        hit |= (lo < B) & (hi > B)
    return hit


def limits_at(s, T, r):
    return np.array([rho_limits(s.check, s.contact[0], s.normal[0], t, r).min() for t in T])


@pytest.mark.parametrize("family", ["corner", "ball", "sharp"])
def test_arcs_of_a_point(family):
    rng = np.random.default_rng({"corner": 1, "ball": 2, "sharp": 3}[family])
    B = np.linspace(0.0, 2.0 * math.pi, 360, endpoint=False) + 1e-3
    both = 0
    for _ in range(90):
        s = one(rng, rng.normal(size=(1, 3)) * rng.uniform(2.0, 15.0))
        r = 0.0 if family == "sharp" else rng.uniform(0.5, 4.0)
        rho = 0.0 if family == "ball" else rng.uniform(0.5, 12.0)
        table = rng.uniform(0.1, 0.5 * math.pi)
        bound = limits_at(s, axis_at(table, B), r)
        found = inside(arcs_of(s, 0, table, rho, r), B)
        sure = np.abs(bound - rho) > 1e-6
        np.testing.assert_array_equal(found[sure], bound[sure] < rho)
        both += found.any() and not found.all()
    assert both > 12


def test_arcs_of_the_curvature():
    rng = np.random.default_rng(4)
    B = np.linspace(0.0, 2.0 * math.pi, 360, endpoint=False) + 1e-3
    both = 0
    for _ in range(60):
        s = one(rng, np.full((1, 3), 500.0), bend=0.04)
        r, rho, table = rng.uniform(0.5, 2.0), rng.uniform(1.0, 12.0), rng.uniform(0.1, 0.5 * math.pi)
        T = axis_at(table, B)
        bound = np.array([contact_limit(s.normal[0], t, r, s.curvature[0]) for t in T])
        found = inside(arcs_of(s, -2, table, rho, r), B)
        sure = np.abs(bound - rho) > 1e-6
        np.testing.assert_array_equal(found[sure], bound[sure] < rho)
        both += found.any() and not found.all()
    assert both > 12


@pytest.mark.parametrize("seed", range(4))
def test_hollow(seed):
    # a dented bowl, open above: the corner is held by its floor as often as the flank by its rim
    rng = np.random.default_rng(seed)
    out = rng.normal(size=(3000, 3))
    out /= np.linalg.norm(out, axis=1)[:, None]
    bowl = out * (16.0 + rng.normal(scale=0.3, size=(3000, 1)))
    N = np.array([-math.cos(0.3 * seed), 0.1 * seed, 0.2])
    N /= np.linalg.norm(N)
    centre = 14.0 * N + rng.normal(size=3)
    bowl = bowl[bowl[:, 2] < 4.0] + centre
    none = np.zeros(1, int)
    s = Scene(np.zeros((1, 3)), N[None], np.zeros((1, 3, 3)), none, bowl, np.ones(len(bowl), int), 0.0)
    table, r = 0.4 + 0.1 * seed, 5.0
    found = limits(s, [table], r, 20.0)
    B = np.linspace(0.0, 2.0 * math.pi, 1800, endpoint=False) + 1e-4
    T = axis_at(table, B)
    bound = limits_at(s, T, r)
    bound[T @ N < 0.0] = -np.inf
    assert found.rho[0, 0] > 1.0
    assert bound.max() <= found.bound[0, 0]
    assert bound.max() == pytest.approx(found.rho[0, 0], abs=0.05)
    tree, cone, tool = s.tree, np.array([math.sin(table), math.cos(table)]), np.array([r, math.inf, 0.0])
    points, own = s.check[tree.order], s.check_surface[tree.order]
    for k in np.flatnonzero(np.isfinite(bound))[::7]:
        one_limit, _ = _largest_cutter.largest_at(
            points, own, tree.nodes, tree.spans, tree.leaves, s.rows[0], cone, tool, B[k], 1e9, -1,
            np.zeros(1, int), 0,
        )  # fmt: skip
        assert one_limit == pytest.approx(bound[k], abs=1e-9)
    for rho in (0.3, 0.6, 0.9) * found.rho[0]:
        got = valid_ranges(s, CatalogueCutter(2.0 * (rho + r), r), table).ranges[0]
        sure = np.abs(bound - rho) > 1e-6
        np.testing.assert_array_equal(inside(got, B)[sure], bound[sure] > rho)
