"""Verification of a plan in the plane from the path of the cutter's centre alone.

Notation: R cutter radius. Compared are the planned engagement against that of the rim with the uncut stock, the
finished wall against the path (gouge, excess), and rapids below the stock's top against what still stands there.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from chipload.errors import Cancelled, InputError
from chipload.geometry.contour import Contour, Region
from chipload.lazy import LateModule
from chipload.number_text import number_text
from chipload.program.program import ARC_CCW, ARC_CW, LINE, RAPID, Program
from chipload.progress import Progress, silent
from chipload.simulation.centre_path import LEVEL_MM, CentrePath, flat_motions, motion_rows, rim_engagement
from chipload.simulation.wall_distance import GreatestDistance, excess, gouge

_centre_path = LateModule("chipload.simulation._centre_path")

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]

#: a row of the history lies on the program's path within this [mm]
MATCH_MM = 1e-6
#: where a rim lies on the edge of an earlier disc there is no one engagement: that this far [mm] before counts too
BEFORE_MM = 1e-5
#: stock that a rapid passes through counts when it is thicker than this [mm]
RAPID_MM = 1e-6
#: rows between two calls of ``progress``
CHUNK = 4096
#: spacing on the rim [deg] at first, and where a row disagrees
COARSE_DEG, FINE_DEG = 1.0, 1.0 / 16.0

Place = tuple[float, float]


@dataclass(frozen=True)
class Verification:
    """The verdict on a plan.

    ``verdict``: `proved`, every comparison was made and holds; `failed`, at least one does not, ``reasons`` say which
    and where; `unproven`, none failed but something could not be compared, ``reasons`` say what.
    ``engagement_difference_deg`` the greatest |planned - found| and its centre; ``gouge_mm`` and ``excess_mm`` the
    greatest and their places on the wall; ``rapids`` the centres [mm] of rapids that meet stock;
    ``compared`` rows of the history held against the centre path; ``samples`` points and moments checked;
    ``text`` one line that says what was compared.
    """

    verdict: Literal["proved", "failed", "unproven"]
    engagement_difference_deg: float
    engagement_at: Place
    gouge_mm: float
    gouge_at: Place
    excess_mm: float
    excess_at: Place
    rapids: tuple[Place, ...]
    compared: int
    samples: int
    reasons: tuple[str, ...]
    text: str


@dataclass(frozen=True, eq=False)
class Level:
    """One height of the program: its centre path, and what lies above it up to ``top``."""

    z: float
    top: float
    centre_path: CentrePath


def verify_contour(
    program: Program,
    radius: float,
    history: Mapping[str, NDArray[Any]],
    *,
    stock: Region | None,
    stock_top_mm: float,
    wall: Sequence[Contour],
    material: str,
    engagement_tolerance_deg: float,
    gouge_tolerance_mm: float,
    excess_tolerance_mm: float,
    passes: Sequence[str] | None = None,
    wall_below: tuple[float, Sequence[Contour]] | None = None,
    step_mm: float = 0.05,
    workers: int = 1,
    progress: Progress = silent,
) -> Verification:
    """Compare a planned program with the path of its own motions.

    Parameters
    ----------
    program : motions in the XY plane, at one or more heights; rapids included
    radius : R [mm]
    history : columns `x_mm`, `y_mm`, `z_mm`, `engagement_deg`, `pass`, one row for each step in program order
    stock : the stock before row 0 of the program, in the plane; None: solid everywhere
    stock_top_mm : motions wholly at or above this height cut nothing
    wall : the finished part's wall, empty where there is none to compare with
    material : the part is `left` or `right` of the wall's travel
    engagement_tolerance_deg, gouge_tolerance_mm, excess_tolerance_mm : what is still proved
    passes : values of `pass` whose engagement is compared; None: all
    wall_below : a height [mm], and the wall of what is cut below it; None: the wall is the same at all heights
    step_mm : spacing on path and wall for gouge, excess and rapids [mm]
    workers : threads; the answer does not depend on it
    progress : called with the share done; if it raises Cancelled, the verdict so far is returned, `unproven` at best

    Raises
    ------
    InputError
        A column is missing, columns differ in length, a tolerance is not above 0.

    Notes
    -----
    A row is found on the path by its place: the first place within ``MATCH_MM`` at or after that of the row before
    it. At a joint of two motions, where the heading may jump, it is held against both headings and the nearer counts.
    So the place of the cutter is known to ``MATCH_MM``. Where the engagement that is found differs from the planned
    one, the least and the greatest that a displacement by ``MATCH_MM`` makes are found too, and a planned engagement
    between them agrees: stock of 1 nm beside a cutter of R 5 mm is an engagement of 0.036 deg, and a rim that lies on
    the edge of an earlier cut is engaged by anything between nothing and the whole of that edge.
    Rows on motions that rise or fall below the stock's top (ramps, plunges) are not compared: that leaves the plan
    unproven, unless ``passes`` leaves them out. Rows above the stock's top must show no engagement.
    """
    columns = _columns(history)
    _need_tolerances(
        stock, engagement_tolerance_deg=engagement_tolerance_deg,
        gouge_tolerance_mm=gouge_tolerance_mm, excess_tolerance_mm=excess_tolerance_mm,
    )  # fmt: skip
    failed: list[str] = []
    open_: list[str] = []
    difference = cleft = remains = GreatestDistance(0.0, (0.0, 0.0), 0)
    hits: list[Place] = []
    compared = samples = 0
    try:
        levels = levels_of(program, radius, stock, stock_top_mm)
        if not levels:
            open_.append("the program has no level cutting motion below the stock's top")
        progress(0.05, "centre path")
        hits, samples = _rapids_through_stock(program, levels, step_mm, failed)
        progress(0.15, "rapids")
        if wall:
            cleft, remains, points = _wall(levels, wall, wall_below, material, step_mm)
            samples += points
            if cleft.value_mm > gouge_tolerance_mm:
                failed.append(_exceeds("gouge", cleft, "mm", gouge_tolerance_mm))
            if remains.value_mm > excess_tolerance_mm:
                failed.append(_exceeds("excess", remains, "mm", excess_tolerance_mm))
        progress(0.3, "wall")
        difference, compared = _compare(
            program, levels, columns, passes, stock_top_mm, engagement_tolerance_deg, workers, progress, failed, open_
        )
        samples += compared
        if difference.value_mm > engagement_tolerance_deg:
            failed.append(_exceeds("engagement differs by", difference, "deg", engagement_tolerance_deg))
    except Cancelled:
        open_.append("stopped before the end")
    compared_with = f"{compared} of {len(columns['x_mm'])} rows against the centre path of {len(program)} motions"
    return _verification(
        compared_with, bool(wall), difference, cleft, remains, hits, (compared, samples), failed, open_
    )


def _rapids_through_stock(
    program: Program, levels: Sequence[Level], step: float, failed: list[str]
) -> tuple[list[Place], int]:
    """Places of rapids in the stock of the levels, and how many points were checked; adds findings to ``failed``."""
    hits: list[Place] = []
    samples = 0
    for level in levels:
        found, points = _rapids(program, level, step)
        hits += found
        samples += points
    if hits:
        x, y = hits[0]
        failed.append(f"rapid through stock at ({x:.4f}, {y:.4f}), {len(hits)} motions in all")
    return hits, samples


def _verification(
    what: str,
    wall: bool,
    difference: GreatestDistance,
    cleft: GreatestDistance,
    remains: GreatestDistance,
    hits: Sequence[Place],
    counts: tuple[int, int],
    failed: Sequence[str],
    open_: Sequence[str],
) -> Verification:
    """The verdict on ``what`` was compared, from what was found."""
    verdict: Literal["proved", "failed", "unproven"] = "failed" if failed else "unproven" if open_ else "proved"
    against = (
        f"gouge {number_text(cleft.value_mm * 1e3, 3)} µm, excess {number_text(remains.value_mm * 1e3, 3)} µm"
        if wall
        else "no wall given"
    )
    within = f"engagement within {difference.value_mm:.3g} deg"
    text = f"{verdict}: {what}, {within}; {against}; {len(hits)} rapids through stock"
    return Verification(
        verdict,
        difference.value_mm,
        difference.at,
        cleft.value_mm,
        cleft.at,
        remains.value_mm,
        remains.at,
        tuple(hits),
        *counts,
        (*failed, *open_),
        text,
    )


def _need_tolerances(stock: Region | None, **tolerances: float) -> None:
    """Refuse a tolerance that is not above 0, and a stock without a contour."""
    for name, value in tolerances.items():
        if not value > 0.0:
            raise InputError(f"verify: {name} = {value:g}: must be above 0")
    if stock is not None and not stock.contours:
        raise InputError("verify: the stock has no contour: pass None for material everywhere")


def _wall(
    levels: Sequence[Level],
    wall: Sequence[Contour],
    wall_below: tuple[float, Sequence[Contour]] | None,
    material: str,
    step: float,
) -> tuple[GreatestDistance, GreatestDistance, int]:
    """The greatest gouge and excess of all levels, and the number of checked points."""
    cleft = remains = GreatestDistance(0.0, (0.0, 0.0), 0)
    samples = 0
    for level in levels:
        own = wall_below[1] if wall_below is not None and level.z < wall_below[0] - LEVEL_MM else wall
        cleft = max(cleft, gouge(level.centre_path, own, material, step), key=lambda v: v.value_mm)
        remains = max(remains, excess(level.centre_path, own, step), key=lambda v: v.value_mm)
        samples += cleft.samples + remains.samples
    return cleft, remains, samples


def _exceeds(what: str, worst: GreatestDistance, unit: str, limit: float) -> str:
    x, y = worst.at
    return f"{what} {worst.value_mm:.6g} {unit} at ({x:.4f}, {y:.4f}): limit {limit:g} {unit}"


def _columns(history: Mapping[str, NDArray[Any]]) -> dict[str, NDArray[Any]]:
    out: dict[str, NDArray[Any]] = {}
    for name in ("x_mm", "y_mm", "z_mm", "engagement_deg", "pass"):
        if name not in history:
            raise InputError(f"history: column {name} is missing")
        out[name] = np.asarray(history[name], dtype=object if name == "pass" else np.float64)
        if len(out[name]) != len(out["x_mm"]):
            raise InputError(f"history.{name}: {len(out[name])} rows: must be {len(out['x_mm'])} as in x_mm")
        if name != "pass" and not np.isfinite(out[name]).all():
            raise InputError(f"history.{name}: a value is not a finite number")
    return out


def heights_of(program: Program) -> tuple[Floats, Floats]:
    """Heights (n,) at which the motions begin and end; row 0 begins where it ends."""
    z1 = program.p_work[:, 2]
    return np.concatenate([z1[:1], z1[:-1]]), z1


def levels_of(program: Program, radius: float, stock: Region | None, top: float) -> list[Level]:
    """The heights of level cutting motions below the stock's top, the lowest last."""
    z0, z1 = heights_of(program)
    cuts = np.isin(program.motion, (LINE, ARC_CW, ARC_CCW)) & (np.abs(z1 - z0) <= LEVEL_MM) & (z1 < top - LEVEL_MM)
    heights: list[float] = []
    for z in np.sort(z1[cuts])[::-1]:
        if not heights or heights[-1] - z > LEVEL_MM:
            heights.append(float(z))
    tops = [top, *heights[:-1]]
    return [Level(z, t, CentrePath.of_program(program, radius, stock, z)) for z, t in zip(heights, tops, strict=True)]


def _rapids(program: Program, level: Level, step: float) -> tuple[list[Place], int]:
    """Centres at which rapids meet uncut stock of this level, one a motion, and the number of checked points.

    The part of a rapid below the level's top sweeps its front half rim, ``RAPID_MM`` smaller than the cutter, through
    what stood before it; one that comes from above is also checked over its whole disc, in 8 rings of 64 points.
    """
    z0, z1 = heights_of(program)
    below = np.minimum(z0, z1) < level.top - LEVEL_MM
    at = np.flatnonzero((program.motion == RAPID) & below)
    at = at[at > 0]
    hits: list[Place] = []
    count = 0
    if not len(at):
        return hits, count
    centres, path = level.centre_path, CentrePath(flat_motions(program), level.centre_path.radius)
    reach = centres.radius - RAPID_MM
    front = np.linspace(0.0, np.pi, 181)
    around = np.linspace(0.0, 2.0 * np.pi, 64, endpoint=False)
    ring = np.column_stack([np.cos(around), np.sin(around)])
    disc = np.vstack([[[0.0, 0.0]], *(ring * reach * j / 8.0 for j in range(1, 9))])
    for k in at:
        z, rise = level.top, z1[k] - z0[k]
        first = 0.0 if z0[k] <= z else float((z - z0[k]) / rise)
        last = 1.0 if z1[k] <= z else float((z - z0[k]) / rise)
        n = max(1, int(np.ceil(path.lengths[k] * (last - first) / step)))
        share = np.linspace(first, last, n + 1)
        o, t = path.places(np.full(n + 1, k), share)
        left = np.column_stack([-t[:, 1], t[:, 0]])
        points = o[:, None] + reach * (np.sin(front)[:, None] * t[:, None] + np.cos(front)[:, None] * left[:, None])
        points = points.reshape(-1, 2)
        owner = np.repeat(np.arange(n + 1), len(front))
        if first > 0.0 or not t.any():
            points = np.vstack([o[0] + disc, points])
            owner = np.concatenate([np.zeros(len(disc), dtype=np.int64), owner])
        count += len(points)
        still = centres.uncut(points, np.full(len(points), k - 1), np.ones(len(points)))
        if still.any():
            x, y = o[owner[int(still.argmax())]]
            hits.append((float(x), float(y)))
    return hits, count


def _compare(
    program: Program,
    levels: Sequence[Level],
    columns: Mapping[str, NDArray[Any]],
    passes: Sequence[str] | None,
    top: float,
    tolerance: float,
    workers: int,
    progress: Progress,
    failed: list[str],
    open_: list[str],
) -> tuple[GreatestDistance, int]:
    """Greatest difference of the engagement [deg] with its centre, and the number of rows compared."""
    x, y, z = columns["x_mm"], columns["y_mm"], columns["z_mm"]
    points = np.ascontiguousarray(np.column_stack([x, y]))
    m = len(points)
    mot = motion_rows(flat_motions(program))
    z0, z1 = heights_of(program)
    k, w = np.zeros(m, dtype=np.int64), np.zeros(m)
    found = int(_centre_path.locate(points, np.ascontiguousarray(z), mot, z0, z1, MATCH_MM, LEVEL_MM, k, w))
    if found < m:
        failed.append(f"history row {found} at ({x[found]:.4f}, {y[found]:.4f}, {z[found]:.4f}) is not on the path")
    wanted = np.ones(m, dtype=np.bool_) if passes is None else np.isin(columns["pass"].astype(str), list(passes))
    wanted[found:] = False
    length = CentrePath(flat_motions(program), 1.0).lengths
    joint_k, joint_w = _other_side(k, w, length)
    done = np.zeros(m, dtype=np.bool_)
    air = wanted & (z >= top - LEVEL_MM)
    done |= air
    gap = np.where(air, np.abs(columns["engagement_deg"]), 0.0)
    total, finished = max(int((wanted & ~air).sum()), 1), 0
    for level in levels:
        flat = np.abs(z - level.z) <= LEVEL_MM
        still = (np.abs(z1[k] - z0[k]) > LEVEL_MM) | (length[k] == 0.0)
        one = wanted & flat & ~air & ~still
        # a row at the end of a plunge is the beginning of the motion after it
        two = wanted & flat & ~air & (joint_k >= 0)
        two &= (np.abs(z1[joint_k] - z0[joint_k]) <= LEVEL_MM) & (length[joint_k] > 0.0)
        for rows in np.array_split(np.flatnonzero(one | two), max(1, int((one | two).sum()) // CHUNK)):
            best = np.full(len(rows), np.inf)
            for mine, kk, ww in ((one, k, w), (two, joint_k, joint_w)):
                use = np.flatnonzero(mine[rows])
                at = rows[use]
                planned = columns["engagement_deg"][at]
                off = np.abs(_degrees(level.centre_path, kk[at], ww[at], COARSE_DEG, workers) - planned)
                # a row that agrees on one side of a joint needs no finer check on the other
                again = np.flatnonzero((off > tolerance) & (best[use] > tolerance))
                if len(again):
                    j = at[again]
                    off[again] = _difference(level.centre_path, kk[j], ww[j], planned[again], tolerance, workers)
                best[use] = np.minimum(best[use], off)
            stuck = np.flatnonzero((best > tolerance) & one[rows])
            if len(stuck):
                at = rows[stuck]
                just_before = np.maximum(w[at] - BEFORE_MM / length[k[at]], 0.0)
                there = _degrees(level.centre_path, k[at], just_before, FINE_DEG, workers)
                best[stuck] = np.minimum(best[stuck], np.abs(there - columns["engagement_deg"][at]))
            gap[rows] = best
            done[rows] = True
            finished += len(rows)
            progress(0.3 + 0.7 * finished / total, "engagement")
    left_out = int((wanted & ~done).sum())
    if left_out:
        first = int(np.flatnonzero(wanted & ~done)[0])
        open_.append(
            f"{left_out} rows on rising or falling motions, the first at ({x[first]:.4f}, {y[first]:.4f}), not compared"
        )
    if not done.any():
        open_.append("no row of the history was compared")
        return GreatestDistance(0.0, (0.0, 0.0), 0), 0
    i = int(np.argmax(np.where(done, gap, -1.0)))
    return GreatestDistance(float(gap[i]), (float(x[i]), float(y[i])), int(done.sum())), int(done.sum())


def _degrees(
    centres: CentrePath, k: Ints, w: Floats, step_deg: float, workers: int, displacement_mm: float = 0.0
) -> Floats:
    rim = rim_engagement(centres, k, w, step_deg=step_deg, workers=workers, displacement_mm=displacement_mm)
    return np.degrees(rim.angle)


def _difference(centres: CentrePath, k: Ints, w: Floats, planned: Floats, tolerance: float, workers: int) -> Floats:
    """(m,) |found - planned| [deg]; where a displacement by at most ``MATCH_MM`` makes an engagement within
    ``tolerance`` of the planned one, only what is between them.
    """
    found, low, high = (_degrees(centres, k, w, FINE_DEG, workers, d) for d in (0.0, MATCH_MM, -MATCH_MM))
    apart = np.maximum(np.maximum(low - planned, planned - high), 0.0)
    return np.where(apart <= tolerance, np.minimum(apart, np.abs(found - planned)), np.abs(found - planned))


def _other_side(k: Ints, w: Floats, length: Floats) -> tuple[Ints, Floats]:
    """For a moment at a joint, the moment on the other side of it: the beginning of the next motion that has a
    length, or the end of the one before; -1 where there is none.
    """
    n = len(length)
    moves = np.flatnonzero(length > 0.0)
    other, share = np.full(len(k), -1, dtype=np.int64), np.zeros(len(k))
    if not len(moves):
        return other, share
    after = np.append(moves, -1)[np.searchsorted(moves, np.arange(n), side="right")]
    before = np.concatenate([[-1], moves])[np.searchsorted(moves, np.arange(n), side="left")]
    at_end = ((1.0 - w) * length[k] <= MATCH_MM) & (after[k] >= 0)
    at_start = ~at_end & (w * length[k] <= MATCH_MM) & (before[k] >= 0)
    other[at_end] = after[k[at_end]]
    other[at_start] = before[k[at_start]]
    share[at_start] = 1.0
    return other, share
