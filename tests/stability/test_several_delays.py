"""Three directions, and runout that makes delays of several tooth periods, against simulations in time."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from chipload.cutter.cutter import Cutter
from chipload.cutting.force import mean_forces
from chipload.cutting.material import Material
from chipload.engagement.tooth_engagement import ToothEngagement, engagement_of_arcs
from chipload.engagement.tooth_surfaces import chips_of_teeth
from chipload.errors import InputError
from chipload.stability._several_delays import matrices3
from chipload.stability.cuts import dynamic_cuts
from chipload.stability.margin import largest_multipliers, stability_margins
from chipload.stability.modes import Modes
from stability.stability_oracles import HALF, METAL, TAU, TWO, down, in_time_by_teeth, mill

THRUST = Material("thrust", 700.0, 210.0, 150.0, 0.0, 0.0, 0.0, source="made up for tests")
FEED = 0.05
#: discs of a bull nose: s from, rho, z, sin(kappa), cos(kappa), lag and its rate, of which each cuts 0.5 mm
NOSE = np.array(
    [[0.5 * k, 4.0, 0.3 * k, math.sin(a), math.cos(a), 0.0, 0.0] for k, a in enumerate(np.radians([20.0, 45.0, 75.0]))]
)
#: x, y and a mode along the axis and across it
SPATIAL = Modes(
    [650.0, 720.0, 900.0], [0.02, 0.025, 0.02], [5000.0, 7000.0, 6000.0], [[1, 0, 0], [0, 1, 0], [0.3, 0.5, 0.8]]
)


def nose_cut(modes, rpm, arc=HALF, *, metal=THRUST, teeth=3, length=0.5, directions=3):
    """Three discs of a bull nose, engaged over one arc."""
    rows = [[*arc, 0.5 * k, 0.5 * k + length, FEED * own[3], 0.0, 0.0] for k, own in enumerate(NOSE)]
    met = ToothEngagement([0, 3], rows, [-1] * 3, [0, 1, 2], NOSE)
    T, n, A = [[1.0, 0.0, 0.0]], [[0.0, 1.0, 0.0]], [[0.0, 0.0, 1.0]]
    return dynamic_cuts(met, mill(teeth), metal, modes, rpm * TAU / 60.0, T, n, A=A, directions=directions)


def growth_in_time(modes, rpm, arc, sine, cosine, length, radii, metal=THRUST, feed=FEED):
    """log|mu| of a revolution."""
    w, direction = modes.omega, np.pad(modes.direction, ((0, 0), (0, 3 - modes.direction.shape[1])))
    U = np.ascontiguousarray(direction.T * w / np.sqrt(modes.stiffness))
    steps = max(160, math.ceil(160 * w.max() / TAU * 60.0 / (rpm * len(radii))))
    ends = (np.full(len(sine), x) for x in arc)
    return in_time_by_teeth(
        100,
        steps,
        radii,
        *ends,
        np.zeros(len(sine)),
        sine,
        cosine,
        length,
        feed,
        *metal.coefficients[:3],
        w,
        np.array(modes.damping),
        U,
        rpm,
    )


@pytest.mark.parametrize("helix", [0.0, 30.0])
@pytest.mark.parametrize(("rpm", "depth"), [(6000, 2.0), (9000, 4.0), (8000, 1.0)])
def test_a_flank_in_three_directions_has_the_multiplier_of_two(rpm, depth, helix):
    """Modes in x and y: the axis neither changes the chip nor moves."""
    cutter = mill(3, helix)
    met = engagement_of_arcs([HALF[0]], [HALF[1]], FEED, cutter, depth)
    two, three = (
        dynamic_cuts(met, cutter, THRUST, TWO, rpm * TAU / 60.0, [[1.0, 0.0]], [[0.0, 1.0]], directions=d)
        for d in (2, 3)
    )
    assert largest_multipliers(three)[0] == pytest.approx(largest_multipliers(two)[0], rel=1e-8)
    a, b = stability_margins(two), stability_margins(three)
    assert b.margin[0] == pytest.approx(a.margin[0], rel=4e-3)
    assert (b.mode[0], b.growth[0]) == (a.mode[0], pytest.approx(a.growth[0], abs=1e-3))


@pytest.mark.parametrize("exponents", [(0.0, 0.0, 0.0), (0.25, 0.25, 0.25)])
def test_the_matrix_times_a_feed_is_the_force_of_the_chip(exponents):
    """A displacement of a feed along T cuts a chip of the nominal thickness: the mean force of the product's own force
    model, along T, n and the axis; with exponents its slope, (1 - m) of it.
    """
    for own, helix in ((0, 0.0), (1, 0.0), (2, 0.0), (1, 30.0)):
        discs = NOSE.copy()
        discs[:, 6] = math.tan(math.radians(helix)) / 4.0
        metal = Material("m", 700.0, 300.0, 150.0, 0.0, 0.0, 0.0, source="made up for tests", exponents=exponents)
        met = ToothEngagement(
            [0, 1], [[0.4, 2.7, 0.0, 0.5, FEED * NOSE[own][3], 0.0, 0.0]], [-1], [own], discs, np.eye(3)[None]
        )
        cutter, m = mill(3, helix), 40
        cut = dynamic_cuts(met, cutter, metal, SPATIAL, 600.0)
        A = np.zeros((m, 3, 9))
        matrices3(cut.rows, 0, 1, TAU / 3, m, cut.exponents, A)
        mean = np.einsum("mgc,g->c", A, [5 / 18, 8 / 18, 5 / 18]).reshape(3, 3) / m
        force = mean_forces(met, cutter, metal)[0][0]
        assert np.abs(force).min() > 0.1
        assert mean @ [FEED, 0.0, 0.0] == pytest.approx((1.0 - exponents[0]) * force, rel=1e-5)


@pytest.mark.parametrize(
    ("rpm", "share", "length"),
    [(6000, 0.5, 0.5), (9000, 0.5, 0.9), (8000, 0.3, 0.2), (12000, 1.0, 0.3), (7000, 1.0, 0.4), (10500, 0.5, 0.1)],
)
def test_a_bull_nose_in_three_directions_grows_as_in_time(rpm, share, length):
    arc = down(share)
    cut = nose_cut(SPATIAL, rpm, arc, length=length)
    exact = 3 * math.log(abs(largest_multipliers(cut)[0]))
    told = growth_in_time(SPATIAL, rpm, arc, NOSE[:, 3].copy(), NOSE[:, 4].copy(), np.full(3, length), np.zeros(3))
    assert told == pytest.approx(exact, abs=0.05 + 0.03 * abs(exact))
    rigid = Modes(SPATIAL.frequency[:2], SPATIAL.damping[:2], SPATIAL.stiffness[:2], SPATIAL.direction[:2])
    if rpm == 9000:
        assert abs(3 * math.log(abs(largest_multipliers(nose_cut(rigid, rpm, arc, length=length))[0])) - exact) > 0.1


@pytest.mark.parametrize(
    ("rpm", "share", "depth", "offset"),
    [(6000, 0.5, 2.0, 0.01), (6000, 0.5, 2.0, 0.03), (9000, 0.5, 3.0, 0.02), (8000, 1.0, 0.8, 0.015),
     (11000, 0.1, 6.0, 0.02), (7000, 0.3, 3.0, 0.06)],
)  # fmt: skip
def test_runout_grows_as_in_time(rpm, share, depth, offset):
    """Where a tooth misses its turn the next one cuts what the one before it left, two tooth periods ago."""
    arc = down(share)
    cutter = replace(mill(3), runout=(offset, 0.4))
    met = engagement_of_arcs([arc[0]], [arc[1]], FEED, mill(3), depth)
    cut = dynamic_cuts(met, cutter, METAL, TWO, rpm * TAU / 60.0, [[1.0, 0.0]], [[0.0, 1.0]])
    assert (cut.delay > 1.5 * TAU / 3).any()
    exact = math.log(abs(largest_multipliers(cut)[0]))
    radii = offset * np.cos(0.4 - np.arange(3) * TAU / 3)
    one = np.ones(1)
    told = growth_in_time(TWO, rpm, arc, one, 0.0 * one, depth * one, radii, METAL)
    assert told == pytest.approx(exact, abs=0.05 + 0.03 * abs(exact))
    found = stability_margins(cut)
    assert (found.margin[0] < 1.0) == (exact > 0.0)
    if found.margin[0] < 3.0:
        assert abs(largest_multipliers(cut, found.margin)[0]) == pytest.approx(1.0, abs=0.02)


def test_a_small_runout_changes_nothing_and_a_great_one_leaves_one_tooth():
    small, great = (replace(mill(3), runout=(e, 0.0)) for e in (1e-9, 0.2))
    speed, frames = 6000 * TAU / 60.0, ([[1.0, 0.0]], [[0.0, 1.0]])
    # the chips of single teeth begin a little before the front, f / (2 R), which the map of equal teeth does not know
    met = engagement_of_arcs([HALF[0]], [HALF[1]], FEED, mill(3), 2.0)
    plain, one_of_three = (dynamic_cuts(met, c, METAL, TWO, speed, *frames) for c in (mill(3), great))
    even = largest_multipliers(plain)[0]
    assert abs(largest_multipliers(dynamic_cuts(met, small, METAL, TWO, speed, *frames))[0]) == pytest.approx(
        abs(even) ** 3, rel=3e-3
    )
    single = Cutter(10.0, 1, 0.0, 60.0, 80.0, 6e5)
    met = chips_of_teeth(engagement_of_arcs([HALF[0]], [HALF[1]], 3 * FEED, single, 2.0), single)
    alone = dynamic_cuts(met, single, METAL, TWO, speed, *frames)
    assert one_of_three.delay.tolist() == pytest.approx([TAU])
    assert largest_multipliers(one_of_three)[0] == pytest.approx(largest_multipliers(alone)[0], rel=1e-4)


def test_what_the_axis_cannot_do_is_refused():
    with pytest.raises(InputError, match="a mode along the axis with a rigid thrust: ask for 3 directions"):
        nose_cut(SPATIAL, 6000, directions=2)
    with pytest.raises(InputError, match=r"modes\.direction of shape \(1, 4\)"):
        Modes([650.0], [0.02], [5000.0], [[0, 1, 0, 0]])
