"""Run of an impeller job: search for the largest cutters of its surfaces, planning and check of its programs."""

from __future__ import annotations

import itertools
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from chipload.checking.workpiece import Stock, Surroundings
from chipload.cutter.catalogue import Catalogue, CatalogueCutter, catalogue_named, read_catalogue
from chipload.errors import InputError
from chipload.jobs.impeller.blade_deflection import elastic_blades, with_blade_deflection
from chipload.jobs.impeller.channel_depth import reach_line
from chipload.jobs.impeller.checkpoint import KeptParts
from chipload.jobs.impeller.estimate import estimate
from chipload.jobs.impeller.five_axis import five_axis_machine
from chipload.jobs.impeller.flank import checked_flanks
from chipload.jobs.impeller.forces import cutter_feeds, force_terms
from chipload.jobs.impeller.job import ImpellerJob
from chipload.jobs.impeller.outcome import ImpellerResult, OneCutter, Searched, StatedJob, unreached_text
from chipload.jobs.impeller.part import ImpellerPart, read_part
from chipload.jobs.impeller.partition_programs import checked_partitions
from chipload.jobs.impeller.paths import EDGE, finish_settings, walls_of
from chipload.jobs.impeller.point_milling import checked_points
from chipload.jobs.impeller.ray_depth import ray_depth
from chipload.jobs.impeller.roughing import checked_roughing, roughing_settings
from chipload.jobs.impeller.simulated_programs import blank_of_roughing, with_removal
from chipload.jobs.impeller.surface_search import WORKERS, SearchInputs, SurfaceSearch, searched_surfaces
from chipload.jobs.impeller.tables import ImpellerOperationTable
from chipload.jobs.impeller.written_programs import with_texts_read_back
from chipload.jobs.simulation.fixtures import fixtures_of
from chipload.jobs.simulation.values import machine_table_of, stock_of
from chipload.jobs.tables import Table
from chipload.machine.machine import Machine, machine_named, read_machine
from chipload.planning.impeller.answer import Answer, one_cutter_of
from chipload.planning.impeller.compare import CutterChoice, cutter_choices
from chipload.planning.impeller.costs import ChannelSide, Terms
from chipload.planning.impeller.covering.covering import Covering, covering_of, first_edge
from chipload.planning.impeller.impeller import Impeller
from chipload.planning.impeller.kept import Keep
from chipload.planning.impeller.surfaces import BODIES, ContactSampling, ContactSurface, hub_range, surface_of
from chipload.planning.impeller.tables import IndexTable, index_table
from chipload.progress import Progress, part_of, silent
from chipload.result import Provenance
from chipload.result.provenance import provenance_of, sources, title_of, versions
from chipload.simulation.checkpoint import Checkpoint, digest
from chipload.workers import Team, Workers

#: shares of the time of a run: search, division, roughing, finishing and removal, with paths and without
_WITH_PATHS, _SEARCH_ALONE = (4.0, 8.0, 8.0, 55.0, 25.0), (50.0, 50.0, 0.0, 0.0, 0.0)
#: of the tolerance, by how much tapered cutters may stand out of the cylinders that are planned with
_OUTSIDE = 0.5


def run(
    job: ImpellerJob, progress: Progress = silent, checkpoint: Checkpoint | None = None, workers: Workers | None = None
) -> ImpellerResult:
    """Search the largest cutters of every surface that the job names; plan and check the programs.

    Parameters
    ----------
    workers : processes or a cluster that search the surfaces, plan paths, links and rest passes and check programs,
        each as a task; None: this process does all

    Raises
    ------
    InputError
        A file cannot be used, or no cutter of the catalogue reaches any point of a surface.
    Cancelled
        By ``progress``.
    """
    if workers is None or workers.alone:
        return _run(job, progress, checkpoint, None)
    with workers.team() as team:
        return _run(job, progress, checkpoint, team)


def _run(job: ImpellerJob, progress: Progress, checkpoint: Checkpoint | None, team: Team | None) -> ImpellerResult:
    machine, cutters, part = _machine(job), _catalogue(job), read_part(job)
    impeller, catalogue = part.impeller, _indexed_cutters(job, cutters)
    _picked_cutter(job, catalogue)
    _rougher(job, cutters)
    _checkable(job, impeller)
    forces = force_terms(job, catalogue)
    _five_axis_machines(job)
    surroundings, stated_stock = surroundings_of(job), _stated_stock(job)
    surroundings.fixture_points(machine)
    op = job.operation
    provenance = _provenance(job, machine, catalogue, part)
    keep = KeptParts(checkpoint, digest(job.table.model_dump_json(), provenance.inputs, versions(), sources()), team)
    table, begin = _tables(machine, op), time.perf_counter()
    covering = _cover_walls(job, impeller, catalogue)
    took = time.perf_counter() - begin
    surfaces = _surfaces(job, impeller, covering)
    if checkpoint is not None:
        checkpoint.notice(_estimate(job, surfaces, catalogue))
    first, second, third, last, simulating = _stages(op, progress)
    inputs = SearchInputs(surfaces, table, catalogue, op.clearance_mm)
    keep.share(inputs)
    found = searched_surfaces(inputs, keep, team is not None, first)
    done = [_search_surface(job, k, inputs, one, took / len(surfaces)) for k, one in enumerate(found)]
    for k, surface in enumerate(done):
        _refuse_unreached(k, surface)
    pairs = [(surface.surface.scene, surface.answer) for surface in done]
    whole = keep(("one cutter",), lambda: one_cutter_of(pairs, op.clearance_mm, table.spans, WORKERS))
    one = None if whole is None else (catalogue.cutters[whole[0]], whole[1])
    feeds = cutter_feeds(job, catalogue, forces)
    choices = _choices(job, done, catalogue, impeller, feeds, part_of(second, 0.0, 0.5), keep)
    partitions = tuple(choice.partition(WORKERS, part_of(second, 0.5, 1.0), keep) for choice in choices)
    stated = StatedJob(
        title_of(job.path), _settings(op), job.table.impeller.outer_diameter_mm, _ahead(job),
        tuple(surroundings.fixture_meshes(machine)),
    )  # fmt: skip
    milled = ImpellerResult(
        stated, impeller, catalogue, machine, tuple(done), one, partitions, None, None, provenance,
    )  # fmt: skip
    if op.paths is None or milled.used is None:
        return milled
    roughs = None
    if op.rough is not None:
        roughs = checked_roughing(
            impeller, machine, table, cutters.of(cutters.straight), _rougher(job, cutters), op, op.paths, op.rough,
            walls_of(impeller, _ahead(job)), _ahead(job), WORKERS, third, keep,
        )  # fmt: skip
    how = finish_settings(
        impeller, machine, table, catalogue, op, op.paths, _ahead(job), len(roughs or ()), WORKERS, covering, forces
    )
    keep.share(replace(how, workers=1))
    checked = checked_partitions(choices, partitions, how, machine, op.paths, last, keep)
    chosen = {one.name: one.partition for one in checked}
    flanks = checked_flanks(job, how, cutters.of(cutters.straight), keep=keep) if op.flank is not None else None
    points = checked_points(job, how, cutters, keep=keep) if op.point_milling is not None else None
    keep.write(at_once=True)
    milled = replace(milled, flanks=flanks, points=points)
    partitions = tuple(chosen.get(p.name, p) for p in partitions)
    milled = replace(milled, checked=checked, roughs=roughs, partitions=partitions)
    read = with_texts_read_back(milled, surroundings, op.clearance_mm)
    stock = stated_stock
    if op.rough is not None and roughs:
        stock = blank_of_roughing(milled, roughing_settings(machine, op, op.paths, op.rough))
    if stock is None:
        return read
    simulated = with_removal(read, stock, forces, simulating, contacts=op.blades is not None)
    return simulated if op.blades is None else with_blade_deflection(simulated, elastic_blades(impeller, op.blades))


def _stated_stock(job: ImpellerJob) -> Stock | None:
    """Stock before finishing, where the job states it; its file is read."""
    table = job.table.stock
    return None if table is None else stock_of(table, job.path.parent)


def surroundings_of(job: ImpellerJob) -> Surroundings:
    """Fixtures, and the table or pallet, that the job states; their files are read."""
    table = job.table
    bodies = [one for k, f in enumerate(table.fixture) for one in fixtures_of(f, k, job.path.parent, None)]
    return Surroundings(fixtures=tuple(bodies), machine_table=machine_table_of(table.machine_table))


def _five_axis_machines(job: ImpellerJob) -> None:
    """Refuse machines that have not two rotary axes which move in the cut."""
    for key, source in (("flank", job.flank_machine), ("point_milling", job.point_machine)):
        if source is not None:
            five_axis_machine(source, f"operation.0.{key}")


def _checkable(job: ImpellerJob, impeller: Impeller) -> None:
    """Refuse programs for blades that are too thin to be checked, before anything is searched."""
    paths = job.operation.paths
    if paths is not None:
        ray_depth(impeller, EDGE, paths.gouge_mm)


def _provenance(job: ImpellerJob, machine: Machine, catalogue: Catalogue, part: ImpellerPart) -> Provenance:
    files = dict(job.files)
    files |= {key: p for key, p in _shipped_names(job) if not isinstance(p, str)}
    files |= {f"fixture {k}": job.path.parent / f.file for k, f in enumerate(job.table.fixture) if f.file is not None}
    if job.table.stock is not None and job.table.stock.file is not None:
        files["stock"] = job.path.parent / job.table.stock.file
    own = provenance_of(files, job.overrides, machine)
    cutters = f"{catalogue.name}: {catalogue.note}" if catalogue.note else catalogue.name
    faces = {f"face {k}": line for k, line in enumerate(part.faces)}
    return replace(own, inputs={**own.inputs, "catalogue name": cutters, **faces})


def _shipped_names(job: ImpellerJob) -> list[tuple[str, str | Path]]:
    """Shipped names or files by what they are."""
    named: list[tuple[str, str | Path]] = [("machine", job.machine), ("catalogue", job.catalogue)]
    more = (
        ("material", job.material),
        ("flank machine", job.flank_machine),
        ("point-milling machine", job.point_machine),
    )
    return [*named, *((key, path) for key, path in more if path is not None)]


def check(job: ImpellerJob) -> tuple[list[str], bool]:
    """Contents of the files of a job; nothing is searched."""
    machine, cutters, part = _machine(job), _catalogue(job), read_part(job)
    impeller, catalogue = part.impeller, _indexed_cutters(job, cutters)
    _picked_cutter(job, catalogue)
    _rougher(job, cutters)
    _checkable(job, impeller)
    force_terms(job, catalogue)
    _five_axis_machines(job)
    around = surroundings_of(job).fixture_points(machine)
    _stated_stock(job)
    lines = [f"impeller: {impeller.blades} blades{' and as many splitters' if impeller.splitter else ''}", *part.faces]
    table = _tables(machine, job.operation)
    angles = np.degrees(table.angle)
    lines.append(
        f"machine {machine.name}: {len(angles)} table angles from {angles.min():.6g} to {angles.max():.6g} deg"
    )
    surfaces = _surfaces(job, impeller)
    for k, surface in enumerate(surfaces):
        s = surface.scene
        lines.append(f"surface {k}: {surface.name}: {len(s.contact)} contact points, {len(s.check)} check points")
    corner = _least_corner(job, impeller, catalogue)
    if corner is not None:
        within = job.operation.tolerance_mm
        lines.append(f"between check points: certified within {within:g} mm for corner radii from {corner:g} mm")
    corners = ", ".join(f"{r:g}" for r in catalogue.families)
    lines.append(f"catalogue {catalogue.name}: {len(catalogue.cutters)} cutters, corner radii {corners} mm")
    lines += [f"{name}: {len(points)} points" for name, points in around.items()]
    more = [c.label for c in cutters.cutters if c not in catalogue.cutters]
    if more:
        lines.append(f"for point milling on five axes alone: {', '.join(more)}")
    line, reached = reach_line(impeller, catalogue, np.concatenate([s.scene.contact for s in surfaces]))
    return [*lines, line, _estimate(job, surfaces, catalogue)], reached


def _estimate(job: ImpellerJob, surfaces: Sequence[ContactSurface], catalogue: Catalogue) -> str:
    """Estimate of the run."""
    op = job.operation
    areas = [float(s.area.sum()) for s in surfaces] if op.paths is not None else []
    choices = op.most_cutters + (op.hand_picked is not None)
    return estimate(sum(len(s.scene.contact) for s in surfaces), areas, op.scallop_mm, min(catalogue.families), choices)


def _stages(op: ImpellerOperationTable, progress: Progress) -> list[Progress]:
    """Progress of search, division, roughing, finishing and removal, by the share of the time that each takes."""
    shares = _WITH_PATHS if op.paths is not None else _SEARCH_ALONE
    edges = np.concatenate([[0.0], np.cumsum(shares)]) / sum(shares)
    return [part_of(progress, float(a), float(b)) for a, b in itertools.pairwise(edges)]


def _search_surface(
    job: ImpellerJob, k: int, inputs: SearchInputs, found: SurfaceSearch, covering_s: float
) -> Searched:
    """Surface k with its largest cutters; ``covering_s`` its share of the time of the covering [s]."""
    surface, best = inputs.surfaces[k], None
    if found.one is not None:
        reached = np.flatnonzero(found.answer.cutter >= 0)
        best = OneCutter(inputs.catalogue.cutters[found.one[0]], found.one[1], reached, found.one[2])
    settings = _settings(job.operation) | _settings(job.table.surface[k])
    return Searched(settings, surface, found.answer, inputs.table, best, inputs.clearance, found.search_s + covering_s)


def _choices(
    job: ImpellerJob, done: Sequence[Searched], catalogue: Catalogue, impeller: Impeller,
    feeds: float | tuple[float, ...], progress: Progress, keep: Keep,
) -> tuple[CutterChoice, ...]:  # fmt: skip
    """The cutter picked by hand where one is stated, then one cutter, two, ..."""
    op = job.operation
    terms = Terms(feeds, op.scallop_mm, op.cutter_change_s, op.table_change_s, impeller.blades)
    picked = _picked_cutter(job, catalogue)
    index = None if picked is None else catalogue.cutters.index(picked)
    sides = [_side(x, x.answer) for x in done]
    return cutter_choices(sides, terms, index, range(1, op.most_cutters + 1), WORKERS, progress, keep)


def _side(op: Searched, answer: Answer) -> ChannelSide:
    s = op.surface
    body = BODIES.index(s.body)
    return ChannelSide(body, s.side, s.scene, s.u, s.v, s.area, answer, op.clearance, op.table.spans)


def _indexed_cutters(job: ImpellerJob, cutters: Catalogue) -> Catalogue:
    """The cutters that the index table is planned with: no barrels, and with feeds by the force no tapered ones.

    Raises
    ------
    InputError
        There are none; others without point milling, which alone is planned with them; roughing or flank passes without
        a straight cutter.
    """
    op = job.operation
    able = tuple(c for c in cutters.cutters if c.barrel_radius is None and (c.straight or op.forces is None))
    other = next((c for c in cutters.cutters if c not in able), None)
    if other is not None and op.point_milling is None:
        by = "with operation.0.forces " if other.barrel_radius is None else ""
        raise InputError(
            f"catalogue {cutters.name}: {other.label}: {by}such a cutter mills by points on five axes alone: state "
            "operation.0.point_milling, or leave it out"
        )
    if not able:
        raise InputError(
            f"catalogue {cutters.name}: {cutters.cutters[0].label}: no other cutter for the index table, which is not "
            "planned with such cutters: add a flat, bull-nose or ball cutter"
        )
    for key, stated in (("rough", op.rough), ("flank", op.flank)):
        if stated is not None and not cutters.straight:
            raise InputError(
                f"operation.0.{key}: catalogue {cutters.name} has tapered cutters alone, which are not planned with "
                "here: add a straight one"
            )
    return cutters.of(able)


def _picked_cutter(job: ImpellerJob, catalogue: Catalogue) -> CatalogueCutter | None:
    """The cutter of the catalogue that is picked by hand."""
    picked = job.operation.hand_picked
    if picked is None:
        return None
    return _of_catalogue(catalogue, picked.diameter_mm, picked.corner_radius_mm, "hand_picked")


def _rougher(job: ImpellerJob, catalogue: Catalogue) -> CatalogueCutter | None:
    """The cutter of the catalogue that roughs; None: the largest that fits."""
    rough = job.operation.rough
    if rough is None or rough.diameter_mm is None or rough.corner_radius_mm is None:
        return None
    return _of_catalogue(catalogue, rough.diameter_mm, rough.corner_radius_mm, "rough")


def _of_catalogue(catalogue: Catalogue, d: float, r: float, key: str) -> CatalogueCutter:
    for cutter in catalogue.straight:
        if (cutter.diameter, cutter.corner_radius) == (d, r):
            return cutter
    near = min(catalogue.straight or catalogue.cutters, key=lambda c: abs(c.diameter - d) + abs(c.corner_radius - r))
    raise InputError(
        f"operation.0.{key}: D {d:g} r {r:g} mm is not in catalogue {catalogue.name}: the nearest is {near.label} mm"
    )


def _settings(table: Table) -> dict[str, Any]:
    """The keys that are stated."""
    return {k: v for k, v in table.model_dump().items() if v is not None}


def _refuse_unreached(k: int, op: Searched) -> None:
    """Refuse a catalogue that reaches nothing of a surface."""
    if (op.answer.cutter < 0).all():
        first = unreached_text(op, op.answer.unreachable[0])
        raise InputError(f"surface.{k}: no cutter of catalogue {op.answer.catalogue.name} fits anywhere: {first}")


def _tables(machine: Machine, op: ImpellerOperationTable) -> IndexTable:
    table = index_table(machine)
    if op.table_deg is None:
        return table
    try:
        return table.at(np.radians(op.table_deg))
    except InputError as err:
        raise InputError(f"operation.0.table_deg: {err}") from None


def _cover_walls(job: ImpellerJob, impeller: Impeller, catalogue: Catalogue) -> Covering | None:
    """The walls covered for every cutter with a corner radius; None: there is no such cutter."""
    op, corner = job.operation, _least_corner(job, impeller, catalogue)
    if corner is None:
        return None
    slack = max(c.not_enclosed for c in catalogue.cutters)
    return covering_of(impeller, op.tolerance_mm, corner, op.around, hub_range(impeller, _ahead(job)), slack)


def _least_corner(job: ImpellerJob, impeller: Impeller, catalogue: Catalogue) -> float | None:
    """The least corner radius above 0, for which the walls can be covered; None: there is none."""
    op, corner = job.operation, min((r for r in catalogue.families if r > 0.0), default=None)
    if corner is not None:
        widest = max(catalogue.cutters, key=lambda c: c.not_enclosed)
        slack = widest.not_enclosed
        if slack > _OUTSIDE * op.tolerance_mm:
            raise InputError(
                f"operation.0.tolerance_mm = {op.tolerance_mm:g}: {widest.label} stands out of the cylinders that the "
                f"index table is planned with by {slack:.3g} mm: must be at least {slack / _OUTSIDE:.3g}"
            )
        try:
            first_edge(impeller, op.tolerance_mm - slack, corner - slack, op.around)
        except InputError as err:
            raise InputError(f"operation.0.tolerance_mm = {op.tolerance_mm:g}: {err}") from None
    return corner


def _surfaces(job: ImpellerJob, impeller: Impeller, covering: Covering | None = None) -> list[ContactSurface]:
    op, ahead = job.operation, _ahead(job)
    out = []
    for k, s in enumerate(job.table.surface):
        how = ContactSampling(s.along, s.up, s.points, op.check_mm, op.near_mm, op.around, ahead)
        try:
            out.append(surface_of(impeller, s.body, s.side, how, covering))
        except InputError as err:
            raise InputError(f"surface.{k}: {err}") from None
    return out


def _ahead(job: ImpellerJob) -> float:
    """Length of the hub ahead of the leading edge [mm]."""
    given = job.table.impeller.sections or job.table.impeller.step
    return given.hub_ahead_mm if given is not None else 0.0


def _machine(job: ImpellerJob) -> Machine:
    return machine_named(job.machine) if isinstance(job.machine, str) else read_machine(job.machine)


def _catalogue(job: ImpellerJob) -> Catalogue:
    return catalogue_named(job.catalogue) if isinstance(job.catalogue, str) else read_catalogue(job.catalogue)
