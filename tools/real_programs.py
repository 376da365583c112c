"""Run real files of other people and write their verdicts and times into docs/real_programs.md.

    CHIPLOAD_DATA=... python tools/real_programs.py [NAME ...] [--limit-s 900]

``chipload simulate`` runs each file of :data:`FILES` in a process of its own: what a file does not state is guessed, so
that a verdict is never better than unproven. A file that takes longer than the limit, or that is refused, is recorded
as such. Rows of files that were not run this time stay as they are. Times are processor times.
"""

from __future__ import annotations

import argparse
import os
import re
import resource
import subprocess
import sys
from pathlib import Path

PAGE = Path(__file__).parents[1] / "docs" / "real_programs.md"
#: files below CHIPLOAD_DATA, and what they are
FILES = {
    "nc/camotics/compass/top.ngc": "engraving",
    "nc/camotics/compass/compass.camotics": "CAMotics project, engraving",
    "nc/camotics/compass/text.camotics": "CAMotics project, text",
    "nc/camotics/bear/bear.camotics": "CAMotics project, relief",
    "nc/camotics/wave/wave.camotics": "CAMotics project, surface",
    "nc/camotics/heart/heart.camotics": "CAMotics project",
    "nc/camotics/cat/cat.camotics": "CAMotics project",
    "nc/camotics/cameo/cameo.camotics": "CAMotics project",
    "nc/camotics/camotics/camotics.camotics": "CAMotics project",
    "nc/camotics/buildbotics/buildbotics.camotics": "CAMotics project",
    "nc/camotics/botomata_bottom/botomata_bottom.camotics": "CAMotics project",
    "nc/linuxcnc_5axis/boat-xyzac.ngc": "five axes",
    "nc/apt_dmu50/apt/Guincho_Lbar.apt": "APT",
    "nc/apt_dmu50/apt/Guincho_LLbar.apt": "APT",
    "cad/dxf_hsm_nibbler/gear.dxf": "drawing",
    "cad/dxf_hsm_nibbler/octagon.dxf": "drawing",
    "cad/nist_step/nist_ftc_11_asme1_rb.stp": "model",
    "cad/nist_step/nist_ctc_01_asme1_ap203.stp": "model",
    "machines_tools/better_tool_library/Shape/slittingsaw.fcstd": "FreeCAD document",
}
#: what stands for a verdict where there is none
NOT_RUN, TOO_LONG, REFUSED = "not run", "longer than {:g} s", "refused"
HEAD = """# Real programs, run whole

Files of other people, each run from its beginning to its end by `chipload simulate FILE`. What a file does not state
(cutter, stock, machine) is guessed, so that no verdict is better than `unproven`, and a gouge or a rapid through stock
may be that of a guessed stock. `make real` runs all of them and writes this page; times are processor times of one run,
the compiling of kernels included where a run was the first. A row with *{not_run}* waits for the next `make real`.

| file | kind | verdict | first reason | time [s] |
|---|---|---|---|---:|
"""


def rows_of(page: str) -> dict[str, str]:
    """The row of each file that the page has."""
    return {m[1]: m[0] for m in re.finditer(r"^\| `([^`]+)` \|.*$", page, re.MULTILINE)}


def row(name: str, kind: str, verdict: str, reason: str, seconds: float | None) -> str:
    """A row of the table; bars would end a cell."""
    time = "" if seconds is None else f"{seconds:.0f}"
    return f"| `{name}` | {kind} | {verdict} | {reason.replace('|', '/')[:160]} | {time} |"


def run(file: Path, limit_s: float) -> tuple[str, str, float]:
    """Verdict, first reason and processor time [s] of a file."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    try:
        done = subprocess.run(
            [sys.executable, "-m", "chipload", "simulate", str(file)], capture_output=True, text=True, timeout=limit_s
        )
        verdict, reason = read(done.returncode, done.stdout, done.stderr)
    except subprocess.TimeoutExpired:
        verdict, reason = TOO_LONG.format(limit_s), ""
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return verdict, reason, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def read(code: int, out: str, err: str) -> tuple[str, str]:
    """Verdict and first reason from the exit code and the two texts of a run."""
    for line in out.splitlines():
        if found := re.match(r"(Holds|Unproven|Exceeds): (.*)", line):
            return found[1].lower(), found[2].strip()
    reasons = [line.removeprefix("chipload: ") for line in err.splitlines() if line.strip()]
    return (REFUSED if code == 2 else f"exit code {code}"), reasons[-1] if reasons else ""


def main(arguments: list[str] | None = None) -> None:
    """Run the files and write the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", help="parts of the names of the files; none: all")
    parser.add_argument("--limit-s", type=float, default=900.0, help="by the clock, for each file")
    chosen = parser.parse_args(arguments)
    data = os.environ.get("CHIPLOAD_DATA")
    if not data:
        sys.exit("CHIPLOAD_DATA is not set: state the folder of the real files")
    for name, kind in FILES.items():
        if chosen.names and not any(part in name for part in chosen.names):
            continue
        if not (Path(data) / name).exists():
            print(f"{name}: is not in {data}")
            continue
        found = row(name, kind, *run(Path(data) / name, chosen.limit_s))
        print(found, flush=True)
        write({name: found})


def write(new: dict[str, str]) -> None:
    """The page with new rows."""
    rows = (rows_of(PAGE.read_text(encoding="utf-8")) if PAGE.exists() else {}) | new
    lines = [rows.get(name, row(name, kind, NOT_RUN, "", None)) for name, kind in FILES.items()]
    PAGE.write_text(HEAD.format(not_run=NOT_RUN) + "\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
