"""Point milling of the example `impeller` on five axes: the path, the time and the scallops of each surface.

    python benchmarks/impeller_points.py [SURFACE ...]

SURFACE is ``plus``, ``minus`` or ``floor``; none: all three. Surfaces, catalogue, scallop and gouge are those of the
example, the machine is `cradle-ac`, the feed 300 mm/min. Nothing is planned for the index table.
"""

from __future__ import annotations

import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

from chipload.cutter.catalogue import catalogue_named
from chipload.examples import copy_example
from chipload.jobs import load_job
from chipload.jobs.impeller.five_axis_outcome import CheckedPoints, points_numbers
from chipload.jobs.impeller.part import read_part
from chipload.jobs.impeller.paths import finish_settings
from chipload.jobs.impeller.point_milling import checked_points
from chipload.machine.machine import machine_named
from chipload.planning.impeller.covering.covering import covering_of
from chipload.planning.impeller.surfaces import hub_range
from chipload.planning.impeller.tables import index_table

POINTS = '\n[operation.point_milling]\nmachine = { name = "cradle-ac" }\nfeed_mm_min = 300.0\n'


def main() -> None:
    """Print the table."""
    with tempfile.TemporaryDirectory() as folder:
        path = copy_example("impeller", Path(folder) / "impeller") / "job.toml"
        path.write_text(path.read_text() + POINTS)
        job = load_job(path).job
    sides = sys.argv[1:] or ["plus", "minus", "floor"]
    surfaces = [s for s in job.table.surface if s.side in sides]
    op, machine, catalogue = job.operation, machine_named("horizontal-b"), catalogue_named("wu2019")
    impeller = read_part(job).impeller
    covering = covering_of(impeller, op.tolerance_mm, min(catalogue.families), op.around, hub_range(impeller, 0.0))
    how = finish_settings(impeller, machine, index_table(machine), catalogue, op, op.paths, 0.0, 0, 1, covering)
    print(
        "| surface | cutter | lines | path [mm] | time [min] | all channels [min] | scallop at most, on the mean [mm] "
        "| gouge found, bound [mm] | turn of the axis [deg/mm] | verdict | processor time [s] |"
    )
    print("|---|---|---:|---:|---:|---:|---:|---:|---:|---|---:|")
    for surface in surfaces:
        begin = time.process_time()
        one = replace(job, table=job.table.model_copy(update={"surface": [surface]}))
        (found,) = checked_points(one, how, catalogue)
        took = time.process_time() - begin
        if not isinstance(found, CheckedPoints):
            print(f"| {surface.side} | {found.reason} |")
            continue
        x = points_numbers(found, "")
        print(
            f"| {surface.side} | D {x['diameter_mm']:g} r {x['corner_radius_mm']:g} | {x['lines']} | "
            f"{x['path_mm']:.0f} | {x['time_min']:.2f} | {x['time_all_channels_min']:.1f} | "
            f"{x['scallop_greatest_mm']:.4f}, {x['scallop_mean_share'] * op.scallop_mm:.3f} | "
            f"{x['gouge_mm']:.4f}, {x['gouge_bound_mm']:.4f} | {x['axis_turn_deg_mm']:.1f} | "
            f"{x['verdict']} | {took:.0f} |",
            flush=True,
        )


if __name__ == "__main__":
    main()
