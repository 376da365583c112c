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
from chipload.cutter.slices import Slices
from chipload.cutting.band import mean_band, peak_band
from chipload.cutting.force import forces_over_turn, in_work, mean_forces
from chipload.cutting.material import Material
from chipload.cutting.revolution import first_greatest
from chipload.engagement.chips.move import Move
from chipload.engagement.immersion.immersion import Section, engagement_rows, tool_frame
from chipload.engagement.tooth_engagement import ToothEngagement
from chipload.engagement.tooth_surfaces import chips_of_teeth
from chipload.errors import InputError
from chipload.lazy import LateModule
from chipload.simulation.steps import Steps

chips = LateModule("chipload.engagement.chips._section")

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
#: the front is at least so many tolerances ahead of the one that the step before left
AHEAD = 20.0
#: an engagement range ends where h = 0 if h is at most this share of its greatest
GRAZES = 1e-6
#: a mean normal shorter than this stands for surfaces that face each other
ONE_SIDE = 0.5


@dataclass(frozen=True, eq=False)
class StepEngagement:
    """Tooth engagement of one step."""

    step: int
    frame: Floats
    rows: Floats
    owner: NDArray[np.int64]


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


def engagement_of_step(
    steps: Steps, k: int, move: Move, cutter: Cutter, profile: Slices, section: Section, tolerance: float
) -> StepEngagement:
    """Return the tooth engagement at the middle of a step.

    The front that the step before it left is half a step behind, and its edges are known to ``tolerance`` [mm] only.
    Where half a step is less than :data:`AHEAD` of those, contact is judged for the cutter moved on along its feed by
    what lacks: along walls that run with the feed that changes nothing, and the front is found whatever the step.
    """
    if steps.spindle[k] == 0.0:
        raise InputError(f"line {steps.line[k]}: cuts with the spindle at rest: start it (M3 S) before the cut")
    S = np.empty(27)
    chips.state(move.tip, move.axis, 0.5, S)
    tip, axis, speed, swing = S[:3], S[3:6], S[6:9], S[9:12]
    tooth = math.tau / (cutter.flutes * abs(float(steps.spindle[k]))) / float(steps.seconds[k])
    (a, b, c), (x, y, z) = axis.tolist(), swing.tolist()
    turn = np.array([b * z - c * y, c * x - a * z, a * y - b * x])
    middle = speed + 0.5 * cutter.flute_length * swing
    frame = tool_frame(axis, speed if speed.any() else middle, bool(steps.spindle[k] > 0.0))
    travel = float(np.linalg.norm(speed))
    ahead = max(AHEAD * tolerance / travel - 0.5, 0.0) if travel > 0.0 else 0.0
    rows, owner = engagement_rows(tip + ahead * speed, frame, speed * tooth, turn * tooth, profile, section)
    return StepEngagement(k, frame, rows, owner)


def engagement_of_steps(cuts: list[StepEngagement], profile: Slices) -> ToothEngagement:
    """Return the tooth engagement of some steps of one cutter, without its runout."""
    start = np.cumsum([0, *(len(c.rows) for c in cuts)])
    rows, owner = np.concatenate([c.rows for c in cuts]), np.concatenate([c.owner for c in cuts])
    frame = np.array([c.frame for c in cuts])
    owner, table = _with_parts(rows, owner, profile)
    return ToothEngagement(start, rows, np.full(len(rows), -1), owner, table, frame)


def _with_parts(rows: Floats, owner: Ints, profile: Slices) -> tuple[Ints, Floats]:
    """Return slices of the engaged edge, and the columns of the profile followed by those of parts of its arcs.

    An engagement range that ends within a slice of an arc has the radius and the normal of its own middle, not those of
    the slice: in a shallow cut by a ball nose the uppermost slice has much of the torque.
    """
    s, part = rows[:, 2:4], profile.radius[owner] > 0.0
    part &= (s[:, 0] != profile.s_from[owner]) | (s[:, 1] != profile.s_to[owner])
    if not part.any():
        return owner, profile.columns
    keys, which = np.unique(np.column_stack([owner[part], s[part]]), axis=0, return_inverse=True)
    of = keys[:, 0].astype(np.int64)
    middle, r = 0.5 * (profile.s_from[of] + profile.s_to[of]), profile.radius[of]
    kappa = np.arctan2(profile.sin_kappa[of], profile.cos_kappa[of])
    own = kappa + (0.5 * (keys[:, 1] + keys[:, 2]) - middle) / r
    z = profile.z_middle[of] + r * (profile.cos_kappa[of] - np.cos(kappa + (keys[:, 1] - middle) / r))
    rho = profile.rho[of] + r * (np.sin(own) - profile.sin_kappa[of])
    lead = profile.rate[of] / profile.sin_kappa[of]
    z = np.maximum(z, 0.0)
    parts = np.column_stack([keys[:, 1], rho, z, np.sin(own), np.cos(own), lead * z, lead * np.sin(own)])
    out = owner.copy()
    out[part] = len(profile) + which.ravel()
    return out, np.vstack([profile.columns, parts])


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


def loads_of_steps(
    front: ToothEngagement,
    engagement: ToothEngagement,
    cuts: list[StepEngagement],
    cutter: Cutter,
    material: Material,
    turn: OverTurn,
    spindle: Floats,
    seconds: Floats,
) -> Floats:
    """Return loads (c, len(LOADS)) of steps that take ``seconds`` (c,), from :func:`over_turn`; ``engagement`` has the
    chips of ``front``.
    """
    force, torque, _ = turn
    mean, torque_mean = mean_forces(engagement, cutter, material)
    turned = in_work(force, engagement.frames)
    left = _normals_left(engagement, cuts)
    volume, work = engaged_work(front, cutter, material, np.abs(spindle) * seconds)
    return np.column_stack(
        [
            in_work(mean, engagement.frames),
            turned.max(axis=1),
            turned.min(axis=1),
            np.linalg.norm(force, axis=2).max(axis=1),
            torque_mean / 1000.0,
            torque.max(axis=1) / 1000.0,
            torque_mean * np.abs(spindle) / 1000.0,
            engagement.chip_max(),
            -np.einsum("nmi,ni->nm", turned, left).min(axis=1).clip(None, 0.0),
            volume,
            work / 1000.0,
        ]
    )


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


def _normals_left(engagement: ToothEngagement, cuts: list[StepEngagement]) -> Floats:
    """(c, 3) outward normal of the cutter, in the work frame, where it leaves a surface behind: nu averaged over the
    ends of engagement at which h = 0, by their length along the profile; 0 where no surface or two that face each
    other are left.
    """
    rows, owner = np.concatenate([c.rows for c in cuts]), np.concatenate([c.owner for c in cuts])
    of = np.repeat(np.arange(len(cuts)), [len(c.rows) for c in cuts])
    p, q, a, b, along, offset, across = rows.T
    sk, ck = engagement.slices[owner, 3], engagement.slices[owner, 4]
    total, whole = np.zeros((len(cuts), 3)), np.zeros(len(cuts))
    for phi in (p, q):
        h = along * np.sin(phi) + across * np.cos(phi) + offset
        made = np.where(np.abs(h) <= GRAZES * (np.hypot(along, across) + np.abs(offset)), b - a, 0.0)
        for i, nu in enumerate((sk * np.sin(phi), sk * np.cos(phi), -ck)):
            total[:, i] += np.bincount(of, made * nu, len(cuts))
        whole += np.bincount(of, made, len(cuts))
    size = np.linalg.norm(total, axis=1)
    one = (size > ONE_SIDE * whole) & (whole > 0.0)
    turned = np.einsum("ni,nij->nj", total, np.array([c.frame for c in cuts]))
    return np.asarray(np.where(one[:, None], turned / np.where(one, size, 1.0)[:, None], 0.0))
