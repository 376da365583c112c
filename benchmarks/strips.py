"""Remove a finishing program from layers in one process and in strips: `python benchmarks/strips.py --processes 2`.

A wave of 120 rows by a ball nose of 6 mm, 29,000 steps, in a block of 120 x 240 mm. Clock times, since strips share the
processors; the machine should be idle. The volumes that are left must have the same bits.
"""

from __future__ import annotations

import argparse
import time

import numpy as np

from chipload.cutter.cutter import Cutter
from chipload.cutting.material import material_named
from chipload.program.build import rapid, rows
from chipload.program.program import LINE, Program
from chipload.simulation.chips import remove
from chipload.simulation.removal import Resolution
from chipload.stock.layers import LayeredStock

BALL = Cutter(6.0, 2, 0.5, 12.0, 30.0, 6e5, corner_radius=3.0)
FINE = Resolution(step_mm=1.0, tolerance=0.01, corner_slices=12, flank_mm=1.0, rotation=0.2)


def wave(count: int) -> Program:
    """So many rows 2 mm apart, with a point a millimetre."""
    points: list[list[float]] = []
    for j in range(count):
        xs = np.arange(0.0, 120.1)[:: 1 if j % 2 == 0 else -1]
        points += [[x, 2.0 * j, -1.5 + 0.8 * np.sin(x / 7.0) * np.cos(2.0 * j / 5.0)] for x in xs.tolist()]
    first = rapid([*points[0][:2], 5.0], 300.0, 1, "begin")
    return Program.join([first, rows([LINE] * len(points), points, (0.0, 0.0), 20.0, 300.0, 1, "cut")])


def shared(lines: int, processes: int) -> tuple[float, float, bool]:
    """Clock times [s] in one process and in several, and whether what is left has the same bits."""
    metal, times, left = material_named("al7075-t6"), list[float](), list[float]()
    for some, each in ((4, 1), (lines, 1), (lines, processes)):
        # the first compiles
        stock = LayeredStock.block((0.0, 0.0, -6.0), (120.0, 2.0 * some, 0.0), 0.3, 15.0)
        begun = time.perf_counter()
        remove(wave(some), stock, {1: BALL}, metal, FINE, processes=each, accuracy=False, engine="layers")
        times.append(time.perf_counter() - begun)
        left.append(stock.volume())
    return times[1], times[2], left[1] == left[2]


def main() -> None:
    """Print the clock times and their ratio."""
    ask = argparse.ArgumentParser(description=__doc__)
    ask.add_argument("--processes", type=int, default=2)
    ask.add_argument("--rows", type=int, default=120)
    given = ask.parse_args()
    one, several, alike = shared(given.rows, given.processes)
    print(f"one process {one:.1f} s, {given.processes} processes {several:.1f} s: {one / several:.2f} times")
    print(f"volume that is left: {'the same bits' if alike else 'different'}")


if __name__ == "__main__":
    main()
