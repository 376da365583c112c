"""Inputs of a thin-wall job: its shape with stock, finite elements, operations and thresholds.

Notation: u, v parameters of a side; i, j elements along the wall and up it; delta [mm] allowed deflection.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from chipload.cutting.material import material_named, need_directions, read_material
from chipload.errors import Finding, InputError
from chipload.geometry.mesh import read_mesh
from chipload.geometry.sections import check_sections, loft, read_sections
from chipload.geometry.thin_wall import ThinWall, blade, plate, through_sections
from chipload.jobs.tables import require_stated
from chipload.jobs.thinwall.faces import wall_of_faces
from chipload.jobs.thinwall.job import ThinWallJob
from chipload.jobs.thinwall.part_blank import PartBlank, part_blank
from chipload.jobs.thinwall.part_floor import PartFloor
from chipload.jobs.thinwall.part_shape import PartShape, part_of_faces
from chipload.jobs.thinwall.program_rows import program_rows
from chipload.jobs.thinwall.tables import SHAPES
from chipload.jobs.thinwall.wall_operation import DepthRules, WallCut, WallOperation, wall_operation
from chipload.lazy import trimesh
from chipload.machine.machine import machine_named, read_machine
from chipload.planning.thinwall.blank import SIDES, ContactLine, FinishSurface, WallBlank
from chipload.planning.thinwall.finish_rows import FinishSide
from chipload.planning.thinwall.flank_rows import FlankSide
from chipload.planning.thinwall.flank_stock import FlankPose
from chipload.planning.thinwall.floor_rows import FloorArea, FloorSide
from chipload.planning.thinwall.linking import FineSide
from chipload.planning.thinwall.passes import ThresholdOf
from chipload.planning.thinwall.table import read_cuts
from chipload.planning.thinwall.threshold import Experiments, Threshold, calibrated, modelled
from chipload.result.provenance import title_of
from chipload.simulation.surface import fine as points_of_mesh
from chipload.structure.grid import from_map
from chipload.structure.solid import SolidWorkpiece

Floats = NDArray[np.float64]

#: pieces of the meshes of stock and finished wall, along and up
FACETS = (96, 64)
#: the finished wall may be cut into by the chord of its rows and by so much [mm], for those of chips and facets
GOUGE = 0.003
#: share of the contact line of a tooth over which its force is spread
LOADED = 0.5
#: share of a step-over that rows may be farther apart: a height of whole step-overs, with rounded digits, stays so
SLACK = 1e-4
#: angle of entries over a floor [deg], where the job states none
RAMP_DEG = 2.0


@dataclass(frozen=True, eq=False)
class WallBody:
    """The wall with its stock, or a part with several walls, in mm.

    Attributes
    ----------
    shape : finished
    allowance : on k- and k+, or on each side of a part's walls
    side_numbers : of the sides that have stock, 0 for k-, 1 for k+; of a part all of them
    foot : share of v that keeps its stock; of a part 0
    elastic : its finite elements, or the cells of the part
    places : u (n,) and v (m,) of them
    """

    shape: ThinWall | PartShape
    allowance: tuple[float, ...]
    side_numbers: tuple[int, ...]
    foot: float
    elastic: WallBlank | PartBlank
    places: tuple[Floats, Floats]

    @property
    def wall(self) -> WallBlank:
        """The finite elements of one wall, where it is no part."""
        assert isinstance(self.elastic, WallBlank)
        return self.elastic

    @property
    def swept(self) -> ThinWall:
        """The shape of one wall, where it is no part."""
        assert isinstance(self.shape, ThinWall)
        return self.shape

    @property
    def part(self) -> PartBlank | None:
        """The part with walls; None: one wall."""
        return self.elastic if isinstance(self.elastic, PartBlank) else None

    def compliance(self, left: Sequence[Floats], number: int, line: ContactLine | None = None) -> Floats:
        """C_nn of the places of a side while stock ``left`` is on all sides, (p,) [mm/N]; of a wall that is
        cut with the flank that of a contact line.
        """
        if isinstance(self.elastic, PartBlank):
            return self.elastic.compliance(left, number)
        return self.elastic.compliance(left, SIDES[number], line)

    def wall_of(self, number: int) -> int:
        """Number of the wall of a side."""
        return self.shape.each[number].wall if isinstance(self.shape, PartShape) else 0


@dataclass(frozen=True, eq=False)
class WallInputs:
    """Inputs of planning and simulation.

    Attributes
    ----------
    operations : in the order of cutting
    findings : while it was read
    neighbours, neighbour_meshes : points, and vertices and faces, of the bodies next to one wall, by name
    """

    job: ThinWallJob
    title: str
    body: WallBody
    operations: tuple[WallOperation, ...]
    findings: tuple[Finding, ...]
    neighbours: Mapping[str, Floats] = field(default_factory=dict)
    neighbour_meshes: Mapping[str, tuple[Floats, NDArray[np.int64]]] = field(default_factory=dict)

    @property
    def cut(self) -> WallCut:
        """Cutting data of the last operation, which makes the finished surface."""
        return self.operations[-1].cut

    @property
    def depths(self) -> DepthRules:
        """Depth rules of the last operation."""
        return self.operations[-1].depths

    @property
    def line(self) -> ContactLine | None:
        """Contact line of the flank on the wall, measured from its lower end. The deflection is taken at its upper end,
        where it is greatest. The force acts over half the length along which one tooth cuts with the smallest depth,
        because it is not even along that length. None: the corner radius cuts.
        """
        pose = self.cut.posture
        if not isinstance(pose, FlankPose):
            return None
        height = self.body.shape.size()[1] * (1.0 - self.body.foot)
        return ContactLine(abs(pose.step) / height, LOADED * pose.tooth_line(self.depths.law.limits.smallest) / height)

    @property
    def surface_line(self) -> ContactLine | None:
        """Contact line of the flank for a point of the surface: from there up. None: the corner radius cuts."""
        return None if self.line is None else ContactLine(self.line.length, self.line.length)

    @property
    def below(self) -> float:
        """How far the cutters reach below their contact at most [mm]: the corner radius, of a barrel nearly its arc."""
        return max(o.cut.posture.below for o in self.operations)

    @property
    def top(self) -> float:
        """Height of the wall, or of the part with its stock [mm]."""
        highest = max(float(p[:, 2].max()) for p in self.body.shape.sides(np.linspace(0.0, 1.0, 65), 1.0))
        return highest if self.body.part is None else max(highest, float(self.stock_mesh().bounds[1][2]))

    @property
    def gouge_tolerance(self) -> float:
        """Allowed depth of a gouge in the finished wall [mm]."""
        return self.job.operation.chord_mm + GOUGE

    @property
    def foot_height(self) -> float:
        """Highest point of the foot [mm]."""
        return max(float(p[:, 2].max()) for p in self._lowest_rows())

    @property
    def lowest_row(self) -> float:
        """Lowest point of the rows [mm]."""
        return min(float(p[:, 2].min()) for p in self._lowest_rows())

    def _lowest_rows(self) -> tuple[Floats, ...]:
        return self.body.shape.sides(np.linspace(0.0, 1.0, 65), self.body.foot)

    def coarse(self, side: int) -> FinishSurface:
        """Finish surface at the places."""
        return self._surface(side, *self.body.places)

    def floor(self, side: int) -> PartFloor | None:
        """A side that is a floor; None: it is the side of a wall."""
        shape = self.body.shape
        found = shape.each[side] if isinstance(shape, PartShape) else None
        return found if isinstance(found, PartFloor) else None

    def floor_area(self, side: int, operation: int = -1) -> FloorArea:
        """Where the cutter of an operation may go over a floor."""
        floor, own = require_stated(self.floor(side), "floor"), self.operations[operation]
        return floor.area(own.cut.cutter, own.table.step_mm, math.radians(own.table.ramp_deg or RAMP_DEG))

    def fine(self, side: int, operation: int = -1) -> FineSide | FlankSide | FloorSide:
        """Finish surface at the contact points of an operation: a step apart along the wall, a row apart up it."""
        own = self.operations[operation]
        u, v = np.linspace(0.0, 1.0, 65), np.linspace(self.body.foot, 1.0, 33)
        p = self._surface(side, u, v).points
        along = np.linalg.norm(np.diff(p, axis=0), axis=2).sum(axis=0).max()
        up = np.linalg.norm(np.diff(p, axis=1), axis=2).sum(axis=1).max()
        n = max(math.ceil(along / own.table.step_mm), self._chords(side, own.table.chord_mm), 2) + 1
        m = math.ceil(up / abs(own.cut.step_over) - SLACK) + 1
        u, v = np.linspace(0.0, 1.0, n), np.linspace(self.body.foot, 1.0, m)
        if self.floor(side) is not None:
            return FloorSide(self._surface(side, u, v), u, v, self.floor_area(side, operation))
        made = FlankSide if own.table.contact == "flank" else FineSide
        return made(self._surface(side, u, v), u, v)

    def sides_of(self, operation: int) -> tuple[FineSide | FinishSide | FlankSide | FloorSide, ...]:
        """Sides with stock, each with the rows of an operation: planned, or those of its program."""
        rows = self.operations[operation].rows
        if rows is not None:
            return rows.sides
        return tuple(self.fine(side, operation) for side in self.body.side_numbers)

    def _chords(self, side: int, chord: float) -> int:
        """Straight chords along a row that sag by at most ``chord`` [mm]: the sag of one falls as its square."""
        u, v = np.meshgrid(np.linspace(0.0, 1.0, 65), np.linspace(self.body.foot, 1.0, 17), indexing="ij")
        p = self.body.shape.sides(u, v)[side]
        a, b = p[:-1], p[1:]
        middle = self.body.shape.sides(0.5 * (u[:-1] + u[1:]), v[1:])[side]
        along = (b - a) / np.linalg.norm(b - a, axis=-1, keepdims=True)
        off = middle - a - ((middle - a) * along).sum(axis=-1, keepdims=True) * along
        sag = float(np.linalg.norm(off, axis=-1).max())
        return math.ceil(64 * math.sqrt(sag / chord))

    def _surface(self, side: int, u: Floats, v: Floats) -> FinishSurface:
        a, b = np.meshgrid(u, v, indexing="ij")
        return FinishSurface(
            self.body.shape.sides(a, b)[side],
            self.body.shape.normals(a, b)[side],
            self.body.allowance[side],
            self.body.wall_of(side),
        )

    def threshold(self, deflection: float) -> ThresholdOf:
        """Thresholds of the sides with stock for an allowed deflection [mm]."""

        def limited(left: Sequence[Floats], side: int) -> Threshold:
            C = self.body.compliance(self.both(left), self.body.side_numbers[side], self.line)
            return modelled(C, deflection, self.depths.factor)

        def measured(left: Sequence[Floats], side: int) -> Threshold:
            u, v = np.meshgrid(*self.body.places, indexing="ij")
            place = np.stack([u.ravel(), v.ravel()], axis=1)
            table = require_stated(self.job.table.threshold, "threshold")
            return calibrated(require_stated(self.depths.experiments, "threshold"), place, table.deviations)

        return limited if self.depths.experiments is None else measured

    def finished_threshold(self) -> Threshold:
        """Thresholds of the first side with stock in the finished state."""
        return self.threshold(self.depths.deflection)(
            [np.zeros(self.body.elastic.shape) for _ in self.body.side_numbers], 0
        )

    def both(self, left: Sequence[Floats]) -> list[Floats]:
        """Stock on all sides of stock on those that have any."""
        out = [np.zeros(self.body.elastic.shape) for _ in self.body.allowance]
        for number, D in zip(self.body.side_numbers, left, strict=True):
            out[number] = D
        return out

    def stock_mesh(self) -> trimesh.Trimesh:
        """The workpiece before it is cut."""
        shape = self.body.shape
        if isinstance(shape, PartShape):
            return shape.body(self.body.places, [np.full(self.body.elastic.shape, a) for a in self.body.allowance])
        return shape.mesh(FACETS, _pair(self.body.allowance))

    def finished_mesh(self) -> trimesh.Trimesh:
        """The finished wall, from the clamp up; or the finished part."""
        shape = self.body.shape
        return shape.part if isinstance(shape, PartShape) else shape.mesh(FACETS, (0.0, 0.0))


def read_wall(job: ThinWallJob) -> WallInputs:
    """Read the files of a job and make the finite elements and the force laws.

    Raises
    ------
    InputError
        A file cannot be read, or values do not go together.
    """
    table = job.table
    machine = machine_named(job.machine) if isinstance(job.machine, str) else read_machine(job.machine)
    material = material_named(job.material) if isinstance(job.material, str) else read_material(job.material)
    need_directions(material, "a thin wall")
    experiments: Experiments | None = None
    findings: tuple[Finding, ...] = ()
    if job.threshold_file is not None:
        experiments, findings = read_cuts(job.threshold_file, table.limits.deflection_workpiece_um / 1000.0)
    shape = part_of_faces(job) if job.walls else _shape(job)
    sides, foot = _sides_and_foot(job, shape)
    operations: list[WallOperation] = []
    for k in range(len(table.operation)):
        rows = program_rows(job, k, machine, shape, sides, foot)
        before = operations[-1] if operations else None
        operations.append(wall_operation(job, k, machine, material, experiments, rows, before))
    step_over = min(abs(o.cut.step_over) for o in operations)
    neighbours = _neighbours(job)
    return WallInputs(
        job=job,
        title=title_of(job.path),
        body=_part_body(job, shape, step_over) if isinstance(shape, PartShape) else _wall_body(job, shape, sides, foot),
        operations=tuple(operations),
        findings=(*findings, *(f for o in operations if o.rows is not None for f in o.rows.findings)),
        neighbours={name: points for name, (points, _) in neighbours.items()},
        neighbour_meshes={name: mesh for name, (_, mesh) in neighbours.items()},
    )


def _neighbours(job: ThinWallJob) -> dict[str, tuple[Floats, tuple[Floats, NDArray[np.int64]]]]:
    """Points of the neighbours of one wall, and their vertices and faces, by name."""
    out = {}
    for k, table in enumerate(job.table.neighbour):
        key = f"neighbour.{k}"
        mesh = read_mesh(job.path.parent / table.file, unit=table.units, chord_mm=table.chord_mm, key=f"{key}.file")
        drawn = np.asarray(mesh.vertices), np.asarray(mesh.faces, dtype=np.int64)
        out[f"neighbour {k}"] = points_of_mesh(mesh, table.spacing_mm, key)[0], drawn
    return out


def _pair(values: tuple[float, ...]) -> tuple[float, float]:
    """Values of k- and k+."""
    minus, plus = values
    return minus, plus


def _sides_and_foot(job: ThinWallJob, shape: ThinWall | PartShape) -> tuple[tuple[int, ...], float]:
    """Numbers of the sides that have stock, and the share of v that keeps it."""
    if isinstance(shape, PartShape):
        return tuple(range(len(shape.each))), 0.0
    w, height = job.wall, shape.size()[1]
    foot = w.foot_mm / height
    if not foot < 0.8:
        raise InputError(
            f"wall.foot_mm = {w.foot_mm:g}: must be below 0.8 of the wall's height of {height:.4g} mm: the rest is cut"
        )
    return tuple(k for k, a in enumerate(w.allowance_mm) if a > 0.0), foot


def _part_body(job: ThinWallJob, shape: PartShape, step_over: float) -> WallBody:
    """A part with walls, in its clamps."""
    part = part_blank(job, shape, step_over)
    allowance = tuple(s.allowance for s in part.body.each)
    return WallBody(part.body, allowance, tuple(range(len(allowance))), 0.0, part, part.places)


def _wall_body(job: ThinWallJob, shape: ThinWall, sides: tuple[int, ...], foot: float) -> WallBody:
    """One wall."""
    wall = _wall(job, shape, foot)
    return WallBody(
        shape=shape,
        allowance=job.wall.allowance_mm,
        side_numbers=sides,
        foot=foot,
        elastic=wall,
        places=(np.linspace(0.0, 1.0, wall.shape[0]), np.linspace(foot, 1.0, wall.shape[1])),
    )


def _shape(job: ThinWallJob) -> ThinWall:
    w = job.wall
    if w.shape == "plate":
        return plate(*(require_stated(getattr(w, key), f"wall.{key}") for key in SHAPES["plate"][0]))
    if w.shape == "blade":
        value = {key: float(x) for key, x in w.model_dump().items() if isinstance(x, (int, float))}
        return blade(
            (value["chord_root_mm"], value["chord_tip_mm"]),
            value["height_mm"],
            (value["thickness_root_mm"], value["thickness_tip_mm"]),
            value["edge_share"],
            math.radians(value["camber_deg"]),
            (math.radians(value["stagger_root_deg"]), math.radians(value["stagger_tip_deg"])),
        )
    if w.shape == "step":
        return wall_of_faces(job)
    unit, edge_share = require_stated(w.unit, "wall.unit"), require_stated(w.edge_share, "wall.edge_share")
    made = loft(check_sections(read_sections(job.section_files, unit, columns=w.columns)))
    return through_sections(made, edge_share, w.span or (0.0, 1.0))


def _wall(job: ThinWallJob, shape: ThinWall, foot: float) -> WallBlank:
    """The wall in finite elements with all of its stock, above the share ``foot`` of v."""
    w, made = job.wall, job.table.workpiece
    i, j = w.elements
    rows = max(1, round(foot * j))
    if rows >= j:
        raise InputError(
            f"wall.elements = {list(w.elements)}: {j} up the wall: must be above {rows}, those of the foot: raise it"
        )
    v = np.concatenate([np.linspace(0.0, foot, rows + 1)[:-1], np.linspace(foot, 1.0, j - rows + 1)])

    def place(p: Floats) -> Floats:
        stock = tuple(np.full(len(p), a) for a in w.allowance_mm)
        low, high = shape.offset(p[:, 0], p[:, 1], (stock[0], stock[1]))
        return np.asarray((1.0 - p[:, 2:]) * low + p[:, 2:] * high)

    grid = from_map(np.linspace(0.0, 1.0, i + 1).tolist(), v.tolist(), [0.0, 1.0], place)
    solid = SolidWorkpiece(grid, 1000.0 * made.modulus_gpa, made.poisson, 1e-12 * made.density_kg_m3, grid.side("j-"))
    return WallBlank(solid, w.allowance_mm, 1, rows)
