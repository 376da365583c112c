"""The front on the test pockets of another generator: engagement held, nearly all of the reachable area cleared."""

import math
import os
from pathlib import Path

import numpy as np
import pytest

from chipload.geometry.contour import Region
from chipload.geometry.dxf import read_dxf
from chipload.planning.front.front import CUT, clear_region
from chipload.simulation.trail import Trail, rim_engagement

DATA = Path(os.environ.get("CHIPLOAD_DATA", Path(__file__).parents[3] / "shared" / "data")) / "cad" / "dxf_hsm_nibbler"
#: drawing -> cutter radius [mm]; the radial depth is a fifth of it
POCKETS = {
    "arcs": 4.0,
    "circle": 3.0,
    "circle_point": 8.0,
    "curve": 6.0,
    "diverging_lines": 6.0,
    "gear": 3.0,
    "hextest": 4.0,
    "missing_arc": 4.0,
    "octagon": 5.0,
    "square1": 3.0,
    "square2": 3.0,
    "square_circle": 4.0,
    "squiffey": 8.0,
    "squiffey2": 8.0,
    "taper": 5.0,
}


@pytest.mark.skipif(not DATA.is_dir(), reason="no real drawings: set CHIPLOAD_DATA")
@pytest.mark.parametrize("name", POCKETS)
def test_pocket(name):
    drawing = read_dxf(DATA / f"{name}.dxf", units_if_unsaid="mm")
    region = Region.of([c for c in drawing.contours if c.closed])
    radius = POCKETS[name]
    wanted = math.acos(1.0 - 0.2)
    path = clear_region(region, radius, wanted)
    assert path.cleared_share >= 0.995
    assert path.engagement_max[path.kind == CUT].max() <= wanted + 1e-4
    points = np.column_stack([path.x, path.y])
    steps = np.column_stack([points[:-1], points[1:], np.zeros((len(points) - 1, 3))])
    trail = Trail(steps, radius, None, path.kind[1:] < 3)
    cut = np.flatnonzero(path.kind[1:] == CUT)[::40]
    rim = rim_engagement(trail, cut, np.full(len(cut), 0.5), workers=2)
    assert np.degrees(rim.angle).max() <= math.degrees(wanted) + 0.06
