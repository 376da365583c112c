"""What a person sees first: the verdict as an answer, the picture of the worst place, and what a face says."""

import numpy as np

from square import FORCE, ROWS
from web_lists import VIEW, settle

WORST = int(FORCE.argmax())


def test_state_worst_value_and_its_line_are_seen_at_every_width(shared) -> None:
    page = shared
    for width, height in ((420, 860), (1280, 720), (1920, 1080)):
        page.set_viewport_size({"width": width, "height": height})
        page.wait_for_function("w => document.documentElement.scrollWidth == w", arg=width)
        for part in (".cl-word", ".answer .value", ".answer .limit-bar", ".answer [data-row]"):
            box = page.locator(part).first.bounding_box()
            assert box["x"] >= 0.0, part
            assert box["x"] + box["width"] <= width, part
            assert box["y"] + box["height"] <= 0.3 * height, part
    page.set_viewport_size({"width": 1280, "height": 720})
    assert page.inner_text(".answer .value") == "force 900 of 800 N"
    assert "12.5 % beyond the limit" in page.inner_text(".answer")
    assert page.inner_text(".answer [data-row]").startswith("in line 9")


def test_a_click_on_the_place_leads_there_and_the_message_unfolds(square) -> None:
    page = square
    page.click(".answer [data-row]")
    settle(page, WORST)
    assert not page.locator(".cl-lines").is_visible()
    page.locator(".cl-fold").click()
    page.wait_for_selector(".cl-lines", state="visible")
    assert page.inner_text(".cl-lines").startswith("Not checked: limit power_w")
    page.locator(".cl-fold").click()
    page.wait_for_selector(".cl-lines", state="hidden")


def test_the_picture_is_parallel_and_rings_the_place(shared) -> None:
    seen = shared.evaluate(
        f"""() => {{ const v = {VIEW}; v.look('iso'); v.picture();
        const at = (x) => v.camera.position.clone().set(...x).project(v.camera);
        const edge = (a, b) => at(a).distanceTo(at(b));
        return [v.marks.children.length, edge([0, 0, 0], [0, 0, -9]), edge([40, 40, 0], [40, 40, -9]),
                v.camera.isOrthographicCamera]; }}"""
    )
    assert seen[0] == 1
    # equal edges near and far are drawn equally long
    assert abs(seen[1] / seen[2] - 1.0) < 1e-6
    assert seen[3]


def test_a_face_says_which_line_cut_it(window) -> None:
    page = window("?show=cut")
    page.wait_for_selector(".cv-ramp")
    page.wait_for_selector(".cl-now")
    page.keyboard.press("End")
    settle(page, ROWS - 1)
    # the floor of the slot along the second side, x = 40, and the raw top beside it
    places = page.evaluate(
        f"""() => {{ const v = {VIEW}; v.look('top'); v.layer('path', false); v.layer('cutter', false); v.picture();
        const b = v.overlay.stage.getBoundingClientRect();
        return [[40, 20.2, -2], [20, 20, 0]].map(p => {{
          const q = v.camera.position.clone().set(...p).project(v.camera);
          return [b.x + (q.x + 1) * b.width / 2, b.y + (1 - q.y) * b.height / 2]; }}); }}"""
    )
    page.mouse.click(*places[1])
    page.wait_for_function("document.querySelector('.cv-note').textContent.includes('raw stock')")
    page.mouse.click(*places[0])
    page.wait_for_function("document.querySelector('.cv-note').textContent.startsWith('cut in step')")
    said = page.inner_text(".cv-note")
    assert "line 8" in said
    assert "force" in said
    row = int(said.split()[3]) - 1
    settle(page, row)
    tip = page.evaluate(f"{VIEW}.state().tip")
    # the mill of 8 mm reaches the place with its front
    assert np.allclose(tip[:2], [40.0, 20.2], atol=4.0 + 0.8)
