"""Selection of the kind of draft by the ending of a file."""

from __future__ import annotations

from pathlib import Path

from chipload.errors import InputError
from chipload.files import is_file, require_utf8
from chipload.jobs.drafts.draft import Draft

#: endings of meshes
MESHES = (".stl", ".ply", ".obj", ".3mf", ".off")


def draft_of(
    file: Path, folder: Path, *, machine: str | None = None, tools: Path | None = None, job: str | None = None
) -> Draft:
    """Return the draft of a job for a file.

    Parameters
    ----------
    file : NC text, CL data, a CAMotics project, DXF, STEP, STL, FreeCAD document, BladeGen.inf or blade sections
    folder : of the job, to which file names are relative
    machine : a shipped name or a file (TOML); None: guessed
    tools : a LinuxCNC tool table of a program, or a tool library of Fusion, whose tools are assigned by number
    job : a CAM job of a FreeCAD document, by name or label; None: the first

    Raises
    ------
    InputError
        The file is missing or cannot be used.
    """
    if not is_file(file):
        raise InputError(f"{file}: no such file: name a program, a drawing, a model or sections of a blade")
    require_utf8(file)
    ending = file.suffix.lower()
    if job is not None and ending != ".fcstd":
        raise InputError(f"--job {job}: applies to a FreeCAD document only: leave it out for {file.name}")
    if ending == ".camotics":
        from chipload.jobs.drafts.projects import draft_camotics

        return draft_camotics(file, folder, machine)
    if ending == ".fcstd":
        from chipload.jobs.drafts.freecad import draft_freecad

        return draft_freecad(file, folder, machine, job)
    if ending in (".dxf", ".step", ".stp"):
        from chipload.jobs.drafts.drawing import draft_drawing, draft_model

        make = draft_drawing if ending == ".dxf" else draft_model
        return make(file, folder, machine)
    if ending in MESHES:
        from chipload.jobs.drafts.mesh import draft_mesh

        return draft_mesh(file, folder, machine)
    from chipload.jobs.drafts.blade import draft_sections, holds_sections
    from chipload.jobs.drafts.impeller import draft_impeller, holds_impeller
    from chipload.jobs.drafts.program import Known, draft_program

    if holds_impeller(file):
        return draft_impeller(file, folder, machine)
    if holds_sections(file):
        return draft_sections(file, folder, machine)
    if tools is not None and tools.suffix.lower() in (".json", ".tools"):
        from chipload.cutter.fusion import read_fusion_library

        where = f"the library {tools.name}"
        library = {
            number: {key: (value, where) for key, value in values.items() if key != "number"}
            for number, values in read_fusion_library(tools).items()
        }
        return draft_program(file, folder, Known(machine=machine, cutters=library))
    return draft_program(file, folder, Known(machine=machine, tools=tools))


def drafts_of(
    file: Path, folder: Path, *, machine: str | None = None, tools: Path | None = None, job: str | None = None
) -> dict[str, Draft]:
    """Return the drafts of all jobs for a file by their names, in the order in which they run.

    A model with thin walls beside pockets gives several, any other file one, which is named ``job``. Parameters and
    errors as :func:`draft_of`.
    """
    if file.suffix.lower() in (".step", ".stp") and is_file(file) and job is None:
        from chipload.jobs.drafts.frame import find_frame, frame_drafts

        require_utf8(file)
        found = find_frame(file)
        if found is not None:
            return frame_drafts(found, folder, machine)
    return {"job": draft_of(file, folder, machine=machine, tools=tools, job=job)}
