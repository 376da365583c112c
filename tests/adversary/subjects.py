"""All cases, by subject, and their table in docs/reliability.md."""

from __future__ import annotations

from adversary import control_cases, geometry_cases, impeller_cases, planner_cases, program_cases, text_cases
from adversary.base import Case

#: tables of cases, one a subject
SUBJECTS = (text_cases, program_cases, control_cases, geometry_cases, planner_cases, impeller_cases)
CASES: tuple[Case, ...] = tuple(case for subject in SUBJECTS for case in subject.CASES)
#: where the table stands in the page
BEGIN, END = "<!-- cases: python benchmarks/adversary.py --page -->\n", "<!-- end of cases -->\n"


def page_table() -> str:
    """The table of the cases that have something wrong, as the page has it."""
    rows = [
        f"| `{case.name}` | {case.wrong} | {case.state} | `{case.found}` |\n" for case in CASES if case.state != "holds"
    ]
    return "| case | what is wrong | result | finding, limit or item |\n|---|---|---|---|\n" + "".join(rows)
