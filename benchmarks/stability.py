"""Time of a stability chart and of the margins of 10 000 different steps, beside semi-discretisation at equal error.

    python benchmarks/stability.py

Processor time and wall time; the chart has 400 x 200 points, half immersion, down milling, three teeth, 3000 to
15000 rpm, with one, two and four modes. Semi-discretisation (first order, one matrix exponential a step, matrix product
over a period) is run at some points of the chart with as many steps as have the same error of |mu|.
"""

import math
import sys
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "stability"))
from stability_oracles import HALF, ONE, TAU, TWO, cut_of, down, semi_discretisation

from chipload.stability.chart import stability_chart
from chipload.stability.cuts import join_dynamic_cuts
from chipload.stability.margin import PER_WAVE, largest_multipliers, stability_margins
from chipload.stability.modes import Modes

FOUR = Modes(
    [400.0, 650.0, 900.0, 1500.0], [0.03, 0.02, 0.025, 0.02], [8e3, 5e3, 7e3, 2e4], [[1, 0], [0, 1], [1, 0], [0, 1]]
)
STEPS = 10_000


def timed(call):
    """Result, wall time and processor time [s], of the second call."""
    call()
    wall, busy = time.perf_counter(), time.process_time()
    result = call()
    return result, time.perf_counter() - wall, time.process_time() - busy


def program(modes):
    """Steps whose engagement and depth wander, half of them at each of two speeds; no two alike."""
    s = np.arange(STEPS) / STEPS
    ae = np.clip(0.1 + 0.175 * (1 + np.sin(40 * s)) + 0.5 * (np.sin(200 * s) > 0.95), 0.02, 1.0)
    depth, rpm = 1.0 + 0.8 * np.sin(13 * s), np.where(s < 0.5, 9000.0, 12500.0)
    return join_dynamic_cuts([cut_of(modes, r, d, down(a), helix=30.0) for r, d, a in zip(rpm, depth, ae, strict=True)])


def main() -> None:
    speed, depth = np.linspace(3000, 15000, 400) * TAU / 60.0, np.linspace(0.02, 4.0, 200)
    print("chart 400 x 200        wall [s]  processor [s]  evaluated")
    for name, modes in (("1 mode", ONE), ("2 modes", TWO), ("4 modes", FOUR)):
        for helix in (0.0, 30.0):
            cut = cut_of(modes, 6000, 1.0, HALF, helix=helix)
            chart, wall, busy = timed(lambda cut=cut: stability_chart(cut, speed, depth))
            print(f"{name}, helix {helix:2.0f}      {wall:8.2f}  {busy:13.2f}  {chart.evaluated.mean():9.2f}")
    print("\nmargins of 10 000 different steps   wall [s]  processor [s]  share that chatters")
    for name, modes in (("2 modes", TWO), ("4 modes", FOUR)):
        cuts = program(modes)
        found, wall, busy = timed(lambda cuts=cuts: stability_margins(cuts))
        print(f"{name}                              {wall:8.2f}  {busy:13.2f}  {(found.margin < 1).mean():.2f}")
    print("\none |mu|, 2 modes, half immersion, 9000 rpm, 1 mm")
    cut = cut_of(TWO, 9000, 1.0, HALF)
    exact = abs(largest_multipliers(cut, per_wave=80.0)[0])
    many = cut.chosen(np.zeros(200, dtype=np.int64))
    mu, _, busy = timed(lambda: largest_multipliers(many, per_wave=PER_WAVE, most=14, still=1e-3))
    error = abs(abs(mu[0]) - exact)
    print(f"marched map        error {error:.1e}   {1e6 * busy / 200:9.0f} us")
    m = 40
    while True:
        value, _, busy = timed(lambda m=m: semi_discretisation(TWO, 9000, 1.0, HALF, m=m))
        print(f"semi-discretisation error {abs(value - exact):.1e}   {1e6 * busy:9.0f} us, {m} steps")
        if abs(value - exact) <= error or m > 300:
            break
        m = math.ceil(1.6 * m)


if __name__ == "__main__":
    main()
