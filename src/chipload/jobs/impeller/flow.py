"""Direction of the flow through an impeller: as the job states it, or by its shape.

Notation: see ``planning/impeller/impeller.py``; z axis of rotation, the flow comes in against it. An impeller is milled
with the narrow end of its hub upwards. A hub whose ends are as wide as one another tells nothing: then the thicker edge
of the blades is taken as the leading one.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from chipload.errors import InputError
from chipload.geometry.revolve import Revolved
from chipload.geometry.sections import loft, read_meridian, read_sections
from chipload.geometry.step_faces import Face
from chipload.geometry.step_meridian import meridian_of
from chipload.jobs.impeller.tables import ImpellerTable, SectionsTable
from chipload.jobs.tables import require_stated

Floats = NDArray[np.float64]
#: a hub whose ends differ by less than this share of the radius has no wide end; likewise edges of blades
SAME_RADIUS = 0.02
#: how far from its edges the thickness of a blade is measured, as a share of its length
_EDGE = 0.04

_CYCLE = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
_OVER = np.diag([1.0, -1.0, -1.0])
#: rotation from a file's frame to that whose axis is z, by the way the flow comes in; +x as sections with flow_along_x
AGAINST_Z = {"-z": np.eye(3), "-x": _CYCLE, "-y": _CYCLE @ _CYCLE}
AGAINST_Z |= {key.replace("-", "+"): _OVER @ R for key, R in AGAINST_Z.items()}


def require_narrow_end_up(hub: Revolved, part: ImpellerTable) -> None:
    """Refuse a part whose hub widens upwards: the stated flow contradicts the geometry, and no cutter from above would
    reach between the blades.
    """
    low, high = _end_radii(hub.meridian)
    if high <= (1.0 + SAME_RADIUS) * low:
        return
    key, value, other = "impeller.sections.flow_along_x", "true", "false"
    if part.step is not None:
        key, value = "impeller.step.flow", str(part.step.flow)
        other = ("-" if value.startswith("+") else "+") + value[1:]
    elif not require_stated(part.sections, "impeller.sections").flow_along_x:
        value, other = other, value
    raise InputError(
        f"{key} = {value}: the hub would be {high:.4g} mm in radius at its upper end, {low:.4g} mm at the table: the "
        f"part is milled with the narrow end of its hub upwards: state {other}"
    )


def flow_of_sections(folder: Path, table: SectionsTable) -> tuple[bool, str]:
    """Whether the flow comes along the axis of the files, and what tells it.

    Raises
    ------
    InputError
        Both ends of the hub are as wide as one another, and both edges of the blade as thick.
    """
    low, high = _end_radii(read_meridian(folder / table.hub, table.unit, axis=table.axis))
    if max(low, high) > (1.0 + SAME_RADIUS) * min(low, high):
        return high > low, "by the hub, whose narrow end is up"
    names = [folder / name for name in table.blade]
    blade = loft(read_sections(names, table.unit, False, table.columns, table.axis))
    u, v = (x.ravel() for x in np.meshgrid([_EDGE, 1.0 - _EDGE], np.linspace(0.1, 0.9, 9), indexing="ij"))
    upper, lower = np.linalg.norm(blade.plus.at(u, v) - blade.minus.at(u, v), axis=1).reshape(2, -1).mean(axis=1)
    if max(upper, lower) > (1.0 + SAME_RADIUS) * min(upper, lower):
        return bool(lower > upper), "by the blade, whose thicker edge is the leading one"
    raise InputError(
        f"impeller.sections.flow_along_x: missing: the hub is {low:.4g} and {high:.4g} mm in radius at its ends, the "
        f"blade {lower:.3g} and {upper:.3g} mm thick near its edges, which do not tell where the flow comes from: "
        "state true or false"
    )


def flow_of_faces(faces: Sequence[Face], key: str) -> tuple[str, str]:
    """Direction of the flow in a STEP file, a key of :data:`AGAINST_Z`, by the faces of its hub, and what tells it.

    Raises
    ------
    InputError
        The faces are not of revolution about an axis of the file, or their ends are as wide as one another.
    """
    for axis in "xyz":
        meridian = _meridian_if_any(faces, AGAINST_Z[f"-{axis}"], key)
        if meridian is None:
            continue
        low, high = _end_radii(meridian)
        if max(low, high) <= (1.0 + SAME_RADIUS) * min(low, high):
            raise InputError(
                f"impeller.step.flow: missing: the hub is {low:.4g} and {high:.4g} mm in radius at its ends, which do "
                f"not tell where the flow comes from: state +{axis} or -{axis}"
            )
        return ("-" if low > high else "+") + axis, "by the hub, whose narrow end is up"
    raise InputError(
        f"impeller.step.flow: missing: {key} is of revolution about no axis of the file: state the direction of the "
        "incoming flow, for example -z"
    )


def _meridian_if_any(faces: Sequence[Face], R: Floats, key: str) -> Floats | None:
    """The meridian of faces about an axis, or nothing where they are not of revolution about it."""
    try:
        return meridian_of(faces, R, key)
    except InputError:
        return None


def _end_radii(meridian: Floats) -> tuple[float, float]:
    """Radii of a meridian at its lower and at its upper end [mm]."""
    z = meridian[:, 1]
    return float(meridian[z.argmin(), 0]), float(meridian[z.argmax(), 0])
