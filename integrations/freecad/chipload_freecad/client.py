"""The program `chipload` as a process of its own, and what it leaves in a result folder.

FreeCAD's Python need not have the libraries of chipload: nothing of it is imported here.
"""

import csv
import json
import os
import shlex
import subprocess
from collections import namedtuple
from pathlib import Path

#: exit codes of a run with a result: every limit holds; one does not, or is unproven
DONE = (0, 3)
#: variables by which FreeCAD's own Python would reach into another one
FOREIGN = ("PYTHONHOME", "LD_LIBRARY_PATH")

#: verdict: holds, unproven or exceeds; limits, findings: dictionaries of summary.json; columns: lists of history.csv by
#: name, of the track in use
Result = namedtuple("Result", "verdict message limits findings columns folder")


class ChiploadError(Exception):
    """chipload refused the job or is not there; the text is what it said."""


def command_words(text):
    """The words of a command line, as ``/home/me/.venv/bin/chipload`` or ``python3 -m chipload``."""
    words = shlex.split(text or "chipload")
    if not words:
        raise ChiploadError("the command of chipload is empty: state it in the settings")
    return words


def call(command, *words):
    """Run chipload and return what it wrote to stdout.

    Raises
    ------
    ChiploadError
        It cannot be started, or it ended without a result.
    """
    own = {key: value for key, value in os.environ.items() if key not in FOREIGN}
    line = [*command_words(command), *map(str, words)]
    try:
        done = subprocess.run(line, capture_output=True, text=True, stdin=subprocess.DEVNULL, env=own)
    except OSError as err:
        raise ChiploadError(
            f"{line[0]}: cannot be started: {err}: state the command of chipload in the settings"
        ) from err
    if done.returncode not in DONE:
        raise ChiploadError(done.stderr.strip() or f"chipload ended with exit code {done.returncode}")
    return done.stdout


def read_result(folder, table):
    """The result of a result folder and of the folder that ``chipload export --csv`` wrote of it.

    Raises
    ------
    ChiploadError
        A file is missing or is not what this add-on knows.
    """
    try:
        summary = json.loads((Path(folder) / "summary.json").read_text(encoding="utf-8"))
        used = [track["name"] for track in summary["tracks"] if track["in_use"]]
        findings = list(summary["findings"])
        for track in summary["tracks"]:
            if track["name"] in used:
                findings += track.get("findings", [])
        with (Path(table) / "history.csv").open(newline="", encoding="utf-8") as file:
            rows = [row for row in csv.DictReader(file) if row.get("track", "") in used]
        columns = {name: [_value(row[name]) for row in rows] for name in (rows[0] if rows else ())}
        return Result(summary["verdict"], summary["message"], summary["limits"], findings, columns, Path(folder))
    except (OSError, ValueError, KeyError, TypeError) as err:
        raise ChiploadError(f"{folder}: not a result of chipload that this add-on reads: {err!r}") from err


def _value(text):
    """A number, or the text."""
    try:
        return float(text)
    except ValueError:
        return text
