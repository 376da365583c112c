"""The stock over the rows of a history against volumes in closed form, and the history of a simulation."""

import math

import numpy as np
import pytest
import trimesh

from chipload.cutter.cutter import Cutter
from chipload.simulation.removal_mesh import ToolPoses, merged_quads, removal_mesh

FLAT = Cutter(10.0, 2, 0.5, 20.0, 30.0, 6e5)
BALL = Cutter(10.0, 2, 0.5, 20.0, 30.0, 6e5, corner_radius=5.0)
BOX = trimesh.creation.box(bounds=[[0, 0, 0], [60, 40, 20]])


def path(tips, tool=1, axis=(0.0, 0.0, 1.0), apart=()) -> ToolPoses:
    """A path through tips with one axis."""
    p = np.array(tips, dtype=float)
    gaps = np.zeros(len(p), dtype=bool)
    gaps[list(apart)] = True
    a = np.array(axis) / np.linalg.norm(axis)
    return ToolPoses(p, np.tile(a, (len(p), 1)), np.full(len(p), tool), gaps)


def slot(z: float, n: int = 141) -> list[tuple[float, float, float]]:
    """Along x through the box, at y = 20."""
    return [(x, 20.0, z) for x in np.linspace(-10.0, 70.0, n)]


def test_a_slot_and_what_is_left_of_it_at_half() -> None:
    mesh = removal_mesh(BOX, path(slot(15.0)), {1: FLAT})
    assert mesh.volumes[0] == pytest.approx(48000.0)
    assert mesh.volumes[-1] == pytest.approx(48000.0 - 60.0 * 10.0 * 5.0, rel=0.002)
    # the middle of the path: the disc has its axis at x = 30
    k = mesh.frame_of(70)
    half = 48000.0 - 5.0 * (300.0 + 0.5 * math.pi * 25.0)
    assert mesh.volumes[k] == pytest.approx(half, rel=0.002)
    # what is drawn encloses what the rays hold
    for frame in (0, k, len(mesh.rows)):
        assert mesh.volume(frame) == pytest.approx(mesh.volumes[frame], rel=0.01)
    assert mesh.frame_of(-1) == 0
    assert mesh.frame_of(140) == len(mesh.rows)


def test_wider_cells_show_the_same_slot_with_fewer_faces() -> None:
    """Cells four times as wide: the volume of the slot to a cell across."""
    fine = removal_mesh(BOX, path(slot(15.0)), {1: FLAT})
    wide = removal_mesh(BOX, path(slot(15.0)), {1: FLAT}, wider=4.0)
    assert wide.cell == pytest.approx(4.0 * fine.cell, rel=0.3)
    assert wide.volumes[-1] == pytest.approx(48000.0 - 60.0 * 10.0 * 5.0, rel=0.01)
    assert len(wide.corners) < 0.25 * len(fine.corners)


def test_paths_before_have_cut_the_first_frame() -> None:
    mesh = removal_mesh(BOX, path(slot(12.0)), {1: FLAT, 2: FLAT}, [path(slot(17.0), tool=2), path(slot(15.0))])
    assert mesh.volumes[0] == pytest.approx(48000.0 - 60.0 * 10.0 * 5.0, rel=0.002)
    assert mesh.volumes[-1] == pytest.approx(48000.0 - 60.0 * 10.0 * 8.0, rel=0.002)
    assert mesh.rows.max() == 140


def test_a_ball_that_leans_and_one_that_plunges() -> None:
    plunge = removal_mesh(BOX, path([(30.0, 20.0, z) for z in np.linspace(25.0, 10.0, 20)]), {1: BALL})
    taken = 2.0 / 3.0 * math.pi * 125.0 + math.pi * 25.0 * 5.0
    assert plunge.volumes[0] - plunge.volumes[-1] == pytest.approx(taken, rel=0.01)
    # the axis leans across the path by 45 deg, the centre stays at z = 20: half a disc, and beside it a triangle less
    # an eighth of the disc, which the flank takes
    a = np.array([0.0, 1.0, 1.0]) / math.sqrt(2.0)
    tips = [np.array([x, 20.0, 20.0]) - 5.0 * a for x in np.linspace(-10.0, 70.0, 81)]
    lean = removal_mesh(BOX, path(tips, axis=a), {1: BALL})
    below = 60.0 * (0.5 * math.pi * 25.0 + 12.5 - math.pi * 25.0 / 8.0)
    assert lean.volumes[0] - lean.volumes[-1] == pytest.approx(below, rel=0.01)


def test_gaps_other_tools_and_air_take_nothing() -> None:
    whole = slot(15.0)
    jump = removal_mesh(BOX, path([whole[0], whole[-1]], apart=[1]), {1: FLAT})
    assert jump.volumes[-1] == pytest.approx(48000.0)
    assert removal_mesh(BOX, path(whole, tool=7), {1: FLAT}).volumes.tolist() == pytest.approx([48000.0])
    # a move longer than the cutter is wide is followed, not jumped
    long = removal_mesh(BOX, path([whole[0], whole[-1]]), {1: FLAT})
    assert long.volumes[-1] == pytest.approx(45000.0, rel=0.002)


def test_the_surface_is_closed_in_every_frame() -> None:
    mesh = removal_mesh(BOX, path([*slot(15.0, 41), (70.0, 20.0, 40.0), (-10.0, 8.0, 40.0), (-10.0, 8.0, 12.0),
                                   (70.0, 8.0, 12.0)]), {1: FLAT})  # fmt: skip
    for frame in (0, len(mesh.rows) // 3, len(mesh.rows)):
        here = (mesh.seen[:, 0] <= frame) & (frame < mesh.seen[:, 1])
        a, b, c, d = np.moveaxis(mesh.corners[here].astype(float), 1, 0)
        # the area vectors of a closed surface add up to nothing
        area = 0.5 * np.cross(c - a, d - b)
        assert np.abs(area.sum(axis=0)).max() < 1e-6 * np.abs(area).sum()


def test_merging_keeps_the_area_and_leaves_out_what_is_never_seen() -> None:
    k = np.arange(3)
    low = np.stack([np.repeat(k, 3), np.tile(k, 3), np.zeros(9, int)], axis=1) * 10
    corners = (low[:, None] + 10 * np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])).astype(np.uint16)
    seen = np.tile(np.array([[0, 65535]], dtype=np.uint16), (9, 1))
    one, when = merged_quads(corners, seen)
    assert one.tolist() == [[[0, 0, 0], [30, 0, 0], [30, 30, 0], [0, 30, 0]]]
    assert when.tolist() == [[0, 65535]]
    seen[4] = 3, 3
    ring, _ = merged_quads(corners, seen)
    side = ring.max(axis=1).astype(int) - ring.min(axis=1)
    assert (side[:, 0] * side[:, 1]).sum() == 800
    # seen from below, it stays so
    turned, _ = merged_quads(corners[:, ::-1], np.tile(np.array([[0, 5]], dtype=np.uint16), (9, 1)))
    e, f = turned[0, 1].astype(int) - turned[0, 0], turned[0, 2].astype(int) - turned[0, 1]
    assert np.cross(e, f)[2] < 0


def test_hundreds_of_holes_of_few_frames_are_all_drawn() -> None:
    """Holes 1.6 wide and 4 deep, 2 apart, each a run of its own: two and more in a frame."""
    drill = Cutter(1.6, 2, 0.5, 20.0, 30.0, 6e5)
    tips, apart = [], []
    for n, (x, y) in enumerate((x, y) for x in np.arange(2.0, 59.0, 2.0) for y in np.arange(2.0, 39.0, 2.0)):
        apart.append(2 * n)
        tips += [(x, y, 21.0), (x, y, 16.0)]
    mesh = removal_mesh(BOX, path(tips, apart=apart), {1: drill})
    taken = len(apart) * 4.0 * math.pi * 0.64
    assert mesh.volumes[0] - mesh.volumes[-1] == pytest.approx(taken, rel=0.03)
    # what is drawn
    assert mesh.volume(0) - mesh.volume(len(mesh.rows)) == pytest.approx(taken, rel=0.1)
