"""Deflection of tool and work in every step, and the form error of the surface that results.

Notation: q point of the wanted surface, n its unit normal out of the part; p, A tip and axis of the cutter, T, n_c, A
its frame; s length along its profile, phi immersion, theta rotation of tooth 0, lag(s) of its edge, engagement ranges
as in :mod:`chipload.engagement.tooth_engagement`; F [N] force ON THE CUTTER, that on the work is -F; C (3, 3) [mm/N]
compliance of the
work at q, C_nn = n . C n; C_b(z', z) that of the bars of cutter, holder and spindle.

The rigid cutter passes q at a distance d_k in step k, least at a moment when the normal of its surface at the foot of q
does not move: there its edge makes the surface. Tooth j is there at theta = phi + lag(s) + 2 pi j / N. What all teeth
cut at that rotation bends both, and they part along n by

    e_k = n . C F + n . (T, n_c) integral over the edges of C_b(z', z) dF(z'),

positive where the cutter is pushed away. The surface is what the deflected cutter leaves:

    left(q) = min over k and j of d_k + e_k - r_j sin(kappa),

r_j what tooth j stands out by where its edge passes q, over the steps at which q lies at the end of an engagement range
of the front (over all where there are none): the moment that makes q counts, not the greatest force, nor a tooth that
has just left its engagement range and would spring back. d of that step is what a rigid cutter leaves there (cusps, and
stock where the program leaves any). Steps that do not cut count as absent: what they would take again after a
deflection is not known.

Without helix a tooth leaves all of its engagement range at once: the moment just before counts, as in
:mod:`chipload.cutting.wall_error`.

The load is that of the rigid model in the middle of the step: deflection does not reduce the chip thickness. The work
deflects at q under the whole force as if it acted there. The cutter is stiff along its axis, and q lies on the envelope
of the feed: marks of single teeth along the feed are not calculated.

Reference: [Uddin2007] and [Altintas2012] ch. 2 for the wall of an end mill, which this repeats for any cutter and
surface.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipload.cutter.cutter import Cutter
from chipload.cutting.levers import greatest_height, has_lever_loads, lever_loads, lever_loads_in_blocks
from chipload.cutting.material import Material
from chipload.engagement.tooth_surfaces import tooth_radii
from chipload.errors import InputError
from chipload.lazy import LateModule
from chipload.progress import Progress, silent
from chipload.simulation.loads import GRAZES, ONE_SIDE, Cuts
from chipload.simulation.removal import Removal
from chipload.structure.spindle import Bar, tip_compliance

_form_error = LateModule("chipload.simulation._form_error")

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]

#: cosine of the greatest angle between the surface and that of the cutter where it makes it: a cusp, not a corner
FACING = 0.5
#: how near to the end of an engagement range q must lie to be made by it, along its circle [mm]: slices of a corner
#: know no better
REACH = 0.2
#: points whose pairs with steps are held at once
CHUNK = 4096
#: the greatest force is sought between rotations at which it is at least 1 less this share of the greatest found, in so
#: many parts: at 2 deg it is up to 3 % too small, where an edge begins or leaves abruptly, then 0.4 %
MAY_RISE, FINER = 0.06, 16


@dataclass(frozen=True, eq=False)
class Contacts:
    """Contact of each cutting step with the surface that it leaves.

    Attributes
    ----------
    step : (c,) int, rows of the removal's columns
    point : (c, 3) float [mm], on the cutter in the middle of the step: mean of the ends of its engagement ranges at
    which h = 0 normal : (c, 3) float, unit, out of the surface that is left; 0 where it leaves two that face each other
    """

    step: Ints
    point: Floats
    normal: Floats


@dataclass(frozen=True, eq=False)
class FormError:
    """Form error of the points of a surface by deflection of cutter and workpiece.

    Attributes
    ----------
    step : (p,) int, the step that makes each point; -1: none comes near, the other columns are then 0
    rigid : (p,) float [mm], what the rigid cutter leaves there; below 0: it gouges
    cutter, work : (p,) float [mm], by how much each gives way along n at that moment
    force : (p,) float [N], F . n at that moment: it pushes work and cutter apart where above 0
    at_edge : (p,) bool, whether q lies at the end of an engagement range, as it should; False: it is touched again by
    a cutter that
        cuts elsewhere
    """

    step: Ints
    rigid: Floats
    cutter: Floats
    work: Floats
    force: Floats
    at_edge: Bools

    @property
    def made(self) -> Bools:
        """Points that some step makes."""
        return np.asarray(self.step >= 0)

    @property
    def error(self) -> Floats:
        """Form error by deflection [mm], positive where material is left."""
        return self.cutter + self.work

    @property
    def left(self) -> Floats:
        """Material left over the wanted surface [mm], cusps and all."""
        return self.rigid + self.error


@dataclass(frozen=True, eq=False)
class _Model:
    """The cuts of one cutter, with the parameters of the form error."""

    cuts: Cuts
    material: Material
    bars: Mapping[int, tuple[Bar, ...]] | None
    facing: float
    reach: float


def contacts(removal: Removal) -> Contacts:
    """Return the contact of each cutting step with the surface that it leaves.

    Raises
    ------
    InputError
        The removal was made without ``keep``.
    """
    parts = [(np.zeros(0, dtype=np.int64), np.zeros((0, 3)), np.zeros((0, 3)))]
    for cuts in _kept_cuts(removal):
        engagement = cuts.plain
        owner = np.repeat(np.arange(len(engagement)), np.diff(engagement.start))
        p, q, a, b, along, offset, across = engagement.rows.T
        s0, rho, z0, sk, ck = engagement.slices[engagement.slice, :5].T
        half = 0.5 * (a + b) - s0
        height, radius = z0 + sk * half, rho
        total, place, weight = np.zeros((len(engagement), 3)), np.zeros((len(engagement), 3)), np.zeros(len(engagement))
        frame = engagement.frames[owner]
        tip = 0.5 * (cuts.ends[owner, :3] + cuts.ends[owner, 3:6])
        for phi in (p, q):
            h = along * np.sin(phi) + across * np.cos(phi) + offset
            made = np.where(np.abs(h) <= GRAZES * (np.hypot(along, across) + np.abs(offset)), b - a, 0.0)
            u = np.column_stack([np.sin(phi), np.cos(phi), np.zeros(len(phi))])
            nu = np.column_stack([sk[:, None] * u[:, :2], -ck])
            at = radius[:, None] * u
            at[:, 2] = height
            np.add.at(total, owner, made[:, None] * np.einsum("bi,bij->bj", nu, frame))
            np.add.at(place, owner, made[:, None] * (tip + np.einsum("bi,bij->bj", at, frame)))
            np.add.at(weight, owner, made)
        size = np.linalg.norm(total, axis=1)
        one = size > ONE_SIDE * weight
        point = 0.5 * (cuts.ends[:, :3] + cuts.ends[:, 3:6])
        point[weight > 0.0] = place[weight > 0.0] / weight[weight > 0.0, None]
        normal = np.zeros((len(cuts), 3))
        normal[one] = -total[one] / size[one, None]
        parts.append((cuts.step, point, normal))
    step, point, normal = (np.concatenate([part[i] for part in parts]) for i in range(3))
    order = np.argsort(step, kind="stable")
    return Contacts(step[order], point[order], normal[order])


def step_deflections(
    removal: Removal,
    material: Material,
    place: Contacts,
    *,
    work: ArrayLike | None,
    bars: Mapping[int, tuple[Bar, ...]] | None,
    rotation: float = math.radians(2.0),
) -> dict[str, NDArray[Any]]:
    """Return the greatest deflection of work and cutter over a revolution for every step.

    Parameters
    ----------
    removal : made with ``keep``
    place : :func:`contacts` of it
    work : compliance at these places in the state of removal in which each is cut, (c,) [mm/N] normal or (c, 3, 3);
        None: rigid
    bars : by tool number, from the tip upwards; None: rigid
    rotation : between two evaluated rotations [rad]; near the greatest a sixteenth of it

    Returns
    -------
    columns, (n,) each, one row for each step of the removal, 0 where nothing is cut or two surfaces are left
        ``work_mm``, ``cutter_mm`` float: greatest motion of work and cutter along the normal by which they part;
        ``deflection_mm`` the greatest of their sum; ``force_normal_n`` the greatest force that does it.
    """
    stiff = _work(work, place.normal, "step_deflections")
    names = ("work_mm", "cutter_mm", "deflection_mm", "force_normal_n")
    out = {name: np.zeros(len(removal.columns["line"])) for name in names}
    for cuts in _kept_cuts(removal):
        at = np.searchsorted(place.step, cuts.step)
        if not (len(place.step) and (place.step[np.minimum(at, len(place.step) - 1)] == cuts.step).all()):
            raise InputError("step_deflections: the contacts are not those of this removal")
        pitch = math.tau / cuts.cutter.flutes if cuts.cutter.teeth_alike else math.tau
        count = max(math.ceil(pitch / rotation), 8)
        model = _Parting(cuts, place.point[at], place.normal[at], stiff[at], material, bars)
        number, theta = np.arange(len(cuts)), np.arange(count) * (pitch / count)
        values = model(np.repeat(number, count), np.tile(theta, len(cuts))).reshape(len(cuts), count, 4)
        most = values.max(axis=1)
        # between two rotations of which one is nearly the greatest, the force may rise further before an edge leaves
        near = ((values >= (1.0 - MAY_RISE) * most[:, None]) & (most[:, None] > 0.0)).any(axis=2)
        k, low = np.nonzero(near | np.roll(near, -1, axis=1))
        share = np.arange(1, FINER) / FINER
        finer = (theta[low][:, None] + share * (pitch / count)).ravel()
        np.maximum.at(most, np.repeat(k, FINER - 1), model(np.repeat(k, FINER - 1), finer))
        for name, column in zip(names, most.T, strict=True):
            out[name][cuts.step] = column.clip(0.0)
    return out


class _Parting:
    """How work and cutter part along the normals of the contacts of some steps, at any rotation."""

    def __init__(
        self, cuts: Cuts, point: Floats, normal: Floats, stiff: Floats, material: Material,
        bars: Mapping[int, tuple[Bar, ...]] | None,
    ) -> None:  # fmt: skip
        self.cuts, self.material, self.bars = cuts, material, bars
        frames = cuts.engagement.frames
        self.z = np.einsum("ci,ci->c", point - 0.5 * (cuts.ends[:, :3] + cuts.ends[:, 3:6]), frames[:, 2])
        # in the frames of the cutter, as the force is
        self.normal = np.einsum("cji,ci->cj", frames, normal)
        self.gives = np.einsum("cij,ckj,ck->ci", frames, stiff, normal)

    def __call__(self, k: Ints, theta: Floats) -> Floats:
        """Motion of the work and of the cutter, their sum [mm], and the force [N], (m, 4), of steps k at rotations."""
        moments = _bend_cutter(self.cuts, k, theta, self.z[k], self.material, self.bars)
        force, n = moments[:, :3], self.normal[k]
        bent = np.einsum("mi,mi->m", force, self.gives[k])
        pushed = np.einsum("mi,mi->m", moments[:, 3:], n[:, :2])
        return np.stack([bent, pushed, bent + pushed, np.einsum("mi,mi->m", force, n)], axis=1)


def tip_deflections(
    cuts: Cuts,
    material: Material,
    *,
    bars: tuple[Bar, ...],
    work: float | Floats | None = None,
    rotation: float = math.radians(2.0),
) -> dict[str, Floats]:
    """Return the greatest relative displacement of cutter tip and work over a revolution for some steps.

    With u the lateral motion of the tip under what all teeth cut and F the force on the cutter, the work with a
    compliance c in every direction goes -c F, and they part by u + c F.

    Parameters
    ----------
    cuts : of one cutter, as the watch of :func:`chipload.simulation.chips.remove` gets them
    bars : of cutter, holder and spindle, from the tip upwards
    work : c [mm/N]; (c, s, 3, 3): compliance of the work in the frame of the program at some places of each step, of
        which the one that moves farthest counts; None: the work counts as rigid
    rotation : between two evaluated rotations [rad]; without helix, where edges leave at once, a sixteenth of
        it. At 2 deg the greatest deflection was at most 0.3 % too small, that of a single step 1.4 %

    Returns
    -------
    columns, (c,) each
        ``deflection_cutter_um`` greatest size of u, with ``work`` also ``deflection_workpiece_um`` c times that of F,
        ``deflection_um`` greatest size of u + c F.
    """
    if isinstance(work, float) and not 0.0 <= work < math.inf:
        raise InputError(f"tip_deflections: work = {work:g} mm/N: a compliance must be at least 0")
    pitch = math.tau / cuts.cutter.flutes if cuts.cutter.teeth_alike else math.tau
    m = max(math.ceil(pitch / (rotation if cuts.cutter.helix > 0.0 else rotation / FINER)), 8)
    n = len(cuts)
    if has_lever_loads(cuts.engagement, cuts.cutter, material) and greatest_height(cuts.engagement) <= bars[0].length:
        # the teeth are all on the first bar
        levers = np.vstack([np.eye(4)[0], tip_compliance(bars)])
        if work is None:
            most = np.empty(n)
            for some, loads in lever_loads_in_blocks(cuts.engagement, cuts.cutter, material, m, levers):
                most[some] = 1e3 * np.hypot(loads[:, 6], loads[:, 7]).max(axis=1)
            return {"deflection_cutter_um": most, "deflection_um": most}
        loads = np.swapaxes(lever_loads(cuts.engagement, cuts.cutter, material, m, levers), 1, 2)
        force, bent = loads[..., [4, 5, 0]], loads[..., 6:]
    else:
        theta = np.arange(m) * (pitch / m)
        moments = _bend_cutter(
            cuts, np.repeat(np.arange(n), m), np.tile(theta, n), np.zeros(n * m), material, {cuts.tool: bars}
        ).reshape(n, m, 5)
        force, bent = moments[..., :3], moments[..., 3:]
    out = {"deflection_cutter_um": 1e3 * np.linalg.norm(bent, axis=2).max(axis=1)}
    if work is None:
        return out | {"deflection_um": out["deflection_cutter_um"]}
    if isinstance(work, float):
        apart = (work * force)[:, :, None]
    else:
        # in the frame of the cutter, as the force is
        frame = cuts.engagement.frames
        own = np.einsum("nia,nsab,njb->nsij", frame, work, frame)
        apart = np.einsum("nsij,nmj->nmsi", own, force)
    out["deflection_workpiece_um"] = 1e3 * np.linalg.norm(apart, axis=3).max(axis=(1, 2))
    apart[..., :2] += bent[:, :, None]
    return out | {"deflection_um": 1e3 * np.linalg.norm(apart, axis=3).max(axis=(1, 2))}


def form_error(
    removal: Removal | Sequence[Cuts],
    material: Material,
    points: ArrayLike,
    normals: ArrayLike,
    *,
    work: ArrayLike | None,
    bars: Mapping[int, tuple[Bar, ...]] | None,
    near: float,
    facing: float = FACING,
    reach: float = REACH,
    progress: Progress = silent,
) -> FormError:
    """Return the form error of the points of a surface.

    Parameters
    ----------
    removal : made with ``keep``, or some of its cuts; ``step`` of the answer counts as theirs does
    points, normals : (p, 3) float [mm] and unit, out of the part, in the frame of the program
    work : compliance of the work at the points in the state of removal in which they are made, (p,) [mm/N] normal or
        (p, 3, 3); None: rigid
    bars : of cutter, holder and spindle by tool number, from the tip upwards, e.g.
        :func:`chipload.structure.spindle.cutter_bars`; None: rigid
    near : a step that stays farther than this [mm] from a point does not make it
    facing : cosine of the greatest angle between the normals of surface and cutter
    reach : how near to the end of an engagement range a point must lie to be made by it [mm], see ``FormError.at_edge``

    Raises
    ------
    InputError
        The removal was made without ``keep``, shapes do not fit, a cutter has no bars, or they are shorter than it.

    Notes
    -----
    Every step that may win is looked at: those whose distance is within twice the greatest deflection of the least.
    """
    q, n = (np.ascontiguousarray(np.atleast_2d(np.asarray(v, dtype=np.float64))) for v in (points, normals))
    if q.ndim != 2 or q.shape[1] != 3 or n.shape != q.shape or not (np.isfinite(q).all() and np.isfinite(n).all()):
        raise InputError(f"form_error: points {q.shape}, normals {n.shape}: need (p, 3) finite numbers, one of each")
    if not np.isclose(np.linalg.norm(n, axis=1), 1.0, rtol=0.0, atol=1e-6).all():
        raise InputError("form_error: normals must be unit vectors")
    if not 0.0 < near < math.inf:
        raise InputError(f"form_error: near_mm = {near:g}: must be above 0")
    stiff = _work(work, n, "form_error")
    all_cuts = _kept_cuts(removal) if isinstance(removal, Removal) else removal
    least = np.full(len(q), np.inf)
    for cuts in all_cuts:
        _form_error.least_distances(q, n, cuts.ends, _shape(cuts.cutter), near, facing, least)
    rigid, cutter, yielded, force = (np.zeros(len(q)) for _ in range(4))
    out = FormError(np.full(len(q), -1), rigid, cutter, yielded, force, np.zeros(len(q), dtype=np.bool_))
    best = np.full(len(q), np.inf)
    todo = np.flatnonzero(np.isfinite(least))
    for at in range(0, len(todo), CHUNK):
        some = todo[at : at + CHUNK]
        margin = 1e-6
        while True:
            best[some], out.at_edge[some], widest = np.inf, False, 0.0
            for cuts in all_cuts:
                most = np.minimum(least[some] + margin, near)
                model = _Model(cuts, material, bars, facing, reach)
                widest = max(widest, _made_by(model, q[some], n[some], stiff[some], most, some, best, out))
            needed = float((best[some] - least[some]).max()) + widest
            if needed <= margin or margin >= 2.0 * near:
                break
            margin = 2.0 * needed
        progress(min(1.0, (at + CHUNK) / len(todo)), "form error")
    return out


def _made_by(
    model: _Model, q: Floats, n: Floats, stiff: Floats, most: Floats, number: Ints, best: Floats, out: FormError
) -> float:
    """Assign points to the steps of one cutter that leave less than ``best``; return the greatest deflection."""
    cuts = model.cuts
    shape = _shape(cuts.cutter)
    room = 16 * len(q) + 64
    while True:
        owner, moment = np.empty((room, 2), dtype=np.int64), np.empty((room, 14))
        count = _form_error.contacts(q, n, cuts.ends, shape, most, model.facing, owner, moment)
        if count <= room:
            break
        room = count
    owner, moment = owner[:count], moment[:count]
    if not count:
        return 0.0
    point, k = owner.T
    d, s, z, sine = moment[:, :4].T
    frame = cuts.engagement.frames[k]
    along, left = (np.einsum("mi,mi->m", moment[:, 11:], frame[:, i]) for i in (0, 1))
    phi = np.arctan2(along, left) % math.tau
    lag = math.tan(cuts.cutter.helix) / cuts.cutter.radius
    radii = tooth_radii(cuts.cutter, lag * z)
    widest = 0.0
    for j in range(1 if cuts.cutter.teeth_alike else cuts.cutter.flutes):
        there, made = np.empty(count), np.empty(count, dtype=np.bool_)
        # the ends of the front, not those of the chips of each tooth
        b = cuts.plain
        _form_error.nearest_engaged_many(
            k, s, phi, b.start, b.rows, b.tooth, b.slice, b.slices, j, model.reach, there, made
        )
        if lag > 0.0:
            there = phi
        theta = there + lag * z + cuts.cutter.tooth_angles[j]
        loads = _bend_cutter(cuts, k, theta, z, model.material, model.bars)
        force = np.einsum("mi,mij->mj", loads[:, :3], frame)
        bent = np.einsum("mi,mij->mj", loads[:, 3:], frame[:, :2])
        away = np.einsum("mi,mi->m", force, n[point])
        work = np.einsum("mi,mij,mj->m", n[point], stiff[point], force)
        cutter = np.einsum("mi,mi->m", bent, n[point])
        rigid = d - radii[:, j] * sine
        widest = max(widest, float(np.abs(cutter + work - radii[:, j] * sine).max()))
        total = rigid + cutter + work
        order = np.lexsort((total, ~made, point))
        first = order[np.r_[True, point[order][1:] != point[order][:-1]]]
        at = number[point[first]]
        better = np.where(made[first] == out.at_edge[at], total[first] < best[at], made[first])
        first, at = first[better], at[better]
        best[at] = total[first]
        out.step[at] = cuts.step[k[first]]
        out.rigid[at], out.cutter[at], out.work[at] = rigid[first], cutter[first], work[first]
        out.force[at], out.at_edge[at] = away[first], made[first]
    return widest


def _kept_cuts(removal: Removal) -> tuple[Cuts, ...]:
    if not removal.cuts:
        if not removal.columns["chip_volume_mm3"].any():
            raise InputError("deflection: the program cuts nothing")
        if not removal.columns["chip_areas"].any():
            return ()  # films, narrower than a few tolerances, have no loads
        raise InputError("deflection: the removal did not keep the tooth engagement: remove(..., keep=True)")
    return removal.cuts


def _work(work: ArrayLike | None, n: Floats, name: str) -> Floats:
    """Return the compliance (p, 3, 3) of the work at places with normals n: (p,) along the normal is C_nn n n^T."""
    if work is None:
        return np.zeros((len(n), 3, 3))
    C = np.asarray(work, dtype=np.float64)
    if C.shape == (len(n),):
        bad = np.flatnonzero(~((C >= 0.0) & np.isfinite(C)))
        if len(bad):
            raise InputError(f"{name}: work[{bad[0]}] = {C[bad[0]]:g} mm/N: a compliance must be at least 0")
        return np.asarray(C[:, None, None] * n[:, :, None] * n[:, None, :])
    if C.shape != (len(n), 3, 3) or not np.isfinite(C).all():
        raise InputError(f"{name}: work of shape {C.shape}: must be ({len(n)},) or ({len(n)}, 3, 3) finite numbers")
    return C


def _shape(cutter: Cutter) -> Floats:
    """Return the shape of the cutter for the kernels."""
    if cutter.shape:
        return _shape_of_segments(cutter)
    _, r, e, f, alpha, beta, h = cutter.apt
    arc, end = cutter.flank_arc, cutter.corner_end
    bow = (e, f, 0.0, end, end) if arc is None else (arc.e, arc.f, arc.radius, end, arc.kappa_at(min(h, arc.z_to)))
    return np.array([r, e, f, alpha, beta, h, e + r * math.sin(alpha), *bow])


def _shape_of_segments(cutter: Cutter) -> Floats:
    """Return :func:`_shape` of a profile of at most two arcs or sharp corners between a bottom and a flank."""
    segments = cutter.segments
    first, *more = (s for s in segments if not s.straight)
    (e, f), r, (alpha, end) = first.centre, first.radius, first.kappa
    bow = (e, f, 0.0, end, end)
    if more:
        bow = (*more[0].centre, more[0].radius, *more[0].kappa)
    return np.array([r, e, f, alpha, 0.5 * math.pi - segments[-1].kappa[1], cutter.flute_length, first.rho[0], *bow])


def _bend_cutter(
    cuts: Cuts, k: Ints, theta: Floats, z: Floats, material: Material, bars: Mapping[int, tuple[Bar, ...]] | None
) -> Floats:
    """(m, 5) force along T, n, A [N] and displacement of the cutter at the height z along T, n [mm]."""
    chain = np.zeros((0, 5))
    if bars is not None:
        number = cuts.tool
        if number not in bars:
            raise InputError(f"deflection: tool {number} has no bars: give them, or None for rigid cutters")
        chain = np.array(
            [[b.length, b.flexibility, b.joint.c_ff, b.joint.c_mm, b.joint.c_fm] for b in bars[number]]
        ).reshape(-1, 5)
        if chain[:, 0].sum() < cuts.cutter.flute_length * (1.0 - 1e-9):
            raise InputError(
                f"deflection: the bars of tool {number} are {chain[:, 0].sum():g} mm long: must be at least its "
                f"flute_length_mm = {cuts.cutter.flute_length:g}"
            )
    out = np.empty((len(k), 5))
    b = cuts.engagement
    law = np.array(material.law)
    _form_error.loads_of_teeth(
        k, theta, z, b.start, b.rows, b.tooth, b.slice, b.slices, cuts.cutter.flutes, law, chain, out
    )
    return out
