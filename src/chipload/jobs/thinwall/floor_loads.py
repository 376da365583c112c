"""Loads and form error of floors: what the contact points of an upright cutter feel, and what is left.

Notation: C [mm/N] displacement of a place along the normal under a force of 1 N along x, y and z, C_nn its last
component; F [N] force over a revolution. The floor moves by |C . F|, with the lateral force as well: it acts at the
upper surface, half the thickness above the middle of the floor.

The force acts where teeth cut: at the beginning, the middle and the end of their arc, whichever moves the floor most,
at the mean distance of the edge in cut from the axis.
`force_normal_n` is the force along the normal alone that would move the floor as far.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chipload.cutting.force import forces_over_turn, in_work
from chipload.jobs.tables import require_stated
from chipload.jobs.thinwall.inputs import WallInputs
from chipload.jobs.thinwall.mesh_error import error_at
from chipload.jobs.thinwall.outcome import Finish
from chipload.jobs.thinwall.part_floor import PartFloor
from chipload.jobs.thinwall.places import Places
from chipload.simulation.floor_error import floor_error
from chipload.simulation.loads import Cuts
from chipload.simulation.removal import Removal

Floats = NDArray[np.float64]

#: rotations between which the greatest force is searched [rad]: engagement begins and ends abruptly
TURN = math.radians(0.25)
#: points of a finished floor along and across
POINTS = (33, 25)
#: a step whose tip is nearer to the floor [mm] than this share of the stock makes it
NEAR = 0.25


@dataclass(frozen=True, eq=False)
class FloorLoads:
    """Loads of the steps that cut a floor, in the order of the steps.

    Attributes
    ----------
    step : (c,) int
    motion : (c,) float [mm], greatest
    normal : (c,) float [mm/N], C_nn of the place at which it is greatest
    parameters : (c, 2) of that place
    error : (c,) greatest relative error of the compliance of the places
    """

    step: NDArray[np.int64]
    motion: Floats
    normal: Floats
    parameters: Floats
    error: Floats


def floor_loads(places: Places, removal: Removal, left: Sequence[Floats], side: int, error: Floats) -> FloorLoads:
    """Loads of a pass over a floor.

    Parameters
    ----------
    left : stock after the pass
    error : (n, m) of the compliance of the side
    """
    inputs = places.inputs
    floor = require_stated(inputs.floor(inputs.body.side_numbers[side]), "floor")
    parts = []
    for cuts in removal.cuts:
        uv = arc_places(cuts, floor)
        C = places.pressed(left, side, uv)
        moved = _greatest(cuts, C, inputs)
        worst, each = moved.argmax(axis=0), np.arange(len(cuts))
        unsure = error_at(inputs.body.places, error, *uv.reshape(-1, 2).T).reshape(uv.shape[:2]).max(axis=0)
        parts.append((cuts.step, moved[worst, each], C[worst, each, 2], uv[worst, each], unsure))
    step, motion, normal, parameters, unsure = (np.concatenate([p[k] for p in parts]) for k in range(5))
    order = np.argsort(step, kind="stable")
    return FloorLoads(step[order], motion[order], normal[order], parameters[order], unsure[order])


def arc_places(cuts: Cuts, floor: PartFloor) -> Floats:
    """Parameters (3, c, 2) of the places of a floor under the beginning, the middle and the end of the arcs in cut."""
    engagement = cuts.plain
    first = engagement.start[:-1]
    low, high = (
        f.reduceat(x, first) for f, x in ((np.minimum, engagement.rows[:, 0]), (np.maximum, engagement.rows[:, 1]))
    )
    length = np.maximum(engagement.rows[:, 3] - engagement.rows[:, 2], 0.0)
    rho = np.add.reduceat(engagement.slices[engagement.slice, 1] * length, first) / np.add.reduceat(length, first)
    tip = 0.5 * (cuts.ends[:, :3] + cuts.ends[:, 3:6])
    out = []
    for phi in (low, 0.5 * (low + high), high):
        T, n = engagement.frames[:, 0], engagement.frames[:, 1]
        out.append(tip + rho[:, None] * (np.sin(phi)[:, None] * T + np.cos(phi)[:, None] * n))
    xy = floor.on(floor.parameters(np.concatenate(out)) * floor.box)
    return np.asarray((xy / floor.box).reshape(3, len(cuts), 2))


def _greatest(cuts: Cuts, C: Floats, inputs: WallInputs) -> Floats:
    """Greatest |C . F| over a revolution (k, c) of places with C (k, c, 3)."""
    cutter, engagement = cuts.cutter, cuts.engagement
    pitch = math.tau / cutter.flutes if cutter.teeth_alike else math.tau
    count = math.ceil(pitch / TURN)
    force = in_work(
        forces_over_turn(engagement, cutter, inputs.cut.material, np.arange(count) * (pitch / count))[0],
        engagement.frames,
    )
    return np.asarray(np.abs(np.einsum("kci,cmi->kcm", C, force)).max(axis=2))


def floor_finish(places: Places, removal: Removal, left: Sequence[Floats], side: int, error: Floats) -> Finish:
    """Form error of a floor by its last pass."""
    inputs = places.inputs
    number = inputs.body.side_numbers[side]
    floor = require_stated(inputs.floor(number), "floor")
    parameters = np.linspace(0.0, 1.0, POINTS[0]), np.linspace(0.0, 1.0, POINTS[1])
    u, v = np.meshgrid(*parameters, indexing="ij")
    # what no cutter of this diameter reaches, in corners between walls, is no error of deflection
    area = inputs.floor_area(number)
    reach = area.centres.buffer(inputs.cut.cutter.radius - inputs.cut.cutter.corner_radius)
    xy = floor.on_part(reach, np.column_stack([u.ravel(), v.ravel()]) * floor.box)
    uv = xy / floor.box
    points = floor.at(*uv.T)
    unsure = error_at(inputs.body.places, error, *uv.T).reshape(u.shape)
    found = floor_error(
        removal.cuts, inputs.cut.material, points, places.pressed(left, side, uv), NEAR * inputs.body.allowance[number]
    )
    shape = u.shape
    return Finish(
        number,
        points.reshape(*shape, 3),
        found.error.reshape(shape),
        np.zeros(shape),
        found.made.reshape(shape),
        unsure,
        parameters,
    )
