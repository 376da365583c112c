"""The program of a track, and the line of each row of its history.

The text is the one with new feeds where the result has changed nothing else, else the original where the opened folder
has it (found by the hash that the result states), else the program that the result holds for the machine, else its CL
data. The history of a program that was written for turning axes counts in the lines of its text. Where the history does
not count in the lines of the text, rows are followed along its motions: each row lies on the motion that is shown,
within a tolerance.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from chipload.errors import ChiploadError
from chipload.files import decode_text
from chipload.machine.machine import machine_named, machine_names
from chipload.program.apt.reader import read_apt_file
from chipload.program.motions import is_arc, straighten_arcs
from chipload.program.program import Program
from chipload.program.read import read_program
from chipload.web.folder_access import find_by_hash
from chipload.web.result import PageResult, PageTrack

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

#: turn of the chords [rad] that rows are followed along, and how far a row may lie from its chord [mm]
TURN, NEAR_MM = 0.01, 0.02
#: rows that are followed one by one, chords of look-ahead, and the largest text [bytes]
FOLLOWED, AHEAD, LARGEST = 20_000, 48, 50_000_000
#: capabilities that write the program of the user again with other feeds, and count its history in its lines
FEEDS = ("program", "feeds")
#: after so many rows on no motion at all the rest of the program is no longer searched for one
LOST = 200


@dataclass(frozen=True, eq=False)
class TrackText:
    """Source text of a track.

    Parameters
    ----------
    name : of the file
    lines : its lines
    of_row : (n,) line of each row of the track, counted from 1; 0: none
    note : what the text is, where it is not the program itself
    """

    name: str
    lines: Sequence[str]
    of_row: Ints
    note: str

    def row_of(self, line: int) -> int | None:
        """The first row of a line, or of the next one that moves."""
        later = np.where(self.of_row >= line, self.of_row, np.iinfo(np.int64).max)
        k = int(np.argmin(later)) if len(later) else 0
        return k if len(later) and later[k] < np.iinfo(np.int64).max else None


def source_of(result: PageResult, track: PageTrack) -> TrackText | None:
    """The text of a track; None where the result holds none that can be read."""
    wanted, note = result.result.provenance.inputs.get("program"), ""
    if track.line is not None and track.line.any() and wanted is not None:
        own = _with_new_feeds(result, track)
        if own is not None:
            return TrackText(own.name, _lines(own), track.line, "with its new feeds")
        original = find_by_hash(result.root, wanted)
        if original is not None and original.stat().st_size <= LARGEST:
            return TrackText(original.name, _lines(original), track.line, "")
        note = f"CL data of {wanted.rsplit(' sha256 ', 1)[0]}; the original program is not in the opened folder"
    for name in track.own.programs:
        try:
            path = result.file(name)
            if path.stat().st_size > LARGEST:
                continue
            if wanted is None and path.suffix != ".apt" and _counts_in(path, track):
                return TrackText(path.name, _lines(path), np.asarray(track.line), "")
            program = read_apt_file(path)[0] if path.suffix == ".apt" else _read_axes(path, result)
        except (ChiploadError, OSError):
            continue
        if program is None:
            continue
        lines = follow_lines(track.place, program)
        # the axes of a machine whose table turns do not stand where the tool cuts: its program is not followed
        if len(np.unique(lines)) > 1 or len(np.unique(track.place, axis=0)) == 1:
            return TrackText(path.name, _lines(path), lines, note)
    return None


def _with_new_feeds(result: PageResult, track: PageTrack) -> Path | None:
    """The program with other F words, in whose lines the history counts; None: none has changed them."""
    if result.result.capability not in FEEDS:
        return None  # the controller of the torque gets a text of its own, with other lines
    for name in track.own.programs:
        if Path(name).suffix == ".apt":
            continue
        try:
            path = result.file(name)
            return path if path.stat().st_size <= LARGEST else None
        except (ChiploadError, OSError):
            return None
    return None


def follow_lines(place: Floats, program: Program) -> Ints:
    """(n,) line of the motion that each place lies on, going along the program; 0 before the first.

    A place that lies on no motion ahead keeps the line of the place before.
    """
    chords = straighten_arcs(program, np.where(is_arc(program), TURN, np.inf))
    a = np.vstack([chords.p_work[:1], chords.p_work[:-1]])
    d = chords.p_work - a
    square = np.maximum((d * d).sum(axis=1), np.finfo(np.float64).tiny)
    line = np.asarray(chords.line)
    n = len(place)
    rows = np.unique(np.linspace(0, n - 1, min(n, FOLLOWED)).astype(np.int64))
    out, j, skipped = np.zeros(len(rows), dtype=np.int64), 0, 0
    for k, row in enumerate(rows.tolist()):
        p = place[row]
        for stop in (j + AHEAD, len(a) if skipped < LOST else 0):
            some = slice(j, stop)
            share = np.clip(((p - a[some]) * d[some]).sum(axis=1) / square[some], 0.0, 1.0)
            off = np.linalg.norm(a[some] + share[:, None] * d[some] - p, axis=1)
            near = np.flatnonzero(off <= NEAR_MM)
            if len(near):
                j += int(near[0])
                break
        else:
            skipped += 1
        out[k] = line[j]
    return out[np.searchsorted(rows, np.arange(n), side="right") - 1]


def _counts_in(path: Path, track: PageTrack) -> bool:
    """Whether the history counts in the lines of a program: of one that was written for axes that turn it does."""
    turns = bool((track.axis[:, 2] < 1.0 - 1e-9).any())
    return turns and track.line is not None and 0 < int(track.line.max()) <= len(_lines(path))


def _read_axes(path: Path, result: PageResult) -> Program | None:
    """The program of a shipped machine that moves straight axes only."""
    name = result.result.provenance.machine.partition(": ")[0]
    if name not in machine_names():
        return None
    return read_program(path, machine_named(name)).program


def _lines(path: Path) -> list[str]:
    return decode_text(path.read_bytes()).splitlines()
