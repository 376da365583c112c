"""Tooth engagement in the middle of a step, and the loads over a revolution.

Notation: t in 0..1 within a step; T, n, A the frame of the cutter, nu the outward normal of its surface, phi immersion
as in :mod:`chipload.engagement.tooth_engagement`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from chipload.cutter.cutter import Cutter
from chipload.cutting.band import mean_band, peak_band
from chipload.cutting.force import forces_over_turn, mean_forces
from chipload.cutting.material import Material
from chipload.cutting.revolution import first_greatest
from chipload.engagement.tooth_engagement import ToothEngagement
from chipload.engagement.tooth_surfaces import chips_of_teeth

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

#: force (n, m, 3) [N] along T, n and the axis, torque (n, m) [N mm], rotations (m,) [rad]
OverTurn = tuple[Floats, Floats, Floats]

#: columns of loads, in their order
LOADS = (
    *(f"force_{x}_mean_n" for x in "xyz"),
    *(f"force_{x}_max_n" for x in "xyz"),
    *(f"force_{x}_min_n" for x in "xyz"),
    "force_n",
    "torque_mean_nm",
    "torque_nm",
    "power_w",
    "chip_max_mm",
    "force_normal_n",
    "engaged_volume_mm3",
    "cutting_work_j",
)
#: columns of how sure they are, one standard deviation; where the material says how sure its coefficients are
BANDS = ("force_sd_n", "torque_sd_nm", "torque_mean_sd_nm", "power_sd_w")
#: column of how far the mean torque over a revolution rises within a step above that of the step, relative
TORQUE_RISE = "torque_rise"
#: an engagement range ends where h = 0 if h is at most this share of its greatest
GRAZES = 1e-6
#: a mean normal shorter than this stands for surfaces that face each other
ONE_SIDE = 0.5


@dataclass(frozen=True, eq=False)
class Cuts:
    """Tooth engagement of one cutter, step by step.

    Parameters
    ----------
    tool : its number in the program
    cutter : its numbers
    step : (c,) int, the steps that cut, rows of ``Removal.columns``
    ends : (c, 12) float, tip at the start and the end [mm], axis at the start and the end
    engagement : of those steps, in the middle of each, with frames
    plain : the same without runout
    spindle : (c,) float [rad/s], signed
    """

    tool: int
    cutter: Cutter
    step: NDArray[np.int64]
    ends: Floats
    engagement: ToothEngagement
    plain: ToothEngagement
    spindle: Floats

    def __len__(self) -> int:
        return len(self.step)


def join_cuts(cuts: list[Cuts]) -> Cuts:
    """Return consecutive cuts of one cutter joined to one."""
    columns = (np.concatenate([getattr(c, name) for c in cuts]) for name in ("step", "ends", "spindle"))
    step, ends, spindle = columns
    engagement = _join_engagement([c.engagement for c in cuts])
    plain = engagement if all(c.plain is c.engagement for c in cuts) else _join_engagement([c.plain for c in cuts])
    return Cuts(cuts[0].tool, cuts[0].cutter, step, ends, engagement, plain, spindle)


def part_of_cuts(cuts: Cuts, first: int, end: int) -> Cuts:
    """Return the tooth engagement of the steps ``first`` to before ``end`` of those that cut."""
    kept = np.arange(first, end)
    plain = cuts.plain.part(kept)
    engagement = plain if cuts.engagement is cuts.plain else cuts.engagement.part(kept)
    return replace(
        cuts, step=cuts.step[first:end], ends=cuts.ends[first:end], engagement=engagement, plain=plain,
        spindle=cuts.spindle[first:end],
    )  # fmt: skip


def _join_engagement(parts: list[ToothEngagement]) -> ToothEngagement:
    start = np.concatenate([[0], np.cumsum(np.concatenate([np.diff(b.start) for b in parts]))])
    rows, tooth = (np.concatenate([getattr(b, name) for b in parts]) for name in ("rows", "tooth"))
    frame = np.concatenate([b.frames for b in parts])
    if all(b.slices is parts[0].slices or np.array_equal(b.slices, parts[0].slices) for b in parts):
        return ToothEngagement(start, rows, tooth, np.concatenate([b.slice for b in parts]), parts[0].slices, frame)
    # each has slices of its own
    before = np.cumsum([0, *(len(b.slices) for b in parts)])
    piece = np.concatenate([b.slice + n for b, n in zip(parts, before, strict=False)])
    return ToothEngagement(start, rows, tooth, piece, np.concatenate([b.slices for b in parts]), frame)


def at_feeds(cuts: Cuts, factor: Floats) -> Cuts:
    """Return the tooth engagement at other feeds.

    The place of a cut does not depend on the feed. The chip thickness without runout is proportional to it; the part
    that runout adds does not depend on it.

    Parameters
    ----------
    factor : (c,) float, above 0, the feed of each step over the one that it has
    """
    old = cuts.plain
    rows = old.rows.copy()
    rows[:, 4:] *= np.repeat(factor, np.diff(old.start))[:, None]
    plain = ToothEngagement(old.start, rows, old.tooth, old.slice, old.slices, old.frame)
    return replace(cuts, engagement=chips_of_teeth(plain, cuts.cutter), plain=plain)


def greatest_loads(cuts: Cuts, material: Material, rotation: float, bands: bool = False) -> dict[str, Floats]:
    """Return the columns (c,) of :data:`LOADS` that limits bound; with ``bands`` those of :data:`BANDS` too.

    They are greatest force and axial force [N], greatest and mean torque [N m], mean power [W] and thickest chip [mm].
    """
    turn = over_turn(cuts.engagement, cuts.cutter, material, rotation)
    force, torque, _ = turn
    sure = bands_of_steps(cuts.engagement, cuts.cutter, material, turn, cuts.spindle) if bands else {}
    _, mean = mean_forces(cuts.engagement, cuts.cutter, material)
    return {
        "force_n": np.linalg.norm(force, axis=2).max(axis=1),
        "force_axial_n": np.abs(force[:, :, 2]).max(axis=1),
        "torque_nm": torque.max(axis=1) / 1000.0,
        "torque_mean_nm": mean / 1000.0,
        "power_w": mean * np.abs(cuts.spindle) / 1000.0,
        "chip_max_mm": cuts.engagement.chip_max(),
        **sure,
    }


def bands_of_steps(
    engagement: ToothEngagement, cutter: Cutter, material: Material, turn: OverTurn, spindle: Floats
) -> dict[str, Floats]:
    """Columns (c,) of :data:`BANDS` from :func:`over_turn` of the steps: standard deviation of greatest force [N],
    greatest and mean torque [N m] and power [W] by that of the coefficients; none where the material does not say it.
    """
    if not material.has_band:
        return {}
    force, torque, theta = turn
    at_force, at_torque = theta[first_greatest(np.linalg.norm(force, axis=2))], theta[first_greatest(torque)]
    force_sd, torque_sd = peak_band(engagement, cutter, material, at_force, at_torque)
    mean_sd = mean_band(engagement, cutter, material)[1]
    values = (force_sd, torque_sd / 1000.0, mean_sd / 1000.0, mean_sd * np.abs(spindle) / 1000.0)
    return dict(zip(BANDS, values, strict=True))


def over_turn(engagement: ToothEngagement, cutter: Cutter, material: Material, rotation: float) -> OverTurn:
    """Return force and torque at rotations at most ``rotation`` apart, and these rotations [rad]."""
    pitch = math.tau / cutter.flutes if cutter.teeth_alike else math.tau
    count = max(math.ceil(pitch / rotation), 8)
    theta = np.asarray(np.arange(count) * (pitch / count), dtype=np.float64)
    return *forces_over_turn(engagement, cutter, material, theta), theta


def engaged_work(
    engagement: ToothEngagement, cutter: Cutter, material: Material, turned: Floats
) -> tuple[Floats, Floats]:
    """(c,) volume [mm^3] that the engaged front sweeps while the spindle turns by ``turned`` (c,) [rad], and (c,) work
    [N mm] of the torque without the edge coefficients.

    With h the thickness used, rho the distance from the axis and N teeth they are N / (2 pi) times ``turned`` times the
    integrals over phi and s of rho h and of rho Ktc h^(1 - m): the work is Ktc times the volume where m = 0, and where
    the material has a size effect the quotient is the mean of Ktc h^(-m) over the volume. The front moves on by what is
    removed; chips between the paths of the teeth are this volume to first order, and cost as much.
    """
    plain = replace(material, Kte=0.0, Kre=0.0, Kae=0.0, covariance=None)
    work = mean_forces(engagement, cutter, plain)[1] * turned
    if material.exponents[0] == 0.0:
        return work / material.Ktc, work
    return mean_forces(engagement, cutter, replace(plain, exponents=(0.0, 0.0, 0.0)))[1] * turned / material.Ktc, work
