"""The run of a distortion job: all plans in wide cells, the one in use and the stated one in fine ones."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from chipload.checking.clamped import PER
from chipload.errors import Finding, InputError, Severity
from chipload.geometry.mesh import read_mesh
from chipload.geometry.pocketed_part import level_faces
from chipload.jobs.distortion.job import DistortionJob
from chipload.jobs.distortion.outcome import Banded, DistortionResult, PlanOutcome
from chipload.jobs.distortion.plans import MillingPlan, plans_of
from chipload.jobs.distortion.release import PlateRelease, in_wider_cells, plate_release
from chipload.jobs.distortion.shapes import PartLayers, part_layers
from chipload.jobs.distortion.surface import part_surface
from chipload.lazy import trimesh
from chipload.number_text import number_text, percent_text
from chipload.progress import Progress, silent
from chipload.result import Provenance
from chipload.result.provenance import hashes, title_of, versions
from chipload.structure.cells.thickness import thinnest
from chipload.structure.cells.workpiece import Elastic

Floats = NDArray[np.float64]

#: cells in which plans are compared, over those of the result; the difference is their error
WIDER = 1.5
#: triangles along the longest side of the part
POINTS = 15
#: walls and floors [mm] below which the stress that milling leaves in the surface may bend them
SKIN = 2.0
#: longest side of the part over the thickest wall that is searched for
THIN = 12


def run(job: DistortionJob, progress: Progress = silent) -> DistortionResult:
    """Compute the flatness of the part after each plan.

    Raises
    ------
    InputError
        The part does not lie in the stock, a clamp holds nothing, a setup is missing, or what is left falls apart.
    """
    progress(0.0, "reading")
    mesh = read_part(job)
    side = float(np.ptp(mesh.bounds, axis=0).max())
    surface = part_surface(mesh, job.table.part.spacing_mm or side / POINTS)
    height = float(np.ptp(mesh.bounds[:, 2]))
    plans = plans_of(job, float(mesh.bounds[0, 2]), height)
    releases: dict[float, PlateRelease] = {}
    compared: list[tuple[MillingPlan, Banded, Banded]] = []
    wide: dict[MillingPlan, PlanOutcome] = {}
    last: float | None = None
    for k, plan in enumerate(sorted(plans, key=lambda p: p.offset)):
        progress(0.05 + 0.7 * k / len(plans), "plans")
        if plan.offset != last and last is not None and last != plans[0].offset:
            del releases[last]
        last = plan.offset
        if plan.offset not in releases:
            releases[plan.offset] = in_wider_cells(_release(job, mesh, plans, plan.offset), WIDER)
        try:
            one = releases[plan.offset].outcome(plan, surface, _spread(job))
        except InputError:
            if plan is plans[0]:
                raise
            continue
        wide[plan] = one
        compared.append((plan, one.flatness, one.distortion))
    compared.sort(key=lambda row: (row[1].high, len(row[0].setups), row[0].name))
    progress(0.75, "plan in use")
    best = compared[0][0] if job.table.choices is not None else plans[0]
    fine = _release(job, mesh, plans, best.offset)
    used = fine.outcome(best, surface, _spread(job))
    stated = used if best == plans[0] else wide[plans[0]]
    error = _relative(wide[best].flatness.value, used.flatness.value)
    layers = _layers(job, mesh, plans, plans[0].offset)
    part = layers.stock(list(layers.shapes))
    wall = thinnest(part, side / 1000.0, side / THIN)
    progress(1.0, "released")
    findings = tuple(_findings(job, used, wall, side / THIN, skipped=len(plans) - len(compared)))
    return DistortionResult(
        job, title_of(job.path), mesh, surface, stated, used, tuple(compared), error, fine.grid.widest, wall, findings,
        _provenance(job),
    )  # fmt: skip


def read_part(job: DistortionJob) -> trimesh.Trimesh:
    """The finished part as a closed mesh [mm]."""
    part = job.table.part
    return read_mesh(job.part_file, unit=part.units, chord_mm=part.chord_mm, key="part.file")


def _spread(job: DistortionJob) -> float:
    return 0.01 * job.table.residual_stress.spread_percent


def _corners(job: DistortionJob, mesh: trimesh.Trimesh, offset: float) -> tuple[Floats, Floats]:
    """Corners of the blank in which the part lies at an offset."""
    low, high = (np.array(v, dtype=np.float64) for v in (job.table.stock.low_mm, job.table.stock.high_mm))
    shift = float(mesh.bounds[0, 2]) - offset - low[2]
    low[2] += shift
    high[2] += shift
    return low, high


def _stocks(plans: Sequence[MillingPlan]) -> list[float]:
    return sorted({s.cut.stock for plan in plans for s in plan.setups})


def _layers(job: DistortionJob, mesh: trimesh.Trimesh, plans: Sequence[MillingPlan], offset: float) -> PartLayers:
    return part_layers(mesh, *_corners(job, mesh, offset), _stocks(plans))


def _release(job: DistortionJob, mesh: trimesh.Trimesh, plans: Sequence[MillingPlan], offset: float) -> PlateRelease:
    made = job.table.workpiece
    elastic = Elastic(PER * made.modulus_gpa, made.poisson)
    corners = _corners(job, mesh, offset)
    return plate_release(mesh, *corners, _stocks(plans), (job.profile, job.odd), elastic, made.cell_mm)


def _relative(one: float, other: float) -> float:
    return abs(one - other) / other if other > 0.0 else 0.0


def _findings(job: DistortionJob, used: PlanOutcome, wall: float, most: float, skipped: int) -> list[Finding]:
    """What is to be said of the stress, of the plans, and of what the model leaves out."""
    out = []
    if job.unbalance > 0.0:
        text = (
            f"the stated stress has a resultant of {percent_text(job.unbalance)} of itself: it is balanced by a "
            "constant and a linear term"
        )
        out.append(Finding("stress-balanced", 0, text))
    if skipped:
        text = f"{skipped} plan{'s leave' if skipped > 1 else ' leaves'} a part of the surface unmilled: not compared"
        out.append(Finding("plans-left-out", 0, text))
    if wall < min(SKIN, most):
        text = (
            f"walls or floors of {number_text(wall, 3)} mm: the stress that milling leaves in their surfaces is not in "
            f"the model; below {SKIN:g} mm mill both sides with the same cutter and feed"
        )
        out.append(Finding("milled-skin", 0, text, Severity.NOTE))
    for k, force in enumerate(used.clamp_force.tolist(), start=1):
        if used.plan.setups[k - 1].flat:
            out.append(
                Finding("pressed-flat", 0, f"setup {k}: the clamps press the part flat with {number_text(force, 3)} N")
            )
    return out


def _provenance(job: DistortionJob) -> Provenance:
    files = {"part": job.part_file}
    stress = job.table.residual_stress
    if stress.file is not None:
        files["residual stress"] = job.path.parent / stress.file
    return Provenance(hashes(files), job.overrides, "", {"residual stress": stress.source}, versions())


def check(job: DistortionJob) -> tuple[list[str], bool]:
    """Return lines on the part, the plate and the plans of a job, without solving."""
    mesh = read_part(job)
    plans = plans_of(job, float(mesh.bounds[0, 2]), float(np.ptp(mesh.bounds[:, 2])))
    _layers(job, mesh, plans, plans[0].offset)
    lines = [f"{job.path.name}: valid: {len(plans)} plan{'s' if len(plans) > 1 else ''} of {job.part_file.name}"]
    size = " x ".join(number_text(v) for v in np.ptp(mesh.bounds, axis=0).tolist())
    lines.append(f"part {size} mm, level faces at {', '.join(number_text(z) for z in level_faces(mesh)[:12])} mm")
    lines.append(
        f"plate {number_text(job.profile.thickness)} mm, stress up to {number_text(job.profile.greatest, 3)} MPa"
        + (f", balanced: {percent_text(job.unbalance)} of it was a resultant" if job.unbalance else "")
    )
    lines.append(f"stated: {plans[0].name}")
    if job.unchecked:
        lines.append(f"not checked, no limit stated: {', '.join(job.unchecked)}")
    return lines, True
