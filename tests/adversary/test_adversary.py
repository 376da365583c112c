"""Jobs with one thing that a shop would call wrong: none holds silently."""

from __future__ import annotations

from pathlib import Path

import pytest

from adversary import geometry_cases, planner_cases, program_cases
from adversary.base import Case, require_end

#: tables of cases, one a subject
SUBJECTS = (geometry_cases, planner_cases, program_cases)
CASES: tuple[Case, ...] = tuple(case for subject in SUBJECTS for case in subject.CASES)


def test_each_case_has_a_name_of_its_own() -> None:
    names = [case.name for case in CASES]
    assert len(set(names)) == len(names)


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_a_job_with_one_thing_wrong(case: Case, tmp_path: Path) -> None:
    require_end(case, tmp_path)
