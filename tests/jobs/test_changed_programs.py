"""A text with new feeds or speeds is read again: whatever else differs from the old program is refused by its line."""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np
import pytest

from chipload.errors import InputError
from chipload.jobs.feeds.verify import require_same
from chipload.jobs.program.speeds import _same
from chipload.program.program import DWELL, LINE, RAPID, Program

#: rapid, cut, dwell, cut, retract at the feed, rapid; speeds in rad/s, feeds in mm/s, the time of the dwell in s
OLD = Program(
    motion=np.array([RAPID, LINE, DWELL, LINE, LINE, RAPID]),
    p_work=np.array([[0, 0, 5], [0, 0, -1], [0, 0, -1], [9, 0, -1], [9, 0, 2], [9, 0, 9.0]]),
    axis=np.tile([0.0, 0.0, 1.0], (6, 1)),
    centre=np.zeros((6, 3)),
    normal=np.tile([0.0, 0.0, 1.0], (6, 1)),
    turns=np.zeros(6, dtype=np.int64),
    feed=np.array([0.0, 2.0, 0.5, 10.0, 20.0, 0.0]),
    spindle=np.full(6, 300.0),
    tool=np.ones(6, dtype=np.int64),
    line=np.array([3, 4, 5, 6, 7, 8]),
    label=np.zeros(6, dtype=np.int64),
    labels=("all",),
)


def changed(program: Program, name: str, row: int, value: object) -> Program:
    """A program with one value of one column changed."""
    column = np.array(getattr(program, name))
    column[row] = value
    return replace(program, **{name: column})


#: column, row, its new value, line that the message names
ELSEWHERE = [
    ("p_work", 3, [9.001, 0.0, -1.0], 6),
    ("motion", 4, RAPID, 7),
    ("tool", 3, 2, 6),
    ("axis", 3, [0.0, 1.0, 0.0], 6),
    ("turns", 3, 1, 6),
    ("line", 3, 9, 6),
    ("feed", 2, 5.0, 5),
    ("spindle", 4, 310.0, 7),
]


@pytest.mark.parametrize(("name", "row", "value", "line"), ELSEWHERE)
def test_more_than_feeds_changed(name: str, row: int, value: object, line: int) -> None:
    lines, factor = np.array([6]), np.array([0.5])
    new = changed(OLD, "feed", 3, 5.0)
    require_same(OLD, new, lines, factor)
    wrong = (
        changed(new, name, row, value) if name != "motion" else changed(changed(new, name, row, value), "feed", 5, 1)
    )
    with pytest.raises(InputError, match=f"^line {line}: its feed cannot be set by its own F word: convert the progr"):
        require_same(OLD, wrong, lines, factor)


@pytest.mark.parametrize("feed", [5.001, 4.9])
def test_another_feed_than_was_asked_for(feed: float) -> None:
    """Rounded down by the last digit it holds, above what was asked for never."""
    require_same(OLD, changed(OLD, "feed", 3, 4.9999), np.array([6]), np.array([0.5]))
    with pytest.raises(InputError, match=r"^line 6: "):
        require_same(OLD, changed(OLD, "feed", 3, feed), np.array([6]), np.array([0.5]))


@pytest.mark.parametrize(("name", "row", "value", "line"), ELSEWHERE)
def test_more_than_speeds_changed(name: str, row: int, value: object, line: int) -> None:
    """Only the cut of line 6 gets another speed, at the same feed per tooth."""
    wanted = np.array([np.nan, np.nan, np.nan, 330.0, np.nan, np.nan])
    new = changed(changed(OLD, "spindle", 3, 330.0), "feed", 3, 11.0)
    _same(OLD, new, wanted)
    wrong = (
        changed(new, name, row, value) if name != "motion" else changed(changed(new, name, row, value), "feed", 5, 1)
    )
    with pytest.raises(InputError, match=f"^line {line}: its speed cannot be set by its own S word: convert the prog"):
        _same(OLD, wrong, wanted)


@pytest.mark.parametrize(
    ("speed", "feed"), [(331.0, 11.0), (-330.0, 11.0), (300.0, 10.0), (330.0, 11.1), (330.0, 10.0)]
)
def test_another_speed_or_feed_per_tooth_than_was_asked_for(speed: float, feed: float) -> None:
    wanted = np.array([np.nan, np.nan, np.nan, 330.0, np.nan, np.nan])
    with pytest.raises(InputError, match=r"^line 6: "):
        _same(OLD, changed(changed(OLD, "spindle", 3, speed), "feed", 3, feed), wanted)


def test_a_program_of_another_length() -> None:
    shorter = replace(OLD, **{f.name: getattr(OLD, f.name)[:5] for f in fields(OLD) if f.name != "labels"})
    with pytest.raises(InputError, match=r"^its feed cannot be set"):
        require_same(OLD, shorter, np.array([6]), np.array([1.0]))
    with pytest.raises(InputError, match=r"^its speed cannot be set"):
        _same(OLD, shorter, np.full(6, np.nan))
