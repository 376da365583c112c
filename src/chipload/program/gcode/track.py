"""The rows of Commands while a text is read, and what was noticed.

Notation: a row is ``(motion, x, y, z, a, b, c, u, v, w, context, line)`` in mm and degrees; a context is ``(feed,
spindle, tool, tcp, frame, plane, label, path mode)``, kept once and named by its number. Rows wait in a list and go to
columns in pieces, so that a long text does not hold a tuple for each.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from chipload.errors import Finding, InputError, Severity
from chipload.program.commands import ARC, Commands, Frame
from chipload.program.gcode.state import Datum
from chipload.program.path_mode import UNSTATED, PathMode

#: rows that wait
PIECE = 1 << 15
#: findings that are kept; one more says how many are not
MOST_FINDINGS = 2000
#: frames and labels that a text may make
MOST_FRAMES = 100_000


class BoundError(InputError):
    """A bound of the reader is passed, as by a loop without an end: what follows is not read in any mode."""


Row = tuple[int, float, float, float, float, float, float, float, float, float, int, int]
Context = tuple[float, float, int, bool, int, int, int, PathMode]


class Findings:
    """Findings, each text once for a code and line."""

    def __init__(self) -> None:
        self._kept: dict[tuple[str, int, str], Severity] = {}
        self._once: set[tuple[str, str]] = set()
        self._left = 0
        self._left_severity = Severity.NOTE

    def add(self, code: str, line: int, text: str, severity: Severity = Severity.NOTE) -> None:
        """Keep a finding."""
        key = (code, line, text)
        if key in self._kept:
            return
        if len(self._kept) < MOST_FINDINGS:
            self._kept[key] = severity
        else:
            self._left += 1
            self._left_severity = max(self._left_severity, severity)

    def once(self, code: str, line: int, text: str, severity: Severity = Severity.NOTE) -> None:
        """Keep a finding whose text has not been seen on any line."""
        if (code, text) not in self._once and len(self._once) <= MOST_FINDINGS:
            self._once.add((code, text))
            self.add(code, line, text, severity)

    def all(self) -> tuple[Finding, ...]:
        """The findings in the order in which they were made."""
        kept = [Finding(*key, severity) for key, severity in self._kept.items()]
        if self._left:
            text = f"{self._left} more findings are not listed"
            kept.append(Finding("nc-more-findings", 0, text, self._left_severity))
        return tuple(kept)


class MotionRows:
    """Rows in the order in which they are made.

    Parameters
    ----------
    most : a text may make as many rows
    """

    def __init__(self, most: int) -> None:
        self.rows: list[Row] = []
        self.most = most
        self.count = 0
        self._pieces: list[NDArray[np.float64]] = []
        self._arcs: list[tuple[int, float, float, int]] = []
        self._contexts: dict[Context, int] = {}
        self._by_number: list[Context] = []
        self._frames: dict[Datum, int] = {}
        self._labels: dict[str, int] = {"": 0}

    def context(self, context: Context) -> int:
        """Number of a context."""
        return self._contexts.setdefault(context, len(self._contexts))

    def feed_of(self, number: int) -> float:
        """Feed of a context."""
        return self._list()[number][0]

    def with_feed(self, number: int, feed: float) -> int:
        """Number of a context that differs by its feed."""
        return self.context((feed, *self._list()[number][1:]))

    def _list(self) -> list[Context]:
        """Contexts by number."""
        if len(self._by_number) < len(self._contexts):
            self._by_number += list(self._contexts)[len(self._by_number) :]
        return self._by_number

    def frame(self, datum: Datum) -> int:
        """Number of the frame of a datum."""
        number = self._frames.setdefault(datum, len(self._frames))
        if number >= MOST_FRAMES:
            raise BoundError(f"the offsets change more than {MOST_FRAMES} times")
        return number

    def label(self, text: str) -> int:
        """Number of a label; past the most, the last."""
        if text not in self._labels and len(self._labels) >= MOST_FRAMES:
            return len(self._labels) - 1
        return self._labels.setdefault(text, len(self._labels))

    def arc(self, row: Row, first: float, second: float, turns: int) -> None:
        """Add an arc about (first, second) in its plane."""
        self._arcs.append((self.count + len(self.rows), first, second, turns))
        self.rows.append(row)

    def heading(self, first: int, second: int) -> complex | None:
        """Direction of the last motion in a plane of two of the axes X Y Z, where it ends; None: not known."""
        rows = self.rows
        for k in range(len(rows) - 1, 0, -1):
            to, begin = (complex(rows[i][1 + first], rows[i][1 + second]) for i in (k, k - 1))
            arc = next((a for a in reversed(self._arcs) if a[0] <= self.count + k), None)
            if arc is not None and arc[0] == self.count + k:
                radius = to - complex(arc[1], arc[2])
                return 1j * math.copysign(1.0, arc[3]) * radius / abs(radius) if abs(radius) > 0.0 else None
            if abs(to - begin) > 1e-9:
                return (to - begin) / abs(to - begin)
        return None

    def used_frames(self) -> tuple[Datum, ...]:
        """The datums that rows were made in."""
        return tuple(self._frames)

    def spill(self) -> None:
        """Move rows to columns when many wait."""
        if len(self.rows) >= PIECE:
            self._spill()

    def _spill(self) -> None:
        if self.rows:
            self._pieces.append(np.array(self.rows, dtype=np.float64))
            self.count += len(self.rows)
            self.rows.clear()
        if self.count > self.most:
            raise BoundError(f"more than {self.most} motions: split the program")

    def commands(self) -> Commands:
        """All rows as Commands."""
        self._spill()
        table = np.concatenate(self._pieces) if self._pieces else np.zeros((0, 12))
        self._pieces.clear()
        n = len(table)
        which = table[:, 10].astype(np.int64)
        columns = list(zip(*self._contexts, strict=True)) if self._contexts else [(0,)] * 7 + [(UNSTATED,)]
        centre, turns = np.zeros((n, 2)), np.zeros(n, dtype=np.int64)
        if self._arcs:
            arcs = np.array(self._arcs, dtype=np.float64)
            rows = arcs[:, 0].astype(np.int64)
            centre[rows], turns[rows] = arcs[:, 1:3], arcs[:, 3].astype(np.int64)
        position = table[:, 1:10].copy()
        position[:, 3:6] = np.radians(position[:, 3:6])
        motion = table[:, 0].astype(np.int64)
        assert not (turns[motion != ARC] != 0).any()
        line = table[:, 11].astype(np.int64)
        del table
        for column in (motion, position, centre, turns, line):
            column.setflags(write=False)  # Commands keeps them as they are
        return Commands(
            motion=motion,
            position=position,
            plane=np.array(columns[5], dtype=np.int64)[which],
            centre=centre,
            turns=turns,
            feed=np.array(columns[0], dtype=np.float64)[which],
            spindle=np.array(columns[1], dtype=np.float64)[which],
            tool=np.array(columns[2], dtype=np.int64)[which],
            tcp=np.array(columns[3], dtype=np.bool_)[which],
            frame=np.array(columns[4], dtype=np.int64)[which],
            line=line,
            label=np.array(columns[6], dtype=np.int64)[which],
            frames=tuple(datum.frame() for datum in self._frames) or (Frame(),),
            labels=tuple(self._labels),
            path_mode=np.array(columns[7], dtype=np.float64)[which],
        )
