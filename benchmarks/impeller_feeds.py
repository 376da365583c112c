"""Feeds by the force of the chip: a part of a side with the hand-picked cutter and with the one that is chosen.

    python benchmarks/impeller_feeds.py

prints for each way: cutter, path, time of all channels, the greatest deflection and stress of its programs.
"""

from __future__ import annotations

import re
import tempfile
from pathlib import Path

from chipload import examples
from chipload.jobs import load_job, run_job

SURFACE = """[[surface]]
body = "blade"
side = "plus"
along = [0.30, 0.45]
up = [0.50, 0.70]
points = [4, 4]

"""
FORCES = """[operation.forces]
material = { name = "al7075-t6" }
flutes = 2
overhang_mm = 70.0
allowance_mm = 0.5
deflection_um = 30.0

"""


def job_text() -> str:
    """The example with a part of one side, one cutter, no roughing, feeds by force up to 400 mm/min."""
    text = (Path(examples.__file__).parent / "impeller" / "job.toml").read_text()
    text = text[: text.index("[[surface]]")] + SURFACE + text[text.index("[[operation]]") :]
    text = text[: text.index("[operation.rough]")] + FORCES + text[text.index("[operation.paths]") :]
    for key, value in (("most_cutters", "1"), ("check_mm", "2.0"), ("feed_mm_min", "400.0")):
        text = re.sub(rf"^{key} = .*$", f"{key} = {value}", text, flags=re.MULTILINE)
    return text


def main() -> None:
    """Print the table."""
    print("| way | path [mm] | cut [min] | all [min] | deflection [µm] | stress [MPa] | verdict |")
    print("|---|---:|---:|---:|---:|---:|---|")
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "job.toml"
        path.write_text(job_text())
        milled = run_job(load_job(path)).outcome
    for way in milled.checked or ():
        loads = [p.setting.loads for p in way.programs if p.setting.loads is not None]
        cutters = ", ".join(f"D {c.diameter:g} r {c.corner_radius:g}" for c in way.cutters)
        print(
            f"| {way.name}, {cutters} | {way.path:.0f} | {way.cutting / 60.0:.2f} "
            f"| {way.seconds / 60.0:.2f} | {1000.0 * max(x.deflection.max() for x in loads):.1f} "
            f"| {max(x.stress.max() for x in loads):.0f} | {'holds' if way.verified else 'exceeds'} |"
        )


if __name__ == "__main__":
    main()
