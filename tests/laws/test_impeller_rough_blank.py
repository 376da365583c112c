"""Roughing programs on the blank: what rapids and what is above the cutting part take of it, counted by dexels."""

import copy
import math

import numpy as np
import pytest

from chipload.cutter.catalogue import Catalogue, CatalogueCutter
from chipload.errors import InputError
from chipload.jobs.impeller.roughing import blank_of, without_touch
from chipload.machine.machine import machine_named
from chipload.planning.impeller.lines import LineMotion
from chipload.planning.impeller.links import Link
from chipload.planning.impeller.parametric import ImpellerShape, impeller_of
from chipload.planning.impeller.rough_settings import rough_channels
from chipload.planning.impeller.roughing import RoughingSettings, uncut
from chipload.planning.impeller.tables import index_table
from chipload.simulation.channel.stock import taken_from
from chipload.stock.dexel import TriDexel

#: its holder is wider than the channel and near: it may not come down beside the blades
SHORT = CatalogueCutter(12.0, 2.0, cutting_length=30.0, reach=44.0, holder_diameter=30.0)
HOW = RoughingSettings(20.0, 14.0, 0.5, 0.5, LineMotion(0.1, 5.0, 2.0, 0.5), spacing=3.0, around=0, over=1.0)
LINK = Link(2.0, 0.3, 0.1, 0.0, 20.0, 5.0)
TABLE = index_table(machine_named("horizontal-b"))


@pytest.fixture(scope="module")
def impeller():
    return impeller_of(ImpellerShape())


def plans(impeller, cutters, stated, tables=(55.0,), share=0.9):
    return rough_channels(
        impeller, Catalogue("own", cutters), stated, HOW, LINK, 90.0, TABLE.at(np.radians(tables)), share, workers=2
    )


def test_nothing_above_the_cutting_part_touches_the_uncut_blank(impeller):
    (plan,) = plans(impeller, (SHORT,), SHORT)
    blank = TriDexel.of_mesh(blank_of(impeller, [0], HOW, 0.0), 2.5)
    volume = blank.volume()
    # as laid out beside the walls the holder meets what earlier rows left: such rows are left out
    assert taken_from(copy.deepcopy(blank), plan.program, SHORT, 2.5).above.max() > 20.0
    safe, taken, left = without_touch(plan, blank, 2.5, 1.0, machine_named("horizontal-b"))
    assert blank.volume() == volume
    assert len(safe.stopped) + len(safe.tracks.tracks) == len(plan.tracks.tracks)
    assert len(safe.machined) > 4
    # counted again, on a blank of its own
    again = taken_from(blank_of(impeller, [0], HOW, 0.0), safe.program, SHORT, 2.5)
    assert again.above.max() <= 1.0
    assert again.rapid.max() == 0.0
    # but for the pieces in which the text turns an axis
    assert again.after == pytest.approx(left.volume(), rel=1e-4)
    # what is taken: no more than the channel between hub and top of the blank, which is one of 2.6 pitches
    assert 0.1 * volume / 2.6 < taken.before - taken.after < volume / 2.6


def test_top_of_the_blank_is_beside_the_channel_only(impeller):
    p = uncut(impeller, 0, HOW)
    s = ImpellerShape()
    theta, r = np.arctan2(p[:, 1], p[:, 0]), np.hypot(p[:, 0], p[:, 1])
    # at the inlet the channel is narrowest: its width less both allowances is free of points
    inlet = p[:, 2] > p[:, 2].max() - 1e-6
    around = np.sort(theta[inlet])
    gap = float((np.diff(around) * r[inlet].mean()).max())
    # a blade is as thick at the shroud as at the hub
    thick = math.tau * s.hub_radius / s.blades - s.channel
    assert gap == pytest.approx(math.tau * r[inlet].mean() / s.blades - thick - 2.0 * HOW.blades, abs=0.1)


def test_largest_that_fits_and_none_that_does(impeller):
    cutters = tuple(CatalogueCutter(d, 2.0) for d in (10.0, 14.0, 60.0))
    (plan, *_) = plans(impeller, cutters, None, tables=(40.0, 55.0))
    assert plan.cutter.diameter == 14.0
    assert plan.table in TABLE.angle
    with pytest.raises(
        InputError, match=r"operation.0.rough.share = 0.9: no cutter of catalogue own fits at that share"
    ):
        plans(impeller, (CatalogueCutter(60.0, 2.0),), None)
    with pytest.raises(InputError, match=r"operation.0.rough: D 60 r 2 mm fits nowhere in the channel"):
        plans(impeller, cutters, cutters[2])


def test_a_second_table_angle_mills_only_what_the_first_does_not(impeller):
    cutter = CatalogueCutter(26.0, 2.0)
    both = plans(impeller, (cutter,), cutter, tables=(35.0, 90.0))
    if len(both) == 1:
        pytest.skip("one table angle does all")
    first, second = both
    assert sum(t.length for t in second.machined) < 0.5 * sum(t.length for t in first.machined)
    done = np.concatenate([t.contact for t in first.machined])
    for track in second.machined:
        away = [np.linalg.norm(done - p, axis=1).min() for p in track.contact[1:-1]]
        assert min(away, default=math.inf) > 0.3 * HOW.step
