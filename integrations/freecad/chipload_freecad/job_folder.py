"""A CAM job of a document as a job of chipload in a folder beside the document.

The folder holds a copy of the document, job.toml (cutters, stock, limits), program.ngc (the commands of the operations)
and program_lines.csv (of which command of which operation each line is). It is written anew each time, so that it is
never older than the document. What the document cannot state (flutes, overhang, material, machine, limits) is in the
property `ChiploadSettings` of the job, a line each as `cutter.0.flutes = 3`; what is in neither is a guess, and the
verdict is not better than unproven.
"""

import csv
import shutil
from pathlib import Path

from chipload_freecad.client import ChiploadError, call, read_result

#: property of a job: keys of job.toml with their values
SETTINGS = "ChiploadSettings"
#: files of the folder
DOCUMENT, JOB, PROGRAM, LINES, RESULT, TABLE, FEEDS = (
    "document.FCStd", "job.toml", "program.ngc", "program_lines.csv", "result", "table", "feeds",
)  # fmt: skip
#: what begins the settings of new feeds, and those of a job that states none
FEED_KEYS = "operation.0.feeds."
FEED_SETTINGS = ("operation.0.feeds.slowest_percent = 25", "operation.0.feeds.fastest_percent = 200")
#: a command of an operation has one feed: its line is not divided
UNDIVIDED = "operation.0.feeds.divide"


def jobs_of(document):
    """The CAM jobs of a document."""
    return [o for o in document.Objects if all(hasattr(o, name) for name in ("Operations", "Stock", "Tools"))]


def settings_of(job):
    """The lines of the settings of a job; the property is added where it is missing."""
    if SETTINGS not in job.PropertiesList:
        text = "Keys of job.toml with their values, as cutter.0.flutes = 3; chipload's docs/jobs.md lists all keys"
        job.addProperty("App::PropertyStringList", SETTINGS, "chipload", text)
    return [line.strip() for line in getattr(job, SETTINGS) if line.strip() and not line.strip().startswith("#")]


def folder_of(document):
    """The folder beside the document.

    Raises
    ------
    ChiploadError
        The document was never saved.
    """
    if not document.FileName:
        raise ChiploadError(f"{document.Label}: save the document first: the job is written beside it")
    path = Path(document.FileName)
    return path.with_name(f"{path.stem}-chipload")


def write_job(job, folder, command="chipload"):
    """Write the job into the folder; return what chipload found and guessed, a line each.

    Raises
    ------
    ChiploadError
        chipload refuses the document.
    """
    folder = Path(folder)
    for name in (DOCUMENT, JOB, PROGRAM, LINES):
        if (folder / name).exists():
            (folder / name).unlink()
    folder.mkdir(parents=True, exist_ok=True)
    job.Document.saveCopy(str(folder / DOCUMENT))
    return call(command, "init", folder / DOCUMENT, folder, "--job", job.Name).splitlines()


def check(job, folder, command="chipload", feeds=False):
    """Write the job and run it; with ``feeds`` chipload looks for better ones. Return the result.

    Raises
    ------
    ChiploadError
        chipload refuses the job, or the settings state whether lines are divided.
    """
    folder = Path(folder)
    write_job(job, folder, command)
    lines = settings_of(job)
    asked = [line for line in lines if line.startswith(FEED_KEYS)]
    lines = [line for line in lines if line not in asked]
    if feeds:
        divided = [line for line in asked if line.partition("=")[0].strip() == UNDIVIDED]
        if divided:
            raise ChiploadError(f"{SETTINGS}: {divided[0]!r}: leave it out: a command of an operation has one feed")
        lines += [*FEED_SETTINGS, *asked, f"{UNDIVIDED} = false"]
    sets = [word for line in lines for word in ("--set", _stated(line))]
    out, table = folder / (FEEDS if feeds else RESULT), folder / TABLE
    for old in (out, table):
        if old.exists():
            shutil.rmtree(old)
    call(command, "simulate", folder / JOB, "--out", out, *sets)
    call(command, "export", out, "--csv", "--out", table)
    return read_result(out, table)


def _stated(line):
    """A line of the settings as `--set` takes it."""
    key, equals, value = line.partition("=")
    if not equals:
        raise ChiploadError(f"{SETTINGS}: {line!r}: must be a key, = and a value, as cutter.0.flutes = 3")
    return f"{key.strip()}={value.strip()}"


def origins(folder):
    """Of each line of the program: name of its operation and number of its command."""
    with (Path(folder) / LINES).open(newline="", encoding="utf-8") as file:
        return {int(row["line"]): (row["operation"], int(row["command"])) for row in csv.DictReader(file)}
