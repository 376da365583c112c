"""Deflection of the blades in the programs of an impeller, step by step, from the forces of the simulation.

Notation: g of a point of a blade as in :mod:`chipload.jobs.impeller.elastic_blade`; F force on the blade, which within
a revolution stays between the least and greatest value of each component.

In a step the cutter presses along its contact line, where it leaves the finished surface. The deflection there is
bounded by the greatest g . F of the points that are near the line, over all forces between the stated values: how the
force spreads over the contact does not matter, as a blade gives less under a spread force than under the whole force at
the softest of its points. The mean force at the nearest point is what the deflection is at least; only that can exceed
a limit.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from chipload.cutter.catalogue import CatalogueCutter
from chipload.jobs.impeller.elastic_blade import ElasticBlade, elastic_blade
from chipload.jobs.impeller.five_axis_outcome import FiveAxisProgram
from chipload.jobs.impeller.outcome import ImpellerResult
from chipload.jobs.impeller.program_removal import ProgramRemoval
from chipload.jobs.impeller.simulated_programs import replace_removals
from chipload.jobs.impeller.tables import BladesTable
from chipload.number_text import number_text
from chipload.planning.impeller.impeller import Impeller
from chipload.result import Verdict, check_limit
from chipload.result.limits import Columns

Floats = NDArray[np.float64]

#: name of the column and of its limit
DEFLECTION = "deflection_workpiece_um"
#: bodies on either side of the first blade that a program of one channel may come near
NEIGHBOURS = 2
#: rows that are compared with all points at a time
ROWS = 64


@dataclass(frozen=True, eq=False)
class ElasticBlades:
    """Blades that a program may press on, and their stated limit.

    Parameters
    ----------
    bodies : blades and splitters, each where it stands
    limit : greatest deflection [mm]
    """

    bodies: tuple[ElasticBlade, ...]
    limit: float

    @property
    def error(self) -> float:
        """Relative error of the compliance."""
        return max(one.error for one in self.bodies)


def elastic_blades(impeller: Impeller, stated: BladesTable) -> ElasticBlades:
    """Return the blades of an impeller near its first channel."""
    kinds = len(impeller.bodies)
    own = [
        elastic_blade(
            impeller.body(k), impeller.fillet(k) if impeller.fillets else None, 1000.0 * stated.modulus_gpa,
            stated.poisson,
        )
        for k in range(kinds)
    ]  # fmt: skip
    around = range(-NEIGHBOURS * kinds, NEIGHBOURS * kinds + 1)
    bodies = tuple(own[k % kinds].turned(impeller.pitch * (k // kinds)) for k in around)
    return ElasticBlades(bodies, stated.deflection_um / 1000.0)


def with_blade_deflection(outcome: ImpellerResult, blades: ElasticBlades) -> ImpellerResult:
    """Return a result whose finishing programs in use, and those on five axes, have the deflection of the blades."""
    found = {id(r): r.removal for r in outcome.roughs or () if r.removal is not None}
    for p in outcome.programs or ():
        if p.removal is not None:
            found[id(p)] = _add_deflection(p.removal, p.name, p.setting.cutter, blades)
    for each in (*(outcome.flanks or ()), *(outcome.points or ())):
        if isinstance(each, FiveAxisProgram) and each.removal is not None:
            found[id(each)] = _add_deflection(each.removal, each.name, each.cutter, blades)
    return replace_removals(outcome, found)


def _add_deflection(
    removal: ProgramRemoval, name: str, cutter: CatalogueCutter, blades: ElasticBlades
) -> ProgramRemoval:
    """What a program removes, with the deflection of the blades and its limit."""
    if removal.contact is None or not removal.loads or not removal.columns:
        return removal
    most, least = blade_deflections(removal.columns, removal.contact, 0.5 * cutter.top_diameter, blades)
    columns = {**removal.columns, DEFLECTION: 1000.0 * most}
    track = next((check.track for check in removal.limits), name)
    force = max((c.error for c in removal.limits if c.name == "deflection_cutter_um"), default=math.inf)
    check = check_limit(DEFLECTION, 1000.0 * blades.limit, columns, track=track, error=blades.error + force)
    reached = 1000.0 * float(least.max(initial=0.0))
    if check.state is Verdict.EXCEEDS and reached * (1.0 - check.error) <= check.limit:
        why = f"a bound; under the mean force at the nearest point of a blade it is {number_text(reached)} µm"
        check = replace(check, state=Verdict.UNPROVEN, reason=why)
    return replace(removal, columns=columns, limits=(*removal.limits, check))


def blade_deflections(columns: Columns, contact: Floats, radius: float, blades: ElasticBlades) -> tuple[Floats, Floats]:
    """Return the bound of the deflection of the blades in each row, and what it is at least, (n,) [mm] each.

    Parameters
    ----------
    columns : of a history with forces, in the frame of the part
    contact : (n, 2, 3) [mm], ends of the contact line of each row; nan where nothing is cut
    radius : of the cutter [mm]: a line that is farther from every blade presses on none
    """
    low, high, mean = (
        -np.column_stack([columns[f"force_{x}_{key}_n"] for x in "xyz"]) for key in ("max", "min", "mean")
    )
    size = np.asarray(columns["force_n"], dtype=np.float64)
    points, gives = (np.concatenate([getattr(one, key) for one in blades.bodies]) for key in ("points", "gives"))
    norm, near = np.linalg.norm(gives, axis=1), max(one.spacing for one in blades.bodies)
    most, least = np.zeros(len(size)), np.zeros(len(size))
    pressed = np.flatnonzero((size > 0.0) & np.isfinite(contact).all(axis=(1, 2)))
    for begin in range(0, len(pressed), ROWS):
        row = pressed[begin : begin + ROWS]
        away = _distance(points, contact[row, 0], contact[row, 1])
        at = away.argmin(axis=1)
        closest = away[np.arange(len(row)), at]
        touched = (away <= np.maximum(closest, near)[:, None]) & (closest <= radius + near)[:, None]
        ends = [gives[None] * force[row, None] for force in (low, high)]
        up, down = (pick(*ends).sum(axis=-1) for pick in (np.maximum, np.minimum))
        bound = np.minimum(np.maximum(up, -down), size[row, None] * norm)
        most[row] = np.where(touched, bound, 0.0).max(axis=1)
        least[row] = np.minimum(np.abs(np.einsum("ri,ri->r", gives[at], mean[row])), most[row])
    return most, least


def _distance(points: Floats, begin: Floats, end: Floats) -> Floats:
    """Distance of points (p, 3) from segments (r, 3) to (r, 3), (r, p)."""
    along = end - begin
    length2 = np.einsum("ri,ri->r", along, along)
    y = points[None] - begin[:, None]
    t = np.einsum("rpi,ri->rp", y, along) / np.where(length2 > 0.0, length2, 1.0)[:, None]
    return np.asarray(np.linalg.norm(y - np.clip(t, 0.0, 1.0)[..., None] * along[:, None], axis=2))
