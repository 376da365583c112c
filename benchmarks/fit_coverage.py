"""How often the 95 % intervals of a fit from samples over the turn hold the true coefficients.

    python benchmarks/fit_coverage.py SETS [SCENARIO ...]

Each set is made by a sum over teeth and heights that shares no code with the fit: slots by a cutter of two teeth,
runout that lags with the helix, teeth that differ from turn to turn, noise of the samples, zeros that drift. Printed
for each scenario: share of the sets whose interval holds each coefficient, its half width and its mean error.
"""

from __future__ import annotations

import math
import sys
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chipload.cutter.cutter import Cutter
from chipload.cutting.fit_turns import fit_instantaneous
from chipload.cutting.turns import MeasuredCut

Floats = NDArray[np.float64]

K = np.array([800.0, 250.0, 120.0, 22.0, 18.0, 4.0])
MILL = Cutter(10.0, 2, math.radians(30.0), 20.0, 30.0, 6e5)
RPM, RATE, DEPTH, ANGLES, HEIGHTS, HARMONICS = 5993.0, 10_000.0, 3.0, 360, 30, 15


@dataclass(frozen=True)
class Scenario:
    """Runout [mm], share by which teeth differ, noise [N], drift [N/s], feeds per tooth [mm], seconds of each cut."""

    runout: float = 0.008
    differ: float = 0.05
    noise: float = 10.0
    drift: float = 5.0
    feeds: tuple[float, ...] = (0.03, 0.06, 0.09, 0.12)
    seconds: float = 0.5
    zero: bool = True


SCENARIOS = {
    "whole": Scenario(),
    "noise": Scenario(runout=0.0, differ=0.0, drift=0.0, zero=False),
    "even": Scenario(runout=0.0),
    "noisy": Scenario(noise=40.0),
    "unlike": Scenario(differ=0.15),
    "two-feeds": Scenario(feeds=(0.04, 0.12)),
    "long": Scenario(seconds=1.0),
    "quiet": Scenario(differ=0.0, noise=2.0, drift=0.0),
}


def forces(feed: float, runout: float, direction: float) -> Floats:
    """Force on the cutter (ANGLES, 3) [N] over a turn of a slot: the deeper of the two paths before, at each height."""
    N, R, out = MILL.flutes, MILL.radius, np.zeros((ANGLES, 3))
    theta = np.arange(ANGLES)[:, None] * math.tau / ANGLES
    lag = math.tan(MILL.helix) / MILL.radius * (np.arange(HEIGHTS) + 0.5) * DEPTH / HEIGHTS
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
    g, cuts = np.random.default_rng(seed), []
    direction = g.uniform(0.0, math.tau)
    for feed in scenario.feeds:
        one = forces(feed, scenario.runout, direction)
        t = np.arange(int(RATE * scenario.seconds)) / RATE
        turn = t * RPM / 60.0 + g.uniform()
        at = turn % 1.0 * ANGLES
        low, share = at.astype(int) % ANGLES, (at - np.floor(at))[:, None]
        force = one[low] * (1.0 - share) + one[(low + 1) % ANGLES] * share
        strong = 1.0 + scenario.differ * g.normal(size=int(turn.max() * MILL.flutes) + 2)
        force = force * strong[(turn * MILL.flutes).astype(int)][:, None]
        force += scenario.noise * g.normal(size=force.shape) + scenario.drift * t[:, None] * g.normal(size=3)
        speed = RPM * math.tau / 60.0
        cuts.append(
            MeasuredCut(f"{feed:g}", RATE, force, feed * MILL.flutes * RPM / 60.0, speed, (0.0, math.pi), DEPTH)
        )
    return cuts


def coverage(scenario: Scenario, sets: int) -> tuple[Floats, Floats, Floats]:
    """Return share of intervals that hold, mean half width and mean error of each coefficient, relative."""
    held, half, error = np.zeros(6), list[Floats](), list[Floats]()
    for seed in range(sets):
        cuts = measured(scenario, 1000 + seed)
        fit = fit_instantaneous(
            cuts, MILL, band=HARMONICS * RPM * math.tau / 60.0, runout=scenario.runout > 0.0, zero=scenario.zero
        )
        low, high = fit.coefficients.interval.T
        held += (low <= K) & (high >= K)
        half.append(0.5 * (high - low) / np.abs(K))
        error.append(fit.coefficients.values / K - 1.0)
    # a coefficient that a set does not identify has no interval, and does not hold
    return held / sets, np.nanmean(half, axis=0), np.nanmean(error, axis=0)


def main() -> None:
    """Print the coverage of the scenarios."""
    sets, names = int(sys.argv[1]), sys.argv[2:] or list(SCENARIOS)
    for name in names:
        held, half, error = coverage(SCENARIOS[name], sets)
        print(
            f"{name}: held {(100.0 * held).round(1).tolist()} %, half width {(100.0 * half).round(1).tolist()} %, "
            f"error {(100.0 * error).round(2).tolist()} %",
            flush=True,
        )


if __name__ == "__main__":
    main()
