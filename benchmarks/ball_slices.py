"""How many slices the edge of a ball nose needs where its contact is known exactly.

    python benchmarks/ball_slices.py [NUMBER] [--first SEED]

The ball cuts of ``benchmarks/truth.py``: beside a wall each slice has the exact ends of its contact, so that nothing
but the slices differs. The reference has 300. Printed for each number of slices are the median and the greatest error
of the greatest force, the greatest torque and the mean torque, with ends that are the same all over a slice, and with
ends that run along it as the contact does, as they do in the simulation.
"""

from __future__ import annotations

import argparse
import math

import numpy as np
from numpy.typing import NDArray
from truth import Cut, kind_of, mill_of, random_cut

from chipload.cutting.force import greatest_forces, mean_forces
from chipload.cutting.material import Material
from chipload.engagement.moves.stock import corner_parts
from chipload.engagement.tooth_engagement import ToothEngagement
from chipload.engagement.tooth_surfaces import chips_of_teeth

Floats = NDArray[np.float64]

SLICES, REFERENCE = (6, 8, 12, 24), 300


def front_of_slices(cut: Cut, count: int, runs: bool) -> ToothEngagement:
    """The engaged front of a ball beside a wall, in slices at Gauss nodes between the ends of the contact."""
    R, wall, lead = 0.5 * cut.D, 0.5 * cut.D - cut.ae, math.tan(math.radians(cut.helix)) / (0.5 * cut.D)
    low, high = math.asin(max(wall, 0.0) / R) or 1e-3, math.acos(1.0 - cut.ap / R)
    rows, table = [], []

    def width(kappa: float) -> float:
        return math.acos(min(max(wall / (R * math.sin(kappa)), -1.0), 1.0))

    for a, b, _ in low + (high - low) * corner_parts(count):
        mid = 0.5 * (a + b)
        w, sine, rate = width(mid), math.sin(mid), (width(b) - width(a)) / (R * (b - a))
        first, last = (0.0, w) if cut.up else (math.pi - w, math.pi)
        z = R * (1.0 - math.cos(a))
        rows.append([first, last, R * a, R * b, sine * cut.fz, 0.0, 0.0])
        ends = [0.0 if cut.up else -rate, rate if cut.up else 0.0, R * mid, first, w, 0.0]
        table.append([R * a, R * sine, z, sine, math.cos(mid), lead * z, lead * sine, *(ends if runs else [0.0] * 6)])
    return ToothEngagement([0, count], rows, np.full(count, -1), np.arange(count), table)


def loads(cut: Cut, K: Floats, count: int, runs: bool) -> Floats:
    """Greatest force, greatest torque and mean torque (3,)."""
    mill, metal = mill_of(cut), Material("m", *K, source="made up")
    chips = chips_of_teeth(front_of_slices(cut, count, runs), mill)
    peak = greatest_forces(chips, mill, metal)
    force = math.hypot(float(peak["force_t"][0]), float(peak["force_n"][0]))
    return np.array([force, float(peak["torque"][0]), float(mean_forces(chips, mill, metal)[1][0])])


def main() -> None:
    """Print the errors of each number of slices."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("number", nargs="?", type=int, default=25)
    parser.add_argument("--first", type=int, default=200_000)
    given = parser.parse_args()
    seeds = [s for s in range(given.first, given.first + 6 * given.number) if kind_of(s) == "ball"]
    cuts = [random_cut(seed, "ball") for seed in seeds]
    known = np.array([loads(cut, K, REFERENCE, False) for cut, K in cuts])
    print("| slices | ends | median: force, torque, mean torque [%] | greatest [%] |\n|---:|---|---|---|")
    for runs in (False, True):
        for count in SLICES:
            off = 100.0 * np.abs(np.array([loads(cut, K, count, runs) for cut, K in cuts]) / known - 1.0)
            texts = [", ".join(f"{x:.2f}" for x in some) for some in (np.median(off, axis=0), off.max(axis=0))]
            print(f"| {count} | {'run' if runs else 'alike'} | {texts[0]} | {texts[1]} |", flush=True)


if __name__ == "__main__":
    main()
