"""What the teeth cut at the slider's step: the chip as a body, its thickness, force over a revolution, the sector."""

import base64

import numpy as np
import pytest

from web_lists import choose

VIEW = "chiploadViewer.of(document.querySelector('.cl-stage').id)"
PANEL = "chiploadViewer.cut(document.querySelector('.cl-cut').id, document.querySelector('.cl-stage').id)"


@pytest.fixture(scope="module")
def cut(browser, served):
    """The page of a slot along a square, with the panel of the cut open."""
    page = browser.new_page(viewport={"width": 1280, "height": 720})
    page.set_default_timeout(120_000)
    wrong = []
    page.on("pageerror", lambda e: wrong.append(str(e)))
    page.goto(served.address("?show=cut"))
    page.wait_for_selector(".cv-ramp")
    page.wait_for_selector(".cl-now")
    page.locator(".cl-tabs").get_by_text("cut", exact=True).click()
    page.wait_for_selector(".cv-cut-said")
    yield page
    page.close()
    assert wrong == []


def stand(page, row):
    page.evaluate(f"{VIEW}.go({row})")
    page.wait_for_function(f"r => {VIEW}.state().row == r", arg=row)


def test_the_chip_of_a_slot_is_that_of_the_closed_form(cut) -> None:
    stand(cut, 30)
    state = cut.evaluate(f"{PANEL}.state()")
    # feed per tooth 0.08 mm, slot 8 mm wide and 2 mm deep; h = f_z sin(phi)
    assert state["row"] == 30
    assert state["teeth"] == [-1]
    assert state["thickest"] == pytest.approx([0.08], rel=1e-6)
    assert state["volume"] == pytest.approx([0.08 * 8.0 * 2.0], rel=1e-6)
    assert np.ravel(state["sectors"]) == pytest.approx([0.0, np.pi])
    said = cut.inner_text(".cv-cut-said")
    assert said.startswith("Step 31, tool 1, 2 teeth. Chip of each tooth: thickest 0.08 mm, 1.28 mm³; drawn 10 times")
    assert "In cut over 180°" in said
    # half the feed on the last side
    stand(cut, 180)
    assert cut.evaluate(f"{PANEL}.state()")["volume"] == pytest.approx([0.64], rel=1e-6)
    cut.wait_for_function("document.querySelector('.cv-cut-said').textContent.includes('0.64 mm³')")


def test_four_plots_and_the_chip_are_drawn(cut, pixels) -> None:
    stand(cut, 30)
    names = ["chip thickness [µm]", "force over a revolution, X and Y [N]", "force on the cutter [N]", "torque [N m]"]
    assert [e.get_attribute("aria-label") for e in cut.locator(".cv-cut-plots .cv-plot").all()] == names
    # the limit of torque, 12 N m, is far above: it would flatten the line
    assert cut.locator(".cv-cut-plots .cv-plot line[stroke='#c81e1e']").count() == 0
    # the end of the force goes round: as many points as rotations of two tooth periods, and the first again
    points = cut.locator(".cv-locus").get_attribute("points").split()
    assert len(points) == 241
    assert points[0] == points[-1]
    assert len(set(points)) > 20
    data = cut.evaluate("document.querySelector('.cv-chip canvas').toDataURL('image/png')")
    picture = pixels(base64.b64decode(data.split(",", 1)[1])).astype(int)
    # the thickest part of the chip is as bright as the upper end of the scale, its ends as dark as the lower one
    bright = (picture[..., 0] > 180) & (picture[..., 2] < 110)
    dark = (picture[..., 0] < 70) & (picture[..., 1] < 70) & (picture[..., 2] > 50)
    assert bright.sum() > 200
    assert dark.sum() > 50


def test_where_nothing_is_cut_the_panel_says_so_and_the_sector_is_gone(cut) -> None:
    stand(cut, 30)
    assert cut.evaluate(f"{VIEW}.state()")["engaged"] > 100
    stand(cut, 5)
    cut.wait_for_function("document.querySelector('.cv-cut-said').textContent == 'Step 6: the teeth do not cut.'")
    assert cut.evaluate(f"{VIEW}.state()")["engaged"] == 0
    assert cut.evaluate(f"{PANEL}.state()") is None
    assert not cut.locator(".cv-chip").is_visible()


def test_the_sector_lies_ahead_of_the_cutter_and_can_be_hidden(cut, pixels) -> None:
    stand(cut, 30)
    others = ("cutter", "stock", "path", "fixture 0", "marks")
    cut.evaluate(f"{VIEW}.look('top'); {''.join(f'{VIEW}.layer({name!r}, false);' for name in others)}")

    def orange():
        data = cut.evaluate(f"{VIEW}.picture()")
        rgb = pixels(base64.b64decode(data.split(",", 1)[1])).astype(int)
        return np.argwhere((np.abs(rgb - [226, 174, 113]) < 25).all(axis=2))

    shown = orange()
    assert len(shown) > 100
    tip = cut.evaluate(
        f"""() => {{ const v = {VIEW}, q = v.camera.position.clone().set(24.8, 0, 0).project(v.camera);
        return [(1 - q.y) / 2, (q.x + 1) / 2]; }}"""
    )
    width = cut.evaluate(f"{VIEW}.overlay.stage.clientWidth")
    # the cutter goes along +x, to the right as seen from above
    assert (shown[:, 1] > tip[1] * width - 4).mean() > 0.98
    cut.evaluate(f"{VIEW}.layer('engagement', false)")
    assert len(orange()) < 0.1 * len(shown)
    cut.evaluate("".join(f"{VIEW}.layer({name!r}, true);" for name in ("engagement", *others)))


def test_the_operating_point_moves_in_the_chart_and_is_red_below_the_wanted_margin(cut) -> None:
    text = "document.querySelector('.cv-margin text:last-of-type').textContent"
    dot = cut.locator(".cv-operating")
    places = {}
    for row, said, colour in ((30, "3000 1/min, margin 2", "#3457a6"), (70, "3000 1/min, margin 0.8", "#c81e1e"),
                              (180, "2400 1/min, margin 2", "#3457a6")):  # fmt: skip
        stand(cut, row)
        cut.wait_for_function(f"t => {text} == t", arg=said)
        assert dot.get_attribute("fill") == colour
        places[row] = float(dot.get_attribute("cx")), float(dot.get_attribute("cy"))
    line = [tuple(map(float, p.split(","))) for p in cut.locator(".cv-margin polyline").get_attribute("points").split()]
    # at 3000 1/min the chart has the margin of row 70; another speed lies to the left, a greater margin above
    assert places[70] == pytest.approx(line[2], abs=0.2)
    assert places[30][0] == places[70][0] > places[180][0]
    assert places[30][1] == places[180][1] < places[70][1]
    # evenly spaced in the logarithm of speed
    assert line[1][0] - line[0][0] == pytest.approx(line[3][0] - line[2][0], abs=0.2)


def test_a_map_shows_its_limit_as_a_line_and_bends(cut, pixels) -> None:
    """The line of 12 N m lies at x = 30; the edge at x = 40 moves by 0.01 mm, drawn as 12 % of the diagonal."""
    choose(cut, "surface map", "sheet: torque")
    cut.wait_for_function(f"{VIEW}.state().map == 'sheet'")
    assert cut.evaluate(f"{VIEW}.state()")["factor"] == 0.0
    assert cut.locator(".cv-bar").get_by_text("limit 12").count() == 1
    others = ("cutter", "path", "fixture 0", "marks", "engagement")
    cut.evaluate("".join(f"{VIEW}.layer({name!r}, false);" for name in others) + f"{VIEW}.look('top')")
    data = cut.evaluate(f"{VIEW}.picture()")
    rgb = pixels(base64.b64decode(data.split(",", 1)[1])).astype(int)
    red = np.argwhere((rgb[..., 0] > 170) & (rgb[..., 1] < 70) & (rgb[..., 2] < 70))
    assert len(red) > 40
    across, width = cut.evaluate(
        f"""() => {{ const v = {VIEW}, q = v.camera.position.clone().set(30, 20, 0).project(v.camera);
        return [(q.x + 1) / 2, v.overlay.stage.clientWidth]; }}"""
    )
    assert np.median(red[:, 1]) == pytest.approx(across * rgb.shape[1], abs=3.0)
    assert width > 100
    slider = cut.locator("[aria-label='scale of the deflection']")
    slider.click(position={"x": slider.bounding_box()["width"] - 2.0, "y": 8.0})
    # at most 0.12 * 40 sqrt(2) mm over 0.01 mm
    most = 0.12 * 40.0 * np.sqrt(2.0) / 0.01
    cut.wait_for_function(f"m => {VIEW}.state().factor > 0.9 * m", arg=most)
    factor = cut.evaluate(f"{VIEW}.state()")["factor"]
    assert factor <= most * (1.0 + 1e-6)
    cut.wait_for_function("t => document.body.textContent.includes(t)", arg=f"deflection x {factor:.3g}")
    assert cut.evaluate(f"{VIEW}.map('sheet', 1)") == pytest.approx(most, rel=1e-5)
    # in the colours of a tolerance from 4 to 12 N m: red to x = 10, green to x = 30, blue beyond
    cut.evaluate(
        f"(() => {{ const v = {VIEW}; v.header.maps[0].tolerance = [4, 12]; v.map('sheet|tolerance', 0); }})()"
    )
    data = cut.evaluate(f"{VIEW}.picture()")
    rgb = pixels(base64.b64decode(data.split(",", 1)[1])).astype(int)
    cover = [((rgb.argmax(axis=2) == k) & (rgb.max(axis=2) - rgb.min(axis=2) > 60)).sum() for k in range(3)]
    assert np.array(cover) / sum(cover) == pytest.approx([0.25, 0.5, 0.25], abs=0.03)
    legend = cut.locator(".cv-bar").inner_text()
    for words in ("below 4", "within the tolerance", "above 12"):
        assert words in legend
    choose(cut, "surface map", "no map")
    cut.wait_for_function(f"{VIEW}.state().map == ''")
    cut.evaluate("".join(f"{VIEW}.layer({name!r}, true);" for name in others))


def test_the_path_is_coloured_by_tool(cut) -> None:
    choose(cut, "path coloured by", "tool")
    cut.locator(".cv-bar").get_by_text("T1", exact=True).wait_for()
    assert cut.locator(".cv-bar .cv-dot").count() >= 1
    choose(cut, "path coloured by", "force [N]")


def test_a_result_without_samples_says_so(browser, served) -> None:
    page = browser.new_page(viewport={"width": 1280, "height": 720})
    page.set_default_timeout(120_000)
    page.goto(served.address("?show=square"))
    page.wait_for_selector(".cv-ramp")
    page.locator(".cl-tabs").get_by_text("cut", exact=True).click()
    page.wait_for_function(
        "document.querySelector('.cv-cut-said')?.textContent == 'This result keeps no tooth engagement.'"
    )
    assert not page.locator(".cl-layers").get_by_text("engagement").count()
    page.close()
