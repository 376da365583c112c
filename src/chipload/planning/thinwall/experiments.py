"""Calibration cuts that determine the threshold of a wall best: their places and depths.

Notation: u, v parameters of the surface; y = log F_th, F_th [N] the threshold as modelled at p places; S the m sites of
the cuts; w_i(p) weight of site i at a place in the interpolation of :mod:`chipload.planning.thinwall.threshold`
(Delaunay's triangles, linear; beyond all sites the least of them); s standard deviation of y in one experiment.

The sites are the set of m candidates with the least mean square of the expected error of the interpolation. This is an
I-optimal design that includes the bias of the interpolation: the model knows the shape of y, but not its level.

    J(S) = mean over p of (sum_i w_i y_i - y_p)^2 + s^2 sum_i w_i^2,

and (min y_i - y_p)^2 + s^2 beyond all sites. There the threshold may be below that of every site, so the outermost
candidates (the corners) are always sites where m is large enough for them; else the three that span the greatest
triangle are the first (D-optimal for a plane). The other sites are chosen greedily and then exchanged one for another
while that lowers J. All subsets would be C(c, m); a test compares small cases with them.

Each site has a series of depths with the normal forces F_th b^k, k = -n .. n. The series brackets a threshold that is
wrong by a factor of up to b^n. The table of the cuts is that of :mod:`chipload.planning.thinwall.table`.

Reference: [Yan2018] for the calibration; [Atkinson2007] ch. 12 for exchange.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipload.errors import Finding, InputError
from chipload.lazy import scipy
from chipload.number_text import number_text
from chipload.planning.thinwall.force_table import ForceTable
from chipload.progress import Progress, silent

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

#: number of candidates in the first exchange of sites, and of neighbours among which each site is moved afterwards
COARSE, NEIGHBOURS = 40, 9
#: relative difference below which two depths are the same cut
SAME = 1e-6


@dataclass(frozen=True, eq=False)
class Proposal:
    """Proposed calibration cuts.

    Attributes
    ----------
    sites : (m,) int, numbers of the places that are cut
    place : (m, 2) float, u, v; point : (m, 3) float [mm]
    threshold : (m,) float [N], as modelled
    site, repeat : (c,) int of each cut: row of ``sites``; 0, or 1 where the series is repeated
    depth, force : (c,) float [mm], [N]; rising within a series: stop when it is too much
    bias, noise : root mean square over the places of the interpolation error of log F_th, and of the scatter of the
        experiments in it
    findings : series that do not bracket the modelled threshold
    """

    sites: Ints
    place: Floats
    point: Floats
    threshold: Floats
    site: Ints
    repeat: Ints
    depth: Floats
    force: Floats
    bias: float
    noise: float
    findings: tuple[Finding, ...]


def expected_misses(sites: ArrayLike, places: ArrayLike, y: ArrayLike) -> tuple[Floats, Floats]:
    """Expected error of the interpolation of y from some sites, and the part of the scatter of one experiment in it.

    Parameters
    ----------
    sites : (m,) int, rows of ``places``, at least three not on a line
    places : (p, 2) float; y : (p,) float

    Returns
    -------
    bias : (p,) float; weight : (p,) float, sum of w_i^2

    Examples
    --------
    A quarter and three quarters of the way between sites, on a plane: no bias; 0.25^2 + 0.75^2.

    >>> b, w = expected_misses([0, 1, 2], [[0, 0], [4, 0], [0, 4], [1, 0]], [0.0, 4.0, 0.0, 1.0])
    >>> b.tolist(), w.tolist()
    ([0.0, 0.0, 0.0, 0.0], [1.0, 1.0, 1.0, 0.625])
    """
    x, value = np.asarray(places, dtype=np.float64), np.asarray(y, dtype=np.float64)
    S = np.asarray(sites, dtype=np.int64)
    S = S[np.lexsort((x[S, 1], x[S, 0]))]
    triangles = scipy.spatial.Delaunay(x[S])
    where = triangles.find_simplex(x)
    T = triangles.transform[where]
    two = np.einsum("pij,pj->pi", T[:, :2], x - T[:, 2])
    w = np.column_stack([two, 1.0 - two.sum(axis=1)])
    inside = where >= 0
    guess = np.where(inside, (w * value[S][triangles.simplices[where]]).sum(axis=1), value[S].min())
    return guess - value, np.where(inside, (w**2).sum(axis=1), 1.0)


def propose_sites(
    places: ArrayLike,
    modelled: ArrayLike,
    count: int,
    scatter: float,
    candidates: ArrayLike | None = None,
    progress: Progress = silent,
) -> Ints:
    """Sites whose experiments determine the threshold of the places best; (count,) int, rows of ``places``, ascending.

    Parameters
    ----------
    places : (p, 2) float, u, v; all of the surface
    modelled : (p,) float [N], above 0
    count : m >= 3
    scatter : s >= 0, standard deviation of log F in one experiment, as it is expected
    candidates : (c,) int, places that may be cut; None: all

    Notes
    -----
    O(m c) interpolations a sweep, of which there are a few; beyond ``COARSE`` candidates c is that many of them, spread
    over the surface, and each site is moved among its neighbours in the end.
    """
    x, y, allowed = _check_experiments(places, modelled, count, scatter, candidates)

    def cost(S: Sequence[int]) -> float:
        try:
            bias, weight = expected_misses(S, x, y)
        except scipy.spatial.QhullError:
            return math.inf
        return float(np.mean(bias**2) + scatter**2 * np.mean(weight))

    chosen, fixed = _outermost(x, allowed, count)
    rest = [c for c in _spread(x, allowed, chosen) if c not in chosen]
    while len(chosen) < count:
        progress(0.5 * len(chosen) / count, "sites")
        best = min(rest, key=lambda c: (cost([*chosen, c]), c))
        chosen.append(best)
        rest.remove(best)
    now, coarse, near = cost(chosen), len(rest) + len(chosen) < len(allowed), scipy.spatial.cKDTree(x[allowed])
    while True:
        before = now
        for k in range(fixed, count):
            progress(0.5 + 0.5 * k / count, "sites exchanged")
            around = allowed[np.atleast_1d(near.query(x[chosen[k]], min(NEIGHBOURS, len(allowed)))[1])].tolist()
            others = chosen[:k] + chosen[k + 1 :]
            least, c = min(((cost([*others, c]), c) for c in {*rest, *around} - set(chosen)), default=(math.inf, -1))
            if least < now * (1.0 - 1e-9):
                rest = sorted({*rest, chosen[k]} - {c}) if not coarse or rest else []
                chosen[k], now = c, least
        if now == before:
            if not (coarse and rest):
                return np.sort(np.array(chosen, dtype=np.int64))
            rest = []  # from here on each among its neighbours only


def _spread(x: Floats, allowed: Ints, chosen: list[int]) -> list[int]:
    """Candidates to begin with: all, or so many that lie as far from one another as can be."""
    if len(allowed) <= COARSE:
        return [int(i) for i in allowed]
    size = np.ptp(x[allowed], axis=0)
    scaled = x[allowed] / size
    far = scipy.spatial.cKDTree(x[chosen] / size).query(scaled)[0]
    out: list[int] = []
    while len(out) < COARSE:
        k = int(np.argmax(far))
        out.append(int(allowed[k]))
        far = np.minimum(far, np.linalg.norm(scaled - scaled[k], axis=1))
    return sorted(out)


def _check_experiments(
    places: ArrayLike, modelled: ArrayLike, count: int, scatter: float, candidates: ArrayLike | None
) -> tuple[Floats, Floats, Ints]:
    x, F = np.asarray(places, dtype=np.float64), np.asarray(modelled, dtype=np.float64)
    if x.ndim != 2 or x.shape[1] != 2 or F.shape != (len(x),) or not ((F > 0.0) & np.isfinite(F)).all():
        raise InputError(f"experiments: places {x.shape}, thresholds {F.shape}: need (p, 2) and (p,) above 0 N")
    allowed = np.arange(len(x)) if candidates is None else np.unique(np.asarray(candidates, dtype=np.int64))
    if len(allowed) and not (allowed[0] >= 0 and allowed[-1] < len(x)):
        raise InputError(f"experiments: a candidate outside 0 .. {len(x) - 1}")
    if not 3 <= count <= len(allowed):
        raise InputError(f"experiments.count = {count}: must be from 3 to {len(allowed)}, the places that may be cut")
    if not 0.0 <= scatter < math.inf:
        raise InputError(f"experiments.scatter = {scatter:g}: must be at least 0 (0.1 is 10 %)")
    return x, np.log(F), allowed


def _outermost(x: Floats, allowed: Ints, count: int) -> tuple[list[int], int]:
    """The corners of the convex hull of the candidates, and how many they are; where these are more than ``count``,
    the three that span the greatest triangle, of which none must stay.
    """
    try:
        hull = np.sort(allowed[scipy.spatial.ConvexHull(x[allowed]).vertices])
    except scipy.spatial.QhullError as error:
        raise InputError("experiments: all candidates lie on a line: add a candidate off it") from error
    if len(hull) <= count:
        return [int(i) for i in hull], len(hull)
    hull = hull[:: max(1, len(hull) // 40)]

    def area(three: tuple[int, ...]) -> float:
        a, b, c = x[list(three)]
        return abs(float((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])))

    return [int(i) for i in max(itertools.combinations(hull.tolist(), 3), key=area)], 0


def propose_cuts(
    places: ArrayLike,
    points: ArrayLike,
    modelled: ArrayLike,
    law: ForceTable,
    count: int,
    scatter: float,
    *,
    bracket: float,
    steps: int,
    repeats: int = 1,
    candidates: ArrayLike | None = None,
    progress: Progress = silent,
) -> Proposal:
    """Propose calibration cuts: places and depths.

    Parameters
    ----------
    places, modelled, count, scatter, candidates : as of :func:`propose_sites`
    points : (p, 3) float [mm] of the places
    law : force over depth of the cutter and posture that will cut
    bracket : b > 1, factor from force to force
    steps : n >= 1, forces below and above the modelled threshold each
    repeats : sites whose series is cut twice, those that count for most places; 0: the scatter is then known only from
        sites that lie between others
    """
    x = np.asarray(places, dtype=np.float64)
    xyz = np.asarray(points, dtype=np.float64)
    if xyz.shape != (len(x), 3) or not np.isfinite(xyz).all():
        raise InputError(f"experiments: points {xyz.shape}: need ({len(x)}, 3) finite numbers")
    if not 1.0 < bracket < math.inf or steps < 1:
        raise InputError(f"experiments: bracket = {bracket:g}, steps = {steps}: must be above 1, at least 1")
    if not 0 <= repeats <= count:
        raise InputError(f"experiments.repeats = {repeats}: must be from 0 to count = {count}")
    sites = propose_sites(x, modelled, count, scatter, candidates, progress)
    F = np.asarray(modelled, dtype=np.float64)
    bias, weight = expected_misses(sites, x, np.log(F))
    twice = set(np.argsort(-_influence(sites, x), kind="stable")[:repeats].tolist())
    rows: list[tuple[int, int, float, float]] = []
    findings = []
    for i, at in enumerate(sites.tolist()):
        wanted = F[at] * bracket ** np.arange(-steps, steps + 1)
        depth = np.asarray(law.depth(wanted))
        depth = depth[depth > 0.0]
        depth = depth[np.r_[True, np.diff(depth) > SAME * depth[1:]]] if len(depth) else depth
        if not len(depth):
            raise InputError(
                f"experiments: site {i + 1} (u {x[at, 0]:g}, v {x[at, 1]:g}): the smallest depth "
                f"{law.limits.smallest:g} mm needs {number_text(float(law.forces[0]))} N, the greatest force to try is "
                f"{number_text(wanted[-1])} N: allow a smaller depth or feed, or leave the place out of the candidates"
            )
        force = np.asarray(law.force(depth))
        if force[0] > F[at] or force[-1] < F[at]:
            side = "below" if force[0] > F[at] else "above"
            findings.append(
                Finding(
                    "site-not-bracketed",
                    0,
                    f"site {i + 1}: forces from {force[0]:.4g} to {number_text(force[-1])} N: none {side} the modelled "
                    f"threshold of {number_text(F[at])} N within the depths {law.limits.smallest:g} to "
                    f"{law.limits.greatest:g} mm",
                )
            )
        for repeat in range(2 if i in twice else 1):
            rows += [(i, repeat, float(d), float(f)) for d, f in zip(depth, force, strict=True)]
    series, again, depths, forces = (np.array(column) for column in zip(*rows, strict=True))
    return Proposal(
        sites,
        x[sites],
        xyz[sites],
        F[sites],
        series,
        again,
        depths,
        forces,
        float(np.sqrt(np.mean(bias**2))),
        float(scatter * np.sqrt(np.mean(weight))),
        tuple(findings),
    )


def _influence(sites: Ints, x: Floats) -> Floats:
    """Number of places that each site represents, (m,) float: the sum of its weights."""
    ahead = scipy.spatial.Delaunay(x[sites])
    where = ahead.find_simplex(x)
    inside = np.flatnonzero(where >= 0)
    T = ahead.transform[where[inside]]
    two = np.einsum("pij,pj->pi", T[:, :2], x[inside] - T[:, 2])
    out = np.zeros(len(sites))
    np.add.at(out, ahead.simplices[where[inside]], np.column_stack([two, 1.0 - two.sum(axis=1)]))
    return out
