"""The override gauge of a controlled track: what it says is the history at the slider's step."""

import shutil
from dataclasses import replace

import numpy as np
import pytest

from chipload.result import in_memory
from square import ROWS, square_result, write_by_hand
from web_lists import settle

OVERRIDE = np.linspace(1.0, 0.2, ROWS)


@pytest.fixture(scope="module")
def controlled(browser, served, folder):
    """A track whose override falls, with a torque that is above the allowable one at its end."""
    one = square_result("controlled")
    columns = dict(one.tracks[0].columns)
    more = {
        "override": OVERRIDE,
        "override_state": np.array(["trim"] * (ROWS - 1) + ["overload"], dtype=object),
        "torque_nm": np.linspace(2.0, 10.0, ROWS),
        "torque_allowable_nm": np.full(ROWS, 8.0),
        "torque_planned_nm": np.full(ROWS, 5.0),
    }
    track = replace(one.tracks[0], limits=(), findings=(), blocks=in_memory({**columns, **more}))
    write_by_hand(replace(one, tracks=(track,)), folder / "controlled")
    page = browser.new_page(viewport={"width": 420, "height": 800})
    page.set_default_timeout(120_000)
    page.goto(served.address("?show=controlled"))
    page.wait_for_selector(".cv-ramp")
    page.wait_for_selector(".cl-now")
    yield page
    page.close()
    shutil.rmtree(folder / "controlled")


def test_the_gauge_stands_at_the_row(controlled) -> None:
    page = controlled
    width = "[...document.querySelectorAll('.cl-gauge-bar b')].map(e => [e.style.width, e.style.backgroundColor])"
    page.keyboard.press("Home")
    settle(page, 0)
    page.wait_for_function("document.querySelector('.cl-gauge').innerText.startsWith('override 100 %')")
    assert page.inner_text(".cl-gauge").split("\n") == ["override 100 %", "torque 2 of 8 N m", "planned 5 N m", "trim"]
    assert [w for w, _ in page.evaluate(width)] == ["100%", "25%"]
    page.keyboard.press("End")
    settle(page, ROWS - 1)
    page.wait_for_function("document.querySelector('.cl-gauge').innerText.startsWith('override 20 %')")
    assert page.inner_text(".cl-gauge").split("\n")[1::2] == ["torque 10 of 8 N m", "overload"]
    assert page.evaluate(width) == [["20%", "rgb(47, 93, 138)"], ["100%", "rgb(200, 30, 30)"]]


def test_no_control_covers_the_scene_of_a_narrow_window(controlled) -> None:
    stage = controlled.locator(".cl-stage").bounding_box()
    assert stage["height"] > 250
    for part in (".cl-controls", ".cl-buttons"):
        box = controlled.locator(part).bounding_box()
        assert box["y"] + box["height"] <= stage["y"] + 0.5
        assert box["x"] + box["width"] <= 420
