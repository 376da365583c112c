"""The largest cutters of the paper's problem, certified, against its own sampled test; and cost against both numbers.

    python benchmarks/impeller.py [--large]

Reference: [Wu2019]: 100 contact points, 2900 check points, 15 table angles, 36 diameters. The impeller is the one by
formula. Its method, compiled the same way on the same two threads: for every table angle, diameter, contact point and
pallet angle of a 1 deg grid every check point is tested against the cutter; the test of one pallet angle ends at the
first check point that is met. It is timed twice: all pallet angles (it wants the valid ranges), and ending at the first
valid one. Ours finds the largest cutter of every contact point with proof (``best``), then that of every table angle
too (``every``); the whole answer adds the second corner radius and the exact ranges of B.
"""

import math
import sys
import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from numba import njit

from chipload.cutter.catalogue import catalogue_named
from chipload.planning.sectional.answer import largest_cutters
from chipload.planning.sectional.parametric import Shape, impeller_of
from chipload.planning.sectional.search import limits

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
    return impeller_of(Shape()).scene(0, "plus", (u, v), (along, along), NEAR, around, (along, along))


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
    print(f"whole answer {time.perf_counter() - begun:8.3f} s  both corner radii, ranges of B, certified "
          f"{answer.certified.mean():.0%}, {len(answer.unreachable)} unreachable")  # fmt: skip
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


def large() -> None:
    for contact, check in (
        (100, 100_000),
        (1000, 1000),
        (1000, 10_000),
        (1000, 100_000),
        (10_000, 1000),
        (10_000, 100_000),
    ):
        scene = scene_of(contact, check)
        found, took, _ = timed(scene, TABLES[5:6], True)
        print(f"{len(scene.contact):6d} x {len(scene.check):6d}  {took:8.2f} s  certified {found.certified.mean():.2%}")


if __name__ == "__main__":
    paper()
    if "--large" in sys.argv:
        large()
