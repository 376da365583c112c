"""Largest cutter of a catalogue at every contact point, and the largest single cutter for all contact points.

Notation: R cutter radius, r corner radius, rho = R - r; a family is the cutters of one r. rho* of a family
(``search.py``) is a proved bound, tested with the cutting part alone; the cutters below it are tried from the largest
down, each with its neck, shank and holder, by their exact ranges of the pallet angle. Where the scene has a covering,
those ranges hold on the walls between the check points too, within its tolerance (``covering/``).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipload.cutter.catalogue import Catalogue, CatalogueCutter
from chipload.planning.impeller.blocks import BLOCK
from chipload.planning.impeller.pallet_ranges import FULL, valid_ranges
from chipload.planning.impeller.scene import Floats, Ints, Scene
from chipload.planning.impeller.search import CURVATURE, Sampling, SearchLimits, limits
from chipload.progress import Progress, silent


@dataclass(frozen=True)
class Unreachable:
    """A contact point that no cutter of the catalogue mills.

    ``reason``: `turned away` (no table angle faces it), `curvature` (every corner radius is larger than the radius of
    curvature), `cutting part` (the smallest cutter meets the ``blockers``), `above` (neck, shank or holder meets them),
    `between` (each cutter that is clear of the check points meets a wall between them);
    ``fits`` [mm] the diameter that would, with ``fits_corner``; nan: none does.
    """

    point: int
    reason: str
    blockers: tuple[int, ...]
    fits: float
    fits_corner: float

    def __str__(self) -> str:
        would = f"D {self.fits:.3f} r {self.fits_corner:g} mm would fit" if self.fits > 0.0 else "no diameter would fit"
        return f"contact point {self.point}: {self.reason}: {would}"


@dataclass(frozen=True, eq=False)
class Answer:
    """Largest cutter at each contact point of a scene, or of a selection of them, with its table and pallet angles.

    Parameters
    ----------
    catalogue, tables : what was searched; tables [rad]
    families : proved bounds, one for each corner radius
    cutter : (c,) int, index in the catalogue; -1: unreachable
    table : (c,) int, index of the table angle
    ranges : for each contact point (k, 2) pallet angles [rad] at which that cutter is clear
    blockers : for each contact point check points that forbid the cutters tried above it; with those of the families
    bounded : (c,) bool, no larger cutter of the catalogue goes at any table and pallet angle: proved
    certified : (c,) bool, that, and no wall lies deeper in the cutter than ``tolerance`` at any angle of its ranges
    tolerance : [mm] of the scene's covering; None: it has none, nothing is certified
    unreachable : what is not reached, and why
    """

    catalogue: Catalogue
    tables: Floats
    families: tuple[SearchLimits, ...]
    cutter: Ints
    table: Ints
    ranges: tuple[Floats, ...]
    blockers: tuple[Ints, ...]
    bounded: NDArray[np.bool_]
    certified: NDArray[np.bool_]
    tolerance: float | None
    unreachable: tuple[Unreachable, ...]

    @property
    def diameter(self) -> Floats:
        """Diameter of the largest cutter (c,) [mm]; 0: unreachable."""
        sizes = np.array([c.diameter for c in self.catalogue.cutters] + [0.0])
        return sizes[self.cutter]


def largest_cutters(
    scene: Scene,
    catalogue: Catalogue,
    tables: ArrayLike,
    clearance: float,
    every: bool = True,
    pallets: ArrayLike = FULL,
    sampling: Sampling | None = None,
    workers: int = 1,
    progress: Progress = silent,
    points: ArrayLike | None = None,
) -> Answer:
    """Largest cutter of the catalogue at each contact point, over the table angles [rad] and all pallet angles.

    Parameters
    ----------
    clearance : [mm] of neck, shank and holder
    every : as :func:`limits`
    points : (c,) int, which contact points; None: all. :func:`join_answers` makes one answer of several selections
    """
    alpha = np.atleast_1d(np.asarray(tables, dtype=np.float64))
    among = np.arange(len(scene.contact)) if points is None else np.asarray(points, dtype=np.int64)
    families = tuple(
        _family(scene, catalogue.family(r), alpha, every, pallets, sampling, workers, progress, among)
        for r in catalogue.families
    )
    c = len(among)
    cutter, table = np.full(c, -1), np.zeros(c, dtype=np.int64)
    empty = np.zeros((0, 2))
    ranges, refused = [empty] * c, [np.zeros(0, dtype=np.int64)] * c
    bounded = np.logical_and.reduce([f.certified.all(axis=1) for f in families])
    between = np.zeros(c, dtype=np.bool_)
    waiting = [_candidates(catalogue, families, k) for k in range(c)]
    place = np.zeros(c, dtype=np.int64)
    open_points = [k for k in range(c) if waiting[k]]
    while open_points:
        groups: dict[int, list[int]] = {}
        for k in open_points:
            groups.setdefault(waiting[k][place[k]][0], []).append(k)
        for index, members in sorted(groups.items()):
            which = among[members]
            tried = np.array([waiting[k][place[k]][1] for k in members])
            got = valid_ranges(
                scene, catalogue.cutters[index], alpha[tried], clearance, pallets, which, workers=workers
            )
            for j, k in enumerate(members):
                if len(got.ranges[j]):
                    cutter[k], table[k], ranges[k] = index, tried[j], got.ranges[j]
                else:
                    refused[k] = got.blockers[j]
                    bounded[k] &= got.complete[j]
                    between[k] |= got.between[j]
                    place[k] += 1
        open_points = [k for k in open_points if cutter[k] < 0 and place[k] < len(waiting[k])]
    blockers = tuple(np.unique(np.concatenate([refused[k], *(_proof(f, k) for f in families)])) for k in range(c))
    missed = tuple(
        _reason(scene, families, int(k), int(among[k]), bool(waiting[k]), bool(between[k]), blockers[k])
        for k in np.flatnonzero(cutter < 0)
    )
    proves = np.array([_proves(scene, one, clearance) for one in catalogue.cutters] + [scene.covering is not None])
    tolerance = None if scene.covering is None else scene.covering.tolerance
    return Answer(
        catalogue, alpha, families, cutter, table, tuple(ranges), blockers, bounded, bounded & proves[cutter],
        tolerance, missed,
    )  # fmt: skip


def join_answers(parts: Sequence[Answer]) -> Answer:
    """The answer of all contact points from those of selections that follow one another; the same to the last bit."""
    first = parts[0]
    families = tuple(_join_bounds([part.families[k] for part in parts]) for k in range(len(first.families)))
    return Answer(
        first.catalogue,
        first.tables,
        families,
        np.concatenate([x.cutter for x in parts]),
        np.concatenate([x.table for x in parts]),
        tuple(row for x in parts for row in x.ranges),
        tuple(row for x in parts for row in x.blockers),
        np.concatenate([x.bounded for x in parts]),
        np.concatenate([x.certified for x in parts]),
        first.tolerance,
        tuple(one for x in parts for one in x.unreachable),
    )


def _join_bounds(parts: Sequence[SearchLimits]) -> SearchLimits:
    """The bounds of a family; where a part has fewer blockers, its rows are filled up with -1."""
    blockers = np.full((*np.shape(parts[0].rho)[1:], max(f.blockers.shape[2] for f in parts)), -1, dtype=np.int64)
    rows = [np.repeat(blockers[None], len(f.rho), axis=0) for f in parts]
    for row, f in zip(rows, parts, strict=True):
        row[:, :, : f.blockers.shape[2]] = f.blockers
    return replace(
        parts[0],
        rho=np.concatenate([f.rho for f in parts]),
        bound=np.concatenate([f.bound for f in parts]),
        pallet=np.concatenate([f.pallet for f in parts]),
        certified=np.concatenate([f.certified for f in parts]),
        blockers=np.concatenate(rows),
    )


def _proves(scene: Scene, cutter: CatalogueCutter, clearance: float) -> bool:
    return scene.covering is not None and scene.covering.proves(cutter, clearance)


def one_cutter(
    scene: Scene, answer: Answer, clearance: float, pallets: ArrayLike = FULL, workers: int = 1
) -> tuple[int, int, tuple[Floats, ...]] | None:
    """Largest cutter that mills every reachable contact point at one table angle.

    Returns
    -------
    (index in the catalogue, index of the table angle, ranges of each reachable contact point), None: there is none.
    Needs an answer with ``every``.
    """
    found = one_cutter_of([(scene, answer)], clearance, pallets, workers)
    return None if found is None else (found[0], found[1], found[2][0])


def one_cutter_of(
    parts: Sequence[tuple[Scene, Answer]], clearance: float, pallets: ArrayLike = FULL, workers: int = 1
) -> tuple[int, int, tuple[tuple[Floats, ...], ...]] | None:
    """Largest cutter for several surfaces at one table angle; all were searched with the same catalogue and tables.

    Returns
    -------
    As :func:`one_cutter`, the ranges for each surface.
    """
    reachable = [np.flatnonzero(answer.cutter >= 0) for _, answer in parts]
    if not all(len(row) for row in reachable):
        return None
    catalogue, tables = parts[0][1].catalogue, parts[0][1].tables
    tries = []
    for k, cutter in enumerate(catalogue.cutters):
        bounds = [_bounds_of(answer, cutter) for _, answer in parts]
        goes = [left_open(f, cutter.rho)[row].all(axis=0) for f, row in zip(bounds, reachable, strict=True)]
        least = np.min([f.rho[row].min(axis=0) for f, row in zip(bounds, reachable, strict=True)], axis=0)
        tries += [(cutter.diameter, least[t], k, int(t)) for t in np.flatnonzero(np.logical_and.reduce(goes))]
    for _, _, k, t in sorted(tries, reverse=True):
        cutter, found = catalogue.cutters[k], []
        for (scene, answer), row in zip(parts, reachable, strict=True):
            rho = _bounds_of(answer, cutter).rho[:, t]
            got = _everywhere(
                scene, cutter, tables[t], clearance, pallets, row[np.argsort(rho[row], kind="stable")], workers
            )
            if got is None:
                break
            found.append(tuple(got[int(i)] for i in row))
        if len(found) == len(parts):
            return k, t, tuple(found)
    return None


def _everywhere(
    scene: Scene, cutter: CatalogueCutter, table: float, clearance: float, pallets: ArrayLike, order: Ints,
    workers: int,
) -> dict[int, Floats] | None:  # fmt: skip
    """Ranges of each contact point, those with least room tried first; None: somewhere there is none."""
    found: dict[int, Floats] = {}
    for part in (order[:BLOCK], order[BLOCK:]):
        got = valid_ranges(scene, cutter, table, clearance, pallets, part, workers=workers)
        if not all(len(row) for row in got.ranges):
            return None
        found |= {int(i): row for i, row in zip(part, got.ranges, strict=True)}
    return found


def _bounds_of(answer: Answer, cutter: CatalogueCutter) -> SearchLimits:
    """The bounds of a cutter's corner radius."""
    return next(f for f in answer.families if f.corner_radius == cutter.corner_radius)


def _family(
    scene: Scene, cutters: tuple[CatalogueCutter, ...], alpha: Floats, every: bool, pallets: ArrayLike,
    sampling: Sampling | None, workers: int, progress: Progress, points: Ints,
) -> SearchLimits:  # fmt: skip
    r = cutters[0].corner_radius
    rho = [c.rho for c in cutters]
    return limits(
        scene, alpha, r, max(rho), min(rho), shortest(cutters), every, pallets, sampling, workers, progress, points
    )


def shortest(cutters: Sequence[CatalogueCutter]) -> float:
    """Height above the corner's centres [mm] up to which every cutter of a family cuts."""
    return min(math.inf if c.cutting_length is None else c.cutting_length - c.corner_radius for c in cutters)


def _candidates(catalogue: Catalogue, families: tuple[SearchLimits, ...], k: int) -> list[tuple[int, int]]:
    """(cutter, table angle) within the bounds of contact point k, the largest diameter and the widest bound first."""
    out = []
    for index, cutter in enumerate(catalogue.cutters):
        f = next(f for f in families if f.corner_radius == cutter.corner_radius)
        out += [(-cutter.diameter, -f.bound[k, t], index, t) for t in np.flatnonzero(left_open(f, cutter.rho)[k])]
    return [(index, int(t)) for _, _, index, t in sorted(out)]


def left_open(f: SearchLimits, rho: float) -> NDArray[np.bool_]:
    """(c, t) where the bounds of a family do not exclude a cutter of it."""
    out: NDArray[np.bool_] = (rho < f.bound) | (rho <= f.rho)
    return out


def _proof(f: SearchLimits, k: int) -> Ints:
    every: Ints = f.blockers[k].ravel()
    out: Ints = every[every != -1]
    return out


def _reason(
    scene: Scene, families: tuple[SearchLimits, ...], k: int, point: int, tried: bool, between: bool, blockers: Ints
) -> Unreachable:
    """Why the contact ``point``, row k of the ``families``, is not reached."""
    best = max(families, key=lambda f: (f.rho[k].max() >= 0.0, f.rho[k].max() + f.corner_radius))
    rho = best.rho[k].max()
    fits, corner = (2.0 * (rho + best.corner_radius), best.corner_radius) if rho >= 0.0 else (math.nan, math.nan)
    who = tuple(int(i) for i in blockers)
    if tried:
        return Unreachable(point, "between" if between else "above", who, math.nan, math.nan)
    if all(f.corner_radius * scene.curvature_max[point] >= 1.0 for f in families):
        return Unreachable(point, "curvature", (CURVATURE,), math.nan, math.nan)
    if not who:
        return Unreachable(point, "turned away", (), math.nan, math.nan)
    return Unreachable(point, "cutting part", who, fits, corner)
