"""Samples of tooth engagement: which steps are kept, what a chip holds, that a stopped run keeps the same."""

from dataclasses import replace

import numpy as np
import pytest

from chipload.cutter.cutter import Cutter
from chipload.cutting.material import Material
from chipload.engagement.tooth_engagement import engagement_of_arcs
from chipload.engagement.tooth_surfaces import chips_of_teeth
from chipload.errors import InputError
from chipload.simulation.engagement_samples import EngagementRecorder, engagement_samples, samples_from
from chipload.simulation.loads import Cuts

MILL = Cutter(8.0, 2, 0.5, 12.0, 20.0, 6e5)
#: without edge forces: all work of the torque is in the chips
METAL = Material("plain", 1500.0, 400.0, 200.0, 0.0, 0.0, 0.0, source="made up for a test")
DEPTH = 3.0


def cuts_of(steps, cutter=MILL, tool=1):
    """Steps with an immersion and a feed per tooth of their own."""
    n = len(steps)
    feed, wide = 0.05 + 1e-4 * np.asarray(steps), np.full(n, 1.2)
    own = engagement_of_arcs(np.zeros(n), wide, feed, cutter, DEPTH)
    own = replace(own, frame=np.tile(np.eye(3), (n, 1, 1)))
    chips = chips_of_teeth(own, cutter)
    return Cuts(tool, cutter, np.asarray(steps), np.zeros((n, 12)), chips, own, np.full(n, 300.0))


def recorded(those, block, **most):
    recorder = EngagementRecorder(METAL, **most)
    for k in range(0, len(those), block):
        assert recorder(cuts_of(those[k : k + block])) == {}
    return recorder


def test_volume_and_work_of_the_chips_are_those_of_the_material() -> None:
    # the front, whose chips are f sin(phi)
    found = engagement_samples(cuts_of(np.array([4])).plain, MILL, METAL, np.array([4]), 1)
    low, high, along, offset, across, rho, z_low, _, z_high = found.ranges[0, :9]
    # of each tooth: feed times the width of the cut times its depth, R (1 - cos 1.2) wide
    chip = 0.0504 * 4.0 * (1.0 - np.cos(1.2)) * DEPTH
    assert (low, high, rho, z_low, z_high) == pytest.approx((0.0, 1.2, 4.0, 0.0, DEPTH))
    assert along * rho * (np.cos(low) - np.cos(high)) * (z_high - z_low) == pytest.approx(chip)
    assert (offset, across) == (0.0, 0.0)
    # a turn of the mean torque is the specific energy of two chips [N mm]
    assert 2.0 * np.pi * 1000.0 * found.turn[0, :, 3].mean() == pytest.approx(2.0 * 1500.0 * chip, rel=1e-3)


@pytest.mark.parametrize("block", [7, 64, 1000])
def test_what_is_kept_does_not_depend_on_the_blocks(block) -> None:
    steps = np.flatnonzero(np.arange(1000) % 10 < 7)
    found = recorded(steps, block, steps=100).samples()
    # 700 steps cut: every eighth is the first stride that keeps 100 at most
    assert found.stride == 8
    assert found.row.tolist() == [k for k in steps.tolist() if k % 8 == 0]
    # each step has a feed of its own: the chips are those of its row
    own = cuts_of(found.row).engagement
    assert found.start.tolist() == own.start.tolist()
    np.testing.assert_array_equal(found.ranges[:, [0, 1, 2, 3, 4]], own.rows[:, [0, 1, 4, 5, 6]])
    thickest = found.ranges[found.start[:-1], 2]
    np.testing.assert_allclose(thickest, 0.05 + 1e-4 * found.row, rtol=0.02)
    assert (np.diff(thickest) > 0.0).all()


def test_few_ranges_are_kept_and_two_tools_stand_in_the_order_of_their_rows() -> None:
    recorder = EngagementRecorder(METAL, ranges=40)
    steps = np.arange(60)
    recorder(cuts_of(steps[steps % 20 < 10]))
    recorder(cuts_of(steps[steps % 20 >= 10], Cutter(8.0, 2, 0.5, 12.0, 20.0, 6e5, runout=(0.005, 0.0)), 2))
    found = recorder.samples()
    assert len(found.ranges) <= 40
    assert (np.diff(found.row) == found.stride).all()
    assert found.tool.tolist() == [1 if k % 20 < 10 else 2 for k in found.row.tolist()]
    # with runout each tooth has a chip of its own
    second = int(np.argmax(found.tool == 2))
    assert set(found.ranges[found.start[second] : found.start[second + 1], 11].tolist()) == {0.0, 1.0}
    assert set(found.ranges[: found.start[1], 11].tolist()) == {-1.0}


def test_a_stopped_run_goes_on_to_the_bit(tmp_path) -> None:
    steps = np.arange(500)
    whole = recorded(steps, 50, steps=60).samples()
    first = recorded(steps[:250], 50, steps=60)
    (tmp_path / "state.npz").write_bytes(first.to_bytes())
    again = EngagementRecorder(METAL, steps=60)
    again.restore(tmp_path / "state.npz")
    for k in range(250, 500, 50):
        again(cuts_of(steps[k : k + 50]))
    both = whole.arrays(), again.samples().arrays()
    assert all(np.array_equal(both[0][name], both[1][name]) for name in both[0])
    again.clear()
    assert again.samples() is None
    (tmp_path / "state.npz").write_bytes(again.to_bytes())
    again.restore(tmp_path / "state.npz")
    assert again.samples() is None
    (tmp_path / "state.npz").write_bytes(b"no archive")
    with pytest.raises(InputError, match="remove its folder"):
        again.restore(tmp_path / "state.npz")


def test_a_damaged_file_is_refused() -> None:
    arrays = recorded(np.arange(20), 20).samples().arrays()
    back = samples_from(arrays)
    assert back.row.tolist() == list(range(20))
    assert len(back.at_most(5)) == 5
    with pytest.raises(InputError, match="turn"):
        samples_from({name: values for name, values in arrays.items() if name != "turn"})
    with pytest.raises(InputError, match="ranges of shape"):
        samples_from({**arrays, "ranges": arrays["ranges"][1:]})
