"""Tooth engagement: the immersion, the part of the edge and the chip thickness of each cut of a tooth.

It is the interface between engagement and force.

Notation: A the cutter's axis from the tip to the holder; T unit direction normal to A, that of the feed where the feed
is normal to the axis; n = Rot(+90 deg about A) T, mirrored where the spindle runs counter-clockwise; phi [rad]
immersion, counted in the sense of the spindle from n, so that pi/2 is T (up milling 0 .. a, down milling pi - a .. pi);
u = cos(phi) n + sin(phi) T the radial direction; s [mm] along the cutter's profile and kappa the angle of its outward
normal nu = sin(kappa) u - cos(kappa) A with the downward axis, as in :mod:`chipload.cutter.slices`; f_z [mm] feed per
tooth; N teeth; j tooth, each its pitch p_j behind the one before it, 2 pi / N where all are alike, and so a_j behind
tooth 0; (e, lambda) runout, lambda counted from tooth 0 towards tooth 1; h [mm] chip thickness along nu.

An engagement range is a range of immersion and of the profile in which h = along sin(phi) + across cos(phi) + offset,
at least 0. A motion f a tooth of the point on the edge gives along = sin(kappa) f.T, across = sin(kappa) f.n and
offset = -cos(kappa) f.A: a plunge is an offset on the bottom.

The front is the part of the cutter that the feed moves into the stock, with h = f_z sin(phi) for every tooth: what the
methods that find the engagement give. :func:`chipload.engagement.tooth_surfaces.chips_of_teeth` makes of it the chips
between the true paths of the teeth, with runout and uneven pitch; the angle of a tooth behind an evenly spaced one is
added there to the lag of its slices.

Reference: [Altintas2012] ch. 2 for h = f_z sin(phi).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipload.cutter.cutter import Cutter
from chipload.cutter.slices import edge_lag
from chipload.errors import InputError

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

#: how far beyond its range an end of an arc or of an engagement range may lie [rad]; rounding, not a setting
_SLACK = 1e-6


@dataclass(frozen=True, eq=False)
class ToothEngagement:
    """Tooth engagement of n steps, sorted by step.

    Parameters
    ----------
    start : (n + 1,) int; the engagement ranges of step i are the rows start[i] .. start[i + 1] - 1
    rows : (b, 7) float: phi from, phi to [rad; 0 <= from <= 2 pi, from <= to <= from + 2 pi], s from, s to [mm], along,
        offset, across [mm]; those of one tooth at one place of the profile are disjoint; h >= 0 in each
    tooth : (b,) int; which tooth; -1: every tooth
    slice : (b,) int; the row of ``slices`` in which the engagement range's s lies
    slices : (k, 7) float: s from [mm], rho [mm], z at s from [mm], sin(kappa), cos(kappa), lag at s from [rad], rate of
        the lag [rad/mm]; ``Slices.columns``. Or (k, 13), where borders run along the edge: rates at the beginning
        and at the end of the range of the front [rad/mm], s at which it is stated, that range, from and width [rad],
        and 1 where the chip runs with the border; a border between them runs with a rate between theirs
    frame : (n, 3, 3) float: rows T, n, A in the frame of the work; None: not needed
    """

    start: Ints
    rows: Floats
    tooth: Ints
    slice: Ints
    slices: Floats
    frame: Floats | None = None

    def __post_init__(self) -> None:
        start = np.ascontiguousarray(self.start, dtype=np.int64)
        rows = np.ascontiguousarray(self.rows, dtype=np.float64)
        tooth = np.ascontiguousarray(self.tooth, dtype=np.int64)
        piece = np.ascontiguousarray(self.slice, dtype=np.int64)
        slices = np.ascontiguousarray(self.slices, dtype=np.float64)
        if rows.ndim != 2 or rows.shape[1] != 7 or not np.isfinite(rows).all():
            raise InputError(f"tooth engagement: rows of shape {rows.shape}: need (b, 7) finite numbers")
        if slices.ndim != 2 or slices.shape[1] not in (7, 13) or not np.isfinite(slices).all():
            raise InputError(f"tooth engagement: slices of shape {slices.shape}: need (k, 7) finite numbers")
        if len(tooth) != len(rows) or start[0] != 0 or start[-1] != len(rows) or (np.diff(start) < 0).any():
            raise InputError(
                f"tooth engagement: {len(rows)} rows, {len(tooth)} teeth, start up to {start[-1]}: must agree"
            )
        if piece.shape != (len(rows),) or not ((piece >= 0) & (piece < len(slices))).all():
            raise InputError(
                f"tooth engagement: slice of shape {piece.shape}: need ({len(rows)},) from 0 to {len(slices) - 1}"
            )
        bad = np.flatnonzero(~(slices[:, [1, 5, 6]] >= 0.0).all(axis=1))
        if len(bad):
            rho, lag, rate = slices[bad[0], [1, 5, 6]]
            raise InputError(
                f"tooth engagement: slice {bad[0]}: rho = {rho:g}, lag = {lag:g}, rate = {rate:g}: must be at least 0"
            )
        low, turn, high = rows[:, 0], rows[:, 1] - rows[:, 0], math.tau + _SLACK
        bad = np.flatnonzero(~((low >= 0.0) & (low <= math.tau) & (turn >= 0.0) & (turn <= high)))
        if len(bad):
            ends = f"{rows[bad[0], 0]:g} to {rows[bad[0], 1]:g} rad"
            raise InputError(
                f"tooth engagement: row {bad[0]}: {ends}: must begin within 0 to 2 pi and rise by at most 2 pi"
            )
        bad = np.flatnonzero(~(rows[:, 2] <= rows[:, 3]))
        if len(bad):
            ends = f"s from {rows[bad[0], 2]:g} to {rows[bad[0], 3]:g} mm"
            raise InputError(f"tooth engagement: row {bad[0]}: {ends}: must rise")
        checked = {"start": start, "rows": rows, "tooth": tooth, "slice": piece, "slices": slices}
        if self.frame is not None:
            frame = np.ascontiguousarray(self.frame, dtype=np.float64)
            if frame.shape != (len(start) - 1, 3, 3) or not np.isfinite(frame).all():
                raise InputError(
                    f"tooth engagement: frame of shape {frame.shape}: need ({len(start) - 1}, 3, 3) finite numbers"
                )
            checked["frame"] = frame
        for name, value in checked.items():
            value.setflags(write=False)
            object.__setattr__(self, name, value)

    def __len__(self) -> int:
        return len(self.start) - 1

    @property
    def frames(self) -> Floats:
        """The array ``frame``; refused if it is None.

        Raises
        ------
        InputError
            There is none.
        """
        if self.frame is None:
            raise InputError("tooth engagement: has no frame: needs the rows T, n and A (n, 3, 3) of each step")
        return self.frame

    def part(self, kept: Ints) -> ToothEngagement:
        """Return the steps ``kept``, rising numbers: part of what was validated, and not validated again."""
        count = np.diff(self.start)[kept]
        start = np.concatenate([[0], np.cumsum(count)])
        row = np.arange(start[-1]) - np.repeat(start[:-1], count) + np.repeat(self.start[kept], count)
        frame = None if self.frame is None else self.frame[kept]
        out = object.__new__(ToothEngagement)
        columns = (start, self.rows[row], self.tooth[row], self.slice[row], self.slices, frame)
        for field, value in zip(fields(self), columns, strict=True):
            if value is not None:
                value.setflags(write=False)
            object.__setattr__(out, field.name, value)
        return out

    def chip_max(self) -> Floats:
        """Return the greatest chip thickness (n,) [mm] of each step; 0 where nothing is cut."""
        low, high, _, _, along, offset, across = self.rows.T
        peak = np.arctan2(along, across)
        peak = peak + math.tau * np.ceil((low - peak) / math.tau)
        ends = np.maximum(along * np.sin(low) + across * np.cos(low), along * np.sin(high) + across * np.cos(high))
        h = np.where(peak <= high, np.hypot(along, across), ends) + offset
        out = np.zeros(len(self))
        np.maximum.at(out, np.repeat(np.arange(len(self)), np.diff(self.start)), h)
        return out


def engagement_of_arcs(
    phi_in: ArrayLike,
    phi_out: ArrayLike,
    feed_per_tooth: ArrayLike,
    cutter: Cutter,
    axial_depth: float,
    *,
    count: ArrayLike | None = None,
    clockwise: bool = True,
) -> ToothEngagement:
    """Return the tooth engagement of a straight flank with the same engaged arcs over the whole depth.

    Parameters
    ----------
    phi_in, phi_out : (n,) or (n, k) float [rad], ends of the disjoint engaged arcs, 0 <= phi_in <= phi_out <= pi,
        counted CLOCKWISE from n = Rot(+90 deg) T, as :mod:`chipload.engagement.contact` gives them
    feed_per_tooth : () or (n,) float [mm], >= 0; at 0 nothing is cut
    cutter : a straight flank: no corner radius, no taper, a flat bottom
    axial_depth : [mm], above 0, at most the flute length
    count : (n,) int, number of valid arcs of each step; None: all k (an arc of no length cuts nothing)
    clockwise : sense of the spindle seen from above (M3); False mirrors: phi is then counted the other way

    Returns
    -------
    ToothEngagement
        The front, of one slice, the flank, on which s is the height above the tip; without frames.

    Raises
    ------
    InputError
        A number is out of range, shapes disagree, or the cutter has no straight flank.

    Examples
    --------
    >>> mill = Cutter(10.0, 4, 0.5, 20.0, 30.0, 6e5)
    >>> engagement_of_arcs([0.0], [1.0], 0.05, mill, 5.0).rows.tolist()
    [[0.0, 1.0, 0.0, 5.0, 0.05, 0.0, 0.0]]
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
    full = np.full(len(step), axial_depth)
    none = 0.0 * full
    rows = np.column_stack([low[step, arc], high[step, arc], none, full, feed[step], none, none])
    start = np.concatenate([[0], np.cumsum(np.bincount(step, minlength=n))])
    flank = np.array([[0.0, cutter.radius, 0.0, 1.0, 0.0, 0.0, edge_lag(cutter)]])
    zero = np.zeros(len(step), dtype=np.int64)
    return ToothEngagement(start, rows, zero - 1, zero, flank)


def _check_cutter(cutter: Cutter, axial_depth: float) -> None:
    """Refuse a cutter whose flank is not straight."""
    round_ = (("corner_radius_mm", cutter.corner_radius), ("barrel_radius_mm", cutter.barrel_radius or 0.0))
    for key, value in (*round_, ("taper", cutter.taper), ("bottom", cutter.bottom)):
        if value != 0.0:
            raise InputError(
                f"cutter.{key} = {value:g}: forces are known for a straight flank only; choose a flat end mill"
            )
    if not 0.0 < axial_depth <= cutter.flute_length:
        raise InputError(
            f"axial_depth_mm = {axial_depth:g}: must be above 0 and at most cutter.flute_length_mm = "
            f"{cutter.flute_length:g}"
        )


def tool_frame(axis: ArrayLike, toward: ArrayLike, clockwise: bool = True) -> Floats:
    """Return the tool frame (3, 3), rows T, n, A: T the direction ``toward`` (3,) across the unit axis (3,), n left of
    it (right if the spindle turns counter-clockwise). Where ``toward`` is parallel to the axis, T is any direction
    across it.

    >>> tool_frame([0, 0, 1], [3, 0, 4]).tolist()
    [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
    """
    ax, ay, az = np.asarray(axis, dtype=np.float64).tolist()
    vx, vy, vz = np.asarray(toward, dtype=np.float64).tolist()
    along = vx * ax + vy * ay + vz * az
    tx, ty, tz = vx - along * ax, vy - along * ay, vz - along * az
    size = math.sqrt(tx * tx + ty * ty + tz * tz)
    if size <= 1e-12 * math.sqrt(vx * vx + vy * vy + vz * vz) or size == 0.0:
        least = int(np.argmin(np.abs([ax, ay, az])))
        tx, ty, tz = (float(i == least) - (ax, ay, az)[least] * a for i, a in enumerate((ax, ay, az)))
        size = math.sqrt(tx * tx + ty * ty + tz * tz)
    tx, ty, tz = tx / size, ty / size, tz / size
    hand = 1.0 if clockwise else -1.0
    n = [hand * (ay * tz - az * ty), hand * (az * tx - ax * tz), hand * (ax * ty - ay * tx)]
    return np.array([[tx, ty, tz], n, [ax, ay, az]]) + 0.0
