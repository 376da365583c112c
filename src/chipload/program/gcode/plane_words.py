"""What the words of G68.2 state about a tilted plane: Euler angles, roll-pitch-yaw, three points, two vectors.

Notation: P says how. Without P, or P0: the origin X Y Z and Euler angles I J K. P1: the origin, and turns by I, J and K
about X, Y and Z of the work offset; the digits of Q say in which order, 123 without it. P2: three blocks with Q1, Q2
and Q3, each a point X Y Z: the origin, a point on X of the plane, and one on the side of its Y. P3: two blocks, Q1
with the origin and a vector I J K along X, Q2 with a vector along Z. R = R3 R2 R1 for turns about fixed axes.

Reference: Fanuc B-63944EN-1, "Tilted Working Plane Command"; Mazak, Programming Manual EIA/ISO, "Inclined-plane
machining". Differs from source: a block with Q0, which shifts and turns the plane of P2, is not read, nor are P4 and
the angle between the vectors of P3.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from chipload.program.tilt import Tilt, of_vectors, tilt_of, turn_matrix

#: Q of Euler angles of a Haas
EULER = 313.0
#: order of turns without Q
USUAL_ORDER = 123.0
_EULER, _TURNS, _POINTS, _VECTORS = 0.0, 1.0, 2.0, 3.0
#: blocks of a plane by its P
_BLOCKS = {_POINTS: (1.0, 2.0, 3.0), _VECTORS: (1.0, 2.0)}


@dataclass
class PlaneBlocks:
    """The blocks of a plane that is stated in several: P, and the words of each by Q."""

    kind: float = -1.0
    words: dict[float, dict[str, float]] = field(default_factory=dict)

    @property
    def is_open(self) -> bool:
        """Whether a block of the plane is still missing."""
        return bool(self.words)


def stated_plane(words: Mapping[str, float], scale: float, blocks: PlaneBlocks) -> Tilt | None:
    """The plane that a block states or completes; None: it is not read, or another block is missing.

    Parameters
    ----------
    words : of the block, X Y Z in units of the text, I J K in degrees or along a vector
    scale : mm in a unit
    blocks : those before it; it is kept there if another one is missing

    >>> blocks = PlaneBlocks()
    >>> stated_plane({"p": 3.0, "q": 1.0, "x": 5.0, "i": 1.0}, 1.0, blocks), blocks.is_open
    (None, True)
    >>> plane = stated_plane({"p": 3.0, "q": 2.0, "j": -1.0}, 1.0, blocks)
    >>> plane.direction.tolist(), plane.origin
    ([0.0, -1.0, 0.0], (5.0, 0.0, 0.0))
    """
    kind = words.get("p", _EULER)
    needed = _BLOCKS.get(kind)
    if needed is not None:
        if blocks.kind != kind:
            blocks.kind, blocks.words = kind, {}
        place = words.get("q", 0.0)
        if place not in needed:
            blocks.words = {}
            return None
        blocks.words[place] = dict(words)
        if len(blocks.words) < len(needed):
            return None
        given, blocks.words = blocks.words, {}
        origin = _vector(given[1.0], "xyz") * scale
        if kind == _VECTORS:
            return tilt_of(of_vectors(_vector(given[1.0], "ijk"), _vector(given[2.0], "ijk")), tuple(origin))
        along, beside = (_vector(given[q], "xyz") * scale - origin for q in (2.0, 3.0))
        return tilt_of(of_vectors(along, np.cross(along, beside)), tuple(origin))
    blocks.words = {}
    if "r" in words:
        return None
    angles, origin = _vector(words, "ijk"), _vector(words, "xyz") * scale
    if kind == _EULER and words.get("q", EULER) == EULER:
        return tilt_of(turn_matrix("zxz", tuple(angles)), tuple(origin))
    order = f"{words.get('q', USUAL_ORDER):g}"
    if kind != _TURNS or sorted(order) != ["1", "2", "3"]:
        return None
    axes = [int(digit) - 1 for digit in reversed(order)]
    return tilt_of(turn_matrix("".join("xyz"[k] for k in axes), tuple(angles[axes])), tuple(origin))


def _vector(words: Mapping[str, float], letters: str) -> NDArray[np.float64]:
    return np.array([words.get(x, 0.0) for x in letters])
