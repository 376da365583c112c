"""The front on the test pockets of another generator: engagement held, nearly all of the reachable area cleared."""

import math
import os
from pathlib import Path

import numpy as np
import pytest

from chipload.cutter.cutter import Cutter
from chipload.cutting.material import material_named
from chipload.geometry.contour import Region
from chipload.geometry.dxf import read_dxf
from chipload.machine.feed import move_time
from chipload.machine.machine import machine_named
from chipload.planning.pocket.clearing import clear_region
from chipload.planning.pocket.clearing_path import CUT
from chipload.planning.pocket.plan import plan_pocket
from chipload.planning.pocket.request import Clearing
from chipload.simulation.centre_path import CentrePath, rim_engagement

CAD = Path(os.environ.get("CHIPLOAD_DATA", Path(__file__).parents[3] / "shared" / "data")) / "cad"
DATA = CAD / "dxf_hsm_nibbler"
SEAHORSE = CAD / "dxf_camotics" / "locket" / "seahorse.dxf"
#: drawing -> cutter radius [mm]; the radial depth is a fifth of it
POCKETS = {
    "arcs": 6.0,
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
    drawing = read_dxf(DATA / f"{name}.dxf", units_if_unstated="mm")
    region = Region.of([c for c in drawing.contours if c.closed])
    radius = POCKETS[name]
    wanted = math.acos(1.0 - 0.2)
    path = clear_region(region, radius, wanted)
    assert path.cleared_share >= 0.995
    assert path.engagement_max[path.kind == CUT].max() <= wanted + 1e-4
    trail = CentrePath(path.segments, radius, None, path.kind < 3)
    cut = np.flatnonzero(path.kind == CUT)[::40]
    rim = rim_engagement(trail, cut, np.full(len(cut), 0.5), workers=2)
    assert np.degrees(rim.angle).max() <= math.degrees(wanted) + 0.06


@pytest.mark.skipif(not SEAHORSE.is_file(), reason="no real drawings: set CHIPLOAD_DATA")
def test_outline_of_862_pieces_has_a_finite_time():
    """Passes of one short step between two stops: the time lies between those at the feed alone and with every step
    run from rest to rest.
    """
    machine, feed = machine_named("vmc"), 20.0
    asked = Clearing("down", 0.45, 1.0, feed, 838.0, 0.0, 5.0, 0.2)
    cutter = Cutter(1.5, 3, math.radians(35.0), 20.0, 30.0, 580e3)
    contours = read_dxf(SEAHORSE, units_if_unstated="mm").contours
    result = plan_pocket(contours, asked, cutter, material_named("al7075-carbide"), machine, {}).strategies["pocket"]
    h = result.history
    legs = np.diff(h["s_mm"])
    moving = (legs > 0.0) & (h["pass"][1:] != "link") & (h["pass"][1:] != "ramp")
    took = np.diff(h["t_s"])[moving]
    rest_to_rest = move_time(legs[moving], feed, machine.acceleration_xy, 0.0, 0.0)
    # corners that the controller rounds are shorter than drawn
    assert (took >= legs[moving] / feed * (1.0 - 3e-4)).all()
    assert (took <= rest_to_rest * (1.0 + 1e-6)).all()
    assert result.summary["time_s"] == h["t_s"][-1] >= took.sum()


@pytest.mark.skipif(not DATA.is_dir(), reason="no real drawings: set CHIPLOAD_DATA")
def test_no_pass_is_made_twice_with_long_steps():
    """Two passes far apart took turns for tens of thousands of passes, each counting the same area as before."""
    drawing = read_dxf(DATA / "missing_arc.dxf")

    def progress(share, what):
        assert not what.endswith("pass 20000")

    region = Region.of([c for c in drawing.contours if c.closed])
    path = clear_region(region, 3.0, math.acos(0.7), step=0.75, allowance=0.15, progress=progress)
    points = np.column_stack([path.x, path.y]).round(6)
    cut = path.kind == CUT
    passes = [points[cut & (path.pass_number == k)].tobytes() for k in np.unique(path.pass_number[cut])]
    assert len(set(passes)) == len(passes)
    assert path.cleared_share > 0.97
