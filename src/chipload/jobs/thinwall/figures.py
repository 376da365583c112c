"""Presentation of a thin-wall result: sections of the report, scene, programs."""

from __future__ import annotations

from functools import partial

import trimesh

from chipload.jobs.thinwall.outcome import ThinWallResult
from chipload.jobs.thinwall.part_shape import PartShape
from chipload.jobs.thinwall.scene import scene_bytes
from chipload.jobs.thinwall.sections import sections_of
from chipload.program.apt.writer import write_apt
from chipload.program.gcode.writer import write_commands
from chipload.report.presentation import Blank, Presentation
from chipload.report.programs import ENDINGS, program_name
from chipload.result import Result, release_of


def presentation_of(walled: ThinWallResult) -> Presentation:
    """The presentation of a thin wall."""
    return Presentation(
        partial(sections_of, walled),
        partial(scene_bytes, walled),
        partial(program_files, walled),
        partial(_blanks, walled),
    )


def _blanks(walled: ThinWallResult) -> dict[str, Blank]:
    """The workpiece before, the same for every variant."""
    mesh = trimesh.Trimesh(*walled.geometry.stock, process=True)
    return {name: Blank(mesh, walled.planning.cutters) for name in walled.variants} if mesh.is_watertight else {}


def _frame(walled: ThinWallResult) -> str:
    """The coordinates of the program, in words."""
    if isinstance(walled.geometry.shape, PartShape):
        return "coordinates are those of the part's model"
    return "Z 0 is the clamp, X along the wall, its sides towards Y+ and Y-"


def program_files(walled: ThinWallResult, result: Result) -> dict[str, bytes]:
    """The program of each variant for the machine and as CL data; the first line states the verdict of the job."""
    out: dict[str, bytes] = {}
    cutters = walled.planning.cutters
    for k, (name, one) in enumerate(walled.variants.items()):
        title = f"{walled.title}, operation 0, thinwall, {name}"
        comments = [
            f"T{c.number}: D {c.diameter:g} mm, corner {c.corner_radius:g} mm, {c.flutes} flutes, overhang "
            f"{c.overhang:g} mm"
            for c in cutters.values()
        ]
        comments += [f"{_frame(walled)}; machine {walled.planning.machine.name}"]
        comments += [
            f"G43 H{c.number} must be the overhang of {c.overhang:g} mm: the rotary axes turn about it"
            for c in cutters.values()
        ]
        stem = program_name(0, name)
        file, cl = f"{stem}.{ENDINGS[walled.planning.machine.dialect]}", f"{stem}.apt"
        text = write_commands(
            one.commands, walled.planning.machine, title=title, release=release_of(result, file), comments=comments,
            number=100 + k,
        )  # fmt: skip
        out[file] = text.encode("ascii")
        out[cl] = write_apt(one.program, cutters, title=title, release=release_of(result, cl)).encode("ascii")
    return out
