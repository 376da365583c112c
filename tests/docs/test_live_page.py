"""The live page of the documentation: the verdict, the limits and the view of a report, in a file that asks nobody."""

from __future__ import annotations

import re
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path

import pytest

from chipload.report.page import page_bytes
from chipload.report.presentation import Presentation
from square import square_result

ROOT = Path(__file__).parents[2]


@pytest.fixture
def tool():
    spec = spec_from_file_location("live_page", ROOT / "tools" / "live_page.py")
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_figures_and_other_sections_are_left_out(tool) -> None:
    result = square_result("cut")
    view = ["<h2>In space</h2>", '<div id="view3d"></div>', '<script class="view3d-data">AAAA</script>']
    text = page_bytes(result, Presentation(lambda _: ["<h2>More</h2><p>a figure</p>"], lambda: b""), view).decode()
    live = tool.live_page(text)
    assert result.first_lines[0].replace("'", "&#x27;") in live
    assert re.findall("<h2>(.*?)</h2>", live) == ["In space", "Limits"]
    assert '<script id="viewer"' in live
    assert live.index("async function library") < live.index('library("viewer").then')
    for left in ("plotly", "a figure", "const figures", "Provenance"):
        assert left not in live, left


def test_the_first_page_shows_it_and_it_asks_nobody(tool, browser) -> None:
    assert f'<iframe src="live/{tool.OUT.name}"' in (ROOT / "docs" / "index.md").read_text(encoding="utf-8")
    assert tool.OUT.stat().st_size < 1_500_000
    page = browser.new_page(viewport={"width": 800, "height": 860})
    page.set_default_timeout(120_000)
    asked, wrong = [], []
    page.on("request", lambda r: asked.append(r.url))
    page.on("pageerror", lambda e: wrong.append(str(e)))
    page.goto(tool.OUT.as_uri())
    page.wait_for_selector(".view3d .cv-ramp")
    page.wait_for_function("chiploadViewer.of('view3d').frames > 0")
    assert page.inner_text(".verdict b") == "holds"
    page.close()
    assert wrong == []
    assert [u for u in asked if not u.startswith(("data:", "blob:")) and u != tool.OUT.as_uri()] == []
