"""Roughing of a channel: layers, allowances, ways in from outside, against the check of channels."""

import math

import numpy as np
import pytest

from chipload.cutter.catalogue import CatalogueCutter
from chipload.planning.impeller.floor import layer_of, patch_of
from chipload.planning.impeller.lines import LineMotion
from chipload.planning.impeller.links import Link, link_tracks
from chipload.planning.impeller.parametric import ImpellerShape, impeller_of
from chipload.planning.impeller.programs import program_of
from chipload.planning.impeller.roughing import RoughingSettings, guard_walls, layers, roughing_tracks, thicken_walls
from chipload.simulation.channel.channel import left_on, wall

CUTTER = CatalogueCutter(12.0, 2.0, cutting_length=45.0, reach=60.0, holder_diameter=30.0)
TABLE = math.radians(55.0)
HOW = RoughingSettings(20.0, 12.0, 0.5, 0.4, LineMotion(0.05, 2.0, 2.0, 0.5), spacing=2.5, around=0)


@pytest.fixture(scope="module")
def impeller():
    return impeller_of(ImpellerShape())


@pytest.fixture(scope="module")
def rough(impeller):
    tracks, scene = roughing_tracks(impeller, 0, CUTTER, TABLE, HOW, workers=2), thicken_walls(impeller, 0, HOW)
    way = link_tracks(
        tracks.tracks, scene, CUTTER, TABLE, 2.0, Link(1.0, 0.3, 0.1, 0.0, 20.0, 5.0), 0.5, "rough", 2.0, one_way=True
    )
    return tracks, way, program_of(way.moves, 90.0, 2)


def test_floor_is_the_hub(impeller):
    patch = patch_of(impeller, "blade", "floor")
    u, v = (x.ravel() for x in np.meshgrid(np.linspace(0, 1, 41), np.linspace(0, 1, 9), indexing="ij"))
    p = patch.at(u, v)
    # the hub by its formula: a quarter of an ellipse
    s = ImpellerShape()
    r, z = np.hypot(p[:, 0], p[:, 1]), p[:, 2]
    x = (s.outer_radius - r) / (s.outer_radius - s.hub_radius)
    assert np.abs(x**2 + (1.0 - z / s.height) ** 2 - 1.0).max() < 1e-3
    assert (patch.normal(u, v) * np.column_stack([p[:, :2] / r[:, None], np.ones(len(r))])).sum(axis=1).min() > 0.0


def test_guarded_walls_stand_out_by_the_sag_and_the_milled_one_does_not(impeller):
    s = ImpellerShape()
    for milled in (0, 2):
        scene = guard_walls(impeller, 0, milled, 2.0, 2.0, around=0)
        p = scene.check[scene.check_surface == 2]
        # distance from the ellipse of the hub, to first order of its equation
        x, y = s.outer_radius - np.hypot(p[:, 0], p[:, 1]), s.height - p[:, 2]
        a, b = s.outer_radius - s.hub_radius, s.height
        off = ((x / a) ** 2 + (y / b) ** 2 - 1.0) / (2.0 * np.hypot(x / a**2, y / b**2))
        assert np.abs(off + (0.25 if milled == 0 else 0.0)).max() < 0.01


def test_no_layer_is_thicker_than_asked(impeller):
    w = layers(impeller, 8.0, 0.4)
    assert w[-1] == 0.0
    assert (np.diff(w) < 0.0).all()
    u = np.linspace(0.0, 1.0, 21)
    grids = [layer_of(impeller, 0, float(x), 0.4).at(u, 0.5) for x in w]
    step = [np.linalg.norm(np.diff([np.hypot(g[:, 0], g[:, 1]), g[:, 2]], axis=1), axis=0) for g in grids]
    assert all(len(x) for x in step)
    tops = [*grids[1:]]
    for high, low in zip(grids[:-1], tops, strict=True):
        m = [np.column_stack([np.hypot(g[:, 0], g[:, 1]), g[:, 2]]) for g in (high, low)]
        assert np.linalg.norm(m[0] - m[1], axis=1).max() <= 8.0 * 1.02


def test_nothing_comes_into_the_allowance_and_rows_begin_outside(impeller, rough):
    tracks, way, program = rough
    assert len(tracks.tracks) > 6
    assert len(way.refused) <= 2
    grid = np.linspace(0.0, 1.0, 41), np.linspace(0.0, 1.0, 21)
    walls = [
        wall("blade", impeller.blade.plus, *grid), wall("facing", impeller.body(1).minus, *grid),
        wall("floor", patch_of(impeller, "blade", "floor"), *grid),
    ]  # fmt: skip
    for got, allowance in zip(
        left_on(walls, program, CUTTER, 6.0, 1.0, step=1.0, workers=2), (0.5, 0.5, 0.4), strict=True
    ):
        assert got.deepest[0] == 0.0
        # of the allowance the check points' distance takes s^2 / (8 r), the way off a row its touch, the path its chord
        assert got.rest.min() >= allowance - 2.5**2 / (8.0 * 2.0) - 0.1 - 0.05
        assert got.excess(5.9) < 0.6
    start = [t.tip[0] for t in tracks.tracks if t.at[0, 0] > 0.99]
    assert len(start) == tracks.lines
    assert min(math.hypot(p[0], p[1]) for p in start) > ImpellerShape().outer_radius
