"""Compliance of a wall under a force that is spread over a contact line: a beam's closed form, and a sum of forces."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from chipload.cutter.cutter import Cutter
from chipload.errors import InputError
from chipload.planning.thinwall.blank import ContactLine, FinishSurface, WallBlank
from chipload.planning.thinwall.depth import DepthRange
from chipload.planning.thinwall.flank_rows import FlankSide
from chipload.planning.thinwall.flank_stock import FlankPose
from chipload.planning.thinwall.force_table import ForceTable
from chipload.planning.thinwall.passes import variable
from chipload.planning.thinwall.paths import place_rows
from chipload.planning.thinwall.threshold import modelled
from chipload.structure.grid import from_map
from chipload.structure.places import normals_of, on_cut, on_side, weights
from chipload.structure.solid import SolidWorkpiece, displacement, factorise

E = 70000.0
MILL = Cutter(8.0, 4, math.radians(30.0), 20.0, 30.0, 6e5, corner_radius=0.5)


def blank(width, height, thickness, counts, poisson=0.0):
    grid = from_map(
        np.linspace(0.0, width, counts[0] + 1).tolist(),
        np.linspace(0.0, height, counts[1] + 1).tolist(),
        [0.0, thickness],
        lambda p: p,
    )
    return WallBlank(SolidWorkpiece(grid, E, poisson, 2.7e-9, grid.side("j-")), (0.2, 0.2), 1, 1)


def test_beam():
    """The end of a cantilever under a force spread over a stretch of it: the mean of z^2 (3 L - z) / (6 E I)."""
    L, t, w, foot = 60.0, 2.4, 3.0, 60.0 / 16.0
    wall = blank(w, L, t, (1, 16))
    none = np.zeros(wall.shape)
    x = np.linspace(0.0, L, 3001)
    # the foot keeps its stock
    inertia = w * np.where(x < foot, t, 2.0) ** 3 / 12.0
    for line in (ContactLine(0.2, 0.2), ContactLine(0.3, 0.1)):
        got = wall.compliance((none, none), "k+", line).reshape(wall.shape).mean(axis=0)
        top, bottom = line.ends(np.linspace(0.0, 1.0, wall.shape[1]))
        for k in (3, 9, wall.shape[1] - 1):
            a, b = (foot + (L - foot) * end[k] for end in (bottom, top))
            z = np.linspace(a, b, 201)[:, None]
            bent = np.trapezoid(np.maximum(z - x, 0.0) * np.maximum(b - x, 0.0) / inertia, x, axis=1)
            assert_allclose(got[k], bent.mean() / E, rtol=0.02)


def test_sum_of_forces():
    """The upper end of a line under equal forces at 200 places of it, solved at once."""
    wall = blank(30.0, 20.0, 2.0, (5, 5), 0.3)
    left = (np.full(wall.shape, 0.1), np.zeros(wall.shape))
    line = ContactLine(0.25, 0.15)
    got = wall.compliance(left, "k-", line).reshape(wall.shape)
    solid = wall.state(left)
    factored = factorise(solid)
    top, bottom = line.ends(np.linspace(0.0, 1.0, wall.shape[1]))
    for i, k in ((0, 2), (2, 1), (5, 4)):
        share = bottom[k] + (top[k] - bottom[k]) * (np.arange(200) + 0.5) / 200
        acts, seen = (
            on_cut(on_side(solid.grid, "k-", np.full(len(s), i / 5), (1.0 + 4.0 * s) / 5.0), solid.kept, "k-")
            for s in (share, top[k : k + 1])
        )
        force = weights(solid.grid, acts).T @ (normals_of(solid.grid, acts, "k-") / 200.0)
        moved = weights(solid.grid, seen) @ displacement(factored, force)
        assert_allclose(got[i, k], float(moved[0] @ normals_of(solid.grid, seen, "k-")[0]), rtol=2e-3)


def test_lines_that_are_none():
    with pytest.raises(InputError, match="need 0 < length <= reach <= 1"):
        ContactLine(0.1, 0.2)


def side(rows=5, places=7):
    u, v = np.linspace(0.0, 1.0, places), np.linspace(0.2, 1.0, rows + 1)
    a, b = np.meshgrid(u, v, indexing="ij")
    points = np.stack([20.0 * a, 0.0 * a, 15.0 * b], axis=-1)
    return FlankSide(FinishSurface(points, np.broadcast_to([0.0, 1.0, 0.0], points.shape), 0.4), u, v)


def weaker_up(left, side):
    """Bears less towards the free edge, and least at its ends; the highest row reaches up to the edge."""
    u, v = np.meshgrid(np.linspace(-1.0, 1.0, 7), np.minimum(np.linspace(0.2, 1.0, 6), 0.84), indexing="ij")
    return modelled((0.02 / (40.0 / v**2 - 25.0 * u**2)).ravel(), 0.02)


def law():
    d = np.linspace(0.02, 0.4, 50)
    return ForceTable(DepthRange(0.02, 0.4), d, 200.0 * d)


@pytest.mark.parametrize("step", [2.4, -2.4])
def test_where_the_flank_stands(step):
    """Each row: the axis up, the flank as far from what it leaves as the radius, the tip a corner radius below the row;
    the wall on the right of the feed in down milling, seen along the axis. The flank never comes below rows before."""
    one, pose = side(), FlankPose(MILL, 0.05, step)
    plan = variable([one.surface], weaker_up, law(), 0.05, steps=True)
    assert len(plan.passes) > 1
    for p in plan.passes:
        for stock in (p.low, p.high):
            assert (np.diff(stock, axis=1) <= 0.0).all()
            assert (np.diff(stock, axis=0) == 0.0).all()
        rows, place, depth = one.laid(p, (one.u, one.v), pose)
        assert rows.contact.shape[0] == 5
        assert (np.diff(place[:, 0, 1]) < 0.0).all()
        assert place[0, 0, 1] < 0.999
        tip, axis, centre = place_rows(rows, pose)
        assert_allclose(axis, np.broadcast_to([0.0, 0.0, 1.0], axis.shape), atol=1e-12)
        assert_allclose(np.linalg.norm((centre - rows.contact), axis=2), 4.0, rtol=1e-12)
        assert_allclose(tip[..., 2], rows.contact[..., 2] - 0.5, atol=1e-12)
        toward = np.einsum("rsi,rsi->rs", np.cross(axis, rows.feed), rows.normal)
        # left of the feed, seen from above, is away from the wall in down milling
        assert (np.sign(toward) == np.sign(step)).all()
        k = np.searchsorted(one.u, place[..., 0])
        height = np.searchsorted(one.v, place[..., 1] - 1e-9)
        assert_allclose(rows.contact[..., 1], p.low[k, height], atol=1e-12)
        assert_allclose(depth, (p.high - p.low)[k, height], atol=1e-12)


def test_a_plan_in_steps_holds():
    """Depths that are lowered for the flank above stay within what the places bear."""
    one = side()
    plan = variable([one.surface], weaker_up, law(), 0.05, steps=True)
    assert plan.holds
    raised = variable([one.surface], weaker_up, law(), 0.05)
    assert all((p.depth <= q.depth + 1e-12).all() for p, q in zip(plan.passes[-1:], raised.passes[-1:], strict=True))
