"""Feeds of a program that chipload wrote, back in the commands of the operations. Feeds in a document are mm/s."""

import re
from pathlib import Path

from chipload_freecad.client import ChiploadError
from chipload_freecad.job_folder import FEEDS, PROGRAM, origins

_FEED = re.compile(r"F\s*([0-9]*\.?[0-9]+)")
_WORD = re.compile(r"([A-Z])\s*([-+]?[0-9]*\.?[0-9]+)")
#: commands that cut
CUTS = ("G1", "G01", "G2", "G02", "G3", "G03")
#: [mm] how far a written coordinate may be from the document's own, which has six digits
CLOSE = 1e-5


def new_feeds(folder):
    """(operation, command) -> feed [mm/s] of each line that cuts, and the words of its coordinates.

    Raises
    ------
    ChiploadError
        There is no program with new feeds in the folder, or its lines are not those of the program.
    """
    programs = sorted((Path(folder) / FEEDS).glob("*-feeds.ngc"))
    if len(programs) != 1:
        raise ChiploadError(f"{folder}: no program with new feeds: look for them first")
    lines = programs[0].read_text(encoding="ascii", errors="replace").splitlines()
    own = len((Path(folder) / PROGRAM).read_text(encoding="ascii", errors="replace").splitlines())
    if len(lines) != own:
        raise ChiploadError(
            f"{programs[0].name}: {len(lines)} lines, {PROGRAM}: {own}: a line was divided: look for feeds again"
        )
    feed, out, known = None, {}, origins(folder)
    for number, line in enumerate(lines, 1):
        text = re.sub(r"\([^)]*\)", "", line)
        if found := _FEED.search(text):
            feed = float(found[1]) / 60.0
        if number in known and text.split()[:1] and text.split()[0] in CUTS and feed is not None:
            words = {letter: float(value) for letter, value in _WORD.findall(text) if letter in "XYZIJ"}
            out[known[number]] = (feed, words)
    return out


def write_feeds(job, folder, result, exceeding=False):
    """Write new feeds into the operations of a job; return how many commands have another feed.

    An operation that FreeCAD computes again has its own feeds again.

    Raises
    ------
    ChiploadError
        The program with new feeds exceeds a limit and ``exceeding`` is not set, or an operation has changed since it
        was checked. No operation is changed then.
    """
    import Path as FreeCADPath

    if result.verdict == "exceeds" and not exceeding:
        raise ChiploadError(f"the feeds are not written: with them the program exceeds a limit: {result.message}")
    feeds = new_feeds(folder)
    changed, paths = 0, {}
    for (name, k), (feed, words) in feeds.items():
        operation = job.Document.getObject(name)
        commands = paths.get(name) or (list(operation.Path.Commands) if operation is not None else [])
        if k >= len(commands) or not _same(commands[k], words):
            raise ChiploadError(f"operation {name}: has changed since it was checked: check the job again")
        paths[name] = commands
        own = dict(commands[k].Parameters)
        if abs(own.get("F", 0.0) - feed) > 1e-6 * feed:
            commands[k] = FreeCADPath.Command(commands[k].Name, {**own, "F": feed})
            changed += 1
    for name, commands in paths.items():
        operation = job.Document.getObject(name)
        operation.Path = FreeCADPath.Path(commands)
        operation.purgeTouched()
    return changed


def _same(command, words):
    """Whether a command is still the one that was written."""
    own = {key: value for key, value in command.Parameters.items() if key in "XYZIJ"}
    return command.Name in CUTS and own.keys() == words.keys() and all(
        abs(own[key] - value) <= CLOSE for key, value in words.items()
    )  # fmt: skip
