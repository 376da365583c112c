"""How many slices the edge of a ball nose needs where its contact is known exactly.

    python benchmarks/ball_slices.py [NUMBER] [--first SEED]

The ball cuts of ``benchmarks/truth.py``: beside a wall each slice has the exact ends of its contact, so that nothing
but the slices differs. The reference has 300. Printed for each number of slices are the median and the greatest error
of the greatest force, the greatest torque and the mean torque, with ends that are the same all over a slice, as they
are in the simulation, and with ends that shift along it as the contact does.
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
#: greatest shift of an end along a slice [rad], and a lag that keeps all of them above 0
SHIFT, LAG = 0.5, 10.0


def front_of_slices(cut: Cut, count: int, shifts: bool) -> ToothEngagement:
    """The engaged front of a ball beside a wall, in slices at Gauss nodes between the ends of the contact.

    Where ends shift, the rate of the lag is that of the end at the wall: the edge passes it in the right order.
    """
    R, wall, lead = 0.5 * cut.D, 0.5 * cut.D - cut.ae, math.tan(math.radians(cut.helix)) / (0.5 * cut.D)
    low, high = math.asin(max(wall, 0.0) / R) or 1e-3, math.acos(1.0 - cut.ap / R)
    rows, table = [], []

    def width(kappa: float) -> float:
        return math.acos(min(max(wall / (R * math.sin(kappa)), -1.0), 1.0))

    for a, b, mid in low + (high - low) * corner_parts(count):
        w, sine, rate = width(mid), math.sin(mid), lead * math.sin(mid)
        if shifts:
            change = (width(b) - width(a)) / (R * (b - a))
            rate = min(abs(rate + change if cut.up else rate - change), SHIFT / (R * (b - a)))
        first, last = (0.0, w) if cut.up else (math.pi - w, math.pi)
        lag = lead * R * (1.0 - math.cos(mid)) - rate * R * (mid - a) + LAG
        rows.append([first, last, R * a, R * b, sine * cut.fz, 0.0, 0.0])
        table.append([R * a, R * sine, R * (1.0 - math.cos(a)), sine, math.cos(mid), lag, rate])
    return ToothEngagement([0, count], rows, np.full(count, -1), np.arange(count), table)


def loads(cut: Cut, K: Floats, count: int, shifts: bool) -> Floats:
    """Greatest force, greatest torque and mean torque (3,)."""
    mill, metal = mill_of(cut), Material("m", *K, source="made up")
    chips = chips_of_teeth(front_of_slices(cut, count, shifts), mill)
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
    for shifts in (False, True):
        for count in SLICES:
            off = 100.0 * np.abs(np.array([loads(cut, K, count, shifts) for cut, K in cuts]) / known - 1.0)
            texts = [", ".join(f"{x:.2f}" for x in some) for some in (np.median(off, axis=0), off.max(axis=0))]
            print(f"| {count} | {'shift' if shifts else 'alike'} | {texts[0]} | {texts[1]} |", flush=True)


if __name__ == "__main__":
    main()
