"""A job that mills an impeller: read, its surfaces searched for the largest cutters."""

from __future__ import annotations

import math
import os
import time

import numpy as np

from chipload.cutter.catalogue import Catalogue, catalogue_named, read_catalogue
from chipload.errors import InputError
from chipload.geometry.revolve import Revolved
from chipload.geometry.sections import Blade, checked, loft, read_meridian, read_sections
from chipload.job import ImpellerJob, SectionalTable
from chipload.job.impeller import SectionsTable, ShapeTable
from chipload.machine.machine import Machine, machine_named, read_machine
from chipload.planning.sectional.answer import largest_cutters, one_cutter
from chipload.planning.sectional.impeller import Impeller
from chipload.planning.sectional.parametric import Shape, impeller_of
from chipload.planning.sectional.surfaces import Sampled, Surface, surface_of
from chipload.planning.sectional.tables import IndexTable, index_table
from chipload.progress import Progress, silent
from chipload.report.impeller.outcome import Milled, OneCutter, Sectional, said
from chipload.run.provenance import hashes, title_of, versions

#: contact points of which the cutter that would fit is looked for
LISTED = 3


def run_impeller(job: ImpellerJob, progress: Progress = silent) -> Milled:
    """The largest cutters of every surface that the job names.

    Raises
    ------
    InputError
        A file cannot be used, or no cutter of the catalogue reaches any point of a surface.
    Cancelled
        By ``progress``.
    """
    machine, catalogue, impeller = _machine(job), _catalogue(job), _impeller(job)
    surfaces = [_surface(impeller, k, op, job) for k, op in enumerate(job.operations)]
    tables = [_tables(machine, k, op) for k, op in enumerate(job.operations)]
    done = []
    n = len(job.operations)
    for k, (op, surface, table) in enumerate(zip(job.operations, surfaces, tables, strict=True)):
        done.append(_searched(op, surface, table, catalogue, part_of(progress, k, n)))
        _reached(k, done[-1])
    files = {"job": job.path, **job.files}
    files |= {key: p for key, p in (("machine", job.machine), ("catalogue", job.catalogue)) if not isinstance(p, str)}
    provenance = {
        "inputs": hashes(files),
        "overrides": list(job.overrides),
        "machine": f"{machine.name}: {machine.note}" if machine.note else machine.name,
        "catalogue": f"{catalogue.name}: {catalogue.note}" if catalogue.note else catalogue.name,
        "versions": versions(),
    }
    return Milled(
        title_of(job.path), impeller, catalogue, machine, tuple(done), job.table.impeller.outer_diameter_mm, provenance
    )


def look_at_impeller(job: ImpellerJob) -> tuple[list[str], bool]:
    """What the files of a job hold; nothing is searched."""
    machine, catalogue, impeller = _machine(job), _catalogue(job), _impeller(job)
    lines = [f"impeller: {impeller.blades} blades{' and as many splitters' if impeller.splitter else ''}"]
    for k, op in enumerate(job.operations):
        surface, table = _surface(impeller, k, op, job), _tables(machine, k, op)
        s = surface.scene
        angles = np.degrees(table.angle)
        lines.append(
            f"operation {k}: {surface.name}: {len(s.contact)} contact points, {len(s.check)} check points, "
            f"{len(angles)} table angles from {angles.min():g} to {angles.max():g} deg"
        )
    corners = ", ".join(f"{r:g}" for r in catalogue.families)
    lines.append(f"catalogue {catalogue.name}: {len(catalogue.cutters)} cutters, corner radii {corners} mm")
    return lines, True


def part_of(progress: Progress, k: int, n: int) -> Progress:
    """Progress of the k-th of n like parts."""
    return lambda done, what: progress((k + done) / n, what)


def _searched(
    op: SectionalTable, surface: Surface, table: IndexTable, catalogue: Catalogue, progress: Progress
) -> Sectional:
    """The largest cutters of a surface."""
    workers = len(os.sched_getaffinity(0))
    begin = time.perf_counter()
    answer = largest_cutters(
        surface.scene, catalogue, table.angle, op.clearance_mm, pallets=table.spans, workers=workers, progress=progress
    )
    one = one_cutter(surface.scene, answer, op.clearance_mm, table.spans, workers)
    took = time.perf_counter() - begin
    best = None
    if one is not None:
        reached = np.flatnonzero(answer.cutter >= 0)
        best = OneCutter(catalogue.cutters[one[0]], one[1], reached, one[2])
    settings = {k: v for k, v in op.model_dump().items() if v is not None}
    return Sectional(settings, surface, answer, table, best, op.clearance_mm, took)


def _reached(k: int, op: Sectional) -> None:
    """Refuse a catalogue that reaches nothing of a surface."""
    if (op.answer.cutter < 0).all():
        first = said(op, op.answer.unreachable[0])
        raise InputError(f"operation.{k}: no cutter of catalogue {op.answer.catalogue.name} fits anywhere: {first}")


def _tables(machine: Machine, k: int, op: SectionalTable) -> IndexTable:
    table = index_table(machine)
    if op.table_deg is None:
        return table
    try:
        return table.at(np.radians(op.table_deg))
    except InputError as err:
        raise InputError(f"operation.{k}.table_deg: {err}") from None


def _surface(impeller: Impeller, k: int, op: SectionalTable, job: ImpellerJob) -> Surface:
    given = job.table.impeller.sections
    ahead = given.hub_ahead_mm if given is not None else 0.0
    how = Sampled(op.along, op.up, op.points, op.check_mm, op.near_mm, op.around, ahead)
    try:
        return surface_of(impeller, op.body, op.side, how)
    except InputError as err:
        raise InputError(f"operation.{k}: {err}") from None


def _machine(job: ImpellerJob) -> Machine:
    return machine_named(job.machine) if isinstance(job.machine, str) else read_machine(job.machine)


def _catalogue(job: ImpellerJob) -> Catalogue:
    return catalogue_named(job.catalogue) if isinstance(job.catalogue, str) else read_catalogue(job.catalogue)


def _impeller(job: ImpellerJob) -> Impeller:
    part = job.table.impeller
    if part.sections is not None:
        return _of_sections(job, part.sections, part.blades, part.outer_diameter_mm)
    assert part.shape is not None
    return _of_shape(part.shape, part.blades, part.outer_diameter_mm)


def _of_shape(given: ShapeTable, blades: int, outer_diameter: float) -> Impeller:
    shape = Shape(
        blades, given.channel_mm, given.hub_radius_mm, 0.5 * outer_diameter, given.height_mm, given.blade_height_mm,
        math.radians(given.wrap_deg), math.radians(given.lean_deg), given.outlet_height_mm,
    )  # fmt: skip
    return impeller_of(shape)


def _of_sections(job: ImpellerJob, given: SectionsTable, blades: int, outer_diameter: float) -> Impeller:
    folder, over = job.path.parent, given.flow_along_x

    def blade(names: tuple[str, ...], key: str) -> Blade:
        try:
            found = read_sections([folder / name for name in names], given.unit, over, given.columns)
            return loft(checked(found, outer_diameter))
        except InputError as err:
            raise InputError(f"impeller.sections.{key}: {err}") from None

    hub, shroud = (
        Revolved(read_meridian(folder / name, given.unit, over), side)
        for name, side in ((given.hub, 1), (given.shroud, -1))
    )
    splitter = blade(given.splitter, "splitter") if given.splitter else None
    return Impeller(blade(given.blade, "blade"), splitter, hub, shroud, blades)
