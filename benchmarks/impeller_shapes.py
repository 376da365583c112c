"""Impellers of others from file to verified programs: what was planned, time, verdict, or the line that refuses it.

    CHIPLOAD_DATA=FOLDER python benchmarks/impeller_shapes.py [NAME ...] [--out FOLDER] [--workers N]

prints a row for each shape: ``kj66`` (STEP), ``pyturbo`` (a table of all sections), ``rotor`` (STEP of T-Blade3), and
``hecc`` where it is named: the example with fillets of 2.5 mm and programs for all ten surfaces, one cutter, scallop
0.1 mm. Results with their report are written to ``--out``. FOLDER of CHIPLOAD_DATA holds the files of others. With
``--workers`` the time of their processes is counted too.
"""

from __future__ import annotations

import argparse
import multiprocessing
import os
import re
import shutil
import tempfile
from dataclasses import dataclass
from pathlib import Path

from chipload.errors import ChiploadError
from chipload.examples import copy_example
from chipload.jobs import load_job, run_job
from chipload.result import Verdict
from chipload.workers import Workers

DATA = Path(os.environ.get("CHIPLOAD_DATA", Path(__file__).parents[1].parent / "shared" / "data"))

CUTTERS = """name = "{name}"
note = "Assumed."
cutter = [
{cutters}
]
"""
OPERATION = """
[catalogue]
file = "cutters.toml"

[machine]
name = "horizontal-b"

[[operation]]
kind = "impeller"
check_mm = 1.5
tolerance_mm = {tolerance:g}
near_mm = 1.0
clearance_mm = 0.2
scallop_mm = 0.1
feed_mm_min = 300.0
speed_rpm = 8000.0
most_cutters = 1
cutter_change_s = 60.0
table_change_s = 300.0

[operation.paths]
check_mm = 0.5
chord_mm = {small:g}
overrun_mm = 0.5
lift_mm = 2.0
lead_mm = 1.0
margin_mm = 0.1
touch_mm = {small:g}
near_mm = 4.0
above_mm = 5.0
link_feed_mm_min = 1200.0
gouge_mm = {gouge:g}
"""
HECC_PATHS = """
[operation.paths]
check_mm = 1.0
chord_mm = 0.05
overrun_mm = 1.0
lift_mm = 3.0
lead_mm = 1.0
margin_mm = 0.1
touch_mm = 0.02
near_mm = 6.0
above_mm = 5.0
link_feed_mm_min = 3000.0
gouge_mm = 0.1
"""


@dataclass(frozen=True)
class Shape:
    """An impeller of others: its file, the part of a job, where it is milled (side, along, up), its cutters (D, r),
    the gouge that is allowed, the
    tolerance between check points [mm].
    """

    title: str
    file: str
    part: str
    surfaces: tuple[tuple[str, tuple[float, float], tuple[float, float]], ...]
    cutters: tuple[tuple[float, float], ...]
    gouge: float = 0.1
    tolerance: float = 0.1


SHAPES = {
    "kj66": Shape(
        "KJ66, STEP by others", "cad/impeller_kj66/impeller.step",
        '[impeller]\nblades = 9\nouter_diameter_mm = 100.2\n\n[impeller.step]\nfile = "FILE"\nflow = "-y"\nplus = 3\n'
        "minus = 1\nhub = [88]\nshroud = [7, 2, 9]\nfit_mm = 0.02\nhub_ahead_mm = 0.0\n",
        (("plus", (0.1, 0.9), (0.3, 0.9)), ("minus", (0.1, 0.9), (0.3, 0.9))),
        ((3.0, 1.0), (4.0, 1.0), (5.0, 1.0), (6.0, 1.0)),
    ),
    "pyturbo": Shape(
        "pyturbo-aero, radial, table of all sections",
        "blades/pyturbo_radial/centrif_compressor_mainblade_xyz_pts.csv",
        "[impeller]\nblades = 7\nouter_diameter_mm = 135.6\n\n[impeller.sections]\nblade = [\"FILE\"]\nhub = \"FILE\"\n"
        'shroud = "FILE"\nunit = "m"\nflow_along_x = true\nhub_ahead_mm = 0.0\n',
        (("plus", (0.1, 0.9), (0.2, 0.9)), ("minus", (0.1, 0.9), (0.2, 0.9))),
        ((2.0, 0.5), (3.0, 0.5), (4.0, 0.5), (6.0, 0.5)),
    ),
    "rotor": Shape(
        "T-Blade3's transonic rotor, STEP", "cad/tblade3_rotor/Case_7-28-8_Rotor.step",
        '[impeller]\nblades = 16\nouter_diameter_mm = 302.4\n\n[impeller.step]\nfile = "FILE"\nflow = "+x"\nplus = 1\n'
        "minus = 2\nhub = [3]\nshroud = [4]\nhub_ahead_mm = 0.0\n",
        (("plus", (0.1, 0.9), (0.4, 0.95)),),
        ((6.0, 1.0), (8.0, 1.0), (12.0, 1.0)), 0.02, 0.015,
    ),
}  # fmt: skip


def job_of(shape: Shape, folder: Path) -> Path:
    """The job file of a shape, its file and its cutters beside it."""
    name = Path(shape.file).name
    shutil.copyfile(DATA / shape.file, folder / name)
    rows = [
        f"  {{ diameter_mm = {d}, corner_radius_mm = {r}, cutting_length_mm = {3.0 * d}, "
        f"neck_diameter_mm = {d - 0.2:.3g}, neck_length_mm = 38.0, "
        "shank_diameter_mm = 6.0, reach_mm = 50.0, holder_diameter_mm = 22.0 },"
        if d < 6.0
        else f"  {{ diameter_mm = {d}, corner_radius_mm = {r} }},"
        for d, r in shape.cutters
    ]
    (folder / "cutters.toml").write_text(CUTTERS.format(name="assumed", cutters="\n".join(rows)))
    surfaces = [
        f'\n[[surface]]\nbody = "blade"\nside = "{side}"\nalong = {list(along)}\nup = {list(up)}\npoints = [8, 4]\n'
        for side, along, up in shape.surfaces
    ]
    (folder / "job.toml").write_text(
        shape.part.replace("FILE", name)
        + "".join(surfaces)
        + OPERATION.format(gouge=shape.gouge, tolerance=shape.tolerance, small=0.2 * shape.gouge)
    )
    return folder / "job.toml"


def hecc_job(folder: Path) -> Path:
    """The example `hecc` with fillets and programs: sides, floors and fillets of blade and splitter."""
    path = copy_example("hecc", folder / "hecc") / "job.toml"
    text = re.sub(r"^hand_picked.*\n", "", path.read_text(), flags=re.MULTILINE)
    for key, value in (("most_cutters", "1"), ("scallop_mm", "0.1")):
        text = re.sub(rf"^{key} = .*$", f"{key} = {value}", text, flags=re.MULTILINE)
    text = text.replace("outer_diameter_mm = 431.5\n", "outer_diameter_mm = 431.5\nfillet_mm = 2.5\n")
    text = text.replace("up = [0.2, 0.98]", "up = [0.02, 0.98]").replace("up = [0.15, 0.85]", "up = [0.05, 0.95]")
    fillets = [
        f'[[surface]]\nbody = "{body}"\nside = "{side} fillet"\nalong = [0.05, 0.95]\nup = [0.1, 0.9]\n'
        "points = [16, 3]\n\n"
        for body in ("blade", "splitter")
        for side in ("plus", "minus")
    ]
    text = text.replace("[[operation]]", "".join(fillets) + "[[operation]]")
    path.write_text(text + HECC_PATHS)
    return path


def cpu_s() -> float:
    """Processor time of this process and of those that it has ended [s]."""
    for child in multiprocessing.active_children():
        # what a process has taken is known when it has ended
        child.join(10.0)
    t = os.times()
    return t.user + t.system + t.children_user + t.children_system


def row(name: str, out: Path | None, workers: int) -> str:
    """What became of a shape: a row of the table."""
    title, sides = "NASA's HECC, points of sections", "all sides, floors and fillets, fillet 2.5 mm"
    if name != "hecc":
        shape = SHAPES[name]
        title = shape.title
        sides = "; ".join(f"{s}, u {a[0]:g} to {a[1]:g}, v {b[0]:g} to {b[1]:g}" for s, a, b in shape.surfaces)
    begin = cpu_s()
    with tempfile.TemporaryDirectory() as folder:
        try:
            file = hecc_job(Path(folder)) if name == "hecc" else job_of(SHAPES[name], Path(folder))
            done = run_job(load_job(file), workers=Workers(workers))
        except ChiploadError as err:
            return f"| {title} | {sides} | {cpu_s() - begin:.0f} s | | | | refused: {err} |"
        took = cpu_s() - begin
        if out is not None:
            done.save(out)
    used = done.outcome.used_checked
    if used is None:
        return f"| {title} | {sides} | {took:.0f} s | | | | {done.result.message} |"
    gouge = max(p.gouge.bound for p in used.programs)
    minutes = f"{used.seconds / 60.0:.1f} min, {done.outcome.impeller.blades} channels"
    scallop = "" if used.scallop is None else f"{100.0 * used.scallop:.0f} %"
    cutters = ", ".join(f"D {c.diameter:g} r {c.corner_radius:g}" for c in used.cutters)
    verdict = "holds" if done.result.verdict is Verdict.HOLDS else done.result.message
    return f"| {title} | {sides}; {cutters} | {took:.0f} s | {minutes} | {scallop} | {gouge:.3f} | {verdict} |"


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("names", nargs="*", metavar="NAME", help=", ".join([*SHAPES, "hecc"]))
    parser.add_argument("--out", type=Path, help="folder for the results")
    parser.add_argument("--workers", type=int, default=1, help="processes")
    given = parser.parse_args()
    print("| shape | what was planned | processor time | programs | mean scallop | gouge at most [mm] | verdict |")
    print("|---|---|---:|---:|---:|---:|---|")
    for name in given.names or SHAPES:
        if name not in (*SHAPES, "hecc"):
            parser.error(f"{name}: must be one of {', '.join([*SHAPES, 'hecc'])}")
        print(row(name, given.out and given.out / name, given.workers), flush=True)


if __name__ == "__main__":
    main()
