"""What the first line of a program states, from the verdict of its whole job."""

from __future__ import annotations

from chipload.program.release import Release
from chipload.result.result import Result
from chipload.result.verdict import Verdict


def release_of(result: Result, file: str) -> Release:
    """Return the statement of a program file of a result.

    A program is verified only if it belongs to a track in use and the verdict of the whole job is ``holds``. This is
    the only place that decides it: whoever writes a program of a result passes what this returns to the writer.

    Parameters
    ----------
    result : as it is written: with the guesses of a draft and the marks of a coarse run
    file : name of the program file, one of :attr:`Track.programs`

    Raises
    ------
    ValueError
        No track has such a program.
    """
    track = next((track for track in result.tracks if file in track.programs), None)
    if track is None:
        raise ValueError(f"program {file}: no track of the result names it")
    if not track.in_use:
        used = ", ".join(one.name for one in result.in_use if one.operation == track.operation)
        return Release(f"not released: the job uses {used or 'other programs'}")
    return Release("" if result.verdict is Verdict.HOLDS else result.message)
