"""Cycles that mill a face in parallel passes, level below level.

Notation: the face runs from 0 to ``length`` along x and from 0 to ``width`` along y (either may be below 0); z in the
coordinates of the program [mm]. A pass ends ``beyond`` the face, where its cutter has left it, or at its border. Steps
are those of a pocket (:mod:`chipload.program.pocket_cycles`).

The passes are as far apart as one another, at most ``step``; the last one ends level with the far side of the face. The
face, the floor and the levels are those that the cycle states; the places of the passes are the control's own.

Reference: Heidenhain, TNC 640 Cycle Programming, "Face milling".
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

from chipload.errors import InputError
from chipload.program.commands import LINE, RAPID
from chipload.program.pocket_cycles import MOST_RINGS, Step


@dataclass(frozen=True)
class FaceCycle:
    """A face and how it is cut [mm, and feeds that the reader takes as they are].

    Parameters
    ----------
    length, width : along x and y, either sign
    tool_radius : of the cutter
    step : most between passes
    side : the cutter stops so far beside the face
    unidirectional : each pass goes along x; between them the tool goes back above the face
    over_border : the tool goes from pass to pass over the border of the face, not beside it
    feed, between_feed : of the passes, and of the ways between them and down
    """

    length: float
    width: float
    tool_radius: float
    step: float
    side: float
    unidirectional: bool
    over_border: bool
    feed: float
    between_feed: float


def face_steps(face: FaceCycle, clear: float, passes: list[float]) -> Iterator[Step]:
    """Mill a face at each of the levels, from ``clear`` above it, and back there.

    Raises
    ------
    InputError
        The step is none, the cutter's diameter is less, or there are too many passes.
    """
    if not 0.0 < face.step <= 2.0 * face.tool_radius:
        raise InputError(
            f"a face with passes {face.step:g} mm apart: must be above 0 and at most the diameter of the tool, "
            f"{2 * face.tool_radius:g} mm"
        )
    along, across = math.copysign(1.0, face.length), math.copysign(1.0, face.width)
    count = math.ceil(abs(face.width) / face.step - 1e-9)
    if not 1 <= count <= MOST_RINGS:
        raise InputError(f"a face of {count} passes: must be from 1 to {MOST_RINGS}")
    places = [across * (abs(face.width) * (k + 1) / count - face.tool_radius) for k in range(count)]
    out = face.tool_radius + face.side
    near, far = -along * out, face.length + along * out
    # from pass to pass the middle of the tool stays over the border
    low, high = (0.0, face.length) if face.over_border else (near, far)
    for level, z in enumerate(passes):
        order = places if face.unidirectional or level % 2 == 0 else places[::-1]
        yield RAPID, near, order[0], clear, 0.0, (0.0, 0.0), 0
        yield LINE, near, order[0], z, face.between_feed, (0.0, 0.0), 0
        for k, y in enumerate(order):
            forth = face.unidirectional or k % 2 == 0
            ends = (near if k == 0 else low, far if k == count - 1 else high)
            if not forth:
                ends = (high, near if k == count - 1 else low)
            if k and not face.unidirectional:
                yield LINE, ends[0], y, z, face.feed if face.over_border else face.between_feed, (0.0, 0.0), 0
            elif k:
                yield RAPID, ends[0], y, clear, 0.0, (0.0, 0.0), 0
                yield LINE, ends[0], y, z, face.between_feed, (0.0, 0.0), 0
            yield LINE, ends[1], y, z, face.feed, (0.0, 0.0), 0
            if face.unidirectional:
                yield RAPID, ends[1], y, clear, 0.0, (0.0, 0.0), 0
        last = near if count % 2 == 0 and not face.unidirectional else far
        yield RAPID, last, order[-1], clear, 0.0, (0.0, 0.0), 0
