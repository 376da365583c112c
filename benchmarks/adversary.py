"""Jobs with one thing that a shop would call wrong: how many are caught, unproven, refused or listed as not checked.

    python benchmarks/adversary.py [--page] [NAME ...]

Runs each case of tests/adversary, or those that are named, and prints the counts and each case that does not end as it
must; then the exit code is 1. ``--page`` runs nothing and writes the table of docs/reliability.md.
"""

from __future__ import annotations

import sys
import tempfile
from collections import Counter
from pathlib import Path

ROOT = Path(__file__).parents[1]
# in place of this folder, where this file would stand for the package
sys.path[0] = str(ROOT / "tests")

from adversary.base import require_end  # noqa: E402
from adversary.subjects import BEGIN, CASES, END, page_table  # noqa: E402

#: what a state of a case is called here
CALLED = {"exceeds": "caught", "unproven": "unproven", "refused": "refused", "unchecked": "listed as not checked"}


def main(words: list[str]) -> int:
    """Run the cases, print the counts and return the exit code."""
    if "--page" in words:
        page = ROOT / "docs" / "reliability.md"
        before, rest = page.read_text().split(BEGIN)
        page.write_text(f"{before}{BEGIN}\n{page_table()}\n{END}{rest.split(END)[1]}")
        print(f"written: {page.relative_to(ROOT)}")
        return 0
    counts, wrong = Counter[str](), 0
    for case in CASES:
        if words and case.name not in words:
            continue
        with tempfile.TemporaryDirectory() as folder:
            try:
                require_end(case, Path(folder))
            except AssertionError as why:
                wrong += 1
                print(f"{case.name}: does not end {case.state} ({case.found}): {str(why).splitlines()[0][:200]}")
                continue
        counts[CALLED.get(case.state, "nothing wrong, and holds")] += 1
    print(", ".join(f"{count} {name}" for name, count in sorted(counts.items())) + f", {wrong} wrong")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
