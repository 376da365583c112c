"""Random ordinary cuts against the true paths of the teeth: how many are within the stated error.

    python benchmarks/truth.py [NUMBER] [--first SEED] [--kind KIND ...] [--results FILE] [--chips N] [--walls N]
        [--verdicts N]

Each cut is a program that chipload.simulate runs at its default settings, with steps of 0.5 to 2 mm: a flat, ball,
bull-nose, tapered or barrel mill of 3 to 20 mm, 2 to 6 teeth, a helix of 20 to 50 deg, a depth of 0.1 to 2 diameters (a
ball: to 0.4), a radial depth of 0.004 to 1 diameter, a feed per tooth of 0.2 to 1.5 % of the diameter, up or down
milling, runout of 0 to 15 µm, a fifth uneven pitch, and coefficients that vary by 30 %; or a flat mill on a helix into
solid material. The oracles, ``tests/engagement/tooth_paths.py`` and ``helix_paths.py``, use no code of the package.
``--chips`` compares the chips of a number of flat and ball mills alone, without a simulation. ``--walls`` compares the
greatest form error of a number of walls that helical flat mills finish, most of them in down milling. ``--results``
appends one line for each cut to a file, and runs no cut again that stands in it. ``--verdicts`` states limits of force
and torque near the true loads of other cuts, and counts the verdicts that are wrong: a limit that holds below the true
load, or is exceeded above it (by nominal loads and at 95 % in turn; runout and coefficients are known).

Compared are the greatest force over all directions, the greatest torque and the mean torque, in the middle of the cut.
The exit code is 1 where fewer than 99 % are within the stated error, one is beyond twice that, or the median of the
stated error is above 2 %.
"""

from __future__ import annotations

import argparse
import importlib.util
import math
import sys
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import numpy as np
import trimesh

import chipload
from chipload.cutter.cutter import Cutter
from chipload.cutting.force import forces_over_turn
from chipload.cutting.material import Material
from chipload.engagement.tooth_engagement import ToothEngagement
from chipload.engagement.tooth_surfaces import chip_error, chips_of_teeth
from chipload.program.build import plunge, rapid, rows
from chipload.program.program import ARC_CCW, Program


def oracle(name: str) -> ModuleType:
    """An oracle of the tests, as they import it: what is compiled is kept under that name."""
    full = f"engagement.{name}"
    if full not in sys.modules:
        spec = importlib.util.spec_from_file_location(
            full, Path(__file__).parents[1] / "tests" / "engagement" / f"{name}.py"
        )
        assert spec is not None
        assert spec.loader is not None
        sys.modules[full] = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(sys.modules[full])
    return sys.modules[full]


Cut, true_loads = oracle("tooth_paths").Cut, oracle("tooth_paths").true_loads
greatest_wall_error = oracle("tooth_paths").greatest_wall_error
Helix, helix_loads = oracle("helix_paths").Helix, oracle("helix_paths").helix_loads

COEFFICIENTS = np.array([800.0, 300.0, 150.0, 20.0, 15.0, 5.0])
COLUMNS = ("force_n", "torque_nm", "torque_mean_nm")


KINDS = ("flat", "ball", "bull", "taper", "barrel", "helix")


def kind_of(seed: int) -> str:
    """The kind of cutter of a cut."""
    return KINDS[seed % len(KINDS)]


def random_cut(seed: int, kind: str) -> tuple[Cut, np.ndarray]:
    """A cut and its coefficients."""
    g = np.random.default_rng(seed)

    def spread(low: float, high: float) -> float:
        return math.exp(g.uniform(math.log(low), math.log(high)))

    D, N, ball = float(g.choice([3, 4, 6, 8, 10, 12, 16, 20])), int(g.integers(2, 7)), kind == "ball"
    ap, share = D * spread(0.1, 0.4 if ball else 2.0), min(0.98, spread(0.004, 1.0))
    pitch: tuple[float, ...] = ()
    if not ball and g.uniform() < 0.2 and N % 2 == 0:
        off = float(g.uniform(1.0, 6.0))
        pitch = (360.0 / N - off, 360.0 / N + off) * (N // 2)
    e = float(g.choice([0.0, 0.003, 0.005, 0.01, 0.015]))
    cut = Cut(
        D, N, float(g.uniform(20.0, 50.0)), ap, 0.0, D * spread(0.002, 0.015), bool(g.integers(2)), e,
        float(g.uniform(0.0, math.tau)), pitch, ball,
    )  # fmt: skip
    if kind == "bull":
        cut = replace(cut, corner=D * float(g.uniform(0.05, 0.4)))
    elif kind == "taper":
        cut = replace(cut, corner=D * float(g.choice([0.0, 0.1, 0.25])), taper=float(g.uniform(1.0, 12.0)))
    elif kind == "barrel":
        r = D * float(g.uniform(0.08, 0.2))
        taper = float(g.choice([0.0, 10.0]))
        cut = replace(cut, corner=r, hub=0.5 * D - 1.5 * r, barrel=D * float(g.uniform(4.0, 15.0)), taper=taper)
    # radial depth at the top of the cut
    top = cut.radius_at(ap)
    return replace(cut, ae=0.5 * D - top + 2.0 * share * top), COEFFICIENTS * np.exp(0.3 * g.normal(size=6))


def mill_of(cut: Cut) -> Cutter:
    """The cutter of a cut."""
    return Cutter(
        cut.D, cut.N, math.radians(cut.helix), 3.0 * cut.D, 4.0 * cut.D, 6e5, runout=(cut.e, cut.lam),
        runout_size=None if cut.e else 0.0, corner_radius=0.5 * cut.D if cut.ball else cut.corner,
        pitch=tuple(cut.pitches) if cut.pitch else (),
        taper=math.radians(cut.taper), corner_e=cut.hub or None, barrel_radius=cut.barrel or None,
    )  # fmt: skip


def front_of(cut: Cut, slices: int = 200) -> ToothEngagement:
    """The engaged front of a cut: a flank, or slices of a ball."""
    wall, ranges, table = 0.5 * cut.D - cut.ae, [], []
    lead = math.tan(math.radians(cut.helix)) / (0.5 * cut.D)
    count = slices if cut.ball else 1
    for i, (rho, sine, cosine, lag, length) in enumerate(cut.slices(count)):
        if wall >= rho:
            continue
        w = math.acos(max(wall / rho, -1.0))
        low, high = (0.0, w) if cut.up else (math.pi - w, math.pi)
        ranges.append([low, high, i * length, (i + 1) * length, sine * cut.fz, 0.0, 0.0])
        first = max(lag - 0.5 * lead * sine * length, 0.0)
        table.append([i * length, rho, 0.0, sine, cosine, first, lead * sine])
    return ToothEngagement([0, len(ranges)], ranges, np.full(len(ranges), -1), np.arange(len(ranges)), table)


def errors_of_chips(seed: int) -> tuple[np.ndarray, float]:
    """True errors (3,) of the loads, and the stated one."""
    cut, K = random_cut(seed, "ball" if seed % 4 == 0 else "flat")
    mill, front = mill_of(cut), front_of(cut)
    rotations = 48 * cut.N if cut.N > 2 else 144
    known = true_loads(cut, K, rotations, 1500 if cut.ball else None)[:3]
    chips = chips_of_teeth(front, mill)
    force, torque = forces_over_turn(
        chips, mill, Material("m", *K, source="made up"), math.tau * np.arange(rotations) / rotations
    )
    found = np.array([np.linalg.norm(force[0], axis=1).max(), torque[0].max(), torque[0].mean()])
    return found / known - 1.0, float(chip_error(front, mill)[0])


def oracle_resolution(cut: Cut) -> tuple[int, int]:
    """Rotations and slices of the oracle: at least 720 and 400 over the contact of one tooth, however thin it is.

    Where a round cutter touches the block with a sliver near its surface, 800 slices over the whole depth are 20 over
    the contact: loads that are off by 5 %. Where the edge of a helical cutter crosses a thin layer, they are 60: up to
    1 %. The rotations share no factor with the teeth, so that no two are one.
    """
    wall, slices = 0.5 * cut.D - cut.ae, cut.slices(20_000)
    radii, lag = slices[:, 0], float(np.ptp(slices[:, 3]))
    share, top = float((radii > wall).mean()), float(radii.max())
    arc = math.acos(max(wall / top, -1.0)) if wall < top else 0.0
    # of the depth that lies in the material, the part that one tooth cuts at a time
    share *= min(arc / lag, 1.0) if lag > 0.0 and arc > 0.0 else 1.0
    rotations = 361 if arc > 0.5 else 1441
    return rotations, min(max(800, math.ceil(400.0 / max(share, 1e-3))), 100_000)


def simulated_cut(
    cut: Cut, K: np.ndarray, step: float, limits: chipload.Limits, checks: chipload.CheckSettings | None = None
) -> chipload.History:
    """Return the simulation of a straight cut through a block, 4 diameters long."""
    mill, speed = mill_of(cut), 300.0
    side = cut.D / 2.0 - cut.ae
    y = -side if cut.up else side
    edge = (-3.0 * cut.D, 0.0) if not cut.up else (0.0, 3.0 * cut.D)
    length, low = 4.0 * cut.D, -cut.ap - 2.0
    feed = cut.fz * cut.N * speed / math.tau
    start = [-2.0 * cut.D, y, -cut.ap]
    program = Program.join(
        [
            rapid([[-2.0 * cut.D, y, 5.0], start], speed, 1, "link"),
            plunge([length - 0.2 * cut.D, y, -cut.ap], feed, speed, 1, "cut"),
        ]
    )
    return chipload.simulate(
        program, chipload.Stock.block((0.0, edge[0], low), (length, edge[1], 0.0)), mill,
        Material("m", *K, source="made up", covariance=1e-12 * np.diag(K * K)), "vmc", limits, checks=checks,
        settings=chipload.SimulationSettings(step),
    )  # fmt: skip


def loads_in_the_middle(found: chipload.History, cut: Cut) -> np.ndarray:
    """Greatest loads (3,) where the cut is steady."""
    x = found["x_mm"]
    middle = (x > 1.6 * cut.D) & (x < 2.6 * cut.D)
    return np.array([found[name][middle].max() for name in COLUMNS])


def errors_of_simulation(cut: Cut, K: np.ndarray, step: float) -> tuple[np.ndarray, np.ndarray]:
    """True errors (3,) of the loads in the middle of a straight cut, and the stated ones."""
    found = simulated_cut(cut, K, step, chipload.Limits(force_n=1e6))
    known = true_loads(cut, K, *oracle_resolution(cut))[:3] * np.array([1.0, 1e-3, 1e-3])
    worst = loads_in_the_middle(found, cut)
    stated = found.numbers["resolution_error"]
    return worst / known - 1.0, np.array([stated[name] for name in COLUMNS])


def random_helix(seed: int) -> tuple[Helix, np.ndarray]:
    """A helix into solid material, of 1 to 6 deg, and the coefficients."""
    g = np.random.default_rng(seed)
    D, N = float(g.choice([3, 4, 6, 8, 10, 12, 16, 20])), int(g.integers(2, 6))
    A = 0.5 * D * float(g.uniform(0.5, 0.95))
    pitch = math.tau * A * math.tan(math.radians(float(g.uniform(1.0, 6.0))))
    K = COEFFICIENTS * np.exp(0.3 * g.normal(size=6))
    return Helix(D, N, float(g.uniform(20.0, 50.0)), A, pitch, D * float(g.uniform(0.003, 0.01))), K


def errors_of_helix(cut: Helix, K: np.ndarray, step: float) -> tuple[np.ndarray, np.ndarray]:
    """True errors (3,) of the greatest loads of the second turn of a helix, and the stated ones."""
    mill = Cutter(cut.D, cut.N, math.radians(cut.helix), 3.0 * cut.D, 4.0 * cut.D, 6e5)
    feed, wide = cut.fz * cut.N * 300.0 / math.tau * math.hypot(1.0, cut.fall), cut.A + cut.D
    ends = [[cut.A if i % 2 else -cut.A, 0.0, -0.5 * cut.pitch * (i + 1)] for i in range(4)]
    turns = rows([ARC_CCW] * 4, ends, (0.0, 0.0), feed, 300.0, 1, "cut")
    program = Program.join([rapid([[cut.A, 0.0, 5.0], [cut.A, 0.0, 0.0]], 300.0, 1, "link"), turns])
    stock = chipload.Stock.block((-wide, -wide, -2.0 * cut.pitch - 2.0), (wide, wide, 0.0))
    found = chipload.simulate(
        program, stock, mill, Material("m", *K, source="made up"), "vmc", chipload.Limits(force_n=1e6),
        settings=chipload.SimulationSettings(step),
    )  # fmt: skip
    known = helix_loads(cut, K) * np.array([1.0, 1e-3, 1e-3])
    steady = found["z_mm"] < -1.1 * cut.pitch
    worst = np.array([found[name][steady].max() for name in COLUMNS])
    stated = found.numbers["resolution_error"]
    return worst / known - 1.0, np.array([stated[name] for name in COLUMNS])


def random_wall(seed: int) -> tuple[Cut, np.ndarray, float]:
    """A finishing cut of a wall by a flat mill, three of four in down milling, its coefficients, and the overhang."""
    g = np.random.default_rng(seed)
    D, N = float(g.choice([4, 6, 8, 10, 12, 16, 20])), int(g.integers(2, 7))
    ap = D * math.exp(g.uniform(math.log(0.5), math.log(1.8)))
    ae, fz = D * math.exp(g.uniform(math.log(0.01), math.log(0.1))), D * float(g.uniform(0.002, 0.01))
    cut = Cut(D, N, float(g.uniform(20.0, 50.0)), ap, ae, fz, bool(g.uniform() < 0.25))
    return cut, COEFFICIENTS * np.exp(0.3 * g.normal(size=6)), ap + 2.0 + D * float(g.uniform(1.0, 2.5))


def error_of_wall(cut: Cut, K: np.ndarray, overhang: float) -> tuple[float, float]:
    """True error of the greatest form error of a wall whose points are 1 mm apart, and the stated one."""
    known = 1e3 * greatest_wall_error(cut, K, overhang, 6e5, 300, 1500)
    mill = Cutter(cut.D, cut.N, math.radians(cut.helix), cut.ap + 2.0, overhang, 6e5)
    feed, side = cut.fz * cut.N * 300.0 / math.tau, 1.0 if not cut.up else -1.0
    y, low, length = side * mill.radius, -cut.ap - 3.0, 1.5 * cut.D
    away = side * 3.0 * cut.D
    path = [[-cut.D, away, 5.0], [-cut.D, y, 5.0], [-cut.D, y, -cut.ap]]
    program = Program.join([rapid(path, 300.0, 1, "link"), plunge([length + cut.D, y, -cut.ap], feed, 300.0, 1, "cut")])
    box = sorted((0.0, -side * 8.0)), sorted((side * cut.ae, -side * 8.0))
    wall = trimesh.creation.box(bounds=[[0.0, box[0][0], low], [length, box[0][1], 0.0]])
    free = ("holder_gpa", "grip_n_um", "grip_nm_rad", "spindle_n_um", "spindle_nm_rad", "work_n_um")
    found = chipload.simulate(
        program, chipload.Stock.block((0.0, box[1][0], low), (length, box[1][1], 0.0)), mill,
        Material("m", *K, source="made up"), "vmc", chipload.Limits(form_error_um=1e4),
        part=chipload.FinishedPart(wall, 1.0), stiffness=chipload.MachineStiffness(**dict.fromkeys(free, math.inf)),
        settings=chipload.SimulationSettings(1.0),
    )  # fmt: skip
    numbers = found.numbers
    greatest = max((numbers["form_error_um"][key] for key in ("greatest", "least")), key=abs)
    return greatest / known - 1.0, numbers["resolution_error"]["form_error_um"]


def verdicts_of(seed: int) -> list[tuple[str, float, float, str, bool]]:
    """The two limits of a random cut: name, limit over the true load, stated error, state, whether it is right.

    A load of the whole program may be greater where the cutter enters or leaves the block, which the oracle does not
    know: there a limit may be exceeded that the steady cut does not exceed.
    """
    g, kind = np.random.default_rng(seed + 2), kind_of(seed)
    cut, K = random_cut(seed, "flat" if kind == "helix" else kind)
    known = true_loads(cut, K, *oracle_resolution(cut))[:2] * np.array([1.0, 1e-3])
    shares = np.exp(g.uniform(-0.12, 0.12, 2))
    force, torque = (float(x) for x in known * shares)
    checks = chipload.CheckSettings(confidence=0.5 if seed % 2 else 0.95)
    found = simulated_cut(cut, K, 1.0, chipload.Limits(force_n=force, torque_nm=torque), checks)
    steady = loads_in_the_middle(found, cut)
    out = []
    for i, check in enumerate(found.limits[:2]):
        elsewhere = check.worst is None or check.worst > steady[i] * (1.0 + 1e-9)
        state, share = check.state.value, float(shares[i])
        right = share >= 1.0 if state == "holds" else share < 1.0 or elsewhere if state == "exceeds" else True
        out.append((check.name, share, check.error, state, right))
    return out


def say_verdicts(seeds: range) -> bool:
    """Print how often each state is said, below and above the true load; whether none is wrong."""
    every = [(seed, *each) for seed in seeds for each in verdicts_of(seed)]
    for at in (0.5, 0.95):
        mine = [each for each in every if (each[0] % 2 == 1) == (at == 0.5)]
        for text, below in (("below", True), ("above", False)):
            some = [each[4] for each in mine if (each[2] < 1.0) == below]
            states = ", ".join(f"{some.count(state)} {state}" for state in ("holds", "unproven", "exceeds"))
            print(f"verdicts at {100.0 * at:g} %, limit {text} the true load: {states}")
    wrong = [each for each in every if not each[5]]
    for seed, name, share, error, state, _ in wrong:
        print(f"  wrong: seed {seed} ({kind_of(seed)}), {name} at {share:.4f} of the truth {state}, stated {error:.4f}")
    print(f"{len(wrong)} of {len(every)} verdicts are wrong", flush=True)
    return not wrong


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


def table(found: dict[str, list[tuple[int, np.ndarray, np.ndarray]]]) -> bool:
    """Print the shares of each kind and of all, and the cuts that are outside; whether they are right."""
    right = True
    whole = [each for some in found.values() for each in some]
    for kind, some in [*found.items(), ("all", whole)]:
        off, stated = (np.array([each[k] for each in some]) for k in (1, 2))
        for k, name in enumerate(COLUMNS):
            inside = say(f"{kind}, {name}", off[:, k], stated[:, k])
            right &= inside or kind != "all"
    off, stated = (np.array([each[k] for each in whole]) for k in (1, 2))
    for i in np.flatnonzero((np.abs(off) > stated).any(axis=1))[:20]:
        print(f"  seed {whole[i][0]}: {(100.0 * off[i]).round(2)} %, stated {(100.0 * stated[i]).round(2)} %")
    return right and bool((np.median(stated, axis=0) <= 0.02).all())


def simulated(seed: int) -> tuple[np.ndarray, np.ndarray]:
    """True errors and stated errors of the simulated cut of a seed."""
    step, kind = float(np.random.default_rng(seed + 1).choice([0.5, 1.0, 2.0])), kind_of(seed)
    if kind == "helix":
        return errors_of_helix(*random_helix(seed), step)
    return errors_of_simulation(*random_cut(seed, kind), step)


def read_results(path: Path | None) -> dict[int, tuple[np.ndarray, np.ndarray]]:
    """True and stated errors of the cuts in a file of results, by seed."""
    if path is None or not path.exists():
        return {}
    lines = [line.split() for line in path.read_text(encoding="utf-8").splitlines()]
    numbers = {int(line[0]): np.array(line[2:], dtype=float) for line in lines if len(line) == 8}
    return {seed: (some[:3], some[3:]) for seed, some in numbers.items()}


def append_result(path: Path, seed: int, off: np.ndarray, stated: np.ndarray) -> None:
    """Write one cut at the end of a file of results."""
    with path.open("a", encoding="utf-8") as file:
        file.write(" ".join([str(seed), kind_of(seed), *(f"{x:.6g}" for x in [*off, *stated])]) + "\n")


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("number", nargs="?", type=int, default=2000)
    parser.add_argument("--first", type=int, default=10_000)
    parser.add_argument("--kind", nargs="*", choices=KINDS, default=KINDS)
    parser.add_argument("--results", type=Path)
    parser.add_argument("--chips", type=int, default=0)
    parser.add_argument("--walls", type=int, default=0)
    parser.add_argument("--verdicts", type=int, default=0)
    given = parser.parse_args()
    right = True
    for kind in ("flat", "ball") if given.chips else ():
        seeds = [s for s in range(given.first, given.first + given.chips) if (kind == "ball") == (s % 4 == 0)]
        some = [errors_of_chips(seed) for seed in seeds]
        for k, name in enumerate(COLUMNS):
            right &= say(f"chips, {kind}, {name}", np.array([o[k] for o, _ in some]), np.array([s for _, s in some]))
    if given.walls:
        walls = np.array([error_of_wall(*random_wall(s)) for s in range(given.first, given.first + given.walls)])
        right &= say("walls, form_error_um", *walls.T)
    if given.verdicts:
        right &= say_verdicts(range(given.first, given.first + given.verdicts))
    found: dict[str, list[tuple[int, np.ndarray, np.ndarray]]] = {kind: [] for kind in given.kind}
    nothing, known = 0, read_results(given.results)
    for seed in range(given.first, given.first + given.number):
        if kind_of(seed) in found:
            off, stated = known.get(seed) or simulated(seed)
            if given.results is not None and seed not in known:
                append_result(given.results, seed, off, stated)
            nothing += int((off == -1.0).all())
            found[kind_of(seed)] += [] if (off == -1.0).all() else [(seed, off, stated)]
    print(f"{nothing} cuts are unproven because nothing is cut")
    if given.number:
        right &= table({kind: some for kind, some in found.items() if some})
    return 0 if right else 1


if __name__ == "__main__":
    sys.exit(main())
