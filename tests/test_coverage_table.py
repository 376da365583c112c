"""The table of tools/coverage_by_package.py: its numbers, its place on the page, and the tests of each package."""

from __future__ import annotations

import importlib.util
import json
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
spec = importlib.util.spec_from_file_location("coverage_by_package", ROOT / "tools" / "coverage_by_package.py")
tool = importlib.util.module_from_spec(spec)
spec.loader.exec_module(tool)


def test_capabilities_and_planners_are_rows_of_their_own(tmp_path):
    lines = {"stock/a.py": (10, 5), "stock/inner/b.py": (10, 10), "jobs/fit/run.py": (4, 1), "jobs/kept.py": (2, 2)}
    lines |= {"units.py": (4, 3), "stock/empty.py": (0, 0)}
    files = {f"src/chipload/{k}": {"summary": {"num_statements": n, "covered_lines": m}} for k, (n, m) in lines.items()}
    (tmp_path / "report.json").write_text(json.dumps({"files": files}))
    found = tool.counts(tmp_path / "report.json")
    assert found == {"stock": (20, 15), "jobs/fit": (4, 1), "jobs": (2, 2), "chipload": (4, 3)}
    rows = tool.table(found).splitlines()[2:]
    assert rows == ["| chipload | 4 | 75 |", "| jobs | 2 | 100 |", "| jobs/fit | 4 | 25 |", "| stock | 20 | 75 |",
                    "| all | 30 | 70 |"]  # fmt: skip


def test_the_table_of_the_page_is_replaced_and_nothing_else():
    page = "# A\n\n| 0 |\n\n## Test coverage\n\ntext\n\n| a |\n|---|\n| 1 |\n\n## Next\n\n| 2 |\n"
    assert tool.with_table(page, "| b |\n|---|") == page.replace("| a |\n|---|\n| 1 |", "| b |\n|---|")
    with pytest.raises(SystemExit, match="no table below"):
        tool.with_table("## Test coverage\n\ntext\n", "| b |")


def test_every_package_has_tests_of_its_own():
    folders = {p.parent.name for p in (ROOT / "src" / "chipload").glob("*/__init__.py")} - {"examples", "data"}
    assert set(tool.packages()) == folders | {"chipload"}
    assert all(any(ROOT.glob(pattern)) for name in tool.MORE for pattern in tool.MORE[name])


def test_rows_of_packages_that_are_not_measured_stay(tmp_path, monkeypatch):
    head = "## Test coverage\n\n| package | a | b |\n|---|---:|---:|\n"
    page = f"{head}| cli | 100 | 90 |\n| web | 50 | 20 |\n| all | 150 | 67 |\n"
    (tmp_path / "page.md").write_text(page)
    monkeypatch.setattr(tool, "PAGE", tmp_path / "page.md")
    monkeypatch.setattr(tool, "own_counts", lambda package, *_: {package: (60, 45)})
    monkeypatch.setattr("sys.argv", ["coverage_by_package.py", "--own", "web", "--write"])
    monkeypatch.setattr(tool, "ROOT", tmp_path)
    monkeypatch.setattr(tool, "packages", lambda: ["cli", "web"])
    assert tool.main() == 0
    rows = (tmp_path / "page.md").read_text().splitlines()[-3:]
    assert rows == ["| cli | 100 | 90 |", "| web | 60 | 75 |", "| all | 160 | 84 |"]
