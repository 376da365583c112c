"""How many measured peaks the band of a fitted material covers in runs that it has not seen.

    CHIPLOAD_DATA=... python benchmarks/peaks.py

Measured slots at three feeds. Each is left out in turn: the coefficients are fitted on the two others. The band is that
of the two other runs, each predicted by a fit on the rest (which has seen the one that is left out). Covered is the
share of its turns whose larger peak is below the predicted one and the band, direction by direction.
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
    """The comparison of a run with a fit on the others."""
    text = slots.JOB.format(diameter=25.0, helix=30.0)
    for each in FEEDS:
        text += slots.MORE.format(folder=slots.FOLDER, feed=each, use="predict" if each == feed else "fit")
    path = folder / f"{feed}.toml"
    path.write_text(text)
    done = run(load_job(path).job)
    return next(c for c in done.comparisons if c.use == "predict")


def main() -> None:
    if "CHIPLOAD_DATA" not in os.environ:
        sys.exit("CHIPLOAD_DATA is not set: state the folder of the real files")
    with tempfile.TemporaryDirectory() as folder:
        runs = {feed: left_out(feed, Path(folder)) for feed in FEEDS}
    print("| left out [mm/min] | own excess [%] | band of the others [%] | covered: feed, across, axis, plane [%] |")
    print("|---:|---:|---:|---|")
    for feed, one in runs.items():
        band = peak_excess([other for other in runs.values() if other is not one]) or 0.0
        said, turns = one.predicted, one.turns
        predicted = np.append(np.maximum(np.abs(said.high), np.abs(said.low)), said.resultant)
        seen = np.column_stack([np.maximum(np.abs(turns.high), np.abs(turns.low)), turns.plane])
        covered = 100.0 * (seen <= predicted * (1.0 + band)).mean(axis=0)
        own = 100.0 * (peak_excess([one]) or 0.0)
        print(f"| {feed} | {own:.0f} | {100.0 * band:.0f} | {', '.join(f'{x:.0f}' for x in covered)} |", flush=True)


if __name__ == "__main__":
    main()
