"""Run by `freecadcmd`: a CAM job is made, checked by the add-on, shown, and its feeds written back; out comes JSON.

ADDON, FOLDER and CHIPLOAD are the folder of the add-on, that of the document, and the command line of chipload.
"""

import json
import os
import sys
import traceback
from pathlib import Path

sys.path.insert(0, os.environ["ADDON"])
FOLDER = Path(os.environ["FOLDER"])


def profile():
    """A block of 40 x 30 x 10 mm, its outline cut by a cutter of 6 mm in two levels of 6 mm, by FreeCAD itself."""
    import FreeCAD

    try:
        import Path.Main.Job as CamJob
        import Path.Op.Profile as CamProfile
    except ImportError:
        import PathScripts.PathJob as CamJob
        import PathScripts.PathProfile as CamProfile
    document = FreeCAD.newDocument("part")
    box = document.addObject("Part::Box", "Box")
    box.Length, box.Width, box.Height = 40, 30, 10
    document.recompute()
    job = CamJob.Create("Job", [box])
    controller = job.Tools.Group[0]
    controller.HorizFeed, controller.VertFeed, controller.SpindleSpeed = "600 mm/min", "200 mm/min", 6000
    controller.Tool.Diameter = controller.Tool.ShankDiameter = 6
    operation = CamProfile.Create("Profile", parentJob=job)
    operation.ToolController = controller
    document.recompute()
    document.saveAs(str(FOLDER / "part.FCStd"))
    return document, job, operation


def feeds_of(operation):
    """Feed of each command [mm/s]."""
    return [c.Parameters.get("F") for c in operation.Path.Commands]


def posted(operation, file):
    """The program as FreeCAD's own post for LinuxCNC writes it."""
    try:
        from PathScripts.post import linuxcnc_post
    except ImportError:
        from Path.Post.scripts import linuxcnc_post
    import FreeCAD

    FreeCAD.ActiveDocument = operation.Document
    linuxcnc_post.export([operation], str(file), "--no-show-editor --no-header")


def refused(work, *values, **named):
    """What a refusal says; empty where there is none."""
    from chipload_freecad.client import ChiploadError

    try:
        work(*values, **named)
    except ChiploadError as err:
        return str(err)
    return ""


def main():
    """The whole way."""
    from chipload_freecad import feeds, job_folder, shown

    document, job, operation = profile()
    command = os.environ["CHIPLOAD"]
    folder, out = job_folder.folder_of(document), {}
    posted(operation, FOLDER / "posted.ngc")
    out["jobs"] = [o.Name for o in job_folder.jobs_of(document)]
    out["settings"] = job_folder.settings_of(job)
    job_folder.write_job(job, folder, command)
    written = (folder / "job.toml").read_text().splitlines()
    out["guesses"] = [line.split()[0] for line in written if "# guess: " in line]
    job.ChiploadSettings = ["machine.name", "# no setting"]
    out["not_a_setting"] = refused(job_folder.check, job, folder, command)
    job.ChiploadSettings = [
        "machine.name = vmc", "material.name = al6082-t6", "cutter.0.flutes = 3", "cutter.0.helix_deg = 35",
        "cutter.0.overhang_mm = 35", "cutter.0.runout_mm = 0", "limits.force_n = 300",
        "operation.0.step_mm = 4",
    ]  # fmt: skip
    out["no_program"] = refused(job_folder.check, job, folder, "/nowhere/chipload")
    result = job_folder.check(job, folder, command)
    out |= {"verdict": result.verdict, "message": result.message, "force": max(result.columns["force_n"])}
    out["line"] = result.columns["line"][result.columns["force_n"].index(out["force"])]
    for _ in range(2):  # a new result replaces the old one
        group = shown.show(document, result)
    out["shown"] = [(o.TypeId, o.Label) for o in group.Group]
    path = [o for o in group.Group if o.TypeId == "Part::Feature"]
    out["length"] = sum(o.Shape.Length for o in path)
    out["before"] = feeds_of(operation)
    better = job_folder.check(job, folder, command, feeds=True)
    out["better"] = better.verdict
    out["exceeding"] = refused(feeds.write_feeds, job, folder, better._replace(verdict="exceeds"))
    out["kept"] = feeds_of(operation) == out["before"]
    out["changed"] = feeds.write_feeds(job, folder, better)
    out["after"] = feeds_of(operation)
    operation.OffsetExtra = 1
    document.recompute()
    out["outdated"] = refused(feeds.write_feeds, job, folder, better)
    (FOLDER / "out.json").write_text(json.dumps(out))


try:
    main()
except Exception:  # freecadcmd would go on with exit code 0
    (FOLDER / "fault.txt").write_text(traceback.format_exc())
