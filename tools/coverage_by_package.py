"""Print which share of its statements the tests run in each package: `make coverage`, or after it, this file.

The source is measured by `coverage`, in every process that the tests start. Compiled functions run outside Python and
are left out of both counts; the laws and oracles that hold them are listed in docs/accuracy.md.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from collections import defaultdict
from pathlib import Path

ROOT = Path(__file__).parents[1]
SOURCE = "src/chipload/"


def counts(data: Path) -> dict[str, tuple[int, int]]:
    """Statements and how many of them were run, by package, from a report of `coverage json`."""
    found: dict[str, tuple[int, int]] = defaultdict(lambda: (0, 0))
    for name, file in json.loads(data.read_text("utf-8"))["files"].items():
        parts = name.removeprefix(SOURCE).split("/")
        # a capability of jobs/ and a planner are packages of their own
        package = "/".join(parts[: min(len(parts) - 1, 2 if parts[0] in ("jobs", "planning") else 1)]) or "chipload"
        statements, run = found[package]
        summary = file["summary"]
        found[package] = statements + summary["num_statements"], run + summary["covered_lines"]
    return found


def main() -> int:
    """One row for each package, in Markdown."""
    coverage = [sys.executable, "-m", "coverage"]
    with tempfile.TemporaryDirectory() as folder:
        data = Path(folder) / "coverage.json"
        if any(ROOT.glob(".coverage.*")):
            subprocess.run([*coverage, "combine", "--quiet"], cwd=ROOT, check=True)
        subprocess.run([*coverage, "json", "--quiet", "-o", str(data)], cwd=ROOT, check=True)
        found = counts(data)
    print("| package | statements | run by the tests [%] |\n|---|---:|---:|")
    whole = [sum(column) for column in zip(*found.values(), strict=True)]
    for package, (statements, run) in (*sorted(found.items()), ("all", (whole[0], whole[1]))):
        if statements:
            print(f"| {package} | {statements} | {100.0 * run / statements:.0f} |")
    return 0


if __name__ == "__main__":
    sys.exit(main())
