"""Simulation of one variant of the passes over a thin wall: forces, deflections, form error, gouges.

Notation: F_n [N] greatest force along the normal of the surface that a pass leaves; C_nn [mm/N] normal compliance of
the wall in the state of that pass, by finite elements; F_th [N] threshold. C_nn between places by cubics of its
logarithm, see :mod:`chipload.jobs.thinwall.places`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipload.checking.default_checks import check_columns
from chipload.checking.settings import CheckSettings
from chipload.jobs.tables import value_of
from chipload.jobs.thinwall.floor_loads import FloorLoads, floor_finish, floor_loads
from chipload.jobs.thinwall.floor_shape import floor_shape
from chipload.jobs.thinwall.inputs import WallInputs
from chipload.jobs.thinwall.load_error import load_error
from chipload.jobs.thinwall.mesh_error import error_at
from chipload.jobs.thinwall.neighbours import part_collisions, wall_collisions
from chipload.jobs.thinwall.outcome import Finish, Shape, Surfaces
from chipload.jobs.thinwall.part_shape import PartShape
from chipload.jobs.thinwall.places import Places, interpolate_places
from chipload.lazy import scipy
from chipload.planning.thinwall.blank import SIDES
from chipload.planning.thinwall.pass_program import PassProgram
from chipload.planning.thinwall.passes import Plan
from chipload.program.program import Program
from chipload.progress import Progress
from chipload.simulation.chips import stack_blocks
from chipload.simulation.contact_points import touch_points
from chipload.simulation.continued import KnownRemoval, remove_from
from chipload.simulation.deflection import Contacts, form_error, step_deflections
from chipload.simulation.initial_stock import initial_stock
from chipload.simulation.removal import Removal, Resolution, removal_between
from chipload.simulation.shape_deviation import mesh_points, nearest, shape_deviation
from chipload.stock.layers import LayeredStock
from chipload.structure.places import normals_of, on_cut, on_side, weights
from chipload.structure.solid import displacement, factorise
from chipload.structure.spindle import tool_bars
from chipload.structure.stress import greatest

Floats = NDArray[np.float64]

#: direction up a wall
UP = np.array([0.0, 0.0, 1.0])
#: places of a step at which the wall is judged: its beginning, middle and end
JUDGED, MIDDLE = (0.0, 0.5, 1.0), 1
#: rotations of a flank between which greatest forces are searched [rad]: its engagement begins and ends abruptly
FLANK_TURN = math.radians(0.25)
#: variants whose stock is even
EVEN = ("constant", "unconstrained")
#: points of a finished side, along and up
POINTS = (33, 25)
#: the highest points lie so much of v below the free edge, at which the contact of a row ends
EDGE = 0.002
#: spacing [mm] of the points of the finished wall with which the path is compared, and the stock up the wall
CLOUD = 0.2
#: points along the wall with which the stock is compared
SHAPE_POINTS = 64


@dataclass(frozen=True, eq=False)
class Proof:
    """Result of the simulation of a variant.

    Attributes
    ----------
    columns : one row for each step, all passes one after another
    thresholds : (n, m) [N] a pass, at the places of its side
    find_surfaces : gives what the plan leaves
    find_load_error : gives the relative error of the loads by column, of layers and steps
    removal : of the simulation, from which a plan that begins alike continues; None: it is not kept
    """

    columns: Mapping[str, NDArray[Any]]
    thresholds: tuple[Floats, ...]
    find_surfaces: Callable[[], Surfaces]
    find_load_error: Callable[[], Mapping[str, float]]
    removal: KnownRemoval | None = None


@dataclass(frozen=True, eq=False)
class _CutPass:
    """A pass as it was simulated: its columns, the stock that it leaves on all sides, and its removal."""

    side: int
    left: tuple[Floats, ...]
    columns: Mapping[str, NDArray[Any]]
    removal: Removal


def resolution_of(inputs: WallInputs, program: Program) -> Resolution:
    """Resolution of the simulation of the whole program: the finest of the operations; one row is one step."""
    tables = [o.table for o in inputs.operations]
    longest = float(np.linalg.norm(np.diff(program.p_work, axis=0), axis=1).max())
    return Resolution(
        max(longest, *(op.step_mm for op in tables)),
        min(op.tolerance_mm for op in tables),
        max(op.corner_slices for op in tables),
        0.5 * min(o.cut.cutter.radius for o in inputs.operations),
    )


def prove(
    places: Places,
    plan: Plan,
    pass_programs: Sequence[PassProgram],
    times: Floats,
    progress: Progress,
    read: Program | None = None,
    before: KnownRemoval | None = None,
) -> Proof:
    """Simulate the program of all passes of a plan from the uncut stock.

    Parameters
    ----------
    times : (n,) float [s], time of each row of the program on the machine
    read : the program as its text is read back, with the lines of ``pass_programs``; None: it is simulated as planned
    before : the removal of another plan, whose first passes are not simulated again where they are those of this one
    """
    inputs = places.inputs
    stock, program = places.uncut.copied(), read or Program.join([one.program for one in pass_programs])
    fine, cutters = resolution_of(inputs, program), {o.cut.cutter.number: o.cut.cutter for o in inputs.operations}
    known = remove_from(before, program, stock, cutters, inputs.cut.material, fine, times, progress)
    whole = known.removal
    bars = {number: tool_bars(cutter) for number, cutter in cutters.items()}
    left = [np.full(places.shape, inputs.body.allowance[s]) for s in inputs.body.side_numbers]
    cut: list[_CutPass] = []
    thresholds: list[Floats] = []
    for p, pass_program, removal in zip(
        plan.passes, pass_programs, removals_of_passes(whole, pass_programs), strict=True
    ):
        rules = inputs.operations[p.operation].depths
        left[p.side] = p.low
        floor = inputs.floor(inputs.body.side_numbers[p.side]) is not None
        C = places.compliance(left, p.side)
        F_th = places.threshold(inputs.depths.deflection, 1.0, spare=False)(left, p.side).force.reshape(places.shape)
        thresholds.append(F_th)
        error = places.error(p.side)
        loads = floor_loads(places, removal, left, p.side, error) if floor and removal.cuts else None
        columns = _columns(places, removal, pass_program, C, F_th, error, bars, loads)
        u, v = np.clip(columns["u"], 0.0, 1.0), np.clip(columns["v"], inputs.body.foot, 1.0)
        share = scipy.interpolate.RegularGridInterpolator(places.grid, p.correction)(np.column_stack([u, v]))
        law = rules.even_law if plan.name in EVEN else rules.law
        columns["force_normal_planned_n"] = share * law.force(columns["depth_mm"])
        if places.chatter is not None:
            columns |= places.chatter.columns(places, removal, p, left, columns)
        columns["pass"] = np.full(len(columns["t_s"]), pass_program.program.labels[0], dtype=object)
        cut.append(_CutPass(p.side, tuple(left), columns, removal))
    floors = any(inputs.floor(number) is not None for number in inputs.body.side_numbers)
    return Proof(
        stack_blocks([one.columns for one in cut]),
        tuple(thresholds),
        partial(_surfaces, places, cut, bars, stock, pass_programs, program),
        partial(load_error, program, places.uncut, whole, cutters, inputs.cut.material, fine, floors=floors),
        known,
    )


def _surfaces(
    places: Places,
    cut: Sequence[_CutPass],
    bars: Mapping[int, Any],
    stock: LayeredStock,
    pass_programs: Sequence[PassProgram],
    program: Program,
) -> Surfaces:
    """What the passes of a plan leave."""
    inputs, finish, stress = places.inputs, dict[int, Finish](), 0.0
    last = {one.side: k for k, one in enumerate(cut)}
    for k, one in enumerate(cut):
        number = inputs.body.side_numbers[one.side]
        stress = max(stress, _stress(inputs, places.coarse(one.left), number, one.columns))
        if k != last[one.side]:
            continue
        error = places.error(one.side)
        if inputs.floor(number) is not None:
            finish[number] = floor_finish(places, one.removal, one.left, one.side, error)
        else:
            C = places.compliance(one.left, one.side, of_surface=True)
            finish[number] = _finish(inputs, one.removal, number, C, error, bars)
    return Surfaces(tuple(finish.values()), _shape(places, stock, pass_programs, program), stress)


def removals_of_passes(whole: Removal, pass_programs: Sequence[PassProgram]) -> list[Removal]:
    """The removal of each pass from that of the whole program, by the lines of its rows."""
    ends = np.searchsorted(whole.columns["line"], [int(one.program.line[-1]) for one in pass_programs], side="right")
    return [removal_between(whole, int(a), int(b)) for a, b in zip([0, *ends[:-1]], ends, strict=True)]


def _stress(inputs: WallInputs, left: Sequence[Floats], number: int, columns: Mapping[str, NDArray[Any]]) -> float:
    """Greatest equivalent stress [MPa] of the elements at the clamp by the contact point whose force bends them most:
    its force times its height. Of a part everywhere, by the greatest deflection and by the greatest force.
    """
    if inputs.body.part is not None:
        rows = {int(np.argmax(columns[name])) for name in ("deflection_workpiece_um", "force_normal_n")}
        at = np.clip(np.column_stack([columns[name] for name in ("u", "v")]), 0.0, 1.0)
        return max(
            inputs.body.part.stress(
                inputs.both(left), number, float(at[k, 0]), float(at[k, 1]), float(columns["force_normal_n"][k])
            )
            for k in rows
        )
    k = int(np.argmax(columns["force_normal_n"] * columns["contact_z_mm"]))
    if not columns["force_normal_n"][k] > 0.0:
        return 0.0
    solid = inputs.body.wall.state(inputs.both(left))
    grid = solid.grid
    v = float(_acting_heights(inputs, columns["v"][k]))
    places = on_side(grid, SIDES[number], [columns["u"][k]], [_rows(inputs, v) / grid.counts[1]])
    places = on_cut(places, solid.kept, SIDES[number])
    force = weights(grid, places).T @ (columns["force_normal_n"][k] * normals_of(grid, places, SIDES[number]))
    foot = np.arange(len(grid.elements)).reshape(grid.counts)[:, 0].ravel()
    return greatest(solid, displacement(factorise(solid), force), foot)


def _acting_heights(inputs: WallInputs, v: ArrayLike) -> Floats:
    """Parameters v at which the force of contacts is judged: of a flank the upper ends of its contact lines."""
    at, foot = np.asarray(v, dtype=np.float64), inputs.body.foot
    return at if inputs.line is None else foot + (1.0 - foot) * inputs.line.ends((at - foot) / (1.0 - foot))[0]


def _rows(inputs: WallInputs, v: float) -> float:
    """How many rows of elements a parameter v lies above the clamp."""
    j = inputs.body.wall.solid.grid.counts[1]
    return float(np.interp(v, [0.0, inputs.body.foot, 1.0], [0.0, inputs.body.wall.foot + 1e-9, j]))


def _columns(
    places: Places,
    removal: Removal,
    pass_program: PassProgram,
    C: Floats,
    F_th: Floats,
    error: Floats,
    bars: Mapping[int, Any],
    loads: FloorLoads | None = None,
) -> dict[str, NDArray[Any]]:
    """Columns of a pass: those of the removal, and what its contact points feel; ``loads`` of a floor.

    The force of a step acts anywhere in it: threshold and compliance are the worst of its beginning, middle and end, so
    that edges and corners of the wall are among them. `contact_*_mm` is the place of that threshold, the upper end of a
    contact line; `u` and `v` are those of the middle. `depth_mm` is the greatest planned depth of the three, as the
    force is the greatest in the step. `compliance_error` is the greatest error of the compliance by its mesh there.
    """
    inputs = places.inputs
    columns = dict(removal.columns)
    columns.pop("label")
    n = len(columns["line"])
    known = np.column_stack([pass_program.place, pass_program.depth])
    spots = [
        touch_points(
            removal,
            int(pass_program.program.line[0]),
            pass_program.contact,
            pass_program.points,
            pass_program.normals,
            known,
            within,
        )
        for within in JUDGED
    ]
    uv = [(np.clip(x[:, 0], 0.0, 1.0), np.clip(x[:, 1], inputs.body.foot, 1.0)) for _, x in spots]
    gives = np.stack([interpolate_places(inputs.body.places, C, u, v) for u, v in uv])
    if inputs.depths.experiments is None:
        allowable = inputs.depths.deflection / gives
    else:
        allowable = np.stack([interpolate_places(places.grid, F_th, u, v) for u, v in uv])
    unsure = np.stack([error_at(inputs.body.places, error, u, v) for u, v in uv]).max(axis=0)
    place, deepest = spots[MIDDLE][0], np.stack([values[:, 2] for _, values in spots]).max(axis=0)
    u, v = uv[MIDDLE]
    if loads is not None:
        gives, unsure = loads.normal[None], loads.error
        allowable = inputs.depths.deflection / gives
        found = _floor_deflections(n, loads)
    elif removal.cuts:
        found = _deflections(inputs, removal, place, gives.max(axis=0), bars)
    else:  # a pass that takes only films: its loads are not known, as its load_error states
        found = dict.fromkeys(("work_mm", "cutter_mm", "deflection_mm", "force_normal_n"), np.zeros(n))
    weakest, each = allowable.argmin(axis=0), np.arange(len(u))
    threshold = allowable[weakest, each]
    judged = np.stack([spot.point for spot, _ in spots])[weakest if loads is None else np.full(len(u), MIDDLE), each]
    if inputs.line is not None:  # along the wall, which is plane
        up = np.stack([_acting_heights(inputs, b) - b for _, b in uv])[weakest, each]
        judged = judged + (up * inputs.body.shape.size()[1])[:, None] * UP
    columns |= {
        "deflection_workpiece_um": 1000.0 * found["work_mm"],
        "deflection_cutter_um": 1000.0 * found["cutter_mm"],
        "deflection_um": 1000.0 * found["deflection_mm"],
        "force_normal_n": found["force_normal_n"],
    }
    columns |= check_columns(
        value_of(CheckSettings, inputs.job.table.checks), removal.cuts, inputs.cut.material, columns["deflection_um"]
    )
    at = place.step
    for name, given in (
        ("u", u),
        ("v", v),
        ("depth_mm", deepest),
        ("force_allowable_n", threshold),
        ("compliance_error", unsure),
        *((f"contact_{x}_mm", judged[:, k]) for k, x in enumerate("xyz")),
    ):
        columns[name] = np.zeros(n)
        columns[name][at] = given
    ratio = np.zeros(n)
    ratio[at] = found["force_normal_n"][at] / threshold
    columns["force_over_allowable"] = ratio
    columns["side"] = np.full(n, pass_program.side)
    columns["operation"] = np.full(n, pass_program.operation)
    return columns


def _floor_deflections(n: int, loads: FloorLoads) -> dict[str, NDArray[Any]]:
    """As :func:`chipload.simulation.deflection.step_deflections`; the cutter is stiff along its axis."""
    out = {name: np.zeros(n) for name in ("work_mm", "cutter_mm", "deflection_mm", "force_normal_n")}
    out["work_mm"][loads.step] = out["deflection_mm"][loads.step] = loads.motion
    out["force_normal_n"][loads.step] = loads.motion / loads.normal
    return out


def _deflections(
    inputs: WallInputs, removal: Removal, place: Contacts, gives: Floats, bars: Mapping[int, Any]
) -> dict[str, NDArray[Any]]:
    """Greatest deflections and normal force of the steps; a flank may also pull the wall towards it, in up milling."""
    material = inputs.cut.material
    if inputs.line is None:
        return step_deflections(removal, material, place, work=gives, bars=bars)
    both = [
        step_deflections(
            removal, material, replace(place, normal=s * place.normal), work=gives, bars=bars, rotation=FLANK_TURN
        )
        for s in (1.0, -1.0)
    ]
    return {name: np.maximum(values, both[1][name]) for name, values in both[0].items()}


def _finish(
    inputs: WallInputs, removal: Removal, number: int, C: Floats, error: Floats, bars: Mapping[int, Any]
) -> Finish:
    """Form error of a side by its last pass."""
    parameters = np.linspace(0.02, 0.98, POINTS[0]), np.linspace(inputs.body.foot, 1.0 - EDGE, POINTS[1] + 1)[1:]
    u, v = np.meshgrid(*parameters, indexing="ij")
    points, normals = inputs.body.shape.sides(u, v)[number], inputs.body.shape.normals(u, v)[number]
    unsure = error_at(inputs.body.places, error, u.ravel(), v.ravel()).reshape(u.shape)
    if not removal.cuts:
        none = np.zeros(u.shape)
        return Finish(number, points, none, none, none > 0.0, unsure, parameters)
    found = form_error(
        removal,
        inputs.cut.material,
        points.reshape(-1, 3),
        normals.reshape(-1, 3),
        work=interpolate_places(inputs.body.places, C, u.ravel(), v.ravel()),
        bars=bars,
        near=0.5 * inputs.body.allowance[number],
    )
    shape = u.shape
    return Finish(
        number,
        points,
        found.error.reshape(shape),
        found.rigid.reshape(shape),
        found.made.reshape(shape),
        unsure,
        parameters,
    )


def _shape(places: Places, stock: LayeredStock, pass_programs: Sequence[PassProgram], program: Program) -> Shape:
    """Path and stock against the finished wall, the tool against its neighbours or the part."""
    inputs = places.inputs
    if isinstance(inputs.body.shape, PartShape) and inputs.body.shape.floors:
        return floor_shape(places, stock, pass_programs)
    length, height, _ = inputs.body.shape.size()
    u, v = np.meshgrid(
        np.linspace(0.0, 1.0, round(length / CLOUD) + 1),
        np.linspace(0.0, 1.0, round(height / CLOUD) + 1),
        indexing="ij",
    )
    cloud = np.concatenate([p.reshape(-1, 3) for p in inputs.body.shape.sides(u, v)])
    cutters = {o.cut.cutter.number: o.cut.cutter for o in inputs.operations}
    gaps = [nearest(_rows_of_tool(program, number), cutter, cloud) for number, cutter in cutters.items()]
    gap = min(gaps, key=lambda one: one.distance)
    left = initial_stock(stock, cutters, upright=True)
    found = shape_deviation(left, *_surface_points(inputs), inputs.foot_height + inputs.below)
    at = found.at if found.gouge > -gap.distance else gap.at
    touched = (
        wall_collisions(inputs, pass_programs)
        if inputs.body.part is None
        else part_collisions(inputs, places.uncut, pass_programs)
    )
    return Shape(found.gouge, found.left, at, found.points, gap.distance, touched)


def _surface_points(inputs: WallInputs) -> tuple[Floats, Floats]:
    """Points (p, 3) [mm] of the sides that are cut, and of the part, none on an edge, and normals out of the metal."""
    shape = inputs.body.shape
    along, up = ((np.arange(n) + 0.5) / n for n in (SHAPE_POINTS, round(shape.size()[1] / CLOUD) + 1))
    u, v = np.meshgrid(along, up, indexing="ij")
    points, normals = shape.sides(u, v), shape.normals(u, v)
    out = [(points[k].reshape(-1, 3), normals[k].reshape(-1, 3)) for k in inputs.body.side_numbers]
    if inputs.body.part is not None:
        out.append(mesh_points(inputs.finished_mesh()))
    return np.vstack([p for p, _ in out]), np.vstack([n for _, n in out])


def _rows_of_tool(program: Program, number: int) -> Program:
    """The rows of a program that have a tool."""
    own = program.tool == number
    return replace(program, **{f.name: getattr(program, f.name)[own] for f in fields(program) if f.name != "labels"})
