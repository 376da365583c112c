"""Presentation of a thin-wall result: sections of the report, scene, programs."""

from __future__ import annotations

from functools import partial

from chipload.jobs.thinwall.outcome import ThinWallResult
from chipload.jobs.thinwall.program_text import program_file, program_text, program_title
from chipload.jobs.thinwall.scene import scene_bytes
from chipload.jobs.thinwall.sections import sections_of
from chipload.lazy import trimesh
from chipload.program.apt.writer import write_apt
from chipload.program.release import NOT_SIMULATED, release_of_text
from chipload.report.presentation import Blank, Presentation
from chipload.report.programs import program_name
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


def program_files(walled: ThinWallResult, result: Result) -> dict[str, bytes]:
    """The program of each variant for the machine and as CL data; the first line states the verdict of the job."""
    out: dict[str, bytes] = {}
    for name, one in walled.variants.items():
        file, cl = program_file(walled, one), f"{program_name(0, name)}.apt"
        text = program_text(walled, one, NOT_SIMULATED)
        release = release_of_text(text, walled.texts[name], release_of(result, file))
        out[file] = program_text(walled, one, release).encode("ascii")
        title, release = program_title(walled, one), release_of(result, cl)
        out[cl] = write_apt(one.program, walled.planning.cutters, title=title, release=release).encode("ascii")
    return out
