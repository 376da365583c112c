"""Cutters that are too short for a channel: found by `check`, before anything is searched."""

from __future__ import annotations

import math

import numpy as np
import pytest

from chipload.cutter.catalogue import Catalogue, CatalogueCutter
from chipload.examples import copy_example
from chipload.geometry.revolve import Revolved
from chipload.geometry.sections import Blade
from chipload.jobs import check_job, load_job
from chipload.jobs.impeller.channel_depth import channel_depth, reach_line, too_short
from chipload.planning.impeller.impeller import Impeller
from chipload.planning.impeller.parametric import ImpellerShape, impeller_of

SHAPED = impeller_of(ImpellerShape())


def straight(shroud: float) -> Impeller:
    """The blades of the example between two cylinders."""
    hub, outer = (Revolved(np.array([[r, 0.0], [r, 60.0]]), side) for r, side in ((20.0, -1), (shroud, 1)))
    blade: Blade = SHAPED.blade
    return Impeller(blade, None, hub, outer, 8)


def test_the_depth_below_a_cylinder_is_that_of_the_radii():
    angle = np.linspace(0.0, 5.0, 20)
    points = np.column_stack([20.0 * np.cos(angle), 20.0 * np.sin(angle), np.linspace(0.0, 60.0, 20)])
    assert channel_depth(straight(47.0), points) == pytest.approx(27.0, rel=1e-12)
    assert channel_depth(straight(47.0), 1.1 * points[:10]) == pytest.approx(25.0, rel=1e-12)


def test_a_short_cutter_with_a_slender_holder_may_reach():
    """Two of eight blades on a radius of 47 mm are at most 2 x 47 sin(22.5 deg) = 35.97 mm apart."""
    gap = 2.0 * 47.0 * math.sin(math.radians(22.5))
    wide, slender = (CatalogueCutter(6.0, 1.0, 10.0, reach=20.0, holder_diameter=d) for d in (1.001 * gap, 0.999 * gap))
    long = CatalogueCutter(8.0, 1.0, 10.0, reach=28.0, holder_diameter=60.0)
    impeller, catalogue = straight(47.0), Catalogue("shop", (wide, slender, long))
    assert too_short(impeller, catalogue, 27.0) == (wide,)
    point = np.array([[20.0, 0.0, 30.0]])
    line, reached = reach_line(impeller, catalogue, point)
    assert reached
    assert line.endswith("1 of 3 cutters are too short, the longest of these with reach_mm = 20")
    line, reached = reach_line(impeller, Catalogue("short", (wide,)), point)
    assert not reached
    assert line.endswith("add cutters with reach_mm of at least 27")


def test_check_says_that_no_cutter_is_long_enough(tmp_path):
    path = copy_example("impeller", tmp_path / "job") / "job.toml"
    lines, holds = check_job(load_job(path))
    assert holds
    assert lines[-2].endswith("no cutter is too short, 37 of 37 state no reach_mm")
    (path.parent / "short.toml").write_text(
        'name = "short"\n[[cutter]]\ndiameter_mm = 14.0\ncorner_radius_mm = 1.5\n'
        "cutting_length_mm = 15.0\nreach_mm = 30.0\nholder_diameter_mm = 200.0\n"
    )
    text = path.read_text()
    path.write_text(text.replace('[catalogue]\nname = "wu2019"', '[catalogue]\nfile = "short.toml"'))
    lines, holds = check_job(load_job(path))
    assert not holds
    assert "no cutter reaches the deepest point: add cutters with reach_mm of at least 39.31" in lines[-2]
