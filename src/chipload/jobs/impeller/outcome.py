"""Outcome of an impeller job, and its verdict."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chipload.cutter.catalogue import Catalogue, CatalogueCutter
from chipload.jobs.impeller.five_axis_outcome import CheckedFlank, CheckedPoints, NoFiveAxisPath
from chipload.jobs.impeller.machine_check import MachineCheck
from chipload.jobs.impeller.program_removal import ProgramRemoval
from chipload.jobs.impeller.read_program import ReadProgram
from chipload.jobs.impeller.roughing_check import CheckedRough
from chipload.machine.machine import Machine
from chipload.number_text import number_text
from chipload.planning.impeller.answer import Answer, Unreachable
from chipload.planning.impeller.compare import Partition
from chipload.planning.impeller.impeller import Impeller
from chipload.planning.impeller.patch import Patch
from chipload.planning.impeller.settings import CutterSetting
from chipload.planning.impeller.surfaces import BODIES, ContactSurface
from chipload.planning.impeller.tables import IndexTable
from chipload.program.gcode.writer import Repeat
from chipload.result import Provenance
from chipload.simulation.channel.channel import Remainder
from chipload.simulation.channel.gouges import Gouge

Floats = NDArray[np.float64]

#: name of the partition with the hand-picked cutter
PICKED = "hand-picked"
#: why a contact point is not reached, in words
REASONS: Mapping[str, str] = {
    "turned away": "no table angle faces it",
    "curvature": "every corner radius of the catalogue is larger than its radius of curvature",
    "cutting part": "the smallest cutters of the catalogue collide with other walls",
    "above": "neck, shank or holder collide with other walls",
    "between": "every cutter that is clear of the check points collides with a wall between them",
}


@dataclass(frozen=True, eq=False)
class OneCutter:
    """A cutter and a table angle for a whole surface.

    Parameters
    ----------
    cutter : the cutter
    table : index of its table angle
    points : (k,) contact points that it mills: the reachable ones
    ranges : for each of them (j, 2) pallet angles [rad]
    """

    cutter: CatalogueCutter
    table: int
    points: NDArray[np.int64]
    ranges: tuple[Floats, ...]


@dataclass(frozen=True, eq=False)
class Searched:
    """One surface with the results of its search.

    Parameters
    ----------
    settings : keys of the operation and of the surface, as stated
    surface, answer : contact points, and the largest cutter at each
    table : the machine's table angles that were searched
    one : the largest cutter for all of it; None: there is none
    clearance : of neck, shank and holder [mm]
    search_s : time of the search [s]
    """

    settings: Mapping[str, Any]
    surface: ContactSurface
    answer: Answer
    table: IndexTable
    one: OneCutter | None
    clearance: float
    search_s: float

    @property
    def place(self) -> Floats:
        """Contact points (c, 3) [mm]."""
        return self.surface.scene.contact

    @cached_property
    def limiting(self) -> tuple[Limiting, ...]:
        """For each corner radius and table angle the contact point and cutter that limit one cutter for the surface."""
        out = []
        reached = np.flatnonzero(self.answer.cutter >= 0)
        for f in self.answer.families if len(reached) else ():
            sizes = [c.diameter for c in self.answer.catalogue.family(f.corner_radius)]
            for t in range(len(f.tables)):
                k = int(reached[f.bound[reached, t].argmin()])
                rho = float(f.bound[k, t])
                most = 2.0 * (rho + f.corner_radius) if rho > -np.inf else None
                fits = [d for d in sizes if most is not None and 0.5 * d - f.corner_radius <= max(f.rho[k, t], -1.0)]
                who = f.blockers[k, t]
                out.append(
                    Limiting(
                        f.corner_radius, t, k, most, max(fits, default=None),
                        bool(f.certified[reached, t].all()), rho >= f.cap, tuple(int(i) for i in who[who != -1]),
                    )
                )  # fmt: skip
        return tuple(out)


@dataclass(frozen=True)
class Limiting:
    """Limit of one cutter for a whole surface at a table angle, and its cause.

    Parameters
    ----------
    corner_radius : [mm]
    table : index of the table angle
    point : the contact point whose limit is least
    most : diameter [mm] that no cutter of that corner radius exceeds there; None: it is turned away
    size : largest of the catalogue below, by the cutting part alone; None: none
    certified : proved for every reachable contact point
    capped : the search ended at the largest of the catalogue
    blockers : check points that prove it
    """

    corner_radius: float
    table: int
    point: int
    most: float | None
    size: float | None
    certified: bool
    capped: bool
    blockers: tuple[int, ...]


@dataclass(frozen=True)
class Scallop:
    """Scallops that the check measures on a patch.

    Parameters
    ----------
    limit, greatest, mean : allowed, greatest excess between two passes, mean height of the scallops [mm]
    count : of the scallops
    covered : share of the patch with no more excess than the limit
    place : (x, y, z) [mm] of the greatest; None: no passes lie on both sides
    row : of the program that passes lowest there; -1: none does
    """

    limit: float
    greatest: float
    mean: float
    count: int
    covered: float
    place: tuple[float, float, float] | None
    row: int

    @property
    def holds(self) -> bool:
        """Whether no scallop between two passes is higher than the limit."""
        return self.greatest <= self.limit


@dataclass(frozen=True, eq=False)
class Checked:
    """A program of one setting with the results of its simulation.

    Parameters
    ----------
    setting : cutter, table angle, patches, moves
    gouge : deepest that any part of the tool comes below a surface, between bounds
    allowed : what of it is allowed [mm]
    scallops : of each patch
    machine_check : what it does on the machine, and what its text shows
    read : the program as its text was read, which was checked
    between : from the end of one channel to the beginning of the next [s]
    repeat : how the text goes through all channels; None: it is of one channel
    removal : from the stock that the programs before it leave; None: not simulated
    """

    setting: CutterSetting
    gouge: Gouge
    allowed: float
    scallops: tuple[Scallop, ...]
    machine_check: MachineCheck
    read: ReadProgram
    between: float
    repeat: Repeat | None
    removal: ProgramRemoval | None = None

    @property
    def seconds(self) -> float:
        """Time of one channel, as the text takes it on the machine [s]."""
        return self.read.seconds

    @property
    def cutting(self) -> float:
        """Of that in tracks; the rest is leads, links and rapids [s]."""
        return float(self.read.times[self.read.in_cut()].sum())

    @property
    def verified(self) -> bool:
        """Whether there is no gouge, no motion beyond the machine, no scallop above the aim, no overloaded cutter,
        and its text shows nothing that is wrong or unproven.
        """
        return not (self.fails or self.machine_check.doubts)

    @property
    def missed(self) -> float:
        """Length of lines that are not milled as laid out [mm]; rest passes may have milled it."""
        own = math.fsum(x.length for m in self.setting.millings for x in m.tracks.missed)
        return own + math.fsum(self.setting.tracks[k].length for k, _ in self.setting.linked.refused)

    @property
    def name(self) -> str:
        """`D 12 r 2 mm at 45 deg`."""
        c = self.setting.cutter
        return f"{c.label} mm at {np.degrees(self.setting.table):.6g} deg"

    @property
    def fails(self) -> tuple[str, ...]:
        """Conditions that do not hold."""
        out = [f"{self.name}: {f}" for f in self.machine_check.fails]
        if self.gouge.bound > self.allowed:
            out.append(f"{self.name}: {self.gouge.message}: gouge_mm = {self.allowed:g} is allowed")
        for m, s in zip(self.setting.millings, self.scallops, strict=True):
            if not s.holds:
                where = f"{self.name}, {BODIES[m.patch.body]} {m.patch.side}"
                out.append(f"{where}: {s.greatest:.4f} mm are left between passes: scallop_mm = {s.limit:g} is allowed")
        loads = self.setting.loads
        if loads is not None and len(loads.feed):
            for what, values, most, unit in loads.columns:
                worst = float(values.max()) * (1.0 + loads.error)
                if worst > most:
                    out.append(f"{self.name}: {what} up to {worst:.4g} {unit} at the least feed: {most:.4g} is allowed")
        return tuple(out)


@dataclass(frozen=True, eq=False)
class Covered:
    """Excess that all programs together leave on a surface, within its patches.

    Parameters
    ----------
    body, side : of the surface
    left : what the check finds on a grid of its points
    limit : of the scallop [mm]
    spacing : most distance of the points [mm]
    unreached : area [mm2] where the planner found no cutter and table angle for rest passes
    """

    body: int
    side: str
    left: Remainder
    limit: float
    spacing: float
    unreached: float

    @property
    def name(self) -> str:
        """`blade floor`."""
        return f"{BODIES[self.body]} {self.side}"

    @property
    def share(self) -> float:
        """Share of the area with no more excess than the limit."""
        return 1.0 - self.left.excess(self.limit)

    @property
    def greatest(self) -> tuple[float, int]:
        """Greatest excess [mm], at most the height of the rays, and its point."""
        k = int(self.left.rest.argmax())
        return float(self.left.rest[k]), k

    @property
    def fails(self) -> tuple[str, ...]:
        """Conditions that do not hold."""
        most, k = self.greatest
        if most <= self.limit:
            return ()
        wall = self.left.wall
        x, y, z = wall.points[k].tolist()
        over = float(wall.area[self.left.rest > self.limit].sum())
        least = f"{most:.3f} mm" if most < self.left.height else f"{most:g} mm or more"
        note = f", no cutter was found for {self.unreached:.1f} mm2 of it" if self.unreached > 0.0 else ""
        return (
            f"{self.name}: on {over:.1f} mm2, {number_text(100.0 * (1.0 - self.share), 2)} % of what is "
            "milled, more than "
            f"{self.limit:g} mm is left: {least} at ({x:.2f}, {y:.2f}, {z:.2f}){note}",
        )


@dataclass(frozen=True, eq=False)
class CheckedPartition:
    """A partition of all surfaces with its checked programs. Times and paths are of all channels, without roughing.

    Parameters
    ----------
    partition : its patches, as they were chosen
    programs : one for each cutter at each table angle, of one channel
    covered : what they leave on each surface
    blades : how many channels
    predicted : time that it was chosen by [s]
    changes : of cutters and of the table [s]
    """

    partition: Partition
    programs: tuple[Checked, ...]
    covered: tuple[Covered, ...]
    blades: int
    predicted: float
    changes: float

    @property
    def name(self) -> str:
        """`2 cutters`."""
        return self.partition.name

    @property
    def cutters(self) -> tuple[CatalogueCutter, ...]:
        """All cutters of the programs, each once, with those of rest passes."""
        return tuple(dict.fromkeys(p.setting.cutter for p in self.programs))

    @property
    def path(self) -> float:
        """Length of the path in the cut [mm]."""
        return self.blades * math.fsum(p.setting.length for p in self.programs)

    @property
    def cutting(self) -> float:
        """Time in the cut [s]."""
        return self.blades * math.fsum(p.cutting for p in self.programs)

    @property
    def links(self) -> float:
        """Time of leads, links and rapids [s]."""
        between = (self.blades - 1) * math.fsum(p.between for p in self.programs)
        return self.blades * math.fsum(p.seconds - p.cutting for p in self.programs) + between

    @property
    def seconds(self) -> float:
        """Total time [s]."""
        return self.cutting + self.links + self.changes

    @property
    def fails(self) -> tuple[str, ...]:
        """Conditions that do not hold."""
        return (*(f for p in self.programs for f in p.fails), *(f for c in self.covered for f in c.fails))

    @property
    def doubts(self) -> tuple[str, ...]:
        """What is not proven of its programs."""
        return tuple(f"{p.name}: {text}" for p in self.programs for text in p.machine_check.doubts)

    @property
    def verified(self) -> bool:
        """Whether every program holds, and together they leave no more excess than the limit."""
        return not (self.fails or self.doubts)

    @property
    def scallop(self) -> float | None:
        """Mean height of the scallops as a share of the limit; None: there are none."""
        rows = [x for p in self.programs for x in p.scallops]
        count = sum(x.count for x in rows)
        return math.fsum(x.mean * x.count for x in rows) / count / rows[0].limit if count else None


@dataclass(frozen=True, eq=False)
class StatedJob:
    """Values that the job states: its title, the keys of its operation, the outer diameter [mm], the length of the hub
    ahead of the blade's leading edge [mm], and the names of fixtures and table, which no tool may touch.
    """

    title: str
    settings: Mapping[str, Any]
    outer_diameter: float
    ahead: float = 0.0
    around: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class ImpellerResult:
    """Result of a whole run.

    Parameters
    ----------
    stated : what the job states
    impeller, catalogue, machine : what is milled, with what, where
    surfaces : in their order
    one : the largest cutter for all surfaces at one table angle, and the index of that; None: there is none
    partitions : the cutter picked by hand where one is stated, then one cutter, two, ...
    checked : each partition with its programs, checked; None: the job has none
    roughs : roughing programs, before the others; None: the job has none
    provenance : where the numbers come from
    flanks, points : flank passes and point milling on five axes, in addition to the programs; None: the job has none
    """

    stated: StatedJob
    impeller: Impeller
    catalogue: Catalogue
    machine: Machine
    surfaces: tuple[Searched, ...]
    one: tuple[CatalogueCutter, int] | None
    partitions: tuple[Partition, ...]
    checked: tuple[CheckedPartition, ...] | None
    roughs: tuple[CheckedRough, ...] | None
    provenance: Provenance
    flanks: tuple[CheckedFlank | NoFiveAxisPath, ...] | None = None
    points: tuple[CheckedPoints | NoFiveAxisPath, ...] | None = None

    @property
    def title(self) -> str:
        """Name of the job."""
        return self.stated.title

    @property
    def not_on_five_axes(self) -> tuple[str, ...]:
        """Reasons why surfaces are not milled on five axes although the job has the table."""
        return tuple(p.reason for p in (*(self.flanks or ()), *(self.points or ())) if isinstance(p, NoFiveAxisPath))

    @property
    def picked(self) -> Partition | None:
        """Partition with the hand-picked cutter."""
        return next((partition for partition in self.partitions if partition.name == PICKED), None)

    @property
    def used_checked(self) -> CheckedPartition | None:
        """Partition that is milled: of those that hold, or else of all, the one with the least program time."""
        able = [w for w in self.checked or () if w.name != PICKED]
        return min(able, key=lambda w: (bool(w.fails), bool(w.doubts), w.seconds), default=None)

    @property
    def used(self) -> Partition | None:
        """Partition that is milled; without programs the one with the least predicted time; None: none mills all.

        Of equal ones that with fewer cutters.
        """
        if self.used_checked is not None:
            return self.used_checked.partition
        able = [
            partition for partition in self.partitions if partition.name != PICKED and partition.divided is not None
        ]
        return min(able, key=lambda one: one.divided.total if one.divided else math.inf, default=None)

    @property
    def programs(self) -> tuple[Checked, ...] | None:
        """Finishing programs of the partition that is milled; None: the job has none."""
        return None if self.used_checked is None else self.used_checked.programs

    @property
    def covered(self) -> tuple[Covered, ...] | None:
        """Excess that these programs leave on each surface."""
        return None if self.used_checked is None else self.used_checked.covered

    @property
    def tolerance(self) -> float | None:
        """Greatest depth of a wall in a certified cutter [mm]; None: nothing is certified between check points."""
        return self.surfaces[0].answer.tolerance

    @property
    def area(self) -> float:
        """Area of all surfaces [mm^2], one channel."""
        return float(sum(op.surface.area.sum() for op in self.surfaces))

    def searched(self, patch: Patch) -> Searched:
        """The surface of a patch."""
        return next(
            op for op in self.surfaces if (BODIES.index(op.surface.body), op.surface.side) == (patch.body, patch.side)
        )


def unreached_text(op: Searched, missed: Unreachable) -> str:
    """`contact point 37 at (1.0, 2.0, 3.0): ...: D 8.300 r 2 mm would fit`."""
    x, y, z = op.place[missed.point]
    would = f"D {missed.fits:.3f} r {missed.fits_corner:g} mm would fit" if missed.fits > 0.0 else ""
    would = would or ("none of these corner radii fits" if missed.reason == "cutting part" else "no diameter would fit")
    return f"contact point {missed.point} at ({x:.3f}, {y:.3f}, {z:.3f}): {REASONS[missed.reason]}: {would}"


def unmilled_messages(milled: ImpellerResult) -> tuple[str, ...]:
    """Messages: the partition does not mill all that can be reached, or ranges of pallet angles are undecided."""
    if milled.used is None:
        return (f"{milled.partitions[-1].name} of the catalogue do not mill all that can be reached",)
    divided = milled.used.divided
    undecided = divided.undecided if divided else 0
    return (
        (f"{undecided} ranges of pallet angles had too many arcs to be decided: they are taken as blocked",)
        if undecided
        else ()
    )


def uncertified_text(op: Searched) -> str:
    """Why the largest cutters of contact points are not certified; empty: all are."""
    answer, covering = op.answer, op.surface.scene.covering
    count = int((~answer.certified).sum())
    if not count:
        return ""
    text = f"{op.surface.name}: the largest cutter of {count} contact points is not certified"
    if not answer.bounded.all():
        return f"{text}: too many arcs of pallet angle to decide"
    if covering is None or any(answer.catalogue.cutters[k].corner_radius == 0.0 for k in np.unique(answer.cutter)):
        return f"{text} between check points: a sharp corner may meet a wall there: take cutters with a corner radius"
    return f"{text} between check points: the rim of a shank or holder may meet a wall there: state more clearance_mm"


def certified_text(milled: ImpellerResult) -> str:
    """`certified between the check points within 0.05 mm`."""
    if milled.tolerance is None:
        return "nothing is certified between the check points"
    return f"certified between the check points within {milled.tolerance:g} mm"


def for_all(milled: ImpellerResult) -> str:
    """`one cutter for all: D 16 r 2 mm at 40 deg`."""
    if milled.one is not None:
        c, alpha = milled.one[0], np.degrees(milled.surfaces[0].table.angle[milled.one[1]])
        return f"the largest single cutter for all: {c.label} mm at {alpha:.6g} deg"
    return "no single cutter mills all of it at one table angle"


def largest(op: Searched) -> str:
    """`D 20 r 2 at 45 deg for all`, or the range of diameters."""
    if op.one is not None:
        c, alpha = op.one.cutter, np.degrees(op.table.angle[op.one.table])
        return f"{c.label} mm at {alpha:.6g} deg for all of it"
    d = op.answer.diameter[op.answer.cutter >= 0]
    return f"no single cutter mills all of it at one table angle, D {d.min():g} to {d.max():g} mm point by point"
