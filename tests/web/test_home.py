"""The list of results: groups by job, and the small picture of each."""

import io
import os
import shutil

import numpy as np
import pytest
import trimesh
from PIL import Image

from chipload.report.bodies import SceneBody
from chipload.web.folder_access import list_folder
from chipload.web.home import home_groups
from chipload.web.thumbnail import EYE, FINE, HIGH, MARGIN, RIGHT, UP, WIDE, picture, png, thumbnail
from square import make_cut_result, make_result

JOB = "[program]\nfile = '../square.ngc'\n"


def box_body(low, high) -> SceneBody:
    """A box of one colour."""
    box = trimesh.creation.box(bounds=[low, high])
    return SceneBody("part", "part", box.vertices, box.faces, np.array([90, 150, 210, 255], dtype=np.uint8), 12)


def test_results_are_grouped_by_their_job_the_newest_first(tmp_path) -> None:
    make_result(tmp_path / "square")
    for name in ("result", "result-changed"):
        shutil.copytree(tmp_path / "square", tmp_path / "a" / name)
    shutil.copytree(tmp_path / "square", tmp_path / "elsewhere")
    (tmp_path / "a" / "job.toml").write_text(JOB)
    (tmp_path / "none.toml").write_text(JOB)
    for k, name in enumerate(("square", "a/result-changed", "a/result", "elsewhere")):
        summary = tmp_path / name / "summary.json"
        text = summary.read_text()
        if name.startswith("a/"):
            summary.write_text(text.replace('"inputs":{', '"inputs":{"job":"job.toml sha256 00",').replace(
                '"inputs": {', '"inputs": {"job": "job.toml sha256 00",'))  # fmt: skip
        os.utime(summary, (1_700_000_000 + 60 * k,) * 2)
    groups = home_groups(tmp_path, list_folder(tmp_path)[0])
    assert [(g.title, g.job, [r.name for r in g.results]) for g in groups] == [
        ("square", None, ["elsewhere", "square"]),
        ("a/job.toml", "a/job.toml", ["a/result", "a/result-changed"]),
        ("none.toml", "none.toml", []),
    ]
    newest = groups[0].results[0]
    assert (newest.verdict.value, newest.critical.name) == ("exceeds", "force_n")
    assert newest.changed_ns == 1_700_000_180 * 10**9


def test_a_result_of_another_schema_is_listed_with_its_reason(tmp_path) -> None:
    make_result(tmp_path / "now")
    shutil.copytree(tmp_path / "now", tmp_path / "old")
    summary = tmp_path / "old" / "summary.json"
    summary.write_text(summary.read_text().replace('"schema_version":1', '"schema_version":0').replace(
        '"schema_version": 1', '"schema_version": 0'))  # fmt: skip
    for name, text in (("other", '{"name": "of another program"}'), ("list", "[]"), ("damaged", "{")):
        (tmp_path / name).mkdir()
        (tmp_path / name / "summary.json").write_text(text)
    entries, _ = list_folder(tmp_path)
    assert [(e.name, e.kind) for e in entries] == [("now", "result"), ("old", "unread")]
    assert entries[1].word == "is not a result of schema version 1 (1 difference): run the job again"
    assert [g.title for g in home_groups(tmp_path, entries)] == ["square"]


def test_the_picture_of_a_box_covers_its_projection() -> None:
    low, high = np.array([3.0, -2.0, 1.0]), np.array([63.0, 38.0, 11.0])
    image = picture([box_body(low, high)], np.zeros((0, 3)), np.zeros((0, 3)))
    # area of a convex body in a parallel projection: its three faces that are seen, each by its cosine
    sides = high - low
    area = float(np.abs(EYE) @ [sides[1] * sides[2], sides[0] * sides[2], sides[0] * sides[1]])
    corners = np.array([[x, y, z] for x in (0, 60) for y in (0, 40) for z in (0, 10)], dtype=np.float64)
    wide, tall = np.ptp(corners @ RIGHT), np.ptp(corners @ UP)
    scale = min((WIDE - 2 * MARGIN) / wide, (HIGH - 2 * MARGIN) / tall)
    assert (image[..., 3] / 255.0).sum() == pytest.approx(area * scale**2, rel=0.01)
    # three faces, three shades; the colour of each goes by the light alone
    inside = image[image[..., 3] == 255][:, :3].astype(np.float64)
    shades = np.unique((inside[:, 2] / 210.0).round(2))
    assert len(shades) <= 3 * FINE**2
    np.testing.assert_allclose(inside[:, 0] / inside[:, 2], 90.0 / 210.0, atol=0.01)


def test_the_path_is_drawn_where_it_lies_and_hidden_behind_the_body() -> None:
    body = box_body([0.0, 0.0, 0.0], [60.0, 40.0, 10.0])
    red = np.tile([255.0, 0.0, 0.0], (2, 1))
    above = picture([body], np.array([[0.0, 20.0, 10.0], [60.0, 20.0, 10.0]]), red)
    below = picture([body], np.array([[10.0, 20.0, 5.0], [50.0, 20.0, 5.0]]), red)
    marked = [np.argwhere((im[..., 0] > 200) & (im[..., 2] < 60)) for im in (above, below)]
    # along x the line falls by the direction of the picture: tan of its angle is UP_x / RIGHT_x
    rise = np.polyfit(marked[0][:, 1], -marked[0][:, 0], 1)[0]
    assert rise == pytest.approx(UP[0] / RIGHT[0], abs=0.02)
    assert len(marked[0]) > 100
    assert len(marked[1]) == 0


def test_a_result_has_a_picture_as_png(tmp_path) -> None:
    make_cut_result(tmp_path / "cut")
    made = thumbnail(tmp_path, "cut")
    with Image.open(io.BytesIO(made)) as image:
        assert (image.size, image.mode) == ((WIDE, HIGH), "RGBA")
        pixels = np.asarray(image)
    assert 0.2 < (pixels[..., 3] > 0).mean() < 0.9
    assert len(made) < 40_000
    assert made == thumbnail(tmp_path, "cut")
    decoded = np.asarray(Image.open(io.BytesIO(png(pixels))))
    np.testing.assert_array_equal(decoded, pixels)
