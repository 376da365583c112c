"""Surface maps of the 3D view: isolines against closed forms, limits of both signs, the bent surface."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from chipload.report.shown_maps import isolines, shown_maps
from square import SHEET, square_result


def test_an_isoline_of_height_on_a_ball_is_a_circle() -> None:
    ball = trimesh.creation.icosphere(subdivisions=5, radius=10.0)
    faces, points = np.asarray(ball.faces), np.asarray(ball.vertices)
    for level in (-6.0, 0.37, 8.0):
        lines = isolines(faces, points[:, 2], level, points)
        assert lines[..., 2] == pytest.approx(level, abs=1e-9)
        radius = np.sqrt(100.0 - level**2)
        assert np.linalg.norm(lines[..., :2], axis=2) == pytest.approx(radius, rel=3e-3)
        length = np.linalg.norm(lines[:, 1] - lines[:, 0], axis=1).sum()
        assert length == pytest.approx(2.0 * np.pi * radius, rel=3e-3)
    assert len(isolines(faces, points[:, 2], 11.0, points)) == 0
    # where a value is not known there is no line
    half = np.where(points[:, 0] > 0.0, np.nan, points[:, 2])
    assert (isolines(faces, half, 0.37, points)[..., 0] < 0.5).all()


def test_a_map_has_the_limit_of_its_column_and_bends_its_line() -> None:
    one = replace(square_result(), maps=(SHEET, replace(SHEET, name="other", track="another")))
    (found,) = shown_maps(one, one.tracks[0], {"torque_nm": 12.0, "force_n": 800.0})
    assert (found.name, found.label, found.unit, found.limit) == ("sheet", "torque", "N m", 12.0)
    assert (found.low, found.high) == (0.0, 16.0)
    assert found.lines[..., 0] == pytest.approx(30.0)
    assert np.abs(np.diff(found.lines[..., 1], axis=1)).sum() == pytest.approx(40.0)
    assert found.lines_moved[..., 2] == pytest.approx(0.01 * 0.75**2)


def test_gouge_and_excess_and_a_signed_error_have_two_lines() -> None:
    two = replace(SHEET, column="excess_mm", values=SHEET.points[:, 0] / 40.0 - 0.5)
    signed = replace(two, name="error", column="form_error_um")
    one = replace(square_result(), maps=(two, signed))
    excess, error = shown_maps(one, one.tracks[0], {"excess_mm": 0.25, "gouge_mm": 0.1, "form_error_um": 0.4})
    assert np.unique(excess.lines[..., 0].round(6)).tolist() == [16.0, 30.0]
    assert np.unique(error.lines[..., 0].round(6)).tolist() == [4.0, 36.0]
    assert (excess.tolerance, error.tolerance) == ((-0.1, 0.25), (-0.4, 0.4))
