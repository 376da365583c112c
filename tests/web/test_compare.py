"""Tracks and results against one another: numbers by formula, and what the page shows of them."""

import shutil
from pathlib import Path

import numpy as np
import pytest

from chipload.web.comparison import COLOURS, KeyNumber, Side, common_span, key_numbers, knots, matching_row, rows_along
from chipload.web.loads import line_loads, tool_uses
from chipload.web.panels.comparison import comparison_table
from chipload.web.result import open_result
from square import FORCE, LINE, ROWS, make_result, two_variants, write_by_hand
from web_lists import choose

VIEW = "chiploadViewer.of(document.querySelector('.cl-stage').id)"
SECOND = "chiploadViewer.of(document.querySelector('.cl-second').id)"


@pytest.fixture
def sides(tmp_path: Path) -> tuple[Side, Side]:
    """Half the force in half the time, against twice the time."""
    write_by_hand(two_variants(), tmp_path / "v")
    r = open_result(tmp_path, "v")
    return tuple(Side(r, t, t.title, COLOURS[k]) for k, t in enumerate(r.tracks))


def test_key_numbers_and_their_differences(sides) -> None:
    numbers = {n.label: n for n in key_numbers(sides)}
    # variable: 20 s and 450 N; constant: 40 s and 900 N; both go 160 mm with a torque of 9 N m
    assert numbers["program time"].values == (20.0, 40.0)
    assert numbers["program time"].difference(1) == (20.0, 100.0)
    assert numbers["greatest force"].values == (450.0, 900.0)
    assert numbers["greatest torque"].difference(1) == (0.0, 0.0)
    assert numbers["path"].values == pytest.approx((160.0, 160.0))
    assert numbers["time in cut"].values == pytest.approx((20.0, 40.0))
    assert KeyNumber("x", "", (None, 1.0)).difference(1) == (None, None)
    text = comparison_table(sides, "path")
    assert "+450 (+100 %)" in text
    assert "holds" in text
    assert "exceeds" in text


def test_rows_belong_together_by_time_or_by_path(sides) -> None:
    a, b = sides
    # row 99 of the first: 10 s and 80 mm; the second is at half its way then, or at the same place after 20 s
    assert matching_row(a, b, "path", 99) == 99
    assert matching_row(a, b, "time", 99) == 49
    assert matching_row(b, a, "time", 49) == 99
    assert matching_row(b, a, "time", ROWS - 1) == ROWS - 1
    assert rows_along(a, b, "path") == pytest.approx(a.track.s)
    assert rows_along(a, b, "time") == pytest.approx(2.0 * a.track.t)
    here, there = knots(a, b, "path")
    assert (here.tolist(), there.tolist()) == ([0.0, pytest.approx(160.0)], [0.0, pytest.approx(160.0)])
    assert common_span(sides, "force_n") == (FORCE.min() / 2.0, FORCE.max())
    assert common_span(sides, "pass") is None


def test_passes_of_one_name_begin_together(outcome, tmp_path: Path) -> None:
    from chipload.jobs.contour.figures import presentation_of
    from chipload.jobs.contour.result import result_of
    from chipload.report.folder import write_result

    made = outcome()
    write_result(result_of(made), presentation_of(made), tmp_path / "p")
    r = open_result(tmp_path, "p")
    a, b = (Side(r, t, t.title, "") for t in r.tracks[:2])
    here, _ = knots(a, b, "path")
    # a semi-finish pass and a finish pass of 900 rows each
    assert here.tolist() == pytest.approx([0.0, a.track.s[899], a.track.s[-1]])
    assert matching_row(a, b, "path", 899) == 899


def test_tools_and_lines_by_load(tmp_path: Path) -> None:
    make_result(tmp_path / "r")
    r = open_result(tmp_path, "r")
    track = r.tracks[0]
    (use,) = tool_uses(r, track)
    assert (use.tool, use.time_s, use.cut_s) == (1, pytest.approx(20.0), pytest.approx(20.0))
    assert use.cut_mm == pytest.approx(160.0)
    assert use.worst["force_n"] == (900.0, 120)
    assert [(p.first, p.last, p.begin, p.end) for p in use.periods] == [(0, ROWS - 1, 0.0, pytest.approx(20.0))]
    lines = line_loads(r, track, track.line, "force_n")
    # the greatest force of each side of the square: |row - 120| is least in it at row 120, 99, 150 and 49
    expected = sorted(((float(FORCE[n == LINE].max()), n) for n in (7, 8, 9, 10)), reverse=True)
    assert [(line.worst["force_n"], line.line) for line in lines] == expected
    assert [line.row for line in lines] == [120, 99, 150, 49]
    assert [line.time_s for line in lines] == pytest.approx([5.0] * 4)


def test_a_tool_that_leaves_the_material_has_two_bars(tmp_path: Path) -> None:
    from dataclasses import replace

    from chipload.result import in_memory
    from square import square_result

    one = square_result()
    columns = dict(one.tracks[0].columns)
    air = (np.arange(ROWS) >= 50) & (np.arange(ROWS) < 80)
    tool = np.where(np.arange(ROWS) < 150, 1, 7)
    columns |= {"force_n": np.where(air, 0.0, FORCE), "tool": tool}
    track = replace(one.tracks[0], blocks=in_memory(columns))
    write_by_hand(replace(one, tracks=(track,)), tmp_path / "r")
    r = open_result(tmp_path, "r")
    first, second = tool_uses(r, r.tracks[0])
    assert [(p.first, p.last) for p in first.periods] == [(0, 49), (80, 149)]
    assert (first.time_s, first.cut_s, first.cut_mm) == pytest.approx((15.0, 12.0, 96.0))
    assert (second.tool, second.cut_s, second.worst["force_n"][1]) == (7, pytest.approx(5.0), 150)


@pytest.fixture(scope="module")
def compared(browser, served, folder):
    """The page of two variants, compared."""
    write_by_hand(two_variants(), folder / "variants")
    page = browser.new_page(viewport={"width": 1280, "height": 720})
    page.set_default_timeout(120_000)
    wrong = []
    page.on("pageerror", lambda e: wrong.append(str(e)))
    page.goto(served.address("?show=variants"))
    page.wait_for_selector(".cl-limits", state="visible")
    page.wait_for_selector(".cv-ramp")
    choose(page, "compare with", "constant")
    page.wait_for_selector(".cl-compared", state="visible")
    page.wait_for_function(f"{SECOND}.header && {SECOND}.paired")
    yield page
    page.close()
    shutil.rmtree(folder / "variants")
    assert wrong == []


def test_two_views_and_two_lines_stand_together(compared) -> None:
    page = compared
    cells = page.locator(".cl-compared tbody tr", has_text="greatest force").locator("td").all_inner_texts()
    assert cells == ["greatest force [N]", "450", "900", "+450 (+100 %)"]
    lines = page.evaluate("document.querySelector('.cl-figure').data.map(d => [d.line.color, Math.max(...d.y)])")
    assert lines[:2] == [[COLOURS[0], 450.0], [COLOURS[1], 900.0]]
    page.evaluate(f"{VIEW}.go(99)")
    # both at 10 s: the second has gone half as far
    assert page.evaluate(f"[{VIEW}.row, {SECOND}.row]") == [99, 49]
    page.locator(".cl-plots").get_by_text("path", exact=True).last.click()
    page.wait_for_function(f"{SECOND}.row == {VIEW}.row")
    page.evaluate(f"{VIEW}.go(120)")
    assert page.evaluate(f"[{VIEW}.row, {SECOND}.row]") == [120, 120]
    tips = [page.evaluate(f"{view}.state().tip") for view in (VIEW, SECOND)]
    assert tips[0] == pytest.approx(tips[1])
    # the scale of colours is one: from the least to the greatest of both
    ends = [e.split() for e in page.locator(".cv-ends").all_inner_texts()]
    assert ends == [[f"{FORCE.min() / 2.0:.3g}", "900"]] * 2
    cameras = page.evaluate(f"{VIEW}.look('top'); [{VIEW}, {SECOND}].map(v => v.camera.position.toArray())")
    assert cameras[0] == pytest.approx(cameras[1])
    page.locator(".cl-plots").get_by_text("time", exact=True).last.click()


def test_the_timeline_and_the_lines_lead_to_their_place(compared) -> None:
    page = compared
    page.locator(".cl-tabs").get_by_text("tools").click()
    cells = page.locator(".cl-tools tbody td").all_inner_texts()
    assert cells[:6] == ["T1", "20", "20", "100", "160", "450"]
    page.locator(".cl-tools tbody td").nth(5).click()
    page.wait_for_function(f"{VIEW}.row == 120")
    # the cursor of the timeline stands at 12.1 of 20 s
    page.wait_for_function("Math.abs(parseFloat(document.querySelector('.cl-time-now').style.left) - 60.5) < 0.01")
    page.locator(".cl-tabs").get_by_text("lines").click()
    rows = page.locator(".cl-lines-box tbody tr")
    rows.first.wait_for(state="visible")
    lines = page.locator(".cl-lines-box tbody tr td:first-child").all_inner_texts()
    assert lines == ["9", "8", "10", "7"]
    rows.nth(2).click()
    page.wait_for_function(f"{VIEW}.row == 150")


def test_another_result_is_compared_and_left_again(compared) -> None:
    page = compared
    choose(page, "compare with", "constant", chosen=False)
    choose(page, "compare with", "square")
    page.wait_for_function("document.querySelector('.cl-compared')?.innerText.includes('square: program')")
    page.wait_for_function(f"{SECOND}.state().bodies.length == 1")
    choose(page, "compare with", "square", chosen=False)
    page.wait_for_function("!document.querySelector('.cl-compared')")
    assert not page.locator(".cl-second").is_visible()
    assert page.evaluate(f"{VIEW}.paired") is False
    page.wait_for_function("document.querySelector('.cl-figure').data.length == 2")
