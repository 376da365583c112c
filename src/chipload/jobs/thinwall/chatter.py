"""Chatter of a thin wall's passes: stable depths with the deflection limit, a speed for each pass, the stability
margin.

A pass is checked in two states: with the stock that it leaves, and with the stock before it, thicker by at most the
greatest depth. The modes are those of the finite elements that the compliance comes from. The margins of the simulated
passes are then calculated with their own chips, in both states.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from chipload.lazy import scipy
from chipload.planning.thinwall.blank import SIDES
from chipload.planning.thinwall.chatter import WallCutting, WallMotion, quietest_speed, stable_depths
from chipload.planning.thinwall.passes import ThresholdOf, WallPass
from chipload.planning.thinwall.paths import rows_of
from chipload.planning.thinwall.plane_stock import CutterPose
from chipload.planning.thinwall.threshold import Threshold
from chipload.result import CoveredRows, LimitCheck, check_limit
from chipload.simulation.removal import Removal
from chipload.stability.cuts import dynamic_cuts
from chipload.stability.margin import MOST_MARGIN, stability_margins
from chipload.stability.modes import Modes
from chipload.units import rad_s_from_rpm, rpm_from_rad_s

if TYPE_CHECKING:
    from chipload.jobs.thinwall.inputs import WallInputs
    from chipload.jobs.thinwall.outcome import PassMap, Variant
    from chipload.jobs.thinwall.places import Places

Floats = NDArray[np.float64]

#: column that the history does not keep: the margin with the modes that the wall has before its first pass
FIRST_STATE = "first_margin"
#: speeds that are tested for a pass
SPEEDS = 9
#: greatest number of places of the elements at which depths are searched, along and up
ALONG, UP = 7, 6
#: relative error of a margin by the map
MARGIN_ERROR = 0.01
#: N/mm in 1 N/um
PER_UM = 1000.0


@dataclass(frozen=True, eq=False)
class WallChatter:
    """Chatter calculation of a thin-wall job: modes of wall and cutter, stable depths, margins.

    Parameters
    ----------
    inputs : of the job
    cutting : cutter, damping and required margin
    count : modes of the wall
    speeds : (s,) float [rad/s] that a pass may have, rising
    """

    inputs: WallInputs
    cutting: WallCutting
    count: int
    speeds: Floats
    _motions: dict[tuple[bytes, int], WallMotion] = field(default_factory=dict)
    _depths: dict[tuple[bytes, int], tuple[Floats, float]] = field(default_factory=dict)

    def motion(self, left: Sequence[Floats], side: int) -> WallMotion:
        """Modes at all places of the elements of a side; ``left`` at these places, on all sides."""
        states = self.inputs.both(left)
        key = (b"".join(D.tobytes() for D in states), side)
        if key not in self._motions:
            body = self.inputs.body
            frequency, shapes = body.wall.modes(states, SIDES[body.side_numbers[side]], self.count)
            self._motions[key] = WallMotion(frequency, shapes, self._frames(side))
        return self._motions[key]

    def _frames(self, side: int) -> Floats:
        """(p, 3, 3) feed, left and normal at the places of the elements."""
        surface = self.inputs.coarse(self.inputs.body.side_numbers[side])
        none = np.zeros(surface.points.shape[:2])
        feed = rows_of(surface, none, none + surface.allowance, self.inputs.cut.posture).feed[0, 0]
        along = np.gradient(surface.points, axis=0)
        along *= np.sign(along[0, -1] @ feed)
        along -= (along * surface.normals).sum(axis=2, keepdims=True) * surface.normals
        along /= np.linalg.norm(along, axis=2, keepdims=True)
        frames = np.stack([along, np.cross(surface.normals, along), surface.normals], axis=2)
        return np.asarray(frames.reshape(-1, 3, 3))

    def depths(self, left: Sequence[Floats], side: int) -> tuple[Floats, float]:
        """Stable depths at all places of the elements of a side [mm], and the speed of the pass [rad/s].

        Between these places the least of those around counts.
        """
        key = (b"".join(np.asarray(D).tobytes() for D in left), side)
        if key not in self._depths:
            limits, shape = self.inputs.depths.law.limits, self.inputs.body.elastic.shape
            allowance = self.inputs.body.allowance[self.inputs.body.side_numbers[side]]
            before = [np.array(D) for D in left]
            before[side] = np.minimum(before[side] + limits.greatest, allowance)
            a, b = (
                np.unique(np.linspace(0, n - 1, min(n, m)).round().astype(np.int64))
                for n, m in zip(shape, (ALONG, UP), strict=True)
            )
            at = (a[:, None] * shape[1] + b[None, :]).ravel()
            walls = [self.motion(state, side).chosen(at) for state in (left, before)]
            speed = quietest_speed(self.cutting, walls, limits, self.speeds, self.inputs.cut.pass_motion.spindle)
            found = stable_depths(self.cutting, walls, limits, speed).reshape(len(a), len(b))
            self._depths[key] = (_least_around(found, (a, b), shape), speed)
        return self._depths[key]

    def limited(self, places: Places, threshold_of: ThresholdOf) -> ThresholdOf:
        """Thresholds with the stable depth and its spindle speed."""

        def both(left: Sequence[Floats], side: int) -> Threshold:
            depth, speed = self.depths(places.coarse(left), side)
            own, v = self.inputs.body.places[1], places.v
            low = np.clip(np.searchsorted(own, v, side="right") - 1, 0, len(own) - 1)
            high = np.clip(np.searchsorted(own, v, side="left"), 0, len(own) - 1)
            return replace(
                threshold_of(left, side), depth=np.minimum(depth[:, low], depth[:, high]).ravel(), speed=speed
            )

        return both

    def columns(
        self, places: Places, removal: Removal, p: WallPass, left: Sequence[Floats], known: Mapping[str, NDArray[Any]]
    ) -> dict[str, Floats]:
        """``stability_margin`` and ``chatter_hz`` of the steps of a simulated pass, by the lesser margin of its two
        states, and :data:`FIRST_STATE`.

        Parameters
        ----------
        left : stock after the pass, on all sides at the places
        known : columns of the steps, with ``u`` and ``v``
        """
        count = len(known["line"])
        margin, hertz, first = np.full(count, MOST_MARGIN), np.zeros(count), np.full(count, MOST_MARGIN)
        full = [np.full(places.shape, self.inputs.body.allowance[s]) for s in self.inputs.body.side_numbers]
        before = list(left)
        before[p.side] = p.high
        shape = self.inputs.body.elastic.shape
        for cuts in removal.cuts:
            step = np.asarray(cuts.step)
            if not len(step):
                continue
            frames = cuts.plain.frames
            T, n, A = (frames[:, k] for k in range(3))
            bare = dynamic_cuts(
                cuts.plain, cuts.cutter, self.cutting.material, None, cuts.spindle, T, n, A=A, directions=3
            )
            u = np.clip(known["u"][step], 0.0, 1.0)
            v = np.clip(known["v"][step], self.inputs.body.foot, 1.0)
            for state in (left, before, full):
                whole = self.motion(places.coarse(state), p.side)
                grid = whole.shapes.reshape(*shape, 3, -1)
                shapes = scipy.interpolate.RegularGridInterpolator(self.inputs.body.places, grid)(
                    np.column_stack([u, v])
                )
                wall = WallMotion(whole.frequency, shapes, np.zeros((len(step), 3, 3)))
                found = stability_margins(self.cutting.vibrating(bare, wall, frames))
                if state is full:
                    first[step] = found.margin
                    continue
                less = found.margin < margin[step]
                margin[step[less]], hertz[step[less]] = found.margin[less], found.frequency[less]
        return {"stability_margin": margin, "chatter_hz": hertz, FIRST_STATE: first}


def _least_around(values: Floats, at: tuple[NDArray[np.int64], NDArray[np.int64]], shape: tuple[int, int]) -> Floats:
    """Values of some places of a grid at all of them (n, m): the least of those around."""
    ends = [
        (np.searchsorted(own, np.arange(n), side="right") - 1, np.searchsorted(own, np.arange(n), side="left"))
        for own, n in zip(at, shape, strict=True)
    ]
    corners = [values[np.ix_(i, j)] for i in ends[0] for j in ends[1]]
    return np.asarray(np.min(corners, axis=0))


def chatter_of(inputs: WallInputs) -> WallChatter | None:
    """Chatter calculation that a job states; None: it states none."""
    table = inputs.job.table.dynamics
    if table is None:
        return None
    modes = None
    if table.mode:
        modes = Modes(
            np.array([m.frequency_hz for m in table.mode]), np.array([m.damping_ratio for m in table.mode]),
            PER_UM * np.array([m.stiffness_n_um for m in table.mode]), np.tile([1.0, 0.0], (len(table.mode), 1)),
        )  # fmt: skip
    pose = inputs.cut.posture
    assert isinstance(pose, CutterPose)  # a job with a flank has no [dynamics]
    cutting = WallCutting(pose, inputs.cut.material, modes, table.damping_ratio, table.margin)
    own = inputs.job.operation.speed_rpm
    low, high = (rad_s_from_rpm(x or own) for x in (table.least_rpm, table.most_rpm))
    present = inputs.cut.pass_motion.spindle
    speeds = np.unique(np.concatenate([np.geomspace(low, high, SPEEDS), np.clip([present], low, high)]))
    return WallChatter(inputs, cutting, table.modes, speeds)


def chatter_limits(
    dynamics: Mapping[str, Any] | None, columns: Mapping[str, NDArray[Any]], track: str, force_error: float = 0.0
) -> tuple[LimitCheck, ...]:
    """The check of the margin by the values of ``[dynamics]``; none where it is not stated.

    ``force_error`` is the relative error of the force by layers and steps.
    """
    if dynamics is None:
        return ()
    limit, reason = float(dynamics["margin"]), "" if dynamics["mode"] else "modes of the cutter are not stated"
    cuts = CoveredRows(np.asarray(columns["chip_areas"]) > 0, "cuts with a chip", "where a margin is calculated")
    return (
        check_limit(
            "stability_margin", limit, columns, track=track, rows=cuts, error=MARGIN_ERROR + force_error, reason=reason
        ),
    )


def chatter_numbers(one: Variant, dynamics: Mapping[str, Any] | None) -> dict[str, Any]:
    """``stability`` of a variant in summary.json; nothing where chatter is not calculated."""
    margin = one.columns.get("stability_margin")
    if margin is None or dynamics is None:
        return {}
    first = one.columns[FIRST_STATE]
    differs = (margin < dynamics["margin"]) != (first < dynamics["margin"])
    cuts = np.flatnonzero(np.asarray(one.columns["chip_areas"]) > 0)
    k = int(cuts[np.argmin(margin[cuts])])
    passes = [
        {
            "speed_rpm": None if m.speed is None else rpm_from_rad_s(m.speed),
            "stable_depth_mm_min": None if m.stable is None else float(m.stable.min()),
            "governed_by_chatter": None if m.stable is None else chatter_share(m),
        }
        for m in one.plan.maps
    ]
    return {
        "stability": {
            "margin_min": float(margin[k]), "line": int(one.columns["line"][k]), "pass": str(one.columns["pass"][k]),
            "chatter_hz": float(one.columns["chatter_hz"][k]), "passes": passes,
            "start_state_margin_min": float(first[cuts].min()), "verdict_differs_steps": int(differs.sum()),
            "verdict_differs_lines": np.unique(np.asarray(one.columns["line"])[differs]).tolist(),
        }
    }  # fmt: skip


def chatter_share(m: PassMap) -> float:
    """Share of the places of a pass whose depth is the stable depth."""
    return float((m.depth >= (1.0 - 1e-6) * m.stable).mean()) if m.stable is not None else 0.0
