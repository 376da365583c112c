"""Exit code, summary, loaded result, report and page of real runs state the same: verdict, message, limits, tracks."""

import html
import json
import re
import shutil
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest
from typer.testing import CliRunner

from chipload.cli import app
from chipload.number_text import number_text, worst_text
from chipload.result import Verdict, load_result
from square import two_variants, write_by_hand
from web_lists import VIEW, press_until
from web_served import Served

EXAMPLES = Path(__file__).parents[2] / "src" / "chipload" / "examples"
STRATEGIES = (('["plain", "backward", "feed"]', '["plain", "backward"]'), ("step_mm = 0.05", "step_mm = 0.5"))
#: folder of a run: the example, and what its job is changed in so that it runs within seconds
RUNS: dict[str, tuple[str, tuple[tuple[str, str], ...]]] = {
    "contour": ("contour", STRATEGIES),
    "overloaded": ("contour", (*STRATEGIES, ("force_xy_n = 450.0", "force_xy_n = 300.0"))),
    "feeds": ("feeds", (("layer_mm = 1.0", "layer_mm = 2.0"),)),
    "trunnion": ("trunnion", ()),
}
#: run by a process of its own, for its exit code; the others by this one, which loads compiled functions once
PROCESSES = ("trunnion",)
#: a slot in two layers, in the place of the program of `feeds`
SLOT = """%
O1
N10 G21 G90 G17 G40 G80 G94
N15 T1 M6
N20 G54 S6000 M3
N25 G0 X-43. Y0.
N40 G0 Z-2.
N45 G1 X-25. F1200
N50 G3 X-20. Y5. I0. J5.
N885 G0 Z5.
N890 M5
N895 M30
%
"""


def run(name: str, folder: Path) -> int:
    """Exit code of `chipload run` on a changed copy of an example."""
    example, changes = RUNS[name]
    shutil.copytree(EXAMPLES / example, folder)
    if example == "feeds":
        (folder / "pocket.nc").write_text(SLOT)
    job = folder / "job.toml"
    text = job.read_text()
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    job.write_text(text)
    words = ["run", str(job), "--out", str(folder / "result")]
    if name not in PROCESSES:
        return CliRunner().invoke(app, words).exit_code
    line = [sys.executable, "-c", "from chipload.cli import main; main()", *words]
    return subprocess.run(line, capture_output=True, text=True, timeout=900, check=False).returncode


#: whether a track is the one that is shown
SHOWN = "name => document.querySelector('.cl-tracks .q-field__native')?.innerText.startsWith(name)"


@pytest.fixture(scope="module")
def opened(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, int]]:
    """The folder with the results, and the exit code of each run."""
    root = tmp_path_factory.mktemp("contract")
    codes = {name: run(name, root / name) for name in RUNS}
    made = write_by_hand(two_variants(), root / "variants" / "result")
    (made / "report.html").unlink()
    return root, codes


@pytest.fixture(scope="module")
def served_results(opened: tuple[Path, dict[str, int]]) -> Iterator[Served]:
    """The page of the folder."""
    served = Served(opened[0])
    yield served
    served.end()


@pytest.fixture
def page_of(browser: object, served_results: Served) -> Iterator[object]:
    """Opens the page of a result; a page draws all the time, so it is closed after its test."""
    pages = []

    def page(name: str) -> object:
        one = browser.new_page(viewport={"width": 1280, "height": 720})
        one.set_default_timeout(60_000)
        one.goto(served_results.address(f"?show={name}/result"))
        one.wait_for_selector(".cl-word", state="visible")
        # it opens at the worst that was found
        one.wait_for_function("/step [0-9]+ of/.test(document.querySelector('.cl-where').textContent)")
        pages.append(one)
        return one

    yield page
    for one in pages:
        one.close()


def summary_of(folder: Path) -> dict:
    return json.loads((folder / "summary.json").read_text())


def report_of(folder: Path) -> str:
    """The report without the library's text."""
    return re.sub(r"<script.*?</script>", "", (folder / "report.html").read_text(), flags=re.S)


def rows_of(text: str) -> list[list[str]]:
    """Cells of the first table of a page."""
    rows = re.findall(r"<tr(?! class=.more).*?</tr>", text[: text.index("</table>")], flags=re.S)[1:]
    return [[html.unescape(re.sub("<[^>]*>", "", c)) for c in re.findall(r"<td[^>]*>(.*?)</td>", r)] for r in rows]


def number(value: float | None, limit: float) -> str:
    return "not known" if value is None else worst_text(value, limit)


@pytest.mark.parametrize("name", RUNS)
def test_exit_code_summary_result_report_and_page_state_one_verdict(opened, page_of, name: str) -> None:
    folder = opened[0] / name / "result"
    summary, result, page = summary_of(folder), load_result(folder), page_of(name)
    verdict = Verdict(summary["verdict"])
    assert opened[1][name] == {"holds": 0, "unproven": 3, "exceeds": 3}[summary["verdict"]]
    assert (result.verdict, result.message) == (verdict, summary["message"])
    report = report_of(folder)
    assert f": {verdict.value}</title>" in report
    found = re.search(
        r'<div class="verdict (\w+)"><b>([^<]*)</b>(?:<div class="answer">.*?</div>)?<span>(.*?)</span>', report
    )
    assert found is not None
    assert (found[2], html.unescape(found[3])) == (verdict.value, summary["message"])
    assert (found[1] == "good") == (verdict is Verdict.HOLDS)
    assert (page.inner_text(".cl-word"), page.inner_text(".cl-message")) == (verdict.value, summary["message"])
    colour = {"holds": "cl-ok", "unproven": "cl-may", "exceeds": "cl-no"}[verdict.value]
    assert colour in page.get_attribute(".cl-verdict", "class").split()
    changes = [change.line_text for change in result.changes]
    assert page.locator(".cl-change > :first-child").all_inner_texts() == changes
    assert all(f"<li>{html.escape(text)}</li>" in report for text in changes)
    assert changes or name != "overloaded"


def test_the_runs_end_in_every_state(opened) -> None:
    states = {summary_of(opened[0] / name / "result")["verdict"] for name in RUNS}
    assert states == {"holds", "unproven", "exceeds"}


@pytest.mark.parametrize("name", RUNS)
def test_every_limit_of_the_job_stands_in_summary_and_report(opened, name: str) -> None:
    folder = opened[0] / name / "result"
    summary = summary_of(folder)
    stated = tomllib.loads((opened[0] / name / "job.toml").read_text()).get("limits", {})
    if summary["capability"] != "program" or summary["limits"]:
        assert set(stated) <= {c["name"] for c in summary["limits"]}
    assert summary["limits"] == [c for t in summary["tracks"] if t["in_use"] for c in t["limits"]]
    text = report_of(folder)
    text = text[text.index("<h2>Limits</h2>") :]
    if not summary["limits"]:
        assert "No limit was checked." in text
        return
    checks = {c.name: c for t in load_result(folder).tracks for c in t.limits}
    wanted = [
        (t["name"] + (" in use" if t["in_use"] else ""), checks[c["name"]].column.title, c["state"],
         number_text(c["limit"], 6), number(c["worst"], c["limit"]))
        for t in summary["tracks"] for c in t["limits"]
    ]  # fmt: skip
    assert sorted(tuple(r[:5]) for r in rows_of(text)) == sorted(wanted)


@pytest.mark.parametrize("name", [*RUNS, "variants"])
def test_the_page_lists_the_limits_and_the_time_of_each_track(opened, page_of, name: str) -> None:
    folder = opened[0] / name / "result"
    summary, page = summary_of(folder), page_of(name)
    history = pq.read_table(folder / "history.parquet", columns=["track", "t_s"]).to_pandas()
    tracks = sorted((t for t in summary["tracks"] if t["rows"]), key=lambda t: not t["in_use"])
    assert tracks[0]["in_use"]
    checks = {
        (t.name, c.name): c.column.label + ("" if c.coverage.whole else f", {c.coverage.name}")
        for t in load_result(folder).tracks
        for c in t.limits
    }
    for k, track in enumerate(tracks):
        if k:
            page.keyboard.press("t")
        t = history.loc[history["track"] == track["name"], "t_s"].to_numpy()
        assert len(t) == track["rows"]
        assert (np.diff(t) >= 0.0).all()
        assert t[-1] == pytest.approx(track["time_s"], rel=1e-3)
        ends = f" of {t[-1]:.2f} s \u00b7 step 1 of {len(t)}"
        press_until(page, "Home", "e => document.querySelector('.cl-where').textContent.includes(e)", ends)
        if len(tracks) > 1:
            page.wait_for_function(SHOWN, arg=track["name"])
            shown = page.locator(".cl-tracks input, .cl-tracks .q-field__native").first.inner_text()
            assert shown.startswith(track["name"])
            assert shown.endswith(", in use") == track["in_use"]
        wanted = [
            (
                checks[track["name"], c["name"]],
                number(c["worst"], c["limit"]),
                f"{c['limit']:g} {c['unit']}".strip(),
                c["state"],
            )
            for c in track["limits"]
        ]
        for _ in range(600):  # the table follows the name of the track
            cells = page.evaluate(
                "[...document.querySelectorAll('.cl-checks tbody tr')].map(r => [...r.cells].map(c => c.textContent))"
            )
            if sorted((c[0], c[1], c[2].strip(), c[4]) for c in cells) == sorted(wanted):
                break
            page.wait_for_timeout(100)
        assert sorted((c[0], c[1], c[2].strip(), c[4]) for c in cells) == sorted(wanted)
        # what exceeds comes first and is marked
        for text, cell in zip(page.locator(".cl-checks .cl-no").all_inner_texts(), cells, strict=False):
            assert text == cell[4] == "exceeds"
        found = page.locator(".cl-found .cl-grave").all_inner_texts()
        for finding in track["findings"]:
            if finding["severity"] != "note":
                assert any(finding["text"] in text for text in found)
                colour = {"unproven": "cl-may", "exceeds": "cl-no"}[finding["severity"]]
                assert page.locator(f".cl-found .{colour}").filter(has_text=finding["text"]).count()


def test_the_failing_variant_shows_its_failure(opened, page_of) -> None:
    page = page_of("variants")
    assert page.inner_text(".cl-word") == "holds"
    assert page.locator(".cl-checks .cl-no").count() == 0
    page.keyboard.press("t")
    page.locator(".cl-checks .cl-no").get_by_text("exceeds").wait_for()
    assert page.locator(".cl-checks tbody tr").all_inner_texts()[0].split()[:3] == ["force", "900", "800"]
    page.locator(".cl-found .cl-grave").get_by_text("line 8: the path leaves the workpiece").wait_for()
    page.locator(".cl-found").get_by_text("constant is not in use").wait_for()


def test_what_does_not_cut_is_drawn_thin(opened, page_of) -> None:
    """Motions in air are lines of one pixel, which hide nothing; cuts are wide and in the colours of the column."""
    page = page_of("feeds")
    history = pq.read_table(opened[0] / "feeds" / "result" / "history.parquet").to_pandas()
    used = next(t["name"] for t in summary_of(opened[0] / "feeds" / "result")["tracks"] if t["in_use"])
    cuts = (history.loc[history["track"] == used, "chip_volume_mm3"].to_numpy() > 0.0)[1:]
    page.wait_for_function(f"{VIEW}.frames > 0")
    thin, wide = page.evaluate(
        f"""[true, false].map(thin => {VIEW}.path.sets.filter(s => Boolean(s.lines.isLineSegments2) !== thin)
        .reduce((n, s) => n + (thin ? s.lines.geometry.attributes.position.count / 2
        : s.lines.geometry.attributes.instanceStart.count), 0))"""
    )
    assert (thin, wide) == (int((~cuts).sum()), int(cuts.sum()))
    assert 0 < thin < wide
    assert "in air" in page.inner_text(".cv-bar")


@pytest.mark.parametrize("name", RUNS)
def test_the_programs_of_every_track_open(opened, page_of, name: str) -> None:
    folder = opened[0] / name / "result"
    summary, page = summary_of(folder), page_of(name)
    tracks = sorted((t for t in summary["tracks"] if t["rows"]), key=lambda t: not t["in_use"])
    for k, track in enumerate(tracks):
        for program in track["programs"]:
            assert (folder / program).read_text().strip()
        if k:
            page.keyboard.press("t")
        texts = [p for p in (*(folder / n for n in track["programs"]), *(opened[0] / name).iterdir()) if p.is_file()]
        page.wait_for_function(
            "names => names.some(n => document.querySelector('.cl-file').textContent.startsWith(n))",
            arg=[p.name for p in texts],
        )
        page.wait_for_selector(".cl-now")
        shown = page.inner_text(".cl-file").split(" \u00b7 ")[0]
        lines = next(p for p in texts if p.name == shown).read_text().splitlines()
        first = page.evaluate(
            "[...document.querySelectorAll('.cl-line')].slice(0, 5).map(x => [x.dataset.line, x.textContent])"
        )
        for line, text in first:
            assert text.removeprefix(line).rstrip() == lines[int(line) - 1].rstrip()
