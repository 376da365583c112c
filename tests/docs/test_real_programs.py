"""The tool that runs real files reads what a run prints, and keeps the rows of files that it did not run."""

from __future__ import annotations

import math
import re
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path

import pytest

from chipload.simulation.estimate import estimate

ROOT = Path(__file__).parents[2]


@pytest.fixture
def tool():
    spec = spec_from_file_location("real_programs", ROOT / "tools" / "real_programs.py")
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize(
    ("code", "out", "err", "found"),
    [
        (3, "a title\nguess: x\nUnproven: no stock.\nworst values: -\n", "", ("unproven", "no stock.")),
        (3, "Exceeds: line 3: a rapid\n", "chipload: 20 %\n", ("exceeds", "line 3: a rapid")),
        (2, "", "chipload: 20 %\nchipload: part: no contour\n", ("refused", "part: no contour")),
        (1, "", "Traceback\nValueError: x\n", ("failed", "ValueError: x")),
        (1, "", "", ("failed", "exit code 1")),
    ],
)
def test_a_run_is_read(tool, code, out, err, found):
    assert tool.read(code, out, err) == found


@pytest.mark.parametrize(
    ("code", "err", "reason"),
    [
        (None, "chipload: 12 %, about 9 min left: removing\nchipload: stopped: 7 steps are kept\n",
         "stopped after 60 s at 12 %; goes on in the next run"),
        (-9, "chipload: 13 %, about 127 min left: removing\n", "ended by SIGKILL at 13 %; goes on in the next run"),
        (-15, "", "ended by SIGTERM; goes on in the next run"),
    ],
)  # fmt: skip
def test_a_run_that_did_not_end_says_how_far_it_came(tool, tmp_path, monkeypatch, code, err, reason):
    monkeypatch.setattr(tool, "timed", lambda words, limit_s: (code, "", err, 4.0))
    assert tool.run(tmp_path, 60.0) == ("not finished", reason, 4.0)


def test_a_long_reason_ends_at_a_word(tool):
    cell = tool.row("a", "k", "exceeds", "word " * 100, 1.0).split("|")[4].strip()
    assert cell.endswith("word ...")
    assert len(cell) <= tool.LONGEST_REASON


def test_rows_of_other_files_stay(tool, tmp_path, monkeypatch):
    monkeypatch.setattr(tool, "PAGE", tmp_path / "page.md")
    a, b, *rest = tool.FILES
    tool.write({a: tool.row(a, "k", "exceeds", "x | y", 12.3)})
    tool.PAGE.write_text(tool.PAGE.read_text() + "\n## More\n\nA text.\n")
    tool.write({b: tool.row(b, "k", "unproven", "z", 4.0)})
    assert tool.PAGE.read_text().endswith("|\n\n## More\n\nA text.\n")
    rows = tool.rows_of(tool.PAGE.read_text())
    assert rows[a] == f"| `{a}` | k | exceeds | x / y | 12 |"
    assert rows[b].endswith("| unproven | z | 4 |")
    assert all("| not run |" in rows[name] for name in rest)


def test_the_page_names_every_file_once(tool):
    page = (ROOT / "docs" / "real_programs.md").read_text(encoding="utf-8")
    assert list(tool.rows_of(page)) == list(tool.FILES)
    assert re.search(r"^real: ", (ROOT / "Makefile").read_text(), re.MULTILINE)


@pytest.mark.parametrize(
    ("out", "seconds"),
    [
        ("job.toml: read\nestimate: 5671 steps, 358 MB of memory, 13 to 100 s\n8 guesses", 100.0),
        ("estimate: 200000 steps, 610 MB of memory, 5 to 57 min; for a first result: run --coarse", 3420.0),
        ("operation 0: pocket, cutter 1 of 12 mm, 1600 mm2", math.inf),
    ],
)
def test_an_estimate_is_read(tool, out, seconds):
    assert tool.estimated(out) == seconds


def test_the_estimate_of_the_product_is_read(tool):
    for steps in (100, 200_000, 20_000_000):
        assert math.isfinite(tool.estimated(estimate(steps, steps // 2)))


def test_the_shortest_is_run_first_and_a_verdict_is_kept(tool, tmp_path, monkeypatch):
    """Files with a verdict are left out; what was stopped at the limit goes on, and its times add up."""
    monkeypatch.setattr(tool, "PAGE", tmp_path / "page.md")
    monkeypatch.setenv("CHIPLOAD_DATA", str(tmp_path))
    names = list(tool.FILES)[:3]
    for name in names:
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).touch()
    tool.write({names[0]: tool.row(names[0], "k", "exceeds", "x", 5.0)})
    ran, codes = [], [None, 3, 3]

    def timed(words, limit_s=None):
        if words[0] == "check":
            minutes = 1 if "text" in words[1] else 2
            return 0, f"estimate: 1 steps, 1 MB of memory, 1 to {minutes} min", "", 0.0
        if words[0] == "run":
            ran.append(Path(words[1]).parents[1].name)
            return codes.pop(0), "Exceeds: y\n", "chipload: stopped: 7 steps are kept\n", 10.0
        return 0, "", "", 0.0

    monkeypatch.setattr(tool, "timed", timed)
    kept = ["--kept", str(tmp_path / "kept")]
    for name in names:
        tool.folder_of(tmp_path / "kept", name).mkdir(parents=True)
    tool.main([*names[1:], *kept])
    assert ran == [tool.folder_of(tmp_path, name).name for name in (names[2], names[1])]
    rows = tool.rows_of(tool.PAGE.read_text())
    assert "stopped after 600 s" in rows[names[2]]
    assert rows[names[0]].endswith("| exceeds | x | 5 |")
    tool.main([*names, *kept])
    assert len(ran) == 3
    assert tool.rows_of(tool.PAGE.read_text())[names[2]].endswith("| exceeds | y | 20 |")
    old = tool.folder_of(tmp_path / "kept", names[0]) / "job" / "job.toml"
    old.parent.mkdir(exist_ok=True)
    old.touch()
    codes.append(3)
    tool.main([names[0], "--again", *kept])
    assert (len(ran), old.exists()) == (4, False)
    assert tool.rows_of(tool.PAGE.read_text())[names[0]].endswith("| exceeds | y | 10 |")
