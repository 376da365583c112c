"""The result of a job of any capability: verdict, limits, tracks, findings, surface maps and provenance."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from chipload.errors import Finding, InputError
from chipload.result.changes import MOST as MOST_CHANGES
from chipload.result.changes import Change, propose_changes
from chipload.result.columns import COLUMNS
from chipload.result.display import result_html
from chipload.result.first_lines import (
    confidence_line,
    coverage_line,
    critical_check,
    headline,
    reason_line,
    unchecked_line,
)
from chipload.result.limits import Columns, LimitCheck
from chipload.result.tabular import pandas_of, xarray_of
from chipload.result.track import Track
from chipload.result.verdict import Verdict

if TYPE_CHECKING:
    import pandas
    import plotly.graph_objects as go
    import xarray

Floats = NDArray[np.float64]
#: most columns that are plotted where none is named
MOST_ROWS = 5


@dataclass(frozen=True)
class Provenance:
    """Record of the inputs and versions that determine a result, without the computer's name or the time of day.

    Parameters
    ----------
    inputs : what was read: name, file name and hash
    overrides : keys of the job that were overridden
    machine : its name and note
    materials : source of the coefficients by name of the material
    versions : of chipload, Python and the libraries that may change a number
    """

    inputs: Mapping[str, str]
    overrides: tuple[str, ...]
    machine: str
    materials: Mapping[str, str]
    versions: Mapping[str, str]


@dataclass(frozen=True, eq=False)
class SurfaceMap:
    """A quantity over a surface of the part.

    Parameters
    ----------
    name : unique in the result
    column : name of the quantity, see :data:`chipload.result.columns.COLUMNS`
    points : (n, 3) float [mm]
    values : (n,) float, in the unit of the column; NaN where the quantity is not known
    faces : (m, 3) int, triangles of the points; (0, 3): points only
    track : name of the track that it belongs to; empty: the whole result
    displacement : (n, 3) float [mm] of the points by finite elements; None: the map has none
    """

    name: str
    column: str
    points: Floats
    values: Floats
    faces: NDArray[np.int64]
    track: str = ""
    displacement: Floats | None = None

    def __post_init__(self) -> None:
        """Refuse arrays whose shapes do not match."""
        n = len(np.atleast_1d(self.points))
        if self.points.shape != (n, 3) or self.values.shape != (n,) or self.faces.shape[1:] != (3,):
            raise ValueError(f"map {self.name}: shapes {self.points.shape}, {self.values.shape}, {self.faces.shape}")
        if not np.isfinite(self.points).all() or (self.faces < 0).any() or (self.faces >= n).any():
            raise ValueError(f"map {self.name}: points must be finite, and faces name {n} points")
        if self.displacement is not None and self.displacement.shape != (n, 3):
            raise ValueError(f"map {self.name}: displacement of shape {self.displacement.shape}, not {(n, 3)}")
        if self.column not in COLUMNS:
            raise ValueError(f"map {self.name}: column {self.column} is not known")


@dataclass(frozen=True, eq=False)
class Result:
    """The result of a job: its tracks with their limits and histories, findings, surface maps and provenance.

    Parameters
    ----------
    capability : name of the folder in ``jobs/`` that made it
    title : of the job
    tracks : those in use first, within an operation in the order of the job
    operations : JSON values particular to the capability, one a operation
    findings : of the job, its files and the whole result
    unchecked : names of limits that are not stated and of checks that are switched off
    provenance : where the numbers come from
    maps : quantities over surfaces
    note : a sentence that the message adds where everything holds; empty: none
    """

    capability: str
    title: str
    tracks: tuple[Track, ...]
    operations: tuple[Mapping[str, Any], ...]
    findings: tuple[Finding, ...]
    unchecked: tuple[str, ...]
    provenance: Provenance
    maps: tuple[SurfaceMap, ...] = ()
    note: str = ""

    def __post_init__(self) -> None:
        """Refuse two tracks of one name, and a track in use that follows one of its operation that is not in use."""
        names = [track.name for track in self.tracks]
        if len(set(names)) < len(names):
            raise ValueError(f"tracks: names {names} must differ")
        unused: set[int] = set()
        for track in self.tracks:
            if track.in_use and track.operation in unused:
                raise ValueError(f"tracks: of operation {track.operation}: those in use come first: move {track.name}")
            if not track.in_use:
                unused.add(track.operation)

    @property
    def in_use(self) -> tuple[Track, ...]:
        """The tracks that determine the verdict."""
        return tuple(track for track in self.tracks if track.in_use)

    @property
    def limits(self) -> tuple[LimitCheck, ...]:
        """All limit checks of the tracks in use."""
        return tuple(check for track in self.in_use for check in track.limits)

    @cached_property
    def verdict(self) -> Verdict:
        """The worst verdict of the tracks in use and of the findings; unproven if no limit was checked."""
        states = [track.verdict for track in self.in_use] + [Verdict.of_finding(f) for f in self.findings]
        return Verdict.worst(states + ([] if self.limits else [Verdict.UNPROVEN]))

    @cached_property
    def headline(self) -> str:
        """The first line of the verdict: state, critical limit with its margin and place, and what is not proven."""
        return headline(self.verdict, self.findings, self.in_use)

    @cached_property
    def critical(self) -> LimitCheck | None:
        """The check of a track in use with the least margin; None: none has a margin."""
        return critical_check(self.limits)

    @cached_property
    def critical_program(self) -> str:
        """The name of the track in use that the critical check is of; empty: one alone is in use, or no check has a
        margin.
        """
        own = (track.name for track in self.in_use if any(check is self.critical for check in track.limits))
        return next(own, "") if len(self.in_use) > 1 else ""

    @cached_property
    def open_lines(self) -> tuple[str, ...]:
        """What the verdict leaves open: what exceeds or is not proven, what the limits do not cover, what is not
        checked.
        """
        reason = reason_line(self.verdict, self.findings, self.in_use)
        return tuple(filter(None, (reason, coverage_line(self.in_use), unchecked_line(self.unchecked))))

    @cached_property
    def changes(self) -> tuple[Change, ...]:
        """Up to three changes that would settle a limit of a track in use that does not hold, the greatest margin
        first.
        """
        found = [change for track in self.in_use for change in propose_changes(track)]
        return tuple(sorted(found, key=lambda change: -change.margin)[:MOST_CHANGES])

    @cached_property
    def message(self) -> str:
        """The verdict in a few sentences: its first line, what the limits do not cover, and the note."""
        note = self.note if self.verdict is Verdict.HOLDS else ""
        lines = (self.headline, coverage_line(self.in_use), note)
        return " ".join(filter(None, lines))

    @cached_property
    def first_lines(self) -> tuple[str, ...]:
        """The lines that every page and terminal shows first: the message, what is not checked, and the load that uses
        most of its limit at the confidence, with the parts of its error.
        """
        return tuple(filter(None, (self.message, unchecked_line(self.unchecked), confidence_line(self.in_use))))

    def _repr_html_(self) -> str:
        """HTML for notebooks: the message, and tables of limits, tracks and findings."""
        return result_html(self)

    def plot(self, *columns: str, track: str = "", x: Literal["t_s", "s_mm"] = "t_s") -> go.Figure:
        """Plot columns of a track one below the other, with their limits, against time or path.

        Parameters
        ----------
        columns : names; none: those that the limits of the track bound, then force, torque and power; at most five
        track : name; none: the first in use
        x : time or path

        Raises
        ------
        InputError
            There is no track or column of that name, or the track has no history.
        """
        from chipload.result.plot import USUAL, columns_figure

        chosen, history = self._choose_track(track), self._history(track)
        bound = [check.column.name for check in chosen.limits]
        names = columns or tuple(dict.fromkeys(c for c in (*bound, *USUAL) if c in history))[:MOST_ROWS]
        n = len(next(iter(history.values())))
        covered = {check.name: check.coverage.mask(n) for check in chosen.limits}
        return columns_figure(history, {check.name: check.limit for check in chosen.limits}, names, covered, x)

    def to_pandas(self, track: str = "") -> pandas.DataFrame:
        """Return the history of a track as a pandas DataFrame; without a name that of the first track in use.

        Raises
        ------
        InputError
            There is no track of that name, it has no history, or pandas is not installed (``chipload[notebook]``).
        """
        return pandas_of(self._history(track))

    def to_xarray(self, track: str = "") -> xarray.Dataset:
        """Return the history of a track as an xarray Dataset with units; without a name that of the first track in use.

        Raises
        ------
        InputError
            There is no track of that name, it has no history, or xarray is not installed (``chipload[notebook]``).
        """
        return xarray_of(self._history(track))

    def track(self, name: str) -> Track:
        """Return the track with this name.

        Raises
        ------
        KeyError
            There is none.
        """
        return {track.name: track for track in self.tracks}[name]

    def _choose_track(self, name: str) -> Track:
        names = [one.name for one in self.tracks]
        if not names or (name and name not in names):
            raise InputError(f"track {name!r}: is not in the result, which has {', '.join(names) or 'none'}")
        return self.track(name or names[0])

    def _history(self, name: str) -> Columns:
        chosen = self._choose_track(name)
        columns = chosen.columns
        if not columns:
            with_history = [one.name for one in self.tracks if any(True for _ in one.blocks())]
            raise InputError(
                f"track {chosen.name!r}: has no history; tracks with a history: {', '.join(with_history) or 'none'}"
            )
        return columns
