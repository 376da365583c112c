"""Gouge and excess of passes whose traces are known, and what a holder runs into."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
import trimesh

from chipload.cutter.cutter import Cutter
from chipload.errors import InputError
from chipload.program.build import plunge, rapid
from chipload.program.program import Program
from chipload.simulation.checkpoint import Checkpoint
from chipload.simulation.kept_pass import KeptPasses
from chipload.simulation.steps import StepBlocks, steps_of
from chipload.simulation.surface import collisions, difference, fine, in_stock

BALL = Cutter(10.0, 2, 0.5, 20.0, 30.0, 6e5, corner_radius=5.0)


def box(low, high):
    low, high = np.array(low, dtype=float), np.array(high, dtype=float)
    mesh = trimesh.creation.box(extents=high - low)
    mesh.apply_translation(0.5 * (low + high))
    return mesh


def line(*points):
    moves = [rapid(points[0], 800, 1, "way"), *(plunge(p, 10.0, 800.0, 1, "cut") for p in points[1:])]
    return steps_of(Program.join(moves), 2.0, 0.001)


def everywhere(points):
    return np.ones(len(points), dtype=bool)


def test_triangles_are_fine_and_stay_on_the_part():
    points, faces = fine(box([0, 0, 0], [10, 6, 4]), 0.5, "part")
    sides = np.linalg.norm(points[faces] - points[np.roll(faces, 1, axis=1)], axis=2)
    assert sides.max() <= 0.5
    assert len(np.unique(points, axis=0)) == len(points)
    assert trimesh.Trimesh(points, faces).volume == pytest.approx(240.0, rel=1e-12)


def test_a_finished_plane():
    """Passes of a ball 1 mm apart, the last 0.03 mm too deep: cusps and a gouge of that depth in closed form."""
    rows = [[[-6.0, y, 0.0 if y < 7.9 else -0.03], [16.0, y, 0.0 if y < 7.9 else -0.03]] for y in np.arange(-5.0, 8.1)]
    path = [p for k, row in enumerate(rows) for p in (row if k % 2 == 0 else row[::-1])]
    found = difference(line(*path), {1: BALL}, box([0, 0, -5], [10, 8, 0]), everywhere, 0.25, 1.0, 1e-4)
    top = found.points[:, 2] == 0.0
    y = found.points[top, 1]
    centre = np.arange(-5.0, 8.1)
    height = np.where(centre < 7.9, 5.0, 4.97)
    expected = (np.hypot(y[:, None] - centre, height) - 5.0).min(axis=1)
    np.testing.assert_allclose(found.distance[top], expected, atol=1.5e-4)
    assert expected.min() == pytest.approx(-0.03)
    assert expected.max() == pytest.approx(math.hypot(0.5, 5.0) - 5.0)
    assert found.deepest.min() == pytest.approx(-0.03, abs=1.5e-4)
    assert np.isinf(found.distance[found.points[:, 2] == -5.0]).all()


def test_too_many_points_are_refused():
    with pytest.raises(InputError, match=r"part: spacing_mm = 0.001: gives about \de\+\d+ points, more than 4000000"):
        fine(box([0, 0, 0], [10, 6, 4]), 0.001, "part")


@pytest.mark.parametrize(("wall", "depth"), [(28.0, 0.0), (33.0, 3.0)])
def test_a_holder_beside_a_wall(wall, depth):
    """The wall stands 8 mm from the axis, the holder begins 30 mm up and is 20 mm in radius."""
    cutter = Cutter(10.0, 2, 0.5, 20.0, 30.0, 6e5, corner_radius=5.0, holder=((40.0, 40.0),))
    points, _ = fine(box([8, -20, 0], [12, 20, wall]), 0.5, "fixture")
    found = collisions(line([0, -5, 0], [0, 5, 0]), {1: cutter}, {"fixture 1": points}, 0.01)
    if depth == 0.0:
        assert found == ()
    else:
        (only,) = found
        assert (only.what, only.into, only.line) == ("shank or holder", "fixture 1", 0)
        assert only.depth_mm == pytest.approx(depth, abs=0.5)


def test_the_cutting_part_may_touch_the_part_and_no_fixture():
    points, _ = fine(box([4, -20, 0], [12, 20, 8]), 0.5, "fixture")
    steps = line([0, -5, 0], [0, 5, 0])
    assert collisions(steps, {1: BALL}, {"part": points}, 0.01, above_only=frozenset(["part"])) == ()
    (only,) = collisions(steps, {1: BALL}, {"fixture 1": points}, 0.01)
    assert (only.what, only.depth_mm) == ("cutting part", pytest.approx(1.0, abs=1e-3))


@pytest.mark.parametrize(("depth", "hits"), [(12.0, False), (35.0, True)])
def test_a_holder_in_the_stock(depth, hits):
    """A slot in steps of 4 mm, the holder 30 mm up: a deeper slot takes it into the stock that the cutter has left."""
    cutter = Cutter(10.0, 2, 0.5, 20.0, 30.0, 6e5, holder=((40.0, 40.0),))
    levels = -np.arange(4.0, depth + 0.1, 4.0)
    path = [
        p for k, z in enumerate(levels) for p in ([[0, 0, z], [20, 0, z]] if k % 2 == 0 else [[20, 0, z], [0, 0, z]])
    ]
    grid = np.stack(np.meshgrid(*(np.arange(a, b, 1.0) for a, b in ((-30, 50), (-30, 30), (-40, 0.01)))), -1).reshape(
        -1, 3
    )
    found = in_stock(line([0, 0, 2], *path), {1: cutter}, grid, 0.05)
    assert bool(found) == hits
    if hits:
        assert found[0].depth_mm == pytest.approx(2.0, abs=0.1)


def two_tools():
    """A program that cuts too deep, runs its holder into a fixture and the stock; two tools; the part, points of a
    fixture and of the stock.
    """
    holder = ((40.0, 40.0),)
    cutters = {1: replace(BALL, holder=holder), 2: Cutter(6.0, 2, 0.5, 20.0, 30.0, 6e5, holder=holder)}
    path = [[-6, 2, 4], [-6, 2, -1], [16, 2, -1], [16, 6, -25], [-6, 6, -25], [-6, 4, -33], [16, 4, -33]]
    moves = [rapid(path[0], 800, 1, "way"), *(plunge(p, 10.0, 800.0, 1 + k // 4, "cut") for k, p in enumerate(path))]
    lines = [replace(m, line=np.full(1, k)) for k, m in enumerate(moves)]
    part, fixture = box([0, 0, -40], [10, 8, 0]), fine(box([4, 12, -10], [8, 20, 0]), 0.5, "fixture")[0]
    grid = np.stack(np.meshgrid(*(np.arange(a, b, 2.0) for a, b in ((-30, 30), (-30, 30), (-40, 1)))), -1).reshape(
        -1, 3
    )
    return Program.join(lines), cutters, part, fixture, grid


def test_blocks_of_steps_find_what_all_steps_find():
    """In blocks of 5 steps."""
    program, cutters, part, fixture, grid = two_tools()
    whole, blocks = steps_of(program, 2.0, 0.001), StepBlocks(program, 2.0, 0.001, size=5)
    one, two = (difference(s, cutters, part, everywhere, 1.0, 1.0, 1e-2) for s in (whole, blocks))
    for name in ("distance", "step", "deepest"):
        assert np.array_equal(getattr(one, name), getattr(two, name)), name
    assert len(two.deepest) == len(whole)
    assert two.step.max() > 20
    touched = [collisions(s, cutters, {"fixture": fixture, "part": part.vertices}, 0.01) for s in (whole, blocks)]
    assert touched[0] == touched[1]
    assert len({c.line for c in touched[0]}) > 2
    sunk = [in_stock(s, cutters, grid, 0.05) for s in (whole, blocks)]
    assert sunk[0] == sunk[1]
    assert len(sunk[0]) > 1
    for c in (*touched[0], *sunk[0]):
        assert (int(whole.line[c.step]), whole.p1[c.step].tolist()) == (c.line, list(c.at))


class Stopped(Exception):
    """The run is stopped."""


def stopping(after):
    """Progress that stops the pass where so many steps are done."""

    def tell(done):
        if done >= after:
            raise Stopped

    return tell


def test_passes_that_were_stopped_go_on_and_find_the_same(tmp_path):
    """Stopped twice, each pass takes the steps that it had not taken and finds what it finds without a stop."""
    program, cutters, part, fixture, grid = two_tools()
    blocks = StepBlocks(program, 2.0, 0.001, size=5)
    solids = {"fixture": fixture, "part": part.vertices}
    passes = {
        "part": lambda **more: difference(blocks, cutters, part, everywhere, 1.0, 1.0, 1e-2, **more),
        "collisions": lambda **more: collisions(blocks, cutters, solids, 0.01, **more),
        "stock": lambda **more: in_stock(blocks, cutters, grid, 0.05, **more),
    }
    told = []
    for name, go in passes.items():
        alone, taken = go(), []
        for after in (20, 40):
            with Checkpoint(tmp_path / "u", 0.0, notice=told.append) as kept, pytest.raises(Stopped):
                go(kept=KeptPasses(kept, "key"), progress=stopping(after))
            assert kept.what_is_kept() == f"{after} steps of a pass are kept"
        with Checkpoint(tmp_path / "u", 0.0, notice=told.append) as kept:
            found = go(kept=KeptPasses(kept, "key"), progress=taken.append)
        assert taken[0] == 40
        # what was finished is not gone through again, what is of another input is
        taken.clear()
        with Checkpoint(tmp_path / "u", 0.0, notice=told.append) as kept:
            again = go(kept=KeptPasses(kept, "key"), progress=taken.append)
            assert taken == []
            other = go(kept=KeptPasses(kept, "other"), progress=taken.append)
        assert taken[0] == 0
        for each in (found, again, other):
            if name == "part":
                for column in ("distance", "step", "deepest", "over"):
                    assert np.array_equal(getattr(each, column), getattr(alone, column)), column
            else:
                assert each == alone
    assert told[:2] == [f"the pass 'part' continues after step {k}, kept in {tmp_path / 'u'}" for k in (20, 40)]
    assert [t.split("'")[1] for t in told] == ["part"] * 3 + ["collisions"] * 3 + ["stock"] * 3


def test_a_pass_that_cannot_be_read_begins_again_and_is_set_aside(tmp_path):
    program, cutters, part, _, _ = two_tools()
    blocks = StepBlocks(program, 2.0, 0.001, size=5)
    told, taken = [], []
    with Checkpoint(tmp_path / "u", 0.0) as kept:
        alone = difference(blocks, cutters, part, everywhere, 1.0, 1.0, 1e-2, kept=KeptPasses(kept, "key"))
    file = tmp_path / "u" / "pass-part.npz"
    file.write_bytes(file.read_bytes()[:-100])
    with Checkpoint(tmp_path / "u", 0.0, notice=told.append) as kept:
        found = difference(
            blocks, cutters, part, everywhere, 1.0, 1.0, 1e-2, taken.append, KeptPasses(kept, "key")
        )  # fmt: skip
    assert taken[0] == 0
    assert np.array_equal(found.distance, alone.distance)
    aside = tmp_path / "u.damaged-1"
    assert told == [f"starts from the beginning: pass-part.npz cannot be read: the checkpoint is moved to {aside}"]
    assert [p.name for p in (tmp_path / "u.damaged-1").iterdir()] == ["pass-part.npz"]
    # a run that is to begin again does not read it
    taken.clear()
    with Checkpoint(tmp_path / "u", 0.0, fresh=True) as kept:
        difference(blocks, cutters, part, everywhere, 1.0, 1.0, 1e-2, taken.append, KeptPasses(kept, "key"))
    assert taken[0] == 0
