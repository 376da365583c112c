"""The cutting edge in slices along the profile of the cutter: position, normal and lag.

Notation: s [mm] length along the profile, 0 where the bottom line ends, below 0 on the bottom line, rising through the
corner and the flank to the end of the flutes; rho [mm] distance from the axis, z [mm] height above the tip; R half the
diameter; kappa [rad] angle of the outward normal nu with the downward axis: nu = sin(kappa) u - cos(kappa) A, u the
radial direction, A the axis from the tip to the holder. A flat bottom has kappa = 0, a bottom line alpha, a straight
flank pi/2, a tapered one pi/2 - beta; along the corner kappa rises evenly from alpha to pi/2 - beta and s - s' =
r (kappa - kappa'), likewise along the flank arc of a barrel.

The edge has a constant lead: at height z it lags behind the tip by z tan(helix) / R, also where it is nearer to the
axis, so that along s the lag grows by sin(kappa) tan(helix) / R. On a flat bottom it does not lag.

A slice takes rho and kappa at its middle: exact on lines, of second order in the slice's length on the corner.

Reference: [Engin2001], generalised cutter and constant lead.
Differs from source: there a slice is a step of z; here of s, so that a flat bottom has slices too.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from chipload.cutter.cutter import Cutter
from chipload.errors import InputError

Floats = NDArray[np.float64]
#: nodes of s, then of each slice between them: rho at the middle, lower z, sine, cosine, radius of the arc
Part = tuple[Floats, Floats, Floats, Floats, Floats, Floats]


@dataclass(frozen=True, eq=False)
class Slices:
    """Consecutive segments of a cutter's profile, (k,) float each.

    Parameters
    ----------
    s_from, s_to : bounds [mm]
    rho : radius at the middle [mm]
    z : height at ``s_from`` [mm]
    sin_kappa, cos_kappa : at the middle
    lag : at ``s_from`` [rad]
    rate : of the lag [rad/mm]
    radius : of the profile's arc [mm]; 0 on a straight segment
    """

    s_from: Floats
    s_to: Floats
    rho: Floats
    z: Floats
    sin_kappa: Floats
    cos_kappa: Floats
    lag: Floats
    rate: Floats
    radius: Floats

    def __post_init__(self) -> None:
        for field in fields(self):
            value = np.array(getattr(self, field.name), dtype=np.float64)
            if value.shape != (len(self),) or not np.isfinite(value).all():
                raise InputError(f"slices.{field.name} of shape {value.shape}: need ({len(self)},) finite numbers")
            value.setflags(write=False)
            object.__setattr__(self, field.name, value)

    def __len__(self) -> int:
        return len(self.s_from)

    @property
    def z_middle(self) -> Floats:
        """(k,) float [mm], height at the middle of the slice, where ``rho`` is taken: the point (rho, z) lies on the
        profile; the mean of the ends of an arc would lie inside it, by r cos(kappa) (1 - cos(half its angle)).

        >>> ball = slices(Cutter(12.0, 2, 0.0, 20.0, 30.0, 6e5, corner_radius=6.0), corner_slices=3)
        >>> (np.hypot(ball.rho, 6.0 - ball.z_middle)[:3]).round(12).tolist()
        [6.0, 6.0, 6.0]
        """
        half = 0.5 * (self.s_to - self.s_from)
        bent = self.radius > 0.0
        r = np.where(bent, self.radius, 1.0)
        kappa = np.arctan2(self.sin_kappa, self.cos_kappa)
        return np.asarray(
            self.z + np.where(bent, r * (np.cos(kappa - half / r) - self.cos_kappa), half * self.sin_kappa)
        )

    @property
    def columns(self) -> Floats:
        """Columns (k, 7) for tooth engagement and force: s_from, rho, z, sin(kappa), cos(kappa), lag, rate."""
        return np.column_stack([self.s_from, self.rho, self.z, self.sin_kappa, self.cos_kappa, self.lag, self.rate])


def edge_lag(cutter: Cutter) -> float:
    """Return tan(helix) / R [rad/mm]: the lag of the edge behind its tip for each mm of height."""
    return math.tan(cutter.helix) / cutter.radius


def slices(
    cutter: Cutter,
    *,
    bottom_slices: int = 4,
    corner_slices: int = 16,
    flank_mm: float | None = None,
    grading: float = 1.0,
) -> Slices:
    """Return the profile from the axis to the end of the flutes in slices.

    Parameters
    ----------
    cutter : of any shape that is not a body
    bottom_slices : number of slices of the bottom line, at least 1
    corner_slices : number of slices of the corner, at least 1; the flank arc of a barrel has as many, or more so that
        none is longer than ``flank_mm``
    grading : exponent of the spacing of the corner's slices in kappa, (j / n)^grading, from 1 (even) to 3; above 1 the
        slices are narrow near the bottom, where shallow cuts lie
    flank_mm : greatest length of a slice of the flank [mm], above 0; None: the flank is one slice (with a taper its rho
        is then that of its middle)

    Returns
    -------
    Slices
        From the axis upwards; a part of the profile without length has no slice.

    Examples
    --------
    >>> bull = slices(Cutter(10.0, 4, 0.0, 20.0, 30.0, 6e5, corner_radius=1.0), bottom_slices=1, corner_slices=1)
    >>> bull.s_from.round(3).tolist(), bull.s_to.round(3).tolist(), bull.rho.round(3).tolist()
    ([-4.0, 0.0, 1.571], [0.0, 1.571, 20.571], [2.0, 4.707, 5.0])
    >>> bull.sin_kappa.round(3).tolist(), bull.z.round(3).tolist()
    ([0.0, 0.707, 1.0], [0.0, 0.0, 1.0])
    """
    for name, number in (("bottom_slices", bottom_slices), ("corner_slices", corner_slices)):
        if number < 1:
            raise InputError(f"slices: {name} = {number}: must be at least 1")
    if not 1.0 <= grading <= 3.0:
        raise InputError(f"slices: grading = {grading:g}: must be from 1 (evenly) to 3")
    if flank_mm is not None and not flank_mm > 0.0:
        raise InputError(f"slices: flank_mm = {flank_mm:g}: must be above 0, or None for one slice")

    def count(length: float, least: int) -> int:
        return least if flank_mm is None else max(least, math.ceil(length / flank_mm * (1.0 - 1e-12)))

    segments, parts = cutter.segments, list[Part]()
    # 0 where the bottom line ends
    s = -segments[0].length if segments[0].straight and len(segments) > 1 else 0.0
    for i, segment in enumerate(segments):
        (inner, outer), (low, top), (first, last), length = segment.rho, segment.z, segment.kappa, segment.length
        if segment.straight:
            number = count(length, 1) if i == len(segments) - 1 and i > 0 else bottom_slices
            share = np.linspace(0.0, 1.0, number + 1)
            parts.append(_line(s + length * share, inner + (outer - inner) * share, low + (top - low) * share, first))
        elif segment.radius > 0.0:
            # an arc of a larger radius than the cutter's is cut as a flank is
            wide = segment.radius > cutter.radius
            share = np.linspace(0.0, 1.0, (count(length, corner_slices) if wide else corner_slices) + 1)
            kappa = first + (last - first) * (share if wide or grading == 1.0 else share**grading)
            parts.append(_bow(s, kappa, *segment.centre, segment.radius))
        s = 0.0 if i == 0 and s < 0.0 else s + length
    s_from = np.concatenate([p[0][:-1] for p in parts])
    s_to = np.concatenate([p[0][1:] for p in parts])
    rho, z, sin, cos, bend = (np.concatenate([p[i] for p in parts]) for i in range(1, 6))
    lead = edge_lag(cutter)
    return Slices(s_from, s_to, rho, z, sin, cos, lead * z, lead * sin, bend)


def _bow(start: float, kappa: Floats, e: float, f: float, r: float) -> Part:
    """Slices of an arc between nodes of kappa, ``start`` its s: as :func:`_line`."""
    mid = 0.5 * (kappa[:-1] + kappa[1:])
    s = start + r * (kappa - kappa[0])
    # a sharp corner on the bottom: its height is 0 but for rounding
    z = np.maximum(f - r * np.cos(kappa[:-1]), 0.0)
    return s, e + r * np.sin(mid), z, np.sin(mid), np.cos(mid), r + 0.0 * mid


def _line(s: Floats, rho: Floats, z: Floats, kappa: float) -> Part:
    """Slices of a straight segment of the profile between nodes: nodes of s, middle rho, lower z, sine, cosine, 0."""
    one = np.ones(len(s) - 1)
    cosine = 0.0 if abs(kappa - 0.5 * math.pi) < 1e-12 else math.cos(kappa)
    return s, 0.5 * (rho[:-1] + rho[1:]), z[:-1], math.sin(kappa) * one, cosine * one, 0.0 * one
