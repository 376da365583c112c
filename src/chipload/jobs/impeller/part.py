"""Part of an impeller job: by formula, through sections of points, or from faces of a STEP file.

Notation: see ``planning/impeller/impeller.py``; z axis of rotation, the flow comes in against it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from chipload.errors import InputError
from chipload.geometry.bspline import BSplinePatch
from chipload.geometry.overlap import splitter_apart
from chipload.geometry.revolve import Revolved
from chipload.geometry.sections import Blade, check_sections, checked_diameter, loft, read_meridian, read_sections
from chipload.geometry.sides import blade_of, foot_off, radius_of
from chipload.geometry.step_faces import Face, Model, Name, read_faces
from chipload.geometry.step_meridian import meridian_of
from chipload.geometry.step_patch import four_sided, patch_of
from chipload.geometry.step_side import side_of
from chipload.jobs.impeller.flow import AGAINST_Z, flow_of_faces, flow_of_sections, require_narrow_end_up
from chipload.jobs.impeller.job import ImpellerJob
from chipload.jobs.impeller.tables import ImpellerTable, SectionsTable, ShapeTable, StepTable
from chipload.jobs.tables import require_stated
from chipload.planning.impeller.fillets import with_fillets
from chipload.planning.impeller.impeller import Impeller
from chipload.planning.impeller.parametric import ImpellerShape, impeller_of
from chipload.planning.impeller.surfaces import BODIES

Floats = NDArray[np.float64]
#: faces of one side
Names = Name | tuple[Name, ...]


@dataclass(frozen=True, eq=False)
class ImpellerPart:
    """An impeller, and a line on each face that was read and on each side with fillets."""

    impeller: Impeller
    faces: tuple[str, ...] = ()


def read_part(job: ImpellerJob) -> ImpellerPart:
    """The impeller of a job.

    Raises
    ------
    InputError
        A file cannot be used, or its numbers are not those of an impeller.
    """
    part = job.table.impeller
    plain = _without_fillets(job)
    if _states_flow(part):
        require_narrow_end_up(plain.impeller.hub, part)
    if part.fillet_mm is None:
        return plain
    made, fillet_lines = with_fillets(plain.impeller, part.fillet_mm)
    named = {(s.body, s.side) for s in job.table.surface}
    names = [(b, f"{k} fillet") for b in BODIES[: len(made.bodies)] for k in ("plus", "minus")]
    left = [" ".join(name) for name in names if name not in named]
    rest_text = (f"not milled: no [[surface]] names it: {', '.join(left)}",) if left else ()
    return ImpellerPart(made, (*plain.faces, *fillet_lines, *rest_text))


def _states_flow(part: ImpellerTable) -> bool:
    if part.step is not None:
        return part.step.flow is not None
    return part.sections is not None and part.sections.flow_along_x is not None


def _without_fillets(job: ImpellerJob) -> ImpellerPart:
    part = job.table.impeller
    if part.step is not None:
        return _of_step(job.files, part.step, part.blades, part.outer_diameter_mm)
    if part.sections is not None:
        folder, given = job.path.parent, part.sections
        over, reason = given.flow_along_x, ""
        if over is None:
            over, reason = flow_of_sections(folder, given)
        made = _of_sections(folder, given, over, part.blades, part.outer_diameter_mm)
        flow_text = f"flow: {'along' if over else 'against'} the axis of the files, {reason}"
        return ImpellerPart(made, (flow_text,) if reason else ())
    return ImpellerPart(_of_shape(require_stated(part.shape, "impeller.shape"), part.blades, part.outer_diameter_mm))


def _of_shape(given: ShapeTable, blades: int, outer_diameter: float) -> Impeller:
    shape = ImpellerShape(
        blades, given.channel_mm, given.hub_radius_mm, 0.5 * outer_diameter, given.height_mm, given.blade_height_mm,
        math.radians(given.wrap_deg), math.radians(given.lean_deg), given.outlet_height_mm,
    )  # fmt: skip
    return impeller_of(shape)


def _of_sections(folder: Path, given: SectionsTable, over: bool, blades: int, outer_diameter: float) -> Impeller:
    """The impeller through sections of points; ``over``: the flow comes along +X of the files."""

    def blade(names: tuple[str, ...], key: str) -> tuple[Blade, tuple[Floats, ...]]:
        # a splitter is the second blade of the files that the blade is in
        body = 1 if key == "splitter" and set(names) <= set(given.blade) else 0
        try:
            paths = [folder / name for name in names]
            found = read_sections(paths, given.unit, over, given.columns, given.axis, body)
            return loft(check_sections(found, outer_diameter)), found
        except InputError as err:
            raise InputError(f"impeller.sections.{key}: {err}") from None

    main, splitter = blade(given.blade, "blade")[0], None
    if given.splitter:
        splitter, sections = blade(given.splitter, "splitter")
        try:
            splitter_apart(splitter, main, math.tau / blades, sections)
        except InputError as err:
            raise InputError(f"impeller.sections.splitter: {err}") from None
    hub, shroud = (
        Revolved(read_meridian(folder / name, given.unit, over, side < 0, given.axis), side)
        for name, side in ((given.hub, 1), (given.shroud, -1))
    )
    return Impeller(main, splitter, hub, shroud, blades)


def _of_step(files: dict[str, Path], given: StepTable, blades: int, outer_diameter: float) -> ImpellerPart:
    model, lines = read_faces(files["step"], "impeller.step.file"), list[str]()
    flow: str = given.flow or ""
    if not flow:
        at = "impeller.step.hub"
        if isinstance(given.hub, str):
            raise InputError(f"impeller.step.flow: missing: the points of {given.hub} do not tell it: state it")
        flow, reason = flow_of_faces([model.face(name, at) for name in given.hub], at)
        lines.append(f"flow: {flow} of the file, {reason}")
    R = AGAINST_Z[flow]

    def revolved(key: str, side: int) -> Revolved:
        names = getattr(given, key)
        if isinstance(names, str):
            unit = require_stated(given.unit, "impeller.step.unit")
            return Revolved(read_meridian(files[key], unit, flow.startswith("+"), side < 0), side)
        at = f"impeller.step.{key}"
        faces = [model.face(name, at) for name in names]
        numbers = [f.number for f in faces]
        for k, number in enumerate(numbers):
            if number in numbers[:k]:
                raise InputError(f"{at}: face {number} appears twice: name each face once")
        found = meridian_of(faces, R, at, tips=key == "shroud")
        (r0, z0), (r1, z1) = found[0], found[-1]
        lines.append(f"{key}: {'; '.join(map(str, faces))}: r {r0:.6g}, z {z0:.6g} to r {r1:.6g}, z {z1:.6g} mm")
        return Revolved(found, side)

    hub, shroud = revolved("hub", 1), revolved("shroud", -1)

    def blade(plus: Names, minus: Names, prefix: str) -> Blade:
        def side(key: str, names: Names) -> BSplinePatch:
            at = f"impeller.step.{prefix}{key}"
            faces = _faces(model, names, at)
            if len(faces) == 1 and four_sided(faces[0]):
                one = patch_of(faces[0], at, given.fit_mm)
                face_text, patch = str(one), one.patch.rotated(R)
            else:
                several = side_of(faces, at, given.fit_mm, R, hub, shroud)
                face_text, patch = str(several), several.patch
            lines.append(f"{prefix}{key}: {'; '.join(map(str, faces))}: {face_text}")
            return patch

        sides = [side("plus", plus), side("minus", minus)]
        try:
            made = blade_of(sides[0], sides[1], hub, shroud, math.tau / blades)
            checked_diameter(2.0 * radius_of(made), outer_diameter, "faces")
        except InputError as err:
            raise InputError(f"impeller.step.{prefix}plus and {prefix}minus: {err}") from None
        off = max(foot_off(made.plus, hub), foot_off(made.minus, hub))
        lines.append(f"{'splitter' if prefix else 'blade'}: its foot leaves the hub by at most {off:.3g} mm")
        return made

    main, splitter = blade(given.plus, given.minus, ""), None
    if given.splitter_plus is not None and given.splitter_minus is not None:
        splitter = blade(given.splitter_plus, given.splitter_minus, "splitter_")
        try:
            splitter_apart(splitter, main, math.tau / blades)
        except InputError as err:
            raise InputError(f"impeller.step.splitter_plus and splitter_minus: {err}") from None
    return ImpellerPart(Impeller(main, splitter, hub, shroud, blades), tuple(lines))


def _faces(model: Model, names: Names, key: str) -> list[Face]:
    """The faces of a side: a number, a point, or several of either."""
    if isinstance(names, int):
        return [model.face(names, key)]
    if len(names) == 3 and all(isinstance(x, int | float) for x in names):
        x, y, z = names
        return [model.face((float(x), float(y), float(z)), key)]  # type: ignore[arg-type]
    faces = [model.face(name, key) for name in names]  # type: ignore[arg-type]
    for k, one in enumerate(faces):
        if any(one.number == other.number for other in faces[:k]):
            raise InputError(f"{key}: face {one.number} appears twice: name each face once")
    return faces
