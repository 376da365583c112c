"""A pass over a wall or floor as a program: its motions, with the contact point and planned depth of each row."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chipload.errors import InputError
from chipload.planning.thinwall.paths import PassMotion
from chipload.program.program import LINE, RAPID, Program

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class PassProgram:
    """One pass as a program, with the side, contact point and planned depth of its rows.

    Attributes
    ----------
    program : from the safe height to the safe height; ``line`` counts the rows of the whole program from 1
    side : number of the side
    contact : (k,) bool, rows that end at a contact point
    points, normals : (k, 3) float [mm], q and n of those rows; 0 elsewhere
    place : (k, 2) float, u and v
    depth : (k,) float [mm], planned; 0 beyond the edges
    operation : number of the operation
    """

    program: Program
    side: int
    contact: NDArray[np.bool_]
    points: Floats
    normals: Floats
    place: Floats
    depth: Floats
    operation: int = 0


@dataclass(frozen=True)
class Margins:
    """Distances of links.

    Parameters
    ----------
    beyond : length by which rows run on beyond the edges of the wall [mm]
    safe : safe height z of the tip [mm]
    sag : greatest deviation of a link from its distance to the surface [mm]

    Raises
    ------
    InputError
        A distance is not above 0.
    """

    beyond: float
    safe: float
    sag: float

    def __post_init__(self) -> None:
        for key in ("beyond", "safe", "sag"):
            if not 0.0 < getattr(self, key) < math.inf:
                raise InputError(f"margins.{key}_mm = {getattr(self, key):g}: must be above 0")


class PassPath:
    """Path of a pass under construction: a list of motions, to which each method adds.

    Attributes
    ----------
    points, axes : tip (3,) [mm] and unit axis (3,) of each motion
    motion : RAPID or LINE
    ratio : speed of the tip over that of the corner's centre; 0 of rapids
    at : number of a motion that ends at a contact point -> point (3,) [mm], normal (3,), u and v (2,), depth [mm]
    """

    def __init__(self) -> None:
        self.points: list[Floats] = []
        self.axes: list[Floats] = []
        self.motion: list[int] = []
        self.ratio: list[float] = []
        self.at: dict[int, tuple[Floats, Floats, Floats, float]] = {}

    def rapid(self, tip: Floats, axis: Floats) -> None:
        """Add a rapid to a tip (3,) [mm] and axis (3,); none if the tool is there."""
        if self.points and np.allclose(tip, self.points[-1], atol=1e-9) and np.allclose(axis, self.axes[-1], atol=1e-9):
            return
        self._add(tip, axis, RAPID, 0.0)

    def line(self, tip: Floats, axis: Floats, centre: Floats, before: Floats) -> None:
        """Add a feed motion to a tip and axis.

        Parameters
        ----------
        tip, axis : (3,) [mm], (3,)
        centre, before : (3,) of the corner's centre [mm] at the end and at the beginning of the motion, whose speed is
            the feed
        """
        length = float(np.linalg.norm(centre - before))
        own = float(np.linalg.norm(tip - self.points[-1]))
        self._add(tip, axis, LINE, own / length if self.motion[-1] == LINE and length > 0.0 else 1.0)

    def known(self, point: Floats, normal: Floats, place: Floats, depth: float) -> None:
        """Record contact point (3,) [mm], normal (3,), u and v (2,), and depth [mm] at the end of the last motion."""
        self.at[len(self.points) - 1] = (point, normal, place, depth)

    def _add(self, tip: Floats, axis: Floats, motion: int, ratio: float) -> None:
        self.points.append(tip)
        self.axes.append(axis)
        self.motion.append(motion)
        self.ratio.append(ratio)

    def pass_program(self, side: int, pass_motion: PassMotion, label: str) -> PassProgram:
        """Return the program of the motions so far."""
        count = len(self.points)
        zero, none = np.zeros((count, 3)), np.zeros(count, dtype=np.int64)
        program = Program(
            motion=np.array(self.motion),
            p_work=np.array(self.points),
            axis=np.array(self.axes),
            centre=zero,
            normal=np.tile([0.0, 0.0, 1.0], (count, 1)),
            turns=none,
            feed=pass_motion.feed * np.array(self.ratio),
            spindle=np.full(count, pass_motion.spindle if pass_motion.posture.clockwise else -pass_motion.spindle),
            tool=np.full(count, pass_motion.posture.cutter.number),
            line=none,
            label=none,
            labels=(label,),
        )
        at = np.array(sorted(self.at))
        points, normals, place, depth = zero.copy(), zero.copy(), np.zeros((count, 2)), np.zeros(count)
        for k in at.tolist():
            points[k], normals[k], place[k], depth[k] = self.at[k]
        contact = np.zeros(count, dtype=np.bool_)
        contact[at] = True
        return PassProgram(program, side, contact, points, normals, place, depth)
