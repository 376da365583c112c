"""The check of channels with tapered and barrel cutters: closed forms, and dense points of rays in the true profile."""

import math
from dataclasses import replace

import numpy as np
import pytest
from tests.simulation.test_channel import FLAT, over

from chipload.cutter.catalogue import CatalogueCutter
from chipload.geometry.bspline import patch_through
from chipload.program.build import plunge, rapid
from chipload.program.program import Program
from chipload.simulation.channel import _ray_cuts
from chipload.simulation.channel.channel import left_on, tool_parts, wall
from chipload.simulation.channel.gouges import deepest_gouge
from chipload.simulation.channel.stock import taken_from

BETA = math.radians(4.0)
TAPERED = CatalogueCutter(4.0 * (1.0 - math.sin(BETA)) / math.cos(BETA), 2.0, 18.0, reach=40.0, holder_diameter=30.0,
                          taper=BETA)  # fmt: skip
OVAL = CatalogueCutter(12.0, 2.0, 24.0, neck_diameter=8.0, neck_length=30.0, barrel_radius=50.0)
CONE = CatalogueCutter(8.0, 1.5, 20.0, barrel_radius=250.0, taper=math.radians(12.0))
ALL = pytest.mark.parametrize("cutter", [TAPERED, OVAL, CONE], ids=["tapered", "oval", "cone"])


@ALL
def test_an_upright_wall_is_cut_as_deep_as_the_profile_is_wide(cutter):
    """A wall x = 0 that the tool, standing along z at x = -4, goes by."""
    low, high = 3.0, cutter.cutting_length - 0.1
    side = patch_through([[[0, 0, low], [0, 0, high]], [[0, 20, low], [0, 20, high]]], [0, 1], [0, 1], side=-1)
    grid = wall("side", side, np.linspace(0.3, 0.7, 3), np.linspace(0.0, 1.0, 40))
    x = -0.5 * cutter.top_diameter + 0.4
    path = [rapid([[x, -30.0, 0.0]], 100.0, 1, "link"), plunge([[x, 50.0, 0.0]], 10.0, 100.0, 1, "finish")]
    (got,) = left_on([grid], Program.join(path), cutter, 3.0, 3.0, tol=1e-9)
    deep = x + cutter.shape.radius_at(grid.points[:, 2])
    assert np.abs(got.gouge - np.maximum(deep, 0.0)).max() < 1e-6
    assert np.abs(got.rest + deep)[deep > -2.9].max() < 1e-6
    assert (got.part[got.gouge > 1e-9] == 0).all()


def test_scallops_of_a_tapered_ball_are_those_of_its_ball():
    w, grid = 1.2, wall("floor", FLAT, np.linspace(0.2, 0.8, 5), np.linspace(0.0, 1.0, 2001))
    (got,) = left_on([grid], over(np.arange(0.0, 20.1, w)), TAPERED, 1.0, 0.5, step=1.0, tol=1e-9)
    crests = got.scallops("v")
    assert np.abs(crests - (2.0 - math.sqrt(4.0 - 0.36))).max() < 1e-6


@ALL
def test_no_part_is_nearer_than_it_is_said(cutter):
    """Points beside the tool: the bound by which rays are left out is never above the distance of the profile."""
    rng = np.random.default_rng(2)
    starts, shapes, _ = tool_parts(cutter)
    d, h = rng.uniform(0.0, 12.0, 3000), rng.uniform(-4.0, cutter.cutting_length + 4.0, 3000)
    p = cutter.shape.profile(1e-4)
    p = np.vstack([p, [0.0, p[-1, 1]]])
    a, side = p[:-1], np.diff(p, axis=0)
    x = np.stack([d, h], axis=-1)[:, None] - a
    w = np.clip((x * side).sum(axis=-1) / (side**2).sum(axis=1), 0.0, 1.0)
    far = np.sqrt(((x - w[..., None] * side) ** 2).sum(axis=-1)).min(axis=1)
    inside = (h > 0.0) & (h < cutter.cutting_length) & (d < cutter.shape.radius_at(np.maximum(h, 0.0)))
    said = np.array([_ray_cuts.part_distance(z, rho, starts[0], shapes[0]) for z, rho in zip(h, d, strict=True)])
    assert (said <= np.where(inside, 0.0, far) + 2e-4).all()
    # and not so far below it that nothing is left out
    assert (said[far > 2.0] > 0.0).mean() > 0.9 * (~inside[far > 2.0]).mean()


@ALL
def test_on_a_curved_wall_rays_end_where_the_profile_is(cutter):
    """Poses at random on a wavy wall: along every ray points close to one another, in the tool or not."""
    rng = np.random.default_rng(7)
    u = np.linspace(0.0, 1.0, 9)
    U, V = np.meshgrid(u, u, indexing="ij")
    grid = np.stack([24.0 * U, 24.0 * V, 1.2 * np.sin(5.0 * U) * np.cos(4.0 * V)], axis=-1)
    surface = patch_through(grid, u, u)
    own, fine = (wall("wavy", surface, x, x) for x in (u, np.linspace(0.0, 1.0, 61)))
    s = np.linspace(-1.5, 0.0, 3001)
    for _ in range(3):
        at = 0.3 + 0.4 * rng.random((1, 2))
        p = surface.at(*at.T)
        axis = np.array([[0.0, 0.0, 1.0]]) + 0.6 * rng.normal(size=(1, 3))
        axis /= np.linalg.norm(axis)
        tips = p + axis * rng.uniform(-0.9, -0.3)
        end = tips + np.array([[0.0, 0.0, 1e-9]])
        program = Program.join([rapid(tips, 100.0, 1, "link"), plunge(end, 10.0, 100.0, 1, "finish")])
        program = replace(program, axis=np.concatenate([axis, axis]))
        (dense,) = left_on([fine], program, cutter, 1.0, 1.5)
        x = fine.points[:, None] + s[:, None] * fine.normals[:, None] - tips[0]
        z = x @ axis[0]
        rho = np.sqrt(np.maximum((x * x).sum(axis=-1) - z * z, 0.0))
        within = (z >= 0.0) & (z <= cutter.cutting_length) & (rho <= cutter.shape.radius_at(np.maximum(z, 0.0)))
        want = np.where(within.any(axis=1), -s[within.argmax(axis=1)], 0.0)
        cuts = dense.part == 0
        assert cuts.sum() > 10
        assert np.abs(dense.gouge - want)[cuts].max() < 1e-3
        got = deepest_gouge([own], program, cutter, 1.5, 0.01, 0.02)
        assert dense.deepest[0] <= got.bound + 1e-6
        assert got.found == pytest.approx(dense.deepest[0], abs=0.02)


def test_a_blank_loses_the_profile():
    """Standing still in a block: the volume of the profile turned about its axis, up to the block's top."""
    import trimesh

    block = trimesh.creation.box((40.0, 40.0, 15.0))
    block.apply_translation([0.0, 0.0, 7.5])
    tips = [[0.0, 0.0, 16.0], [0.0, 0.0, 0.0]]
    program = Program.join([rapid(tips[:1], 100.0, 1, "link"), plunge(tips[1:], 10.0, 100.0, 1, "finish")])
    z = np.linspace(0.0, 15.0, 200_001)
    for cutter in (TAPERED, OVAL):
        got = taken_from(block, program, cutter, 0.25)
        rho = cutter.shape.radius_at(z)
        want = math.pi * ((rho[1:] ** 2 + rho[:-1] ** 2) * 0.5 * np.diff(z)).sum()
        assert got.before - got.after == pytest.approx(want, rel=0.01)
