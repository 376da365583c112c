"""The pocket planner and FreeCAD's Adaptive on real pockets: engagement, time at one force, path, lifts, area.

    python benchmarks/pockets.py [names ...] [--data FOLDER] [--json FILE] [--spacing 0.3] [--no-freecad]
                                 [--no-trochoidal] [--pictures FOLDER]

Radial depth R / 5, so that the engagement wanted is acos(0.8) = 36.87 deg. All paths (passes, trochoidal, Adaptive) are
asked by the same checker, which knows no planner: the trail of the centre, and the rim point by point, every
``spacing`` R of the cutting moves. Bores are taken out first and are no cutting moves. FreeCAD runs in its own process
(``freecadcmd``); without it its columns are empty.

Machining time is that of the program on the shipped machine `vmc`, by the clock of the product, at the same greatest
force: the planner's feed is 0.05 mm a tooth, that of Adaptive as much lower as its greatest engagement asks for to keep
the force (al7075-t6, R deep, 3 teeth, helix 30 deg). Links of both run 0.1 mm off the floor at the machine's greatest
feed. Size is that of the G-code. Planning time is processor time.
"""

import argparse
import json
import math
import os
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from pocket_pictures import picture

from chipload.cutter.cutter import Cutter
from chipload.cutting.force import forces_along
from chipload.cutting.material import material_named
from chipload.errors import InputError
from chipload.geometry.contour import Contour, Region
from chipload.geometry.dxf import read_dxf
from chipload.machine.machine import machine_named
from chipload.planning.pocket.clearing import clear_region
from chipload.planning.pocket.clearing_path import (
    CUT,
    ENTRY,
    LIFT,
    LINK,
    ClearingPath,
    polyline,
    segment_lengths,
)
from chipload.planning.pocket.leftover import leftover
from chipload.planning.pocket.motions import Heights, motions_of, programs_of
from chipload.planning.pocket.reach import centre_region
from chipload.program.gcode.writer import write_gcode
from chipload.program.program import Program
from chipload.program.release import NOT_SIMULATED
from chipload.program.time import program_time
from chipload.simulation.centre_path import CentrePath, rim_engagement

#: drawing -> radius of the cutter [mm]; drawings that no cutter can clear, to be refused, stand last
POCKETS = {
    "arcs": 4.0,
    "circle": 3.0,
    "circle_point": 8.0,
    "curve": 6.0,
    "diverging_lines": 6.0,
    "gear": 3.0,
    "hextest": 4.0,
    "missing_arc": 4.0,
    "octagon": 5.0,
    "square1": 3.0,
    "square2": 3.0,
    "square_circle": 4.0,
    "squiffey": 8.0,
    "squiffey2": 8.0,
    "taper": 5.0,
    "thrash": 12.0,
    "involute": 3.0,
    "slots": 3.0,
    "test_polyline": 3.0,
    "text": 1.0,
    "text_&": 1.0,
    "text_asterex": 1.0,
    "text_at": 1.0,
    "text_hash": 1.0,
    "triceratops": 1.5,
}
#: radial depth / R
DEPTH = 0.2
#: feed per tooth of the planner [mm], cutting speed [mm/s], number of teeth
FEED_PER_TOOTH, CUTTING_SPEED, TEETH = 0.05, 200e3 / 60.0, 3
MATERIAL, MACHINE = material_named("al7075-t6"), machine_named("vmc")
#: kinds of a path here: a bore, cutting, along cleared space, raised
BORE, CUTTING, LINKING, RAISED = 0, 1, 2, 3
#: planners in the order of the columns
PLANNERS = ("pocket", "trochoidal", "adaptive")
#: a rim that goes this much beyond what was wanted counts as over it [deg]
OVER_DEG = 1.0

#: what freecadcmd runs: reads job.json, writes path.json beside it
FREECAD = """
import json, os, time
import area
folder = os.environ["CHIPLOAD_ADAPTIVE"]
with open(os.path.join(folder, "job.json")) as f:
    job = json.load(f)
a = area.Adaptive2d()
a.toolDiameter = 2.0 * job["radius"]
a.helixRampDiameter = job["helix"]
a.stepOverFactor = job["step_over"]
a.tolerance = job["tolerance"]
a.stockToLeave = 0.0
a.forceInsideOut = False
a.finishingProfile = True
a.opType = area.AdaptiveOperationType.ClearingInside
begun = time.process_time()
regions = a.Execute(job["stock"], job["outlines"], lambda paths: False)
seconds = time.process_time() - begun
names = {int(getattr(area.AdaptiveMotionType, n)): n for n in ("Cutting", "LinkClear", "LinkNotClear",
                                                               "LinkClearAtPrevPass")}
out = {"seconds": seconds, "regions": [
    {"centre": list(r.HelixCenterPoint), "start": list(r.StartPoint),
     "paths": [[names[int(kind)], [list(p) for p in points]] for kind, points in r.AdaptivePaths]} for r in regions]}
with open(os.path.join(folder, "path.json"), "w") as f:
    json.dump(out, f)
"""


def planned_path(region, radius, trochoidal=False):
    """Rows (n, 8) of the planner's path, segments and kind, and its seconds of processor time."""
    begun = time.process_time()
    path = clear_region(region, radius, math.acos(1.0 - DEPTH), trochoidal=trochoidal)
    seconds = time.process_time() - begun
    kind = np.select([path.kind == ENTRY, path.kind == CUT, path.kind == LIFT], [BORE, CUTTING, RAISED], LINKING)
    return np.column_stack([path.segments, kind]), seconds


def adaptive_path(region, radius, program, tolerance, timeout):
    """The same of FreeCAD; None where it failed."""
    xmin, ymin, xmax, ymax = region.bounds
    m = 2.0 * radius
    box = [[xmin - m, ymin - m], [xmax + m, ymin - m], [xmax + m, ymax + m], [xmin - m, ymax + m]]
    job = {
        "radius": radius,
        "helix": 1.8 * radius,
        "step_over": 0.5 * DEPTH,
        "tolerance": tolerance,
        "stock": [[*box, box[0]]],
        "outlines": [closed(c, 1e-3 * radius) for c in region.contours],
    }
    with tempfile.TemporaryDirectory() as folder:
        script = Path(folder) / "adaptive.py"
        script.write_text(FREECAD)
        (Path(folder) / "job.json").write_text(json.dumps(job))
        env = {**os.environ, "CHIPLOAD_ADAPTIVE": folder, "HOME": folder}
        try:
            subprocess.run(
                [program, str(script)], env=env, cwd=folder, timeout=timeout, check=False, stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
            )  # fmt: skip
            found = json.loads((Path(folder) / "path.json").read_text())
        except (subprocess.TimeoutExpired, OSError, ValueError):
            return None
    kinds = {"Cutting": CUTTING, "LinkClear": LINKING, "LinkClearAtPrevPass": LINKING, "LinkNotClear": RAISED}
    rows = []
    for part in found["regions"]:
        (cx, cy), (sx, sy) = part["centre"], part["start"]
        a0, r = math.atan2(sy - cy, sx - cx), math.hypot(sx - cx, sy - cy)
        ring = np.zeros((3, 6))  # two half turns
        ring[:, 0], ring[:, 1] = cx + r * np.cos(a0 + np.array([0.0, np.pi, 0.0])), cy
        ring[:, 1] += r * np.sin(a0 + np.array([0.0, np.pi, 0.0]))
        ring[0, 2], ring[1:, 2:6] = RAISED, (BORE, cx, cy, np.pi)
        rows.append(ring)
        for name, points in part["paths"]:
            p = np.array(points).reshape(-1, 2)
            rows.append(np.column_stack([p, np.full(len(p), kinds[name]), np.zeros((len(p), 3))]))
    points = np.vstack(rows)
    p = points[:, 0:2]
    lines = np.column_stack([np.vstack([p[:1], p[:-1]]), p, points[:, 3:6], points[:, 2]])
    return lines, found["seconds"]


def closed(contour, chord):
    """The corners of a closed contour, chords at most ``chord`` [mm] off, the first one again at the end."""
    p = np.asarray(contour.flatten(chord)).tolist()
    return p if p[0] == p[-1] else [*p, p[0]]


def greatest_force(radius, angle, feed_per_tooth):
    """Greatest force in the plane over a revolution [N], down milling at an engagement [rad], R deep."""
    cutter = Cutter(2.0 * radius, TEETH, math.radians(30.0), 3.0 * radius, 4.0 * radius, 580e3)
    loads = forces_along(
        np.array([math.pi - angle]), np.array([math.pi]), feed_per_tooth, [[1.0, 0.0]], cutter, MATERIAL, radius,
        spindle_speed=CUTTING_SPEED / radius,
    )  # fmt: skip
    return float(loads["force_xy_n"][0])


def feed_at_force(radius, angle, force):
    """Feed per tooth [mm] at which that force is reached at an engagement, at most the planner's; 0: none."""
    low, high = 0.0, FEED_PER_TOOTH
    if greatest_force(radius, angle, high) <= force:
        return high
    for _ in range(40):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if greatest_force(radius, angle, middle) <= force else (low, middle)
    return low if low > 1e-6 else 0.0


def machined(rows, radius, feed_per_tooth):
    """Time on the machine [s] and bytes of G-code at a feed per tooth; nan, 0 where there is no feed."""
    if feed_per_tooth <= 0.0:
        return math.nan, 0
    kind = np.select([rows[:, 7] == BORE, rows[:, 7] == CUTTING, rows[:, 7] == RAISED], [ENTRY, CUT, LIFT], LINK)
    keep = (segment_lengths(rows[:, 0:7]) > 1e-9) | (kind == LIFT)
    kept, kind = rows[keep], kind[keep]
    n = len(kept)
    path = ClearingPath(
        kept[:, 2], kept[:, 3], kept[:, 4:6], kept[:, 6], kind, np.zeros(n), np.zeros(n, dtype=np.int64), (), 1.0, 1.0,
        0.0, (), {},
    )  # fmt: skip
    spindle = CUTTING_SPEED / radius
    feed = feed_per_tooth * TEETH * spindle / math.tau
    motions = motions_of(path, Heights(-radius, 0.1 - radius, 0.0, 5.0), feed, MACHINE.feed_max)
    program = Program.join(programs_of(motions, feed, radius, spindle, 1))
    text = write_gcode(program, MACHINE, title="pocket", release=NOT_SIMULATED, comments=[], number=1)
    return float(program_time(program, MACHINE).sum()), len(text)


def measured(rows, seconds, reachable, radius, spacing, workers):
    """What a path costs and gives, asked of the path of the centre and of a union of its buffers."""
    steps, kind = rows[:, 0:7], rows[:, 7]
    leg = segment_lengths(steps)
    trail = CentrePath(steps, radius, None, kind < RAISED)
    cut = np.flatnonzero((kind == CUTTING) & (leg > 1e-9))
    along = np.cumsum(leg[cut])
    asked = np.arange(0.5, along[-1] / (spacing * radius)) * spacing * radius
    which = np.minimum(np.searchsorted(along, asked), len(cut) - 1)
    share = np.clip(1.0 - (along[which] - asked) / leg[cut[which]], 0.0, 1.0)
    angle = np.degrees(rim_engagement(trail, cut[which], share, workers=workers).angle)
    points, raised = polyline(steps[:, 2:4], steps[:, 4:6], steps[:, 6], kind >= RAISED, 2e-5 * radius)
    left, _, _ = leftover(reachable, points, raised, radius)
    wanted = math.degrees(math.acos(1.0 - DEPTH))
    limit = greatest_force(radius, math.radians(wanted), FEED_PER_TOOTH)
    feed = feed_at_force(radius, max(math.radians(wanted), float(np.radians(angle.max()))), limit)
    time_s, size = machined(rows, radius, feed)
    return {
        "time_s": time_s,
        "feed_per_tooth_mm": feed,
        "gcode_bytes": size,
        "link_mm": float(leg[kind == LINKING].sum()),
        "seconds": seconds,
        "samples": len(angle),
        "engagement_max_deg": float(angle.max()),
        "engagement_95_deg": float(np.percentile(angle, 95.0)),
        "engagement_median_deg": float(np.median(angle)),
        "over_share": float((angle > wanted + OVER_DEG).mean()),
        "cut_mm": float(leg[kind == CUTTING].sum()),
        "path_mm": float(leg[kind < RAISED].sum()),
        "lifts": int(((kind == RAISED) & (leg > 1e-9)).sum()),
        "rows": len(rows),
        "reached": 1.0 - left / reachable.area,
    }


def table(results, wanted):
    """Markdown: a row a pocket; then the medians of the drawings that both planners clear."""
    out = [
        f"engagement wanted {wanted:.2f} deg; columns passes / trochoidal / Adaptive",
        "",
        "| pocket | R [mm] | greatest [deg] | over by 1 deg [%] | machining at one force [s] | cutting [m] | links [m] "
        "| lifts | G-code [kB] | reached [%] | planning [s] |",
        "|---|---|---|---|---|---|---|---|---|---|---|",
    ]
    columns = [
        ("engagement_max_deg", 1.0, ".1f"),
        ("over_share", 100.0, ".1f"),
        ("time_s", 1.0, ".0f"),
        ("cut_mm", 1e-3, ".2f"),
        ("link_mm", 1e-3, ".2f"),
        ("lifts", 1, "d"),
        ("gcode_bytes", 1e-3, ".0f"),
        ("reached", 100.0, ".2f"),
    ]
    for name, r in results.items():
        if "refused" in r:
            out.append(f"| {name} | {r['radius_mm']:g} | refused: {r['refused']} |" + " |" * 8)
            continue
        both = [r.get(who) for who in PLANNERS]
        cells = [" / ".join(format(x[key] * k, how) if x else "-" for x in both) for key, k, how in columns]
        ratio = " / ".join(f"{x['seconds']:.1f}" if x else "-" for x in both)
        out.append(f"| {name} | {r['radius_mm']:g} | " + " | ".join(cells) + f" | {ratio} |")
    out.append("")
    for who in PLANNERS[:2]:
        pairs = [(r[who], r["adaptive"]) for r in results.values() if r.get(who) and r.get("adaptive")]
        pairs = [(a, b) for a, b in pairs if math.isfinite(b["time_s"])]
        if pairs:
            out.append(f"{who} over Adaptive, median of {len(pairs)}: " + ", ".join(_medians(pairs)))
    return "\n".join(out)


def _medians(pairs):
    """The median ratio of each quantity, of those pairs in which it is not zero."""
    names = {
        "machining": "time_s", "cutting": "cut_mm", "links": "link_mm", "G-code": "gcode_bytes", "planning": "seconds"
    }  # fmt: skip
    for name, key in names.items():
        ratios = [a[key] / b[key] for a, b in pairs if b[key] > 0.0]
        yield f"{name} {np.median(ratios):.3f}"
    slower = sum(a["time_s"] > b["time_s"] for a, b in pairs)
    yield f"slower in {slower}"


def main() -> None:
    here = Path(__file__).resolve().parents[2] / "shared" / "data"
    data = Path(os.environ.get("CHIPLOAD_DATA", here)) / "cad" / "dxf_hsm_nibbler"
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", help=f"of {', '.join(POCKETS)}, or DXF files; all where none is given")
    parser.add_argument("--radius", type=float, default=4.0, help="of the cutter where a file is given [mm]")
    parser.add_argument("--data", type=Path, default=data, help="folder with the drawings")
    parser.add_argument("--json", type=Path, help="write the results here too")
    parser.add_argument("--spacing", type=float, default=0.3, help="between two places that are asked, / R")
    parser.add_argument("--workers", type=int, default=2, help="threads of the checker")
    parser.add_argument("--no-freecad", action="store_true", help="the planner alone")
    parser.add_argument("--no-trochoidal", action="store_true", help="without the strategy trochoidal")
    parser.add_argument("--pictures", type=Path, help="folder for a picture (SVG) of the paths of each drawing")
    parser.add_argument("--tolerance", type=float, default=0.1, help="of Adaptive, 0.1 being its own default")
    parser.add_argument("--timeout", type=float, default=120.0, help="of one run of FreeCAD [s]")
    asked = parser.parse_args()
    unknown = [name for name in asked.names if name not in POCKETS and not Path(name).is_file()]
    if unknown:
        parser.error(f"{', '.join(unknown)}: must be of {', '.join(POCKETS)}")
    if not asked.data.is_dir():
        parser.error(f"{asked.data}: no such folder: give --data")
    program = None if asked.no_freecad else shutil.which("freecadcmd") or shutil.which("FreeCADCmd")
    if program is None:
        print("without FreeCAD (freecadcmd): the columns of Adaptive are empty", file=sys.stderr)
    clear_region(Region.of([Contour.polyline([[0, 0], [9, 0], [9, 9], [0, 9]], closed=True)]), 2.0, 0.6)  # compile
    results = {}
    for drawn in asked.names or POCKETS:
        name, radius = Path(drawn).stem, POCKETS.get(drawn, asked.radius)
        try:
            file = asked.data / f"{drawn}.dxf" if drawn in POCKETS else Path(drawn)
            drawing = read_dxf(file, units_if_unstated="mm")
            region = Region.of([c for c in drawing.contours if c.closed])
            found = {"pocket": planned_path(region, radius)}
            if not asked.no_trochoidal:
                found["trochoidal"] = planned_path(region, radius, trochoidal=True)
        except InputError as refused:
            print(f"{name}: refused: {refused}", file=sys.stderr, flush=True)
            results[name] = {"radius_mm": radius, "refused": str(refused)}
            continue
        reachable = centre_region(centre_region(region, radius), -radius)
        results[name] = {"radius_mm": radius}
        if program is not None:
            found["adaptive"] = adaptive_path(region, radius, program, asked.tolerance, asked.timeout)
        for who, path in found.items():
            if path is not None:
                results[name][who] = measured(*path, reachable, radius, asked.spacing, asked.workers)
        if asked.pictures is not None:
            asked.pictures.mkdir(parents=True, exist_ok=True)
            panels = [(who, found[who][0], results[name][who]) for who in PLANNERS if found.get(who) is not None]
            (asked.pictures / f"{name}.svg").write_text(picture(name, region, radius, panels))
        print(f"{name}: {json.dumps(results[name])}", file=sys.stderr, flush=True)
    wanted = math.degrees(math.acos(1.0 - DEPTH))
    print(table(results, wanted))
    if asked.json:
        asked.json.write_text(json.dumps({"wanted_deg": wanted, "pockets": results}, indent=1) + "\n")


if __name__ == "__main__":
    main()
