"""Parts of the error of a load besides its resolution: runout that is not known, coefficients, thin chips.

Notation: L load of a step at nominal coefficients and at the runout that the cutter states with its direction; e [mm]
size of a runout whose direction is not known; K, C coefficients and their covariance as in
:mod:`chipload.cutting.band`. All parts are relative to L.

* Runout raises the peaks: rise = L(e) / L - 1. Of an assumed e it is the mean over :data:`DIRECTIONS` directions, and
  its standard deviation is :data:`SCATTER` of it: e is taken as even between 0.5 and 1.5 of its value. Relative to the
  risen load L (1 + rise) that is SCATTER rise / (1 + rise). Of a stated e it is the greatest over the directions. Means
  over a revolution do not rise.
* Coefficients: sqrt(g C g) / L, g = dL / dK at the rotation of the peak.
* Chips below the measured range: half the share that the edge forces have in L, by the part of the engaged edge on
  which the chip is thinner.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipload.cutter.cutter import Cutter
from chipload.cutting.band import force_factors, torque_factors
from chipload.cutting.material import Material
from chipload.cutting.revolution import loads_over_turn
from chipload.engagement.extent import radial_depth
from chipload.engagement.tooth_engagement import ToothEngagement
from chipload.engagement.tooth_surfaces import chips_of_teeth

Floats = NDArray[np.float64]

#: loads whose parts are calculated: those of the first three are peaks, the next are means over a revolution
PEAKS, MEANS, CHIP = ("force_n", "torque_nm", "force_normal_n"), ("torque_mean_nm", "power_w"), "chip_max_mm"
#: directions of a runout at which the peaks are evaluated; angle between two rotations [rad]
DIRECTIONS, ROTATION = 4, math.radians(2.0)
#: standard deviation over mean of what is even between 0.5 and 1.5 of its mean
SCATTER = 1.0 / math.sqrt(12.0)
#: greatest diameter [mm], and runout [mm] that is assumed where none is stated: half of the run-out tolerance of
#: collets of class 2 (ISO 15488:2003, table 4: 0.015 mm up to 10 mm, 0.020 mm above), and 0.0025 mm of spindle and
#: cutter, which is our assumption
ASSUMED = ((10.0, 0.010), (math.inf, 0.0125))
#: standard deviation over value that is assumed of coefficients whose material states none: four published sets of one
#: alloy differ by that
ASSUMED_SPREAD = 0.25
#: radial depth over diameter from which a cut is a full slot
SLOT = 0.999
#: places of a range of immersion at which its chip is compared with the measured range
PLACES = 9


@dataclass(frozen=True)
class LoadParts:
    """Parts of the error of one load, relative to it.

    Parameters
    ----------
    load : in the unit of its column
    rise : by a runout whose direction is not known
    coefficients, thin_chips : standard deviations
    assumed_runout : whether the runout is not stated: its rise has a standard deviation of :data:`SCATTER` of it
    assumed_spread : whether the material does not state the spread of its coefficients
    radial_depth : of the cut [mm]; inf: a full slot, whose width no deflection changes
    elasticity : (6,) relative change of the load with that of each coefficient, K dL/dK / L, whose sum is 1; empty: not
        known

    Raises
    ------
    ValueError
        A number is below 0 or not finite.
    """

    load: float
    rise: float = 0.0
    coefficients: float = 0.0
    thin_chips: float = 0.0
    assumed_runout: bool = False
    assumed_spread: bool = False
    radial_depth: float = math.inf
    elasticity: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        numbers = (self.load, self.rise, self.coefficients, self.thin_chips)
        if not all(math.isfinite(x) and x >= 0.0 for x in numbers):
            raise ValueError(f"parts of a load: {numbers}: must be finite and at least 0")

    @property
    def rise_deviation(self) -> float:
        """Standard deviation of the rise, relative to the risen load."""
        return float(deviation_of_rise(self.rise)) if self.assumed_runout else 0.0

    def relative_to(self, load: float) -> LoadParts:
        """Return the parts relative to another load that is at least as great; what this one lacks counts as rise.

        >>> LoadParts(80.0, 0.5).relative_to(100.0).rise
        0.2
        """
        rise = max(self.load * (1.0 + self.rise) / load - 1.0, 0.0) if load > 0.0 else 0.0
        return replace(self, load=load, rise=round(rise, 12))

    def bending(self, deflection: float) -> float:
        """Return the greatest relative change of the load by a deflection [mm] that changes the radial depth.

        >>> LoadParts(80.0, radial_depth=0.5).bending(0.01)
        0.02
        """
        return deflection / self.radial_depth if self.radial_depth > 0.0 else 0.0


def runout_of(cutter: Cutter) -> tuple[float, bool]:
    """Return the size of a runout whose direction is not known [mm], and whether it is assumed.

    >>> mill = Cutter(10.0, 2, 0.5, 20.0, 30.0, 6e5)
    >>> runout_of(mill), runout_of(replace(mill, runout_size=0.002)), runout_of(replace(mill, runout=(0.002, 1.0)))
    ((0.01, True), (0.002, False), (0.0, False))
    """
    if cutter.flutes == 1 or cutter.runout[0] > 0.0:
        return 0.0, False
    if cutter.runout_size is not None:
        return cutter.runout_size, False
    return next(e for most, e in ASSUMED if cutter.diameter <= most), True


def bounded_parts(cutter: Cutter, material: Material, chip: float) -> LoadParts:
    """Return upper bounds of the parts of a peak whose step is not computed again, from its thickest chip [mm].

    With N teeth the radii of a tooth and of the one before differ by 2 e sin(pi / N) at most, and a tooth cuts N times
    the chip at most if the others do not touch. The mean chip on the engaged edge is at least half of the thickest.

    >>> mill = Cutter(10.0, 2, 0.5, 20.0, 30.0, 6e5)
    >>> sharp = Material("sharp", 1000.0, 0.0, 0.0, 0.0, 0.0, 0.0, source="made up for this example", spread=0.1)
    >>> own = bounded_parts(mill, sharp, 0.1)
    >>> round(own.rise, 12), own.coefficients
    (0.4, 0.1)
    """
    known = with_spread(material)
    values, sizes = np.sqrt(np.diagonal(known.variances)), np.abs(known.coefficients)
    spread = float(np.max(np.divide(values, sizes, out=np.zeros(6), where=sizes > 0.05 * sizes[[0, 0, 0, 3, 3, 3]])))
    rise = float(bounded_rise(cutter, material, np.array([chip]))[0])
    return LoadParts(1.0, rise, spread, 0.0, runout_of(cutter)[1], not material.has_band)


def deviation_of_rise(rise: ArrayLike) -> Floats:
    """Return the standard deviation of a rise by an assumed runout, relative to the risen load: below SCATTER.

    >>> deviation_of_rise([0.0, 0.25, 1e6]).round(4).tolist()
    [0.0, 0.0577, 0.2887]
    """
    r = np.asarray(rise, dtype=np.float64)
    return np.asarray(SCATTER * r / (1.0 + r))


def bounded_rise(cutter: Cutter, material: Material, chip: Floats) -> Floats:
    """Return the rise of :func:`bounded_parts` of steps with the thickest chips (n,) [mm]."""
    e, mean = runout_of(cutter)[0], 0.5 * chip
    more = np.minimum(2.0 * e * math.sin(math.pi / cutter.flutes), (cutter.flutes - 1) * mean)
    whole = mean + material.Kte / material.Ktc
    return np.asarray(np.divide(more, whole, out=np.zeros(len(chip)), where=whole > 0.0))


def with_spread(material: Material) -> Material:
    """Return a material with the assumed spread of its coefficients if it states none."""
    return material if material.has_band else replace(material, spread=ASSUMED_SPREAD)


def load_parts(plain: ToothEngagement, cutter: Cutter, material: Material) -> dict[str, tuple[LoadParts, ...]]:
    """Return the parts of each load of each step.

    Parameters
    ----------
    plain : of n steps, with frames, without runout; each of them cuts

    Returns
    -------
    n parts each for :data:`PEAKS`, :data:`MEANS` and :data:`CHIP`; the load of ``power_w`` is the mean torque [N m]

    Examples
    --------
    One tooth has no runout, and a force that is Ktc h alone has the spread of Ktc.

    >>> from chipload.engagement.tooth_engagement import engagement_of_arcs
    >>> mill = Cutter(10.0, 1, 0.0, 20.0, 30.0, 6e5)
    >>> alone = Material("alone", 1000.0, 0.0, 0.0, 0.0, 0.0, 0.0, source="made up for this example", spread=0.1)
    >>> slot = replace(engagement_of_arcs([0.0], [math.pi], 0.1, mill, 2.0), frame=np.eye(3)[None])
    >>> own = load_parts(slot, mill, alone)["force_n"][0]
    >>> round(own.load, 1), own.rise, round(own.coefficients, 12)
    (200.0, 0.0, 0.1)
    """
    n, known = len(plain), with_spread(material)
    engagement = chips_of_teeth(plain, cutter)
    loads, turned = _loads(engagement, cutter, material)
    at = (turned[:, 0], turned[:, 1])
    factors = {
        "force_n": force_factors(engagement, cutter, known, at[0]),
        "torque_nm": torque_factors(engagement, cutter, known, at[1]) / 1e3,
        "torque_mean_nm": loads_over_turn(engagement, cutter, known, ROTATION, np.zeros((n, 3)))[2][:, 3] / 1e3,
        CHIP: np.zeros((n, 6)),
    }
    e, assumed = runout_of(cutter)
    rise = _rises(plain, cutter, material, loads, e, greatest=not assumed)
    edge, depth = _thin_chips(engagement, cutter, material, loads), radial_depth(plain)
    depth = np.where(depth < SLOT * cutter.resolved_diameter, depth, math.inf)
    out = {}
    for name, factor in factors.items():
        base, up, thin = loads[name], rise.get(name, np.zeros(n)), edge.get(name, np.zeros(n))
        deviates = np.sqrt(np.clip(np.einsum("nk,kl,nl->n", factor, known.variances, factor), 0.0, None))
        spread = np.divide(deviates, base, out=np.zeros(n), where=base > 0.0)
        own = factor * np.array(known.coefficients)
        each = np.divide(own, base[:, None], out=np.zeros((n, 6)), where=base[:, None] > 0.0).tolist()
        numbers = np.column_stack([base, up, spread, thin, depth]).tolist()
        out[name] = tuple(
            LoadParts(x, r, k, t, assumed, not material.has_band, wide, () if name == CHIP else tuple(e))
            for (x, r, k, t, wide), e in zip(numbers, each, strict=True)
        )
    out["force_normal_n"], out["power_w"] = out["force_n"], out["torque_mean_nm"]
    return out


def _loads(engagement: ToothEngagement, cutter: Cutter, material: Material) -> tuple[dict[str, Floats], Floats]:
    """Greatest force [N], greatest and mean torque [N m], thickest chip [mm]; (n, 2) rotations of the first two."""
    found, turned, _ = loads_over_turn(engagement, cutter, material, ROTATION, np.zeros((len(engagement), 3)))
    names = {"force_n": (9, 1.0), "torque_nm": (11, 1e-3), "torque_mean_nm": (10, 1e-3), CHIP: (13, 1.0)}
    return {name: found[:, k] * unit for name, (k, unit) in names.items()}, turned


def _rises(
    plain: ToothEngagement, cutter: Cutter, material: Material, base: Mapping[str, Floats], e: float, greatest: bool
) -> dict[str, Floats]:
    """(n,) each: rise of the peaks and of the thickest chip by a runout of size ``e``."""
    if e == 0.0:
        return {}
    raised: dict[str, list[Floats]] = {"force_n": [], "torque_nm": [], CHIP: []}
    for k in range(DIRECTIONS):
        off = replace(cutter, runout=(e, k * math.tau / DIRECTIONS / cutter.flutes), runout_size=None)
        found = _loads(chips_of_teeth(plain, off), off, material)[0]
        for name, values in raised.items():
            values.append(found[name])
    out = {}
    for name, values in raised.items():
        each = np.max(values, axis=0) if greatest else np.mean(values, axis=0)
        ratio = np.divide(each, base[name], out=np.ones(len(each)), where=base[name] > 0.0)
        out[name] = np.clip(ratio - 1.0, 0.0, None)
    return out


def _thin_chips(
    engagement: ToothEngagement, cutter: Cutter, material: Material, base: Mapping[str, Floats]
) -> dict[str, Floats]:
    """(n,) each: half the share of the edge forces, by the part of the engaged edge whose chip is below the range."""
    if material.chip is None or material.chip[0] == 0.0 or not any((material.Kte, material.Kre, material.Kae)):
        return {}
    p, q, a, b, along, offset, across = engagement.rows.T
    phi = p + (q - p) * ((np.arange(PLACES) + 0.5) / PLACES)[:, None]
    below = (along * np.sin(phi) + across * np.cos(phi) + offset < material.chip[0]).mean(axis=0)
    step, area = np.repeat(np.arange(len(engagement)), np.diff(engagement.start)), (q - p) * (b - a)
    whole = np.bincount(step, area, len(engagement))
    part = np.bincount(step, area * below, len(engagement))
    share = np.divide(part, whole, out=np.zeros(len(engagement)), where=whole > 0.0)
    sharp = _loads(engagement, cutter, replace(material, Kte=0.0, Kre=0.0, Kae=0.0, covariance=None, spread=0.0))[0]
    out = {}
    for name in ("force_n", "torque_nm", "torque_mean_nm"):
        ratio = np.divide(sharp[name], base[name], out=np.ones(len(share)), where=base[name] > 0.0)
        out[name] = 0.5 * share * np.clip(1.0 - ratio, 0.0, 1.0)
    return out
