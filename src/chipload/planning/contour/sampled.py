"""A pass in steps: places of the cutter, and its exact engagement there.

Notation: s [mm] length along lead-in, path and lead-out; O centre, T unit feed; a engagement angle, phi immersion.
All in the work frame.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chipload.engagement.contact import Engagement, StockBoundary, engagement
from chipload.geometry.contour import Contour
from chipload.geometry.distance import distance
from chipload.planning.contour.offsets import mirror_contour
from chipload.planning.contour.passes import ContourPass

Floats = NDArray[np.float64]

#: bisections of the rim where a closed pass meets its own beginning: pi / 2^40 rad
HALVINGS = 40


@dataclass(frozen=True, eq=False)
class SampledPass:
    """Rows along one pass: ``zone`` (n,) is `lead`, the pass's name, or `closing`."""

    zone: NDArray[Any]
    s: Floats
    centre: Floats
    heading: Floats
    curvature: Floats
    engagement: Engagement


def sample_pass(run: ContourPass, radius: float, step: float) -> SampledPass:
    """The pass in steps of at most ``step`` mm, the joints of the path among them.

    The exact engagement is taken against the stock before the pass; the last piece of a closed pass, where the rim
    meets what the pass itself has cut at its beginning, is `closing`.
    """
    zones: list[NDArray[Any]] = []
    columns: list[tuple[Floats, Floats, Floats, Floats]] = []
    travelled = 0.0
    for zone, part in (("lead", run.lead_in), (run.name, run.path), ("lead", run.lead_out)):
        if part is None:
            continue
        s = stations(part, step)
        p, t, kappa = part.at(s)
        columns.append((travelled + s, p, t, kappa))
        zones.append(np.full(len(s), zone, dtype=object))
        travelled += part.length
    s, o, t, kappa = (np.concatenate(c) for c in zip(*columns, strict=True))
    named = np.concatenate(zones)
    met = engagement(run.stock, o, t, radius)
    if run.path.closed:
        named, met = _close_pass(run, radius, named, s, o, t, met)
    return SampledPass(named, s, o, t, kappa, met)


def stations(path: Contour, step: float) -> Floats:
    """Lengths along ``path`` no more than ``step`` apart that contain its joints."""
    counts = np.maximum(np.ceil(path.lengths / step), 1).astype(int)
    parts = [
        np.linspace(a, b, n, endpoint=False) for a, b, n in zip(path.knots[:-1], path.knots[1:], counts, strict=True)
    ]
    return np.concatenate([*parts, [path.length]])


def _close_pass(
    run: ContourPass, radius: float, zone: NDArray[Any], s: Floats, o: Floats, t: Floats, met: Engagement
) -> tuple[NDArray[Any], Engagement]:
    """Take what the beginning of a closed pass has cut away from the engagement of its end.

    The engaged piece loses the part that lies within R of the lead-in and of the first 2R of the path; its new end is
    found by bisection on the distance, so a piece is assumed to lose one end only.
    """
    begun = [run.path.part(0.0, min(2.0 * radius, 0.4 * run.path.length))]
    if run.lead_in is not None:
        begun.insert(0, run.lead_in)
    early = np.vstack([c.segments for c in begun])
    begins = 0.0 if run.lead_in is None else run.lead_in.length
    late = np.flatnonzero(s > begins + run.path.length - 2.5 * radius)
    late = late[s[late] > begins + 0.5 * run.path.length]
    angle, count, phi = met.angle.copy(), met.count.copy(), met.phi.copy()
    for k in range(phi.shape[1]):
        lo, hi = phi[late, k, 0].copy(), phi[late, k, 1].copy()
        cut_lo, cut_hi = (_cut(o[late], t[late], x, radius, early) for x in (lo, hi))
        some = cut_lo != cut_hi
        a, b = np.where(cut_lo, hi, lo), np.where(cut_lo, lo, hi)  # a stays in stock, b has been cut
        for _ in range(HALVINGS):
            middle = 0.5 * (a + b)
            cut_here = _cut(o[late], t[late], middle, radius, early)
            a, b = np.where(cut_here, a, middle), np.where(cut_here, middle, b)
        lo = np.where(some & cut_lo, a, lo)
        hi = np.where(some & cut_hi, a, hi)
        empty = cut_lo & cut_hi
        phi[late, k, 0], phi[late, k, 1] = np.where(empty, 0.0, lo), np.where(empty, 0.0, hi)
    removed = angle[late] - (phi[late, :, 1] - phi[late, :, 0]).sum(axis=1)
    angle[late] -= removed
    count[late] = ((phi[late, :, 1] - phi[late, :, 0]) > 0.0).sum(axis=1)
    zone = zone.copy()
    zone[late[(removed > 1e-9) & (zone[late] == run.name)]] = "closing"
    return zone, Engagement(angle, count, phi)


def _cut(o: Floats, t: Floats, phi: Floats, radius: float, early: Floats) -> NDArray[np.bool_]:
    """Whether the rim points at immersion ``phi`` lie within R of the early path."""
    n = np.column_stack([-t[:, 1], t[:, 0]])
    rim = o + radius * (np.sin(phi)[:, None] * t + np.cos(phi)[:, None] * n)
    return np.asarray(distance(early, rim) < radius * (1.0 - 1e-12))


def mirrored_pass(run: ContourPass, flip: bool) -> ContourPass:
    """The pass in the work frame: reflected in y where ``flip``."""
    if not flip:
        return run
    lead_in, lead_out = (None if c is None else mirror_contour(c) for c in (run.lead_in, run.lead_out))
    seg = run.stock.segments * np.array([1.0, -1.0, 1.0, -1.0, 1.0, -1.0, -1.0])
    seg = seg[:, [2, 3, 0, 1, 4, 5, 6]] * np.array([1, 1, 1, 1, 1, 1, -1.0])
    return ContourPass(run.name, mirror_contour(run.path), lead_in, lead_out, StockBoundary(seg), run.stopped)
