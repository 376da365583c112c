"""Moves a second and peak memory of a simulated program, at three lengths.

    python benchmarks/simulation.py [--moves 10000 30000 100000] [--memory]
    python benchmarks/simulation.py --teeth

The program is a three-axis finishing program as a CAM writes it: a ball nose of 8 mm in rows 0.4 mm apart over a wavy
surface, short lines of 0.4 mm, rows there and back; the stock is a block in layers of 0.25 mm. Every move is a step:
its chip, force, torque and power are calculated and kept. The length of a row stays, so that a longer program has more
rows. Each length runs in a process of its own, with its columns in files (``remove_in_chunks``, as `chipload run` has
them) or, with ``--memory``, in memory (``remove``). Peak memory is the most that the process ever had in memory;
"before" is what it had with libraries, program and stock, when the simulation began.

``--teeth`` measures what the exact surfaces of the teeth cost: the same simulation by moves, in turn with the chips
between the true paths of the teeth and with those of circles (cutters with equal teeth), or with one radius of each
tooth for every slice (cutters with runout). It prints the median of the ratios of the processor times of pairs; the
exit code is 1 where it is above 1.3.
"""

from __future__ import annotations

import argparse
import json
import math
import resource
import subprocess
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

import chipload.engagement.tooth_surfaces as surfaces
import chipload.simulation.loads
import chipload.simulation.moves
from chipload.cutter.cutter import Cutter
from chipload.cutting.material import material_named
from chipload.program.program import LINE, RAPID, Program
from chipload.simulation.checkpoint import Checkpoint
from chipload.simulation.chips import remove
from chipload.simulation.chunks import remove_in_chunks
from chipload.simulation.removal import Resolution
from chipload.stock.layers import LayeredStock

BALL = Cutter(8.0, 2, math.radians(30.0), 20.0, 35.0, 6e5, corner_radius=4.0)
#: moves of a row, from point to point and from row to row [mm]
ROW, ALONG, ACROSS = 250, 0.4, 0.4
RESOLUTION = Resolution(step_mm=1.0, tolerance=5e-3, corner_slices=12, flank_mm=2.0, rotation=math.radians(3.0))


def finishing(moves: int) -> Program:
    """Rows there and back over a wavy surface."""
    k = np.arange(moves + 1)
    row, at = k // ROW, k % ROW
    x = ALONG * np.where(row % 2 == 0, at, ROW - 1 - at)
    y = ACROSS * row
    z = -1.5 + 0.6 * np.sin(x / 9.0) * np.cos(y / 8.0)
    n = len(k)
    motion = np.full(n, LINE)
    motion[0] = RAPID
    return Program(
        motion=motion, p_work=np.column_stack([x, y, z]), axis=np.tile([0.0, 0.0, 1.0], (n, 1)),
        centre=np.zeros((n, 3)), normal=np.tile([0.0, 0.0, 1.0], (n, 1)), turns=np.zeros(n, dtype=int),
        feed=np.where(motion == RAPID, 0.0, 20.0), spindle=np.full(n, 1000.0), tool=np.ones(n, dtype=int),
        line=k + 1, label=np.zeros(n, dtype=int), labels=("finish",),
    )  # fmt: skip


def peak() -> float:
    """Most memory of this process so far [MB]."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0


def one(moves: int, memory: bool) -> dict[str, float]:
    """Run one length."""
    material = material_named("al7075-t6")
    small = finishing(40)
    remove(small, block(small), {1: BALL}, material, RESOLUTION)
    program = finishing(moves)
    stock = block(program)
    before = peak()
    wall, own = time.perf_counter(), time.process_time()
    with tempfile.TemporaryDirectory() as folder, Checkpoint(Path(folder) / "unfinished") as kept:
        if memory:
            removal = remove(program, stock, {1: BALL}, material, RESOLUTION)
        else:
            removal = remove_in_chunks(program, stock, {1: BALL}, material, RESOLUTION, kept)
        wall, own = time.perf_counter() - wall, time.process_time() - own
        after = peak()
        force = float(removal.columns["force_n"].max())
        steps = len(removal.columns["line"])
        disk = sum(f.stat().st_size for f in Path(folder).rglob("*") if f.is_file()) / 1e6
        kept.discard()
    return {
        "moves": moves, "steps": steps, "wall_s": wall, "own_s": own, "before_mb": before, "peak_mb": after,
        "disk_mb": disk, "force_n": force, "removed_mm3": removal.volume_before - removal.volume_after,
    }  # fmt: skip


def block(program: Program) -> LayeredStock:
    """The block under the rows."""
    y = float(program.p_work[:, 1].max())
    return LayeredStock.block((-6.0, -6.0, -8.0), (ALONG * ROW + 6.0, y + 6.0, 0.0), 0.25, 32.0)


#: mills of the finishing program and of rows that go 3 mm deep, without and with runout
MILLS = {
    "ball": BALL,
    "ball, runout 5 um": replace(BALL, runout=(0.005, 0.5)),
    "flat": Cutter(8.0, 4, math.radians(35.0), 20.0, 35.0, 6e5),
    "flat, runout 5 um": Cutter(8.0, 4, math.radians(35.0), 20.0, 35.0, 6e5, runout=(0.005, 0.5)),
}
#: pairs of the comparison, moves of the program, greatest ratio of times
ROUNDS, MOVES, MOST = 16, 3000, 1.3


def level_rows(moves: int) -> Program:
    """Rows there and back on one level, 2 mm apart, 3 mm deep."""
    program = finishing(moves)
    p = np.array(program.p_work)
    p[:, 1] *= 2.0 / ACROSS
    p[:, 2] = -3.0
    return replace(program, p_work=p)


def cost_of_teeth() -> int:
    """Print the ratio of processor times with and without the exact surfaces of the teeth."""
    material, exact, share, worst = material_named("al7075-t6"), surfaces.chips_of_teeth, surfaces.SHARE, 0.0
    users = (chipload.simulation.moves, chipload.simulation.loads)
    for name, mill in MILLS.items():
        program = finishing(MOVES) if mill.corner_radius else level_rows(MOVES)
        alike, times = mill.teeth_alike, []
        for turn in range(2 * ROUNDS + 2):
            first = turn % 2 == 0
            for user in users:
                user.chips_of_teeth = (lambda front, _: front) if first and alike else exact
            surfaces.SHARE = 1e9 if first and not alike else share
            begin = time.process_time()
            remove(program, block(program), {1: mill}, material, RESOLUTION, accuracy=False)
            if turn > 1:
                times.append(time.process_time() - begin)
        # each pair ran in one go, so that other work on the machine slows both
        pairs = np.array(times).reshape(-1, 2)
        ratio, (other, own) = float(np.median(pairs[:, 1] / pairs[:, 0])), np.median(pairs, axis=0)
        worst = max(worst, ratio)
        what = "circles" if alike else "one radius of each tooth for every slice"
        print(f"{name}: {own:.3f} s, with {what} {other:.3f} s: {ratio:.2f} times", flush=True)
    return int(worst > MOST)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--moves", type=int, nargs="+", default=[10_000, 30_000, 100_000])
    parser.add_argument("--memory", action="store_true", help="keep the columns in memory")
    parser.add_argument("--one", action="store_true", help="run in this process")
    parser.add_argument("--teeth", action="store_true", help="cost of the exact surfaces of the teeth")
    args = parser.parse_args()
    if args.teeth:
        sys.exit(cost_of_teeth())
    if args.one:
        print(json.dumps(one(args.moves[0], args.memory)))
        return
    found = []
    print("   moves  moves/s   wall [s]  processors [s]  before [MB]  peak [MB]  grown [MB]  on disk [MB]")
    for moves in args.moves:
        words = [sys.executable, __file__, "--one", "--moves", str(moves), *(["--memory"] if args.memory else [])]
        r = json.loads(subprocess.run(words, check=True, capture_output=True, text=True).stdout)
        found.append(r)
        print(
            f"{moves:8d} {moves / r['wall_s']:8.0f} {r['wall_s']:10.1f} {r['own_s']:15.1f} {r['before_mb']:12.0f} "
            f"{r['peak_mb']:10.0f} {r['peak_mb'] - r['before_mb']:11.1f} {r['disk_mb']:13.1f}",
            flush=True,
        )
    if len(found) > 2:
        n, t, m = (np.array([r[k] for r in found]) for k in ("moves", "own_s", "peak_mb"))
        rate = np.polyfit(n, t, 1)
        rest = ((t - np.polyval(rate, n)) ** 2).sum() / ((t - t.mean()) ** 2).sum()
        print(f"processors: {rate[1]:.2g} s + {1e3 * rate[0]:.3g} ms a move, R2 = {1.0 - rest:.5f}")
        print(f"memory: {1e6 * np.polyfit(n, m, 1)[0]:.0f} bytes a move")


if __name__ == "__main__":
    main()
