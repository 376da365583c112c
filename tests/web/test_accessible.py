"""The page for keyboards, readers of the screen and small windows."""

import pytest

from web_lists import AXE, VIEW, play_slowly, serious_problems, settle, stop

#: whether a part lies inside a window of this width
INSIDE = """([part, width]) => {
    const box = document.querySelector(part).getBoundingClientRect();
    return box.left >= 0 && box.right <= width + 0.5 && box.width > 100;
}"""


@pytest.fixture(scope="module")
def cut(browser, served):
    page = browser.new_page(viewport={"width": 1280, "height": 720}, has_touch=True)
    page.set_default_timeout(120_000)
    page.goto(served.address("?show=cut"))
    page.wait_for_selector(".cv-ramp")
    page.wait_for_selector(".cl-now")
    yield page
    page.close()


def test_nothing_lies_beside_a_narrow_window(cut) -> None:
    for width, height in ((420, 800), (1280, 720), (1920, 1080)):
        cut.set_viewport_size({"width": width, "height": height})
        cut.wait_for_function("w => document.documentElement.scrollWidth == w", arg=width)
        for part in (".cl-header", ".cl-verdict", ".cl-space", ".cl-plots", ".cl-tables", ".cl-source", ".cl-foot"):
            # plots take their new width after the page does
            cut.wait_for_function(INSIDE, arg=[part, width])
            assert cut.evaluate(INSIDE, [part, width]), (part, width)
    cut.set_viewport_size({"width": 1280, "height": 720})


def test_nothing_covers_the_middle_of_the_scene(cut) -> None:
    cut.evaluate(f"{VIEW}.show(0)")
    for width, height in ((420, 800), (1280, 720), (1920, 1080)):
        cut.set_viewport_size({"width": width, "height": height})
        cut.wait_for_function("w => document.documentElement.scrollWidth == w", arg=width)
        scene = cut.locator(".cl-stage canvas").bounding_box()
        assert scene["width"] * scene["height"] > 0.13 * width * height
        low, high = (
            [scene[x] + share * scene[w] for x, w in (("x", "width"), ("y", "height"))] for share in (0.25, 0.75)
        )
        for part in (".cv-bar", ".cv-note", ".cv-scale", ".cl-controls", ".cl-buttons", ".cl-notice", ".cl-section"):
            if cut.locator(part).first.is_visible():
                box = cut.locator(part).first.bounding_box()
                beside = box["x"] >= high[0] or box["x"] + box["width"] <= low[0]
                assert beside or box["y"] >= high[1] or box["y"] + box["height"] <= low[1], (width, part)
    cut.set_viewport_size({"width": 1280, "height": 720})


def test_the_window_says_what_it_shows_and_every_control_has_a_name(cut) -> None:
    assert cut.title() == "exceeds: cut - chipload"
    assert cut.evaluate("document.documentElement.lang") == "en"
    assert cut.get_by_role("heading", level=1).inner_text() == "cut"
    assert cut.locator(".cl-message[role=status]").inner_text().startswith("Exceeds")
    for name in ("3D view", "plots", "limits and findings", "program"):
        assert cut.get_by_role("region", name=name).count() == 1
    nameless = cut.evaluate(
        """[...document.querySelectorAll('button, [role=slider], [role=checkbox], a[href]')]
        .filter(e => e.offsetParent && !(e.getAttribute('aria-label') || e.textContent.trim()))
        .map(e => e.outerHTML.slice(0, 120))"""
    )
    assert nameless == []


def test_space_plays_whatever_was_clicked_before(cut) -> None:
    for text in ("marks", "values on stock", "values on stock", "marks"):
        cut.locator(".cl-layers").get_by_text(text).click()
    cut.keyboard.press("Home")
    settle(cut, 0)
    play_slowly(cut)
    cut.wait_for_selector("button[aria-label='pause (Space)']")
    assert stop(cut) > 3
    cut.wait_for_selector("button[aria-label='play (Space)']")


def test_axe_finds_nothing_serious(cut) -> None:
    if not AXE.exists():
        pytest.skip("no axe-core: npm install in viewer/")
    # the teeth cut there
    cut.evaluate(f"{VIEW}.go(30)")
    for tab, shown in (("limits", ".cl-checks"), ("cut", ".cv-cut-plots svg")):
        cut.locator(".cl-tabs").get_by_text(tab, exact=True).click()
        cut.locator(shown).first.wait_for()
        assert serious_problems(cut) == [], tab
