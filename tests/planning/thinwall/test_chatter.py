"""Depths that chatter allows on a wall: against a simulation in time, a closed-form mode, and a scaling law."""

from __future__ import annotations

import math

import numpy as np
import pytest

from chipload.cutter.cutter import Cutter
from chipload.cutting.material import Material
from chipload.errors import InputError
from chipload.planning.thinwall.blank import WallBlank
from chipload.planning.thinwall.chatter import WallCutting, WallMotion, quietest_speed, stable_depths
from chipload.planning.thinwall.depth import DepthRange
from chipload.planning.thinwall.plane_stock import CutterPose, engagement_of_depths
from chipload.stability.margin import stability_margins
from chipload.stability.modes import Modes
from chipload.structure.grid import plate
from chipload.structure.solid import SolidWorkpiece
from stability.stability_oracles import in_time_by_teeth

METAL = Material("m", 700.0, 250.0, 120.0, 0.0, 0.0, 0.0, source="made up for tests")
POSE = CutterPose(Cutter(8.0, 3, 0.5, 20.0, 40.0, 6e5, corner_radius=4.0), 0.05, -0.5, 0.1, math.radians(40.0))
LIMITS = DepthRange(0.05, 0.8)
RPM = math.tau / 60.0
#: a mode of the wall along its normal, and a little up it
FREQUENCY, STIFFNESS, DAMPING = 1200.0, 900.0, 0.01
SHAPE = np.array([0.0, 0.15, 1.0]) * math.tau * FREQUENCY / math.sqrt(STIFFNESS)


def wall_of(scale=1.0):
    return WallMotion(np.array([FREQUENCY]), scale * SHAPE[None, :, None], np.eye(3)[None])


def cutting_of(cutter_modes=None, margin=1.0):
    return WallCutting(POSE, METAL, cutter_modes, DAMPING, margin)


def growth_in_time(depth, speed, shapes, frequency):
    """log|mu| of a revolution by stepping in time; U as columns along T, n and A."""
    met = engagement_of_depths(POSE, [depth], 4)
    own, rows = met.slices[met.slice], met.rows
    U = np.ascontiguousarray(POSE.frame @ shapes)
    w = math.tau * np.asarray(frequency)
    steps = max(200, math.ceil(200 * w.max() / math.tau * math.tau / (3 * speed)))
    half = 0.5 * (rows[:, 2] + rows[:, 3])
    lag = own[:, 5] + own[:, 6] * (half - own[:, 0])
    return in_time_by_teeth(
        80, steps, np.zeros(3), np.array(rows[:, 0]), np.array(rows[:, 1]), lag, own[:, 3].copy(), own[:, 4].copy(),
        rows[:, 3] - rows[:, 2], 0.05, *METAL.coefficients[:3], w, np.full(len(w), DAMPING), U, speed / RPM,
    )  # fmt: skip


@pytest.mark.parametrize("rpm", [7000.0, 9000.0, 13000.0])
def test_the_stable_depth_is_where_a_simulation_in_time_begins_to_grow(rpm):
    depth = float(stable_depths(cutting_of(), [wall_of()], LIMITS, rpm * RPM, 7)[0])
    assert LIMITS.smallest < depth < 0.9 * LIMITS.greatest
    shapes = SHAPE[:, None]
    assert growth_in_time(0.93 * depth, rpm * RPM, shapes, [FREQUENCY]) < 0.0
    assert growth_in_time(1.07 * depth, rpm * RPM, shapes, [FREQUENCY]) > 0.0


def test_the_margin_times_the_square_of_a_single_mode_is_the_same_everywhere():
    cutting, speed = cutting_of(), 9000.0 * RPM
    found = []
    for scale in (0.8, 1.0, 1.4):
        wall = wall_of(scale)
        cut = cutting.bare(np.array([0.3]), speed)
        some = cutting.vibrating(cut, wall, np.einsum("ab,pbj->paj", POSE.frame, wall.frames))
        found.append(float(stability_margins(some).margin[0]) * scale**2)
    assert found == pytest.approx([found[1]] * 3, rel=5e-3)


def test_the_depth_on_a_strip_is_that_of_its_closed_form_mode():
    """A cantilever strip: f = 1.8751^2 / (2 pi) sqrt(E I / (rho A L^4)), its end moves by 2 / sqrt(mass)."""
    length, width, thick, E, rho = 40.0, 6.0, 2.0, 70e3, 2.7e-9
    grid = plate(width, length, thick, (2, 8, 1))
    solid = SolidWorkpiece(grid, E, 0.0, rho, grid.side("j-"))
    blank = WallBlank(solid, (0.0, 0.2))
    none = np.zeros(blank.shape)
    hertz, shapes = blank.modes((none, none), "k+", 1)
    t = thick - 0.2
    closed = 1.875104**2 / math.tau * math.sqrt(E * t**2 / (12.0 * rho * length**4))
    assert hertz[0] == pytest.approx(closed, rel=0.01)
    end = shapes.reshape(*blank.shape, 3)[1, -1]
    assert abs(end[2]) == pytest.approx(2.0 / math.sqrt(rho * width * t * length), rel=0.01)
    cutting, speed = cutting_of(margin=1.0), 9000.0 * RPM
    frames = np.eye(3)[None]
    by_elements = WallMotion(hertz, end[None, :, None], frames)
    slope = 1.376 / length * 0.5 * t * end[2]  # the end turns by 1.376 / L of what it moves, the face is t / 2 away
    by_hand = WallMotion(np.array([closed]), np.array([[[0.0], [-slope], [end[2]]]]), frames)
    one, other = (stable_depths(cutting, [w], DepthRange(1e-4, 0.8), speed, 8)[0] for w in (by_elements, by_hand))
    assert one == pytest.approx(other, rel=0.05)
    assert one > 1e-4


def test_more_margin_and_more_states_only_lessen_the_depth():
    stiff = Modes([1900.0], [0.03], [9000.0], [[1.0, 0.0]])
    softer = WallMotion(np.array([1100.0]), wall_of().shapes, wall_of().frames)
    speed = 7000.0 * RPM
    one, two = (stable_depths(cutting_of(stiff, m), [wall_of()], LIMITS, speed)[0] for m in (1.0, 1.5))
    both = stable_depths(cutting_of(stiff), [wall_of(), softer], LIMITS, speed)[0]
    alone = stable_depths(cutting_of(stiff), [softer], LIMITS, speed)[0]
    assert 0.0 <= two < one
    assert both == pytest.approx(min(one, alone), rel=0.05)


def test_the_quietest_speed_has_the_greatest_depth():
    speeds = np.linspace(7000.0, 14000.0, 8) * RPM
    best = quietest_speed(cutting_of(), [wall_of()], LIMITS, speeds, speeds[0])
    depths = [stable_depths(cutting_of(), [wall_of()], LIMITS, s, 0)[0] for s in speeds]
    assert depths[int(np.flatnonzero(speeds == best)[0])] == max(depths) > min(depths)


def test_what_cannot_be_is_refused():
    with pytest.raises(InputError, match=r"dynamics\.damping_ratio = 0"):
        WallCutting(POSE, METAL, None, 0.0, 1.0)
    with pytest.raises(InputError, match=r"dynamics\.margin = 0\.5: must be at least 1"):
        WallCutting(POSE, METAL, None, 0.01, 0.5)
