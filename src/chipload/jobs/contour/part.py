"""The part of a job: its contours from a drawing or from a planar face of a model."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from chipload.errors import Finding, InputError
from chipload.geometry.chains import Drawing
from chipload.geometry.contour import Contour
from chipload.geometry.dxf import read_dxf
from chipload.geometry.even_odd import even_odd
from chipload.geometry.step import StepLevel, read_step_level
from chipload.jobs.contour.job import ContourJob
from chipload.jobs.contour.walls import find_walls
from chipload.machine.machine import Machine

#: heights of a model that are one [mm]
HEIGHT_MM = 1e-3


def read_part(job: ContourJob) -> tuple[tuple[Contour, ...], tuple[Contour, ...], tuple[Finding, ...]]:
    """Contours of the drawing or of the planar face, those of the stock's outline, and findings of the reader.

    Raises
    ------
    InputError
        The file cannot be read, has no such layer, or holds contours that cannot be used together.
    """
    part = job.table.part
    ending = job.part_file.suffix.lower()
    if part.stock_layers and ending != ".dxf":
        raise InputError(f"part.stock_layers: {part.file} has no layers: only a drawing (.dxf) has")
    if ending == ".dxf":
        drawing = read_dxf(
            job.part_file,
            units=part.units,
            units_if_unstated=part.units_if_unstated,
            layers=(*part.layers, *part.stock_layers) if part.layers else None,
            join_mm=part.join_mm,
            tolerance_mm=part.tolerance_mm,
        )
    elif ending in (".step", ".stp"):
        face = read_step_level(job.part_file, z_mm=part.face_z_mm, join_mm=part.join_mm, tolerance_mm=part.tolerance_mm)
        require_heights(job, face)
        drawing = face.drawing
    else:
        raise InputError(f"part.file = {part.file}: must end in .dxf, .step or .stp, or be a program")
    outline, contours = _stock_outline(part.stock_layers, drawing) if part.stock_layers else ((), drawing.contours)
    contours, outline = move_contours(contours, part.origin_mm), move_contours(outline, part.origin_mm)
    kept, left_out = closed_alone(contours) if part.open_chains == "dropped" else (contours, ())
    used, crossings = clear_of_each_other(kept)
    found = tuple(replace(f, text=f"part: {f.text}") for f in (*drawing.findings, *left_out, *crossings))
    return used, outline, (*found, *find_walls(job, used))


def require_heights(job: ContourJob, face: StepLevel) -> None:
    """Refuse pockets that end below the face of a model, and rapids below its top.

    Raises
    ------
    InputError
        One does; the message states the depth, or the clearance, with which it does not.
    """
    top, file = job.table.stock.top_mm, job.table.part.file
    for k, op in enumerate(job.operations):
        key, depth = ("axial_depth_mm", op.axial_depth_mm) if op.depth_mm is None else ("depth_mm", op.depth_mm)
        if op.kind == "pocket" and top - depth < face.level - HEIGHT_MM:
            raise InputError(
                f"operation.{k}.{key} = {depth:g}: the pocket ends at z = {top - depth:.6g} mm, below the face at "
                f"z = {face.level:.6g} mm of {file}: must be at most {top - face.level:.6g}, or check stock.top_mm"
            )
        if top + op.clearance_mm < face.top - HEIGHT_MM:
            raise InputError(
                f"operation.{k}.clearance_mm = {op.clearance_mm:g}: rapids go at z = {top + op.clearance_mm:.6g} mm "
                f"above stock.top_mm = {top:g}, and {file} rises to z = {face.top:.6g} mm: must be at least "
                f"{face.top - top:.6g}, or state the top of the stock"
            )


def move_contours(contours: Sequence[Contour], origin: tuple[float, float]) -> tuple[Contour, ...]:
    """The contours in a frame whose origin is a place of the drawing [mm]."""
    if origin == (0.0, 0.0):
        return tuple(contours)
    shift = np.array([*origin, *origin, *origin, 0.0])
    out = []
    for c in contours:
        rows = c.segments - shift
        rows[:, 4:6] = np.where(rows[:, 6:7] != 0.0, rows[:, 4:6], 0.0)
        out.append(Contour(rows))
    return tuple(out)


def require_within_travel(contours: Sequence[Contour], machine: Machine, radius: float) -> None:
    """Refuse contours that the centre of a cutter cannot follow, on whichever side of them it runs.

    Raises
    ------
    InputError
        The centre has farther to go than X or Y travels, wherever the work lies; radius [mm].
    """
    if machine.chain.rotary or not contours:
        return
    boxes = np.array([c.bounds for c in contours])
    for k, axis in enumerate("XY"):
        low, high = float(boxes[:, k].min()), float(boxes[:, 2 + k].max())
        least, most = machine.limits[k]
        if high - low - 2.0 * radius > most - least:
            raise InputError(
                f"part: {axis} from {low:.6g} to {high:.6g} mm: machine {machine.name} travels {most - least:g} mm: "
                "name a machine with more travel, or check part.units"
            )


def closed_alone(contours: Sequence[Contour]) -> tuple[tuple[Contour, ...], tuple[Finding, ...]]:
    """The closed contours, and where the others begin.

    Raises
    ------
    InputError
        None is closed.
    """
    closed, chains = tuple(c for c in contours if c.closed), [c for c in contours if not c.closed]
    if not closed:
        raise InputError('part.open_chains = "dropped": no contour is closed: close them (part.join_mm), or drop none')
    if not chains:
        return closed, ()
    x, y = chains[0].start
    count = f"{len(chains)} open chain{'s' if len(chains) > 1 else ''}"
    return closed, (Finding("part-open", 0, f"{count} dropped, the first from ({x:.6g}, {y:.6g})"),)


def clear_of_each_other(contours: tuple[Contour, ...]) -> tuple[tuple[Contour, ...], tuple[Finding, ...]]:
    """Closed contours that cross or touch as contours of their even-odd area, and where they meet; others unchanged.

    Raises
    ------
    InputError
        Their area has no clear outline.
    """
    if not all(c.closed for c in contours):
        return contours, ()
    made, places = even_odd(contours)
    if not len(places):
        return contours, ()
    x, y = places[0]
    count = f"{len(places)} places" if len(places) > 1 else "one place"
    text = f"contours meet in {count}, the first ({x:.6g}, {y:.6g}): what an even number of them encloses is not cut"
    return made, (Finding("part-crossing", 0, text),)


def _stock_outline(layers: Sequence[str], drawing: Drawing) -> tuple[tuple[Contour, ...], tuple[Contour, ...]]:
    """The contours on the layers of the stock, and the others."""
    wanted = {name.casefold() for name in layers}
    known = {name.casefold() for name in drawing.layers}
    for name in layers:
        if name.casefold() not in known:
            raise InputError(f"part.stock_layers: no contour on layer {name!r}; layers there are: {sorted(known)}")
    pairs = list(zip(drawing.contours, drawing.layers, strict=True))
    outline = tuple(c for c, layer in pairs if layer.casefold() in wanted)
    rest = tuple(c for c, layer in pairs if layer.casefold() not in wanted)
    if not rest:
        raise InputError("part.stock_layers: every contour is on these layers: name those of the stock only")
    return outline, rest
