"""Run real files of other people and write their verdicts and times into docs/real_programs.md.

    CHIPLOAD_DATA=... python tools/real_programs.py [NAME ...] [--limit-s 600] [--again] [--kept DIR]

``chipload init`` drafts a job of each file of :data:`FILES`; ``chipload check`` estimates its run; ``chipload run
--accept`` runs it, the shortest first, in a process of its own. What a file does not state is guessed.
A file that takes more processor time than the limit, or that is refused, is recorded as such; a
simulation that was stopped, or that the system ended, goes on from its checkpoint the next time. Files that have a
verdict on the page are not run again unless ``--again`` asks for it. Times are processor times of a file, all its parts
together.
"""

from __future__ import annotations

import argparse
import math
import os
import re
import resource
import shutil
import signal
import subprocess
import sys
import textwrap
from pathlib import Path

#: where jobs, checkpoints and processor times are kept between two calls
KEPT = Path(__file__).parents[1] / ".real"
#: [s] of a unit of an estimate
UNITS_S = {"s": 1.0, "min": 60.0, "h": 3600.0}
#: characters of a reason
LONGEST_REASON = 240
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
    **{
        f"cad/dxf_hsm_nibbler/{name}.dxf": "drawing"
        for name in ("square_circle", "square2", "taper", "thrash", "test_polyline", "missing_arc", "triceratops")
    },
    **{f"cad/dxf_hsm_nibbler/{name}.dxf": "drawing" for name in ("text_at", "text_&", "involute", "slots")},
    "cad/dxf_camotics/locket/seahorse.dxf": "drawing",
    "cad/dxf_camotics/pattern.dxf": "drawing",
    "cad/nist_step/nist_ftc_11_asme1_rb.stp": "model",
    "cad/nist_step/nist_ctc_01_asme1_ap203.stp": "model",
    "machines_tools/better_tool_library/Shape/slittingsaw.fcstd": "FreeCAD document",
}
#: what stands for a verdict where there is none
NOT_RUN, STOPPED, REFUSED, FAILED = "not run", "not finished", "refused", "failed"
HEAD = """# Real programs, run whole

This page shows what chipload makes of whole files of other people, for users who want to know how far their own files
will lead. `chipload init FILE DIR` drafts a job for each file, and `chipload run DIR/job.toml --accept` runs it from
beginning to end. What a file does not state (cutter, stock, machine) is guessed. What rests on a guess neither
holds nor exceeds: it is unproven until the guess is confirmed.

`make real` runs all files that have no verdict, the shortest first by the estimate of `chipload check`, and writes this
page. A stopped file continues where it was. Times are processor times. They include the compilation of kernels where a
run was the first. A row with *{not_run}* waits for the next `make real`, and states the longest time that its run may
take by the estimate.

| file | kind | verdict | first reason | time [s] |
|---|---|---|---|---:|
"""


def rows_of(page: str) -> dict[str, str]:
    """The row of each file that the page has."""
    return {m[1]: m[0] for m in re.finditer(r"^\| `([^`]+)` \|.*$", page, re.MULTILINE)}


def row(name: str, kind: str, verdict: str, reason: str, seconds: float | None) -> str:
    """A row of the table; bars would end a cell."""
    time = "" if seconds is None else f"{seconds:.0f}"
    told = textwrap.shorten(reason.replace("|", "/"), LONGEST_REASON, placeholder=" ...")
    return f"| `{name}` | {kind} | {verdict} | {told} | {time} |"


def timed(words: list[str], limit_s: float | None = None) -> tuple[int | None, str, str, float]:
    """Exit code (None: stopped at the limit of processor time), the two texts and the processor time [s] of a command.

    The system ends the process at the limit; its checkpoint is there.
    """
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    line = [sys.executable, "-m", "chipload", *words]
    with subprocess.Popen(line, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        if limit_s is not None:
            resource.prlimit(process.pid, resource.RLIMIT_CPU, (math.ceil(limit_s), resource.RLIM_INFINITY))
        out, err = process.communicate()
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    code = None if process.returncode == -signal.SIGXCPU else process.returncode
    return code, out, err, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def drafted(file: Path, folder: Path) -> tuple[float, str]:
    """Draft the job of a file, unless it is there; the longest that its run may take [s], and why there is no job."""
    job = folder / "job" / "job.toml"
    if not job.is_file():
        code, _, err, _ = timed(["init", str(file), str(job.parent)])
        if code:
            return 0.0, read(code, "", err)[1]
    return estimated(timed(["check", str(job)])[1]), ""


def estimated(out: str) -> float:
    """The longest time [s] of the estimate of ``chipload check``; without one it is a plan, which comes last."""
    found = re.search(r"^estimate: .* to ([0-9.]+) (s|min|h)\b", out, re.MULTILINE)
    return float(found[1]) * UNITS_S[found[2]] if found else math.inf


def run(folder: Path, limit_s: float) -> tuple[str, str, float]:
    """Verdict, first reason and processor time [s] of the job in a folder, that of earlier calls included."""
    spent = folder / "seconds.txt"
    earlier = float(spent.read_text()) if spent.is_file() else 0.0
    code, out, err, seconds = timed(
        ["run", str(folder / "job" / "job.toml"), "--accept", "--out", str(folder / "result")], limit_s
    )
    folder.mkdir(parents=True, exist_ok=True)
    spent.write_text(f"{earlier + seconds:.1f}")
    if code is None or code < 0:
        why = f"stopped after {limit_s:g} s" if code is None else f"ended by {signal.Signals(-code).name}"
        return STOPPED, f"{why}{share(err)}; goes on in the next run", earlier + seconds
    return *read(code, out, err), earlier + seconds


def share(err: str) -> str:
    """How far a run came, by the last line of its progress; empty: it tells none."""
    found = re.findall(r"(\d+) %", err)
    return f" at {found[-1]} %" if found else ""


def read(code: int, out: str, err: str) -> tuple[str, str]:
    """Verdict and first reason from the exit code and the two texts of a run that ended."""
    for line in out.splitlines():
        if found := re.match(r"(Holds|Unproven|Exceeds): (.*)", line):
            return found[1].lower(), found[2].strip()
    reasons = [line.removeprefix("chipload: ") for line in err.splitlines() if line.strip()]
    return (REFUSED if code == 2 else FAILED), reasons[-1] if reasons else f"exit code {code}"


def main(arguments: list[str] | None = None) -> None:
    """Run the files and write the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", help="parts of the names of the files; none: all")
    parser.add_argument("--limit-s", type=float, default=600.0, help="processor time of a call, for each file")
    parser.add_argument("--again", action="store_true", help="run files that have a verdict too")
    parser.add_argument("--kept", type=Path, default=KEPT, help="folder for jobs and checkpoints")
    chosen = parser.parse_args(arguments)
    data = os.environ.get("CHIPLOAD_DATA")
    if not data:
        sys.exit("CHIPLOAD_DATA is not set: state the folder of the real files")
    page = rows_of(PAGE.read_text(encoding="utf-8")) if PAGE.exists() else {}
    waiting: list[tuple[float, str]] = []
    for name in FILES:
        if chosen.names and not any(part in name for part in chosen.names):
            continue
        if finished(page.get(name, "")) and not chosen.again:
            continue
        if not (Path(data) / name).exists():
            print(f"{name}: is not in {data}")
            continue
        if chosen.again:  # drafts too may have become others
            shutil.rmtree(folder_of(chosen.kept, name), ignore_errors=True)
        most, why = drafted(Path(data) / name, folder_of(chosen.kept, name))
        if why:
            write({name: row(name, FILES[name], REFUSED, why, None)})
            continue
        waiting.append((most, name))
    for most, name in sorted(waiting):
        length = (
            f"at most {most:.0f} s by the estimate" if math.isfinite(most) else "a plan, whose time is not estimated"
        )
        print(f"{name}: {length}", flush=True)
        if not finished(page.get(name, "")):
            write({name: row(name, FILES[name], NOT_RUN, length, None)})
    for _, name in sorted(waiting):
        found = row(name, FILES[name], *run(folder_of(chosen.kept, name), chosen.limit_s))
        print(found, flush=True)
        write({name: found})


def folder_of(kept: Path, name: str) -> Path:
    """The folder of a file."""
    return kept / re.sub(r"[^A-Za-z0-9]+", "-", name)


def finished(text: str) -> bool:
    """Whether a row of the page has a verdict."""
    cells = [cell.strip() for cell in text.split("|")]
    return len(cells) > 3 and cells[3] in ("holds", "unproven", "exceeds")


def write(new: dict[str, str]) -> None:
    """The page with new rows."""
    page = PAGE.read_text(encoding="utf-8") if PAGE.exists() else ""
    rows, other = rows_of(page) | new, page[page.find("\n## ") :] if "\n## " in page else ""
    lines = [rows.get(name, row(name, kind, NOT_RUN, "", None)) for name, kind in FILES.items()]
    PAGE.write_text(HEAD.format(not_run=NOT_RUN) + "\n".join(lines) + "\n" + other, encoding="utf-8")


if __name__ == "__main__":
    main()
