"""Moves whose axis leans and turns: against finer slices, and against layers in short steps.

    python benchmarks/leaning.py [--planned FOLDER] [--rows 45] [--boat 250]

The boat of LinuxCNC goes by moves with 12 and with 24 slices of a range. Programs that the impeller example plans
(``--planned``, see ``benchmarks/engine_programs.py``) go by moves and by layers of 0.5 mm, in steps of 2 mm and of
0.5 mm. Percentiles are over the moves that cut more than a fifth of the median and have a force by both; sums are over
the moves that have one by both. Rates are processor time of the calling process, one run.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
from engine_programs import Case, cutter_named, head, in_block, of_others
from engines import ALLOY, COLUMNS, p_of

from chipload.machine.machine import machine_named
from chipload.program.read import read_program
from chipload.simulation.chips import remove
from chipload.simulation.moves import Engine
from chipload.simulation.removal import Columns, Resolution
from chipload.stock.layers import LayeredStock

#: slices of a corner that a job takes whose axis leans, and length of a slice of the flank in radii
SLICES, FLANK = 48, 0.1
LAYER_MM = 0.5


def simulated(case: Case, engine: Engine, slices: int, flank: float, step_mm: float) -> tuple[Columns, float]:
    """Columns, and steps a second."""
    smallest = min(c.radius for c in case.cutters.values())
    fine = Resolution(step_mm, 0.01, slices, flank * smallest, bottom_slices=12)
    stock = LayeredStock.block(case.low, case.high, LAYER_MM, 4.0 * smallest)
    begun = time.process_time()
    columns = remove(case.program, stock, case.cutters, ALLOY, fine, engine=engine, accuracy=False).columns
    return columns, len(columns["line"]) / (time.process_time() - begun)


def of_impeller(folder: Path, rows: int) -> list[Case]:
    """The first rows of the programs of roughing and of rest machining."""
    cases = []
    for name in ("1-rough-D26r2-90deg.apt", "2-D14r1.5-40deg.apt"):
        file = folder / "impeller" / "result" / name
        if file.is_file():
            program = read_program(file, machine_named("horizontal-b")).program
            program = replace(program, tool=np.ones(len(program), dtype=np.int64))
            cases.append(in_block(name, head(program, rows), cutter_named(name)))
    return cases


def compared(title: str, some: Columns, known: Columns) -> None:
    """Print what the columns of two runs differ by."""
    cuts = (some["force_n"] > 0.0) & (known["force_n"] > 0.0)
    for name in COLUMNS:
        a, b = some[name], known[name]
        p = ", ".join(f"{v:.2f}" for v in p_of(a[cuts], b[cuts]))
        total, most = (100.0 * (f(a[cuts]) / f(b[cuts]) - 1.0) for f in (np.sum, np.max))
        print(f"| {title} | {name} | {p} | {total:.2f} | {most:.2f} |")


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--planned", type=Path, help="folder of the planned examples")
    parser.add_argument("--rows", type=int, default=45, help="of each program of the impeller")
    parser.add_argument("--boat", type=int, default=250, help="rows of the boat")
    args = parser.parse_args()
    print("| runs | column | p50, p95, p99 [%] | sum [%] | greatest [%] |\n|---|---|---|---|---|")
    for case in of_others(args.boat):
        if case.name == "boat, five axes":
            simulated(replace(case, program=head(case.program, 12)), "moves", SLICES // 2, FLANK, 2.0)
            coarse, fast = simulated(case, "moves", SLICES // 2, FLANK, 2.0)
            fine, slow = simulated(case, "moves", SLICES, 0.5 * FLANK, 2.0)
            compared(f"{case.name}: 12 slices {fast:.0f} /s, 24 slices {slow:.0f} /s", coarse, fine)
    for case in of_impeller(args.planned, args.rows) if args.planned else ():
        for step_mm in (2.0, 0.5):
            one, fast = simulated(case, "moves", SLICES // 2, FLANK, step_mm)
            two, slow = simulated(case, "layers", SLICES, FLANK, step_mm)
            compared(f"{case.name}, {step_mm} mm: moves {fast:.0f} /s, layers {slow:.0f} /s", one, two)


if __name__ == "__main__":
    main()
