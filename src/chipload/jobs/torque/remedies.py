"""Remedies if the edge force alone exceeds the allowable force: each change that would make a torque allowable.

Notation: F_e edge force at a step, in proportion to its depth of cut; F_lim = min(d / (C_w + C_t), S / g) as in
:mod:`chipload.control.wall`, for another depth of cut, wall, free length or overhang. A change would do where F_lim
exceeds F_e, at the confidence of the checks, by :data:`MARGIN`, which leaves something for the chip.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from chipload.control.wall import PathLimit, unit_response
from chipload.cutting.material import Material
from chipload.jobs.torque.confidence import force_factors
from chipload.jobs.torque.cut import Cut, contact_width
from chipload.jobs.torque.job import TorqueJob
from chipload.structure.shell import Ritz, Shell, ritz

#: a change would do where the allowable force is so many times the edge force
MARGIN = 1.2
#: halvings of a search
HALVINGS = 8
#: thicker walls are searched up to this share of the radius, free lengths down to this share of the stated one
THICKEST, SHORTEST = 0.2, 0.1


@dataclass(frozen=True)
class HardestPlace:
    """Step whose edge force is too great: ends of its depth of cut along the wall [mm], C_t [mm/N], F_e [N]."""

    near: float
    far: float
    tool: float
    edge: float


def remedies(job: TorqueJob, shell: Shell, planned: Cut, limit: PathLimit, material: Material) -> list[str]:
    """Changes each of which alone would do; ``shell``: the wall for which the limit is calculated."""
    margin = MARGIN * float(force_factors(job, planned, material, 0.0).max())
    places = _hardest_places(planned, limit)
    k = limit.step
    depth, tolerance, modes = float(planned.far[k] - planned.near[k]), job.shell.wall_tolerance_mm, ritz(shell)

    def is_allowed(modes: Ritz, *changed: HardestPlace) -> bool:
        return all(_force_limit_at(job, modes, at) >= margin * at.edge for at in changed)

    def shallower(share: float) -> bool:
        return is_allowed(modes, *(
            replace(at, near=at.far - share * (at.far - at.near), edge=share * at.edge) for at in places
        ))  # fmt: skip

    def thicker(thickness: float) -> bool:
        return is_allowed(ritz(replace(shell, thickness=thickness)), *places)

    def shorter(share: float) -> bool:
        less = shell.length * (1.0 - share)
        moved = [replace(at, near=at.near - less, far=at.far - less) for at in places]
        return all(at.near >= 0.0 for at in moved) and is_allowed(
            ritz(replace(shell, length=shell.length - less)), *moved
        )

    def stiffer(share: float) -> bool:
        return is_allowed(modes, *(replace(at, tool=at.tool * share**3) for at in places))

    least = float(min(shell.radius, shell.radius + shell.length * np.sin(shell.cone_angle)))
    cutter = min(job.cutters.values(), key=lambda c: c.radius)
    changes: tuple[tuple[Callable[[float], bool], float, float, Callable[[float], str]], ...] = (
        (shallower, 0.02, 1.0, lambda x: f"a depth of cut of at most {x * depth:.2g} mm (now {depth:.3g})"),
        (thicker, THICKEST * least - tolerance, shell.thickness,
         lambda x: f"a wall of at least {x + tolerance:.3g} mm (now {shell.thickness + tolerance:.3g})"),
        (shorter, SHORTEST, 1.0,
         lambda x: f"a clamp at most {x * shell.length:.3g} mm from the free end (now {shell.length:.3g})"),
        (stiffer, 0.2, 1.0,
         lambda x: f"an overhang of the cutter of at most {x * cutter.overhang:.3g} mm (now {cutter.overhang:.3g})"),
    )  # fmt: skip
    out = []
    for does, good, bad, text in changes:
        found = _nearest_value(does, good, bad)
        if found is not None:
            out.append(text(found))
    return out


def _hardest_places(planned: Cut, limit: PathLimit) -> list[HardestPlace]:
    """The step of the limit, and those with the greatest edge force, alone and times the compliance of the cutter."""
    edge = planned.loads.force_edge * (planned.far > planned.near)
    rows = {limit.step, int(np.argmax(edge)), int(np.argmax(edge * planned.tool)), int(np.argmax(edge * planned.far))}
    return [
        HardestPlace(*(float(x[k]) for x in (planned.near, planned.far, planned.tool, planned.loads.force_edge)))
        for k in sorted(rows)
    ]


def remedy_text(job: TorqueJob, shell: Shell, planned: Cut, limit: PathLimit, material: Material) -> str:
    """Remedies in a sentence."""
    found = remedies(job, shell, planned, limit, material)
    if not found:
        return (
            "no feed keeps the limits, and no change of depth of cut, wall, clamp or overhang alone does: state a "
            "sharper cutter or wider limits"
        )
    return f"no feed keeps the limits; one of these changes does: {'; '.join(found)}; or a sharper cutter"


def _force_limit_at(job: TorqueJob, modes: Ritz, place: HardestPlace) -> float:
    """F_lim at a place [N]."""
    width = contact_width(job.shell.stock_mm, job.cutters)
    near, far, tool = (np.array([x]) for x in (place.near, place.far, place.tool))
    wall = unit_response(modes, near, far, width, tool)
    limits = job.table.limits
    deflection, stress = 1e-3 * limits.form_error_um, limits.strength_share * job.shell.strength_mpa
    return float(min(deflection / wall.compliance[0], stress / wall.stress[0]))


def _nearest_value(does: Callable[[float], bool], good: float, bad: float) -> float | None:
    """The value nearest to ``bad`` that would do; None: even ``good`` does not."""
    if does(bad):
        return bad
    if not does(good):
        return None
    for _ in range(HALVINGS):
        middle = 0.5 * (good + bad)
        good, bad = (middle, bad) if does(middle) else (good, middle)
    return good
