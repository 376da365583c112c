"""The page in a real browser: every panel stands at the row that the hand-made history says."""

import re
import shutil
from dataclasses import replace

import numpy as np
import pytest

from chipload.number_text import number_text
from chipload.result import Track, TrackKind, in_memory
from square import FEED, FORCE, LINE, ROWS, T, X, Y, square_result, write_by_hand
from web_lists import VIEW, choose, click_until, drawn, play_slowly, serious_problems, settle, stop

BACKGROUND = (238, 241, 245)


def cutter(page):
    """Where the tool of the 3D view stands."""
    return page.evaluate(f"{VIEW}.state()")["tip"]


def slider(page, value):
    """Wait until the slider has a value."""
    page.wait_for_function(
        "v => Math.abs(Number(document.querySelector('.cl-slider').getAttribute('aria-valuenow')) - v) < 6e-3",
        arg=float(value),
    )


def stands_at(page, row):
    """Every panel is at a row of the history."""
    settle(page, row)
    page.wait_for_function("n => document.querySelector('.cl-now')?.dataset.line == n", arg=str(LINE[row]))
    page.wait_for_function(
        "t => Math.abs(document.querySelector('.cl-figure').layout.shapes[0].x0 - t) < 1e-9", arg=float(T[row])
    )
    said = page.inner_text(".cl-where")
    assert f"X {X[row]:.3f} Y {Y[row]:.3f} Z -2.000" in said
    assert f"line {LINE[row]}" in said
    slider(page, T[row])
    texts = page.evaluate("document.querySelector('.cl-figure').layout.annotations.map(a => a.text)")
    assert number_text(FORCE[row]) in texts[0]
    assert cutter(page) == pytest.approx([X[row], Y[row], -2.0])


def test_what_the_folder_holds_is_shown_by_job_with_pictures_and_opened(window) -> None:
    page = window("")
    page.wait_for_selector(".cl-result")
    groups = page.locator(".cl-group .cl-what").all_inner_texts()
    assert {"<img src=x onerror='window.hacked=1'>", "cut", "square", "contour/job.toml"} <= set(groups)
    assert page.evaluate("window.hacked") is None
    card = page.locator(".cl-result", has=page.locator(".cl-result-name").get_by_text("square", exact=True))
    assert card.locator(".cl-pill").inner_text() == "exceeds"
    assert card.locator(".answer .value").inner_text() == "force 900 of 800 N"
    assert re.match(r"\d{4}-\d\d-\d\d \d\d:\d\d$", card.locator(".cl-result-head .cl-note").inner_text())
    older = page.locator(".cl-entry", has=page.get_by_text("older", exact=True)).inner_text()
    assert "is not a result of schema version 1" in older
    page.wait_for_function("[...document.querySelectorAll('.cl-result img')].every(i => i.naturalWidth == 312)")
    for width, least in ((420, 1), (1280, 4), (1920, 4)):
        page.set_viewport_size({"width": width, "height": 800})
        page.wait_for_function("w => document.documentElement.scrollWidth == w", arg=width)
        lefts = {round(box["x"]) for one in page.locator(".cl-result").all() if (box := one.bounding_box())}
        assert len(lefts) == 1 if least == 1 else len(lefts) >= least
        assert serious_problems(page) == [], width
        # no heading of a group is cut off
        assert page.evaluate(
            "[...document.querySelectorAll('.cl-group .cl-what')].every(e => e.scrollWidth <= e.clientWidth + 1)"
        )
    page.set_viewport_size({"width": 1280, "height": 720})
    card.click()
    page.wait_for_selector(".cl-limits", state="visible")
    assert page.inner_text(".cl-word") == "exceeds"
    assert "cl-no" in page.get_attribute(".cl-verdict", "class")
    message = page.inner_text(".cl-message")
    assert message.startswith(
        "Exceeds: line 8: a rapid goes through material; and 1 more. Critical limit: force 900 N "
    )
    # back by the key, and the same list
    page.keyboard.press("h")
    page.wait_for_selector(".cl-limits", state="hidden")
    assert page.locator(".cl-result").count() == 4
    assert page.title() == "chipload"


def test_limits_and_findings_lead_to_their_place(square) -> None:
    page = square
    rows = [re.split(r"\s{1,}", t) for t in page.locator(".cl-checks tbody tr").all_inner_texts()]
    assert rows[0][:4] == ["force", "900", "800", "N"]
    assert rows[0][4] == "exceeds"
    assert rows[1][:5] == ["torque", "9", "12", "N", "m"]
    assert rows[1][5] == "holds"
    page.click(".cl-checks tbody tr >> nth=0")
    stands_at(page, int(FORCE.argmax()))
    page.locator(".cl-found").get_by_text("line 8: a rapid goes through material").click()
    stands_at(page, int(np.flatnonzero(LINE == 8)[0]))
    assert page.get_by_text("not checked: limit power_w: not stated").is_visible()


def test_the_slider_moves_everything(square) -> None:
    page = square
    box = page.locator(".cl-slider").bounding_box()
    page.mouse.click(box["x"] + 0.5 * box["width"], box["y"] + 0.5 * box["height"])
    page.wait_for_function("!document.querySelector('.cl-where').textContent.includes('step 1 of')")
    row = int(re.search(r"step (\d+) of", page.inner_text(".cl-where"))[1]) - 1
    assert abs(row - 100) <= 2
    assert page.inner_text(".cl-where").startswith(f"{T[row]:.2f} of 20.00 s")
    page.keyboard.press("ArrowRight")
    stands_at(page, row + 1)


def test_a_plot_and_a_line_move_the_slider(square) -> None:
    page = square
    plot = page.locator(".cl-figure .nsewdrag").first.bounding_box()
    moved = "!document.querySelector('.cl-where').textContent.includes('step 1 of')"
    click_until(page, plot["x"] + 0.7 * plot["width"], plot["y"] + 0.5 * plot["height"], moved)
    row = int(re.search(r"step (\d+) of", page.inner_text(".cl-where"))[1]) - 1
    assert T[row] == pytest.approx(T[0] + 0.7 * (T[-1] - T[0]), abs=0.3)
    stands_at(page, row)
    page.click(".cl-line[data-line='9']")
    stands_at(page, int(np.flatnonzero(LINE == 9)[0]))
    # a line that moves nothing leads to the next one that does
    page.click(".cl-line[data-line='2']")
    stands_at(page, 0)


def test_keys(square) -> None:
    page = square
    for key, row in (
        ("ArrowRight", 1), ("ArrowRight", 2), ("ArrowLeft", 1), ("Shift+ArrowRight", 21), ("End", ROWS - 1),
        ("ArrowRight", ROWS - 1), ("ArrowUp", 100), ("ArrowDown", 150), ("Home", 0), ("ArrowLeft", 0),
    ):  # fmt: skip
        page.keyboard.press(key)
        stands_at(page, row)
    play_slowly(page)
    stands_at(page, stop(page))
    # a closed list that the pointer left with the focus takes no key
    page.mouse.click(640, 60)
    page.keyboard.press("Home")
    settle(page, 0)
    page.evaluate("document.querySelector('[role=combobox][aria-label=\"path coloured by\"]').focus()")
    page.keyboard.press("ArrowDown")
    stands_at(page, 50)
    help_text = page.get_by_text("one step back or forward; with Shift twenty", exact=True)
    assert not help_text.is_visible()
    page.keyboard.press("?")
    help_text.wait_for(state="visible")
    page.keyboard.press("Escape")
    help_text.wait_for(state="hidden")


def test_the_frame_does_not_scroll_and_nothing_lies_outside(square) -> None:
    page = square
    assert page.evaluate("[document.documentElement.scrollHeight, document.documentElement.scrollWidth]") == [720, 1280]
    for part in (".cl-space", ".cl-plots", ".cl-tables", ".cl-source", ".cl-foot", ".cl-where"):
        box = page.locator(part).bounding_box()
        assert box["width"] > 100
        assert box["height"] > 10
        assert box["x"] >= 0
        assert box["y"] >= 0
        assert box["x"] + box["width"] <= 1280
        assert box["y"] + box["height"] <= 720


def scene_pixels(page, pixels):
    drawn(page)
    box = page.locator(".cl-stage canvas").bounding_box()
    # the middle, which nothing is laid over
    clip = {
        "x": box["x"] + 0.2 * box["width"],
        "y": box["y"] + 40,
        "width": 0.6 * box["width"],
        "height": box["height"] - 80,
    }
    return pixels(page.screenshot(clip=clip))


def test_the_scene_is_not_blank_and_a_column_changes_its_colours(square, pixels) -> None:
    page = square
    before = scene_pixels(page, pixels)
    drawn = np.abs(before.astype(int) - BACKGROUND).max(axis=2) > 8
    assert drawn.mean() > 0.1
    assert len(np.unique(before.reshape(-1, 3), axis=0)) > 60
    assert page.inner_text(".cv-red") == "red and thick: above 800"
    red = ((before[..., 0] > 170) & (before[..., 1] < 60) & (before[..., 2] < 60)).sum()
    assert red > 20
    assert page.inner_text(".cv-ends").split() == [f"{FORCE.min():.3g}", f"{FORCE.max():.3g}"]
    choose(page, "path coloured by", "feed [mm/min]")
    page.wait_for_function("document.querySelector('.cv-title').textContent.includes('feed')")
    # the keys are the page's again after a list was open
    page.keyboard.press("ArrowRight")
    settle(page, 1)
    page.keyboard.press("Home")
    settle(page, 0)
    assert page.inner_text(".cv-ends").split() == [f"{FEED.min():.3g}", f"{FEED.max():.3g}"]
    after = scene_pixels(page, pixels)
    assert (np.abs(after.astype(int) - before).max(axis=2) > 40).sum() > 200
    for name in ("stock", "path", "cutter"):
        page.locator(".cl-layers").get_by_text(name).click()
        page.wait_for_function(f"n => {VIEW}.hidden.has(n)", arg=name)
    bare = scene_pixels(page, pixels)
    assert (np.abs(bare.astype(int) - BACKGROUND).max(axis=2) > 8).mean() < 0.02
    for name in ("stock", "path", "cutter"):
        page.locator(".cl-layers").get_by_text(name).click()
        page.wait_for_function(f"n => !{VIEW}.hidden.has(n)", arg=name)


def test_a_painted_body_has_its_legend_while_it_is_shown(square) -> None:
    page = square
    assert page.locator(".cv-title").all_inner_texts()[-1] == "gouge and excess [mm]"
    assert page.inner_text(".cv-map-ends").split() == ["-0.2", "0", "0.2"]
    assert page.evaluate("getComputedStyle(document.querySelector('.cv-map')).backgroundImage").startswith(
        "linear-gradient(to right, rgb(178, 24, 43) 0%, rgb(236, 236, 232) 50%, rgb(33, 102, 172) 100%)"
    )
    assert "not looked for" in page.inner_text(".cv-bar")
    page.locator(".cl-layers").get_by_text("stock").click()
    page.wait_for_selector(".cv-map", state="detached")
    page.locator(".cl-layers").get_by_text("stock").click()
    page.wait_for_selector(".cv-map")


def test_plots_show_the_columns_that_are_chosen(square) -> None:
    page = square
    traces = "document.querySelector('.cl-figure').data.map(d => [d.name, Math.max(...d.y), d.x[d.x.length - 1]])"
    assert page.evaluate(traces) == [["force_n", 900.0, T[-1]], ["torque_nm", 9.0, T[-1]]]
    choose(page, "columns", "feed [mm/min]")
    page.wait_for_function("document.querySelector('.cl-figure').data.length == 3")
    assert page.evaluate(traces)[2] == ["feed_mm_min", 480.0, T[-1]]
    page.get_by_text("path", exact=True).last.click()
    page.wait_for_function("document.querySelector('.cl-figure').layout.xaxis.title.text.includes('path')")
    assert page.evaluate(traces)[0][2] == pytest.approx(160.0)
    page.keyboard.press("End")
    settle(page, ROWS - 1)
    slider(page, 160.0)
    page.get_by_text("time", exact=True).last.click()
    page.wait_for_function("document.querySelector('.cl-figure').layout.xaxis.title.text.includes('time')")


def test_names_and_texts_of_a_result_are_only_shown(window) -> None:
    page = window("?show=bare")
    page.wait_for_selector(".cl-limits", state="visible")
    page.wait_for_selector(".cl-now")
    assert page.evaluate("window.hacked") is None
    assert page.inner_text(".cl-name") == "<img src=x onerror='window.hacked=1'>"
    assert "<script>" in page.inner_text(".cl-message")
    assert page.evaluate("document.querySelectorAll('.cl-page img, .cl-page svg[onload]').length") == 0
    assert "This result has no scene" in page.inner_text(".cl-notice")


def test_a_print_of_a_dark_page_is_light_with_whole_plots(square, pixels) -> None:
    page = square
    ground = f"(({VIEW}).scene.background.getHexString())"
    light = page.evaluate(ground)
    page.keyboard.press("d")
    page.wait_for_function(f"{ground} != '{light}'")
    plot = page.locator(".cl-figure .main-svg").first
    size = [0.0, 0.0, *(float(plot.get_attribute(name)) for name in ("width", "height"))]
    page.evaluate("dispatchEvent(new Event('beforeprint'))")
    assert [float(x) for x in plot.get_attribute("viewBox").split()] == pytest.approx(size, abs=1e-3)
    assert page.evaluate(ground) == light
    # the picture on paper is one that a printer takes: as large as the view, and mostly of its light ground
    paper = page.locator(".cl-stage canvas").nth(1)
    assert paper.evaluate("c => [c.width, c.height]") == page.locator(".cl-stage canvas").nth(0).evaluate(
        "c => [c.width, c.height]"
    )
    corner = paper.evaluate("c => Array.from(c.getContext('2d').getImageData(2, c.height - 3, 1, 1).data)")
    assert bytes(corner[:3]).hex() == light
    page.emulate_media(media="print")
    panel = page.locator(".cl-panel").first
    assert panel.evaluate("e => getComputedStyle(e).backgroundColor") == "rgb(255, 255, 255)"
    # scaled by its box, not cut off
    assert plot.bounding_box()["width"] <= page.locator(".cl-figure").bounding_box()["width"] + 1.0
    page.evaluate("dispatchEvent(new Event('afterprint'))")
    page.emulate_media(media="screen")
    assert plot.get_attribute("viewBox") is None
    assert page.evaluate(ground) != light
    assert page.locator(".cl-stage canvas").count() == 1
    page.keyboard.press("d")
    page.wait_for_function(f"{ground} == '{light}'")


def test_a_zoom_shows_rows_that_the_whole_plot_leaves_out(window, folder) -> None:
    n, path = 6000, folder / "long"
    t = 0.01 * np.arange(n)
    table = {"t_s": t, "s_mm": t, "x_mm": t, "y_mm": np.sin(t), "z_mm": np.zeros(n), "force_n": 100.0 + np.sin(t)}
    track = Track("program", TrackKind.PROGRAM, True, float(t[-1]), blocks=in_memory(table))
    write_by_hand(replace(square_result(), tracks=(track,)), path)
    # points drawn in the tenth of the time from 24 to 30 s, of which 600 are rows
    inside = "document.querySelector('.cl-figure').data[0].x.filter((x) => x >= 24 && x <= 30).length"
    try:
        page = window("?show=long")
        page.wait_for_function("document.querySelectorAll('.cl-figure .trace').length > 0")
        assert page.evaluate(inside) < 150
        plot = page.locator(".cl-figure .nsewdrag").first
        box = plot.bounding_box()
        assert box is not None
        y = box["y"] + 0.5 * box["height"]
        page.mouse.move(box["x"] + 0.38 * box["width"], y)
        page.mouse.down()
        page.mouse.move(box["x"] + 0.45 * box["width"], y, steps=4)
        page.mouse.move(box["x"] + 0.52 * box["width"], y, steps=4)
        page.mouse.up()
        page.wait_for_function(f"{inside} >= 600")
        # the part stays in sight when its points have come, and two clicks draw the whole again
        low, high = page.evaluate("document.querySelector('.cl-figure').layout.xaxis.range")
        assert 20.0 < low < 24.0 < 30.0 < high < 34.0
        page.mouse.dblclick(box["x"] + 0.5 * box["width"], y)
        page.wait_for_function(f"{inside} < 150")
    finally:
        shutil.rmtree(path)
