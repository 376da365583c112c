"""Tooth engagement that is kept of a pocket in levels: the loads of its rows, at every level."""

from __future__ import annotations

import numpy as np

from chipload.jobs.contour.result import history_of, samples_of
from pocket_job import done, operation, written

SMALL = [(0, 0), (16, 0), (16, 14), (0, 14)]


def test_the_loads_of_each_level(tmp_path):
    """Over the revolution that is kept, force and torque rise to what the history says of the row, which finds its
    greatest values by another method; both levels are there, and the entries.
    """
    more = "radial_depth_mm = 1.2\ndepth_mm = 5.0\nallowance_mm = 0.2\nfloor_allowance_mm = 0.4\n"
    more += "floor_finish = { feed_mm_min = 600.0, speed_rpm = 7960.0 }\n"
    more += "wall_finish = { feed_mm_min = 600.0, speed_rpm = 7960.0 }\n"
    _, outcome = done(written(tmp_path, {"0": [SMALL]}, operation(more)))
    (op,) = outcome.operations
    (found,) = samples_of(outcome).values()
    rows = history_of(op, op.result.strategies["pocket"])
    assert set(rows["pass"]) >= {"floor", "wall", "entry"}
    assert {"pocket", "entry"} <= set(rows["pass"][found.row])
    clearing = rows["pass"][found.row] == "pocket"
    heights, counts = np.unique(rows["z_mm"][found.row][clearing].round(9), return_counts=True)
    assert heights.tolist() == [-4.6, -2.3]
    assert counts.min() > 20
    force, greatest = np.hypot(found.turn[:, :, 0], found.turn[:, :, 1]), rows["force_xy_n"][found.row]
    most = force.max(axis=1)
    # the greatest force may lie between two rotations, 1 deg apart, where a slice of the entry begins to cut
    between = np.abs(force - np.roll(force, 1, axis=1)).max(axis=1)
    assert (most <= 1.001 * greatest).all()
    assert (greatest - most <= between).all()
    assert np.isclose(most, greatest, rtol=0.01, atol=0.5).mean() > 0.99
    # the greatest torque of a step may belong to another instant than its greatest force
    torque = np.abs(found.turn[:, :, 3]).max(axis=1)
    assert (torque <= 1.01 * rows["torque_nm"][found.row] + 0.002).all()
    assert np.isclose(torque, rows["torque_nm"][found.row], rtol=0.01, atol=0.002).mean() > 0.9
