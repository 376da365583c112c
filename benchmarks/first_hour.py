"""From twelve files of others to a verdict: `chipload init`, at most three edits, `chipload run --accept`.

    CHIPLOAD_DATA=... python benchmarks/first_hour.py [NAME ...] [--write]

`--write` writes docs/first_hour.md. An edit is one changed line of job.toml. Times are processor times.
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
#: a run that takes longer is given up [s]
LONGEST_S = 900.0


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
            ("operation.0.axial_depth_mm", "1.0", "one cut"),
        ),
    ),
    Case("machines_tools/better_tool_library/Shape/slittingsaw.fcstd", "FreeCAD document"),
    Case(
        "blades/turbogrid_rotor37/profile.curve", "sections of a blade",
        (("operation.0.scallop_um", "400.0", "rows far apart, for a first look"),),
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


HEAD = """# The first hour

What a user has becomes a job by `chipload init FILE DIR`, and a verdict by `chipload run DIR/job.toml --out result`.
`init` writes what the file states and marks each guess; `run` refuses until each table with a guess is confirmed
(delete `confirm = true`), or takes all guesses by `--accept`. `chipload simulate FILE` does both for a first look; its
verdict is never better than unproven.

| FILE | what init takes from it | kind of job |
|---|---|---|
| NC text (`.ngc`, `.nc`, `.h` ...) | tools and stock of comments, BLK FORM, WORKPIECE; axes, dialect | simulation |
| APT CL data | CUTTER, tool lengths, stock size | simulation |
| CAMotics project | tools, workpiece, the program that it names | simulation |
| FreeCAD document | a CAM job: operations as a program, tool bits, stock; else the part | simulation; pocket or wall |
| DXF | closed contours, else open ones; layers, unit | pocket; contour |
| STEP | horizontal faces, else two curved faces | pocket; thin wall |
| sections of a blade | shape, numbered files beside it | thin wall |

## Tools, templates, export

A `[[cutter]]` names a tool of a library: `file = "library.json"`, `tool = 3`. What the file states need not be written;
what the job states stands above the file.

| file | made by | states |
|---|---|---|
| `.json`, `.tools` | Fusion 360, HSMWorks | sizes, corner, flutes, length, holder, material |
| `.p21` | tool makers, ISO 13399 | values with their symbol: DC, RE, APMX or LCF, DMM or DCONMS, FHA, ZEFF or NOF |
| `.fctb` | FreeCAD 0.20 and 1.x | diameter, flutes, edge height, shank, corner, stick-out |
| `.camotics` | CAMotics | shape, diameter, length |
| `.tbl` | LinuxCNC | diameter; `file_unit` is needed |

Drills and chamfer mills are read as cutters with a point or a taper. Thread mills, taps, T-slot and barrel cutters are
refused. `chipload init --material DIR` writes a commented template of a material file; likewise `--machine`,
`--catalogue` and `--fixture` (a block as STL).

`chipload export RESULT --out DIR` writes `history.csv` (a row a step, units in the names), the path of each track
with all its numbers for ParaView (`.vtp`), surface maps and the stock that is left (`.vtu`, `.stl`), and `setup.html`,
one page that a browser prints: verdict, program, tools, travel, limits, guesses. `--csv`, `--vtk` and `--sheet` choose.

`chipload run --coarse` takes steps eight times as long, layers four times as thick and wider tolerances. Its result is
never better than unproven and lists the keys that it changed.

## Twelve files of others

Made by `python benchmarks/first_hour.py --write`, processor time of `init` and `run` together. An edit is one changed
line of job.toml. A verdict rests on the guesses that were accepted; it shows that the way from the file to the result
is whole, not that these programs are right for a real workpiece.

| file | kind | guesses | edits | verdict | time [s] |
|---|---|---:|---|---|---:|
"""


TAIL = """
The first row holds the time in which kernels are compiled, once a computer. The pockets exceed limits of the check of
the plan: a gouge of 1.4 to 1.7 um against 1 um at the wall, or the engagement at single rows. Programs exceed by what
was guessed: the travel of a machine that no file names, a block whose zero or top no file states.
"""


def main() -> None:
    """Run the cases that are named, or all."""
    names = [a for a in sys.argv[1:] if not a.startswith("--")]
    rows = []
    for case in CASES:
        if names and not any(n in case.file for n in names):
            continue
        with tempfile.TemporaryDirectory() as above:
            out = run(case, Path(above) / Path(case.file).stem)
        edits = "; ".join(f"`{k} = {v}`: {why}" for k, v, why in case.edits) or "none"
        told = str(out["verdict"]) + (f": {out['message']}" if "message" in out else "")
        told = told.replace("|", "/")
        seconds = f"{out['seconds']:.0f}" if "seconds" in out else ""
        rows.append(
            f"| {Path(case.file).name} | {case.kind} | {out.get('guesses', '')} | {edits} | {told} | {seconds} |"
        )
        print(rows[-1], flush=True)
    if "--write" in sys.argv:
        PAGE.write_text(HEAD + "\n".join(rows) + "\n" + TAIL)


if __name__ == "__main__":
    main()
