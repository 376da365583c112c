"""A pocket cleared by the front, as a program with what it costs.

Notation: R cutter radius, s radial depth, a* = arccos(1 - s/R) the engagement that is held; phi immersion as in
:mod:`chipload.engagement.contact`.
"""

from __future__ import annotations

import itertools
import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chipload.cutter.cutter import Cutter
from chipload.cutting.material import Material
from chipload.cutting.rigid import OF_DEPTH, OF_FEED
from chipload.cutting.wall_error import Milling
from chipload.engagement.contact import PIECES, Engagement
from chipload.errors import InputError
from chipload.geometry.contour import Contour, Region
from chipload.geometry.distance import distance
from chipload.geometry.offset import offset_region
from chipload.machine.feed import corner_speed, limited_speed
from chipload.machine.machine import Machine
from chipload.planning.cost import CutConditions, cost
from chipload.planning.link_rows import row_ends, with_last_link
from chipload.planning.pocket.clearing import CUT, ENTRY, LIFT, STEP, ClearingPath, clear_region, require_clearing
from chipload.planning.pocket.reach import CHORD
from chipload.planning.result import Columns, Event, OperationResult, StrategyResult
from chipload.program.build import helix, plunge, rapid, retract, rows
from chipload.program.program import LINE, Program
from chipload.progress import Progress, silent
from chipload.stock.planar import PlanarStock

Floats = NDArray[np.float64]

#: slope of the helical entry [rad]
RAMP = math.radians(3.0)
#: engagement above a* that counts as one [deg]
ABOVE_DEG = 0.01
#: share of the reachable area that must be cleared
CLEARED = 0.995
#: `pass` of a row by its kind
ZONES = {ENTRY: "entry", CUT: "pocket", 2: "link", LIFT: "link"}


@dataclass(frozen=True)
class Clearing:
    """What the engineer asks of a pocket; mm, mm/s, rad/s, as in :class:`chipload.planning.contour.plan.Finishing`.

    ``step`` greatest step, taken as 0.06 R where it is less (the engagement is kept along the whole of each step);
    ``allowance`` left on the walls.
    """

    milling: Milling
    radial_depth: float
    axial_depth: float
    feed: float
    spindle_speed: float
    top: float
    clearance: float
    step: float
    allowance: float = 0.0
    rigid: tuple[float, float] = (OF_FEED, OF_DEPTH)


def plan_pocket(
    contours: Sequence[Contour],
    setting: Clearing,
    cutter: Cutter,
    material: Material,
    machine: Machine,
    limits: Mapping[str, float],
    progress: Progress = silent,
) -> OperationResult:
    """Clear the region inside closed ``contours`` (islands by even-odd) at constant engagement.

    Raises
    ------
    InputError
        A contour is open, the cutter fits nowhere, s is 2 R or more.
    """
    radius = cutter.radius
    region, wanted, step = _asked(contours, setting, radius)
    path = clear_region(
        region,
        radius,
        wanted,
        milling=setting.milling,
        step=step,
        allowance=setting.allowance,
        progress=lambda done, what: progress(0.9 * done, what),
    )
    cut = CutConditions(cutter, material, setting.axial_depth, setting.spindle_speed, setting.milling, *setting.rigid)
    centre, heading = np.column_stack([path.x, path.y]), headings(path)
    met = replayed(path, centre, heading, radius)
    length, speed = _speeds(path, centre, setting, machine)
    programs = _programs(path, centre, setting, cutter.number)
    program = Program.join(programs)
    ends = row_ends(program, machine)
    time = _times(path, programs, ends)
    zone = np.array([ZONES[int(k)] for k in path.kind], dtype=object)
    zone[:-1][path.kind[1:] == ENTRY] = "entry"
    walls = np.abs(distance(region.segments, centre) - radius - setting.allowance) <= 2.0 * CHORD * radius
    z = setting.top - setting.axial_depth
    history: Columns = {
        **cost(cut, zone, length, time, centre, heading, z, met, speed, walls & (path.kind == CUT)),
        "engagement_max_deg": np.degrees(path.engagement_max),
    }
    on_front = path.kind == CUT
    reach = offset_region(offset_region(region, radius + setting.allowance), -radius)
    result = StrategyResult(
        "pocket",
        program,
        with_last_link(history, setting.top + setting.clearance, float(ends[-1])),
        {**_summary(path, history, on_front, wanted), "time_s": float(ends[-1])},
        (*path.events, *_failures(path, history, on_front, wanted)),
        np.append(on_front, False),
        {
            "wall": reach.contours,
            "part": region.contours,
            "leftover": path.leftover,
            "front path": _chains(path, centre),
        },
    )
    progress(1.0, "pocket")
    return OperationResult("pocket", "pocket", {"pocket": result})


def check_pocket(contours: Sequence[Contour], setting: Clearing, cutter: Cutter) -> float:
    """The area of the region [mm^2] if :func:`plan_pocket` can clear it; nothing is planned.

    Raises
    ------
    InputError
        As :func:`plan_pocket`.
    """
    region, wanted, step = _asked(contours, setting, cutter.radius)
    require_clearing(region, cutter.radius, wanted, setting.milling, step, setting.allowance)
    return region.area


def _asked(contours: Sequence[Contour], setting: Clearing, radius: float) -> tuple[Region, float, float]:
    """The region, the engagement that is held [rad] and the step [mm]."""
    if not 0.0 < setting.radial_depth < 2.0 * radius:
        raise InputError(
            f"operation.radial_depth_mm = {setting.radial_depth:g}: must be above 0 and below the cutter's "
            f"diameter_mm = {2.0 * radius:g}"
        )
    region = Region.of(Region(tuple(contours)).contours)
    wanted = math.acos(1.0 - setting.radial_depth / radius)
    return region, wanted, min(max(setting.step, STEP * radius), 0.25 * radius)


def headings(path: ClearingPath) -> Floats:
    """(n, 2) unit direction of the step that ends in each row; +x where the row does not move."""
    d = np.column_stack([np.diff(path.x, prepend=path.x[:1]), np.diff(path.y, prepend=path.y[:1])])
    length = np.hypot(d[:, 0], d[:, 1])
    still = length == 0.0
    d[still] = (1.0, 0.0)
    return d / np.where(still, 1.0, length)[:, None]


def replayed(path: ClearingPath, centre: Floats, heading: Floats, radius: float) -> Engagement:
    """The engaged arcs at the end of every step, from the stock as the steps before it left it. O(n)."""
    n = len(centre)
    stock = PlanarStock(
        (path.x.min() - radius, path.y.min() - radius, path.x.max() + radius, path.y.max() + radius), radius
    )
    angle, count, phi = np.zeros(n), np.zeros(n, dtype=np.int64), np.zeros((n, PIECES, 2))
    for k in range(1, n):
        if path.kind[k] == LIFT:
            continue
        if path.kind[k] in (CUT, ENTRY):
            arcs = stock.arcs(centre[k], heading[k])
            angle[k], count[k] = (arcs[:, 1] - arcs[:, 0]).sum(), len(arcs)
            kept = arcs[np.argsort(arcs[:, 0] - arcs[:, 1])[:PIECES]]
            phi[k, : len(kept), 0], phi[k, : len(kept), 1] = 0.5 * math.pi - kept[:, 1], 0.5 * math.pi - kept[:, 0]
        stock.remove([[*centre[k - 1], *centre[k]]])
    return Engagement(angle, count, np.clip(phi, 0.0, math.pi))


def _runs(path: ClearingPath) -> list[tuple[int, int]]:
    """Rows first..last of each stretch that begins where the cutter comes down."""
    starts = np.flatnonzero(path.kind == LIFT)
    return list(zip(starts.tolist(), [*(starts[1:] - 1).tolist(), len(path.kind) - 1], strict=True))


def _speeds(path: ClearingPath, centre: Floats, setting: Clearing, machine: Machine) -> tuple[Floats, Floats]:
    """Length at the level [mm] and speed [mm/s] of every row."""
    leg = np.hypot(*np.diff(centre, axis=0, prepend=centre[:1]).T)
    leg[path.kind == LIFT] = 0.0
    length = np.cumsum(leg)
    speed = np.zeros(len(leg))
    turn = headings(path)
    theta = np.arctan2(turn[:-1, 0] * turn[1:, 1] - turn[:-1, 1] * turn[1:, 0], (turn[:-1] * turn[1:]).sum(axis=1))
    acceleration = machine.acceleration_xy
    limit = np.minimum(setting.feed, np.append(corner_speed(theta, acceleration, machine.corner_tolerance), np.inf))
    for a, b in _runs(path):
        speed[a : b + 1], _ = limited_speed(
            length[a : b + 1] - length[a], limit[a : b + 1], acceleration, between=setting.feed
        )
    return length, speed


def _times(path: ClearingPath, programs: list[Program], ends: Floats) -> Floats:
    """(n,) time of every row [s] from that at the ends of the program's rows; of a lift when the cutter is down again.

    The program of a run ends with its steps and the way up.
    """
    time, first = np.zeros(len(path.kind)), 0
    for (a, b), program in zip(_runs(path), programs, strict=True):
        first += len(program)
        time[a : b + 1] = ends[first - 2 - (b - a) : first - 1]
    return time


def _ring(path: ClearingPath, a: int) -> slice:
    """Rows of the bore that begins at the lift ``a``, its start included."""
    rest = path.kind[a + 1 :] != ENTRY
    return slice(a, a + 1 + (int(np.argmax(rest)) if rest.any() else len(rest)))


def _bore_circumference(path: ClearingPath, centre: Floats, a: int) -> float:
    return float(np.hypot(*np.diff(centre[_ring(path, a)], axis=0).T).sum())


def _bore_turns(path: ClearingPath, a: int, setting: Clearing) -> int:
    centre = np.column_stack([path.x, path.y])
    return math.ceil(setting.axial_depth / (_bore_circumference(path, centre, a) * math.tan(RAMP)))


def _programs(path: ClearingPath, centre: Floats, setting: Clearing, tool: int) -> list[Program]:
    """A program a run: rapid above the stock, helical bore from its top, straight steps at depth, up."""
    z, safe = setting.top - setting.axial_depth, setting.top + setting.clearance
    speed, out = setting.spindle_speed, []
    for a, b in _runs(path):
        parts = [rapid([*centre[a], safe], speed, tool, "link")]
        if b > a and path.kind[a + 1] == ENTRY:
            ring = centre[_ring(path, a)]
            middle = ring[:-1].mean(axis=0)
            turns = _bore_turns(path, a, setting)
            sense = 1 if Contour.polyline(ring).area > 0.0 else -1
            parts.append(plunge([*centre[a], setting.top], setting.feed, speed, tool, "entry"))
            parts.append(
                helix(
                    centre[a],
                    (float(middle[0]), float(middle[1])),
                    (setting.top, z),
                    setting.axial_depth / turns,
                    setting.feed,
                    speed,
                    tool,
                    "entry",
                    sense=sense,
                    level=False,
                )
            )
        else:
            parts.append(plunge([*centre[a], z], setting.feed, speed, tool, "entry"))
        names = [ZONES[int(k)] for k in path.kind[a + 1 : b + 1]]
        points = np.column_stack([centre[a + 1 : b + 1], np.full(b - a, z)])
        for first, last, name in _stretches(names):
            parts.append(rows(LINE, points[first:last], (0.0, 0.0), setting.feed, speed, tool, name))
        parts.append(retract([*centre[b], safe], speed, tool, "link"))
        out.append(Program.join(parts))
    return out


def _stretches(names: list[str]) -> list[tuple[int, int, str]]:
    """(first, last + 1, name) of equal neighbours."""
    cut = [0, *(k for k in range(1, len(names)) if names[k] != names[k - 1]), len(names)]
    return [(a, b, names[a]) for a, b in itertools.pairwise(cut) if b > a]


def _chains(path: ClearingPath, centre: Floats) -> tuple[Contour, ...]:
    """The cutting passes as contours, for pictures."""
    out = []
    for a, b in _runs(path):
        chain = centre[a : b + 1]
        if len(chain) > 1 and np.hypot(*np.diff(chain, axis=0).T).max() > 1e-6:
            out.append(Contour.polyline(chain))
    return tuple(out)


def _failures(path: ClearingPath, history: Columns, on_front: NDArray[np.bool_], wanted: float) -> list[Event]:
    """What the clearing must keep by itself: the engagement it was asked for, and the pocket cleared."""
    out = []
    most = np.where(on_front, history["engagement_max_deg"], 0.0)
    k = int(np.argmax(most))
    if most[k] > math.degrees(wanted) + ABOVE_DEG:
        text = f"engagement {most[k]:.4f} deg, wanted at most {math.degrees(wanted):.4f} deg"
        out.append(Event("pocket-engagement", float(path.x[k]), float(path.y[k]), text, failure=True))
    if path.cleared_share < CLEARED:
        x, y = path.leftover[0].start if path.leftover else (float(path.x[-1]), float(path.y[-1]))
        text = (
            f"only {path.cleared_share:.2%} of what the cutter can reach is cleared, {path.leftover_mm2:.4g} mm2 left"
        )
        out.append(Event("pocket-uncleared", float(x), float(y), text, failure=True))
    return out


def _summary(path: ClearingPath, history: Columns, on_front: NDArray[np.bool_], wanted: float) -> dict[str, object]:
    a, force = history["engagement_max_deg"][on_front], history["force_xy_n"][on_front]
    error = history["form_error_um"][on_front]
    return {
        "engagement_deg": {
            "min": float(a.min()),
            "max": float(a.max()),
            "p95": float(np.percentile(a, 95.0)),
            "wanted": math.degrees(wanted),
        },
        "force_xy_n": {"min": float(force.min()), "max": float(force.max())},
        "torque_nm": {"min": 0.0, "max": float(history["torque_nm"].max())},
        "form_error_um": {"max": float(error.max())},
        "path_mm": float(sum(v for k, v in path.lengths_mm.items() if k != "lift")),
        "lengths_mm": dict(path.lengths_mm),
        "passes": path.passes,
        "lifts": int((path.kind == LIFT).sum()) - 1,
        "reachable_mm2": path.reachable_mm2,
        "cleared_mm2": path.cleared_mm2,
        "cleared_share": path.cleared_share,
        "leftover_mm2": path.leftover_mm2,
        "events": dict(Counter(e.code for e in path.events)),
    }
