"""What a shop sees the first time: each program of a folder is drafted and run as it is, with nothing stated.

    python benchmarks/first_time.py FOLDER [--seconds 60] [--saving] [--drafts] [--every 1]

For each program: read (drafted), tools whose size a comment states and that the draft has from it, questions asked,
verdict of the job with its guesses, seconds of processor time from the file to the verdict, which ``--seconds`` bounds,
so that other work on the machine does not count. One without a verdict in that time is run again with ``--coarse``, in
as much time, as the page does first: its verdict begins with "coarse". With ``--saving`` the times before and after the
feeds are chosen, and the verdict of the new ones; with ``--drafts`` nothing is run; with ``--every 8`` one program of
eight is taken. The last lines are the shares of all programs but those that move nothing by themselves: subprograms
whose parameters come from the controller, and texts that only set offsets.
Files in folders named ``bad`` are to be refused and left out.
"""

from __future__ import annotations

import argparse
import json
import math
import re
import resource
import signal
import subprocess
import sys
import tempfile
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

#: endings of programs
ENDINGS = (".nc", ".ngc", ".h", ".mpf", ".apt", ".gcode", ".tap", ".cnc", ".eia", ".min", ".camotics", ".i", ".txt")
#: words of a comment about a tool, and a number that may be its size; not the reader of the product
_TOOL = re.compile(r"(?i)mill|drill|\btap\b|ream|\bball|fräs|bohrer|\bD=[0-9.]|\bdia\b")
_COMMENT = re.compile(r"\(([^\n]*)\)|;([^\n]*)")
_NUMBERED = re.compile(r"(?i)^\W{0,3}(?:TOOL\s*[-#:]?\s*T?|T|#)\s*(?P<tool>[0-9]{1,4})\b(?P<rest>.*[0-9].*)$")
FEEDS = "[operation.feeds]\nslowest_percent = 50.0\nfastest_percent = 200.0\n\n"


@dataclass
class Row:
    """What came out of a program."""

    name: str
    read: bool = False
    verdict: str = ""
    named: int = 0
    sized: int = 0
    questions: int = 0
    seconds: float = 0.0
    saving: str = ""


def programs(folder: Path) -> Iterator[Path]:
    """Programs of a folder, but for those that are to be refused."""
    for path in sorted(folder.rglob("*")):
        if path.suffix.lower() in ENDINGS and path.is_file() and "bad" not in path.parts:
            yield path


def named_tools(path: Path) -> set[int]:
    """Numbers of tools that a comment names with a size."""
    out = set[int]()
    for hit in _COMMENT.finditer(path.read_text(encoding="latin-1")):
        found = _NUMBERED.match(hit[1] if hit[1] is not None else hit[2])
        if found is not None and _TOOL.search(found["rest"]):
            out.add(int(found["tool"]))
    return out


def called(words: list[str], seconds: float) -> tuple[int, str, str, float]:
    """Exit code, output, errors and processor time [s] of a command; 124: it takes longer than a time."""
    most = math.ceil(max(seconds, 1.0))

    def bound() -> None:
        resource.setrlimit(resource.RLIMIT_CPU, (most, most))

    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run(
        [sys.executable, "-m", "chipload", *words], capture_output=True, text=True, preexec_fn=bound, check=False
    )
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    own = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    code = 124 if done.returncode in (-signal.SIGKILL, -signal.SIGXCPU) else done.returncode
    return code, done.stdout, done.stderr, own


def first_time(path: Path, folder: Path, seconds: float, saving: bool, drafts: bool = False) -> Row:
    """Draft and run a program."""
    row = Row(str(path.name))
    code, out, error, row.seconds = called(["init", str(path), str(folder / "job")], seconds)
    if code != 0:
        row.verdict = error.strip().splitlines()[-1][:110] if error.strip() else f"exit code {code}"
        return row
    row.read, row.questions = True, out.count("\nquestion: ")
    text = (folder / "job" / "job.toml").read_text()
    job = tomllib.loads(text)
    named = named_tools(path)
    guessed = {
        int(part.split("number = ")[1].split()[0])
        for part in text.split("[[cutter]]")[1:]
        if re.search(r"^diameter_mm = .*# guess", part, re.MULTILINE)
    }
    own = {c["number"] for c in job.get("cutter", [])} & named
    row.named, row.sized = len(own), len(own - guessed)
    if drafts:
        return row
    words = ["run", str(folder / "job" / "job.toml"), "--accept", "--out", str(folder / "r")]
    code, out, error, own = called(words, seconds - row.seconds)
    row.seconds += own
    if code == 124:
        code, out, error, row.seconds = called([*words, "--coarse", "--fresh"], seconds)
        row.verdict = "no verdict in time" if code == 124 else f"coarse: {out.splitlines()[0][:100]}" if out else error
        return row
    if code not in (0, 3):
        row.verdict = f"run: {error.strip()[:100]}"
        return row
    row.verdict = out.splitlines()[0][:110]
    if saving:
        (folder / "job" / "job.toml").write_text(text.replace("[limits]", f"{FEEDS}[limits]"))
        words = ["run", str(folder / "job" / "job.toml"), "--accept", "--out", str(folder / "feeds")]
        if called(words, seconds - row.seconds)[0] in (0, 3):
            tracks = json.loads((folder / "feeds" / "summary.json").read_text())["tracks"]
            if len(tracks) > 1:
                after, before = tracks[:2]
                row.saving = f"{before['time_s']:.1f} -> {after['time_s']:.1f} s, {after['verdict']}"
    return row


def main() -> None:
    """Print a row for each program, then the shares."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("folder", type=Path)
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--saving", action="store_true")
    parser.add_argument("--drafts", action="store_true")
    parser.add_argument("--every", type=int, default=1)
    options = parser.parse_args()
    rows = []
    print("| program | read | tools by comment | questions | verdict | s | saving |\n|---|---|---|---:|---|---:|---|")
    for path in list(programs(options.folder))[:: options.every]:
        with tempfile.TemporaryDirectory() as above:
            row = first_time(path, Path(above), options.seconds, options.saving, options.drafts)
        rows.append(row)
        tools = f"{row.sized} of {row.named}" if row.named else ""
        verdict = row.verdict.replace("|", "/")
        read = "yes" if row.read else "no"
        print(
            f"| {row.name} | {read} | {tools} | {row.questions} | {verdict} | {row.seconds:.1f} | {row.saving} |",
            flush=True,
        )
    still = [row for row in rows if "no motion" in row.verdict]
    rows = [row for row in rows if row not in still]
    drafted = sum(row.read for row in rows)
    verdicts = sum(row.verdict.startswith(("Holds", "Exceeds", "Unproven")) for row in rows)
    coarse = sum(row.verdict.startswith("coarse") for row in rows)
    sized, named = sum(row.sized for row in rows), sum(row.named for row in rows)
    print(f"\nmove nothing by themselves: {len(still)}")
    print(f"drafted: {drafted} of {len(rows)}; with a verdict in {options.seconds:g} s: {verdicts}")
    print(f"of the others with a coarse one: {coarse}")
    print(f"tools that a comment states: {sized} of {named} read")
    print(f"most questions: {max((row.questions for row in rows), default=0)}")


if __name__ == "__main__":
    main()
