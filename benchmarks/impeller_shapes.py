"""Impellers of others from file to verified programs: what was planned, time, verdict, or the line that refuses it.

    CHIPLOAD_DATA=FOLDER python benchmarks/impeller_shapes.py [NAME ...] [--loads] [--out FOLDER] [--workers N]

prints a row for each shape: time on the machine of the job, with its rates and accelerations, scallop, gouge, greatest
deflection of cutter and blade, verdict. Shapes: ``kj66`` (STEP), ``pyturbo`` (a table of all sections), ``rotor`` (STEP
of T-Blade3), and ``hecc`` where it is named: the example with fillets of 2.5 mm and programs for all ten surfaces, one
cutter, scallop 0.1 mm. Before finishing, :data:`ALLOWANCE` stands on the milled surfaces of all but ``hecc``, as a
stated stock, in which the programs are simulated; the stock of ``hecc`` is not stated. With ``--loads`` the feeds are
found by the forces in aluminium, and cutters and blades bend.
Results with their report are written to ``--out``. FOLDER of CHIPLOAD_DATA holds the files of others. With
``--workers`` the time of their processes is counted too.
"""

from __future__ import annotations

import argparse
import multiprocessing
import os
import re
import shutil
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import trimesh
from numpy.typing import NDArray

from chipload.errors import ChiploadError
from chipload.examples import copy_example
from chipload.jobs import load_job, run_job
from chipload.jobs.impeller.part import read_part
from chipload.result import Track, Verdict
from chipload.workers import Workers

Floats = NDArray[np.float64]

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
FORCES = """
[operation.forces]
material = {{ name = "al7075-t6" }}
flutes = 2
overhang_mm = 60.0
allowance_mm = {allowance:g}
deflection_um = 30.0

[operation.blades]
modulus_gpa = 71.0
poisson = 0.33
deflection_um = 50.0
"""
#: what stands on the milled surfaces before finishing, and how far the stock goes into the metal [mm]
ALLOWANCE, INTO = 0.3, 0.2
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


def job_of(shape: Shape, folder: Path, loads: bool) -> Path:
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
    path = folder / "job.toml"
    stock_body(path, shape).export(folder / "stock.stl")
    text = path.read_text() + (FORCES.format(allowance=ALLOWANCE) if loads else "")
    path.write_text(text + '\n[stock]\nfile = "stock.stl"\nunits = "mm"\n')
    return path


def stock_body(path: Path, shape: Shape) -> trimesh.Trimesh:
    """What stands on the milled surfaces of a job: a shell over each."""
    impeller = read_part(load_job(path).job).impeller
    shells = []
    for side, along, up in shape.surfaces:
        patch = getattr(impeller.blade, side)
        u, v = np.meshgrid(np.linspace(*along, 81), np.linspace(*up, 31), indexing="ij")
        p, n = patch.at(u.ravel(), v.ravel()), patch.normal(u.ravel(), v.ravel())
        shells.append(shell_between(p - INTO * n, p + ALLOWANCE * n, u.shape))
    return trimesh.util.concatenate(shells)


def shell_between(inner: Floats, outer: Floats, size: tuple[int, int]) -> trimesh.Trimesh:
    """The closed body between two grids of points."""
    at = np.arange(size[0] * size[1]).reshape(size)
    a, b, c, d = (x.ravel() for x in (at[:-1, :-1], at[1:, :-1], at[1:, 1:], at[:-1, 1:]))
    rim = np.concatenate([at[:-1, 0], at[-1, :-1], at[:0:-1, -1], at[0, :0:-1]])
    on, n = np.roll(rim, -1), len(inner)
    top = np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d])])
    edge = np.concatenate([np.column_stack([rim, on, n + on]), np.column_stack([rim, n + on, n + rim])])
    body = trimesh.Trimesh(np.concatenate([inner, outer]), np.concatenate([top[:, ::-1], n + top, edge]))
    if body.volume < 0.0:
        body.invert()
    return body


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


def row(name: str, out: Path | None, workers: int, loads: bool) -> str:
    """What became of a shape: a row of the table."""
    title, sides = "NASA's HECC, points of sections", "all sides, floors and fillets, fillet 2.5 mm"
    if name != "hecc":
        shape = SHAPES[name]
        title = shape.title
        sides = "; ".join(f"{s}, u {a[0]:g} to {a[1]:g}, v {b[0]:g} to {b[1]:g}" for s, a, b in shape.surfaces)
    begin = cpu_s()
    with tempfile.TemporaryDirectory() as folder:
        try:
            file = hecc_job(Path(folder)) if name == "hecc" else job_of(SHAPES[name], Path(folder), loads)
            done = run_job(load_job(file), workers=Workers(workers))
        except ChiploadError as err:
            return f"| {title} | {sides} | {cpu_s() - begin:.0f} s | | | | | | refused: {err} |"
        took = cpu_s() - begin
        if out is not None:
            done.save(out)
    used = done.outcome.used_checked
    if used is None:
        return f"| {title} | {sides} | {took:.0f} s | | | | | | {done.result.message} |"
    gouge = max(p.gouge.bound for p in used.programs)
    minutes = f"{used.seconds / 60.0:.1f} min, {done.outcome.impeller.blades} channels"
    scallop = "" if used.scallop is None else f"{100.0 * used.scallop:.0f} %"
    cutters = ", ".join(f"D {c.diameter:g} r {c.corner_radius:g}" for c in used.cutters)
    names = ("deflection_cutter_um", "deflection_workpiece_um")
    bent = " | ".join(" of ".join(greatest(done.result.in_use, name)) for name in names)
    verdict = "holds" if done.result.verdict is Verdict.HOLDS else done.result.message
    head = f"| {title} | {sides}; {cutters} | {took:.0f} s | {minutes} | {scallop} | {gouge:.3f}"
    return f"{head} | {bent} | {verdict} |"


def greatest(tracks: Sequence[Track], name: str) -> list[str]:
    """The worst value of a limit and the limit, as texts; nothing where no track has it."""
    found = [c for track in tracks for c in track.limits if c.name == name and c.worst is not None]
    worst = max(found, key=lambda c: c.worst or 0.0, default=None)
    return [] if worst is None else [f"{worst.worst:.1f}", f"{worst.limit:g}"]


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("names", nargs="*", metavar="NAME", help=", ".join([*SHAPES, "hecc"]))
    parser.add_argument("--out", type=Path, help="folder for the results")
    parser.add_argument("--loads", action="store_true", help="feeds and limits by the forces, blades that bend")
    parser.add_argument("--workers", type=int, default=1, help="processes")
    given = parser.parse_args()
    heads = (
        "shape", "what was planned", "processor time", "programs", "mean scallop", "gouge at most [mm]",
        "cutter bends [um]", "blade bends [um]", "verdict",
    )  # fmt: skip
    print(f"| {' | '.join(heads)} |")
    print("|---|---|---:|---:|---:|---:|---:|---:|---|")
    for name in given.names or SHAPES:
        if name not in (*SHAPES, "hecc"):
            parser.error(f"{name}: must be one of {', '.join([*SHAPES, 'hecc'])}")
        print(row(name, given.out and given.out / name, given.workers, given.loads), flush=True)


if __name__ == "__main__":
    main()
