"""The largest cutters of the paper's problem, certified, against its own sampled test; and cost against both numbers.

    python benchmarks/impeller.py [--patches] [--programs RESULT] [--large [--out FOLDER]] [--tasks] [--removal [JOB]]

`--patches`: instead, one, two, three cutters against one picked by hand, on that impeller and on NASA's HECC.
`--programs`: the table of every way by its programs, of the result folder of the example.
`--large`: cost against both numbers; a picture of it in the folder.
`--tasks`: the search of the surfaces of the example in tasks of blocks of contact points: processor time of each task,
both times on one process and on two with their start, on Dask with two workers, and whether the bytes are the same.
`--removal`: the example, or another job of one process: processor time of the simulation of its programs in the blank,
and of the rest of the run; steps, and loads where the job states forces.

Reference: [Wu2019]: 100 contact points, 2900 check points, 15 table angles, 36 diameters. The impeller is the one by
formula. Its method, compiled the same way on the same two threads: for every table angle, diameter, contact point and
pallet angle of a 1 deg grid every check point is tested against the cutter; the test of one pallet angle ends at the
first check point that is met. It is timed twice: all pallet angles (it wants the valid ranges), and ending at the first
valid one. Ours finds the largest cutter of every contact point with proof (``best``), then that of every table angle
too (``every``); the whole answer adds the second corner radius and the exact ranges of B.
"""

import json
import math
import multiprocessing
import os
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np
from numba import njit
from plotly.subplots import make_subplots

from chipload import examples
from chipload.cutter.catalogue import Catalogue, CatalogueCutter, catalogue_named
from chipload.geometry.revolve import Revolved
from chipload.geometry.sections import check_sections, loft, read_meridian, read_sections
from chipload.jobs import load_job, run_job
from chipload.jobs.impeller import run as impeller_run
from chipload.jobs.impeller import surface_search
from chipload.jobs.impeller.checkpoint import KeptParts, part_bytes
from chipload.jobs.impeller.part import read_part
from chipload.jobs.impeller.programs import five_axis_programs, table_programs
from chipload.jobs.impeller.surface_search import SearchInputs
from chipload.machine.machine import machine_named
from chipload.planning.impeller.answer import largest_cutters
from chipload.planning.impeller.compare import cutter_choices
from chipload.planning.impeller.costs import ChannelSide, Terms
from chipload.planning.impeller.impeller import Impeller
from chipload.planning.impeller.parametric import ImpellerShape, impeller_of
from chipload.planning.impeller.search import limits
from chipload.planning.impeller.surfaces import ContactSampling, surface_of
from chipload.workers import Workers

HECC = Path(os.environ.get("CHIPLOAD_DATA", Path(__file__).parents[1].parent / "shared" / "data")) / "blades/nasa_hecc"
HECC = HECC / "HECC_Vaned_Configuration/Coordinates"
HECC = HECC / "HECC Design-Intent Stage Coordinates (Hot, No Fillets)"

R_CORNER, NEAR = 2.0, 2.0
TABLES = np.radians(np.arange(20.0, 91.0, 5.0))
SIZES = np.arange(10.0, 81.0, 2.0)


@njit(nogil=True, fastmath=True)
def clear(check, own, S, N, near2, T, n, R, r):
    """The source's test at one pallet angle."""
    s = math.sqrt(1.0 - n * n)
    rho = R - r
    X = S + r * N + rho * (N - n * T) / s - r * T
    for i in range(len(check)):
        x, y, z = check[i, 0] - X[0], check[i, 1] - X[1], check[i, 2] - X[2]
        l = x * T[0] + y * T[1] + z * T[2]  # noqa: E741
        if l < 0.0:
            continue
        d2 = x * x + y * y + z * z - l * l
        if d2 >= R * R:
            continue
        P = R if l >= r else rho + math.sqrt(r * r - (r - l) * (r - l))
        if d2 >= P * P * (1.0 - 1e-12):
            continue
        if own[i]:
            u, v, w = check[i, 0] - S[0], check[i, 1] - S[1], check[i, 2] - S[2]
            if u * u + v * v + w * w < near2:
                continue
        return False
    return True


@njit(nogil=True)
def sampled(check, own, S, N, near2, tables, sizes, r, steps, whole, first, last, out):
    """Largest size (c, t) with a valid B of the grid; ``whole``: all sizes at all B."""
    T = np.empty(3)
    for c in range(first, last):
        for t in range(len(tables)):
            out[c, t] = 0.0
            for k in range(len(sizes) - 1, -1, -1):
                good = 0
                for b in range(steps):
                    B = 2.0 * math.pi * b / steps
                    T[0], T[1] = math.sin(tables[t]) * math.cos(B), math.sin(tables[t]) * math.sin(B)
                    T[2] = math.cos(tables[t])
                    n = N[c, 0] * T[0] + N[c, 1] * T[1] + N[c, 2] * T[2]
                    if 0.0 <= n < 1.0 and clear(check, own, S[c], N[c], near2, T, n, 0.5 * sizes[k], r):
                        good += 1
                        if not whole:
                            break
                if good and out[c, t] == 0.0:
                    out[c, t] = sizes[k]
                if good and not whole:
                    break


def two_threads(scene, whole):
    out = np.zeros((len(scene.contact), len(TABLES)))
    args = (
        scene.check,
        scene.check_surface == 0,
        scene.contact,
        scene.normal,
        scene.near**2,
        TABLES,
        SIZES,
        R_CORNER,
        360,
    )
    sampled(*args, whole, 0, 0, out)
    begun, cpu = time.perf_counter(), time.process_time()
    with ThreadPoolExecutor(2) as pool:
        starts = range(0, len(scene.contact), 5)
        list(pool.map(lambda a: sampled(*args, whole, a, min(a + 5, len(out)), out), starts))
    return out, time.perf_counter() - begun, time.process_time() - cpu


def scene_of(contact, check, around=0):
    """About so many contact points on the middle of a blade's side and check points in its channel."""
    side = max(int(math.sqrt(contact)), 2)
    along = max(int(math.sqrt(check / 3.0)), 3)
    u, v = np.linspace(0.03, 0.97, side), np.linspace(0.30, 0.98, max(contact // side, 1))
    return impeller_of(ImpellerShape()).scene(0, "plus", (u, v), (along, along), NEAR, around, (along, along))


def timed(scene, tables, every):
    begun, cpu = time.perf_counter(), time.process_time()
    found = limits(scene, tables, R_CORNER, SIZES[-1] / 2 - R_CORNER, SIZES[0] / 2 - R_CORNER, every=every, workers=2)
    return found, time.perf_counter() - begun, time.process_time() - cpu


def paper() -> None:
    scene = scene_of(100, 2900)
    timed(scene_of(4, 100), TABLES, True)
    largest_cutters(scene_of(4, 100), catalogue_named("wu2019"), TABLES, 0.0, workers=2)
    print(f"{len(scene.contact)} contact points, {len(scene.check)} check points, 15 table angles, 36 diameters")
    ours, took, cpu = {}, {}, {}
    for name, every in (("best", False), ("every", True)):
        runs = [timed(scene, TABLES, every) for _ in range(3)]
        ours[name], took[name], cpu[name] = min(runs, key=lambda x: x[1])
        found = ours[name]
        print(f"ours, {name:6s} {took[name]:8.3f} s ({cpu[name]:.3f} s of the cores)  "
              f"certified {found.certified.mean():.0%}, "
              f"{(found.blockers != -1).sum(axis=2).mean():.1f} blockers a proof")  # fmt: skip
    begun = time.perf_counter()
    answer = largest_cutters(scene, catalogue_named("wu2019"), TABLES, 0.0, workers=2)
    print(f"whole answer {time.perf_counter() - begun:8.3f} s  both corner radii, ranges of B, bounds proved "
          f"{answer.bounded.mean():.0%}, {len(answer.unreachable)} unreachable")  # fmt: skip
    for whole, name in ((False, "first valid B"), (True, "all B")):
        out, slow, slow_cpu = two_threads(scene, whole)
        sizes = 2.0 * (ours["every"].rho + R_CORNER)
        snapped = np.where(sizes >= SIZES[0], SIZES[np.clip(np.searchsorted(SIZES, sizes + 1e-9) - 1, 0, None)], 0.0)
        better, worse = (snapped > out).sum(), (snapped < out).sum()
        at_points = (snapped.max(axis=1) > out.max(axis=1)).sum(), (snapped.max(axis=1) < out.max(axis=1)).sum()
        ratio = [slow / took[k] for k in took] + [slow_cpu / cpu[k] for k in cpu]
        print(f"sampled, {name:13s} {slow:8.2f} s ({slow_cpu:.2f} s of the cores)  ratio {ratio[0]:.0f} (best), "
              f"{ratio[1]:.0f} (every), of core time {ratio[2]:.0f}, {ratio[3]:.0f}")  # fmt: skip
        print(f"         ours larger at {better}, smaller at {worse} of {out.size} pairs, at {at_points[0]} and "
              f"{at_points[1]} of {len(out)} points")  # fmt: skip


def large(out) -> None:
    """Cost against both numbers, one table angle."""
    rows = []
    timed(scene_of(4, 100), TABLES[5:6], True)
    for contact in (100, 1000, 10_000):
        for check in (1000, 10_000, 100_000):
            scene = scene_of(contact, check)
            found, took, cpu = timed(scene, TABLES[5:6], True)
            rows.append((len(scene.contact), len(scene.check), cpu))
            print(f"{rows[-1][0]:6d} x {rows[-1][1]:6d}  {took:8.2f} s ({cpu:.2f} s of the cores)  "
                  f"certified {found.certified.mean():.2%}")  # fmt: skip
    if out:
        (Path(out) / "cost.html").write_text(plot(rows))


def plot(rows) -> str:
    """The page of a picture: time against contact points and against check points."""
    figure = make_subplots(1, 2, shared_yaxes=True)
    for place, own, other, what in ((1, 0, 1, "contact"), (2, 1, 0, "check")):
        for n in sorted({round(row[other], -2) for row in rows}):
            line = sorted((row[own], row[2]) for row in rows if round(row[other], -2) == n)
            x, y = zip(*line, strict=True)
            name = f"{n} {'check' if own == 0 else 'contact'} points"
            figure.add_scatter(x=x, y=y, name=name, mode="lines+markers", row=1, col=place)
        figure.update_xaxes(type="log", title=f"{what} points", row=1, col=place)
    figure.update_yaxes(type="log")
    figure.update_yaxes(title="time of the cores [s]", col=1)
    figure.update_layout(template="simple_white", title="Largest cutters at one table angle")
    return figure.to_html(include_plotlyjs=True)


def hecc():
    kinds = [sorted(HECC.glob(f"*impeller_{kind}_blade_section_*.txt")) for kind in ("main", "splitter")]
    blades = [loft(check_sections(read_sections(k, "inch", True, "X R*THETA R"), 431.5)) for k in kinds]
    hub, shroud = (
        read_meridian(HECC / f"HECCvanedCoordinates_flowpathCoordinates_{n}.txt", "inch", over=True)
        for n in ("hub", "shroud")
    )
    return Impeller(*blades, Revolved(hub, 1), Revolved(shroud, -1), 15)


def shop():
    """Long-reach cutters of assumed lengths."""
    rows = [(4, 60, 80), (5, 60, 80), (6, 90, 110), (8, 90, 110), (10, 90, 110), (12, 90, 110), (14, 90, 110)]
    rows += [(16, 90, 110)]
    cutters = []
    for d, neck, reach in rows:
        for r in (1.0, 2.0) if d > 4 else (1.0,):
            shank = max(d, 10.0)
            cutters.append(CatalogueCutter(d, r, max(2.0 * d, 12.0), d - 0.4, neck, shank, reach, max(28.0, d + 12.0)))
    return Catalogue("shop", tuple(cutters))


def divide(title, impeller, catalogue, picked, tables, names, how, terms) -> None:
    """One, two, three cutters against one picked by hand, all sides of a channel."""
    sides, begun, unreached = [], time.perf_counter(), []
    for body, side, along, up in names:
        surface = surface_of(impeller, body, side, replace(how, along=along, up=up))
        answer = largest_cutters(surface.scene, catalogue, tables, 0.5, workers=2)
        unreached.append(f"{surface.name} {len(answer.unreachable)}")
        index = -1 if side == "floor" else ("blade", "splitter").index(body)
        sides.append(ChannelSide(index, side, surface.scene, surface.u, surface.v, surface.area, answer, 0.5))
    print(f"\n{title}: {sum(len(s.area) for s in sides)} contact points, scallop {terms.scallop} mm; searched in "
          f"{time.perf_counter() - begun:.1f} s; not reached: {', '.join(unreached)}")  # fmt: skip
    begun = time.perf_counter()
    ways = [x.partition(2) for x in cutter_choices(sides, terms, picked, (1, 2, 3), workers=2)]
    print(f"patches in {time.perf_counter() - begun:.1f} s")
    base = ways[0].divided
    for way in ways:
        d = way.divided
        if d is None:
            print(f"| {way.name} | not possible |")
            continue
        used = ", ".join(f"D {way.catalogue.cutters[k].diameter:g} r {way.catalogue.cutters[k].corner_radius:g}"
                         for k in d.cutters)  # fmt: skip
        print(f"| {way.name} | {used} | {len(d.patches)} | {d.cutter_changes} + {d.table_changes} | {d.path / 1e3:.2f} "
              f"({d.path / base.path - 1.0:+.1%}) | {d.total / 60.0:.1f} ({d.total / base.total - 1.0:+.1%}) | "
              f"{d.gap:.1%} | {d.total / d.bound_any_shape - 1.0:.0%} | {way.share:.1%} |")  # fmt: skip
        for p in d.patches:
            c = way.catalogue.cutters[p.cutter]
            part = "" if p.part == (0.0, 1.0) else f" part {p.part[0]:.2f}..{p.part[1]:.2f}"
            name = f"{('floor', 'blade', 'splitter')[p.body + 1]} {p.side}: {p.order} {p.low:.2f}..{p.high:.2f}"
            print(f"      {name}{part} "
                  f"D {c.diameter:g} r {c.corner_radius:g} at {math.degrees(p.table):.0f} deg, {p.area:.0f} mm2, "
                  f"{p.path:.0f} mm")  # fmt: skip


def patches() -> None:
    wide, tall, flat = (0.03, 0.97), (0.30, 0.98), (0.15, 0.85)
    how = ContactSampling(wide, tall, (10, 10), 2.0, 2.0)
    names = [("blade", "plus", wide, tall), ("blade", "minus", wide, tall), ("blade", "floor", wide, flat)]
    catalogue = catalogue_named("wu2019")
    picked = next(k for k, c in enumerate(catalogue.cutters) if c.corner_radius == 1.5)
    # the source: 100 mm/min, 0.1 mm; the changes are ours
    terms = Terms(100.0 / 60.0, 0.1, 60.0, 30.0, 11)
    divide("impeller by formula", impeller_of(ImpellerShape()), catalogue, picked, TABLES, names[:2], how, terms)
    divide("with the floor", impeller_of(ImpellerShape()), catalogue, picked, TABLES, names, how, terms)
    if not HECC.is_dir():
        return
    wide, tall = (0.05, 0.95), (0.20, 0.98)
    how = ContactSampling(wide, tall, (7, 4), 5.0, 2.0, ahead=10.0)
    names = [
        (b, s, wide, flat if s == "floor" else tall) for b in ("blade", "splitter") for s in ("plus", "minus", "floor")
    ]
    catalogue = shop()
    picked = next(k for k, c in enumerate(catalogue.cutters) if c.diameter == 6.0)
    terms = Terms(600.0 / 60.0, 0.05, 60.0, 30.0, 15)
    divide("HECC", hecc(), catalogue, picked, TABLES[::2], names, how, terms)


def programs(folder: str) -> None:
    """The table of the ways of a result of the example `impeller`, by their verified programs."""
    (op,) = json.loads((Path(folder) / "summary.json").read_text())["operations"]
    print("| way | cutters [mm] | path [m] | cut [min] | links [min] | changes [min] | time [min] | predicted [min] | "
          "mean scallop of asked | verdict |\n|---|---|---:|---:|---:|---:|---:|---:|---:|---|")  # fmt: skip
    for way in op["ways"]:
        used = ", ".join(f"D {c['diameter_mm']:g} r {c['corner_radius_mm']:g}" for c in way["cutters"])
        keys = ("cutting_min", "link_min", "changes_min", "time_min", "predicted_min")
        times = " | ".join(f"{way[key]:.1f}" for key in keys)
        name = f"**{way['name']}**" if way["in_use"] else way["name"]
        print(f"| {name} | {used} | {way['path_mm'] / 1e3:.2f} | {times} | {way['scallop_mean_share']:.0%} | "
              f"{way['verdict']} |")  # fmt: skip


def search_inputs() -> SearchInputs:
    """What the search of the example takes."""
    job = load_job(Path(examples.__file__).parent / "impeller" / "job.toml").job
    impeller, catalogue = read_part(job).impeller, catalogue_named(job.catalogue)
    covering = impeller_run._cover_walls(job, impeller, catalogue)
    surfaces = impeller_run._surfaces(job, impeller, covering)
    table = impeller_run._tables(machine_named(job.machine), job.operation)
    return SearchInputs(surfaces, table, catalogue, job.operation.clearance_mm)


def block_seconds(inputs: SearchInputs, k: int, first: int, last: int) -> float:
    """Processor time of a task."""
    begin = time.process_time()
    surface_search._block(inputs, k, first, last)
    return time.process_time() - begin


def tasks() -> None:
    """The search of the example in tasks."""
    from distributed import LocalCluster

    inputs = search_inputs()
    each = [
        (k, a, b)
        for k, s in enumerate(inputs.surfaces)
        for a, b in surface_search.blocks_of(len(s.scene.contact), len(inputs.table.angle))
    ]
    surface_search._block(inputs, 0, 0, 1)
    took = sorted(block_seconds(inputs, *one) for one in each)
    whole = sum(took) / sum(len(s.scene.contact) for s in inputs.surfaces) / len(inputs.table.angle)
    print(f"{len(took)} tasks of {surface_search.PAIRS} pairs of contact point and table angle or more")
    print(f"processor time of a task: {took[0]:.3f} s at least, {took[len(took) // 2]:.3f} s in the middle, "
          f"{took[-1]:.3f} s at most; {1e3 * whole:.2f} ms a pair")  # fmt: skip
    rows = []
    before = sum(os.times()[:4])

    def searched(name: str, where: Workers) -> None:
        begin = time.perf_counter()
        with where.team() as team:
            keep = KeptParts(None, "", None if where.alone else team)
            keep.share(inputs)
            found = surface_search.searched_surfaces(inputs, keep, not where.alone)
        rows.append((name, time.perf_counter() - begin, part_bytes(tuple((x.answer, x.one) for x in found))))

    searched("one process, two threads", Workers(1))
    spent = [before, sum(os.times()[:4])]
    searched("two processes", Workers(2))
    for child in multiprocessing.active_children():
        child.join(10.0)
    spent.append(sum(os.times()[:4]))
    with LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None) as cluster:
        searched("Dask, two workers", Workers(dask=cluster.scheduler_address))
    for name, seconds, found in rows:
        print(f"{name}: {seconds:.1f} s elapsed, {'the same bytes' if found == rows[0][2] else 'OTHER BYTES'}")
    print(f"processor time: one process {spent[1] - spent[0]:.1f} s, two with their start {spent[2] - spent[1]:.1f} s; "
          f"load {os.getloadavg()[0]:.0f} on {os.cpu_count()} cores")  # fmt: skip


def removal(path: Path) -> None:
    """Processor time of the simulation of the programs in the blank beside that of the rest of a run."""
    spent: list[float] = []
    simulated = impeller_run.with_removal

    def timed_removal(*given, **named):
        begin = time.process_time()
        found = simulated(*given, **named)
        spent.append(time.process_time() - begin)
        return found

    impeller_run.with_removal = timed_removal
    begin = time.process_time()
    done = run_job(load_job(path))
    whole = time.process_time() - begin
    outcome = done.outcome
    found = [(name, one.removal) for name, one in table_programs(outcome) if one.removal is not None]
    found += [(name, one.removal) for name, one in five_axis_programs(outcome) if one.removal is not None]
    print("| program | steps | removed [mm3] | greatest force [N] | verdict |\n|---|---:|---:|---:|---|")
    for name, one in found:
        n = one.numbers()
        force = f"{n['force_n']:.0f}" if "force_n" in n else ""
        print(f"| {name} | {n['steps']} | {n.get('removed_mm3', 0.0):.0f} | {force} | {one.verdict.value} |")
    steps, inside = sum(one.numbers()["steps"] for _, one in found), sum(spent)
    print(f"{steps} steps: {inside:.1f} s of processor time in the blank, {whole - inside:.1f} s for the rest; "
          f"load {os.getloadavg()[0]:.0f} on {os.cpu_count()} cores")  # fmt: skip


if __name__ == "__main__":
    if "--removal" in sys.argv:
        after = sys.argv[sys.argv.index("--removal") + 1 :]
        removal(Path(after[0]) if after else Path(examples.__file__).parent / "impeller" / "job.toml")
        sys.exit()
    if "--tasks" in sys.argv:
        tasks()
    elif "--patches" in sys.argv:
        patches()
    elif "--programs" in sys.argv:
        programs(sys.argv[sys.argv.index("--programs") + 1])
    else:
        paper()
    if "--large" in sys.argv:
        large(sys.argv[sys.argv.index("--out") + 1] if "--out" in sys.argv else None)
