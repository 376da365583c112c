"""What a program takes out of a blank, against closed forms."""

import math

import numpy as np
import pytest

from chipload.cutter.catalogue import CatalogueCutter
from chipload.errors import InputError
from chipload.program.build import plunge, rapid
from chipload.program.program import Program
from chipload.simulation.channel.stock import sector, taken_from

MILL = CatalogueCutter(8.0, 0.0, 10.0, shank_diameter=6.0, reach=20.0, holder_diameter=20.0)


@pytest.fixture(scope="module")
def block():
    """A ring sector: 10 to 30 mm from the axis, 20 high, a tenth of a turn about +X."""
    z = np.array([[0.0, 0.0], [0.0, 20.0]])
    return sector(z + np.array([10.0, 0.0]), z + np.array([30.0, 0.0]), -math.pi / 10, math.pi / 10)


def slot_area():
    """Of a slot 8 wide along +X in the sector: between the two cylinders and within its sides."""
    y = np.linspace(-4.0, 4.0, 2001)
    inner = np.maximum(np.sqrt(100.0 - y**2), np.abs(y) / math.tan(math.pi / 10))
    return np.trapezoid(np.sqrt(900.0 - y**2) - inner, y)


def test_blank_is_closed_and_has_its_volume(block):
    assert block.is_watertight
    assert block.volume == pytest.approx(math.pi / 10 * (900.0 - 100.0) * 20.0, rel=1e-3)


def test_slot_takes_its_volume_and_nothing_else(block):
    path = [rapid([[40.0, 0.0, 15.0]], 100.0, 1, "link"), plunge([[0.0, 0.0, 15.0]], 10.0, 100.0, 1, "rough")]
    path += [rapid([[0.0, 0.0, 60.0]], 100.0, 1, "link")]
    got = taken_from(block, Program.join(path), MILL, 0.5)
    assert got.before - got.after == pytest.approx(5.0 * slot_area(), rel=0.02)
    assert got.problems(1e-6) == ()


def test_rapid_and_holder_in_the_blank_are_found(block):
    deep = [rapid([[40.0, 0.0, 4.0]], 100.0, 1, "link"), rapid([[0.0, 0.0, 4.0]], 100.0, 1, "link")]
    got = taken_from(block, Program.join(deep), MILL, 0.5)
    assert got.rapid[1] == pytest.approx(8.0 * 10.0 * 20.0, rel=0.05)
    # the cutting part ends 2 mm below the top of the blank: there the shank, 6 wide, goes through it
    low = [rapid([[40.0, 0.0, 8.0]], 100.0, 1, "link"), plunge([[0.0, 0.0, 8.0]], 10.0, 100.0, 1, "rough")]
    shank = taken_from(block, Program.join(low), MILL, 0.5)
    assert shank.part[1] == 2
    assert shank.above[1] == pytest.approx(2.0 * 6.0 * 20.0, rel=0.05)
    # a holder 10 mm above the tip, wider than the sector: all of its top 2 mm, which the cutting part leaves
    short = CatalogueCutter(8.0, 0.0, 10.0, reach=10.0, holder_diameter=20.0)
    found = taken_from(block, Program.join(low), short, 0.5)
    assert found.part[1] == 3
    assert found.above[1] == pytest.approx(2.0 * math.pi / 10 * 800.0, rel=0.02)
    assert "the holder takes" in found.problems(1.0)[0]


def test_refuses_curves_that_do_not_match():
    with pytest.raises(InputError, match="as many points"):
        sector(np.zeros((3, 2)), np.zeros((2, 2)), 0.0, 1.0)
