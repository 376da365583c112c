"""Process damping against a closed form and collocation: worn edges that rub."""

from __future__ import annotations

import math

import pytest

from chipload.errors import InputError
from chipload.stability.chart import critical_depth
from chipload.stability.margin import largest_multipliers, stability_margins
from chipload.stability.process_damping import ProcessDamping
from stability.stability_oracles import KR, ONE, TAU, TWO, collocation, cut_of, down, with_pitches

SLOT, HALF, THIN = down(1.0), down(0.5), down(0.05)
RADIUS, LAND = 5.0, 0.05


def rubbing(size: float, rpm: float, friction: float = 0.0) -> ProcessDamping:
    """With C_p = ``size`` [N s/mm^2] at a speed: K_sp L_w^2 / (2 v)."""
    return ProcessDamping(2.0 * size * RADIUS * rpm * TAU / 60.0 / LAND**2, LAND, friction)


@pytest.mark.parametrize(("size", "depth"), [(0.01, 1.219204), (0.03, 2.592615)])
def test_the_limit_of_four_teeth_in_a_slot_is_the_closed_form(size, depth):
    """A and C are constant: a mode along n has its limit at 2 k (z + a b) (1 + z + a b) = Krc b, a = C_p w / (2 k)."""
    k, z, w = 5000.0, 0.02, 650.0 * TAU
    a = size * w / (2.0 * k)
    assert 2.0 * k * (z + a * depth) * (1.0 + z + a * depth) == pytest.approx(KR * depth, rel=1e-5)
    # the wave that is chattered at the least depth has a phase of 3/4 of a turn
    chatter = w * math.sqrt(1.0 + 2.0 * (z + a * depth))
    rpm = 60.0 / 4.0 * chatter / TAU / (3.0 + 0.75)
    cut = cut_of(ONE, rpm, depth, SLOT, teeth=4, process=rubbing(size, rpm))
    assert abs(largest_multipliers(cut)[0]) == pytest.approx(1.0, abs=2e-4)
    assert abs(largest_multipliers(cut_of(ONE, rpm, depth, SLOT, teeth=4))[0]) > 1.05


@pytest.mark.parametrize("friction", [0.0, 0.4])
@pytest.mark.parametrize(("rpm", "depth", "arc"), [(3000, 2.5, HALF), (1800, 1.5, SLOT), (4000, 6.0, THIN)])
def test_multipliers_are_those_of_collocation(rpm, depth, arc, friction):
    cut = cut_of(TWO, rpm, depth, arc, process=rubbing(0.01, rpm, friction))
    wanted = collocation(TWO, rpm, depth, arc, n=40, rubbing=0.01, friction=friction)
    assert abs(largest_multipliers(cut, per_wave=40.0)[0]) == pytest.approx(wanted, abs=5e-5)
    assert abs(wanted - abs(largest_multipliers(cut_of(TWO, rpm, depth, arc))[0])) > 0.01


def test_the_error_falls_with_the_cells():
    wanted = collocation(TWO, 3000, 2.5, HALF, n=40, rubbing=0.02)
    cut = cut_of(TWO, 3000, 2.5, HALF, process=rubbing(0.02, 3000))
    off = [abs(abs(largest_multipliers(cut, per_wave=n)[0]) - wanted) for n in (10.0, 20.0, 40.0)]
    assert off[0] > 6.0 * off[1] > 36.0 * off[2]


def test_it_damps_most_at_low_speeds_and_the_margin_says_so():
    process = ProcessDamping(3e4, LAND)
    gain = []
    for rpm in (1500, 6000):
        bare, damped = (stability_margins(cut_of(ONE, rpm, 1.2, HALF, process=p)).margin[0] for p in (None, process))
        assert damped >= bare
        gain.append(damped / bare)
    assert gain[0] > 1.3 > gain[1]


def test_the_critical_depth_counts_it_at_every_depth():
    """The depth at which |mu| is 1: damping grows with the depth as the force does."""
    process = rubbing(0.01, 2000)
    deep = critical_depth(cut_of(ONE, 2000, 1.0, HALF, process=process), 20.0)
    at = cut_of(ONE, 2000, deep, HALF, process=process)
    assert deep > critical_depth(cut_of(ONE, 2000, 1.0, HALF), 20.0)
    assert abs(largest_multipliers(at)[0]) == pytest.approx(1.0, abs=2e-3)


def test_what_cannot_be_is_refused():
    with pytest.raises(InputError, match=r"process_damping.wear_land_mm = 0: must be from 0.0001 to 1"):
        ProcessDamping(1e4, 0.0)
    with pytest.raises(InputError, match=r"not known with cutter.pitch_deg"):
        largest_multipliers(
            with_pitches(cut_of(ONE, 6000, 1.0, HALF, process=ProcessDamping(1e4, 0.05)), [TAU / 3] * 3)
        )
