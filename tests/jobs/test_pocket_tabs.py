"""Pockets that leave tabs."""

from __future__ import annotations

import numpy as np
import pytest
import shapely

from chipload.errors import InputError
from chipload.program.program import ARC_CCW, ARC_CW, LINE
from chipload.result import Verdict
from pocket_job import SQUARE, checked, done, operation, swept, written

RING = {"part": [[(0, 0), (26, 0), (26, 22), (0, 22)], [(8, 8), (18, 8), (18, 14), (8, 14)]]}
TABS = "tabs = { at_mm = [[18.0, 10.0], [8.0, 12.0]], width_mm = 4.0, height_mm = 1.5 }"


def opened(shape, radius):
    """What a disc reaches of a shape."""
    return shapely.buffer(shapely.buffer(shape, -radius, quad_segs=128), radius, quad_segs=128)


@pytest.mark.parametrize(
    "more",
    ["", "\nallowance_mm = 0.2\nwall_finish = { feed_mm_min = 600.0, speed_rpm = 8000.0 }"],
    ids=["", "finished"],
)
def test_tabs_hold_the_part(tmp_path, more):
    """Above 1.5 mm the ring is cleared, below the strips stay whole: areas of both heights, by polygons."""
    (pocket,), outcome = done(written(tmp_path, RING, operation(f"radial_depth_mm = 1.5\n{TABS}{more}", cutter=2)))
    ring = shapely.difference(shapely.box(0, 0, 26, 22), shapely.box(8, 8, 18, 14))
    strips = shapely.union(shapely.box(18, 8, 26, 12), shapely.box(0, 10, 8, 14))
    below = swept(pocket.program, 2.5, -4.0)
    assert shapely.intersection(below, strips).area < 4e-2  # 1 um, the chords of this check, along 40 mm of edges
    assert below.area == pytest.approx(opened(shapely.difference(ring, strips), 2.5).area, rel=3e-3)
    above = shapely.union(swept(pocket.program, 2.5, -2.5), below)
    assert above.area == pytest.approx(opened(ring, 2.5).area, rel=3e-3)
    assert shapely.difference(strips, above).area < 0.3
    p = pocket.program
    cutting = np.isin(p.motion, (LINE, ARC_CW, ARC_CCW)) & (np.diff(p.p_work[:, 2], prepend=9.0) == 0.0)
    assert set(np.unique(p.p_work[cutting, 2].round(6))) >= {-4.0, -2.5}
    (check,) = outcome.operations[0].verifications.values()
    assert check.numbers["gouge_mm"] < 1e-3
    assert check.verdict is Verdict.HOLDS


@pytest.mark.parametrize(
    ("operations", "text"),
    [
        (
            ["radial_depth_mm = 1.2\ntabs = { at_mm = [[15.0, 12.0]], width_mm = 3.0, height_mm = 1.0 }"],
            "operation.tabs.at_mm: (15, 12) is 12 mm from the nearest wall: must be within width_mm = 3",
        ),
        (
            ["radial_depth_mm = 1.2\ntabs = { at_mm = [[0.0, 12.0]], width_mm = 3.0, height_mm = 4.0 }"],
            "operation.tabs.height_mm = 4: must be below the depth of the pocket, 4",
        ),
        (
            ["radial_depth_mm = 1.2\nfloor_allowance_mm = 0.5", "radial_depth_mm = 0.6\nrest_of = 0"],
            "operation.1.rest_of = 0: that operation is 3.5 mm deep without its floor_allowance_mm, this one 4",
        ),
        (
            [
                "radial_depth_mm = 1.2\ntabs = { at_mm = [[0.0, 12.0]], width_mm = 3.0, height_mm = 1.0 }",
                "radial_depth_mm = 0.6\nrest_of = 0",
            ],
            "operation.1.rest_of = 0: that operation leaves tabs",
        ),
    ],
)
def test_refused(tmp_path, operations, text):
    listed = [operation(more, cutter=k + 1) for k, more in enumerate(operations)]
    with pytest.raises(InputError) as err:
        checked(written(tmp_path, {"part": [SQUARE]}, *listed))
    assert text in str(err.value)
