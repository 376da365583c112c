"""Calibration of the coefficients learned from logs, on synthetic cells that are drawn from the prior.

Each cell has coefficients, an efficiency and a wear of its own, and logs with their own clock, idle power of the day,
noise and error of the simulated torque. For Ktc, Kte and the wear: the share of 95 % intervals that hold the truth, and
whether the ranks of the truths in the posteriors are uniform (test of Kolmogorov and Smirnov). Then the error of the
torque of a program that was not used, the same as the spindle shows it (with its own efficiency, which the error of the
torque contains), and the band that is left of the prior's. An efficiency is known to --efficiency-error; what no log
can tell is the error of the torque at 95 % by that alone, 1.96 / sqrt(1 / e^2 + 1 / 0.25^2).

    python benchmarks/learning.py [--cells 500] [--logs 5] [--efficiency-error 0.05]
"""

from __future__ import annotations

import argparse
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.stats import kstest, norm

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

import synthetic_cell
from chipload.control.learning import learn_material
from chipload.errors import InputError
from synthetic_cell import PRIOR, cell, closed_form_program, draw_truth

#: bounds of a coverage of 95 %
BOUNDS = (0.93, 0.97)


def main() -> int:
    """Print the calibration; return 1 where a coverage is out of bounds."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cells", type=int, default=500)
    parser.add_argument("--logs", type=int, default=5)
    parser.add_argument("--efficiency-error", type=float, default=synthetic_cell.GAIN_ERROR)
    given = parser.parse_args()
    begin = time.process_time()
    synthetic_cell.GAIN_ERROR = given.efficiency_error
    synthetic_cell.SIGNAL = replace(synthetic_cell.SIGNAL, gain_error=given.efficiency_error)
    ranks, error, shown, left, refused = [], [], [], [], 0
    for seed in range(given.cells):
        try:
            logs, signal, truth = cell(1000 + seed, given.logs)
            found = learn_material(logs, signal, PRIOR)
        except InputError as err:
            refused += 1
            wear = draw_truth(np.random.default_rng(1000 + seed)).wear
            print(f"cell {1000 + seed}, whose Kte changes by {100.0 * 600.0 * wear:.0f} % in 600 s: {err}")
            continue
        sd = np.sqrt(np.diagonal(found.material.variances))
        rate, spread = found.wear[1]
        z = [
            (truth.cutting * PRIOR.Ktc - found.material.Ktc) / sd[0],
            (truth.edge * PRIOR.Kte - found.material.Kte) / sd[3],
            (3600.0 * truth.wear - rate) / spread,
        ]
        ranks.append(norm.cdf(z))
        program = closed_form_program(np.random.default_rng(10**6 + seed))
        is_cut = program.cutting > 0.0
        real = (truth.cutting * program.cutting + truth.edge * program.edge)[is_cut].mean()
        ratio = (found.material.Ktc / PRIOR.Ktc, found.material.Kte / PRIOR.Kte)
        guess = (ratio[0] * program.cutting + ratio[1] * program.edge)[is_cut].mean()
        error.append(abs(guess / real - 1.0))
        shown.append(abs(guess * found.gain.ratio / (real * truth.gain) - 1.0))
        share = np.array([program.cutting[is_cut].mean(), program.edge[is_cut].mean()])
        before, after = (np.sqrt(share @ m @ share) for m in map(shares_of_prior, (PRIOR, found.material)))
        left.append(after / guess / (before / share.sum()))
    u = np.array(ranks)
    print(
        f"{len(u)} cells of {given.logs} logs, {refused} refused, {time.process_time() - begin:.0f} s of processor time"
    )
    bad = False
    for k, name in enumerate(("Ktc", "Kte", "wear")):
        inside = float(np.mean((u[:, k] > 0.025) & (u[:, k] < 0.975)))
        bad |= not BOUNDS[0] <= inside <= BOUNDS[1]
        print(
            f"{name}: coverage {100.0 * inside:.1f} % of 95, ranks uniform: p = {kstest(u[:, k], 'uniform').pvalue:.2g}"
        )
    print(f"torque of a program that was not used: error {100.0 * np.median(error):.2g} % (median), "
          f"{100.0 * np.quantile(error, 0.95):.2g} % (95 of 100)")  # fmt: skip
    print(f"the same as the spindle shows it: {100.0 * np.median(shown):.2g} % (median), "
          f"{100.0 * np.quantile(shown, 0.95):.2g} % (95 of 100)")  # fmt: skip
    e = given.efficiency_error
    print(f"of the torque no log can tell {196.0 / np.hypot(1.0 / e, 4.0):.2g} % (95 of 100), as efficiency")
    print(f"band of that torque: {np.median(left):.2g} of the prior's (median), {np.max(left):.2g} at most")
    return int(bad)


def shares_of_prior(material):
    """Return the covariance (2, 2) of Ktc and Kte over those of the prior."""
    values = np.array([PRIOR.Ktc, PRIOR.Kte])
    return material.variances[np.ix_([0, 3], [0, 3])] / np.outer(values, values)


if __name__ == "__main__":
    sys.exit(main())
