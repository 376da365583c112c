"""How often the 95 % intervals of a fit from samples over the turn hold the true coefficients.

    python benchmarks/fit_coverage.py SETS [SCENARIO ...] [--first SEED]

Each set is made by a sum over teeth and heights that shares no code with the fit: slots, runout that lags with the
helix, teeth whose force differs each time that they pass, noise of the samples, zeros that drift, a spindle that is
not quite as fast as stated and begins anywhere. Printed for each scenario: share of the sets whose interval holds each
of the coefficients Ktc Krc Kac Kte Kre Kae, its half width, its mean error, and the error over its standard deviation
(root of the mean square: 1 is right, below 1 the intervals are too wide). Last the mean and the least share of all, how
many are outside 93 to 97 %, and outside the range in which a share lies in 95 of 100 runs where each interval holds in
95 % (binomial). The exit code is 1 where the mean is outside 93 to 97 %.
"""

from __future__ import annotations

import argparse
import math
import sys
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.stats import binom

from chipload.cutter.cutter import Cutter
from chipload.cutting.fit_turns import fit_instantaneous
from chipload.cutting.turns import MeasuredCut

Floats = NDArray[np.float64]

K = np.array([800.0, 250.0, 120.0, 22.0, 18.0, 4.0])
RPM, RATE, DEPTH, ANGLES, HEIGHTS, HARMONICS = 5993.0, 10_000.0, 3.0, 720, 60, 15


@dataclass(frozen=True)
class Scenario:
    """Runout [mm], share by which teeth differ, noise [N], drift [N/s], whether the phase and the exact speed of the
    spindle are unknown, feeds per tooth [mm], teeth, seconds of each cut, whether zeros are sought.
    """

    runout: float = 0.0
    differ: float = 0.0
    noise: float = 10.0
    drift: float = 0.0
    turned: bool = False
    feeds: tuple[float, ...] = (0.03, 0.06, 0.09, 0.12)
    flutes: int = 3
    seconds: float = 0.5
    zero: bool = False

    @property
    def mill(self) -> Cutter:
        """The cutter, without its runout."""
        return Cutter(10.0, self.flutes, math.radians(30.0), 20.0, 30.0, 6e5)


ALL = Scenario(runout=0.008, differ=0.05, drift=5.0, turned=True, zero=True)
SCENARIOS = {
    "noise": Scenario(),
    "runout": Scenario(runout=0.008),
    "unlike": Scenario(differ=0.05),
    "drift": Scenario(drift=20.0, zero=True),
    "all": ALL,
    "phase": Scenario(turned=True),
    "two-feeds": replace(ALL, feeds=(0.04, 0.12)),
    "two-teeth": replace(ALL, flutes=2),
}


def forces(mill: Cutter, feed: float, runout: float, direction: float) -> Floats:
    """Force on the cutter (ANGLES, 3) [N] over a turn of a slot: the deeper of the two paths before, at each height."""
    N, R, out = mill.flutes, mill.radius, np.zeros((ANGLES, 3))
    theta = np.arange(ANGLES)[:, None] * math.tau / ANGLES
    lag = math.tan(mill.helix) / mill.radius * (np.arange(HEIGHTS) + 0.5) * DEPTH / HEIGHTS
    for j in range(N):
        phi = (theta - j * math.tau / N - lag) % math.tau
        radius = [runout * np.cos(direction - (j - m) * math.tau / N - lag) for m in range(N + 1)]
        s, c = np.sin(phi), np.cos(phi)
        # between trochoids, of second order in the feed
        paths = [
            m * feed * s * (1.0 - N * feed / math.tau * c / R) + (m * feed * c) ** 2 / (2.0 * R) + radius[0] - radius[m]
            for m in range(1, N + 1)
        ]
        h = np.min(paths, axis=0)
        cuts = h > 0.0  # behind the cutter every path is deeper
        t, r, a = (np.where(cuts, K[k] * h + K[k + 3], 0.0) * DEPTH / HEIGHTS for k in range(3))
        out += np.stack([-(t * c + r * s).sum(1), (t * s - r * c).sum(1), -a.sum(1)], axis=1)
    return out


def measured(scenario: Scenario, seed: int) -> list[MeasuredCut]:
    """Return the cuts of one set."""
    g, cuts, mill = np.random.default_rng(seed), [], scenario.mill
    direction = g.uniform(0.0, math.tau)
    for feed in scenario.feeds:
        one = forces(mill, feed, scenario.runout, direction)
        t = np.arange(int(RATE * scenario.seconds)) / RATE
        turn = t * RPM / 60.0 + (g.uniform() if scenario.turned else 0.0)
        at = turn % 1.0 * ANGLES
        low, share = at.astype(int) % ANGLES, (at - np.floor(at))[:, None]
        force = one[low] * (1.0 - share) + one[(low + 1) % ANGLES] * share
        strong = 1.0 + scenario.differ * g.normal(size=int(turn.max() * mill.flutes) + 2)
        force = force * strong[(turn * mill.flutes).astype(int)][:, None]
        force += scenario.noise * g.normal(size=force.shape) + scenario.drift * t[:, None] * g.normal(size=3)
        stated = (RPM * (1.0 + 1.3e-3 * g.uniform(-1.0, 1.0)) if scenario.turned else RPM) * math.tau / 60.0
        cuts.append(
            MeasuredCut(f"{feed:g}", RATE, force, feed * mill.flutes * RPM / 60.0, stated, (0.0, math.pi), DEPTH)
        )
    return cuts


def coverage(scenario: Scenario, seeds: range) -> Floats:
    """Return (4, 6): share of intervals that hold, mean half width, mean error, all relative, and error over its sd."""
    held, half, error, over = np.zeros(6), list[Floats](), list[Floats](), list[Floats]()
    for seed in seeds:
        fit = fit_instantaneous(
            measured(scenario, seed), scenario.mill, band=HARMONICS * RPM * 1.002 * math.tau / 60.0,
            runout=scenario.runout > 0.0, zero=scenario.zero,
        )  # fmt: skip
        found = fit.coefficients
        low, high = found.interval.T
        held += (low <= K) & (high >= K)
        half.append(0.5 * (high - low) / np.abs(K))
        error.append(found.values / K - 1.0)
        over.append((found.values - K) / np.sqrt(np.diagonal(found.covariance)))
    # a coefficient that a set does not identify has no interval, and does not hold
    each = np.nanmean(half, axis=0), np.nanmean(error, axis=0), np.sqrt(np.nanmean(np.square(over), axis=0))
    return np.array([held / len(seeds), *each])


def main() -> int:
    """Print the coverage of the scenarios."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("sets", type=int)
    parser.add_argument("scenario", nargs="*", help=f"of {', '.join(SCENARIOS)}")
    parser.add_argument("--first", type=int, default=1000)
    given = parser.parse_args()
    shares = []
    for name in given.scenario or SCENARIOS:
        held, half, error, over = coverage(SCENARIOS[name], range(given.first, given.first + given.sets))
        print(
            f"{name}: held {(100.0 * held).round(1).tolist()} %, half width {(100.0 * half).round(1).tolist()} %, "
            f"error {(100.0 * error).round(2).tolist()} %, over its sd {over.round(2).tolist()}",
            flush=True,
        )
        shares.append(100.0 * held)
    every, n = np.concatenate(shares), given.sets
    low, high = (100.0 / n * float(binom.ppf(q, n, 0.95)) for q in (0.025, 0.975))
    print(
        f"{len(every)} shares: mean {every.mean():.1f}, least {every.min():.1f} %; {(every < 93.0).sum()} below 93, "
        f"{(every > 97.0).sum()} above 97 %; by chance alone {low:.1f} to {high:.1f} %: {(every < low).sum()} below, "
        f"{(every > high).sum()} above"
    )
    return 0 if 93.0 <= every.mean() <= 97.0 else 1


if __name__ == "__main__":
    sys.exit(main())
