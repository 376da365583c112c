"""A thin wall between two faces of a STEP file.

Notation: front and back as in the job; v from what is clamped to the free edge, u along it.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from chipload.errors import InputError
from chipload.geometry.bspline import BSplinePatch
from chipload.geometry.sides import wall_of
from chipload.geometry.step_faces import ON, Face, Model, Name, read_faces
from chipload.geometry.step_patch import patch_of
from chipload.geometry.thin_wall import ThinWall, opposite, through_sections
from chipload.jobs.tables import FaceName, require_stated
from chipload.jobs.thinwall.job import ThinWallJob

Floats = NDArray[np.float64]

_FIT = 0.001
_FINE = np.linspace(0.0, 1.0, 1001)


def wall_of_faces(job: ThinWallJob) -> ThinWall:
    """The wall of a job that names two faces.

    Raises
    ------
    InputError
        The file cannot be read, or the faces are not the sides of a wall.
    """
    w = job.wall
    model, fit = read_faces(job.section_files[0], "wall.file"), w.fit_mm or _FIT
    named: dict[str, FaceName] = {
        key: require_stated(getattr(w, key), f"wall.{key}") for key in ("front", "back", "clamp")
    }
    front, back = (model.face(named[key], f"wall.{key}") for key in ("front", "back"))
    if front.number == back.number:
        raise InputError(f"wall.back: face {back.number} is wall.front too: state the opposite face")
    patches = [patch_of(f, f"wall.{key}", fit) for f, key in ((front, "front"), (back, "back"))]
    made = wall_of(patches[0].patch, patches[1].patch, _clamp(model, named["clamp"], front, patches[0].patch))
    name = f"wall between faces {front.number} and {back.number} of {model.file.name}"
    wall = opposite(through_sections(made, w.edge_share or 0.0, w.span or (0.0, 1.0), name))
    if model.solid:
        middle = made.plus.at(0.5, 0.5)[0] - made.minus.at(0.5, 0.5)[0]
        if made.plus.normal(0.5, 0.5)[0] @ middle < 0.0:
            raise InputError(f"{name}: no material between them: state the two sides of a wall, not of a slot")
    return ThinWall(f"{name} (front {patches[0]}; back {patches[1]})", wall.at)


def _clamp(model: Model, clamp: Name, front: Face, patch: BSplinePatch) -> Callable[[Floats], float]:
    """Mean distance [mm] of points of a side from what is clamped; one of the front's sides must lie there."""
    sides = [patch.at(_FINE, 0.0), patch.at(_FINE, 1.0), patch.at(0.0, _FINE), patch.at(1.0, _FINE)]
    if isinstance(clamp, int):
        clamped_face = model.face(clamp, "wall.clamp")

        def away(points: Floats) -> float:
            return float(np.mean([clamped_face.distance(p) for p in points.tolist()]))

        least = min(away(p[::100]) for p in sides)
        if least > ON:
            raise InputError(
                f"wall.clamp: face {clamp} lies {least:.4g} mm off the nearest side of face {front.number}: must touch "
                "it along a side, or state a point of the edge that is clamped"
            )
        return away
    point = np.asarray(clamp, dtype=np.float64)
    near = [_to_polyline(point, p) for p in sides]
    place = f"wall.clamp = [{', '.join(f'{x:g}' for x in clamp)}]"
    if min(near) > ON:
        raise InputError(
            f"{place}: lies {min(near):.4g} mm off the nearest edge of face {front.number}: must be within {ON:g} mm "
            "(mm, in the frame of the file)"
        )
    if sum(d <= ON for d in near) > 1:
        raise InputError(f"{place}: lies at a corner of face {front.number}: take a point within the edge")
    return lambda points: _to_polyline(point, points)


def _to_polyline(point: Floats, line: Floats) -> float:
    """Distance [mm] of a point to a polyline (n, 3)."""
    a, d = line[:-1], np.diff(line, axis=0)
    size = (d * d).sum(axis=1)
    share = np.clip(((point - a) * d).sum(axis=1) / np.where(size > 0.0, size, 1.0), 0.0, 1.0)
    return float(np.linalg.norm(a + share[:, None] * d - point, axis=1).min())
