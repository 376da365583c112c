"""What the certification between check points changes: the same job searched and planned with it and without.

Without it the walls are their check points alone, as in a sampled search; both are divided, planned and checked alike.

    python benchmarks/impeller_certified.py [check_mm ...]

prints for each distance of check points, with the walls covered between them and without: cutters, table angles, path
and time of one channel, the deepest gouge of all programs as the check finds it between bounds, and the verdict.
"""

from __future__ import annotations

import re
import sys
import tempfile
import time
from pathlib import Path
from unittest import mock

import numpy as np

from chipload import examples
from chipload.jobs import load_job
from chipload.jobs.impeller import run as impeller_run

#: the floor of a channel, where the walls are near; one cutter, a scallop of 0.3 mm
SURFACE = """[[surface]]
body = "blade"
side = "floor"
along = [0.03, 0.97]
up = [0.25, 0.75]
points = [8, 5]

"""


def job_text(check: str) -> str:
    """The example with a part of one side, check points so far apart [mm] in the search and in the paths."""
    text = (Path(examples.__file__).parent / "impeller" / "job.toml").read_text()
    text = text[: text.index("[[surface]]")] + SURFACE + text[text.index("[[operation]]") :]
    text = text[: text.index("[operation.rough]")] + text[text.index("[operation.paths]") :]
    for key, value in (("most_cutters", "1"), ("check_mm", check), ("scallop_mm", "0.3")):
        text = re.sub(rf"^{key} = .*$", f"{key} = {value}", text, flags=re.MULTILINE)
    return re.sub(r"^hand_picked.*\n", "", text, flags=re.MULTILINE)


def main() -> None:
    """Print the table."""
    head = "check points [mm] | walls | cutter, table | path [mm] | time [min] | gouge found, bound [mm] | verdict"
    print(f"| {head} | processor [s] |")
    print("|---|---|---|---:|---:|---:|---|---:|")
    for check in sys.argv[1:] or ["3.0", "2.0", "1.0"]:
        for covered in (True, False):
            with tempfile.TemporaryDirectory() as folder:
                path = Path(folder) / "job.toml"
                path.write_text(job_text(check))
                job, begin = load_job(path).job, time.process_time()
                off = mock.patch.object(impeller_run, "_cover_walls", return_value=None)
                if covered:
                    milled = impeller_run.run(job)
                else:
                    with off:
                        milled = impeller_run.run(job)
            programs = milled.programs or ()
            sizes = ", ".join(
                f"D {p.setting.cutter.diameter:g} r {p.setting.cutter.corner_radius:g} at "
                f"{np.degrees(p.setting.table):.6g} deg"
                for p in programs
            )
            found, bound = (max(getattr(p.gouge, key) for p in programs) for key in ("found", "bound"))
            walls = "covered" if covered else "check points alone"
            fails = [f for p in programs for f in p.fails] + [f for c in milled.covered or () for f in c.fails]
            print(
                f"| {check} | {walls} | {sizes} | {sum(p.setting.length for p in programs):.0f} "
                f"| {sum(p.seconds for p in programs) / 60.0:.2f} | {found:.4f}, {bound:.4f} "
                f"| {'exceeds' if fails else 'holds'} | {time.process_time() - begin:.1f} |",
                flush=True,
            )


if __name__ == "__main__":
    main()
