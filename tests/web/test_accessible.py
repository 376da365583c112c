"""The page for keyboards, readers of the screen and small windows."""

import itertools
from pathlib import Path

import pytest

from square import LINE, ROWS
from web_lists import AXE, VIEW, drawn, play_slowly, serious_problems, settle, stop
from web_questions import QUESTIONS, ask, take_back

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


def test_ten_questions_are_answered_within_two_clicks(cut) -> None:
    assert len(QUESTIONS) == 10
    assert max(question.count for question in QUESTIONS) == 2
    cut.keyboard.press("End")
    settle(cut, ROWS - 1)
    options = {"compare with": "square", "surface map": "sheet: torque"}
    for question in QUESTIONS:
        ask(cut, question, options)
        take_back(cut, question, options)
    page = (Path(__file__).parents[2] / "docs" / "how-to" / "questions.md").read_text()
    for number, question in enumerate(QUESTIONS, 1):
        assert f"| {question.text} | {question.count} |" in page
        assert f"](questions/{number}.png)" in page


def test_the_page_is_dark_as_the_system_is_or_by_its_switch(cut) -> None:
    def is_dark(dark: bool) -> None:
        cut.wait_for_function("d => document.body.classList.contains('body--dark') == d", arg=dark)
        drawn(cut)
        ground, scale = cut.evaluate(f"[{VIEW}.scene.background.getHex(), {VIEW}.header.scale[0][1]]")
        assert (ground, scale) == ((0x1B2128, "#7d6fd6") if dark else (0xEEF1F5, "#30245c"))

    is_dark(False)
    cut.emulate_media(color_scheme="dark")
    is_dark(True)
    # every stop of the scale is seen on its ground (contrast of WCAG), and none is darker than the one before by much
    stops = [luminance(colour) for _, colour in cut.evaluate(f"{VIEW}.header.scale")]
    assert min((stop + 0.05) / (luminance("#1b2128") + 0.05) for stop in stops) > 3.0
    assert all(b > 0.9 * a for a, b in itertools.pairwise(stops))
    assert serious_problems(cut) == []
    cut.get_by_role("button", name="dark or light (d)").click()
    is_dark(False)
    cut.emulate_media(color_scheme="light")
    is_dark(False)


def luminance(colour: str) -> float:
    """Relative luminance of a colour `#rrggbb` (WCAG 2.2)."""
    parts = [int(colour[k : k + 2], 16) / 255.0 for k in (1, 3, 5)]
    linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in parts]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def test_wheel_and_keys_step_and_change_the_speed_and_a_tab_keeps_the_step(cut) -> None:
    cut.keyboard.press("Home")
    settle(cut, 0)
    cut.locator(".cl-slider").hover()
    cut.mouse.wheel(0, 120)
    settle(cut, 1)
    cut.keyboard.down("Shift")
    cut.mouse.wheel(0, 120)
    cut.keyboard.up("Shift")
    # the next line of the program begins with its first step
    settle(cut, int((LINE[1] != LINE).argmax()))
    row = cut.evaluate(f"{VIEW}.row")
    for name in ("tools", "lines", "limits"):
        cut.locator(".cl-tabs").get_by_text(name, exact=True).click()
        settle(cut, row)
    speed = cut.locator(".cl-speed")
    for key, shown in (("+", "\u00d70.1"), ("+", "\u00d71"), ("-", "\u00d70.1")):
        cut.keyboard.press(key)
        speed.get_by_text(shown, exact=True).wait_for()
    speed.hover()
    cut.mouse.wheel(0, -120)
    speed.get_by_text("\u00d71", exact=True).wait_for()
    cut.keyboard.press("?")
    keys = cut.locator(".cl-keys").inner_text()
    for key in ("wheel", "+ \u2212", "Space", "h"):
        assert key in keys
    cut.keyboard.press("Escape")
    cut.wait_for_selector(".cl-keys", state="hidden")
