"""How many measured peaks the band of a fitted material covers in runs that it has not seen.

    CHIPLOAD_DATA=... python benchmarks/peaks.py

Measured slots at three feeds. Each is left out in turn: the material is that of a fit on the two others, with the
``peak_excess`` of those. Covered is the share of the turns of the run that is left out whose larger peak is below the
predicted one and the band, direction by direction. The last columns: the thickest chip of the run against the
thickest of the material, above which limits on peaks are unproven.
"""

from __future__ import annotations

import os
import sys
import tempfile
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "real"))
import test_flat_slotting as slots

from chipload.jobs import load_job
from chipload.jobs.fit.run import peak_excess, run

FEEDS = (300, 900, 1500)


def left_out(feed: int, folder: Path):
    """The run of a fit job that keeps one feed back."""
    text = slots.JOB.format(diameter=25.0, helix=30.0)
    for each in FEEDS:
        text += slots.MORE.format(folder=slots.FOLDER, feed=each, use="predict" if each == feed else "fit")
    path = folder / f"{feed}.toml"
    path.write_text(text)
    return run(load_job(path).job)


def main() -> None:
    if "CHIPLOAD_DATA" not in os.environ:
        sys.exit("CHIPLOAD_DATA is not set: state the folder of the real files")
    with tempfile.TemporaryDirectory() as folder:
        runs = {feed: left_out(feed, Path(folder)) for feed in FEEDS}
    print(
        "| left out [mm/min] | mean off: feed, across, axis [%] | larger peak off [%] | its excess [%] | "
        "band of the others [%] | covered: feed, across, axis, plane [%] | chip [mm] | measured to [mm] |"
    )
    print("|---:|---|---|---:|---:|---|---:|---:|")
    for feed, done in runs.items():
        one = next(c for c in done.comparisons if c.use == "predict")
        band = peak_excess([c for c in done.comparisons if c.use == "fit"]) or 0.0
        said, turns = one.predicted, one.turns
        predicted = np.append(np.maximum(np.abs(said.high), np.abs(said.low)), said.resultant)
        seen = np.column_stack([np.maximum(np.abs(turns.high), np.abs(turns.low)), turns.plane])
        covered = 100.0 * (seen <= predicted * (1.0 + band)).mean(axis=0)
        own = 100.0 * (peak_excess([one]) or 0.0)
        runout = 2.0 * done.fit.cutter.runout[0]
        chip = one.cut.feed_per_tooth(2) + runout
        measured = max(cut.feed_per_tooth(2) for cut in done.fit.cuts) + runout
        numbers = [", ".join(f"{x:.0f}" for x in values) for values in (one.mean_percent, one.peak_percent, covered)]
        print(f"| {feed} | {numbers[0]} | {numbers[1]} | {own:.0f} | {100.0 * band:.0f} | {numbers[2]} | {chip:.3f} | "
              f"{measured:.3f} |", flush=True)  # fmt: skip


if __name__ == "__main__":
    main()
