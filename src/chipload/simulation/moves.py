"""Removal and loads of the steps of a cutter from the volume that earlier moves swept.

Notation: as in :mod:`chipload.engagement.moves`, and in :mod:`chipload.engagement.bricks` where the axis leans or
turns. A step is calculated at its middle, and a long step at more instants, the middles of equal parts of it. Its
volume and mean loads are the means over the instants, its greatest loads the greatest of any. A ``watch`` receives the
tooth engagement at the instant of the greatest force; of several equal ones, that nearest to the middle.

The initial body is a block, a mesh, or what was left before: the body of a stock less the moves that cut it, where they
are known (:mod:`chipload.stock.earlier_moves`), else its layers. Tools that are bodies without chips make no move.

A cutter of an upright axis is open above until material stands above its flutes, which :class:`MaterialAboveFlutes`
names. The run then begins again with cutters that end where their flutes end, and asks where the shank is in material
(:mod:`chipload.simulation.shank`).
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from shapely import MultiPolygon

from chipload.cutter.cutter import Cutter
from chipload.cutter.record import cutter_record
from chipload.cutter.slices import edge_lag
from chipload.cutting.band import deviations, force_deviation, torque_deviation, turned_basis
from chipload.cutting.material import Material
from chipload.cutting.revolution import loads_over_turn
from chipload.engagement.bricks.stock import BrickStock
from chipload.engagement.moves.stock import Engaged, MoveStock
from chipload.engagement.tooth_engagement import ToothEngagement
from chipload.engagement.tooth_surfaces import chips_of_teeth
from chipload.errors import InputError
from chipload.lazy import LateModule
from chipload.program.program import Program
from chipload.simulation.initial_stock import initial_stock, make_earlier, moves_of, skip_moves
from chipload.simulation.loads import BANDS, LOADS, ONE_SIDE, TORQUE_RISE, Cuts, engaged_work
from chipload.simulation.section_outlines import Marks, nested_outlines
from chipload.simulation.shank import ShankContact
from chipload.simulation.steps import ROWS, Steps, steps_in_blocks
from chipload.stock.earlier_moves import EarlierMoves
from chipload.stock.layers import LayeredStock

if TYPE_CHECKING:
    from chipload.simulation.removal import Resolution

skew = LateModule("chipload.engagement.moves._skew_slices")

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

#: slices of the engaged part of a corner over those that are asked for of the whole corner: the greatest force is then
#: within 3 % of the converged one in 99 of 100 moves of a finishing program at the default of a job, see
#: docs/design/engines.md
ENGAGED = 0.5
#: longest slice of the flank beside layers of a stock, over the smallest radius
LAYERED_FLANK = 0.1
#: an axis that differs from z by no more than this is upright
UPRIGHT = 1e-9
#: columns of the loads that are means, of :data:`chipload.simulation.loads.LOADS`
MEANS = np.array([0, 1, 2, 10, 12, 15, 16])
LEAST = np.array([6, 7, 8])
#: of the columns, the greatest force, and the greatest and the mean torque
FORCE, TORQUE, MEAN_TORQUE = (LOADS.index(name) for name in ("force_n", "torque_nm", "torque_mean_nm"))
#: instants of steps that are unlike the one before, where no loads are wanted: the volume of six impeller programs
#: differs by at most 0.03 % from that with the middle of each third too
OF_VOLUME = (1, 9)
#: forces of instants that differ by no more than this share are alike
ALIKE = 1e-3
#: instants of rapids stand so many times as close: a corner that reaches h into the path of a radius R is met over
#: sqrt(2 R h) of it, so that one of R / 800 is found; at those of cuts one of R / 32 was missed
OF_RAPIDS = 5.0
#: a rapid that takes less than so many tolerances, over the edge that it meets, meets a film left by chords
FILM = 4.0


class MaterialAboveFlutes(Exception):
    """Error: material stands above the flutes of a tool, in a run that does not ask for its shank; with the line."""

    def __init__(self, line: int, tool: int) -> None:
        super().__init__(f"material stands above the flutes of tool {tool}")
        self.line, self.tool = line, tool


@dataclass(frozen=True, eq=False)
class Moved:
    """Removal and loads of some steps.

    Parameters
    ----------
    removed : (n, 4) volume [mm^3], pieces and layers of each chip, length of the shank in material [mm]
    loads : (n, len(LOADS))
    bands : (n,) each, columns of :data:`chipload.simulation.loads.BANDS`, none where the material has no band, and
        :data:`chipload.simulation.loads.TORQUE_RISE`
    basis : (4, 6) integral over the time in cut of the factors of the coefficients
    cuts : tooth engagement, one for each cutter
    other : the same with the loads of a further material; None: there is none
    """

    removed: Floats
    loads: Floats
    bands: Mapping[str, Floats]
    basis: Floats
    cuts: list[Cuts]
    other: Moved | None = None


@dataclass(frozen=True, eq=False)
class MoveRun:
    """A run by moves: its stock, the layers of the final stock, and the resolution of the edge.

    Parameters
    ----------
    stock : the moves so far: of an upright axis, or of one that leans or turns
    layers : heights of the layers of the stock [mm], ascending bounds
    corner_slices, flank_mm : slices of an engaged corner, longest slice of the flank by tool number
    tolerance : of outlines [mm]
    bodies : numbers of tools that are bodies without chips
    earlier : moves that cut the body before the run; they are in ``stock``
    shank : is asked where material stands above the flutes; None: a run that meets some ends
    uncounted : last line whose steps are made without calculating what they remove; -1: none
    """

    stock: MoveStock | BrickStock
    layers: Floats
    corner_slices: int
    flank_mm: Mapping[int, float]
    tolerance: float
    bodies: tuple[int, ...] = ()
    earlier: EarlierMoves | None = None
    shank: ShankContact | None = None
    uncounted: int = -1

    @property
    def upright(self) -> bool:
        """Whether the axis is upright in the whole program."""
        return isinstance(self.stock, MoveStock)

    def skip(self, program: Program, step_mm: float, count: int) -> None:
        """Make the first ``count`` steps of a program without calculating them, to continue a run."""
        for steps in steps_in_blocks(program, step_mm, self.tolerance, size=ROWS):
            if count <= 0:
                return
            self.make(steps, min(count, len(steps)))
            count -= len(steps)

    def make(self, steps: Steps, count: int) -> None:
        """Make the first ``count`` of some steps without calculating them."""
        own = self._moving(steps)[:count]
        p0, p1, tool = steps.p0[:count][own], steps.p1[:count][own], steps.tool[:count][own]
        poses = (p0, p1, steps.a0[:count][own], steps.a1[:count][own])
        skip_moves(self.stock, *poses, tool)
        if self.shank is not None:
            self.shank.overrun(poses, tool, np.zeros(0, dtype=np.int64), np.zeros(0))

    def cropped(self, low: Floats, high: Floats) -> MoveStock | BrickStock | None:
        """Return the stock before the run in a box (3,), (3,) [mm]; None where it does not reach into it."""
        stock = self.stock.cropped(low, high)
        if stock is not None and self.earlier is not None:
            make_earlier(stock, self.earlier, low, high)
        return stock

    def contact(self, steps: Steps) -> Engaged:
        """Make some steps and return their engagement."""
        pieces, flank, own = self.corner_slices, self.flank_mm, self._moving(steps)
        p0, p1, tool = steps.p0[own], steps.p1[own], steps.tool[own]
        poses = (p0, p1, steps.a0[own], steps.a1[own])
        finer, looked = np.where(steps.rapid[own], OF_RAPIDS, 1.0), steps.line[own] > self.uncounted
        if isinstance(self.stock, BrickStock):
            found = self.stock.take(*poses, tool, corner_slices=pieces, flank_mm=flank, finer=finer, looked=looked)
        else:
            found = self.stock.take(p0, p1, tool, corner_slices=pieces, flank_mm=flank, finer=finer, looked=looked)
        if self.shank is not None:
            at = np.flatnonzero(found.above)
            time = (found.instant[at] + 0.5) / found.instants[at]
            overrun = self.shank.overrun(poses, tool, found.step[at], time)
            found = replace(found, overrun=overrun[found.step])
        return found if own.all() else replace(found, step=np.flatnonzero(own)[found.step])

    def finish(self, stock: LayeredStock, workers: int) -> None:
        """Remove the swept volume of the moves from the layers, with a number of threads, and store the moves there."""
        low = self.stock.lowest()
        at = [i for i, z in enumerate(stock.heights.tolist()) if z > low]
        heights = stock.heights[at].tolist()

        def outlines(z: float) -> MultiPolygon:
            return self.stock.outlines(z, 0.5 * self.tolerance)

        if isinstance(self.stock, MoveStock):
            left = self.stock

            def between(z: float, below: Marks | None, above: Marks | None) -> tuple[MultiPolygon, Marks]:
                return left.outlines_between(z, 0.5 * self.tolerance, below, above)

            shapes = nested_outlines(between, heights, self._levels(), workers)
        else:
            with ThreadPoolExecutor(workers) as pool:
                shapes = list(pool.map(outlines, heights))
        # of a body that is not stored with the stock its layers are all that will be known
        moves = moves_of(self.stock) if self.stock.body is stock.part else None
        self.stock.forget()
        stock.remove_many([i for i, s in zip(at, shapes, strict=True) if not s.is_empty], [s for s in shapes if s])
        stock.earlier = moves

    def store_moves(self, stock: LayeredStock, workers: int) -> None:
        """Store the moves with a stock, whose layers stay as they were; finish one whose body is its layers."""
        if self.stock.body is not stock.part:
            self.finish(stock, workers)
            return
        stock.earlier = moves_of(self.stock)
        self.stock.forget()

    def _levels(self) -> Floats:
        """Return the heights (m,) [mm] at which the stock was cut level."""
        moves = self.stock.moves[: self.stock.count]
        return np.unique(moves[moves[:, 5] == 0.0, 2])

    def _moving(self, steps: Steps) -> NDArray[np.bool_]:
        """Return a mask (n,) of the steps of tools that cut, not of bodies without chips."""
        return ~np.isin(steps.tool, self.bodies) if self.bodies else np.ones(len(steps), dtype=np.bool_)


def run_by_moves(
    program: Program,
    stock: LayeredStock,
    cutters: Mapping[int, Cutter],
    step_mm: float,
    tolerance: float,
    corner_slices: int,
    flank_mm: float,
    loads: bool = True,
    *,
    shank: bool = False,
) -> MoveRun:
    """Return the run of a program by moves: by heights over the plan if the axis is always upright and no cutter is
    undercut, else by bricks; without ``loads`` at fewer instants.

    Parameters
    ----------
    shank : material stands above the flutes: cutters end with them, and the shank is looked for in material
    """
    used = {n: c for n, c in cutters.items() if bool((program.tool == n).any())}
    bodies = tuple(n for n, c in used.items() if c.body)
    cutting = {n: c for n, c in used.items() if n not in bodies} or used
    # heights over the plan know no undercut
    upright = not shank and not leans(program).any() and not any(c.undercut for c in cutting.values())
    made = initial_stock(stock, cutting, upright=upright)
    if not loads:
        made.more = OF_VOLUME
    if made.body is not stock.part:
        # the layers that are the body have edges at every height
        flank_mm = min(flank_mm, LAYERED_FLANK * min(c.radius for c in cutting.values()))
    flank = dict.fromkeys(made.table, flank_mm)
    slices = math.ceil(ENGAGED * corner_slices)
    follows = initial_stock(stock, cutting, upright=False) if shank else None
    asked = ShankContact(follows, FILM * tolerance) if isinstance(follows, BrickStock) else None
    return MoveRun(made, np.asarray(stock.bounds), slices, flank, tolerance, bodies, stock.earlier, asked)


def stock_before(
    step: int,
    program: Program,
    stock: LayeredStock,
    cutters: Mapping[int, Cutter],
    resolution: Resolution,
    after: LayeredStock,
    workers: int = 2,
) -> LayeredStock:
    """Return the stock before a step of a program.

    Parameters
    ----------
    stock : before the program; it stays
    after : the stock after the program
    workers : threads
    """
    out, fine = stock.copied(), resolution
    if step > 0:
        # of moves that are kept with their axes the cutters end where their flutes end
        ends = after.earlier is None or not after.earlier.upright
        run = run_by_moves(
            program, out, cutters, fine.step_mm, fine.tolerance, fine.corner_slices, fine.flank_mm, shank=ends
        )
        run = replace(run, shank=None)
        run.skip(program, fine.step_mm, step)
        run.finish(out, workers)
    return out


def leans(program: Program) -> NDArray[np.bool_]:
    """Return a mask of the rows of a program whose axis is not upright."""
    return np.asarray(np.abs(np.asarray(program.axis) - (0.0, 0.0, 1.0)).max(axis=1) > UPRIGHT)


def with_contact(blocks: Iterable[Steps], run: MoveRun | None, workers: int) -> Iterator[tuple[Steps, Engaged | None]]:
    """Yield blocks of steps with their engagement; with several workers a thread calculates the next block ahead.

    None: without moves, or with one worker, which finds it when it is its turn.
    """
    if run is None or workers < 2:
        for steps in blocks:
            yield steps, None
        return
    waiting = list[tuple[Steps, Future[Engaged]]]()
    with ThreadPoolExecutor(1) as executor:
        for steps in blocks:
            waiting.append((steps, executor.submit(run.contact, steps)))
            if len(waiting) > 1:
                before, found = waiting.pop(0)
                yield before, found.result()
        for before, found in waiting:
            yield before, found.result()


def remove_by_moves(
    steps: Steps,
    run: MoveRun,
    first: int,
    cutters: Mapping[int, Cutter],
    material: Material,
    rotation: float,
    found: Engaged | None = None,
    with_loads: bool = True,
    asks_shank: bool = True,
) -> Moved:
    """Return the removal of some steps; ``first`` is the number of the first, ``found`` their engagement if known.

    Without loads those are 0. Material above the flutes is ignored unless ``asks_shank``.

    Raises
    ------
    MaterialAboveFlutes
        There is material above the flutes, and the run does not ask for the shank.
    InputError
        A step that cuts and is no rapid has no spindle speed.
    """
    n = len(steps)
    found = run.contact(steps) if found is None else found
    if asks_shank and found.overrun is None and found.above.any():
        k = int(found.step[int(np.argmax(found.above))])
        raise MaterialAboveFlutes(int(steps.line[k]), int(steps.tool[k]))
    removed, loads, basis, cuts = np.zeros((n, 4)), np.zeros((n, len(LOADS))), np.zeros((4, 6)), list[Cuts]()
    bands = {name: np.zeros(n) for name in BANDS} if material.has_band and with_loads else {}
    torque = np.zeros(n)
    removed[:, 0] = np.bincount(found.step, found.volume / found.instants, n)
    np.maximum.at(removed[:, 1], found.step, found.areas)
    removed[:, 2] = _layers(found, run.layers, n)
    if found.overrun is not None:
        np.maximum.at(removed[:, 3], found.step, found.overrun)
    rapid = steps.rapid[found.step]
    length = np.linalg.norm(steps.p1 - steps.p0, axis=1)[found.step]
    # a rapid only touches a film where each of its instants does
    thick = np.bincount(found.step, found.volume > FILM * run.tolerance * length * found.edge_mm, n) > 0.0
    removed[steps.rapid & ~thick, 1] = 0.0
    feeding = np.flatnonzero(~rapid)
    for number in sorted(set(steps.tool[found.step[feeding]].tolist())):
        entries = feeding[steps.tool[found.step[feeding]] == number]
        cutter = cutters[number]
        plain = engagement_of(found, entries, steps, cutter)
        if not with_loads:
            cuts.append(_cuts(number, cutter, first, steps, found, entries, plain, np.zeros(len(entries))))
            continue
        engagement = chips_of_teeth(plain, cutter)
        step = found.step[entries]
        left, spindle = _normals_left(found, entries), np.abs(steps.spindle[step])
        seconds = steps.seconds[step]
        each, at, mean = loads_of_instants(plain, engagement, cutter, material, rotation, left, spindle, seconds)
        weight = 1.0 / found.instants[entries]
        _merge_instants(loads, step, each, weight)
        np.maximum.at(torque, step, each[:, MEAN_TORQUE])
        if material.has_band:
            some = turned_basis(mean, engagement.frames)
            basis = basis + np.tensordot(steps.seconds[step] * weight, some, 1)
            own, values = _bands(engagement, cutter, material, step, each, at, some * weight[:, None, None], spindle)
            for name, column in zip(BANDS, values, strict=True):
                bands[name][own] = column
        cuts.append(_cuts(number, cutter, first, steps, found, entries, plain, each[:, FORCE]))
    if with_loads:
        mean = loads[:, MEAN_TORQUE]
        bands[TORQUE_RISE] = np.divide(torque, mean, out=np.ones(n), where=mean > 0.0) - 1.0
    return Moved(removed, loads, bands, basis, cuts)


def loads_of_instants(
    front: ToothEngagement,
    engagement: ToothEngagement,
    cutter: Cutter,
    material: Material,
    rotation: float,
    left: Floats,
    spindle: Floats,
    seconds: Floats,
) -> tuple[Floats, Floats, Floats]:
    """(m, len(LOADS)) loads of steps that take ``seconds`` (m,) and cut all over as ``engagement``, the chips of
    ``front``, says, (m, 2) rotations
    [rad] at which force and torque are greatest, and (m, 4, 6) basis of the mean loads along T, n and the
    axis.

    Oracle: ``tests/layer_oracle/loads.py``, which takes rotation by rotation.
    """
    each, at, basis = loads_over_turn(engagement, cutter, material, rotation, left)
    each[:, 10:12] /= 1000.0
    each[:, 12] = each[:, 10] * spindle
    volume, work = engaged_work(front, cutter, material, spindle * seconds)
    return np.column_stack([each, volume, work / 1000.0]), at, basis


def _bands(
    engagement: ToothEngagement,
    cutter: Cutter,
    material: Material,
    step: Ints,
    each: Floats,
    at: Floats,
    basis: Floats,
    spindle: Floats,
) -> tuple[Ints, tuple[Floats, ...]]:
    """Steps, and of each the columns of :data:`BANDS`: of the greatest loads at the instant that has them, of the means
    over the instants from ``basis`` (m, 4, 6), the weighted one of each instant.
    """
    own, of = np.unique(step, return_inverse=True)
    whole = np.zeros((len(own), 4, 6))
    np.add.at(whole, of, basis)
    mean = deviations(whole, material)[:, 3] / 1000.0
    worst = []
    for column, (name, deviation) in enumerate(((FORCE, force_deviation), (TORQUE, torque_deviation))):
        kept = np.lexsort((-each[:, name], step))
        kept = kept[np.flatnonzero(np.diff(step[kept], prepend=-1))]
        some = engagement if len(kept) == len(step) else engagement.part(kept)
        worst.append(deviation(some, cutter, material, at[kept, column]))
    speed = np.zeros(len(own))
    speed[of] = spindle
    return own, (worst[0], worst[1] / 1000.0, mean, mean * speed)


def engagement_of(found: Engaged, entries: Ints, steps: Steps, cutter: Cutter) -> ToothEngagement:
    """Return the tooth engagement of some entries of one cutter, without its runout.

    Raises
    ------
    InputError
        The spindle rests.
    """
    step = found.step[entries]
    spindle = steps.spindle[step]
    if not spindle.all():
        line = int(steps.line[step[int(np.argmin(np.abs(spindle)))]])
        raise InputError(f"line {line}: cuts with the spindle at rest: start it (M3 S) before the cut")
    hand = np.where(spindle > 0.0, 1.0, -1.0)
    tooth = math.tau / (cutter.flutes * np.abs(spindle)) / steps.seconds[step]
    if found.frames is None:
        return _upright(found, entries, (steps.p1 - steps.p0)[step] * tooth[:, None], hand, cutter)
    start, of, span, piece = _spans(found, entries)
    # psi is counted from the motion counter-clockwise, phi from n in the sense of the spindle
    turn, slices = hand[of], found.slices[piece]
    low = 0.5 * math.pi - np.where(turn > 0.0, span[:, 1], -span[:, 0])
    wide = np.clip(span[:, 1] - span[:, 0], 0.0, math.tau)
    low = low - math.tau * np.floor(low / math.tau)
    frame = found.frames[entries] * np.stack([np.ones(len(hand)), hand, np.ones(len(hand))], axis=1)[:, :, None]
    s0, s1, along, across, rise = slices[:, [0, 1, 6, 7, 8]].T
    motion = np.column_stack([along, -rise, turn * across]) * tooth[of][:, None]
    rows = np.column_stack([low, low + wide, s0, s1, motion])
    return ToothEngagement(start, rows, np.full(len(rows), -1), piece, _slices(found.slices, cutter), frame)


def _upright(found: Engaged, entries: Ints, feed: Floats, hand: Floats, cutter: Cutter) -> ToothEngagement:
    """The tooth engagement of some entries of an upright cutter; ``feed`` (m, 3): motion a tooth [mm]."""
    size = np.hypot(feed[:, 0], feed[:, 1])
    plunge = size <= 1e-12 * np.abs(feed[:, 2])
    T = np.where(plunge[:, None], [[1.0, 0.0]], feed[:, :2] / np.where(plunge, 1.0, size)[:, None])
    frame = np.zeros((len(entries), 3, 3))
    frame[:, 0, :2] = T
    frame[:, 1, 0], frame[:, 1, 1] = -hand * T[:, 1], hand * T[:, 0]
    frame[:, 2, 2] = 1.0
    room = skew.PARTS * int(np.diff(found.start)[entries].sum())
    begin, slices = np.empty(len(entries) + 2, dtype=np.int64), np.ascontiguousarray(found.slices)
    rows, rows_of, table = np.empty((room, 7)), np.empty(room, dtype=np.int64), np.empty((len(slices) + room, 13))
    count = skew.tooth_rows(
        entries, found.start, np.ascontiguousarray(found.span), np.ascontiguousarray(found.slice), slices,
        cutter_record(cutter), edge_lag(cutter), hand, size, np.ascontiguousarray(feed[:, 2]), begin, rows, rows_of,
        table,
    )  # fmt: skip
    # as large as they are, for they may be kept
    return ToothEngagement(
        begin[:-1], rows[:count].copy(), np.full(count, -1), rows_of[:count].copy(), table[: begin[-1]].copy(), frame
    )


def _spans(found: Engaged, entries: Ints) -> tuple[Ints, Ints, Floats, Ints]:
    """Of some entries: where the rows of each begin, the entry of each row, its psi from and to, its slice."""
    count = np.diff(found.start)[entries]
    start = np.concatenate([[0], np.cumsum(count)])
    of = np.repeat(np.arange(len(entries)), count)
    row = np.arange(start[-1]) - start[of] + found.start[entries][of]
    return start, of, found.span[row], found.slice[row]


def _slices(slices: Floats, cutter: Cutter) -> Floats:
    """Return the slices (k, 7) in the form of :class:`ToothEngagement`."""
    s0, _, rho, z, sk, ck = slices[:, :6].T
    lead = edge_lag(cutter)
    # an arc on the bottom begins at 0 but for rounding
    return np.column_stack([s0, rho, z, sk, ck, lead * np.maximum(z, 0.0), lead * sk])


def _normals_left(found: Engaged, entries: Ints) -> Floats:
    """Return unit normals (m, 3) of the surface that is left; 0 where none or two that face each other are left."""
    total, whole = found.left[entries], found.left_mm[entries]
    size = np.linalg.norm(total, axis=1)
    one = (size > ONE_SIDE * whole) & (whole > 0.0)
    return np.asarray(np.where(one[:, None], total / np.where(one, size, 1.0)[:, None], 0.0))


def _merge_instants(loads: Floats, step: Ints, each: Floats, weight: Floats) -> None:
    """Replace the loads of instants by those of their steps: means, greatest, least."""
    fresh = np.unique(step)
    loads[np.ix_(fresh, LEAST)] = math.inf
    greatest = np.setdiff1d(np.arange(each.shape[1]), [*MEANS, *LEAST])
    loads[np.ix_(fresh, greatest)] = -math.inf
    for i in range(each.shape[1]):
        if i in MEANS:
            np.add.at(loads[:, i], step, weight * each[:, i])
        elif i in LEAST:
            np.minimum.at(loads[:, i], step, each[:, i])
        else:
            np.maximum.at(loads[:, i], step, each[:, i])


def _layers(found: Engaged, bounds: Floats, n: int) -> Floats:
    """(n,) number of layers between the least and the greatest height that each step engages."""
    low, high = np.full(n, math.inf), np.full(n, -math.inf)
    np.minimum.at(low, found.step, found.z[:, 0])
    np.maximum.at(high, found.step, found.z[:, 1])
    first = np.searchsorted(bounds, low, "right") - 1
    last = np.searchsorted(bounds, high, "left")
    return np.where(high > low, np.maximum(last - np.maximum(first, 0), 1), np.where(low < math.inf, 1, 0)).astype(
        float
    )


def _cuts(
    number: int,
    cutter: Cutter,
    first: int,
    steps: Steps,
    found: Engaged,
    entries: Ints,
    plain: ToothEngagement,
    force: Floats,
) -> Cuts:
    """What the teeth of a cutter cut: of each step the instant of the greatest ``force`` (m,), where others are within
    ``ALIKE`` of it the one that removes most, by a share of 1e-6, and of those the one nearest to the middle.
    """
    step = found.step[entries]
    greatest = np.zeros(int(step.max(initial=-1)) + 1)
    np.maximum.at(greatest, step, force)
    off = np.abs(2 * found.instant[entries] + 1 - found.instants[entries])
    most = np.zeros(len(greatest))
    np.maximum.at(most, step, found.volume[entries])
    with np.errstate(divide="ignore", invalid="ignore"):
        less = np.where(most[step] > 0.0, np.round(1.0 - found.volume[entries] / most[step], 6), 0.0)
    order = np.lexsort((off, less, force < (1.0 - ALIKE) * greatest[step], step))
    kept = np.sort(order[np.flatnonzero(np.diff(step[order], prepend=-1))])
    some = plain if len(kept) == len(entries) else plain.part(kept)
    at = step[kept]
    ends = np.hstack([steps.p0[at], steps.p1[at], steps.a0[at], steps.a1[at]])
    return Cuts(number, cutter, first + at, ends, chips_of_teeth(some, cutter), some, steps.spindle[at])
