"""Lines of single patches of the example `impeller` and the scallops that the check finds between them.

    python benchmarks/impeller_scallops.py

Patches with the cutters and table angles that the division into three cutters gives them; walls by their check points,
no rest passes. Measured by rays on the true surface, on 7 grid lines of each patch, 14 points from line to line.
"""

import math
import time
from pathlib import Path

import numpy as np

from chipload import examples
from chipload.cutter.catalogue import catalogue_named
from chipload.jobs import load_job
from chipload.jobs.impeller.part import read_part
from chipload.jobs.impeller.paths import finish_settings
from chipload.machine.machine import machine_named
from chipload.planning.impeller.coverage import between_lines
from chipload.planning.impeller.patch import Patch
from chipload.planning.impeller.tables import index_table
from chipload.simulation.channel.channel import left_on, wall

#: side, parameter that strips follow each other across, its range, range of the other; D, r [mm], table angle [deg]
PATCHES = (
    ("plus", "u", (0.03, 0.30), (0.30, 0.98), 34.0, 2.0, 70.0),
    ("plus", "u", (0.30, 0.50), (0.30, 0.98), 22.0, 2.0, 70.0),
    ("plus", "u", (0.50, 0.97), (0.30, 0.98), 12.0, 2.0, 90.0),
    ("minus", "u", (0.03, 0.40), (0.30, 0.98), 34.0, 2.0, 70.0),
    ("minus", "u", (0.40, 0.97), (0.30, 0.98), 34.0, 2.0, 20.0),
)
FEW, BETWEEN, HEIGHT, DEPTH = 7, 14, 1.0, 0.3


def main() -> None:
    """Print the table."""
    job = load_job(Path(examples.__file__).parent / "impeller" / "job.toml").job
    op, machine, catalogue = job.operation, machine_named("horizontal-b"), catalogue_named("wu2019")
    impeller = read_part(job).impeller
    how = finish_settings(
        impeller, machine, index_table(machine), catalogue, op, op.paths, 0.0, 0, 2
    )  # fmt: skip
    print("| side, along it | cutter, table | lines | path [mm] | scallop, mean | most | processor time [s] |")
    print("|---|---|---:|---:|---:|---:|---:|")
    for side, order, strips, part, diameter, corner, table in PATCHES:
        number = next(k for k, c in enumerate(catalogue.cutters) if (c.diameter, c.corner_radius) == (diameter, corner))
        corners = np.array([strips, part]).T
        patch = Patch(0, side, order, *strips, number, math.radians(table), corners, (), 0.0, 0.0, 0.0, part)
        begin = time.process_time()
        milling = how.milling(patch)
        took = time.process_time() - begin
        setting = how.setting((number, patch.table), [milling], [], 1)
        fine = np.linspace(0.0, 1.0, milling.tracks.lines * BETWEEN + 1)
        few = np.linspace(0.06, 0.94, FEW)
        u, v = strips[0] + fine * (strips[1] - strips[0]), part[0] + few * (part[1] - part[0])
        own = wall(side, how.surface(0, side), u, v)
        (left,) = left_on([own], setting.program, setting.cutter, HEIGHT, DEPTH, workers=2)
        within = between_lines(milling.tracks.tracks, milling.along, np.column_stack([own.u, own.v]))
        crests = left.scallops("u", within) / op.scallop_mm
        print(
            f"| {side}, {strips[0]:g} to {strips[1]:g} | D {diameter:g} r {corner:g}, {table:g} deg | "
            f"{milling.tracks.lines} | {milling.tracks.length:.0f} | {100 * crests.mean():.0f} % | "
            f"{100 * crests.max():.0f} % | {took:.1f} |",
            flush=True,
        )


if __name__ == "__main__":
    main()
