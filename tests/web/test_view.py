"""The 3D view in a real browser: stock at the slider, what touches, what is drawn, measured and saved."""

import base64
import re

import numpy as np
import pytest

from square import ROWS, VOLUMES, T, X, Y
from web_lists import VIEW, play_slowly, settle, stop


@pytest.fixture(scope="module")
def cut(browser, served):
    """The page of a result with stock, clamp and holder."""
    page = browser.new_page(viewport={"width": 1280, "height": 720})
    page.set_default_timeout(120_000)
    wrong = []
    page.on("pageerror", lambda e: wrong.append(str(e)))
    page.goto(served.address("?show=cut"))
    page.wait_for_selector(".cv-ramp")
    page.wait_for_selector(".cl-now")
    yield page
    page.close()
    assert wrong == []


def state(page):
    return page.evaluate(f"{VIEW}.state()")


def red(picture):
    """Pixels as red as what touches, which no other thing of this result is."""
    rgb = picture.astype(int)
    return (rgb[..., 0] > 110) & (rgb[..., 1] < 60) & (rgb[..., 2] < 60)


def stage(page, pixels):
    """The picture of the view alone."""
    data = page.evaluate(f"{VIEW}.picture()")
    return pixels(base64.b64decode(data.split(",", 1)[1]))


def pixel(page, place):
    """Where a place of the work is on the screen, as the view itself projects it."""
    return page.evaluate(
        f"""(place) => {{ const v = {VIEW}, b = v.overlay.stage.getBoundingClientRect();
        const q = v.camera.position.clone().set(...place).project(v.camera);
        return [b.x + (q.x + 1) * b.width / 2, b.y + (1 - q.y) * b.height / 2]; }}""",
        place,
    )


def said_of(page, place):
    """What the view says after a click on a place; it says nothing before."""
    page.evaluate(f"{VIEW}.overlay.message('')")
    page.mouse.click(*pixel(page, place))
    page.wait_for_function("document.querySelector('.cv-note').textContent != ''")
    return page.inner_text(".cv-note").split(" \u00b7 ")


def test_the_first_view_is_the_worst_finding_with_what_touches_in_red(cut, pixels) -> None:
    page = cut
    settle(page, 60)
    assert page.inner_text(".cv-note") == "line 8: shank or holder goes 1.5 mm into fixture 0"
    touching = red(stage(page, pixels)).sum()
    assert touching > 1500
    page.keyboard.press("ArrowRight")
    settle(page, 61)
    # the marks stay, the bodies are no longer red
    assert red(stage(page, pixels)).sum() < 0.3 * touching
    page.locator(".cl-found").get_by_text("shank or holder goes").click()
    settle(page, 60)
    page.wait_for_function("document.querySelector('.cv-note').textContent.includes('1.5 mm')")
    assert red(stage(page, pixels)).sum() == pytest.approx(touching, rel=0.2)


def test_the_stock_at_three_moments_has_the_volume_of_what_was_cut(cut, pixels) -> None:
    page, pictures = cut, []
    page.evaluate(f"{VIEW}.look('iso')")
    for row, volume in ((-1, VOLUMES[0]), (ROWS // 2 - 1, VOLUMES[1]), (ROWS - 1, VOLUMES[2])):
        page.evaluate(f"{VIEW}.go({row})")
        shown = state(page)["stock"]
        assert shown["volume"] == pytest.approx(volume, rel=0.01)
        removed = VOLUMES[0] - shown["volume"]
        assert removed == pytest.approx(VOLUMES[0] - volume, abs=0.05 * (VOLUMES[0] - VOLUMES[2]))
        pictures.append(stage(page, pixels))
    for a, b in ((0, 1), (1, 2)):
        assert (np.abs(pictures[a].astype(int) - pictures[b]).max(axis=2) > 40).sum() > 300
    page.keyboard.press("Home")
    settle(page, 0)


def test_the_slider_moves_the_stock_without_the_server(cut) -> None:
    page = cut
    page.evaluate(f"{VIEW}.abscissa({T[150]})")
    at_once = state(page)
    assert at_once["tip"] == pytest.approx([0.0, 39.2, -2.0], abs=0.01)
    assert at_once["stock"]["frame"] > 60
    before = at_once["frames"]
    page.evaluate(f"{VIEW}.abscissa(0.55)")
    # between two rows the tool stands between their places
    assert state(page)["tip"][0] == pytest.approx(0.5 * (0.8 * 5 + 0.8 * 6), abs=1e-3)
    page.wait_for_function(f"n => {VIEW}.state().frames > n", arg=before)


def test_playing_moves_by_itself_and_the_panels_follow(cut) -> None:
    page = cut
    page.keyboard.press("Home")
    settle(page, 0)
    frames = page.evaluate(f"{VIEW}.frames")
    play_slowly(page)
    row = stop(page)
    # it was drawn again for what it showed, and place and panels are those of the row at which it stopped
    assert page.evaluate(f"{VIEW}.frames") > frames
    assert row > 3
    assert state(page)["tip"] == pytest.approx([X[row], Y[row], -2.0], abs=1e-3)
    # nothing moves it any more
    page.wait_for_timeout(500)
    settle(page, row)
    page.keyboard.press("Home")
    settle(page, 0)


def test_bodies_and_triangles_are_those_of_the_scene(cut) -> None:
    shown = state(cut)
    # the stock of the scene is replaced by the stock at the slider
    assert shown["bodies"] == [["fixture 0", 12]]
    assert shown["segments"] == ROWS
    labels = cut.locator(".cl-layers").inner_text()
    for name in ("stock", "fixture 0", "path", "cutter", "marks", "see through", "values on stock"):
        assert name in labels
    assert "frames" in cut.inner_text(".cl-notice")


def test_a_section_see_through_and_values_change_the_picture(cut, pixels) -> None:
    page = cut
    page.keyboard.press("End")
    settle(page, ROWS - 1)
    page.evaluate(f"{VIEW}.look('iso')")
    whole = stage(page, pixels)
    for on, off in (
        ("section('y', 0.6)", "section('', 0.5)"),
        ("glass(true)", "glass(false)"),
        ("drape(true)", "drape(false)"),
        ("layer('stock', false)", "layer('stock', true)"),
    ):
        page.evaluate(f"{VIEW}.{on}")
        other = stage(page, pixels)
        assert (np.abs(whole.astype(int) - other).max(axis=2) > 25).sum() > 500, on
        page.evaluate(f"{VIEW}.{off}")
    assert (np.abs(whole.astype(int) - stage(page, pixels)).max(axis=2) > 25).sum() < 50


def test_a_length_is_measured_on_the_stock(cut) -> None:
    page = cut
    page.evaluate(f"{VIEW}.look('top'); {VIEW}.layer('path', false); {VIEW}.layer('cutter', false); {VIEW}.picture()")
    page.locator("button", has_text="measure").click()
    page.wait_for_function("document.querySelector('.cv-note').textContent == 'click two places'")
    places = [pixel(page, place) for place in ([8, 20, 0], [32, 20, 0])]
    for x, y in places:
        page.mouse.click(x, y)
    page.wait_for_function("document.querySelector('.cv-note').textContent.includes('mm')")
    said = page.inner_text(".cv-note")
    assert float(said.split()[0]) == pytest.approx(24.0, rel=0.03)
    assert said.endswith("face to face")
    # near corners and edges of the clamp, a box of 10 x 14 x 24 mm: they are caught, so the lengths are exact
    for first, second, length, caught in (
        ([46.4, 2.4, 24], [55.6, 2.4, 24], "10 mm dX 10 dY 0 dZ 0", "corner to corner"),
        ([46.4, 15.6, 24], [55.6, 2.4, 24], "17.205 mm dX 10 dY -14 dZ 0", "corner to corner"),
        ([46.4, 15.6, 24], [55.6, 9, 24], None, "corner to edge"),
    ):
        page.mouse.click(*pixel(page, first))
        page.wait_for_function("document.querySelector('.cv-note').textContent.startsWith('corner: ')")
        page.mouse.click(*pixel(page, second))
        page.wait_for_function("document.querySelector('.cv-note').textContent.includes('mm')")
        said = " ".join(page.inner_text(".cv-note").split())
        assert said.endswith(caught)
        if length is None:
            across, along = (float(said.split(f" d{axis} ")[1].split()[0]) for axis in "XY")
            assert across == 10.0
            assert along == pytest.approx(-7.0, abs=0.3)
        else:
            assert said.startswith(length)
    page.locator("button", has_text="measure").click()
    page.evaluate(f"{VIEW}.layer('path', true); {VIEW}.layer('cutter', true)")


def test_a_face_says_which_line_cut_it_and_the_page_goes_there(cut) -> None:
    """The floor beside the fourth side, which goes from (0, 40) to (0, 0), and faces that no step cut."""
    page = cut
    page.keyboard.press("End")
    settle(page, ROWS - 1)
    page.evaluate(f"{VIEW}.look('top'); {VIEW}.picture()")
    row = int(np.argmin(np.hypot(X - 0.0, Y - 20.0)))
    said = said_of(page, [-3.0, 20.0, -2.0])
    # a row of the fourth side whose cutter, 4 mm wide on each side, reaches the place
    cut_in = int(said[0].removeprefix("cut in step ")) - 1
    assert abs(cut_in - row) <= 3
    assert said[1:3] == ["line 10", "T1"]
    assert float(said[3].removesuffix(" s")) == pytest.approx(T[cut_in], rel=1e-3)
    assert said[4].startswith("force ")
    settle(page, cut_in)
    page.wait_for_function("document.querySelector('.cl-now')?.dataset.line == '10'")
    page.keyboard.press("End")
    settle(page, ROWS - 1)
    # a click on the path says as much
    assert said_of(page, [20.0, 0.0, -2.0])[:3] == ["step 25", "line 7", "T1"]
    assert said_of(page, [20.0, 20.0, 0.0]) == ["this face is not cut: raw stock"]
    assert said_of(page, [51.0, 9.0, 24.0]) == ["fixture 0: is not cut"]
    # the front of the block hides the path, which is not clicked through it
    page.evaluate(f"{VIEW}.look('front'); {VIEW}.picture()")
    assert said_of(page, [10.0, -10.0, -2.5]) == ["this face is not cut: raw stock"]


def test_a_map_says_its_value_and_the_step_next_to_it(cut) -> None:
    """The sheet has 0.4 N m for each mm along x; the second side goes along x = 40, no step comes to its middle."""
    page = cut
    page.evaluate(f"{VIEW}.layer('fixture 0', false); {VIEW}.map('sheet'); {VIEW}.look('top'); {VIEW}.picture()")
    assert said_of(page, [20.0, 20.0, 0.0])[0] == "no step comes near this face"
    said = said_of(page, [37.5, 20.0, 0.0])
    assert said[0].startswith("next to step ")
    assert said[1] == "line 8"
    assert float(re.search(r"torque (\S+) N m", said[-1])[1]) == pytest.approx(0.4 * 37.5, abs=0.1)
    # where the surface bends the place is that of the surface that does not
    page.evaluate(f"{VIEW}.map('sheet', 1); {VIEW}.look('top'); {VIEW}.picture()")
    bent = said_of(page, [37.5, 20.0, 0.0])
    assert float(re.search(r"torque (\S+) N m", bent[-1])[1]) == pytest.approx(0.4 * 37.5, abs=0.1)
    page.evaluate(f"{VIEW}.map(''); {VIEW}.layer('fixture 0', true)")


def test_values_under_the_pointer_and_a_saved_picture(cut) -> None:
    page = cut
    page.evaluate(f"{VIEW}.look('top'); {VIEW}.picture()")
    x, y = page.evaluate(
        f"""() => {{ const v = {VIEW}, b = v.overlay.stage.getBoundingClientRect();
        const q = v.camera.position.clone().set(24, 40, -2).project(v.camera);
        return [b.x + (q.x + 1) * b.width / 2, b.y + (1 - q.y) * b.height / 2]; }}"""
    )
    for _ in range(60):  # a pointer that moves before the view is drawn anew finds nothing there
        page.mouse.move(x + 200, y)
        page.mouse.move(x, y)
        page.wait_for_timeout(500)
        if page.evaluate("getComputedStyle(document.querySelector('.cv-tip')).display == 'block'"):
            break
    said = page.inner_text(".cv-tip")
    # the third side goes from (40, 40) to (0, 40): line 9 of the program
    assert "line 9" in said
    assert "force" in said
    assert "Y 40.000" in said
    with page.expect_download() as saved:
        page.locator("button", has_text="picture").click()
    assert saved.value.suggested_filename == "chipload.png"
