"""The tool that runs real files reads what a run prints, and keeps the rows of files that it did not run."""

from __future__ import annotations

import re
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path

import pytest

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
        (1, "", "Traceback\nValueError: x\n", ("exit code 1", "ValueError: x")),
    ],
)
def test_a_run_is_read(tool, code, out, err, found):
    assert tool.read(code, out, err) == found


def test_rows_of_other_files_stay(tool, tmp_path, monkeypatch):
    monkeypatch.setattr(tool, "PAGE", tmp_path / "page.md")
    a, b, *rest = tool.FILES
    tool.write({a: tool.row(a, "k", "exceeds", "x | y", 12.3)})
    tool.write({b: tool.row(b, "k", "unproven", "z", 4.0)})
    rows = tool.rows_of(tool.PAGE.read_text())
    assert rows[a] == f"| `{a}` | k | exceeds | x / y | 12 |"
    assert rows[b].endswith("| unproven | z | 4 |")
    assert all("| not run |" in rows[name] for name in rest)


def test_the_page_names_every_file_once(tool):
    page = (ROOT / "docs" / "real_programs.md").read_text(encoding="utf-8")
    assert list(tool.rows_of(page)) == list(tool.FILES)
    assert re.search(r"^real: ", (ROOT / "Makefile").read_text(), re.MULTILINE)
