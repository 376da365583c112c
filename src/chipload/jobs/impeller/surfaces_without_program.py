"""Surfaces of an impeller that its programs do not mill: those that no table names, and parts beside its ranges."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from chipload.geometry.bspline import BSplinePatch
from chipload.jobs.impeller.outcome import ImpellerResult
from chipload.planning.impeller.surfaces import BODIES

Floats = NDArray[np.float64]

#: cells of a side along and up, whose areas are added
_CELLS = (240, 80)
#: a smaller part of a side is not worth a line [%]
_LEAST = 0.5


def surfaces_without_program(outcome: ImpellerResult) -> str:
    """Return one line with all surfaces, or parts of them, that no program of a job mills."""
    return f"not milled: {'; '.join([*_parts(outcome), 'leading and trailing edges and tips of all blades'])}"


def _parts(outcome: ImpellerResult) -> Iterator[str]:
    """Surfaces that the job does not name, and parts of those that it names."""
    ranges = {(op.surface.body, op.surface.side): (op.settings["along"], op.settings["up"]) for op in outcome.surfaces}
    impeller = outcome.impeller
    sides = ("plus", "minus", "floor", *(("plus fillet", "minus fillet") if impeller.fillets else ()))
    for k, body in enumerate(BODIES[: len(impeller.bodies)]):
        for side in sides:
            span = ranges.get((body, side))
            if span is None:
                yield f"{body} {side}"
                continue
            (u0, u1), (v0, v1) = span
            if side == "floor":
                if min(u0, v0) > 0.0 or max(u1, v1) < 1.0:
                    yield f"{body} floor beyond {u0:g} to {u1:g} along and {v0:g} to {v1:g} across"
                continue
            blade = (impeller.fillets if side.endswith("fillet") else impeller.bodies)[k]
            rest = 100.0 * (1.0 - area_share(getattr(blade, side.split()[0]), (u0, u1), (v0, v1)))
            if rest > _LEAST:
                yield f"{rest:.1f} % of {body} {side}, beyond {u0:g} to {u1:g} along and {v0:g} to {v1:g} up"


def area_share(patch: BSplinePatch, along: tuple[float, float], up: tuple[float, float]) -> float:
    """Share of the area of a patch that lies within a range of u and v, 0 to 1."""
    return _area(patch, along, up) / _area(patch, (0.0, 1.0), (0.0, 1.0))


def _area(patch: BSplinePatch, along: tuple[float, float], up: tuple[float, float]) -> float:
    """Area of a range of a patch [mm^2], by cells."""
    each = [low + (np.arange(n) + 0.5) * (high - low) / n for n, (low, high) in zip(_CELLS, (along, up), strict=True)]
    u, v = (x.ravel() for x in np.meshgrid(*each, indexing="ij"))
    normal = np.linalg.norm(np.cross(patch.at(u, v, 1, 0), patch.at(u, v, 0, 1)), axis=1)
    return float(normal.mean()) * (along[1] - along[0]) * (up[1] - up[0])
