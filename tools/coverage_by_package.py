"""Print which share of its statements the tests run in each package.

Usage: ``python tools/coverage_by_package.py [--own [PACKAGE ...]] [--workers N] [--missing] [--write]``

Without ``--own`` the data of ``make coverage`` are read: the share that all tests run. With ``--own`` the tests of each
package run here, and their share of that package alone is measured: nothing else is traced, so that it takes little
longer than these tests without it. ``--missing`` prints the lines that were not run. ``--write`` puts the table into
docs/reliability.md; rows of packages that were not measured stay.

The source is measured by `coverage`, in every process that the tests start. Compiled functions run outside Python and
are left out of both counts; the laws and oracles that hold them are listed in docs/accuracy.md.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import re
import subprocess
import sys
import tempfile
from collections import defaultdict
from pathlib import Path

ROOT = Path(__file__).parents[1]
SOURCE = "src/chipload/"
PAGE, HEADING = ROOT / "docs" / "reliability.md", "## Test coverage"
#: the modules that are in no package
TOP = "chipload"
#: tests of a package beside those in the folder of its name
MORE = {
    "api": ("tests/test_api.py", "tests/checking/test_simulate.py"),
    "cli": (
        "tests/control/test_chatter.py", "tests/control/test_identification.py", "tests/control/test_safety.py",
        "tests/machine/test_mtconnect.py", "tests/report/test_export.py", "tests/report/test_fit_page.py",
        "tests/structure/test_modal_fit.py", "tests/sweep/test_sweep.py", "tests/web/test_access.py",
    ),
    "geometry": (
        "tests/bad/test_bad_contours.py", "tests/bad/test_bad_drawings.py", "tests/bad/test_bad_faces.py",
        "tests/bad/test_bad_files.py", "tests/cli/test_check_model.py", "tests/cli/test_init_freecad.py",
        "tests/jobs/test_impeller_part.py", "tests/test_cad_kernel.py",
    ),
    # not tests/results, which runs every example
    "jobs": (
        "tests/bad/test_bad_impellers.py", "tests/bad/test_bad_jobs.py", "tests/bad/test_bad_walls.py", "tests/cli",
        "tests/report/test_fit_page.py",
    ),
    "planning": (
        "tests/cli/test_impeller*.py", "tests/jobs/test_finish_*.py", "tests/jobs/test_part_contours.py",
        "tests/jobs/test_pocket_*.py", "tests/jobs/test_stock_levels.py",
    ),
    TOP: (
        "tests/bad/test_bad_ends.py", "tests/bad/test_bad_files.py", "tests/bad/test_bad_output.py",
        "tests/cli/test_progress.py", "tests/cli/test_refused_options.py", "tests/test_errors.py",
        "tests/test_memory.py", "tests/test_workers.py",
    ),
}  # fmt: skip
Counts = dict[str, tuple[int, float]]


def counts(data: Path) -> Counts:
    """Statements and how many of them were run, by package, from a report of `coverage json`."""
    found: Counts = defaultdict(lambda: (0, 0))
    for name, file in json.loads(data.read_text("utf-8"))["files"].items():
        parts = name.removeprefix(SOURCE).split("/")
        # a capability of jobs/ and a planner are packages of their own
        package = "/".join(parts[: min(len(parts) - 1, 2 if parts[0] in ("jobs", "planning") else 1)]) or TOP
        statements, run = found[package]
        summary = file["summary"]
        found[package] = statements + summary["num_statements"], run + summary["covered_lines"]
    return dict(found)


def packages() -> list[str]:
    """Packages that have statements and tests of their own, and the modules beside them."""
    folders = sorted(p.parent.name for p in (ROOT / SOURCE).glob("*/__init__.py"))
    return [*(name for name in folders if any(map(Path.exists, tests_of(name)))), TOP]


def tests_of(package: str) -> list[Path]:
    """Files and folders of tests that are those of a package, its examples in docstrings with them."""
    named = [] if package == TOP else [f"tests/{package}"]
    return [path for name in (*named, *MORE.get(package, ())) for path in sorted(ROOT.glob(name))]


def own_counts(package: str, workers: int, missing: bool = False) -> Counts:
    """The statements of a package, and how many of them its own tests run.

    ``missing`` prints the lines that they do not run.

    Raises
    ------
    SystemExit
        A test fails, or the run has no data.
    """
    source = ROOT / SOURCE / ("" if package == TOP else package)
    doctests = sorted(p for p in source.glob("*.py") if p.stem != "__main__") if package == TOP else [source]
    with tempfile.TemporaryDirectory() as folder:
        env = os.environ | {"COVERAGE_FILE": str(Path(folder) / "data"), "OPENBLAS_NUM_THREADS": "1"}
        env["PYTHONPATH"] = os.pathsep.join([str(Path(__file__).parent), *filter(None, [env.get("PYTHONPATH")])])
        words = [sys.executable, "-m", "coverage"]
        traced = [f"--source={source}"] + ([f"--omit={source}/*/*"] if package == TOP else [])
        tests = ["-m", "pytest", "-q", "-p", "no:cacheprovider", "-p", Path(__file__).stem]
        tests += ["-n", str(workers), "--dist", "worksteal"] if workers > 1 else []
        paths = [str(p) for p in (*tests_of(package), *doctests)]
        words_of_run = [*words, "run", *traced, *tests, *paths]
        done = subprocess.run(words_of_run, cwd=ROOT, env=env, stdout=sys.stderr, check=False)
        if done.returncode:
            raise SystemExit(f"{package}: its tests end with {done.returncode}: nothing is stated for it")
        report = Path(folder) / "coverage.json"
        for more in (("combine", "--quiet"), ("json", "--quiet", "-o", str(report))):
            subprocess.run([*words, *more], cwd=ROOT, env=env, check=True)
        if missing:
            subprocess.run([*words, "report", "-m", "--skip-covered"], cwd=ROOT, env=env, check=True)
        return {name: n for name, n in counts(report).items() if name.split("/")[0] == package}


def pytest_configure() -> None:
    """Let a process of the CAD kernel end by itself, so that it leaves its data; users' runs end it by SIGKILL.

    This file is a plugin of the tests that :func:`own_counts` runs.
    """
    from chipload.geometry import isolated

    kill = isolated._kill

    def end(process: subprocess.Popen[bytes]) -> None:
        with contextlib.suppress(OSError, AttributeError, subprocess.TimeoutExpired):
            process.stdin.close()
            process.wait(10.0)
        kill(process)

    isolated._kill = end


def all_counts() -> Counts:
    """The counts of `make coverage`."""
    coverage = [sys.executable, "-m", "coverage"]
    with tempfile.TemporaryDirectory() as folder:
        data = Path(folder) / "coverage.json"
        if any(ROOT.glob(".coverage.*")):
            subprocess.run([*coverage, "combine", "--quiet"], cwd=ROOT, check=True)
        subprocess.run([*coverage, "json", "--quiet", "-o", str(data)], cwd=ROOT, check=True)
        return counts(data)


def table(found: Counts) -> str:
    """One row for each package, in Markdown.

    >>> print(table({"stock": (200, 150), "units": (0, 0)}))
    | package | statements | run by the tests [%] |
    |---|---:|---:|
    | stock | 200 | 75 |
    | all | 200 | 75 |
    """
    rows = ["| package | statements | run by the tests [%] |", "|---|---:|---:|"]
    whole = [sum(column) for column in zip(*found.values(), strict=True)]
    for package, (statements, run) in (*sorted(found.items()), ("all", (whole[0], whole[1]))):
        if statements:
            rows.append(f"| {package} | {statements} | {100.0 * run / statements:.0f} |")
    return "\n".join(rows)


def stated(page: str) -> Counts:
    r"""The counts of the first table below the heading, those that were run as exact as the table: to half a percent.

    >>> stated("## Test coverage\n\n| package | a | b |\n|---|---:|---:|\n| stock | 200 | 75 |\n| all | 9 | 75 |\n")
    {'stock': (200, 150.0)}
    """
    rows = re.search(r"(?:^\|.*\n)+", page.split(f"{HEADING}\n", 1)[1], re.MULTILINE)
    found = re.findall(r"^\| (\S+) \| (\d+) \| (\d+) \|$", rows[0] if rows else "", re.MULTILINE)
    return {name: (int(n), int(n) * int(share) / 100.0) for name, n, share in found if name != "all"}


def with_table(page: str, rows: str) -> str:
    r"""A page whose first table below the heading is another.

    >>> with_table("## Test coverage\n\ntext\n\n| a |\n|---|\n| 1 |\n\n## Next\n", "| b |\n|---|\n| 2 |")
    '## Test coverage\n\ntext\n\n| b |\n|---|\n| 2 |\n\n## Next\n'
    """
    before, after = page.split(f"{HEADING}\n", 1)
    changed, count = re.subn(r"(?:^\|.*\n)+", lambda _: f"{rows}\n", after, count=1, flags=re.MULTILINE)
    if not count:
        raise SystemExit(f"{PAGE.name}: no table below {HEADING!r}")
    return f"{before}{HEADING}\n{changed}"


def main() -> int:
    """Measure, and print or write the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--own", nargs="*", metavar="PACKAGE", help="run the own tests of these packages; none: of all")
    parser.add_argument("--workers", type=int, default=2, help="processes that run tests")
    parser.add_argument("--missing", action="store_true", help="with --own: print the lines that were not run")
    parser.add_argument("--write", action="store_true", help=f"put the table into {PAGE.relative_to(ROOT)}")
    given = parser.parse_args()
    if given.own is None:
        found = all_counts()
    else:
        if unknown := sorted(set(given.own) - set(packages())):
            parser.error(f"{', '.join(unknown)}: no package with tests of its own; there are: {', '.join(packages())}")
        found = {}
        for package in given.own or packages():
            found |= own_counts(package, given.workers, given.missing)
    print(table(found))
    if given.write:
        page = PAGE.read_text("utf-8")
        others = stated(page) if given.own else {}
        PAGE.write_text(with_table(page, table(others | found)), "utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
