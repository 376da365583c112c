"""The page of a result without a motion: verdict, flatness with its band, the displaced part."""

import shutil
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from chipload.report.folder import write_result
from chipload.report.presentation import Presentation
from chipload.result import LimitCheck, Provenance, Result, SurfaceMap, Track, TrackKind, Verdict
from web_lists import serious_problems

POINTS = np.array([[0.0, 0.0, 0.0], [100.0, 0.0, 0.0], [100.0, 50.0, 0.0], [0.0, 50.0, 0.0]])
MOVED = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 0.024], [0.0, 0.0, 0.0], [0.0, 0.0, -0.012]])


@pytest.fixture
def released(folder: Path) -> Iterator[None]:
    """A distortion result in the opened folder, for this test alone."""
    limit = LimitCheck("flatness_um", 50.0, 24.0, Verdict.HOLDS, "stated plan", resolution_error=0.5)
    track = Track("stated plan", TrackKind.VARIANT, True, None, (limit,))
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    shape = SurfaceMap("part after release", "distortion_um", POINTS, 1e3 * MOVED[:, 2], faces, displacement=MOVED)
    result = Result(
        "distortion", "released", (track,), ({"kind": "distortion"},), (), (), Provenance({}, (), "", {}, {}),
        maps=(shape,), note="Flatness 24 \u00b5m, 12 to 36 \u00b5m from plate to plate.",
    )  # fmt: skip
    write_result(result, Presentation(lambda figures: [], lambda: b""), folder / "released")
    yield
    shutil.rmtree(folder / "released")


def test_a_released_part_is_drawn_with_its_flatness(window, released) -> None:
    """A tenth of 100 mm over 0.024 mm is 417: the part is drawn displaced 200 times."""
    page = window("?show=released")
    page.wait_for_selector(".cl-shape .main-svg", state="attached")
    said = page.inner_text(".cl-card")
    assert page.inner_text(".cl-card .cl-word") == "holds"
    assert "Flatness 24 \u00b5m, 12 to 36 \u00b5m from plate to plate." in said
    assert page.inner_text(".cl-card .answer .value") == "flatness 24 of 50 \u00b5m"
    cells = page.locator(".cl-card .cl-limits tbody td").all_inner_texts()
    assert [cells[0], *cells[1:4], cells[5]] == ["stated plan in use", "flatness", "24", "50 \u00b5m", "holds"]
    for width in (420, 1280, 1920):
        page.set_viewport_size({"width": width, "height": 800})
        page.wait_for_function("w => document.documentElement.scrollWidth == w", arg=width)
        assert serious_problems(page) == [], width
    assert "it is drawn 200 times as large" in said
    z = page.evaluate("[0, 1, 2, 3].map(k => document.querySelector('.cl-shape').data[1].z._inputArray[k])")
    assert z == pytest.approx([0.0, 4.8, 0.0, -2.4])
    assert page.get_attribute("a.cl-link", "href") == "/report?name=released"
