"""Every example's result in a browser: verdict, limits and program texts of each track, the track in use first."""

from __future__ import annotations

import json
from collections.abc import Iterator

import pytest
from page_values import SOURCES

from chipload.number_text import number_text, worst_text
from chipload.result import Result, load_result
from results.test_examples import NAMES
from web_served import Served

#: of many tracks the page shows these
MOST = 4
SHOWN = "name => document.querySelector('.cl-tracks .q-field__native')?.innerText.startsWith(name)"
CELLS = "[...document.querySelectorAll('.cl-checks tbody tr')].map(r => [...r.cells].map(c => c.textContent.trim()))"


@pytest.fixture(scope="module")
def served(example) -> Iterator[Served]:
    """The page of the folder that holds the results."""
    page = Served(example("trunnion").folder.parent)
    yield page
    page.end()


def _critical_track(result: Result) -> str | None:
    """Name of the track in use whose limit has the least margin."""
    margins = [(c.margin, t.name) for t in result.tracks if t.in_use for c in t.limits if c.margin is not None]
    return min(margins)[1] if margins else None


@pytest.mark.parametrize("name", NAMES)
def test_the_page_states_what_the_summary_states(example, browser, served, name):
    done = example(name)
    summary = json.loads((done.folder / "summary.json").read_text())
    tracks = sorted((t for t in summary["tracks"] if t["rows"]), key=lambda t: not t["in_use"])
    if not tracks:
        return  # a search without programs has no page: tests/results/test_examples.py
    result = load_result(done.folder)
    # it opens with the program of the critical limit
    first = next((k for k, t in enumerate(tracks) if t["name"] == _critical_track(result)), 0)
    tracks = tracks[first:] + tracks[:first]
    made = [file for _, file in SOURCES[name].files.values()]
    checks = {(t.name, c.name): c for t in result.tracks for c in t.limits}
    page = browser.new_page(viewport={"width": 1280, "height": 720})
    try:
        page.set_default_timeout(60_000)
        page.goto(served.address(f"?show={name}"))
        page.wait_for_selector(".cl-word", state="visible")
        page.wait_for_function("document.querySelector('.cl-message')?.innerText")
        assert (page.inner_text(".cl-word"), page.inner_text(".cl-message")) == (summary["verdict"], summary["message"])
        assert tracks[0]["in_use"]
        for k, track in enumerate(tracks[:MOST]):
            if k:
                page.keyboard.press("t")
            page.wait_for_function(
                # it opens at the worst that was found
                "end => new RegExp('step [0-9]+ ' + end).test(document.querySelector('.cl-where').textContent)",
                arg=f"of {track['rows']}\\b",
            )
            if len(tracks) > 1:
                page.wait_for_function(SHOWN, arg=track["name"])
            expected = [
                (
                    check.column.label + ("" if check.coverage.whole else f", {check.coverage.name}"),
                    "not known" if c["worst"] is None else worst_text(c["worst"], c["limit"]),
                    f"{'≥ ' if check.column.least else ''}{number_text(c['limit'], 6)} {c['unit']}".strip(),
                    c["state"],
                )
                for c in track["limits"]
                for check in [checks[track["name"], c["name"]]]
            ]
            for _ in range(600):  # the table follows the name of the track
                cells = sorted((c[0], c[1], c[2], c[4]) for c in page.evaluate(CELLS))
                if cells == sorted(expected):
                    break
                page.wait_for_timeout(100)
            assert cells == sorted(expected)
            if track["programs"]:
                page.wait_for_function(
                    "names => names.some(n => document.querySelector('.cl-file').textContent.startsWith(n))",
                    arg=[*track["programs"], *made, *(p.name for p in (done.loaded.job.path.parent).iterdir())],
                )
                assert page.locator(".cl-line").count() > 1
    finally:
        page.close()
