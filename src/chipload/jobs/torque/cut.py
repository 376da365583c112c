"""The cut of a program in the stock of a thin tube or cone, as planned and in reality.

Notation: z height [mm], s distance from the clamp along the wall, f half angle: z = z_0 +- s cos f; r_0 + s sin f the
radius of the middle surface; the wall t / cos f wide across Z, its outer edge t / (2 cos f) outside that.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from chipload.checking.preparation import resolution_of, with_tool
from chipload.checking.settings import SimulationSettings
from chipload.control.wall import Loads, two_parts
from chipload.cutter.cutter import Cutter
from chipload.cutting.force import mean_forces
from chipload.cutting.material import Material
from chipload.engagement.extent import contact_range
from chipload.errors import InputError, Severity
from chipload.jobs.tables import require_stated
from chipload.jobs.torque.job import TorqueJob
from chipload.jobs.torque.tables import RoundTable, ShellTable, SurpriseTable
from chipload.machine.machine import Machine
from chipload.number_text import number_text
from chipload.planning.hand import clockwise_milling, require_hand, signed_speed
from chipload.program.build import helix, plunge, rapid
from chipload.program.program import RAPID, Program
from chipload.program.read import ProgramReading, read_program
from chipload.program.setup import Setup
from chipload.progress import Progress, silent
from chipload.simulation.chips import remove_with_edge
from chipload.simulation.removal import Removal, Resolution
from chipload.stock.layers import LayeredStock
from chipload.stock.rings import Boss, ring_stock
from chipload.stock.tile_grid import LAYER_LIMIT
from chipload.structure.beam import compliance
from chipload.units import mm_s_from_mm_min, rad_s_from_rpm, rpm_from_rad_s

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

#: chords of a conical helix leave it by at most this [mm]
CHORD_MM = 0.005
#: most points of a conical helix
MOST_POINTS = 2_000_000
#: least cutting coefficient that is accepted [MPa]; the second of the two simulations uses it
LITTLE_MPA = 10.0
#: a flank within so much of the finished surface makes it [mm]
MAKES_MM = 0.05
#: slices of a corner or a bottom: of a flat mill that goes down a helix the whole bottom cuts, and half as many leave
#: 7 % of its greatest force unknown instead of 2 %
SLICES = 48
#: layers where no cutter comes are so many times as thick
COARSE = 8.0


@dataclass(frozen=True)
class Place:
    """Position of the finished wall."""

    table: ShellTable

    @property
    def _sense(self) -> float:
        return 1.0 if self.table.clamped == "low" else -1.0

    @property
    def angle(self) -> float:
        """Half angle f [rad]."""
        return math.radians(self.table.angle_deg)

    @property
    def ends(self) -> tuple[float, float]:
        """Lowest and highest z [mm]."""
        other = self.table.clamp_z_mm + self._sense * self.table.length_mm * math.cos(self.angle)
        return min(self.table.clamp_z_mm, other), max(self.table.clamp_z_mm, other)

    def along(self, z: Floats) -> Floats:
        """Distance s along the wall of heights [mm]; outside 0 .. length beyond the wall."""
        return np.asarray(self._sense * (z - self.table.clamp_z_mm) / math.cos(self.angle))

    def outer(self, z: Floats) -> Floats:
        """Radius of the finished outer surface at heights [mm]."""
        return np.asarray(self._middle(z) + 0.5 * self.table.wall_mm / math.cos(self.angle))

    def bore(self, z: Floats, thinner: float = 0.0) -> Floats:
        """Radius of the bore, of a wall that is thinner by a share."""
        return self.outer(z) - self.table.wall_mm * (1.0 - thinner) / math.cos(self.angle)

    def _middle(self, z: Floats) -> Floats:
        return np.asarray(self.table.mean_radius_mm + self.along(z) * math.sin(self.angle))


@dataclass(frozen=True, eq=False)
class CutSteps:
    """Cutting data of the steps of a program, from the first feed to the last.

    Parameters
    ----------
    removal : all of it
    stock : what is left
    points : (n + 1, 3) float [mm], ends of the steps
    feed : (n,) float [mm/s]
    loads : in two parts
    """

    removal: Removal
    stock: LayeredStock
    points: Floats
    feed: Floats
    loads: Loads

    @property
    def rows(self) -> slice:
        """Rows of the removal of the steps."""
        first = int(np.flatnonzero(~self.removal.columns["rapid"])[0])
        return slice(first, first + len(self.feed))


@dataclass(frozen=True, eq=False)
class Cut(CutSteps):
    """Removal and cutting data of the steps of a program in the stock of a thin wall.

    Parameters
    ----------
    near, far : (n,) float [mm], s of the ends of the depth of cut, nearer to the clamp and to the free end
    makes : (n,) bool, the step makes the finished surface
    tool : (n,) float [mm/N], compliance of the cutter in the middle of the depth of cut
    """

    near: Floats
    far: Floats
    makes: Bools
    tool: Floats


def program_of(job: TorqueJob, machine: Machine, progress: Progress = silent) -> Program:
    """Program of the job: the stated file, or the generated one.

    Raises
    ------
    InputError
        It cannot be read, does not hold on the machine, leans its axis, or changes its spindle speed while it cuts.
    """
    if job.program_file is None:
        round_table = require_stated(job.table.round, "round")
        cutter = job.cutters[round_table.cutter]
        require_hand(machine, cutter)
        program = round_program(round_table, Place(job.shell), cutter)
    else:
        program = with_tool(read_file(job, job.program_file, machine, progress).program, job.cutters)
    if np.abs(program.axis - (0.0, 0.0, 1.0)).max() > 1e-9:
        raise InputError("program: the cutter's axis leans: must be +Z all along; use a cutter with the wall's taper")
    cuts = program.motion != RAPID
    if not cuts.any():
        raise InputError("program: has no feed motion: there is nothing to control")
    speeds = np.unique(program.spindle[cuts])
    if len(speeds) != 1 or speeds[0] == 0.0:
        raise InputError(
            f"program: spindle speeds {', '.join(f'{rpm_from_rad_s(x):g}' for x in speeds)} rpm: must be one speed, "
            "not 0: the torque is estimated at one speed"
        )
    return program


def read_file(job: TorqueJob, file: Path, machine: Machine, progress: Progress = silent) -> ProgramReading:
    """Read the program of the job.

    Raises
    ------
    InputError
        It cannot be read, does not hold on the machine, or moves otherwise with block delete on.
    """
    table = require_stated(job.table.program, "program")
    feed = mm_s_from_mm_min(table.feed_mm_min) if table.feed_mm_min is not None else None
    reading = read_program(
        file, machine, dialect=table.dialect, feed=feed, tolerance=table.tolerance_mm,
        setup=Setup(table.parameters, table.work_offsets, job.cutters), comments=table.tool_comments,
        progress=progress,
    )  # fmt: skip
    if reading.violations:
        raise InputError(f"{file.name}: exceeds a limit of the machine: {reading.violations[0]}")
    gaps = [f for f in reading.findings if f.severity >= Severity.UNPROVEN]
    if gaps:
        raise InputError(f"{file.name}: {gaps[0]}: chipload cannot control a line that it does not read")
    if reading.skipped is not None:
        raise InputError(f"{file.name}: moves otherwise with block delete on: take its blocks with / out, or their /")
    return reading


def round_program(table: RoundTable, place: Place, cutter: Cutter) -> Program:
    """Straight to the wall, down it in a helix, one full turn at the bottom, straight away."""
    spindle, tool = signed_speed(rad_s_from_rpm(table.speed_rpm), cutter), cutter.number
    feed = mm_s_from_mm_min(table.feed_mm_min)
    # with the wall on the right of travel: clockwise round it
    sense = -1 if clockwise_milling(table.milling, cutter) == "down" else 1
    corner = float(cutter.radius_at(cutter.apt[3]))

    def radius(z: float) -> float:
        """Of the tip's path, so that the flank leaves the wall."""
        return float(place.outer(np.array([z + cutter.apt[3]]))[0]) + corner

    top, low = table.top_mm, table.bottom_mm
    start = (radius(top), -sense * table.lead_mm)
    clear = place.ends[1] + table.clearance_mm
    parts = [
        rapid([[*start, clear], [*start, top]], spindle, tool, "link"),
        plunge([radius(top), 0.0, top], feed, spindle, tool, "lead"),
    ]
    if place.angle == 0.0:
        parts.append(
            helix((radius(top), 0.0), (0.0, 0.0), (top, low), table.pitch_mm, feed, spindle, tool, "round", sense)
        )
    else:
        turns = math.ceil((top - low) / table.pitch_mm - 1e-9)
        step = 2.0 * math.acos(1.0 - CHORD_MM / max(radius(top), radius(low)))
        n = max(8, math.ceil(math.tau / step))
        if turns * n > MOST_POINTS:
            raise InputError(
                f"round.pitch_mm = {table.pitch_mm:g}: {turns:.4g} rounds from top_mm = {top:g} to "
                f"bottom_mm = {low:g}, {number_text(turns * n)} points: must be at most {MOST_POINTS}: "
                "state a larger pitch, or a lower top"
            )
        z = np.concatenate([np.linspace(top, low, turns * n + 1)[1:], np.full(n, low)])
        a = sense * math.tau * np.arange(1, len(z) + 1) / n
        r = np.array([radius(float(x)) for x in z])
        parts.append(plunge(np.column_stack([r * np.cos(a), r * np.sin(a), z]), feed, spindle, tool, "round"))
    away = [radius(low), sense * table.lead_mm]
    parts += [
        plunge([*away, low], feed, spindle, tool, "lead"),
        rapid([*away, clear], spindle, tool, "link"),
    ]
    program = Program.join(parts)
    return replace(program, line=np.arange(1, len(program) + 1))


def shell_stock(
    job: TorqueJob, program: Program, centre: tuple[float, float] = (0.0, 0.0), thinner: float = 0.0
) -> LayeredStock:
    """The stock: rings outside the wall, their outer edge off its centre, layers thin where the cutter comes."""
    table, place = job.shell, Place(job.shell)
    low, high = place.ends
    feeds = np.flatnonzero(program.motion != RAPID)
    rows = np.unique(np.concatenate([feeds, np.maximum(feeds - 1, 0)]))
    z = program.p_work[rows, 2]
    lowest = min(max(float(z.min()), low), high)
    fine = job.table.simulation.layer_mm
    if (high - low) / fine > LAYER_LIMIT:
        raise InputError(
            f"simulation.layer_mm = {fine:g}: {(high - low) / fine:.4g} layers: must be at most {LAYER_LIMIT}: state "
            "thicker layers"
        )
    bounds = [np.linspace(lowest, high, max(1, math.ceil((high - lowest) / fine - 1e-9)) + 1)]
    if lowest > low:
        bounds.insert(0, np.linspace(low, lowest, max(1, math.ceil((lowest - low) / (COARSE * fine))) + 1)[:-1])
    bosses = [Boss(math.radians(b.from_deg), math.radians(b.to_deg), b.radial_mm) for b in table.boss]
    return ring_stock(
        np.concatenate(bounds),
        lambda h: place.bore(h, thinner),
        lambda h: place.outer(h) + table.stock_mm,
        centre,
        bosses,
        4.0 * max(c.diameter for c in job.cutters.values()),
    )


def settings_of(job: TorqueJob) -> SimulationSettings:
    """Settings of the simulations, in the stock of a wall or of a workpiece."""
    table = job.table.simulation
    return SimulationSettings(table.step_mm, table.tolerance_mm, corner_slices=SLICES)


def resolution_in_stock(job: TorqueJob, program: Program) -> Resolution:
    """Resolution of the simulations."""
    return resolution_of(settings_of(job), job.cutters, program)


def require_linear(material: Material) -> None:
    """Refuse a material whose torque cannot be split into a part of the edge and a part in proportion to the feed.

    Raises
    ------
    InputError
        It has a size effect, or cuts as softly as the material that the parts are found with.
    """
    if any(material.exponents):
        raise InputError(
            f"material {material.name}: has a size effect: must have none here: the torque is split into a part of the "
            "edge and a part proportional to the feed"
        )
    if material.Ktc <= LITTLE_MPA:
        raise InputError(f"material.ktc_mpa = {material.Ktc:g}: must be above {LITTLE_MPA:g}")


def cut(
    job: TorqueJob,
    program: Program,
    stock: LayeredStock,
    material: Material,
    rapids: float,
    progress: Progress,
    *,
    accuracy: bool = False,
) -> Cut:
    """Simulate the program in the stock, which changes.

    Parameters
    ----------
    rapids : feed of the rapids between two cuts [mm/s]
    accuracy : find the error of the loads

    Raises
    ------
    InputError
        As :func:`chipload.simulation.chips.remove`; the material has a size effect, the tip stands while it cuts.
    """
    require_linear(material)
    fine = resolution_in_stock(job, program)
    edge = edge_material(material)
    removal, less = remove_with_edge(
        program, stock, job.cutters, material, edge, fine, accuracy=accuracy, progress=progress
    )
    c, own, little = removal.columns, feed_rows(removal), LITTLE_MPA / material.Ktc
    points = step_points(removal, program)
    loads = two_parts(
        torque_of_cuts(removal, material)[own], c["force_normal_n"][own],
        torque_of_cuts(less, edge)[own], less.columns["force_normal_n"][own], little,
    )  # fmt: skip
    feed = step_feeds(removal, rapids)
    near, far, height = _depths(Place(job.shell), points, removal, job.table.simulation.layer_mm)
    tools = c["tool"][own]
    makes, soft = np.zeros(len(feed), dtype=np.bool_), np.zeros(len(feed))
    for number in np.unique(tools).tolist():
        rows = np.flatnonzero((tools == number) & (height > 0.0))
        m, t = _finished_surface(Place(job.shell), job.cutters[number], points, rows, height)
        makes[rows], soft[rows] = m, t
    return Cut(removal, stock, points, feed, loads, near, far, makes, soft)


def edge_material(material: Material) -> Material:
    """The material with little more than its edge coefficients."""
    little = LITTLE_MPA / material.Ktc
    return replace(
        material, Ktc=LITTLE_MPA, Krc=little * material.Krc, Kac=little * material.Kac, spread=None, covariance=None
    )


def torque_of_cuts(removal: Removal, material: Material) -> Floats:
    """Mean torque over a revolution (n,) [N mm] of each row, at the instant of a step at which its force is greatest,
    so that torque and force of a step that enters or leaves the stock are those of one engagement.
    """
    out = np.zeros(len(removal.columns["line"]))
    for cuts in removal.cuts:
        out[cuts.step] = mean_forces(cuts.engagement, cuts.cutter, material)[1]
    return out


def feed_rows(removal: Removal) -> slice:
    """Rows of a removal from its first feed to its last."""
    feeds = np.flatnonzero(~removal.columns["rapid"])
    return slice(int(feeds[0]), int(feeds[-1]) + 1)


def step_points(removal: Removal, program: Program) -> Floats:
    """Ends of the steps from the first feed to the last, (n + 1, 3) [mm].

    Raises
    ------
    InputError
        The tip stands still.
    """
    c, own = removal.columns, feed_rows(removal)
    ends = np.column_stack([c[f"{x}_mm"] for x in "xyz"])
    start = ends[own.start - 1] if own.start > 0 else np.asarray(program.p_work[0])
    points = np.vstack([start, ends[own]])
    length = np.linalg.norm(np.diff(points, axis=0), axis=1)
    if (length == 0.0).any():
        line = int(c["line"][own][int(np.argmin(length))])
        raise InputError(f"line {line}: the tip stands still: must move along the path")
    return points


def step_feeds(removal: Removal, rapids: float) -> Floats:
    """Programmed feeds of the same steps, (n,) [mm/s]; ``rapids`` that of the rapids between two cuts."""
    c, own = removal.columns, feed_rows(removal)
    return np.where(c["rapid"][own], rapids, mm_s_from_mm_min(1.0) * c["feed_mm_min"][own])


def _depths(place: Place, points: Floats, removal: Removal, within: float) -> tuple[Floats, Floats, Floats]:
    """S of both ends of each step's depth of cut, and its height: between the lowest and the highest point of the edge
    that cuts, on the wall.

    The ends are known to half of ``within`` [mm], so that steps of nearly one depth share the response of the wall.
    """
    own, n = feed_rows(removal), len(points) - 1
    low, high, tip = np.zeros(n), np.zeros(n), 0.5 * (points[1:, 2] + points[:-1, 2])
    for cuts in removal.cuts:
        row = cuts.step - own.start
        low[row], high[row] = contact_range(cuts.plain)
    a, b = place.along(tip + low), place.along(tip + high)
    ends = np.clip(np.column_stack([np.minimum(a, b), np.maximum(a, b)]), 0.0, place.table.length_mm)
    round_ends = np.clip(np.round(ends / within) * within, 0.0, place.table.length_mm)
    ends = np.where((round_ends[:, 1] > round_ends[:, 0])[:, None], round_ends, ends)
    near, far = np.where((high > low)[:, None], ends, 0.0).T
    return near, far, high - low


def _finished_surface(
    place: Place, cutter: Cutter, points: Floats, rows: NDArray[np.int64], height: Floats
) -> tuple[Bools, Floats]:
    """Whether the flank makes the finished surface, and the cutter's compliance, in the middle of the depth of cut."""
    middle = 0.5 * (points[rows] + points[rows + 1])
    half = np.minimum(0.5 * height[rows], cutter.flute_length)
    gap = np.hypot(middle[:, 0], middle[:, 1]) - cutter.radius_at(half) - place.outer(middle[:, 2] + half)
    return np.abs(gap) <= MAKES_MM, compliance(cutter, half, half)


def true_loads(loads: Loads, points: Floats, place: Place, surprises: tuple[SurpriseTable, ...]) -> Loads:
    """Loads with a worn cutter and hard spots; thicker sides and thinner walls are in the real cut."""
    middle = 0.5 * (points[1:] + points[:-1])
    around = place.outer(middle[:, 2])

    def away(x: SurpriseTable) -> Floats:
        """Distance from a hard spot, round the wall."""
        turn = np.arctan2(middle[:, 1], middle[:, 0]) - math.radians(require_stated(x.at_deg, "surprise.at_deg"))
        return np.asarray(around * np.abs(np.angle(np.exp(1j * turn))))

    edge, cut = surprise_factors(len(middle), away, surprises)
    return Loads(loads.torque_edge * edge, loads.torque_cut * cut, loads.force_edge * edge, loads.force_cut * cut)


def surprise_factors(
    steps: int, away: Callable[[SurpriseTable], Floats], surprises: tuple[SurpriseTable, ...]
) -> tuple[Floats, Floats]:
    """Factors (n,) of the parts of the edge and of the feed.

    ``away`` gives the (n,) distance [mm] of the steps from a hard spot.
    """
    cut, edge = np.ones(steps), np.ones(steps)
    for x in surprises:
        if x.kind == "worn-cutter":
            cut *= 1.0 + x.share
            edge *= 1.0 + require_stated(x.edge_share, "surprise.edge_share")
        elif x.kind == "hard-spot":
            width, ramp = require_stated(x.width_mm, "surprise.width_mm"), require_stated(x.ramp_mm, "surprise.ramp_mm")
            there = np.clip((0.5 * width - away(x)) / ramp + 1.0, 0.0, 1.0)
            cut *= 1.0 + x.share * there
            edge *= 1.0 + x.share * there
    return edge, cut


def off_centre(stock_mm: float, surprises: tuple[SurpriseTable, ...]) -> tuple[float, float]:
    """Real centre of the stock's outer edge [mm]."""
    x = y = 0.0
    for one in surprises:
        if one.kind == "thicker-side":
            at = math.radians(require_stated(one.at_deg, "surprise.at_deg"))
            x += one.share * stock_mm * math.cos(at)
            y += one.share * stock_mm * math.sin(at)
    return x, y


def thinner_share(surprises: tuple[SurpriseTable, ...]) -> float:
    """Share by which the wall is thinner than planned."""
    return 1.0 - math.prod(1.0 - x.share for x in surprises if x.kind == "thinner-wall")


def contact_width(stock_mm: float, cutters: Mapping[int, Cutter]) -> float:
    """Width of the contact round the wall, as on a flat one: sqrt(a (2 R - a)) with the smallest cutter [mm]."""
    radius = min(c.radius for c in cutters.values())
    a = min(stock_mm, radius)
    return math.sqrt(a * (2.0 * radius - a))
