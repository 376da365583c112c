"""Further variants that a job can request: the least form error in the same time, and a compensated path.

The variable plan takes less time at one deflection. The least-error plan takes the time of the constant plan and has
less form error, which is that of the last pass of each side: that pass keeps ever smaller shares of the limit, until
the time is used. Places where even the smallest depth exceeds such a share get the smallest depth, where the edge force
governs. The constant plan takes that time as well: where it has less error than all of these, as in a few passes with
coarse rows, it is the plan of least error.

Compensation moves the last pass of each side by its predicted form error to the other side (mirrored), by at most the
stated distance. The moved pass is simulated, and moved again by the error found. The remaining error is the form error
less the distance by which the path was moved. The cut is deeper than planned by that distance, so force and deflection
are found too great rather than too small: a real wall deflects, and is cut less deep.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from chipload.jobs.thinwall.outcome import Finish, Surfaces, Variant
from chipload.jobs.thinwall.places import Places
from chipload.lazy import scipy
from chipload.planning.thinwall.passes import NOTHING, planned_pass
from chipload.planning.thinwall.threshold import Threshold
from chipload.planning.thinwall.variants import DepthOperation, PlannedVariant, limited_to

Floats = NDArray[np.float64]

#: shares of the deflection limit that the last passes of the plan of least error are held to, one after the other
SHARES = (1.0, 0.85, 0.72, 0.6, 0.5, 0.42, 0.35)
#: times that a path is moved and simulated
MOVES = 2


def least_error(
    places: Places,
    operations: Sequence[DepthOperation],
    constant: Variant,
    time_of: Callable[[PlannedVariant], float],
    prove: Callable[[PlannedVariant], Variant],
) -> Variant:
    """Variable depths with the least form error in a given time.

    Parameters
    ----------
    operations : with the thresholds of the other passes
    constant : the plan of constant depth, whose time it may take
    time_of : time of a plan [s]
    prove : writes and simulates one
    """
    inputs = places.inputs

    limited = operations[-1].threshold_of

    def planned(share: float) -> PlannedVariant:
        def threshold_of(left: Sequence[Floats], side: int) -> Threshold:
            found = limited(left, side)
            last = float(left[side].max()) <= NOTHING
            return replace(found, force=share * found.force, factor=share * found.factor) if last else found

        last = replace(operations[-1], threshold_of=threshold_of)
        return limited_to(places.surfaces, [*operations[:-1], last], inputs.depths.deflection)

    best = planned(SHARES[0])
    for share in SHARES[1:]:
        one = planned(share)
        if time_of(one) > constant.seconds:
            break
        best = one
    found = prove(replace(best, plan=replace(best.plan, name="least_error")))
    return found if found.error_rms <= constant.error_rms else replace(constant, name="least_error")


def compensate_passes(
    places: Places, planned: PlannedVariant, before: Variant, most: float, prove: Callable[[PlannedVariant], Variant]
) -> Variant:
    """Plan whose last passes are moved against their predicted form error.

    Parameters
    ----------
    planned, before : the plan, and what its simulation found
    most : [mm] by which the path may be moved
    prove : writes and simulates a plan
    """
    error = before.finish
    found: list[Variant] = []
    for _ in range(MOVES):
        shift = [_shift(places, error, side, most) for side in range(len(places.surfaces))]
        one = prove(_move_last_passes(places, planned, shift))
        error = one.finish
        left = tuple(_remaining_error(places, f, shift) for f in one.finish)
        surfaces = partial(_with_finish, one, left)
        found.append(replace(one, find_surfaces=surfaces, shift=max(float(np.abs(o).max()) for o in shift)))
    return min(found, key=lambda one: one.error)


def _with_finish(one: Variant, finish: tuple[Finish, ...]) -> Surfaces:
    """The surfaces of a variant with other finished sides."""
    return replace(one.surfaces, finish=finish)


def _interpolate(at: tuple[Floats, Floats], values: Floats, to: tuple[Floats, Floats]) -> Floats:
    """Bilinear values at other parameters; beyond the outermost ones theirs."""
    inner = [np.clip(x, own[0], own[-1]) for x, own in zip(to, at, strict=True)]
    found = scipy.interpolate.RegularGridInterpolator(at, values)(np.stack(np.meshgrid(*inner, indexing="ij"), axis=-1))
    return np.asarray(found, dtype=np.float64)


def _side(places: Places, finish: Finish) -> int:
    """Number of a finished side among those with stock."""
    return places.inputs.body.side_numbers.index(finish.side)


def _shift(places: Places, finish: Sequence[Finish], side: int, most: float) -> Floats:
    """(n, m) float [mm] by which the path of a side is moved into the wall, at the places."""
    for f in finish:
        if _side(places, f) == side:
            known = np.where(f.made, f.error, 0.0)
            return np.clip(_interpolate(f.parameters, known, places.grid), -most, most)
    return np.zeros(places.shape)


def _move_last_passes(places: Places, planned: PlannedVariant, shift: Sequence[Floats]) -> PlannedVariant:
    """The plan with the last pass of each side moved."""
    plan, law = planned.plan, places.inputs.depths.law
    passes = [
        replace(
            planned_pass(p.side, p.low - shift[p.side], p.high, p.threshold, law, p.correction), operation=p.operation
        )
        if float(p.low.max()) <= NOTHING
        else p
        for p in plan.passes
    ]
    return replace(planned, plan=replace(plan, name="compensated", passes=tuple(passes)))


def _remaining_error(places: Places, finish: Finish, shift: Sequence[Floats]) -> Finish:
    """A finished side with the error that is left of a moved path."""
    moved = _interpolate(places.grid, shift[_side(places, finish)], finish.parameters)
    return replace(finish, error=finish.error - moved, rigid=finish.rigid + moved)
