"""Point milling on five axes of the example's surfaces with one cutter at a time: straight, tapered, barrel.

    python benchmarks/impeller_point_milling.py
    python benchmarks/impeller_point_milling.py plus

prints for each surface and cutter: lines, path, time of one channel, the greatest scallop, the gouge that was found and
its bound, the angle of axis and normal, the processor time of planning and checking.
"""

from __future__ import annotations

import math
import re
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from chipload import examples
from chipload.cutter.catalogue import Catalogue, CatalogueCutter, catalogue_named
from chipload.jobs import load_job
from chipload.jobs.impeller.five_axis_outcome import NoFiveAxisPath
from chipload.jobs.impeller.paths import finish_settings
from chipload.jobs.impeller.point_milling import checked_points
from chipload.machine.machine import machine_named
from chipload.planning.impeller.parametric import ImpellerShape, impeller_of
from chipload.planning.impeller.tables import index_table

POINTS = """[operation.point_milling]
machine = { name = "cradle-ac" }
feed_mm_min = 300.0

"""


def tapered_ball(r: float, deg: float, length: float) -> CatalogueCutter:
    """A ball of radius r in a cone of this half angle."""
    beta = math.radians(deg)
    return CatalogueCutter(2.0 * r * (1.0 - math.sin(beta)) / math.cos(beta), r, length, taper=beta)


CUTTERS = (
    CatalogueCutter(4.0, 2.0, 50.0),
    tapered_ball(2.0, 3.0, 50.0),
    tapered_ball(2.0, 5.0, 50.0),
    CatalogueCutter(8.0, 2.0, 50.0),
    CatalogueCutter(8.0, 2.0, 50.0, taper=math.radians(4.0)),
    CatalogueCutter(8.0, 2.0, 20.0, barrel_radius=50.0),
    CatalogueCutter(6.0, 1.5, 20.0, barrel_radius=30.0),
)


def main(surfaces: list[str]) -> None:
    """Print the table."""
    print("| surface | cutter | lines | path [mm] | time [min] | scallop [mm] | gouge, bound [mm] | angle [deg] | s |")
    print("|---|---|---:|---:|---:|---:|---:|---:|---:|")
    text = (Path(examples.__file__).parent / "impeller" / "job.toml").read_text()
    rough, paths = text.index("[operation.rough]"), text.index("[operation.paths]")
    text = text[:rough] + POINTS + text[paths:]
    parts = re.split(r"(?=\[\[surface\]\]|\[\[operation\]\])", text)
    for name in surfaces:
        own = "".join(p for p in parts if "[[surface]]" not in p or f'side = "{name}"' in p)
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "job.toml"
            path.write_text(own)
            job = load_job(path).job
        machine, op = machine_named("horizontal-b"), job.operation
        impeller, table, stated = impeller_of(ImpellerShape()), index_table(machine), catalogue_named("wu2019")
        how = finish_settings(impeller, machine, table, stated, op, op.paths, 0.0, 0, 2)
        for cutter in CUTTERS:
            begin = time.process_time()
            (one,) = checked_points(job, how, Catalogue("one", (cutter,)))
            took = time.process_time() - begin
            if isinstance(one, NoFiveAxisPath):
                why = one.reason.split(f"{cutter.label}: ")[-1].split(": state")[0]
                print(f"| {name} | {cutter.label} | {why} | | | | | | {took:.1f} |", flush=True)
                continue
            angle = np.degrees(np.arccos((one.path.normal * one.path.axis).sum(axis=1)))
            gouge, verdict = f"{one.gouge.found:.4f}, {one.gouge.bound:.4f}", "" if one.verified else " exceeds"
            print(
                f"| {name} | {cutter.label} | {one.path.lines} | {one.length:.0f} | {one.seconds / 60.0:.2f} "
                f"| {one.excess:.4f} | {gouge} | {angle.min():.0f} to {angle.max():.0f} | {took:.1f} |{verdict}",
                flush=True,
            )


if __name__ == "__main__":
    main(sys.argv[1:] or ["plus", "minus", "floor"])
