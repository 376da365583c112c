"""Guesses which faces of an impeller are the sides of its blades and which is its hub.

At least :data:`FEWEST` faces of one kind with nearly equal areas are taken as faces of the blades; the group with the
largest total area is the sides. The hub is the largest other face of revolution about an axis of the file that is
neither a plane nor a cylinder.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from chipload.errors import InputError
from chipload.geometry.step import Part
from chipload.geometry.step_faces import Face, Model, kernel_face
from chipload.geometry.step_meridian import meridian_in
from chipload.number_text import number_text

#: greatest relative difference of successive areas in a group of similar faces
LIKE = 0.01
#: least number of similar faces that are faces of blades
FEWEST = 3
#: number of faces tested for the hub, the largest first
_LOOKED = 4
_AXES = {"x": np.roll(np.eye(3), -1, axis=0), "y": np.roll(np.eye(3), 1, axis=0), "z": np.eye(3)}


def roles_of(model: Model) -> list[str]:
    """A line of text for the sides of the blades and one for the hub; none if the part is not like an impeller."""
    groups = [g for g in _similar(model.faces) if len(g) >= FEWEST and g[0].kind not in ("plane", "cylinder")]
    if not groups:
        return []
    sides = max(groups, key=lambda g: sum(f.area for f in g))
    blades = {f.number for g in groups for f in g}
    others = [f for f in model.faces if f.number not in blades and f.kind not in ("plane", "cylinder")]
    hub = None
    for face in sorted(others, key=lambda f: -f.area)[:_LOOKED]:
        for axis, R in _AXES.items():
            ends = face.part.call("step_roles.round_about", face.number, R)
            if ends and hub is None:
                hub = f"face {face.number}: of revolution about {axis}, r {ends[0]:.4g} to {ends[1]:.4g} mm: the hub?"
    if hub is None:
        return []
    numbers = ", ".join(str(f.number) for f in sides)
    low, high = min(f.area for f in sides), max(f.area for f in sides)
    return [f"{len(sides)} similar faces of {low:.4g} to {number_text(high)} mm2: sides of blades?: {numbers}", hub]


def _similar(faces: Sequence[Face]) -> list[list[Face]]:
    """Groups of faces of one kind whose successive areas, in ascending order, differ by at most :data:`LIKE`."""
    out: list[list[Face]] = []
    for face in sorted(faces, key=lambda f: (f.kind, f.area)):
        last = out[-1][-1] if out else None
        if last is not None and last.kind == face.kind and face.area <= (1.0 + LIKE) * last.area:
            out[-1].append(face)
        else:
            out.append([face])
    return [sorted(g, key=lambda f: f.number) for g in out]


# -- in the process of the CAD kernel ---------------------------------------------------------------------------
def round_about(part: Part, number: int, R: np.ndarray[tuple[int, int], np.dtype[np.float64]]) -> list[float]:
    """Least and greatest radius [mm] of a face of revolution about z after a rotation R; empty for another face."""
    try:
        curve = meridian_in(kernel_face(part, number), R, "", tips=False)
    except InputError:
        return []
    return [float(curve[:, 0].min()), float(curve[:, 0].max())]
