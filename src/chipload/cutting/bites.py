"""What each tooth cuts, from where to where, how thick: the one interface between engagement and force.

Notation: phi [rad] immersion, counted in the sense of the spindle from the side where the rim moves with the feed, so
that pi/2 is straight ahead (up milling 0 .. a, down milling pi - a .. pi); z [mm] height above the tip; f_z [mm] feed
per tooth; N teeth; j tooth, each a pitch 2 pi / N behind the one before it; r_j = R + e cos(lambda - 2 pi j / N) its
radius with the runout (e, lambda), lambda counted from tooth 0 towards tooth 1; h [mm] chip thickness.

A bite is a range of immersion and of height in which h = slope sin(phi) + offset, and is positive.

Reference: [Altintas2012] ch. 2 for h = f_z sin(phi); [Kline1983] for runout: a tooth cuts what the N teeth before it
left over, h_j = min over m = 1 .. N of m f_z sin(phi) + r_j - r_(j-m), where positive; else it does not touch.
Differs from source: the phase of the offset does not lag with the helix, a tooth has one radius over its depth.
The volume a revolution removes does not depend on runout: sum over j of h_j = N f_z sin(phi).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipload.cutter.cutter import Cutter
from chipload.cutting import _kernels
from chipload.errors import InputError

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

#: how far beyond 0 .. pi an end of an arc may lie [rad]; rounding, not a setting
_SLACK = 1e-6


@dataclass(frozen=True, eq=False)
class Bites:
    """Bites of n steps, sorted by step.

    Parameters
    ----------
    start : (n + 1,) int; the bites of step i are the rows start[i] .. start[i + 1] - 1
    rows : (b, 6) float: phi from, phi to [rad, 0 .. pi], z from, z to [mm], slope, offset [mm]; those of one tooth at
        one height are disjoint
    tooth : (b,) int; which tooth; -1: every tooth
    """

    start: Ints
    rows: Floats
    tooth: Ints

    def __post_init__(self) -> None:
        start = np.ascontiguousarray(self.start, dtype=np.int64)
        rows = np.ascontiguousarray(self.rows, dtype=np.float64)
        tooth = np.ascontiguousarray(self.tooth, dtype=np.int64)
        if rows.ndim != 2 or rows.shape[1] != 6 or not np.isfinite(rows).all():
            raise InputError(f"bites: rows of shape {rows.shape}: need (b, 6) finite numbers")
        if len(tooth) != len(rows) or start[0] != 0 or start[-1] != len(rows) or (np.diff(start) < 0).any():
            raise InputError(f"bites: {len(rows)} rows, {len(tooth)} teeth, start up to {start[-1]}: must agree")
        for name, value in (("start", start), ("rows", rows), ("tooth", tooth)):
            value.setflags(write=False)
            object.__setattr__(self, name, value)

    def __len__(self) -> int:
        return len(self.start) - 1

    def chip_max(self) -> Floats:
        """Greatest chip thickness of each step, (n,) float [mm]; 0 where nothing is cut."""
        ahead = np.clip(0.5 * math.pi, self.rows[:, 0], self.rows[:, 1])
        h = self.rows[:, 4] * np.sin(ahead) + self.rows[:, 5]
        out = np.zeros(len(self))
        np.maximum.at(out, np.repeat(np.arange(len(self)), np.diff(self.start)), h)
        return out


def tooth_radii(cutter: Cutter) -> Floats:
    """r_j - R = e cos(lambda - 2 pi j / N), (N,) float [mm].

    >>> tooth_radii(Cutter(10.0, 2, 0.0, 20.0, 30.0, 6e5, runout=(0.01, 0.0))).round(6).tolist()
    [0.01, -0.01]
    """
    offset, direction = cutter.runout
    j = np.arange(cutter.flutes)
    return np.asarray(offset * np.cos(direction - math.tau * j / cutter.flutes))


def bites_of_arcs(
    phi_in: ArrayLike,
    phi_out: ArrayLike,
    feed_per_tooth: ArrayLike,
    cutter: Cutter,
    axial_depth: float,
    *,
    count: ArrayLike | None = None,
    clockwise: bool = True,
) -> Bites:
    """Bites of a straight flank whose engaged arcs are the same over the whole depth.

    Parameters
    ----------
    phi_in, phi_out : (n,) or (n, k) float [rad], ends of the disjoint engaged arcs, 0 <= phi_in <= phi_out <= pi,
        counted CLOCKWISE from n = Rot(+90 deg) T, as :mod:`chipload.engagement.contact` gives them
    feed_per_tooth : () or (n,) float [mm], >= 0; at 0 nothing is cut
    cutter : a straight flank: no corner radius, no taper, a flat bottom
    axial_depth : [mm], above 0, at most the flute length
    count : (n,) int, how many of the k arcs of each step hold; None: all k (an arc of no length cuts nothing)
    clockwise : sense of the spindle seen from above (M3); False mirrors: phi is then counted the other way

    Raises
    ------
    InputError
        A number is out of range, shapes disagree, or the cutter has no straight flank.

    Examples
    --------
    >>> mill = Cutter(10.0, 4, 0.5, 20.0, 30.0, 6e5)
    >>> bites_of_arcs([0.0], [1.0], 0.05, mill, 5.0).rows.tolist()
    [[0.0, 1.0, 0.0, 5.0, 0.05, 0.0]]
    """
    _check_cutter(cutter, axial_depth)
    a = np.asarray(phi_in, dtype=np.float64)
    b = np.asarray(phi_out, dtype=np.float64)
    if a.shape != b.shape or a.ndim not in (1, 2):
        raise InputError(f"phi_in {a.shape} and phi_out {b.shape}: must have one shape, (n,) or (n, k)")
    n = len(a)
    a = a.reshape(n, -1)
    b = b.reshape(n, -1)
    feed = np.broadcast_to(np.asarray(feed_per_tooth, dtype=np.float64), (n,))
    if not ((feed >= 0.0) & np.isfinite(feed)).all():
        i = int(np.flatnonzero(~((feed >= 0.0) & np.isfinite(feed)))[0])
        raise InputError(f"feed_per_tooth[{i}] = {feed[i]:g} mm: must be at least 0")
    number = np.full(n, a.shape[1]) if count is None else np.asarray(count, dtype=np.int64)
    if number.shape != (n,) or ((number < 0) | (number > a.shape[1])).any():
        raise InputError(f"count: must be ({n},) integers from 0 to {a.shape[1]}, the number of arcs kept a step")
    real = np.arange(a.shape[1]) < number[:, None]
    if not np.all(((a >= -_SLACK) & (a <= b) & (b <= math.pi + _SLACK))[real]):
        i, k = np.argwhere(~((a >= -_SLACK) & (a <= b) & (b <= math.pi + _SLACK)) & real)[0]
        raise InputError(f"arc {k} of step {i}: {a[i, k]:g} to {b[i, k]:g} rad: must rise within 0 to pi")
    low, high = (a, b) if clockwise else (math.pi - b, math.pi - a)
    low = np.clip(low, 0.0, math.pi)
    high = np.clip(high, 0.0, math.pi)
    real = real & (high > low) & (feed > 0.0)[:, None]
    step, arc = np.nonzero(real)
    ends = np.ascontiguousarray(np.column_stack([low[step, arc], high[step, arc]]))
    radii = tooth_radii(cutter)
    if cutter.runout[0] == 0.0:
        full = np.full(len(step), axial_depth)
        rows = np.column_stack([ends, 0.0 * full, full, feed[step], 0.0 * full])
        tooth = np.full(len(step), -1)
        owner = step
    else:
        sizes = np.zeros(len(step), dtype=np.int64)
        none = np.empty((0, 6))
        _kernels.runout_bites(ends, feed[step], radii, axial_depth, sizes, none, np.empty(0, np.int64), False)
        rows = np.empty((int(sizes.sum()), 6))
        tooth = np.empty(len(rows), dtype=np.int64)
        owner = np.repeat(step, sizes)
        _kernels.runout_bites(ends, feed[step], radii, axial_depth, sizes, rows, tooth, True)
    start = np.concatenate([[0], np.cumsum(np.bincount(owner, minlength=n))])
    return Bites(start, rows, tooth)


def _check_cutter(cutter: Cutter, axial_depth: float) -> None:
    """Refuse what a straight flank does not cover."""
    for key, value in (("corner_radius_mm", cutter.corner_radius), ("taper", cutter.taper), ("bottom", cutter.bottom)):
        if value != 0.0:
            raise InputError(
                f"cutter.{key} = {value:g}: forces are known for a straight flank only; choose a flat end mill"
            )
    if not 0.0 < axial_depth <= cutter.flute_length:
        raise InputError(
            f"axial_depth_mm = {axial_depth:g}: must be above 0 and at most cutter.flute_length_mm = "
            f"{cutter.flute_length:g}"
        )
