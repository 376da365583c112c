"""Speed of the layered engine: steps a second of processor time of the bear and the boat of ``engines.py``.

Each is simulated some times, and the median is printed with the number of tiles that were left to GEOS.
"""

from __future__ import annotations

import argparse
import statistics
import time

from engine_programs import head, of_others
from engines import ALLOY, SLICES

from chipload.simulation.chips import remove
from chipload.simulation.removal import Resolution
from chipload.stock.layers import LayeredStock


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--bear", type=int, default=2000, help="rows of the bear")
    parser.add_argument("--boat", type=int, default=250, help="rows of the boat with three and with five axes")
    parser.add_argument("--times", type=int, default=3)
    words = parser.parse_args()
    cases = [c for c in of_others(words.bear) if c.name == "bear"]
    cases += [c for c in of_others(words.boat) if c.name.startswith("boat")]
    for case in cases:
        smallest = min(c.radius for c in case.cutters.values())
        fine = Resolution(case.step_mm, 0.01, SLICES // 2, 0.5 * smallest)
        stock = LayeredStock.block(case.low, case.high, case.layer_mm, 4.0 * smallest)
        remove(head(case.program, 12), stock.copied(), case.cutters, ALLOY, fine, engine="layers", accuracy=False)
        spent = []
        for _ in range(words.times):
            left = stock.copied()
            begun = time.process_time()
            removal = remove(case.program, left, case.cutters, ALLOY, fine, engine="layers", accuracy=False)
            spent.append(time.process_time() - begun)
        steps = len(removal.columns["line"])
        print(
            f"{case.name}: {steps} steps, {steps / statistics.median(spent):.0f} a second, "
            f"{removal.columns['chip_volume_mm3'].sum():.2f} mm3, sum of peak forces "
            f"{removal.columns['force_n'].sum():.1f} N, {left.by_geos} tiles by GEOS",
            flush=True,
        )


if __name__ == "__main__":
    main()
