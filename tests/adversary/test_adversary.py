"""Jobs with one thing that a shop would call wrong: none holds silently."""

from __future__ import annotations

from pathlib import Path

import pytest

from adversary.base import Case, require_end
from adversary.subjects import CASES, page_table

PAGE = Path(__file__).parents[2] / "docs" / "reliability.md"


def test_each_case_has_a_name_of_its_own() -> None:
    names = [case.name for case in CASES]
    assert len(set(names)) == len(names)


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_a_job_with_one_thing_wrong(case: Case, tmp_path: Path) -> None:
    require_end(case, tmp_path)


def test_the_page_has_the_table_of_the_cases() -> None:
    assert page_table() in PAGE.read_text(), "run: python benchmarks/adversary.py --page"
