"""The shape of each cutter of a track, by tool number.

The result holds it with its stock (removal.npz). Else it is that of the job where the opened folder has the job that
the result was made from (by its hash), else the CUTTER of CL data: the result's own, or the program where the folder
has it. Where none states it, the page shows a pointer and states that the shape is not known.
"""

from __future__ import annotations

import contextlib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chipload.cutter.barrel import tip_of_barrel
from chipload.cutter.cutter import Cutter
from chipload.errors import ChiploadError, InputError
from chipload.jobs import load_job
from chipload.program.apt.cutters import read_cutters
from chipload.program.control import is_cl_data
from chipload.program.read import ENDINGS
from chipload.report.removal import REMOVAL, read_cutter_parts
from chipload.report.view import parts_of, pointer_parts
from chipload.web.folder_access import find_by_hash
from chipload.web.result import PageResult, PageTrack

#: parts of a cutter: kind and profile (m, 2)
Parts = list[tuple[str, NDArray[np.float64]]]

UNKNOWN = "The cutter is drawn as a pointer: no job in the opened folder and no CL data of this result state its shape."


def cutters_of(result: PageResult, track: PageTrack, size: float) -> tuple[dict[int, Parts], str]:
    """Parts of the cutter of each tool number of a track (number 0: of every other), and what is not known.

    Parameters
    ----------
    size : length of a pointer [mm], and of a cutter whose length CL data leave open
    """
    numbers = _numbers(result, track)
    kept = _kept_parts(result, track)
    if kept and (numbers <= set(kept) or len(kept) == 1):
        return ({0: next(iter(kept.values()))} if len(kept) == 1 else kept), ""
    own = {n: c for n, c in _of_job(result).items() if not numbers or n in numbers}
    if own and (not numbers or numbers <= set(own)):
        made = {n: parts_of(c) for n, c in own.items()}
    else:
        made = _of_apt(result, track, size)
    if made and len(made) == 1 and len(numbers) <= 1:
        return {0: next(iter(made.values()))}, ""
    if made and numbers <= set(made):
        return made, ""
    return {0: pointer_parts(size), **made}, UNKNOWN


def outline_parts(shape: Sequence[float], height: float) -> Parts:
    """The envelope (d, r, e, f, alpha, beta, h) [mm, rad] that CL data states, up to ``height`` where h is 0."""
    d, r, _, _, alpha, beta, h = shape
    length = h if h > 0.0 else height
    if (tip := tip_of_barrel(shape)) is not None:
        return parts_of(Cutter(d, 1, 0.0, length, length, 2e5, corner_e=tip, barrel_radius=r, taper=beta))
    return parts_of(Cutter(d, 1, 0.0, length, length, 2e5, corner_radius=r, bottom=alpha, taper=beta))


def _numbers(result: PageResult, track: PageTrack) -> set[int]:
    """Tool numbers that a track uses, as far as the result states it."""
    if track.tool is not None:
        return {int(n) for n in set(track.tool.tolist())}
    operations = result.result.operations
    operation: Any = operations[track.operation] if track.operation < len(operations) else {}
    settings = operation.get("settings")
    number = settings.get("cutter") if isinstance(settings, dict) else None
    return {number} if isinstance(number, int) else set()


def _kept_parts(result: PageResult, track: PageTrack) -> dict[int, Parts]:
    """Parts that the result itself holds with its stock."""
    try:
        return read_cutter_parts(result.file(REMOVAL), result.result.tracks.index(track.own))
    except (InputError, ValueError):
        return {}


def _input(result: PageResult, name: str) -> Path | None:
    """A file that the result was made from, where the opened folder has it."""
    wanted = result.result.provenance.inputs.get(name)
    return None if wanted is None else find_by_hash(result.root, wanted)


def _of_job(result: PageResult) -> dict[int, Cutter]:
    path = _input(result, "job")
    if path is None:
        return {}
    try:
        job = load_job(path, result.result.provenance.overrides).job
    except ChiploadError:
        return {}
    found = getattr(job, "cutters", {})
    return dict(found) if isinstance(found, dict) else {}


def _of_apt(result: PageResult, track: PageTrack, size: float) -> dict[int, Parts]:
    program = _input(result, "program")
    others = [t for t in result.result.tracks if t.operation == track.operation and t is not track.own]
    for name in (n for t in (track.own, *others) for n in t.programs):
        with contextlib.suppress(InputError):
            if name.endswith(".apt") and (shapes := _shapes(result.file(name), size)):
                return shapes
    kind = ENDINGS.get(program.suffix.lower()) if program is not None else None
    return _shapes(program, size) if program is not None and kind is not None and is_cl_data(kind) else {}


def _shapes(path: Path, size: float) -> dict[int, Parts]:
    try:
        shapes = read_cutters(path.read_bytes().decode("utf-8", "replace"))[0]
        return {n: outline_parts(shape, size) for n, shape in shapes.items()}
    except (ChiploadError, OSError):
        return {}
