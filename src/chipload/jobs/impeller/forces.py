"""Data for the finishing feeds of a job: force coefficients, and the cutters as bars with teeth."""

from __future__ import annotations

import math

from chipload.cutter.catalogue import Catalogue
from chipload.cutter.strength import ToolStrength
from chipload.cutting.material import material_named, need_directions, read_material
from chipload.jobs.impeller.job import ImpellerJob
from chipload.planning.impeller.feeds import ForceTerms, nominal_feeds
from chipload.units import mm_s_from_mm_min, rad_s_from_rpm


def force_terms(job: ImpellerJob, catalogue: Catalogue) -> ForceTerms | None:
    """Data from which feeds are calculated; None: the job has no `forces`.

    Raises
    ------
    InputError
        The material cannot be used, or a cutter of the catalogue has no overhang.
    """
    op = job.operation
    if op.forces is None or job.material is None:
        return None
    stated = op.forces
    material = material_named(job.material) if isinstance(job.material, str) else read_material(job.material)
    need_directions(material, "the feeds of an impeller")
    allowance = stated.allowance_mm
    if allowance is None:
        allowance = 0.0 if op.rough is None else max(op.rough.blades_mm, op.rough.hub_mm)
    terms = ForceTerms(
        material, stated.flutes, math.radians(stated.helix_deg), stated.modulus_gpa * 1000.0, allowance,
        stated.deflection_um / 1000.0, rad_s_from_rpm(op.speed_rpm), stated.overhang_mm,
        ToolStrength(safety_factor=stated.safety_factor),
    )  # fmt: skip
    for size in catalogue.cutters:
        terms.cutter(size)
    return terms


def cutter_feeds(job: ImpellerJob, catalogue: Catalogue, terms: ForceTerms | None) -> float | tuple[float, ...]:
    """Feed of every cutter [mm/s], with which cutters are compared before paths are planned."""
    feed = mm_s_from_mm_min(job.operation.feed_mm_min)
    return feed if terms is None else nominal_feeds(catalogue, terms, job.operation.scallop_mm, feed)
