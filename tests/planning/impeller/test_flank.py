"""Flank passes: closed forms of ruled surfaces, the least deviation against a search by another method."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import minimize

from chipload.cutter.catalogue import CatalogueCutter
from chipload.errors import InputError
from chipload.geometry.bspline import patch_through
from chipload.machine.machine import machine_named
from chipload.planning.impeller.five_axis_program import (
    LinkedPath,
    five_axis_program,
    lift_from_end,
    outline_of,
    rotary_share,
)
from chipload.planning.impeller.flank import flank_pass
from chipload.planning.impeller.links import Link
from chipload.planning.impeller.scene import Scene
from chipload.program.program import LINE, RAPID
from chipload.program.to_axes import to_axes

U = np.linspace(0.0, 1.0, 41)
CUTTER = CatalogueCutter(12.0, 1.0)


def ruled(lower, upper, side=1):
    """The patch through straight lines between two curves (41, 3)."""
    v = np.linspace(0.0, 1.0, 5)
    return patch_through(lower[:, None] * (1.0 - v[:, None]) + upper[:, None] * v[:, None], U, v, side=side)


def cone(turn=0.9):
    """A cone of 40 mm below, 30 mm above, 20 mm high: it can be unrolled."""
    a = turn * U
    rim = np.column_stack([np.cos(a), np.sin(a), 0.0 * a])
    return ruled(40.0 * rim, 30.0 * rim + [0.0, 0.0, 20.0])


def twisted(degrees=10.0):
    """A helicoid: rulings of 20 mm along a line of 40 mm that turn about it."""
    a = np.radians(degrees) * (U - 0.5)
    lower = np.column_stack([40.0 * U, 0.0 * U, 0.0 * U])
    return ruled(lower, lower + 20.0 * np.column_stack([0.0 * a, np.sin(a), np.cos(a)]))


def test_a_surface_that_can_be_unrolled_is_milled_exactly():
    found = flank_pass(cone(), (0.1, 0.9), (0.0, 1.0), CUTTER, 0.001)
    assert found.deviation < 2e-4
    # the axis is parallel to the ruling, and the tip one corner radius below its foot
    a = 0.9 * found.u
    ruling = np.column_stack([-10.0 * np.cos(a), -10.0 * np.sin(a), 20.0 + 0.0 * a]) / math.hypot(10.0, 20.0)
    assert np.degrees(np.arccos((found.axis * ruling).sum(axis=1).clip(-1, 1))).max() < 0.05
    normal = np.column_stack([20.0 * np.cos(a), 20.0 * np.sin(a), 10.0 + 0.0 * a]) / math.hypot(10.0, 20.0)
    sign = np.sign((found.normal * normal).sum(axis=1))[:, None]
    foot = 40.0 * np.column_stack([np.cos(a), np.sin(a), 0.0 * a])
    assert found.tip == pytest.approx(foot + 6.0 * sign * normal - ruling, abs=0.02)


def test_deviation_of_a_twisted_side_is_the_least_of_a_direct_search():
    side = twisted()
    found = flank_pass(side, (0.4, 0.6), (0.0, 1.0), CUTTER, 0.01)
    k = len(found.u) // 2
    u = float(found.u[k])
    v = np.linspace(0.0, 1.0, 33)
    near = np.linspace(max(u - 0.15, 0.0), u + 0.15, 301)
    P = side.at(np.tile(near, 33), np.repeat(v, 301)).reshape(33, 301, 3)

    def worst(y):
        """Of an axis by four numbers of its own: where it meets two planes z = 0 and z = 20."""
        a, b = np.array([y[0], y[1], 0.0]), np.array([y[2], y[3], 20.0])
        A = (b - a) / np.linalg.norm(b - a)
        far = np.linalg.norm(np.cross(P - a, A), axis=-1).min(axis=1)
        return float(np.abs(far - 6.0).max())

    p, A = found.tip[k], found.axis[k]
    y = np.concatenate([(p + (h - p[2]) / A[2] * A)[:2] for h in (0.0, 20.0)])
    mine = worst(y)
    assert mine == pytest.approx(max(found.left[k], -found.gouge[k]), abs=1e-3)
    best = min(
        minimize(worst, y + d, method="Nelder-Mead", options={"xatol": 1e-6, "fatol": 1e-8, "maxiter": 600}).fun
        for d in (np.zeros(4), np.array([0.05, 0.05, -0.05, 0.05]))
    )
    assert 0.0 < mine <= best + 1e-3
    assert found.unimproved < 1e-3


def test_thinner_cutters_deviate_less_and_more_twist_more():
    dev = {
        (d, t): flank_pass(twisted(t), (0.3, 0.7), (0.0, 1.0), CatalogueCutter(d, 1.0), 0.01).deviation
        for d, t in ((6.0, 10.0), (12.0, 10.0), (12.0, 20.0))
    }
    assert dev[6.0, 10.0] < dev[12.0, 10.0] < dev[12.0, 20.0]
    # an axis through the two points that are offset by R leaves R (1 - cos(psi / 2)) half way up [Liu1995], psi the
    # turn of the normal over the ruling
    for (d, t), found in dev.items():
        psi = math.atan(math.radians(t) / 40.0 * 20.0)
        assert found < 0.5 * d * (1.0 - math.cos(0.5 * psi))


def test_what_is_wrong_is_refused():
    with pytest.raises(InputError, match=r"up = \[0.5, 0.2\]: must ascend within 0 to 1"):
        flank_pass(cone(), (0.1, 0.9), (0.5, 0.2), CUTTER, 0.01)
    with pytest.raises(InputError, match="cutting_length_mm = 15: must be at least the height of the side"):
        flank_pass(cone(), (0.1, 0.9), (0.0, 1.0), CatalogueCutter(12.0, 1.0, cutting_length=15.0), 0.01)


def test_rotary_axes_keep_their_rates_and_the_cutter_stays_above_between_passes():
    machine = machine_named("cradle-ac")
    side = cone()
    at = side.at(*(x.ravel() for x in np.meshgrid(np.linspace(0, 1, 60), np.linspace(0, 1, 20), indexing="ij")))
    at, n = np.vstack([at, 0.5 * at]), 2 * len(at)
    scene = Scene(at[:1], np.eye(3)[:1], np.zeros((1, 3, 3)), np.zeros(1), at, np.zeros(n), 1.0)
    how = Link(lift=2.0, margin=0.2, touch=0.05, near=5.0, feed=20.0, above=5.0)
    outline = outline_of(scene, 3)
    passes = []
    for up in ((0.0, 0.5), (0.5, 1.0)):
        path = flank_pass(side, (0.1, 0.9), up, CUTTER, 0.01)
        ends = [lift_from_end(path, k, scene, outline, CUTTER, how, 0.0) for k in (0, -1)]
        assert ends[0] is not None
        assert ends[1] is not None
        passes.append(LinkedPath(path, *ends))
    slow, fast = (
        five_axis_program(passes, outline, how, feed, 100.0, 1, machine, math.tau / 3) for feed in (5.0, 1000.0)
    )
    assert rotary_share(slow, machine).max() < 1.0
    assert rotary_share(fast, machine).max() == pytest.approx(1.0)
    assert (fast.feed[fast.motion == LINE] < 999.0).any()
    # the axes themselves, by their positions and the time of each row
    commands, _ = to_axes(replace(fast, line=np.arange(len(fast))), machine)
    turn = np.abs(np.diff(commands.position[:, 3:6], axis=0, prepend=commands.position[:1, 3:6]))
    sums = np.array([np.bincount(commands.line, x, len(fast)) for x in turn.T]).T
    length = np.linalg.norm(np.diff(fast.p_work, axis=0, prepend=fast.p_work[:1]), axis=1)
    rows = (fast.motion == LINE) & (length > 0.0)
    rates = sums[rows] / (length[rows] / fast.feed[rows])[:, None]
    assert rates[:, 2].max() <= math.radians(18000.0) / 60.0 * (1.0 + 1e-9)
    assert rates[:, 0].max() <= math.radians(9000.0) / 60.0 * (1.0 + 1e-9)
    # rapids, and all between two of them, are above every point of the part
    rapid = np.flatnonzero(fast.motion == RAPID)
    for k in rapid[1:]:
        for w in np.linspace(0.0, 1.0, 5):
            tip = (1.0 - w) * fast.p_work[k - 1] + w * fast.p_work[k]
            axis = (1.0 - w) * fast.axis[k - 1] + w * fast.axis[k]
            axis /= np.linalg.norm(axis)
            assert tip @ axis > (at @ axis).max()
