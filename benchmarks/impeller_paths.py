"""The compiled loops of an impeller's paths beside the same in NumPy, in processor time of one run.

    python benchmarks/impeller_paths.py [--lines]

``--lines``: only the processor time of the finishing lines on a part of a blade, with scallop, pallet angles and the
walls between the check points, the second of two times.

A piece of a blade of the impeller by formula, two lines 1.2 mm apart, 200 places along them, 15 between them; 20,000
points of the blade's surface.
"""

import argparse
import math
import time
from dataclasses import replace

import numpy as np

from chipload.cutter.catalogue import CatalogueCutter
from chipload.geometry.bspline import BSplinePatch, basis
from chipload.planning.impeller import _scallop
from chipload.planning.impeller.covering.covering import covering_of
from chipload.planning.impeller.lines import LineMotion
from chipload.planning.impeller.parametric import ImpellerShape, impeller_of
from chipload.planning.impeller.paths import PatchFinish, finish_tracks
from chipload.planning.impeller.scallop_height import distance, shares
from chipload.planning.impeller.settings import channel_scene
from chipload.planning.impeller.surfaces import ContactSampling, hub_range
from chipload.planning.impeller.track import pose_cutter

CUTTER, TABLE, WIDE = CatalogueCutter(12.0, 2.0), math.radians(55.0), 8


def points_in_numpy(patch: BSplinePatch, u, v):
    """Points (k, 3) of a surface."""
    p, q = patch.degrees
    i, N = basis(patch.knots_u, p, u)
    j, M = basis(patch.knots_v, q, v)
    rows = patch.control[i[:, None, None] + np.arange(p + 1)[:, None], j[:, None, None] + np.arange(q + 1)]
    return np.einsum("ki,kj,kijd->kd", N, M, rows)


def heights_in_numpy(points, normals, tips, axes):
    """Crests (n,) between two lines, at the places given."""
    n, k, _ = points.shape
    rho, corner = CUTTER.rho, CUTTER.corner_radius
    away = np.full((n, k), np.inf)
    best_tip, best_axis = np.zeros((n, k, 3)), np.zeros((n, k, 3))
    for p, a in zip(tips, axes, strict=True):
        j = np.arange(n)[:, None] + np.arange(-WIDE, WIDE + 1)
        ok = (j >= 0) & (j < n)
        j = np.clip(j, 0, n - 1)
        D = np.where(ok[:, None], distance(points[:, :, None], p[j][:, None], a[j][:, None], rho, corner), 1e9)
        at = D.argmin(axis=2)
        rows, cols = np.indices(at.shape)
        inner = np.clip(at, 1, D.shape[2] - 2)
        d0, d1, d2 = (D[rows, cols, inner + x] for x in (-1, 0, 1))
        bend = d0 - 2.0 * d1 + d2
        good = (inner == at) & (bend > 0.0) & (np.maximum(d0, d2) < 1e8)
        low = np.where(good, d1 - (d2 - d0) ** 2 / (8.0 * np.where(good, bend, 1.0)), D[rows, cols, at])
        nearer = low < away
        which = j[rows, at]
        away = np.where(nearer, low, away)
        best_tip[nearer], best_axis[nearer] = p[which][nearer], a[which][nearer]
    D0 = distance(points, best_tip, best_axis, rho, corner)
    D1 = distance(points + D0[..., None] * normals, best_tip, best_axis, rho, corner)
    falls = (D0 > 0.0) & (0.2 * D0 < D0 - D1)
    return (away * np.where(falls, D0 / np.where(falls, D0 - D1, 1.0), 1.0)).max(axis=1)


def timed(work, times: int = 5) -> tuple[object, float]:
    """What a call gives and its least processor time [s]; it is called once before, to be compiled."""
    work()
    took = []
    for _ in range(times):
        begin = time.process_time()
        out = work()
        took.append(time.process_time() - begin)
    return out, min(took)


def time_lines() -> None:
    """Print the processor time of the finishing lines on a part of a blade, as the impeller example asks for them."""
    impeller = impeller_of(ImpellerShape())
    scene = channel_scene(impeller, ContactSampling((0.0, 1.0), (0.0, 1.0), (2, 2), 1.0, 2.0))
    covering = covering_of(impeller, 0.05, CUTTER.corner_radius, 1, hub_range(impeller, 0.0))
    scene = replace(scene, covering=covering, known=scene.tree)
    finish = PatchFinish(0.1, LineMotion(0.005, 100.0 / 60.0, 0.5, 0.5, scallop=0.1), 1.5)
    for _ in range(2):
        begin = time.process_time()
        found = finish_tracks(impeller.blade.plus, "u", ((0.05, 0.95), (0.35, 0.98)), scene, 0, CUTTER, TABLE, finish)
        took = time.process_time() - begin
    print(f"{found.lines} lines, {found.length:.6f} mm, {len(found.missed)} missed spans: {took:.2f} s")


def main() -> None:
    """Print the table."""
    ask = argparse.ArgumentParser(description=__doc__)
    ask.add_argument("--lines", action="store_true", help="only the finishing lines on a part of a blade")
    if ask.parse_args().lines:
        time_lines()
        return
    patch = impeller_of(ImpellerShape()).blade.plus
    rng = np.random.default_rng(1)
    u, v = rng.random(20000), rng.random(20000)
    rows = [("points of a surface", timed(lambda: points_in_numpy(patch, u, v)), timed(lambda: patch.at(u, v)))]
    n, share = 200, shares()
    x = np.linspace(0.3, 0.5, n)
    step = 1.2 / float(np.linalg.norm(patch.at(0.4, 0.6, 0, 1)))
    lines = (np.full(n, 0.6), np.full(n, 0.6 + step))
    poses = [pose_cutter(patch.at(x, q), patch.normal(x, q), TABLE, np.full(n, 0.4), CUTTER) for q in lines]
    tips, axes = (np.stack([p[k] for p in poses]) for k in (0, 1))
    at = np.repeat(x, len(share)), (lines[0][:, None] + share * step).ravel()
    points, normals = (f(*at).reshape(n, len(share), 3) for f in (patch.at, patch.normal))
    wide, out = np.array([WIDE, WIDE]), np.empty(n)

    both = np.ascontiguousarray(np.concatenate([tips, axes], axis=2).transpose(0, 2, 1))

    def compiled():
        _scallop.heights(points, normals, both, wide, CUTTER.rho, CUTTER.corner_radius, 0, out)
        return out.copy()

    rows.append(("crest between two lines", timed(lambda: heights_in_numpy(points, normals, tips, axes)),
                 timed(compiled)))  # fmt: skip
    print("| | NumPy [ms] | compiled [ms] | times | greatest difference [mm] |\n|---|---:|---:|---:|---:|")
    for name, (a, slow), (b, fast) in rows:
        print(f"| {name} | {1e3 * slow:.1f} | {1e3 * fast:.1f} | {slow / fast:.0f} | {np.abs(a - b).max():.1e} |")


if __name__ == "__main__":
    main()
