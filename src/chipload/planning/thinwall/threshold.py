"""Allowable normal force of places of a wall: modelled from the compliance, or calibrated by experiments.

Notation: F_th [N] threshold, the allowable force; delta [mm] allowed deflection; C_nn [mm/N] normal compliance of a
place; u, v parameters of the surface; F_i [N] allowable forces found in m experiments, y = log F; s standard deviation
of y; k number of standard deviations that are kept as reserve.

Modelled: F_th = delta / C_nn, with C_nn of the clamped workpiece in its present state of removal.

Calibrated: y is interpolated linearly between the experiments (Delaunay's triangles in u, v), means of repeats, and

    F_th = exp(y - k s).

s is the pooled deviation of repeats, or what it is when each experiment is predicted from the others without it, the
greater of the two where both are known. Beyond the experiments the allowable force may be less than in any of them.
Such places are listed in ``outside`` and take the least force of all, with the reserve.

Reference: [Yan2018] for calibrated thresholds by place. Differs from source: a threshold may also be modelled.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipload.errors import InputError
from chipload.lazy import scipy
from chipload.number_text import number_text
from chipload.structure.removal import StructureRemoval
from chipload.structure.unit_loads import UnitLoads, compliance

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]
Source = Literal["modelled", "calibrated"]


@dataclass(frozen=True, eq=False)
class Threshold:
    """Allowable normal force of places.

    Attributes
    ----------
    force : (p,) float [N], above 0
    source : ``modelled`` or ``calibrated``
    factor : safety factor that is in ``force`` already, at most 1
    outside : (p,) bool, beyond the experiments; False where modelled
    compliance : (p,) float [mm/N], C_nn; None: calibrated
    text : a sentence that states the source of the force
    depth : (p,) float [mm], stable depth, 0: none is stable; None: not calculated
    speed : of the spindle [rad/s] that this holds for; None: that of the operation
    """

    force: Floats
    source: Source
    factor: float
    outside: Bools
    compliance: Floats | None
    text: str
    depth: Floats | None = None
    speed: float | None = None

    def within(self, depth: Floats) -> Floats:
        """Depths [mm] of the places, at most the stable depth."""
        return depth if self.depth is None else np.minimum(depth, self.depth.reshape(depth.shape))


def modelled(C_nn: ArrayLike, deflection: float, factor: float = 1.0) -> Threshold:
    """Threshold modelled from the compliance: delta / C_nn, times the factor.

    Parameters
    ----------
    C_nn : (p,) float [mm/N], above 0
    deflection : delta > 0 [mm]
    factor : share of it that is used, above 0, at most 1

    Examples
    --------
    >>> modelled([0.002, 0.01], 0.05).force.tolist()
    [25.0, 5.0]
    """
    C = np.atleast_1d(np.asarray(C_nn, dtype=np.float64))
    if C.ndim != 1 or not ((C > 0.0) & np.isfinite(C)).all():
        raise InputError("threshold: the normal compliance of a place is not above 0 mm/N")
    if not 0.0 < deflection < math.inf:
        raise InputError(f"threshold.deflection_mm = {deflection:g}: must be above 0")
    if not 0.0 < factor <= 1.0:
        raise InputError(f"threshold.factor = {factor:g}: must be above 0 and at most 1")
    text = (
        f"modelled: {factor * deflection:g} mm over the normal compliance by finite elements in this state of removal"
    )
    return Threshold(factor * deflection / C, "modelled", factor, np.zeros(len(C), dtype=np.bool_), C, text)


def of_state(state: StructureRemoval, watched: UnitLoads, deflection: float, factor: float = 1.0) -> Threshold:
    """Threshold of watched places in one state of removal; see :func:`chipload.structure.unit_loads.watch`.

    Raises
    ------
    InputError
        The places were watched along x, y, z and not along their normals, or are on material that is gone.
    """
    if watched.own.shape[1] != 1:
        raise InputError("threshold: the places are watched along x, y, z: watch them along their normals")
    return modelled(compliance(state, watched), deflection, factor)


@dataclass(frozen=True, eq=False)
class Experiments:
    """Allowable forces that experiments found at places of the wall.

    Parameters
    ----------
    place : (m, 2) float, u, v; at least three places that are not on a line
    force : (m,) float [N], above 0

    Raises
    ------
    InputError
        Too few places, all on a line, or a number out of range.
    """

    place: Floats
    force: Floats

    def __post_init__(self) -> None:
        place = np.array(self.place, dtype=np.float64)
        force = np.array(self.force, dtype=np.float64)
        if place.ndim != 2 or place.shape[1] != 2 or force.shape != (len(place),) or not np.isfinite(place).all():
            raise InputError(f"experiments: places {place.shape}, forces {force.shape}: need (m, 2) and (m,) numbers")
        bad = np.flatnonzero(~((force > 0.0) & np.isfinite(force)))
        if len(bad):
            raise InputError(f"experiments: row {bad[0]}: normal_force_n = {force[bad[0]]:g}: must be above 0")
        different = np.unique(place, axis=0)
        if len(different) < 3:
            raise InputError(
                f"experiments: {len(different)} places: must be at least 3, not on a line, for a map of the wall; "
                "measure at the corners of the free edge, its middle and near the clamp"
            )
        for value in (place, force):
            value.setflags(write=False)
        object.__setattr__(self, "place", place)
        object.__setattr__(self, "force", force)


def from_deflections(place: ArrayLike, force: ArrayLike, measured: ArrayLike, deflection: float) -> Experiments:
    """Experiments in which the deflection was measured: the allowable force is force times delta over measured
    deflection.

    Parameters
    ----------
    place : (m, 2); force : (m,) float [N]; measured : (m,) float [mm], above 0
    deflection : delta [mm]

    Examples
    --------
    >>> from_deflections([[0, 0], [1, 0], [0, 1]], [10, 10, 10], [0.1, 0.05, 0.2], 0.05).force.tolist()
    [5.0, 10.0, 2.5]
    """
    w, F = np.asarray(measured, dtype=np.float64), np.asarray(force, dtype=np.float64)
    bad = np.flatnonzero(~(w > 0.0))
    if len(bad):
        raise InputError(f"experiments: row {bad[0]}: deflection_mm = {w[bad[0]]:g}: must be above 0")
    return Experiments(np.asarray(place, dtype=np.float64), F * deflection / w)


def scatter(experiments: Experiments) -> tuple[float, str]:
    """Standard deviation of log F, and the source of this number.

    Raises
    ------
    InputError
        No place was repeated and none lies between the others: the scatter cannot be known.
    """
    place, y, repeats = _means(experiments)
    found: list[tuple[float, str]] = []
    freedom = sum(len(r) - 1 for r in repeats)
    if freedom:
        square = sum(float(((r - r.mean()) ** 2).sum()) for r in repeats)
        found.append((math.sqrt(square / freedom), f"repeats, {freedom} degrees of freedom"))
    misses = []
    for i in range(len(place)):
        rest = np.arange(len(place)) != i
        try:
            guess = float(scipy.interpolate.LinearNDInterpolator(place[rest], y[rest])(place[i : i + 1])[0])
        except (scipy.spatial.QhullError, ValueError):
            continue
        if math.isfinite(guess):
            misses.append(guess - y[i])
    if misses:
        found.append((math.sqrt(float(np.mean(np.square(misses)))), f"{len(misses)} places predicted from the others"))
    if not found:
        raise InputError(
            "experiments: neither repeats at a place nor a place between the others: the scatter is unknown; repeat one"
        )
    return max(found)


def _means(experiments: Experiments) -> tuple[Floats, Floats, list[Floats]]:
    place, which = np.unique(experiments.place, axis=0, return_inverse=True)
    y = np.log(experiments.force)
    repeats = [y[which.ravel() == i] for i in range(len(place))]
    return place, np.array([r.mean() for r in repeats]), repeats


def calibrated(experiments: Experiments, places: ArrayLike, deviations: float) -> Threshold:
    """Threshold of places, interpolated between experiments.

    Parameters
    ----------
    places : (p, 2) float, u, v
    deviations : k >= 0, number of standard deviations that are kept as reserve

    Raises
    ------
    InputError
        The experiments lie on a line, their scatter is unknown, or a number is out of range.

    Examples
    --------
    Two repeats 5 % to either side of 100 N: s = 0.0707, k = 2.

    >>> made = Experiments([[0, 0], [0, 0], [1, 0], [0, 1]], [100 * 1.05, 100 / 1.05, 100.0, 100.0])
    >>> found = calibrated(made, [[0.2, 0.2], [2.0, 0.0]], 2.0)
    >>> found.force.round(2).tolist(), found.outside.tolist(), round(100 * math.exp(-2 * 2**0.5 * math.log(1.05)), 2)
    ([87.11, 87.11], [False, True], 87.11)
    """
    if not 0.0 <= deviations < math.inf:
        raise InputError(f"threshold.deviations = {deviations:g}: must be at least 0")
    at = np.atleast_2d(np.asarray(places, dtype=np.float64))
    place, y, _ = _means(experiments)
    try:
        triangles = scipy.spatial.Delaunay(place)
    except scipy.spatial.QhullError as error:
        raise InputError("experiments: all places lie on a line: add a place off it") from error
    s, how = scatter(experiments)
    value = scipy.interpolate.LinearNDInterpolator(triangles, y)(at)
    outside = ~np.isfinite(value)
    factor = math.exp(-deviations * s)
    force = factor * np.exp(np.where(outside, y.min(), value))
    text = (
        f"calibrated: {len(experiments.force)} experiments at {len(place)} places, scatter "
        f"{number_text(100.0 * s, 3)} % ({how}), "
        f"safety factor {factor:.3g}"
    )
    return Threshold(force, "calibrated", factor, outside, None, text)
