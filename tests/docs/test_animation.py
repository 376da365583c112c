"""The animation of README.md is a small, well-formed file whose numbers are those of the closed form."""

from __future__ import annotations

import math
import re
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from xml.etree import ElementTree

import pytest

from chipload.jobs.contour.result import result_of

ROOT = Path(__file__).parents[2]
FILE = ROOT / "docs" / "contour.svg"
SVG = "{http://www.w3.org/2000/svg}"


@pytest.fixture
def tool():
    spec = spec_from_file_location("animation", ROOT / "tools" / "animation.py")
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_its_numbers_are_those_of_the_corner():
    """The path of the axis has a radius of 3, the cutter of 5, the stock begins at 7.9 from the corner's centre."""
    text = FILE.read_text(encoding="utf-8")
    corner = math.degrees(math.acos((7.9**2 - 3.0**2 - 5.0**2) / (2.0 * 3.0 * 5.0)))
    plain, backward = (float(x) for x in re.findall(r"at most ([\d.]+)<", text))
    assert plain == pytest.approx(corner, abs=0.05)
    assert math.degrees(math.acos(1.0 - 0.1 / 5.0)) < backward < 13.0
    assert "](docs/contour.svg)" in (ROOT / "README.md").read_text(encoding="utf-8")


def test_it_is_small_and_every_animation_has_all_frames(tool):
    assert FILE.stat().st_size < 100_000
    found = list(ElementTree.parse(FILE).iter(f"{SVG}animate"))
    assert len(found) == 2 * 5
    assert {len(one.get("values").split(";")) for one in found} == {tool.FRAMES}


def test_the_sector_is_at_the_wall_and_as_wide_as_the_engagement(tool, outcome):
    """At the first frame the axis runs down along the wall x = 0: the sector begins at the wall, towards the feed."""
    drawn = ElementTree.fromstring(tool.drawing(result_of(outcome())))
    paths = [p for p in drawn.iter(f"{SVG}path") if p.find(f"{SVG}animate") is not None]
    assert len(paths) == 2
    first = paths[0].find(f"{SVG}animate").get("values").split(";")[0]
    points = [tuple(map(float, p.split(","))) for p in re.findall(r"[\d.]+,[\d.]+", first)]
    (x, y), near, *_, far = points
    radius = tool.SCALE * tool.RADIUS
    assert near == pytest.approx((x - radius, y), abs=0.3)
    assert math.degrees(math.atan2(far[1] - y, x - far[0])) == pytest.approx(11.478, abs=0.3)
