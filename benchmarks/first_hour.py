"""From twelve files of others to a verdict: `chipload init`, at most three edits, `chipload run --accept`.

    CHIPLOAD_DATA=... python benchmarks/first_hour.py [NAME ...] [--write]

`--write` renews the rows of docs/first_hour.md. An edit is one changed line of job.toml. Times are processor times.
"""

from __future__ import annotations

import json
import os
import re
import resource
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import NamedTuple

DATA = Path(os.environ.get("CHIPLOAD_DATA", Path(__file__).parents[1] / ".." / "shared" / "data"))
PAGE = Path(__file__).parents[1] / "docs" / "first_hour.md"
#: a run that takes longer by the clock is given up [s]
LONGEST_S = 3600.0


class Case(NamedTuple):
    """A file, what it is, and the edits: table and key, new value, why."""

    file: str
    kind: str
    edits: tuple[tuple[str, str, str], ...] = ()


CASES = (
    Case("nc/camotics/compass/text.camotics", "NC, CAMotics project"),
    Case(
        "nc/camotics/compass/compass.camotics", "NC, CAMotics project",
        (("cutter.0.diameter_mm", "3.175", "an engraving cutter, the file does not say"),),
    ),
    Case(
        "nc/linuxcnc_5axis/boat-xyzac.ngc", "NC, five axes",
        (("limits.force_n", "2500.0", "of this machine"), ("stock.high_mm", "[47.0, 23.0, 0.5]", "top of the block")),
    ),
    Case(
        "nc/camotics/compass/top.ngc", "NC",
        (("cutter.0.diameter_mm", "3.175", "an engraving cutter, the file does not say"),),
    ),
    Case("nc/apt_dmu50/apt/Guincho_Lbar.apt", "APT"),
    Case("nc/apt_dmu50/apt/Guincho_LLbar.apt", "APT"),
    Case("cad/dxf_hsm_nibbler/gear.dxf", "DXF"),
    Case("cad/dxf_hsm_nibbler/octagon.dxf", "DXF"),
    Case("cad/nist_step/nist_ftc_11_asme1_rb.stp", "STEP"),
    Case(
        "cad/nist_step/nist_ctc_01_asme1_ap203.stp", "STEP",
        (
            ("part.face_z_mm", "50.0", "face the boss"), ("stock.top_mm", "51.0", "of the boss"),
            ("operation.0.axial_depth_mm", "1.0", "one cut"), ("operation.0.depth_mm", "1.0", "above the boss"),
        ),
    ),
    Case("machines_tools/better_tool_library/Shape/slittingsaw.fcstd", "FreeCAD document"),
    Case(
        "blades/turbogrid_rotor37/profile.curve", "sections of a blade",
        (
            ("operation.0.scallop_um", "150.0", "rows far apart, for a first look"),
            ("wall.span", "[0.8, 1.0]", "the upper fifth, for a first look"),
        ),
    ),
)  # fmt: skip


def edited(text: str, key: str, value: str) -> str:
    """The job with one value changed; ``key`` is ``table.key`` or ``table.number.key``."""
    table, *number, name = key.split(".")
    heads = [m.start() for m in re.finditer(rf"^\[\[?{table}\]\]?", text, re.MULTILINE)]
    start = heads[int(number[0]) if number else 0]
    end = next((h.start() for h in re.finditer(r"^\[", text, re.MULTILINE) if h.start() > start), len(text))
    body, found = re.subn(rf"^(# )?{name} = .*$", f"{name} = {value}", text[start:end], count=1, flags=re.MULTILINE)
    if not found:
        head, _, rest = text[start:end].partition("\n")
        body = f"{head}\n{name} = {value}\n{rest}"
    return text[:start] + body + text[end:]


def run(case: Case, folder: Path) -> dict[str, object]:
    """Draft, edit, run; what came out."""
    job, result = folder / "job", folder / "result"
    command = [sys.executable, "-m", "chipload"]
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    made = subprocess.run([*command, "init", DATA / case.file, job], capture_output=True, text=True)
    if made.returncode:
        return {"verdict": f"init: {made.stderr.strip()[:200]}"}
    text = (job / "job.toml").read_text()
    guesses = text.count("# guess: ")
    for key, value, _ in case.edits:
        text = edited(text, key, value)
    (job / "job.toml").write_text(text)
    try:
        done = subprocess.run(
            [*command, "run", job / "job.toml", "--accept", "--out", result],
            capture_output=True, text=True, timeout=LONGEST_S,
        )  # fmt: skip
    except subprocess.TimeoutExpired:
        return {"verdict": f"given up after {LONGEST_S:g} s"}
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    seconds = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    if done.returncode not in (0, 3):
        return {"verdict": f"run {done.returncode}: {done.stderr.strip()[:300]}", "seconds": seconds}
    summary = json.loads((result / "summary.json").read_text())
    return {
        "verdict": summary["verdict"],
        "message": done.stdout.splitlines()[0],
        "seconds": seconds,
        "guesses": guesses,
    }


def written(page: str, rows: dict[str, str]) -> str:
    """The page with new rows, by name of the file, in the places of those with the same name."""
    for name, row in rows.items():
        page = re.sub(rf"^\| {re.escape(name)} \|.*$", lambda _, row=row: row, page, count=1, flags=re.MULTILINE)
    return page


def main() -> None:
    """Run the cases that are named, or all."""
    names = [a for a in sys.argv[1:] if not a.startswith("--")]
    rows = {}
    for case in CASES:
        if names and not any(n in case.file for n in names):
            continue
        with tempfile.TemporaryDirectory() as above:
            out = run(case, Path(above) / Path(case.file).stem)
        edits = "; ".join(f"`{k} = {v}`: {why}" for k, v, why in case.edits) or "none"
        told = str(out.get("message", out["verdict"])).replace("|", "/")
        seconds = f"{out['seconds']:.0f}" if "seconds" in out else ""
        name = Path(case.file).name
        rows[name] = f"| {name} | {case.kind} | {out.get('guesses', '')} | {edits} | {told} | {seconds} |"
        print(rows[name], flush=True)
    if "--write" in sys.argv:
        PAGE.write_text(written(PAGE.read_text(encoding="utf-8"), rows), encoding="utf-8")


if __name__ == "__main__":
    main()
