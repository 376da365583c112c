"""Levels of a pocket that a job states, or leaves to the form error of its walls."""

from __future__ import annotations

import math

import numpy as np
import pytest

from chipload.errors import InputError
from chipload.jobs import load_job
from pocket_job import SMALL, done, operation, written

LEVELS = """radial_depth_mm = 1.2
depth_mm = 6.0
allowance_mm = 0.3
levels_mm = [1.0, 3.5, 1.5]
wall_finish = { feed_mm_min = 500.0, speed_rpm = 9500.0, by_level = true }
"""


def test_stated_levels(tmp_path):
    """Their floors in the order of the program, cleared and then finished; the engagement of 1.2 mm at each.

    The mean force of a level is as its depth: the rest of the cut is the same.
    """
    (pocket,), outcome = done(written(tmp_path, {"part": [SMALL]}, operation(LEVELS)))
    p = pocket.program
    label = np.array(p.labels, dtype=object)[p.label]
    cut = np.flatnonzero(np.isin(label, ["pocket", "wall"]))
    z = p.p_work[cut, 2].round(9)
    runs = np.flatnonzero(np.r_[True, (np.diff(z) != 0.0) | (label[cut][1:] != label[cut][:-1])])
    seen = list(dict.fromkeys(zip(label[cut][runs].tolist(), z[runs].tolist(), strict=True)))
    assert [x for x in seen if x[1] in (-1.0, -4.5, -6.0)] == [
        (name, floor) for floor in (-1.0, -4.5, -6.0) for name in ("pocket", "wall")
    ]
    assert pocket.summary["levels"] == 6
    assert pocket.summary["finish"]["wall"]["axial_depth_mm"] == pytest.approx(3.5)
    h = pocket.history
    front = (h["pass"] == "pocket") & (h["z_mm"] < -0.5)
    torque = [h["torque_mean_nm"][front & np.isclose(h["z_mm"], floor)].max() for floor in (-1.0, -4.5, -6.0)]
    assert np.array(torque) / torque[0] == pytest.approx([1.0, 3.5, 1.5], rel=0.02)
    (check,) = outcome.operations[0].verifications.values()
    assert check.numbers["engagement_difference_deg"] <= 0.05


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("[1.0, 3.5, 1.5]", "[1.0, 3.5]", "operation.0.levels_mm: 4.5 mm deep together: must be 6, the depth"),
        ("[1.0, 3.5, 1.5]", "[1.0, 5.0]", "operation.0.levels_mm: 5: must be at most axial_depth_mm = 4"),
        (
            "[1.0, 3.5, 1.5]", '"limit"',
            "operation.0.levels_mm = 'limit': needs [workpiece], by which the walls bend: state it, or the depths of "
            "the levels",
        ),
        (
            "[1.0, 3.5, 1.5]", '"limit"',
            "operation.0.levels_mm = 'limit': needs limits.form_error_um, by which the walls bend",
        ),
        (
            '[1.0, 3.5, 1.5]\nwall_finish = { feed_mm_min = 500.0, speed_rpm = 9500.0, by_level = true }',
            '"limit"\nwall_finish = { feed_mm_min = 500.0, speed_rpm = 9500.0 }',
            "state wall_finish.by_level = true without wall_finish.axial_depth_mm",
        ),
    ],
)  # fmt: skip
def test_levels_that_do_not_go_with_the_job(tmp_path, old, new, message):
    assert old in LEVELS
    path = written(tmp_path, {"part": [SMALL]}, operation(LEVELS.replace(old, new)))
    with pytest.raises(InputError) as refused:
        load_job(path)
    assert message in str(refused.value)


def test_a_workpiece_without_planned_levels_is_not_used(tmp_path):
    path = written(tmp_path, {"part": [SMALL]}, operation(LEVELS))
    path.write_text(
        path.read_text() + '[workpiece]\nmodulus_gpa = 70.0\npoisson = 0.33\n[[workpiece.clamp]]\nface = "z-"\n'
    )
    assert "workpiece: not used without operation.levels_mm = 'limit'" in load_job(path).job.findings
    assert math.isclose(load_job(path).job.operations[0].levels_mm[1], 3.5)
