"""Rows on surfaces by formula: what the cutter touches, where it leans, how long it takes."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from chipload.cutter.cutter import Cutter
from chipload.errors import InputError
from chipload.planning.thinwall.blank import FinishSurface
from chipload.planning.thinwall.passes import WallPass
from chipload.planning.thinwall.paths import (
    PassMotion,
    gouges,
    offset_normals,
    pass_programs,
    place_rows,
    program_of,
    rows_of,
    seconds,
)
from chipload.planning.thinwall.plane_stock import CutterPose
from chipload.planning.thinwall.threshold import modelled
from chipload.program.program import RAPID

BALL = Cutter(8.0, 2, 0.5, 20.0, 30.0, 6e5, corner_radius=4.0)
BULL = Cutter(10.0, 4, 0.5, 20.0, 30.0, 6e5, corner_radius=1.5)


def flat(side: float = 1.0, n: int = 21, m: int = 13) -> FinishSurface:
    x, y = np.meshgrid(np.linspace(0.0, 20.0, n), np.linspace(0.0, 12.0, m), indexing="ij")
    p = np.stack([x, y, 0.0 * x], axis=-1)
    return FinishSurface(p, np.broadcast_to([0.0, 0.0, side], p.shape), 1.0)


def sphere_like(cutter: Cutter) -> tuple[np.ndarray, np.ndarray]:
    """Points (rho, z) of the envelope's profile."""
    return cutter.profile(1e-5).T


def test_normals_of_an_offset():
    """Of a plane with D = 0.1 x - 0.05 y: N - grad D."""
    for side in (1.0, -1.0):
        s = flat(side)
        D = 1.0 + 0.1 * s.points[..., 0] - 0.05 * s.points[..., 1]
        n = offset_normals(s.points + D[..., None] * s.normals, s.normals)
        expected = np.array([-0.1, 0.05, side]) / math.sqrt(1.0 + 0.0125)
        assert_allclose(n, np.broadcast_to(expected, n.shape), atol=1e-12)


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("cutter", [BALL, BULL])
@pytest.mark.parametrize(("lead", "tilt", "step"), [(15.0, 0.0, 0.5), (10.0, -20.0, -0.5), (-5.0, 30.0, 0.7)])
def test_cutter_touches_the_offset_plane(cutter, lead, tilt, step, side):
    """Every point of the cutter's envelope lies above the plane, the contact point lies on it."""
    s = flat(side)
    D = 1.0 + 0.1 * s.points[..., 0] - 0.05 * s.points[..., 1]
    posture = CutterPose(cutter, 0.05, step, math.radians(lead), math.radians(tilt))
    rows = rows_of(s, D, D + 0.2, posture)
    tip, axis, _ = place_rows(rows, posture)
    n = np.array([-0.1, 0.05, side]) / math.sqrt(1.0 + 0.0125)
    plane = float(n @ (s.points + D[..., None] * s.normals)[0, 0])
    rho, z = sphere_like(cutter)
    for r, k in ((0, 0), (5, 7), (-1, -1)):
        A = axis[r, k]
        lowest = n @ tip[r, k] + z * (n @ A) - rho * math.sqrt(1.0 - float(n @ A) ** 2)
        assert lowest.min() == pytest.approx(plane, abs=1e-5)
        low = int(lowest.argmin())
        down = -n + (n @ A) * A
        point = tip[r, k] + z[low] * A + rho[low] * down / np.linalg.norm(down)
        assert_allclose(point, rows.contact[r, k], atol=0.02)
        t, left = rows.feed[r, k], np.cross(n, rows.feed[r, k])
        assert math.degrees(math.asin(float(A @ t))) == pytest.approx(lead)
        assert math.degrees(math.atan2(float(A @ left), float(A @ n))) == pytest.approx(tilt)
    # the row before lies on the right where the step is above 0, and nearer to the free edge
    left = np.cross(rows.normal[3], rows.feed[3])
    assert (np.sign(((rows.contact[2] - rows.contact[3]) * left).sum(axis=1)) == -math.copysign(1.0, step)).all()
    assert (rows.contact[2, :, 1] > rows.contact[3, :, 1]).all()


def test_only_stock_is_cut_and_timed():
    """Stock on the half x >= 10: 25 rows of 10 mm and the piece before, 2 mm down at the feed, 2 mm up."""
    s = flat()
    low = np.zeros(s.points.shape[:2])
    high = np.where(s.points[..., 0] >= 10.0, 0.3, 0.0)
    posture = CutterPose(BALL, 0.05, -0.5, 0.2)
    pass_motion = PassMotion(posture, 10.0, 100.0, 800.0, 2.0)
    program = program_of(rows_of(s, low, high, posture), pass_motion, "one")
    assert (program.motion == RAPID).sum() == 2 * 25
    links = 24 * math.hypot(11.0, 12.0 / 24.0) + 25 * 2.0
    assert seconds(program, 100.0) == pytest.approx(25 * (11.0 + 2.0) / 10.0 + links / 100.0, rel=1e-9)
    threshold = modelled(np.full(low.size, 0.01), 0.1)
    one = WallPass(0, low, high, threshold, low, low > 1.0, np.ones_like(low))
    (again,) = pass_programs([one], [s], pass_motion)
    assert_allclose(again.p_work, program.p_work)
    assert again.labels == ("pass 1 side 1",)
    with pytest.raises(InputError, match="finds no stock"):
        program_of(rows_of(s, low, low, posture), pass_motion, "none")


def test_ball_in_a_hollow():
    """A hollow of 5 mm radius: a ball of 4 mm fits, one of 6 mm does not."""
    a, y = np.meshgrid(np.linspace(-1.0, 1.0, 81), np.linspace(0.0, 3.0, 5), indexing="ij")
    p = np.stack([5.0 * np.sin(a), y, -5.0 * np.cos(a)], axis=-1)
    n = np.stack([-np.sin(a), 0.0 * a, np.cos(a)], axis=-1)
    s = FinishSurface(p, n, 0.5)
    none = np.zeros(a.shape)
    for radius, fits in ((4.0, True), (6.0, False)):
        posture = CutterPose(Cutter(2 * radius, 2, 0.5, 20.0, 30.0, 6e5, corner_radius=radius), 0.05, 0.5)
        found = gouges(rows_of(s, none, none + 0.1, posture), s, none, posture, 0.01)
        assert (len(found) == 0) == fits


def test_refused():
    with pytest.raises(InputError, match="step_over_mm is missing"):
        PassMotion(CutterPose(BALL, 0.05, None), 10.0, 100.0, 800.0, 2.0)
    with pytest.raises(InputError, match=r"paths\.feed = 0: must be above 0"):
        PassMotion(CutterPose(BALL, 0.05, 0.5), 0.0, 100.0, 800.0, 2.0)
