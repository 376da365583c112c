"""Write every number, console output and picture of README.md and of the pages of docs/ that the shipped examples give.

    python tools/figures.py [NAME ...] [--results FOLDER] [--numbers]       or: make figures

Each job of ``tools/page_values.py`` is run at its own settings (NAME: these alone; a job that takes many minutes only
where it is named). From the results it writes ``docs/figures/values.toml``, the marked numbers of the pages, the output
that the tutorials show below their commands, and the pictures. ``--numbers`` leaves the pictures out. ``--results``
keeps the results in a folder; a result that is there already is not run again.

Look at the differences, and at the pictures, before they are committed.
"""

from __future__ import annotations

import argparse
import re
import shlex
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

from page_values import (
    EXAMPLES,
    PAGES,
    ROOT,
    SOURCES,
    fingerprint,
    numbered,
    read_values,
    values_of,
    write_values,
)

NUMBER = r"[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?"
TUTORIALS = ROOT / "docs" / "tutorials"


def run_job(name: str, results: Path) -> None:
    """Run a job of the examples into a folder of its name."""
    source, out = SOURCES[name], results / name
    if (out / "summary.json").exists():
        return
    for other, _ in source.files.values():
        run_job(other, results)
    words = [sys.executable, "-m", "chipload", "run", str(EXAMPLES / source.example / source.job), "--out", str(out)]
    words += [word for value in source.sets(results) for word in ("--set", value)]
    code = subprocess.run(words, check=False, stdout=subprocess.DEVNULL).returncode
    if code not in (0, 3):
        raise SystemExit(f"{name}: chipload run ended with exit code {code}")
    print(f"{name}: run", flush=True)


def renumbered(shown: str, line: str) -> str | None:
    """Return the shown beginning of a line of output with the numbers of the line; None: its words are different.

    >>> renumbered("force 483.4 of 1500 N", "force 490.1 of 1500 N, torque 2 N m")
    'force 490.1 of 1500 N'
    >>> renumbered("force 483.4 of 1500 N", "torque 3 of 6 N m")
    """
    parts = re.split(f"({NUMBER})", shown)
    pattern = "".join(f"({NUMBER})" if k % 2 else re.escape(part) for k, part in enumerate(parts))
    found = re.match(pattern, line)
    return None if found is None else found[0]


def with_output(text: str, output: Callable[[str], list[str]]) -> str:
    """Return a page whose console blocks show the output of their commands, as many lines as before.

    A line whose words changed is written whole.
    """

    def block(found: re.Match[str]) -> str:
        lines, made, k = list[str](), list[str](), 0
        for shown in found[1].splitlines():
            if shown.startswith("$ chipload "):
                made, k = output(shown.removeprefix("$ chipload ")), 0
                lines.append(shown)
                continue
            line = made[k] if k < len(made) else ""
            lines.append(renumbered(shown, line) or line)
            k += 1
        return "```console\n" + "".join(f"{line}\n" for line in lines) + "```"

    return re.sub(r"^```console\n(.*?)^```", block, text, flags=re.MULTILINE | re.DOTALL)


def chipload(command: str, folder: Path) -> list[str]:
    """Lines that a command prints."""
    words = [sys.executable, "-m", "chipload", *shlex.split(command)]
    return subprocess.run(words, cwd=folder, check=False, capture_output=True, text=True).stdout.splitlines()


def write_tutorials() -> None:
    """Run the commands of the tutorials and write their output."""
    for page in sorted(TUTORIALS.glob("*.md")):
        text = page.read_text(encoding="utf-8")
        if "```console" not in text:
            continue
        with tempfile.TemporaryDirectory() as folder:
            page.write_text(with_output(text, lambda c, f=Path(folder): chipload(c, f)), encoding="utf-8")  # type: ignore[misc]
        print(page.relative_to(ROOT), flush=True)


def write_pages() -> None:
    """Write the marked numbers of all pages."""
    values = read_values()
    for page in PAGES:
        text = page.read_text(encoding="utf-8")
        new = numbered(text, values)
        if new != text:
            page.write_text(new, encoding="utf-8")
            print(page.relative_to(ROOT), flush=True)


def write_pictures(names: list[str], results: Path) -> None:
    """Take the pictures of some jobs, draw the animation of the contour, and store what they were made from."""
    import animation
    import live_page
    from pictures import take

    values = read_values()
    shown = values.setdefault("pictures", {})
    for name in names:
        take(SOURCES[name].pictures, results)
        shown |= {picture: fingerprint(results / name, picture) for picture in SOURCES[name].pictures}
        if name == "contour":
            animation.write(results / name)
        if name == live_page.EXAMPLE:
            live_page.write(results / name)
    write_values({**values, "pictures": {p: shown[p] for s in SOURCES.values() for p in s.pictures if p in shown}})


def main() -> None:
    """Run the jobs and write pages and pictures."""
    parser = argparse.ArgumentParser(description="Write the numbers and the pictures of the pages from the examples.")
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"of {', '.join(SOURCES)}")
    parser.add_argument("--results", type=Path, metavar="FOLDER", help="keep the results, and use those that are there")
    parser.add_argument("--numbers", action="store_true", help="leave the pictures out")
    given = parser.parse_args()
    if unknown := sorted(set(given.names) - set(SOURCES)):
        parser.error(f"{', '.join(unknown)}: must be of {', '.join(SOURCES)}")
    names = given.names or [name for name, source in SOURCES.items() if not source.long]
    with tempfile.TemporaryDirectory() as folder:
        results = given.results or Path(folder)
        for name in names:
            run_job(name, results)
        write_values({**read_values(), **{name: values_of(name, results / name) for name in names}})
        write_pages()
        if not given.names:
            write_tutorials()
        if not given.numbers:
            write_pictures(names, results)
            if not given.names:
                import mechanics_pictures

                mechanics_pictures.write(list(mechanics_pictures.FIGURES))


if __name__ == "__main__":
    main()
