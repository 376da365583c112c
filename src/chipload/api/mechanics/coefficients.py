"""Force coefficients from measured forces, as values."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from chipload.api.mechanics.cut import CutEngagement, speeds_rad_s, straight_cutter
from chipload.api.values import AnyCutter
from chipload.cutting.fit import Fit, fit_average
from chipload.cutting.fit_turns import fit_instantaneous
from chipload.cutting.turns import MeasuredCut
from chipload.errors import InputError
from chipload.units import mm_s_from_mm_min


def measured_cut(
    name: str,
    force_n: ArrayLike,
    *,
    rate_hz: float,
    feed_mm_min: float,
    speed_rpm: float,
    engagement: CutEngagement,
) -> MeasuredCut:
    """Return a steady cut that was measured.

    Parameters
    ----------
    name : as messages call it
    force_n : (n, 3) float, on the cutter along the feed, across it and along the axis; a column of NaN was not measured
    rate_hz : samples a second, above 0
    feed_mm_min : of the centre of the cutter, above 0
    speed_rpm : nominal speed of the spindle, above 0
    engagement : of the cut

    Returns
    -------
    MeasuredCut

    Raises
    ------
    InputError
        A number is out of range, a column is measured in part, or the samples last less than one turn.

    Examples
    --------
    >>> import chipload
    >>> slot = chipload.CutEngagement(entry_deg=0.0, exit_deg=180.0, axial_depth_mm=2.0)
    >>> cut = measured_cut("a", np.zeros((400, 3)), rate_hz=6000, feed_mm_min=600, speed_rpm=3000, engagement=slot)
    >>> round(cut.feed_per_tooth(4), 9)
    0.05
    """
    arc = (math.radians(engagement.entry_deg), math.radians(engagement.exit_deg))
    speed = float(speeds_rad_s(speed_rpm)[0])
    force = np.asarray(force_n, dtype=np.float64)
    return MeasuredCut(name, rate_hz, force, mm_s_from_mm_min(feed_mm_min), speed, arc, engagement.axial_depth_mm)


def fit(
    cuts: Iterable[MeasuredCut],
    cutter: AnyCutter,
    *,
    method: Literal["average", "instantaneous"] = "average",
    band_hz: float | None = None,
    runout: bool | None = None,
    zero: bool | None = None,
    ringing_hz: Sequence[float | None] | None = None,
) -> Fit:
    """Identify the six force coefficients of a material from measured cuts.

    ``average``: mean forces over whole turns are linear in the coefficients, a regression over cuts of two feeds or
    more. ``instantaneous``: least squares on every sample over the turn, by its harmonics up to ``band_hz``; it also
    finds the runout and the phase of the spindle, and one cut is enough. Intervals are 95 %, Student's t.

    Parameters
    ----------
    cuts : from :func:`chipload.measured_cut`
    cutter : straight flank; by the average method its runout, where it is known, decides which teeth touch
    method : ``average`` or ``instantaneous``
    band_hz : highest frequency that counts; only with ``instantaneous``, which requires it. Best below the first
        resonance of the dynamometer
    runout, zero : seek the runout (None: yes) and the zero of each channel (None: no); only with ``instantaneous``
    ringing_hz : about where the dynamometer rings along the feed, across it and along the axis, None where it is rigid;
        only with ``instantaneous``

    Returns
    -------
    Fit
        ``coefficients.values`` (6,) float, Ktc, Krc, Kac [MPa], Kte, Kre, Kae [N/mm], NaN where a measurement does not
        determine one; ``coefficients.interval`` (6, 2), ``coefficients.covariance`` (6, 6); ``cutter`` with the runout
        that was found.

    Raises
    ------
    InputError
        There is no cut, the band holds no harmonic, a setting belongs to the other method, or the cutter has no
        straight flank.

    References
    ----------
    [Altintas2012] ch. 2, mean forces; [Kline1983], runout.

    Examples
    --------
    Two slots whose forces are those of a known material: the fit finds its coefficients again.

    >>> import chipload
    >>> mill = chipload.Cutter(diameter_mm=10, flutes=3, helix_deg=30, flute_length_mm=22, overhang_mm=35,
    ...                        modulus_gpa=580)
    >>> metal = chipload.Material("plain", 1000.0, 300.0, 200.0, 10.0, 5.0, 2.0, source="made up for this example")
    >>> slot = chipload.engagement_of_cut(mill, axial_depth_mm=2, milling="slot")
    >>> cuts = []
    >>> for fz in (0.05, 0.1):
    ...     turn = chipload.tooth_forces(mill, metal, slot, fz, 3000, rotations=720)
    ...     cuts.append(measured_cut("slot", np.tile(turn.force_n, (4, 1)), rate_hz=36000, feed_mm_min=fz * 3 * 3000,
    ...                              speed_rpm=3000, engagement=slot))
    >>> found = fit(cuts, mill).coefficients.values
    >>> found.round().tolist(), bool((abs(found / [1000.0, 300.0, 200.0, 10.0, 5.0, 2.0] - 1.0) < 0.004).all())
    ([1000.0, 300.0, 200.0, 10.0, 5.0, 2.0], True)
    """
    mill = straight_cutter(cutter)
    if method not in ("average", "instantaneous"):
        raise InputError(f"method = {method!r}: must be average or instantaneous")
    measured = list(cuts)
    for k, cut in enumerate(measured):
        if not isinstance(cut, MeasuredCut):
            raise InputError(f"cuts[{k}]: {type(cut).__name__}: give what measured_cut returns")
    if method == "average":
        for key, value in (("band_hz", band_hz), ("runout", runout), ("zero", zero), ("ringing_hz", ringing_hz)):
            if value is not None:
                raise InputError(f"{key}: only the method instantaneous uses it: leave it out")
        return fit_average(measured, mill)
    if band_hz is None or not 0.0 < band_hz < math.inf:
        raise InputError("band_hz: missing or not above 0: the method instantaneous requires it")
    rings = (None, None, None) if ringing_hz is None else tuple(ringing_hz)
    if len(rings) != 3:
        raise InputError(f"ringing_hz: {len(rings)} values: must be three, None where the dynamometer is rigid")
    return fit_instantaneous(
        measured, mill, band=math.tau * band_hz, runout=runout is not False, zero=bool(zero),
        ringing=[None if hz is None else math.tau * hz for hz in rings],
    )  # fmt: skip
