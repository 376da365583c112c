"""Random ordinary cuts against the true paths of the teeth: how many are within the stated error.

    python benchmarks/truth.py [NUMBER] [--first SEED] [--simulated NUMBER]

Each cut has a flat or a ball end mill of 3 to 20 mm, 2 to 6 teeth, a helix of 20 to 50 deg, a depth of 0.1 to 2
diameters (a ball: to 0.4), a radial depth of 0.004 to 1 diameter, a feed per tooth of 0.2 to 1.5 % of the diameter, up
or down milling, runout of 0 to 15 µm, a fifth uneven pitch, and coefficients that vary by 30 %. The oracle is
``tests/engagement/tooth_paths.py``, which uses no code of the package. ``--simulated`` cuts a block with a number of
these flat mills in both engines at the default resolution, and compares the worst force and torque of the program.

Compared are the greatest force over all directions, the greatest torque and the mean torque. The exit code is 1 where
fewer than 99 % are within the stated error, or one is beyond twice that.
"""

from __future__ import annotations

import argparse
import importlib.util
import math
import sys
from pathlib import Path

import numpy as np

from chipload.cutter.cutter import Cutter
from chipload.cutting.force import forces_over_turn
from chipload.cutting.material import Material
from chipload.engagement.tooth_engagement import ToothEngagement
from chipload.engagement.tooth_surfaces import chip_error, chips_of_teeth
from chipload.program.build import plunge, rapid
from chipload.program.program import Program
from chipload.simulation.chips import remove
from chipload.simulation.removal import Resolution
from chipload.stock.layers import LayeredStock

# as the tests import it: the compiled oracle is kept under this name
_spec = importlib.util.spec_from_file_location(
    "engagement.tooth_paths", Path(__file__).parents[1] / "tests" / "engagement" / "tooth_paths.py"
)
oracle = sys.modules["engagement.tooth_paths"] = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(oracle)
Cut, true_loads = oracle.Cut, oracle.true_loads

COEFFICIENTS = np.array([800.0, 300.0, 150.0, 20.0, 15.0, 5.0])
COLUMNS = ("force_n", "torque_nm", "torque_mean_nm")


def random_cut(seed: int) -> tuple[Cut, np.ndarray]:
    """A cut and its coefficients."""
    g = np.random.default_rng(seed)

    def spread(low: float, high: float) -> float:
        return math.exp(g.uniform(math.log(low), math.log(high)))

    D, N, ball = float(g.choice([3, 4, 6, 8, 10, 12, 16, 20])), int(g.integers(2, 7)), bool(g.uniform() < 0.25)
    ap, ae = D * spread(0.1, 0.4 if ball else 2.0), min(0.98, spread(0.004, 1.0)) * D
    if ball:
        # the ball must reach the stock at the top of the cut
        widest = math.sqrt(ap * (D - ap))
        ae = 0.5 * D - widest + min(2.0 * ae / D, 1.9) * widest
    pitch: tuple[float, ...] = ()
    if not ball and g.uniform() < 0.2 and N % 2 == 0:
        off = float(g.uniform(1.0, 6.0))
        pitch = (360.0 / N - off, 360.0 / N + off) * (N // 2)
    e = float(g.choice([0.0, 0.003, 0.005, 0.01, 0.015]))
    cut = Cut(
        D, N, float(g.uniform(20.0, 50.0)), ap, ae, D * spread(0.002, 0.015), bool(g.integers(2)), e,
        float(g.uniform(0.0, math.tau)), pitch, ball,
    )  # fmt: skip
    return cut, COEFFICIENTS * np.exp(0.3 * g.normal(size=6))


def mill_of(cut: Cut) -> Cutter:
    """The cutter of a cut."""
    return Cutter(
        cut.D, cut.N, math.radians(cut.helix), 3.0 * cut.D, 4.0 * cut.D, 6e5, runout=(cut.e, cut.lam),
        corner_radius=0.5 * cut.D if cut.ball else 0.0, pitch=tuple(cut.pitches) if cut.pitch else (),
    )  # fmt: skip


def front_of(cut: Cut, slices: int = 200) -> ToothEngagement:
    """The engaged front of a cut: a flank, or slices of a ball."""
    wall, rows, table = 0.5 * cut.D - cut.ae, [], []
    lead = math.tan(math.radians(cut.helix)) / (0.5 * cut.D)
    count = slices if cut.ball else 1
    for i, (rho, sine, cosine, lag, length) in enumerate(cut.slices(count)):
        if wall >= rho:
            continue
        w = math.acos(max(wall / rho, -1.0))
        low, high = (0.0, w) if cut.up else (math.pi - w, math.pi)
        rows.append([low, high, i * length, (i + 1) * length, sine * cut.fz, 0.0, 0.0])
        first = max(lag - 0.5 * lead * sine * length, 0.0)
        table.append([i * length, rho, 0.0, sine, cosine, first, lead * sine])
    return ToothEngagement([0, len(rows)], rows, np.full(len(rows), -1), np.arange(len(rows)), table)


def errors_of_chips(seed: int) -> tuple[np.ndarray, float]:
    """True errors (3,) of the loads, and the stated one."""
    cut, K = random_cut(seed)
    mill, front = mill_of(cut), front_of(cut)
    rotations = 48 * cut.N if cut.N > 2 else 144
    known = true_loads(cut, K, rotations, 1500 if cut.ball else None)[:3]
    chips = chips_of_teeth(front, mill)
    force, torque = forces_over_turn(
        chips, mill, Material("m", *K, source="made up"), math.tau * np.arange(rotations) / rotations
    )
    found = np.array([np.linalg.norm(force[0], axis=1).max(), torque[0].max(), torque[0].mean()])
    return found / known - 1.0, float(chip_error(front, mill)[0])


def errors_of_simulation(seed: int, engine: str) -> tuple[np.ndarray, np.ndarray]:
    """True errors (2,) of the worst force and torque of a straight cut, and the stated ones."""
    cut, K = random_cut(seed)
    mill, speed = mill_of(cut), 300.0
    side = cut.D / 2.0 - cut.ae
    y = -side if cut.up else side
    edge = (-3.0 * cut.D, 0.0) if not cut.up else (0.0, 3.0 * cut.D)
    length = 4.0 * cut.D
    stock = LayeredStock.block((0.0, edge[0], -cut.ap), (length, edge[1], 0.0), cut.ap / 4.0, 20.0)
    feed = cut.fz * cut.N * speed / math.tau
    start = [-cut.D, y, -cut.ap]
    program = Program.join(
        [rapid(start, speed, 1, "link"), plunge([length - cut.D, y, -cut.ap], feed, speed, 1, "cut")]
    )
    material = Material("m", *K, source="made up")
    found = remove(program, stock, {1: mill}, material, Resolution(cut.D / 20.0, 0.002, 24, 1.0), engine=engine)  # type: ignore[arg-type]
    known = true_loads(cut, K, 360)[:2]
    worst = np.array([found.columns["force_n"].max(), 1000.0 * found.columns["torque_nm"].max()])
    return worst / known - 1.0, np.array([found.resolution_error["force_n"], found.resolution_error["torque_nm"]])


def say(name: str, off: np.ndarray, stated: np.ndarray) -> bool:
    """Print the share within the stated error; whether it is right."""
    size = np.abs(off)
    inside = size <= stated
    print(
        f"{name}: {len(off)} cuts, within the stated error {100.0 * inside.mean():.2f} %, greatest true over stated "
        f"{(size / stated).max():.2f}; true error median {100.0 * np.median(size):.2f}, 99 % "
        f"{100.0 * np.quantile(size, 0.99):.2f}, greatest {100.0 * size.max():.2f} %; stated median "
        f"{100.0 * np.median(stated):.2f}, greatest {100.0 * stated.max():.2f} %",
        flush=True,
    )
    return bool(inside.mean() >= 0.99 and (size <= 2.0 * stated).all())


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("number", nargs="?", type=int, default=2000)
    parser.add_argument("--first", type=int, default=10_000)
    parser.add_argument("--simulated", type=int, default=0)
    given = parser.parse_args()
    right = True
    seeds = range(given.first, given.first + given.number)
    some = [errors_of_chips(seed) for seed in seeds]
    ball = np.array([random_cut(seed)[0].ball for seed in seeds])
    off, stated = np.array([o for o, _ in some]), np.array([s for _, s in some])
    for kind, which in (("flat", ~ball), ("ball", ball)):
        for k, name in enumerate(COLUMNS):
            right &= say(f"chips, {kind}, {name}", off[which, k], stated[which])
        for i in np.flatnonzero(which & (np.abs(off).max(axis=1) > stated))[:10]:
            print(f"  seed {seeds[i]}: {100.0 * off[i]} %, stated {100.0 * stated[i]:.2f}: {random_cut(seeds[i])[0]}")
    flat = [seed for seed in range(given.first, given.first + 40 * given.simulated + 1) if not random_cut(seed)[0].ball]
    for engine in ("moves", "layers") if given.simulated else ():
        made = [errors_of_simulation(seed, engine) for seed in flat[: given.simulated]]
        for k, name in enumerate(COLUMNS[:2]):
            right &= say(f"{engine}, {name}", np.array([o[k] for o, _ in made]), np.array([s[k] for _, s in made]))
    return 0 if right else 1


if __name__ == "__main__":
    sys.exit(main())
