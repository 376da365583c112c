"""How many measured peaks the band of a fitted material covers in runs that it has not seen.

    CHIPLOAD_DATA=... python benchmarks/peaks.py

Measured slots at three feeds. Each is left out in turn: the material is that of a fit on the two others, with the
``peak_excess`` of those. Covered is the share of the turns of the run that is left out whose peak, up to the band of
the fit, is below the predicted one and its excess: across the feed, along the axis, and in the plane. Then the value at
95 % of the peak in the plane, without and with the excess of the others: how far it is above the nominal value, and the
share of the turns below it. Of a mean the difference from the measured one is shown, and the band that the fit states;
a slot's mean force across the feed is, as its torque, a sum of Ktc and Kte alone. The last columns: the thickest chip
of the run against the thickest of the material, above which limits on peaks are unproven. The exit code is 1 where a
run within the measured chips is covered in less than 90 %, or the excess of all three runs in the plane is above 20 %.

The second table says why: measured over predicted peak in the plane, and how much it varies from turn to turn, for the
first 1 .. 5 harmonics of the spindle alone, and where the run itself is the only one that is fitted, with its own
runout and coefficients.
"""

from __future__ import annotations

import math
import os
import sys
import tempfile
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "real"))
import test_flat_slotting as slots

from chipload.checking.load_budget import budget_parts
from chipload.cutting.fit import Fit, predict
from chipload.cutting.load_parts import load_parts
from chipload.cutting.turns import peaks_in_band
from chipload.engagement.tooth_engagement import engagement_of_arcs
from chipload.jobs import load_job
from chipload.jobs.fit.outcome import Comparison, FitResult
from chipload.jobs.fit.run import peak_excess, run
from chipload.result.budget import ErrorBudget

FEEDS = (300, 900, 1500)


def fitted(feeds: Iterable[int], folder: Path) -> FitResult:
    """The run of a fit job on some feeds, which predicts the others."""
    text = slots.JOB.format(diameter=25.0, helix=30.0)
    for each in FEEDS:
        text += slots.MORE.format(folder=slots.FOLDER, feed=each, use="fit" if each in feeds else "predict")
    path = folder / "fit.toml"
    path.write_text(text)
    return run(load_job(path).job)


def over_predicted(fit: Fit, one: Comparison, harmonics: int) -> np.ndarray:
    """Measured over predicted peak in the plane of each turn, of the first harmonics of the spindle."""
    some = predict(replace(fit, search=replace(fit.search, harmonics=harmonics)), one.cut)
    return np.asarray(peaks_in_band(one.cut, one.turns, harmonics)[:, 3] / some.band_resultant)


def print_causes(runs: dict[int, FitResult], alone: dict[int, FitResult]) -> None:
    """Print the second table."""
    band = range(1, next(iter(runs.values())).fit.search.harmonics + 1)
    print("\n| left out [mm/min] | measured over predicted, from turn to turn [%], first harmonics: "
          f"{' | '.join(map(str, band))} | fitted alone |\n|---:|{'---|' * (len(band) + 1)}")  # fmt: skip
    for feed in runs:
        cases = [(runs[feed], k) for k in band] + [(alone[feed], band[-1])]
        texts = []
        for done, k in cases:
            one = next(c for c in done.comparisons if f"f{feed}ap" in c.cut.name)
            ratio = 100.0 * over_predicted(done.fit, one, k)
            texts.append(f"{np.median(ratio) - 100.0:+.1f} +- {ratio.std():.1f}")
        print(f"| {feed} | {' | '.join(texts)} |", flush=True)


def factor_at_95(done: FitResult, one: Comparison, excess: float) -> float:
    """The value at 95 % of the peak in the plane over the nominal one."""
    cutter, metal = done.fit.cutter, done.material
    slot = engagement_of_arcs([0.0], [math.pi], one.cut.feed_per_tooth(2), cutter, 3.0)
    (own,) = load_parts(replace(slot, frame=np.eye(3)[None]), cutter, metal)["force_n"]
    return ErrorBudget(0.95, budget_parts(own, "force_n", cutter, metal, 0.01, excess, 0.0)).value(1.0)


def main() -> int:
    if "CHIPLOAD_DATA" not in os.environ:
        sys.exit("CHIPLOAD_DATA is not set: state the folder of the real files")
    with tempfile.TemporaryDirectory() as folder:
        runs = {feed: fitted({*FEEDS} - {feed}, Path(folder)) for feed in FEEDS}
        whole = fitted(FEEDS, Path(folder))
        alone = {feed: fitted({feed}, Path(folder)) for feed in FEEDS}
    right = whole.material.peak_excess <= 0.2
    print(f"all three fitted: {100.0 * whole.material.peak_excess:.1f} % in the plane, "
          f"{100.0 * whole.material.peak_excess_axial:.1f} % along the axis\n")  # fmt: skip
    print(
        "| left out [mm/min] | mean off and its 95 % band: feed, across, axis [%] | own excess: plane, axis [%] | "
        "excess of the others [%] | covered: across, axis, plane [%] | "
        "plane at 95 %: above nominal, covered [%] | chip [mm] | measured to [mm] |"
    )
    print("|---:|---|---|---|---|---|---:|---:|")
    inside = 0
    for feed, done in runs.items():
        one = next(c for c in done.comparisons if c.use == "predict")
        others = peak_excess([c.peaks for c in done.comparisons if c.use == "fit"])
        own = peak_excess([one.peaks])
        bands = 1.0 + np.array([others[0], others[1], others[0]])
        some = [1, 2, 3]
        covered = 100.0 * (one.peaks.measured[:, some] <= one.peaks.predicted[some] * bands).mean(axis=0)
        factors = [factor_at_95(done, one, excess) for excess in (0.0, others[0] or 0.0)]
        held = [100.0 * float((one.peaks.measured[:, 3] <= one.peaks.predicted[3] * x).mean()) for x in factors]
        at_95 = "; ".join(f"{100.0 * (x - 1.0):.0f}, {share:.0f}" for x, share in zip(factors, held, strict=True))
        runout = 2.0 * done.fit.cutter.runout[0]
        chip = one.cut.feed_per_tooth(2) + runout
        measured = max(cut.feed_per_tooth(2) for cut in done.fit.cuts) + runout
        right &= bool((covered >= 90.0).all()) or chip > measured
        half = 100.0 * one.predicted.half[0] / np.abs(one.cut.force.mean(axis=0))
        inside += int((np.abs(one.mean_percent) <= half).sum())
        means = ", ".join(f"{x:.0f} +- {band:.0f}" for x, band in zip(one.mean_percent, half, strict=True))
        texts = [means] + [
            ", ".join(f"{x:.0f}" for x in values)
            for values in (100.0 * np.array(own), 100.0 * np.array(others), covered)
        ]
        print(f"| {feed} | {' | '.join(texts)} | {at_95} | {chip:.3f} | {measured:.3f} |", flush=True)
    print(f"\n{inside} of 9 means are within their band")
    print_causes(runs, alone)
    return 0 if right else 1


if __name__ == "__main__":
    sys.exit(main())
