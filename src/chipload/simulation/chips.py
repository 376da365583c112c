"""Run a Program through a layered workpiece: what every step removes, and what that costs.

Notation: a step as in :mod:`chipload.simulation.steps`; t in 0..1 within it. Its chip is, layer by layer, what the
cutter covers during the step and what is still there; its volume the sum of area times thickness. Where the stock's
edges are made simpler, by half the tolerance, what that takes or gives counts with the step. Forces are those at
the middle of the step (t = 1/2), on the cutter, in the work frame, over one revolution of the spindle.

What is known at each layer is the section at half its height: see :mod:`chipload.stock.layers` for the error in volume
and :mod:`chipload.engagement.immersion.immersion` for the one in force.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from shapely import MultiPolygon, Polygon, box

from chipload.cutter.cutter import Cutter
from chipload.cutter.slices import Slices, slices
from chipload.cutting.band import deviations, mean_basis
from chipload.cutting.force import forces_over_turn, in_work, mean_forces
from chipload.cutting.material import Material
from chipload.engagement.bites import Bites, with_runout
from chipload.engagement.chips.covered import covered_areas
from chipload.engagement.chips.move import Move
from chipload.engagement.immersion.immersion import Section, immersed, tool_frame
from chipload.errors import Finding, InputError
from chipload.program.program import Program
from chipload.progress import Progress, silent
from chipload.simulation.steps import Steps, steps_of
from chipload.stock.layers import LayeredStock
from chipload.units import mm_min_from_mm_s

Floats = NDArray[np.float64]
Columns = Mapping[str, NDArray[Any]]
Interpolation = Literal["slerp", "lerp"]

#: steps whose forces are calculated at once
BLOCK = 512
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
)
#: a bite ends where h = 0 if h is at most this share of its greatest
GRAZES = 1e-6
#: a mean normal shorter than this stands for surfaces that face each other
ONE_SIDE = 0.5
#: a piece of a chip narrower than so many tolerances is a film left by chords, no piece
FILM = 4.0


@dataclass(frozen=True)
class Resolution:
    """How fine the simulation looks.

    Parameters
    ----------
    step_mm : longest step of the tip [mm]
    tolerance : how far chords leave the edges of chips [mm]
    corner_pieces : slices of a corner radius
    flank_mm : length of a slice along the flank [mm]
    rotation : between two rotations at which the force is looked at [rad]
    """

    step_mm: float
    tolerance: float
    corner_pieces: int
    flank_mm: float
    rotation: float = math.radians(1.0)


@dataclass(frozen=True, eq=False)
class Piece:
    """The chip of one step on one layer: the one with most pieces, of those the one whose pieces are most alike.

    Parameters
    ----------
    step : its number
    move, cutter : of the step
    height : of the layer's section [mm]
    before : the section before the step, around the cutter
    chips : the pieces
    """

    step: int
    move: Move
    cutter: Cutter
    height: float
    before: Any
    chips: tuple[Polygon, ...]


@dataclass(frozen=True, eq=False)
class Removal:
    """What a program removed.

    Parameters
    ----------
    columns : (n,) each, a row a step, see :func:`remove`
    volume_before, volume_after : of the stock [mm^3]
    mean_band : (4,) standard deviation of the mean force x, y, z [N] and torque [N m] over the time in cut, from that
        of the coefficients; None: the material does not say how sure they are
    piece : the chip with most pieces that are most alike; None where nothing was cut
    findings : rapids that cut, material above the flutes
    labels : of the program, `label` of the columns counts in them
    """

    columns: Columns
    volume_before: float
    volume_after: float
    mean_band: tuple[float, ...] | None
    piece: Piece | None
    findings: tuple[Finding, ...]
    labels: tuple[str, ...]


def remove(
    program: Program,
    stock: LayeredStock,
    cutters: Mapping[int, Cutter],
    material: Material,
    resolution: Resolution,
    *,
    interpolation: Interpolation = "slerp",
    progress: Progress = silent,
) -> Removal:
    """Take what the program cuts from ``stock``, which changes, and say what it costs.

    Parameters
    ----------
    program : in the work frame of the stock
    cutters : by tool number
    interpolation : of the axis within a step: along a great circle (slerp) or normalised straight line (lerp)

    Returns
    -------
    Removal
        With the columns ``line``, ``tool``, ``label``, ``rapid``, ``s_mm``, ``t_s``, ``seconds``, ``x_mm``,
    ``y_mm``, ``z_mm``, ``axis_x..z``, ``feed_mm_min``, ``chip_volume_mm3``, ``chip_pieces`` (most on one layer),
    ``chip_layers`` (layers that lost something), ``chip_max_mm`` (thickest),
    ``force_{x,y,z}_{mean,max,min}_n`` over the revolution, ``force_n`` (greatest size), ``torque_mean_nm``,
    ``torque_nm`` (greatest), ``power_w`` (mean),
    ``force_normal_n`` (greatest force that presses on the surface that the step leaves, along its normal; 0 where it
    leaves two that face each other, as in a slot)

    Raises
    ------
    InputError
        A tool has no cutter, an axis lies or looks down, a cut is made with the spindle at rest.

    Notes
    -----
    O(n l m): n steps, l layers under the cutter, m edges of the stock around it; m does not grow with n.
    """
    steps = steps_of(program, resolution.step_mm, resolution.tolerance)
    _check(steps, cutters)
    profiles = {
        n: slices(c, corner_pieces=resolution.corner_pieces, flank_mm=resolution.flank_mm) for n, c in cutters.items()
    }
    before = stock.volume()
    removed = np.zeros((len(steps), 3))
    loads = np.zeros((len(steps), len(LOADS)))
    basis = np.zeros((4, 6))
    best: Piece | None = None
    rank = (0, 0.0)
    for first in range(0, len(steps), BLOCK):
        progress(first / len(steps), "removing")
        cuts: list[_Bite] = []
        for k in range(first, min(first + BLOCK, len(steps))):
            cutter, move = cutters[int(steps.tool[k])], _move(steps, k, interpolation)
            inner, outer = _box(steps, k, cutter)
            layers = stock.layers_between(inner[2], outer[2])
            met = _covered(steps, k, move, cutter, stock, layers, resolution.tolerance)
            if not met:
                continue
            # a face that looks down is held against the layer below
            material_before = Section(*stock.edges(range(max(layers.start - 1, 0), layers.stop), inner[:2], outer[:2]))
            tidied = stock.tidied
            taken = stock.remove_many([i for i, _ in met], [shape for _, shape in met], 0.5 * resolution.tolerance)
            removed[k, 0] = tidied - stock.tidied
            chips = {i: pieces for (i, _), pieces in zip(met, taken, strict=True) if pieces}
            if not chips:
                continue
            for i, pieces in chips.items():
                whole = [p for p in pieces if _whole(p, resolution.tolerance)]
                removed[k] += (sum(p.area for p in pieces) * stock.thickness[i], 0.0, 1.0)
                removed[k, 1] = max(removed[k, 1], len(whole))
                areas = [p.area for p in whole]
                alike = min(areas) / sum(areas) if areas else 0.0
                if (len(whole), alike) > rank:
                    rank = (len(whole), alike)
                    near = stock.section(i).union(MultiPolygon(pieces)).intersection(box(*inner[:2], *outer[:2]))
                    best = Piece(k, move, cutter, float(stock.heights[i]), near, tuple(whole))
            if not steps.rapid[k]:
                cuts.append(_bite(steps, k, move, cutter, profiles[int(steps.tool[k])], material_before))
        for number in sorted({int(steps.tool[c.step]) for c in cuts}):
            some = [c for c in cuts if steps.tool[c.step] == number]
            at = [c.step for c in some]
            bites = _bites(some, cutters[number], profiles[number])
            loads[at] = _loads(bites, some, cutters[number], material, resolution.rotation, steps.spindle[at])
            if _sure(material):
                each = mean_basis(bites, cutters[number], material, bites.frame)
                basis += np.tensordot(steps.seconds[at], each, 1)
    progress(1.0, "removed")
    band = None
    if _sure(material):
        cut_s = float(steps.seconds[(removed[:, 0] > 0.0) & ~steps.rapid].sum())
        sd = deviations(basis / cut_s, material) if cut_s > 0.0 else np.zeros(4)
        band = (*sd[:3].tolist(), float(sd[3]) / 1000.0)
    return Removal(
        _columns(steps, removed, loads), before, stock.volume(), band, best, _findings(steps, removed), program.labels
    )


def _sure(material: Material) -> bool:
    """Whether the material says how sure its coefficients are."""
    return material.spread is not None or material.covariance is not None


@dataclass(frozen=True, eq=False)
class _Bite:
    """Rows of one step."""

    step: int
    frame: Floats
    rows: Floats
    owner: NDArray[np.int64]


def _move(steps: Steps, k: int, interpolation: Interpolation) -> Move:
    make = Move.slerp if interpolation == "slerp" else Move.lerp
    return make(steps.p0[k], steps.a0[k], steps.p1[k], steps.a1[k])


def _covered(
    steps: Steps, k: int, move: Move, cutter: Cutter, stock: LayeredStock, layers: range, tolerance: float
) -> list[tuple[int, Polygon | MultiPolygon]]:
    """What a step covers of each layer that it meets; layers that an upright flank crosses share one polygon."""
    heights = stock.heights[layers.start : layers.stop]
    shared = np.zeros(len(heights), dtype=np.bool_)
    if steps.a0[k, 2] == steps.a1[k, 2] == 1.0 and cutter.taper == 0.0:
        _, r, _, f, _, _, top = cutter.apt
        low, high = sorted((steps.p0[k, 2], steps.p1[k, 2]))
        shared = (heights > high + (f if r > 0.0 else cutter.radius * math.tan(cutter.bottom))) & (heights < low + top)
    own = np.flatnonzero(~shared)
    if shared.any():
        own = np.append(own, np.flatnonzero(shared)[0])
    shapes = {int(own[n]): a for n, a in enumerate(covered_areas(move, cutter, heights[own], tolerance))}
    common = shapes[int(own[-1])] if shared.any() else None
    flank = common.polygon if common is not None else None
    out = []
    for n, i in enumerate(layers):
        area = shapes.get(n)
        if shared[n]:
            out.append((i, flank))
        elif area is not None:
            out.append((i, area.polygon))
    return [(i, shape) for i, shape in out if shape is not None]


def _box(steps: Steps, k: int, cutter: Cutter) -> tuple[Floats, Floats]:
    """(3,), (3,) corners of a box that the cutter does not leave during a step, as the axis turns by a few degrees."""
    top = cutter.flute_length
    wide = max(cutter.radius, float(cutter.radius_at([top])[0]))
    ends = np.array([steps.p0[k], steps.p1[k], steps.p0[k] + top * steps.a0[k], steps.p1[k] + top * steps.a1[k]])
    # the top of the cutter leaves its chord by the sagitta of the turn, and each circle reaches R across the axis
    axes = np.array([steps.a0[k], steps.a1[k]])
    turn = float(np.linalg.norm(axes[1] - axes[0]))
    reach = wide * np.minimum(np.sqrt(np.maximum(1.0 - axes.min(axis=0) ** 2, 1.0 - axes.max(axis=0) ** 2)) + turn, 1.0)
    reach = reach + top * turn**2
    return ends.min(axis=0) - reach, ends.max(axis=0) + reach


def _bite(steps: Steps, k: int, move: Move, cutter: Cutter, profile: Slices, section: Section) -> _Bite:
    """What the teeth cut at the middle of a step."""
    if steps.spindle[k] == 0.0:
        raise InputError(f"line {steps.line[k]}: cuts with the spindle at rest: start it (M3 S) before the cut")
    (tip, axis), (speed, swing) = ((v[0] for v in pair) for pair in (move.at([0.5]), move.rates([0.5])))
    tooth = math.tau / (cutter.flutes * abs(float(steps.spindle[k]))) / float(steps.seconds[k])
    turn = np.cross(axis, swing)
    middle = speed + 0.5 * cutter.flute_length * swing
    frame = tool_frame(axis, speed if np.linalg.norm(speed) > 0.0 else middle, bool(steps.spindle[k] > 0.0))
    rows, owner = immersed(tip, frame, speed * tooth, turn * tooth, profile, section)
    return _Bite(k, frame, rows, owner)


def _bites(cuts: list[_Bite], cutter: Cutter, profile: Slices) -> Bites:
    """The bites of some steps of one cutter, with its runout."""
    start = np.cumsum([0, *(len(c.rows) for c in cuts)])
    rows, owner = np.concatenate([c.rows for c in cuts]), np.concatenate([c.owner for c in cuts])
    frame = np.array([c.frame for c in cuts])
    return with_runout(Bites(start, rows, np.full(len(rows), -1), owner, profile.columns, frame), cutter)


def _loads(
    bites: Bites, cuts: list[_Bite], cutter: Cutter, material: Material, rotation: float, spindle: Floats
) -> Floats:
    """(c, len(LOADS)) loads of steps."""
    assert bites.frame is not None
    pitch = math.tau if cutter.runout[0] > 0.0 else math.tau / cutter.flutes
    count = max(math.ceil(pitch / rotation), 8)
    force, torque = forces_over_turn(bites, cutter, material, np.arange(count) * (pitch / count))
    mean, torque_mean = mean_forces(bites, cutter, material)
    turned = in_work(force, bites.frame)
    left = np.array([_left(c, bites.slices) for c in cuts])
    return np.column_stack(
        [
            in_work(mean, bites.frame),
            turned.max(axis=1),
            turned.min(axis=1),
            np.linalg.norm(force, axis=2).max(axis=1),
            torque_mean / 1000.0,
            torque.max(axis=1) / 1000.0,
            torque_mean * np.abs(spindle) / 1000.0,
            bites.chip_max(),
            -np.einsum("nmi,ni->nm", turned, left).min(axis=1).clip(None, 0.0),
        ]
    )


def _left(cut: _Bite, slices: Floats) -> Floats:
    """Outward normal of the cutter, in the work frame, where it leaves a surface behind: nu averaged over the ends of
    bites at which h = 0, by their length along the profile; (3,), 0 where no surface or two that face each other are
    left.
    """
    p, q, a, b, along, offset, across = cut.rows.T
    sk, ck = slices[cut.owner, 3], slices[cut.owner, 4]
    total, whole = np.zeros(3), 0.0
    for phi in (p, q):
        h = along * np.sin(phi) + across * np.cos(phi) + offset
        made = np.where(np.abs(h) <= GRAZES * (np.hypot(along, across) + np.abs(offset)), b - a, 0.0)
        nu = np.column_stack([sk * np.sin(phi), sk * np.cos(phi), -ck]) @ cut.frame
        total += made @ nu
        whole += float(made.sum())
    size = float(np.linalg.norm(total))
    return total / size if size > ONE_SIDE * whole > 0.0 else np.zeros(3)


def _whole(piece: Polygon, tolerance: float) -> bool:
    """Whether a piece is more than a film that chords have left."""
    return bool(2.0 * piece.area > FILM * tolerance * piece.length)


def _columns(steps: Steps, removed: Floats, loads: Floats) -> dict[str, NDArray[Any]]:
    length = np.linalg.norm(steps.p1 - steps.p0, axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        feed = np.where(steps.seconds > 0.0, mm_min_from_mm_s(1.0) * length / steps.seconds, 0.0)
    return {
        "line": steps.line,
        "tool": steps.tool,
        "label": steps.label,
        "rapid": steps.rapid,
        "s_mm": np.cumsum(length),
        "t_s": np.cumsum(steps.seconds),
        "seconds": steps.seconds,
        **{f"{x}_mm": steps.p1[:, i] for i, x in enumerate("xyz")},
        **{f"axis_{x}": steps.a1[:, i] for i, x in enumerate("xyz")},
        "feed_mm_min": feed,
        "chip_volume_mm3": removed[:, 0],
        "chip_pieces": removed[:, 1].astype(np.int64),
        "chip_layers": removed[:, 2].astype(np.int64),
        **{name: loads[:, i] for i, name in enumerate(LOADS)},
    }


def _check(steps: Steps, cutters: Mapping[int, Cutter]) -> None:
    if len(steps) == 0:
        raise InputError("program: no motion: nothing to simulate")
    for number in np.unique(steps.tool).tolist():
        if number not in cutters:
            line = int(steps.line[np.flatnonzero(steps.tool == number)[0]])
            known = ", ".join(str(n) for n in sorted(cutters))
            raise InputError(f"line {line}: tool {number}: no [[cutter]] has this number: state one beside {known}")


def _findings(steps: Steps, removed: Floats) -> tuple[Finding, ...]:
    """Rapids that cut more than films."""
    lines = dict.fromkeys(steps.line[steps.rapid & (removed[:, 1] > 0.0)].tolist())
    return tuple(Finding("rapid-cuts", line, "a rapid goes through material") for line in lines)
